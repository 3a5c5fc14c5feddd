//! The `report-a` and `report-b` cells: everything a channel says about one axis.

use crate::cell::payload;
use crate::drive::DriveRequest;
use crate::error::ErrorList;
use crate::word::Word;
use crate::{enumeration, layout};

enumeration! {
    /// How far a channel has come since its start (DEC-19).
    pub enum Phase {
        /// Parameters and encoder not yet judged.
        #[default]
        Boot = 0,
        /// The parameter image was refused; stays so until a restart with a valid one.
        Refused = 1,
        /// Waits for partner, agreement and one fault tolerance time of equality.
        Pairing = 2,
        /// Path self-test, led by the agreement.
        SelfTest = 3,
        /// All conditions met but the first acknowledge edge.
        AwaitAcknowledge = 4,
        /// Monitoring; torque is a matter of functions and errors.
        Operational = 5,
    }
}

enumeration! {
    /// The highest stop function that runs or stands, without what the agreement does.
    pub enum Stop {
        /// None.
        #[default]
        None = 0,
        /// Safe torque off.
        Sto = 1,
        /// Safe stop 1 brakes.
        Ss1 = 2,
        /// Safe stop 2 brakes.
        Ss2 = 3,
        /// Safe operating stop stands (after SS2).
        Sos = 4,
    }
}

layout! {
    /// What a channel reports about one axis, computed from encoder sample `exchange`.
    pub struct Report {
        /// Exchange number: header sequence of the `encoder` sample used (design 5).
        pub exchange: u64,
        /// Exchange number of the partner's newest report this channel accepted.
        pub partner_exchange: u64,
        /// The channel's own clock at the step, ns (DEC-26).
        pub time_ns: u64,
        /// Content signature of the parameter image in use.
        pub parameter_signature: u32,
        /// Identity of the program, checked against the release manifest (DEC-22).
        pub build: u32,
        /// Program-flow signature of this step; a constant of the build (DEC-22).
        pub flow: u32,
        /// Start-up.
        pub phase: Phase,
        /// All own conditions for torque are met, without the agreement (design 5).
        pub ready: bool,
        /// The own path is refreshed in this cycle.
        pub driving: bool,
        /// The own path's edge is withheld in this cycle to test it.
        pub test_pulse: bool,
        /// Running or standing stop.
        pub stop: Stop,
        /// Number of cycle overruns in a row, as the shell counts them.
        pub overruns: u8,
        /// Status word of the profile, without the agreement's influence.
        pub status: Word,
        /// Requested functions, 1 = requested, bit numbers of the profile's control word.
        pub requested: Word,
        /// Debounced levels of what the profile evaluates, everything else 0: bits 0 to 3 the
        /// pairs (AMK SE1 to SE3, Lenze SD-In that are not deactivated: on), 4 AIS, 5 AIE.
        pub inputs: u32,
        /// Acknowledge levels: bit 0 error, 1 restart, 2 non-safe clear.
        pub acknowledgements: u32,
        /// Extended position, increments (DEC-10).
        pub position: i64,
        /// Speed, 1/1000 rpm.
        pub speed_mrpm: i32,
        /// What this channel asks of the drive.
        pub drive: DriveRequest,
        /// Id of the present session of the black channel; 0 before the first one.
        pub session_id: u16,
        /// Digest of the last black-channel frame processed.
        pub frame_digest: u32,
        /// Standing errors and warnings.
        pub errors: ErrorList,
    }
}
payload!(Report);
