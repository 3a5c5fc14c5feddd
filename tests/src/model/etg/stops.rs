//! STO, SS1 and SS2 with their instances, restart acknowledge and brake (ETG-SEQ-01 to 08).

use std::collections::{BTreeMap, BTreeSet};

use shm_schema::facts::etg;

use crate::model::StopState;
use crate::model::approach::{Phase, Window};

use super::Finding;
use super::parameters::{ApproachObjects, Approaching, Instance, Parameters, Reaction};

/// The stop in force; SS1 and SS2 by instance.
#[derive(Debug, Clone)]
pub enum Stop {
    /// None.
    None,
    /// Torque off; the SS1 instances that have ended here and are still requested.
    Sto(BTreeSet<u32>),
    /// Instances of SS1 that brake; the first to end ends all.
    Ss1(BTreeMap<u32, Ss1>),
    /// Instances of SS2.
    Ss2(BTreeMap<u32, Ss2>),
}

/// One running SS1.
#[derive(Debug, Clone)]
pub struct Ss1 {
    approaching: Approaching,
    window_is_used: bool,
    /// Times t_SS1 and t_PT_SBC, when the brake is to close before STO (ETG-SBC-04, 05).
    brake: Option<(i64, i64)>,
    started: i64,
    brake_closed_since: Option<i64>,
}

/// One SS2: braking, or standing in SOS at a position.
#[derive(Debug, Clone)]
pub enum Ss2 {
    /// Supervised deceleration.
    Braking(Approaching),
    /// SOS of the same number (ETG-SS2-02).
    Standing(i64),
    /// Off its line: another SS2 has taken its place.
    Replaced,
}

/// Requested instances.
#[derive(Debug, Clone, Default)]
pub struct Requests {
    /// STO.
    pub sto: bool,
    /// SS1 instances.
    pub ss1: Vec<u32>,
    /// SS2 instances.
    pub ss2: Vec<u32>,
}

/// The windows of SOS instance `instance`, speed (if used) and position.
pub fn sos_windows(parameters: &Parameters, instance: u32) -> (Option<Window>, Window) {
    let sos = (etg::SOS, instance);
    let speed = parameters.object(sos, etg::sos::VELOCITY_ZERO_WINDOW);
    let half = parameters.value(sos, etg::sos::POSITION_ZERO_WINDOW).abs();
    let speed = speed.map(|rpm| Window { lower: -rpm.abs() * 1000, upper: rpm.abs() * 1000 });
    (speed, Window { lower: -half, upper: half })
}

/// Whether SOS is left, DEC-01.
pub fn sos_is_violated(parameters: &Parameters, instance: u32, travelled: i64, speed: i64) -> bool {
    let (speed_window, position_window) = sos_windows(parameters, instance);
    let fast = speed_window.is_some_and(|window| !window.contains(speed));
    fast || !position_window.contains(travelled)
}

impl Ss1 {
    fn start(parameters: &Parameters, instance: u32, now: i64, speed: i64) -> Self {
        let ss1 = (etg::SS1, instance);
        let window = parameters.object(ss1, etg::ss1::VELOCITY_ZERO_WINDOW);
        let half = window.unwrap_or(0).abs() * 1000;
        let objects = ApproachObjects {
            instance: ss1,
            time: etg::ss1::TIME_TO_STO,
            dwell: etg::ss1::TIME_FOR_VELOCITY_ZERO,
            slope: etg::ss1::DECELERATION_LIMIT,
            delay: etg::ss1::TIME_DELAY_DECELERATION_MONITORING,
        };
        let target = Window { lower: -half, upper: half };
        let uses_brake = parameters.value(ss1, etg::ss1::ACTIVATE_SBC) != 0;
        let times = || {
            let to_sto = parameters.value(ss1, etg::ss1::TIME_TO_STO);
            (to_sto, parameters.value((etg::SBC, 1), etg::sbc::BRAKE_TIME_DELAY))
        };
        Self {
            approaching: parameters.approach(&objects, now, speed, target),
            window_is_used: window.is_some(),
            brake: uses_brake.then(times),
            started: now,
            brake_closed_since: None,
        }
    }

