//! Producers: from real terminals and encoders to the cells that both channels read.
//!
//! An integrator copies from here, or links it; drive firmware in other languages takes the C
//! interface (`producers/c`). Nothing here decides about safety: the channels check form, age
//! and plausibility of all of it. But each doubt a producer has itself it shows as a low line,
//! a fault bit or silence, never as a good value.
//!
//! - [`cells`]: a running domain, publishing and reading its cells
//! - [`clock`]: absolute cycles on CLOCK_MONOTONIC
//! - [`pattern`]: edges with time stamps become samples of 62.5 µs, and back (pure)
//! - [`terminals`]: the lines of a GPIO chip
//! - [`count`]: a counter of any width becomes quarter periods (pure)
//! - [`counter`]: the kernel's counter subsystem
//! - [`options`]: the options every process of a set takes
//!
//! It must never be linked into a monitor.

pub mod cells;
pub mod clock;
pub mod count;
pub mod counter;
pub mod options;
pub mod pattern;
pub mod terminals;
