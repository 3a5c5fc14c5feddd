//! What a job found: one line each, and whether all of it held.

use std::fmt::Display;

/// Collects findings.
#[derive(Debug, Default)]
pub struct Verdict {
    failed: usize,
    held: usize,
}

impl Verdict {
    /// Judges one thing.
    pub fn check(&mut self, held: bool, what: impl Display) {
        println!("{} {what}", if held { "ok  " } else { "FAIL" });
        if held {
            self.held += 1;
        } else {
            self.failed += 1;
        }
    }

    /// Reports without judging.
    pub fn note(what: impl Display) {
        println!("note {what}");
    }

    /// Something was judged, and all of it held.
    pub const fn passed(&self) -> bool {
        self.failed == 0 && self.held > 0
    }
}
