//! The partner's report against the own one of the same exchange, and the agreement
//! (DEC-21 to DEC-23).

use shm_schema::agreement::{Agreement, Echo, PathTest};
use shm_schema::exchange::{Published, Received, Setup};
use shm_schema::report::{Phase, Report};
use shm_schema::word::Word;

use crate::clock::Measured;
use crate::compare::{Differences, ERROR_BIT, PARTS, SESSION_PART, STATUS_PARTS};
use crate::fresh::{Missed, Patience};

/// Own reports kept for the comparison; a power of two.
const KEPT: usize = 8;
/// Own reports kept for the echo; a power of two above the oldest that the relaxed timing accepts.
const KEPT_PUBLISHED: usize = 32;
/// Oldest own report an agreement may echo, in exchanges.
const ECHO_AGE: u8 = 2;

/// What the partner may differ by.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tolerance {
    /// Increments (Prm2).
    pub position: i64,
    /// 1/1000 rpm (Prm3).
    pub speed: i64,
    /// Fault tolerance time, ns (DEC-20).
    pub time_ns: u64,
    /// Code of the warnings that set the error bit of the status word as errors do; 0: none does,
    /// and the bit alone says whether there is an error.
    pub warnings: u32,
}

impl Tolerance {
    /// Whether a list that begins with this code holds an error. Lists are sorted, and no error
    /// of a profile comes behind its warnings.
    const fn is_error(&self, first: u32) -> bool {
        (self.warnings != 0) & (first != 0) & (first != self.warnings)
    }
}

/// The compared part of an own report.
#[derive(Debug, Clone, Copy, Default)]
pub struct Own {
    /// Exchange number.
    pub exchange: u64,
    /// Start-up.
    pub phase: Phase,
    /// Status word.
    pub status: Word,
    /// Requested functions.
    pub requested: Word,
    /// Debounced levels.
    pub inputs: u32,
    /// Acknowledge levels.
    pub acknowledgements: u32,
    /// Session id of the black channel.
    pub session_id: u16,
    /// Digest of its last frame.
    pub frame_digest: u32,
    /// Increments.
    pub position: i64,
    /// 1/1000 rpm.
    pub speed: i64,
    /// The first of the standing errors and warnings.
    pub first_error: u32,
}

/// What the comparison found in this step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Findings {
    /// No report for three cycles.
    pub lost: bool,
    /// Position further apart than permitted.
    pub position: bool,
    /// Speed further apart than permitted.
    pub speed: bool,
    /// Other parameters, build or program flow.
    pub identity: bool,
    /// The partner's clock runs wrong.
    pub clock: bool,
    /// Bits of the status words that differ for too long.
    pub status: u32,
    /// Bits of the debounced levels that differ for too long.
    pub inputs: u32,
    /// Something else of DEC-21 differs for too long.
    pub other: bool,
    /// Some item of DEC-21 differs, however shortly: no equality yet (DEC-19).
    pub differs: bool,
}

impl Findings {
    /// Nothing found that takes the own permission away.
    pub fn permits(&self) -> bool {
        let values = self.position | self.speed | self.identity | self.clock;
        let states = (self.status != 0) | (self.inputs != 0) | self.other;
        !(self.lost | values | states)
    }
}

/// What of the partner's newest report leaves the controller.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    exchange: u64,
    status: Word,
    speed_mrpm: i32,
}

/// Two reports of one exchange, still to be combined (DEC-25).
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Status words, the own one first.
    pub status: [Word; 2],
    /// Position of A, increments.
    pub position: i64,
    /// The speed further from zero, 1/1000 rpm.
    pub speed_mrpm: i32,
}

/// What of the newest agreement counts here.
#[derive(Debug, Clone, Copy, Default)]
struct Heard {
    permit: bool,
    error: bool,
    path_test: PathTest,
    echo: Option<Echo>,
}

/// What the channel knows of the other two.
#[derive(Debug, Clone)]
pub struct Partner {
    tolerance: Tolerance,
    signature: u32,
    build: u32,
    boot_nonce: u32,
    echo_age: u64,
    longest_step_ns: u64,
    own: [Own; KEPT],
    newest_own: usize,
    published: [Option<Published>; KEPT_PUBLISHED],
    newest_published: usize,
    missed: Missed,
    missed_agreement: Missed,
    missed_echo: Missed,
    differences: Differences,
    now_ns: u64,
    clock: Measured,
    flow: Option<u32>,
    found: Findings,
    /// Newest exchange accepted.
    pub exchange: u64,
    /// The partner's path was refreshed as of its last report.
    pub driving: bool,
    /// The report of this step says that the partner's edge was withheld.
    pub test_pulse: bool,
    told: Option<Told>,
    agreement: Heard,
    echoed: bool,
    sequence: u64,
}

