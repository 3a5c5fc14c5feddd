//! Shell of channel b.
fn main() {}
