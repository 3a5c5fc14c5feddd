//! The monitoring functions of the generic profile, instance by instance.

use shm_schema::facts::etg;

use crate::model::approach::{Phase, Window};

use super::Finding;
use super::parameters::{ApproachObjects, Approaching, Instance, Parameters, Reaction};
use super::stops::sos_is_violated;

/// What one cycle brings to a monitor.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Time, ms.
    pub now: i64,
    /// Increments.
    pub position: i64,
    /// 1/1000 rpm.
    pub speed: i64,
    /// 1/1000 rpm/s.
    pub acceleration: i64,
    /// Millionths of the rated torque.
    pub torque: i64,
}

#[derive(Debug, Clone)]
enum State {
    Off,
    Running { position: i64, approaching: Option<Approaching>, in_target: bool },
    Violated,
}

/// One instance of SOS, SSR, SAR, SLS, SLP, SMS, SLT, SMA or SLI.
#[derive(Debug, Clone)]
pub struct Monitor {
    /// Function and instance.
    pub instance: Instance,
    state: State,
}

/// The functions this module evaluates.
pub const FUNCTIONS: [u32; 9] =
    [etg::SOS, etg::SSR, etg::SAR, etg::SLS, etg::SLP, etg::SMS, etg::SLT, etg::SMA, etg::SLI];

impl Monitor {
    /// Every instance that a set names (DEC-40).
    pub fn all(parameters: &Parameters) -> Vec<Self> {
        let instances = FUNCTIONS.iter().flat_map(|function| {
            parameters.instances(*function).into_iter().map(move |instance| (*function, instance))
        });
        instances.map(|instance| Self { instance, state: State::Off }).collect()
    }

    /// SMS and SMA have no control bit: they are active by parameterisation, when both
    /// limits exist and one is not zero (ETG-SMS-01, ETG-SMA-01).
    pub fn is_always_requested(&self, parameters: &Parameters) -> bool {
        let both = [parameters.object(self.instance, 1), parameters.object(self.instance, 2)];
        let exist = both.iter().all(Option::is_some);
        let any = both.iter().flatten().any(|limit| *limit != 0);
        let without_bit = [etg::SMS, etg::SMA].contains(&self.instance.0);
        without_bit && exist && any
    }

    /// Nothing latched (DEC-14).
    pub fn switch_off(&mut self) {
        self.state = State::Off;
    }

    /// Its error was cleared (DEC-17).
    pub fn cleared(&mut self) {
        if matches!(self.state, State::Violated) {
            self.state = State::Off;
        }
    }

    /// Status bit.
    pub fn is_active(&self) -> bool {
        matches!(self.state, State::Running { in_target: true, .. })
    }

    /// The reaction object of each function.
    fn reaction(&self, parameters: &Parameters) -> Reaction {
        let object = match self.instance.0 {
            etg::SSR => etg::ssr::ERROR_REACTION,
            etg::SLS => etg::sls::ERROR_REACTION,
            // ETG-SOS-04: not configurable.
            etg::SOS => return Reaction::Sto,
            _ => etg::sar::ERROR_REACTION,
        };
        parameters.reaction(self.instance, object)
    }

    /// The speed window of SSR, SLS and SMS.
    fn speed_window(&self, parameters: &Parameters) -> Option<Window> {
        let value = |object| parameters.value(self.instance, object);
        match self.instance.0 {
            etg::SSR => Some(Window {
                lower: value(etg::ssr::VELOCITY_LOWER_LIMIT) * 1000,
                upper: value(etg::ssr::VELOCITY_UPPER_LIMIT) * 1000,
            }),
            etg::SLS => {
                let limit = value(etg::sls::VELOCITY_LIMIT).abs() * 1000;
                Some(Window { lower: -limit, upper: limit })
            }
            etg::SMS => {
                let (positive, negative) = parameters.maximum_speeds();
                Some(Window { lower: -negative * 1000, upper: positive * 1000 })
            }
            _ => None,
        }
    }

    fn objects(&self) -> Option<ApproachObjects> {
        let instance = self.instance;
        match instance.0 {
            etg::SSR => Some(ApproachObjects {
                instance,
                time: etg::ssr::TIME_TO_VELOCITY_MONITORING,
                dwell: etg::ssr::TIME_FOR_VELOCITY_IN_LIMITS,
                slope: etg::ssr::DECELERATION_LIMIT,
                delay: etg::ssr::TIME_DELAY_DECELERATION_MONITORING,
            }),
            etg::SLS => Some(ApproachObjects {
                instance,
                time: etg::sls::TIME_TO_VELOCITY_MONITORING,
                dwell: etg::sls::TIME_FOR_VELOCITY_IN_LIMITS,
                slope: etg::sls::DECELERATION_LIMIT,
                delay: etg::sls::TIME_DELAY_DECELERATION_MONITORING,
            }),
            _ => None,
        }
    }