impl Partner {
    /// A partner not heard of yet.
    pub fn new(tolerance: Tolerance, signature: u32, setup: &Setup) -> Self {
        let patience = Patience::new(setup.age_factor);
        Self {
            tolerance,
            signature,
            build: setup.partner_build,
            boot_nonce: setup.boot_nonce,
            echo_age: u64::from(patience.cycles(ECHO_AGE)),
            longest_step_ns: setup.cycle_ns.saturating_mul(3) / 2,
            own: [Own { exchange: u64::MAX, ..Own::default() }; KEPT],
            newest_own: 0,
            published: [None; KEPT_PUBLISHED],
            newest_published: 0,
            missed: Missed::new(patience),
            missed_agreement: Missed::new(patience),
            missed_echo: Missed::new(patience),
            differences: Differences::new(),
            now_ns: 0,
            clock: Measured::new(patience),
            flow: None,
            found: Findings::default(),
            exchange: 0,
            driving: false,
            test_pulse: false,
            told: None,
            agreement: Heard::default(),
            echoed: false,
            sequence: 0,
        }
    }

    /// Keeps an own report for the comparison.
    pub fn keep(&mut self, own: Own) {
        self.newest_own = self.newest_own.wrapping_add(1) % KEPT;
        if let Some(place) = self.own.get_mut(self.newest_own) {
            *place = own;
        }
    }

    /// The newest own report of `exchange`.
    fn own_of(&self, exchange: u64) -> Option<&Own> {
        let (newer, older) = self.own.split_at_checked(self.newest_own.wrapping_add(1) % KEPT)?;
        let mut backwards = newer.iter().rev().chain(older.iter().rev());
        backwards.find(|own| own.exchange == exchange)
    }

    /// Both reports of `exchange`, as long as both are held.
    pub fn pair_of(&self, exchange: u64) -> Option<Pair> {
        let told = self.told.filter(|told| told.exchange == exchange)?;
        let own = self.own_of(exchange)?;
        let own_mrpm = own.speed.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32;
        let further = told.speed_mrpm.unsigned_abs() > own_mrpm.unsigned_abs();
        Some(Pair {
            status: [own.status, told.status],
            position: own.position,
            speed_mrpm: if further { told.speed_mrpm } else { own_mrpm },
        })
    }

    /// Keeps what the shell published.
    pub fn published(&mut self, published: Option<Published>) {
        let known = self.published.get(self.newest_published) == Some(&published);
        if published.is_none() | known {
            return;
        }
        self.newest_published = self.newest_published.wrapping_add(1) % KEPT_PUBLISHED;
        if let Some(place) = self.published.get_mut(self.newest_published) {
            *place = published;
        }
    }

    /// One cycle of the partner's report.
    pub fn compare(&mut self, received: &Received<Report>, phase: Phase, now_ns: u64) -> Findings {
        let sample = received.as_ref().ok();
        let lost = self.missed.step(sample.map(|sample| sample.sequence));
        self.found.lost = lost;
        // A host that slept has kept both channels: what is read first is late, not a step.
        let slept = now_ns.saturating_sub(self.now_ns) > self.longest_step_ns;
        self.now_ns = now_ns;
        if lost | slept {
            self.clock.restart();
        }
        if lost {
            self.differences.clear();
        }
        let fresh = sample.filter(|sample| sample.sequence != self.sequence);
        self.test_pulse = fresh.is_some_and(|sample| sample.payload.test_pulse);
        if let Some(sample) = fresh {
            self.sequence = sample.sequence;
            self.driving = sample.payload.driving;
            self.judge(&sample.payload, phase, now_ns);
        }
        self.found
    }

    fn judge(&mut self, report: &Report, phase: Phase, now_ns: u64) {
        let lost = self.found.lost;
        self.found = Findings { lost, ..Findings::default() };
        self.found.clock = !self.clock.step(now_ns, report.time_ns);
        let other_build = (self.build != 0) & (report.build != self.build);
        let flow = *self.flow.get_or_insert(report.flow);
        let other_flow = flow != report.flow;
        if phase <= Phase::Pairing {
            // Learnt until it has stood for the whole time of pairing.
            self.flow = Some(report.flow);
        }
        let other_set = report.parameter_signature != self.signature;
        self.found.identity = other_build | other_flow | other_set;
        self.exchange = report.exchange;
        let Report { exchange, status, speed_mrpm, .. } = *report;
        self.told = Some(Told { exchange, status, speed_mrpm });
        let Some(own) = self.own_of(report.exchange) else { return };
        let apart = own.position.saturating_sub(report.position).saturating_abs();
        let faster = own.speed.saturating_sub(i64::from(report.speed_mrpm)).saturating_abs();
        let words_agree = (own.status == report.status) & (own.requested == report.requested);
        let levels_agree = (own.inputs, own.acknowledgements) == (report.inputs, report.acknowledgements);
        let frames_agree = (own.session_id, own.frame_digest) == (report.session_id, report.frame_digest);
        let (first, other_first) = (own.first_error, report.errors.codes[0].code);
        let is_error = |code| self.tolerance.is_error(code);
        let errors_agree = (first == other_first) || is_error(first) == is_error(other_first);
        let agree = words_agree & levels_agree & frames_agree & errors_agree;
        let masks = if agree { None } else { Some(masks(own, report, errors_agree)) };
        self.found.position = apart > self.tolerance.position;
        self.found.speed = faster > self.tolerance.speed;
        match masks {
            None => self.differences.clear(),
            Some(masks) => self.states(&masks, now_ns),
        }
    }

