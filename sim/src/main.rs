//! Simulated producers.
fn main() {}
