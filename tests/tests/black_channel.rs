//! The black-channel slaves of both channels, alone and merged, before the test masters.
//!
//! The masters and these tests are written from `black-channel.md` by somebody who has not
//! seen the slaves: where a slave is wrong, nothing here is wrong in the same way.

#[path = "black_channel/bench.rs"]
mod bench;
#[path = "black_channel/device.rs"]
mod device;
#[path = "black_channel/differential.rs"]
mod differential;
#[path = "black_channel/disturbed.rs"]
mod disturbed;
#[path = "black_channel/exchange.rs"]
mod exchange;
#[path = "black_channel/flips.rs"]
mod flips;
#[path = "black_channel/matrix.rs"]
mod matrix;
