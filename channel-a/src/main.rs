//! Shell of channel a.
fn main() {}
