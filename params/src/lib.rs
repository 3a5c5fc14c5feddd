//! Parameter sets: from a file that a person edits to the safety image that the channels read.
//!
//! - [`definition`]: every parameter of the four profiles, as data from `shm-schema/facts`
//! - [`parse`]: a file with the vendor's names becomes a [`Machine`], or every reason why not
//! - [`image`]: the safety image in both encodings, its signatures, and a reader for tools
//!
//! Nothing here runs in a channel. Whatever this crate computes, both channels judge again
//! from the raw values (design 7): a mistake here costs a start, never a limit.
#![forbid(unsafe_code)]

pub mod definition;
pub mod diagnostic;
mod file;
pub mod image;
pub mod key;
pub mod set;
mod text;
mod value;

pub use definition::Definition;
pub use diagnostic::Diagnostic;
pub use file::parse;
pub use image::Image;
pub use set::{AxisSet, Machine};
