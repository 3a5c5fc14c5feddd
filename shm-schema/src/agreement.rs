//! The `agreement` cell: what crosscheck found, and whether torque is permitted.

use crate::cell::payload;
use crate::error::ErrorList;
use crate::word::Word;
use crate::{enumeration, layout};

enumeration! {
    /// Which path the self-test at start wants raised (DEC-19).
    pub enum PathTest {
        /// None.
        #[default]
        None = 0,
        /// Channel A refreshes alone.
        RaiseA = 1,
        /// Channel B refreshes alone.
        RaiseB = 2,
        /// Both have been seen on and off: passed.
        Passed = 3,
    }
}

layout! {
    /// Proof that a report was read: a channel accepts an agreement only if its own
    /// report of at most two exchanges ago is echoed.
    pub struct Echo {
        /// Exchange number of the report.
        pub exchange: u64,
        /// Its boot nonce.
        pub boot_nonce: u32,
        /// CRC-32 in the header of the cell that carried it.
        pub crc32: u32,
    }
}

layout! {
    /// Result of one exchange of one axis.
    pub struct Agreement {
        /// Newest exchange number for which both reports were compared.
        pub exchange: u64,
        /// Torque is permitted as far as crosscheck is concerned.
        pub permit: bool,
        /// An error of crosscheck's own stands: the channels go to STO until it is acknowledged.
        pub error: bool,
        /// Path self-test.
        pub path_test: PathTest,
        /// The report of A.
        pub echo_a: Echo,
        /// The report of B.
        pub echo_b: Echo,
        /// Combined status word (DEC-25).
        pub status: Word,
        /// Position of A, increments (DEC-25).
        pub position: i64,
        /// Speed of the channel further from zero, 1/1000 rpm (DEC-25).
        pub speed_mrpm: i32,
        /// Crosscheck's own standing errors.
        pub errors: ErrorList,
    }
}
payload!(Agreement);
