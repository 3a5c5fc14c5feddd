//! The scripted axis: each step acts, then waits for a condition with a deadline.

use std::{
    thread,
    time::{Duration, Instant},
};

use shm_schema::facts::amk_kw::status;
use shm_schema::report::Phase;

use crate::master::Master;
use crate::watch::{Frame, Watch, codes, now_ns};

/// Longest wait for any single condition.
const DEADLINE: Duration = Duration::from_secs(6);
const POLL: Duration = Duration::from_micros(500);

/// Something that happened, with the instant of CLOCK_MONOTONIC.
#[derive(Debug, Clone)]
pub struct Event {
    /// When, ns.
    pub time_ns: u64,
    /// What kind, for reaction times and the envelope.
    pub what: What,
    /// In plain words.
    pub text: String,
}

/// Events that the picture or the reaction times need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum What {
    /// Only told.
    Told,
    /// SLS1 requested.
    Request,
    /// SLS1 no longer requested.
    Release,
    /// A monitor saw the limit exceeded.
    Violation,
    /// The axis was left without torque.
    TorqueOff,
    /// The process of channel B was killed.
    Kill,
}

/// What went otherwise than scripted.
pub type Failure = String;

/// Plays the story and returns what happened.
pub struct Story<'a> {
    watch: &'a Watch,
    master: &'a Master,
    tell: &'a dyn Fn(&Event),
    /// What happened so far.
    pub events: Vec<Event>,
}

impl<'a> Story<'a> {
    /// A story about the axis behind `watch`, commanded by `master`; `tell` hears each event.
    pub fn new(watch: &'a Watch, master: &'a Master, tell: &'a dyn Fn(&Event)) -> Self {
        Self { watch, master, tell, events: Vec::new() }
    }

    /// From power-up to the second run, up to where a channel is to be killed.
    ///
    /// # Errors
    /// The first condition that did not come true in time.
    pub fn play(&mut self) -> Result<(), Failure> {
        self.until("start-up with path self-test", |f| f.a.phase == Phase::AwaitAcknowledge)?;
        self.event(What::Told, "start-up done: images equal, encoders plausible, each path tested alone");
        self.master.acknowledge()?;
        self.until("torque after the first acknowledge", torque)?;
        self.event(What::Told, "acknowledged: both channels and crosscheck permit torque");

        self.master.set_point(1_500.0)?;
        self.until("1,490 rpm", |f| f.a.speed_mrpm > 1_490_000)?;
        self.event(What::Told, "running at 1,500 rpm");
        pause(400);

        self.master.request("SLS1")?;
        self.event(What::Request, "SLS1 requested (500 rpm); the controller brakes along its ramp");
        self.master.set_point(450.0)?;
        self.until("SLS1 active", |f| f.agreement.status.bit(status::SLS1))?;
        self.event(What::Told, "SLS1 active: monitored at 500 rpm");
        pause(700);

        self.master.set_point(800.0)?;
        self.event(What::Told, "the controller asks for 800 rpm, more than SLS1 allows");
        self.until("the violation of SLS1", |f| !f.a.errors.is_empty() | !f.b.errors.is_empty())?;
        self.violation();
        self.until("STO at the end of SS1", |f| !torque(f) & f.agreement.status.bit(status::STO))?;
        self.event(What::TorqueOff, "SS1 has brought the axis to rest: torque off (STO)");
        self.master.set_point(0.0)?;
        pause(300);
        self.run_again()
    }

    fn run_again(&mut self) -> Result<(), Failure> {
        self.master.release("SLS1")?;
        self.event(What::Release, "SLS1 no longer requested");
        self.master.acknowledge()?;
        self.until("torque after the acknowledge", torque)?;
        self.event(What::Told, "acknowledged: torque is permitted again");
        self.master.set_point(1_200.0)?;
        self.until("1,190 rpm", |f| f.a.speed_mrpm > 1_190_000)?;
        self.event(What::Told, "running at 1,200 rpm");
        pause(400);
        Ok(())
    }

    /// Waits until both paths are off after a process was killed.
    ///
    /// # Errors
    /// When they are not in time.
    pub fn after_kill(&mut self) -> Result<(), Failure> {
        self.event(What::Kill, "channel B is killed (SIGKILL)");
        self.until("both paths off", |f| !f.readback.1.path_a & !f.readback.1.path_b)?;
        self.event(What::TorqueOff, "both paths off: no torque, the holding brake closes");
        pause(600);
        Ok(())
    }

    fn violation(&mut self) {
        let codes = self.watch.now().map_or(String::new(), |frame| codes(&frame.a.errors));
        self.event(What::Violation, &format!("limit exceeded ({codes}): SS1 starts by itself"));
    }

    fn event(&mut self, what: What, text: &str) {
        let event = Event { time_ns: now_ns(), what, text: text.to_owned() };
        (self.tell)(&event);
        self.events.push(event);
    }

    fn until(&self, what: &str, condition: impl Fn(&Frame) -> bool) -> Result<(), Failure> {
        let start = Instant::now();
        while start.elapsed() < DEADLINE {
            if self.watch.now().is_some_and(|frame| condition(&frame)) {
                return Ok(());
            }
            thread::sleep(POLL);
        }
        let seen = self.watch.now().map_or("no cell written yet".to_owned(), |frame| frame.in_words());
        Err(format!("{what} did not come within {} s; last seen:\n{seen}", DEADLINE.as_secs()))
    }
}

/// Lets the picture show a steady phase; nothing depends on the length.
fn pause(milliseconds: u64) {
    thread::sleep(Duration::from_millis(milliseconds));
}

fn torque(frame: &Frame) -> bool {
    frame.readback.1.path_a & frame.readback.1.path_b
}
