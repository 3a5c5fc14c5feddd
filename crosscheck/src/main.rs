//! Shell of the crosscheck.
fn main() {}