    /// What this cycle finds, and whether STO is reached.
    fn step(&mut self, now: i64, speed: i64) -> (Option<Finding>, bool) {
        self.approaching.observe(now, speed);
        let early = self.approaching.early.filter(|_| self.window_is_used);
        let mut ended = early.is_some();
        if let Some((to_sto, brake_delay)) = self.brake {
            let elapsed = now - self.started;
            if early.is_some() || elapsed >= to_sto - brake_delay {
                self.brake_closed_since.get_or_insert(now);
            }
            // ETG-SEQ-04: STO only when the brake has closed.
            ended = early.is_some_and(|since| now - since >= brake_delay);
        }
        match self.approaching.approach.phase(now) {
            _ if ended => (None, true),
            Phase::Delay => (None, false),
            Phase::Ramp => {
                let violated = self.approaching.approach.ramp_side(now, speed).is_some();
                (violated.then_some(Finding::Ramp), false)
            }
            Phase::Target => {
                let outside = self.window_is_used && !self.approaching.approach.target.contains(speed);
                (outside.then_some(Finding::Limit), true)
            }
        }
    }
}

fn start_ss2(parameters: &Parameters, instance: u32, now: i64, speed: i64) -> Ss2 {
    let objects = ApproachObjects {
        instance: (etg::SS2, instance),
        time: etg::ss2::TIME_TO_SOS,
        dwell: etg::ss2::TIME_FOR_VELOCITY_ZERO,
        slope: etg::ss2::DECELERATION_LIMIT,
        delay: etg::ss2::TIME_DELAY_DECELERATION_MONITORING,
    };
    let (window, _) = sos_windows(parameters, instance);
    let target = window.unwrap_or(Window { lower: 0, upper: 0 });
    Ss2::Braking(parameters.approach(&objects, now, speed, target))
}

/// A finding of a stop function and the reaction to it.
pub type StopFinding = (u32, u32, Finding, Reaction);

impl Stop {
    /// As crosscheck sees it.
    pub fn state(&self) -> StopState {
        match self {
            Self::None => StopState::None,
            Self::Sto(_) => StopState::Sto,
            Self::Ss1(_) => StopState::Ss1,
            Self::Ss2(runs) if runs.values().any(|run| matches!(run, Ss2::Braking(_))) => StopState::Ss2,
            Self::Ss2(_) => StopState::Sos,
        }
    }

