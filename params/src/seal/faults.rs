//! A power loss at the n-th instant of a writer, for tests.

use std::{cell::Cell, io};

thread_local! {
    static LEFT: Cell<Option<u32>> = const { Cell::new(None) };
}

/// Power goes after so many instants; `None`: never. Returns what was left.
pub fn arm(left: Option<u32>) -> Option<u32> {
    LEFT.replace(left)
}

pub fn instant() -> io::Result<()> {
    LEFT.with(|cell| match cell.get() {
        None => Ok(()),
        Some(0) => Err(io::Error::other("power loss")),
        Some(left) => {
            cell.set(Some(left - 1));
            Ok(())
        }
    })
}
