//! Parameter sets: from a file that a person edits to the safety image that the channels read.
//!
//! - [`definition`]: every parameter of the four profiles, as data from `shm-schema/facts`
//! - [`parse`]: a file with the vendor's names becomes a [`Machine`], or every reason why not
//! - [`check`]: every rule of the profile, with line, code and remedy
//! - [`diagnosis`]: what a code means
//! - [`image`]: the safety image in both encodings, its signatures, and a reader for tools
//!
//! Nothing here runs in a channel. Whatever this crate computes, both channels judge again
//! from the raw values (design 7): a mistake here costs a start, never a limit.
#![forbid(unsafe_code)]

pub mod acceptance;
pub mod check;
pub mod create;
pub mod definition;
pub mod diagnosis;
pub mod diagnostic;
pub mod dictionary;
pub mod expression;
mod file;
pub mod image;
pub mod key;
pub mod response;
pub mod rule;
pub mod seal;
pub mod set;
mod text;
mod value;
pub mod vendor;
pub mod view;

pub use check::{Finding, Report, check, check_set};
pub use definition::Definition;
pub use diagnosis::{Explanation, explain};
pub use diagnostic::Diagnostic;
pub use file::parse;
pub use image::Image;
pub use set::{AxisSet, Machine};