    fn states(&mut self, masks: &[u32; PARTS], now_ns: u64) {
        self.found.differs = *masks != [0; PARTS];
        let expired = self.differences.step(masks, now_ns, self.tolerance.time_ns);
        self.found.status = expired[0];
        self.found.inputs = expired[16];
        let rest = expired.iter().enumerate().filter(|(part, _)| (*part != 0) & (*part != 16));
        self.found.other = rest.fold(0, |all, (_, bits)| all | bits) != 0;
    }

    /// One cycle of the agreement; `true` while it is lost: it does not advance, or does not
    /// show for as long that the own reports are read (DEC-23).
    pub fn agree(&mut self, received: &Received<Agreement>, exchange: u64) -> bool {
        let sample = received.as_ref().ok();
        let silent = self.missed_agreement.step(sample.map(|sample| sample.sequence));
        if let Some(Agreement { permit, error, path_test, echo_a, .. }) = sample.map(|sample| &sample.payload)
        {
            self.agreement =
                Heard { permit: *permit, error: *error, path_test: *path_test, echo: Some(*echo_a) };
        }
        self.echoed = self.agreement.echo.is_some_and(|echo| self.is_echo(&echo, exchange));
        let unheard = self.missed_echo.count(self.echoed);
        silent | unheard
    }

    /// An own report of at most two exchanges ago; an exchange whose sample this channel never
    /// saw is missed and does not count.
    fn is_echo(&self, echo: &Echo, exchange: u64) -> bool {
        let aged = |age: usize| {
            let place = self.newest_published.wrapping_sub(age) % KEPT_PUBLISHED;
            self.published.get(place)
        };
        let said = |own: &Option<Published>| {
            own.is_some_and(|own| (own.exchange, own.crc32) == (echo.exchange, echo.crc32))
        };
        let Some(age) = (0..KEPT_PUBLISHED).find(|age| aged(*age).is_some_and(said)) else { return false };
        let recent = (age as u64) < self.echo_age;
        let young = exchange.wrapping_sub(echo.exchange) <= self.echo_age;
        (young | recent) & (echo.boot_nonce == self.boot_nonce)
    }

    /// The agreement read last echoes the own reports.
    pub const fn echoed(&self) -> bool {
        self.echoed
    }

    /// Crosscheck permits torque.
    pub const fn permitted(&self) -> bool {
        self.agreement.permit & !self.agreement.error
    }

    /// An error of crosscheck's own stands.
    pub const fn error(&self) -> bool {
        self.agreement.error
    }

    /// The path crosscheck wants raised.
    pub const fn path_test(&self) -> PathTest {
        self.agreement.path_test
    }
}

/// What differs between the two reports of one exchange, part by part.
fn masks(own: &Own, report: &Report, errors_agree: bool) -> [u32; PARTS] {
    let mut masks = [0; PARTS];
    let words = own.status.0.iter().zip(&report.status.0);
    let requests = own.requested.0.iter().zip(&report.requested.0);
    let sessions = (u32::from(own.session_id), u32::from(report.session_id));
    let single = [
        (&own.inputs, &report.inputs),
        (&own.acknowledgements, &report.acknowledgements),
        (&sessions.0, &sessions.1),
        (&own.frame_digest, &report.frame_digest),
    ];
    let pairs = words.chain(requests).chain(single);
    for (mask, (own, other)) in masks.iter_mut().zip(pairs) {
        *mask = own ^ other;
    }
    if !errors_agree {
        masks[SESSION_PART] |= ERROR_BIT;
    }
    // While this channel starts, the status of one that is a phase ahead or behind says nothing:
    // VALID and STO follow the phase, and so do errors. Waiting for equality here would be waiting for ever.
    let begins = own.phase != Phase::Operational;
    let apart = own.phase != report.phase;
    if begins & apart {
        masks.iter_mut().take(STATUS_PARTS).for_each(|mask| *mask = 0);
        masks[SESSION_PART] &= !ERROR_BIT;
    }
    masks
}
