//! The reference model: slow, plain, exact, written from the catalogues by somebody who
//! has seen neither channel (design 12).
//!
//! It says what a healthy pair of channels and crosscheck must show at each cycle of 1 ms
//! of a settled replay (design 10): status word, torque, path and standing errors. It
//! keeps time in whole milliseconds, lines as exact fractions and everything else in
//! ordinary collections. It models no fault of machine or software; A and B differ only
//! by the line of each safe input pair they read (DEC-36) and by the Info fields of their
//! codes (DEC-45).
//!
//! - [`exact`], [`approach`], [`filter`]: the primitives
//! - [`script`]: short scripts for tests
//! - [`pair`]: two channels and crosscheck: agreement, comparison, combination
//! - [`amk`], [`atv`], [`etg`], [`lenze`]: one channel of each profile

pub mod amk;
pub mod approach;
pub mod atv;
pub mod etg;
pub mod exact;
pub mod filter;
pub mod lenze;
pub mod pair;
pub mod script;

use std::collections::BTreeMap;

use shm_schema::profile::Profile;
use shm_schema::word::Word;

/// Everything one cycle of 1 ms brings.
#[allow(clippy::struct_excessive_bools, reason = "each is a column of a trace")]
#[derive(Debug, Clone, PartialEq)]
pub struct ModelInput {
    /// Position, increments (65,536 per revolution).
    pub position: i64,
    /// Speed, 1/1000 rpm.
    pub speed_mrpm: i64,
    /// Torque, millionths of the rated torque.
    pub torque_ppm: i64,
    /// Acceleration, 1/1000 rpm/s; `None`: derived from the speed.
    pub acceleration_mrpm_s: Option<i64>,
    /// Control word of the profile.
    pub control: Word,
    /// Raw lines .1 and .2 of the safe input pairs.
    pub se: [(bool, bool); 4],
    /// Acknowledge in, restart.
    pub ais: bool,
    /// Acknowledge in, error.
    pub aie: bool,
    /// Non-safe command "clear error".
    pub clear_error: bool,
    /// The drive's own "speed is zero".
    pub drive_n0: bool,
    /// The drive's power stage is enabled.
    pub drive_enabled: bool,
}

impl ModelInput {
    /// Standstill, nothing requested: the columns a trace leaves out (design 10).
    pub fn neutral(profile: Profile) -> Self {
        Self {
            position: 0,
            speed_mrpm: 0,
            torque_ppm: 0,
            acceleration_mrpm_s: None,
            control: Word::from_u32(profile.neutral_word()),
            se: [(true, true); 4],
            ais: false,
            aie: false,
            clear_error: false,
            drive_n0: false,
            drive_enabled: true,
        }
    }
}

/// What one source shows after a cycle (design 10, output).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct View {
    /// Status word.
    pub status: Word,
    /// What the source permits (crosscheck: A and B and agreement).
    pub torque: bool,
    /// State of the inhibit path (crosscheck: both).
    pub path: bool,
    /// Standing errors and warnings, sorted.
    pub errors: Vec<[u32; 4]>,
}

/// The three views of one cycle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModelOutput {
    /// Channel A.
    pub a: View,
    /// Channel B.
    pub b: View,
    /// The combined, external view.
    pub crosscheck: View,
}

/// Which channel a model channel is (DEC-37).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Monitoring channel 1.
    A,
    /// Monitoring channel 2.
    B,
}

/// Stop state as crosscheck needs it (DEC-45).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopState {
    /// No stop.
    None,
    /// STO stands.
    Sto,
    /// SS1 brakes.
    Ss1,
    /// SS2 brakes.
    Ss2,
    /// The standstill after SS2 stands.
    Sos,
}

/// What a channel says about itself in one cycle.
#[derive(Debug, Clone)]
pub struct ChannelView {
    /// Status word.
    pub status: Word,
    /// Requested functions, 1 = requested.
    pub requested: Word,
    /// Debounced levels.
    pub inputs: u32,
    /// Acknowledge levels.
    pub acknowledge: u32,
    /// Torque is permitted as far as this channel is concerned.
    pub ready: bool,
    /// Stop state.
    pub stop: StopState,
    /// Standing errors and warnings.
    pub errors: Vec<[u32; 4]>,
}

/// One channel of a profile.
pub trait Channel {
    /// One cycle; `differs`: the agreement of the cycle before, or the channel's own
    /// comparison with its partner, carries an error.
    fn step(&mut self, input: &ModelInput, differs: bool) -> ChannelView;

    /// Acknowledge levels as a report shows them: bit 0 error, 1 restart, 2 non-safe clear.
    fn acknowledge_levels(&self, input: &ModelInput) -> u32;

    /// A copy that goes its own way.
    fn fork(&self) -> Box<dyn Channel>;
}

/// The reference model of one axis.
pub struct Model {
    pair: pair::Pair,
}

impl Model {
    /// A model that begins settled (design 10).
    ///
    /// # Panics
    /// On [`Profile::None`].
    pub fn new(profile: Profile, parameters: &BTreeMap<u32, i32>) -> Self {
        let channel = |which| -> Box<dyn Channel> {
            match profile {
                Profile::AmkKw => Box::new(amk::Amk::new(parameters, which)),
                Profile::Atv340 => Box::new(atv::Atv::new(parameters)),
                Profile::Etg61002 => Box::new(etg::Etg::new(parameters)),
                Profile::LenzeSm301 => Box::new(lenze::Lenze::new(parameters)),
                other @ Profile::None => panic!("no model of {}", other.name()),
            }
        };
        let rules = pair::Rules::of(profile, parameters);
        Self { pair: pair::Pair::new(channel(Which::A), channel(Which::B), rules) }
    }

    /// One cycle of 1 ms.
    pub fn step(&mut self, input: &ModelInput) -> ModelOutput {
        self.pair.step(input)
    }
}
