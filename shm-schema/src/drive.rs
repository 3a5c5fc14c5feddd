//! The `drive-request` cell: what the controller asks of the drive. A drive that does
//! not follow is caught by the monitoring, never trusted.

use crate::cell::payload;
use crate::layout;

layout! {
    /// Requests to the drive of one axis.
    pub struct DriveRequest {
        /// Brake now: a stop function with automatic braking runs (ID33203 bit 0, SC36).
        pub brake: bool,
        /// Slope to brake with, rpm/s; 0: the drive's own ramp.
        pub deceleration_rpm_s: u32,
        /// The set point must stay inside the two limits below.
        pub limit_set_point: bool,
        /// Upper set-point limit, 1/1000 rpm.
        pub set_point_max_mrpm: i32,
        /// Lower set-point limit, 1/1000 rpm.
        pub set_point_min_mrpm: i32,
        /// The holding brake may be open (SBC not requested).
        pub brake_open: bool,
        /// Levels of safe outputs SA1.1, SA1.2, SA2.1, SA2.2 in bits 0 to 3; SDYN1, SDYN2 in 4 and 5.
        pub outputs: u8,
    }
}
payload!(DriveRequest);