    /// What has reached its end state and nothing requests any more (DEC-12): STO as a whole,
    /// of SS2 each instance by itself (ETG-GEN-12).
    pub fn waiting(&self, requests: &Requests, error_stands: bool) -> Vec<Instance> {
        if error_stands {
            return Vec::new();
        }
        match self {
            // DEC-11: an SS1 that has ended here stands while its request stands; DEC-13:
            // one that STO came before is remembered, and begins when STO is left.
            Self::Sto(ended) if !requests.sto && ended.iter().all(|one| !requests.ss1.contains(one)) => {
                vec![(etg::STO, 1)]
            }
            Self::Ss2(runs) => {
                let ended = runs.iter().filter(|(_, run)| !matches!(run, Ss2::Braking(_)));
                let unrequested = ended.filter(|(instance, _)| !requests.ss2.contains(instance));
                unrequested.map(|(instance, _)| (etg::SS2, *instance)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Leaves what [`Self::waiting`] named.
    pub fn leave(&mut self, (function, instance): Instance) {
        match self {
            Self::Ss2(runs) if function == etg::SS2 => {
                runs.remove(&instance);
                if runs.is_empty() {
                    *self = Self::None;
                }
            }
            _ => *self = Self::None,
        }
    }

    /// DEC-13: STO over SS1 over SS2.
    pub fn request(&mut self, requests: &Requests, parameters: &Parameters, now: i64, speed: i64) {
        if let Self::Sto(ended) = self {
            ended.retain(|instance| requests.ss1.contains(instance));
        }
        if requests.sto {
            self.start(Reaction::Sto, parameters, now, speed);
        }
        for instance in &requests.ss1 {
            self.start(Reaction::Ss1(*instance), parameters, now, speed);
        }
        for instance in &requests.ss2 {
            self.start(Reaction::Ss2(*instance), parameters, now, speed);
        }
    }

    /// Starts a stop unless the same or a higher one is in force.
    #[allow(clippy::match_same_arms, reason = "in the order of priority")]
    pub fn start(&mut self, stop: Reaction, parameters: &Parameters, now: i64, speed: i64) {
        match (stop, &mut *self) {
            (Reaction::None, _) | (_, Self::Sto(_)) => {}
            // Every SS1 that is aborted is over, and its request holds STO.
            (Reaction::Sto, Self::Ss1(runs)) => *self = Self::Sto(runs.keys().copied().collect()),
            (Reaction::Sto, _) => *self = Self::Sto(BTreeSet::new()),
            (Reaction::Ss1(instance), Self::Ss1(runs)) => {
                runs.entry(instance).or_insert_with(|| Ss1::start(parameters, instance, now, speed));
            }
            (Reaction::Ss1(instance), _) => {
                *self = Self::Ss1([(instance, Ss1::start(parameters, instance, now, speed))].into());
            }
            (Reaction::Ss2(_), Self::Ss1(_)) => {}
            (Reaction::Ss2(instance), Self::Ss2(runs)) => {
                runs.entry(instance).or_insert_with(|| start_ss2(parameters, instance, now, speed));
            }
            (Reaction::Ss2(instance), Self::None) => {
                *self = Self::Ss2([(instance, start_ss2(parameters, instance, now, speed))].into());
            }
        }
    }

    /// Whether an instance of SS1 or SS2 brakes or stands.
    pub fn runs(&self, (function, instance): Instance) -> bool {
        match self {
            Self::Ss1(runs) => function == etg::SS1 && runs.contains_key(&instance),
            Self::Ss2(runs) => function == etg::SS2 && runs.contains_key(&instance),
            _ => false,
        }
    }

    /// Supervises what runs and stands, as far as `which` asks for; goes on to the end state.
    pub fn supervise(
        &mut self,
        parameters: &Parameters,
        now: i64,
        position: i64,
        speed: i64,
        which: &dyn Fn(Instance) -> bool,
    ) -> Vec<StopFinding> {
        match self {
            Self::None | Self::Sto(_) => Vec::new(),
            Self::Ss1(runs) => {
                let mut found = Vec::new();
                let mut ended = false;
                for (instance, run) in runs.iter_mut().filter(|(one, _)| which((etg::SS1, **one))) {
                    let (finding, reached) = run.step(now, speed);
                    ended |= reached;
                    found.extend(finding.map(|finding| (etg::SS1, *instance, finding, Reaction::Sto)));
                }
                if ended {
                    *self = Self::Sto(runs.keys().copied().collect());
                }
                found
            }
            Self::Ss2(runs) => runs
                .iter_mut()
                .filter(|(one, _)| which((etg::SS2, **one)))
                .filter_map(|(instance, run)| {
                    supervise_ss2(parameters, *instance, run, (now, position, speed))
                })
                .collect(),
        }
    }

    /// The position at which SOS instance `instance` stands as end of SS2.
    pub fn stands_in_sos(&self, instance: u32) -> bool {
        matches!(self, Self::Ss2(runs) if matches!(runs.get(&instance), Some(Ss2::Standing(_))))
    }

    /// Whether a running SS1 has closed the brake.
    pub fn has_closed_the_brake(&self) -> bool {
        matches!(self, Self::Ss1(runs) if runs.values().any(|run| run.brake_closed_since.is_some()))
    }
}

/// ETG-SS2-10: as configured; an SS2 that is off its line does not brake by itself.
fn ss2_reaction(parameters: &Parameters, instance: u32) -> Reaction {
    match parameters.reaction((etg::SS2, instance), etg::ss2::ERROR_REACTION) {
        Reaction::Ss2(itself) if itself == instance => Reaction::Sto,
        other => other,
    }
}

fn supervise_ss2(
    parameters: &Parameters,
    instance: u32,
    run: &mut Ss2,
    (now, position, speed): (i64, i64, i64),
) -> Option<StopFinding> {
    if let Ss2::Braking(approaching) = run {
        approaching.observe(now, speed);
        let reached = approaching.early.is_some() || approaching.approach.phase(now) == Phase::Target;
        if !reached {
            let ramp = approaching.approach.phase(now) == Phase::Ramp;
            let violated = ramp && approaching.approach.ramp_side(now, speed).is_some();
            let reaction = ss2_reaction(parameters, instance);
            if violated && matches!(reaction, Reaction::Ss2(_)) {
                *run = Ss2::Replaced;
            }
            return violated.then_some((etg::SS2, instance, Finding::Ramp, reaction));
        }
        *run = Ss2::Standing(position);
    }
    let Ss2::Standing(reference) = run else { return None };
    // ETG-SS2-10: after the transition it is SOS that is violated.
    let violated = sos_is_violated(parameters, instance, position - *reference, speed);
    violated.then_some((etg::SOS, instance, Finding::Limit, Reaction::Sto))
}
