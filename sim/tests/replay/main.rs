//! Traces through the real cores: what leaves the machine, to the cycle.

mod encoder;
mod faults;
mod functions;
mod pairing;
mod start;
mod support;
