//! Every layout that crosses a process boundary.
#![no_std]