    /// Whether a value lies outside the standing limits.
    fn is_violated(&self, parameters: &Parameters, sample: &Sample, latched: i64) -> bool {
        let value = |object| parameters.value(self.instance, object);
        let outside = |value: i64, lower: i64, upper: i64| !Window { lower, upper }.contains(value);
        match self.instance.0 {
            etg::SOS => sos_is_violated(parameters, self.instance.1, sample.position - latched, sample.speed),
            // ETG-SAR-01; a signed lower limit (DEC-31).
            etg::SAR => outside(
                sample.acceleration,
                value(etg::sar::ACCELERATION_LOWER_LIMIT) * 1000,
                value(etg::sar::ACCELERATION_UPPER_LIMIT) * 1000,
            ),
            etg::SMA => outside(
                sample.acceleration,
                value(etg::sma::DECELERATION_MAXIMUM) * 1000,
                value(etg::sma::ACCELERATION_MAXIMUM) * 1000,
            ),
            etg::SLP => outside(
                sample.position,
                value(etg::slp::POSITION_LOWER_LIMIT),
                value(etg::slp::POSITION_UPPER_LIMIT),
            ),
            // ETG-SLI-01: both limits are amounts (DEC-31).
            etg::SLI => outside(
                sample.position - latched,
                -value(etg::sli::POSITION_RELATIVE_LOWER_LIMIT).abs(),
                value(etg::sli::POSITION_RELATIVE_UPPER_LIMIT),
            ),
            // The type of both limits is unsigned.
            etg::SLT => outside(
                sample.torque,
                -value(etg::slt::TORQUE_LIMIT_NEGATIVE_DIRECTION).abs() * 1000,
                value(etg::slt::TORQUE_LIMIT_POSITIVE_DIRECTION) * 1000,
            ),
            _ => self.speed_window(parameters).is_some_and(|window| !window.contains(sample.speed)),
        }
    }

    /// Starts, stops and evaluates the instance.
    pub fn step(
        &mut self,
        parameters: &Parameters,
        requested: bool,
        sample: &Sample,
    ) -> Option<(Finding, Reaction)> {
        if !requested {
            self.state = State::Off;
            return None;
        }
        if matches!(self.state, State::Off) {
            let approach = self.objects().zip(self.speed_window(parameters));
            let approaching = approach
                .map(|(objects, target)| parameters.approach(&objects, sample.now, sample.speed, target));
            self.state = State::Running { position: sample.position, approaching, in_target: false };
        }
        let finding = self.evaluate(parameters, sample)?;
        let reaction = self.reaction(parameters);
        // Without a reaction nothing stops the motion, and monitoring goes on as it was.
        if reaction != Reaction::None {
            self.state = State::Violated;
        }
        Some((finding, reaction))
    }

    fn evaluate(&mut self, parameters: &Parameters, sample: &Sample) -> Option<Finding> {
        let State::Running { position, .. } = &self.state else { return None };
        let violated = self.is_violated(parameters, sample, *position);
        let State::Running { approaching, in_target, .. } = &mut self.state else { return None };
        if let Some(approaching) = approaching {
            approaching.observe(sample.now, sample.speed);
            let phase = approaching.approach.phase(sample.now);
            let early = approaching.early.is_some();
            if phase == Phase::Ramp && !early {
                let side = approaching.approach.ramp_side(sample.now, sample.speed);
                return side.map(|_| Finding::Ramp);
            }
            if phase == Phase::Delay && !early {
                return None;
            }
        }
        // Table 5, SSR: active and within the limits.
        *in_target = !violated;
        violated.then_some(Finding::Limit)
    }
}

/// SDI: from where each forbidden direction, positive and negative, counts (DEC-30).
#[derive(Debug, Clone, Default)]
pub struct Sdi {
    forbidden: [bool; 2],
    reference: [Option<i64>; 2],
    speed_before: Option<i64>,
    violated: bool,
}

impl Sdi {
    /// Nothing latched (DEC-14).
    pub fn switch_off(&mut self) {
        *self = Self { speed_before: self.speed_before, ..Self::default() };
    }

    /// Its error was cleared (DEC-17).
    pub fn cleared(&mut self) {
        if self.violated {
            self.switch_off();
        }
    }

    /// One cycle; `forbidden`: positive and negative direction.
    pub fn step(
        &mut self,
        parameters: &Parameters,
        forbidden: [bool; 2],
        sample: &Sample,
    ) -> Option<Finding> {
        let before = self.speed_before.unwrap_or(sample.speed);
        if forbidden != self.forbidden {
            // ETG-GEN-12: what is asked of one direction leaves the other as it is.
            self.violated = false;
        }
        let sdi = (etg::SDI, 1);
        let speed_window = parameters.object(sdi, etg::sdi::VELOCITY_ZERO_WINDOW);
        let zero = speed_window.unwrap_or(0).abs() * 1000;
        let crossed = before.signum() * sample.speed.signum() < 0;
        let stands = sample.speed.abs() <= zero || crossed;
        let half = parameters.value(sdi, etg::sdi::POSITION_ZERO_WINDOW).abs();
        let (mut too_far, mut too_fast) = (false, false);
        for (side, sign) in [1, -1].into_iter().enumerate() {
            let (reached, speed) = (sample.position * sign, sample.speed * sign);
            let reference = &mut self.reference[side];
            if !forbidden[side] {
                *reference = None;
                continue;
            }
            *reference = reference.or(stands.then_some(reached));
            let Some(from) = reference else { continue };
            if !forbidden[1 - side] {
                // Counted from the furthest position reached in the one permitted direction.
                *from = (*from).min(reached);
            }
            too_far |= reached - *from > half;
            too_fast |= speed_window.is_some() && speed > zero;
        }
        self.forbidden = forbidden;
        if self.violated {
            return None;
        }
        self.violated = too_far || too_fast;
        if too_far { Some(Finding::Limit) } else { too_fast.then_some(Finding::Motion) }
    }

    /// Remembers the speed for the crossing of zero.
    pub fn note(&mut self, speed: i64) {
        self.speed_before = Some(speed);
    }
}
