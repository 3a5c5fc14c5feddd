//! Whole sets of real processes (design 12): killed, stopped, crowded, fed garbage.
//!
//! Each test starts `safepair run` with a run folder of its own and waits for conditions
//! with deadlines. The programs must stand beside the test: `cargo xtask test` builds them.
//! Needs no privilege; with real-time scheduling at hand the set uses it. The long forms:
//! `cargo test -p system-tests --test live -- --ignored`.

#[path = "live/axis.rs"]
mod axis;
#[path = "live/bad_cells.rs"]
mod bad_cells;
#[path = "live/black_channel.rs"]
mod black_channel;
#[path = "live/ctl.rs"]
mod ctl;
#[path = "live/deaths.rs"]
mod deaths;
#[path = "live/ending.rs"]
mod ending;
#[path = "live/gateway.rs"]
mod gateway;
#[path = "live/guards.rs"]
mod guards;
#[path = "live/host.rs"]
mod host;
#[path = "live/processes.rs"]
mod processes;
#[path = "live/programs.rs"]
mod programs;
#[path = "live/second.rs"]
mod second;
#[path = "live/set.rs"]
mod set;
#[path = "live/startup.rs"]
mod startup;
#[path = "live/steady.rs"]
mod steady;
