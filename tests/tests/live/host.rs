//! What cannot be judged because the host stood still meanwhile (`sim::host`).
//!
//! A round is repeated only when the witness saw a stall in it that the relaxed timing need not
//! bear: any other failure is the set's.

use std::panic::{self, AssertUnwindSafe};
use std::sync::OnceLock;
use std::time::Instant;

use sim::host::{BORNE, Failure, Witness};

/// A disturbed round is tried so often.
const TRIES: u32 = 12;

static WITNESS: OnceLock<Witness> = OnceLock::new();

/// Runs `round`; again when it failed and the host stood still in it. `None`, said aloud, when the
/// host never left it alone: such a host cannot judge.
pub fn judged<T>(what: &str, mut round: impl FnMut() -> T) -> Option<T> {
    let witness = WITNESS.get_or_init(Witness::start);
    let run = || panic::catch_unwind(AssertUnwindSafe(&mut round));
    let outcome = witness.undisturbed(TRIES, run, |attempt, stall| {
        println!("{what}, try {attempt}: not judged, the host stood still for {stall:?}");
    });
    match outcome {
        Ok(value) => Some(value),
        Err(Failure::Own(failure)) => panic::resume_unwind(failure),
        Err(Failure::Host(_)) => {
            println!("SKIPPED {what}: the host stood still in each of {TRIES} tries");
            None
        }
    }
}

#[test]
fn a_failure_on_a_calm_host_is_not_excused() {
    let start = Instant::now();
    let mut tries = 0;
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| {
        judged("a calm round", || {
            tries += 1;
            // Nothing is waited for: the host has hardly the time to stand still.
            assert!(tries > 1, "as it should");
        })
    }));
    let excused = WITNESS.get().is_some_and(|witness| witness.longest_since(start) > BORNE);
    assert!(outcome.is_err() | excused, "a failure was tried again without a stall");
}
