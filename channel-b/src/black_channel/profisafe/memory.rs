//! Everything the F-Device remembers, and how it changes (black-channel 8.3).

use super::super::mirrored::Words;
use super::telegram::{Control, successor};

const NANOSECONDS_PER_MILLISECOND: u64 = 1_000_000;

/// The safety variables of the F-Device, replaced as a whole by each event.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::struct_excessive_bools, reason = "the bits of the status octet are independent")]
pub(super) struct Memory {
    /// A first telegram has been accepted.
    pub(super) is_started: bool,
    /// Virtual consecutive number, 24 bits.
    pub(super) number: u32,
    /// Toggle_d.
    pub(super) toggle: bool,
    /// cons_nr_R.
    pub(super) number_was_reset: bool,
    /// CE_CRC. Together with `has_timed_out` the communication fault latch.
    pub(super) has_check_fault: bool,
    /// WD_timeout.
    pub(super) has_timed_out: bool,
    /// activate_FV as last taken over, which happens on edges only.
    pub(super) host_wants_fail_safe: bool,
    /// Device_Fault.
    pub(super) has_device_fault: bool,
    /// The watchdog runs, since `renewed_at_ns`.
    pub(super) is_timed: bool,
    pub(super) renewed_at_ns: u64,
}

/// How a telegram relates to what is remembered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reception {
    /// CRC2 wrong.
    Corrupt,
    /// CRC2 right, no edge: the number stays.
    Repeated,
    /// CRC2 right, edge: this is the number now.
    Renewed(u32),
}

impl Memory {
    /// After start-up: passivated, number 0, timer stopped (black-channel 8.1).
    pub(super) const START: Self = Self {
        is_started: false,
        number: 0,
        toggle: false,
        number_was_reset: false,
        has_check_fault: false,
        has_timed_out: false,
        host_wants_fail_safe: true,
        has_device_fault: false,
        is_timed: false,
        renewed_at_ns: 0,
    };

    /// The number that a telegram with this control octet must be checked by,
    /// and what it is if it passes.
    ///
    /// An edge is a new toggle or a new reset request: after a refused telegram
    /// the host toggles back, so that the toggle alone would show none. The first
    /// telegram is an edge whatever its toggle, because the first accepted one
    /// starts the exchange and the timer (black-channel 8.1).
    pub(super) fn candidate(&self, control: Control) -> (u32, Reception) {
        let toggles = control.toggle() != self.toggle;
        let asks_reset = control.resets_number() && !self.number_was_reset;
        let is_first = !self.is_started;
        let begins_anew = control.resets_number() || is_first;
        let number = match (toggles || asks_reset || is_first, begins_anew) {
            (false, _) => return (self.number, Reception::Repeated),
            (true, true) => 0,
            (true, false) => successor(self.number),
        };
        (number, Reception::Renewed(number))
    }

    /// The memory after a telegram.
    pub(super) fn after(self, reception: Reception, control: Control, now_ns: u64) -> Self {
        match reception {
            // Mark L: whether one error may pass unpunished is not known, so
            // the first one passivates.
            Reception::Corrupt => Self { has_check_fault: true, ..self },
            Reception::Repeated => self,
            Reception::Renewed(number) => {
                let begins_anew = control.resets_number() || !self.is_started;
                Self {
                    is_started: true,
                    number,
                    toggle: control.toggle(),
                    number_was_reset: control.resets_number(),
                    has_check_fault: self.has_check_fault && !begins_anew,
                    has_timed_out: self.has_timed_out && !begins_anew,
                    host_wants_fail_safe: control.activates_fail_safe_values(),
                    has_device_fault: self.has_device_fault,
                    is_timed: true,
                    renewed_at_ns: now_ns,
                }
            }
        }
    }

    /// Whether the watchdog has expired: mark M for "reached" rather than
    /// "exceeded". A clock that runs backwards counts as expired.
    pub(super) fn has_expired(&self, now_ns: u64, watchdog_ms: u16) -> bool {
        let limit_ns = u64::from(watchdog_ms).wrapping_mul(NANOSECONDS_PER_MILLISECOND);
        let elapsed_ns = now_ns.checked_sub(self.renewed_at_ns);
        let is_over = elapsed_ns.is_none_or(|elapsed_ns| elapsed_ns >= limit_ns);
        self.is_timed && is_over
    }

    /// The memory after the watchdog has expired.
    pub(super) const fn timed_out(self) -> Self {
        Self { has_timed_out: true, is_timed: false, ..self }
    }

    /// Whether process values may be used rather than fail-safe values.
    pub(super) fn uses_process_values(&self) -> bool {
        [
            self.is_started,
            self.number != 0,
            !self.host_wants_fail_safe,
            !self.has_check_fault,
            !self.has_timed_out,
            !self.has_device_fault,
        ]
        .into_iter()
        .all(|condition| condition)
    }

    /// The status octet (black-channel 7.6, LNZ-BUS-11); iPar_OK is never set.
    pub(super) fn status(&self, sends_fail_safe: bool) -> u8 {
        [
            (self.has_device_fault, 1),
            (self.has_check_fault, 2),
            (self.has_timed_out, 3),
            (sends_fail_safe, 4),
            (self.toggle, 5),
            (self.number_was_reset, 6),
        ]
        .into_iter()
        .fold(0, |status, (is_set, bit)| status | u8::from(is_set) << bit)
    }
}

impl Words<3> for Memory {
    fn words(&self) -> [u64; 3] {
        let flags = [
            self.is_started,
            self.toggle,
            self.number_was_reset,
            self.has_check_fault,
            self.has_timed_out,
            self.host_wants_fail_safe,
            self.has_device_fault,
            self.is_timed,
        ];
        let flags = flags.iter().fold(0, |word, flag| word << 1 | u64::from(*flag));
        [flags, u64::from(self.number), self.renewed_at_ns]
    }
}
