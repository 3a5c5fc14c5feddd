//! Where the path is driven. The cell is written in every case; a GPIO line is toggled with
//! every edge, spoken to in the kernel's own words (GPIO character device, version 2).

use std::fs::File;
use std::mem::size_of;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::path::Path;

use shm_schema::inhibit::Inhibit;

use super::Trouble;
use super::options::{Backend, Options};

/// `struct gpio_v2_line_attribute`
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Attribute {
    id: u32,
    padding: u32,
    value: u64,
}

/// `struct gpio_v2_line_config_attribute`
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct ConfigAttribute {
    attribute: Attribute,
    mask: u64,
}

/// `struct gpio_v2_line_config`
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Config {
    flags: u64,
    count: u32,
    padding: [u32; 5],
    attributes: [ConfigAttribute; 10],
}

/// `struct gpio_v2_line_request`
#[repr(C)]
#[derive(Clone, Copy)]
struct Request {
    offsets: [u32; 64],
    consumer: [u8; 32],
    config: Config,
    lines: u32,
    event_buffer: u32,
    padding: [u32; 5],
    descriptor: i32,
}

/// `struct gpio_v2_line_values`
#[repr(C)]
#[derive(Clone, Copy, Default)]
struct Values {
    bits: u64,
    mask: u64,
}

/// `GPIO_V2_LINE_FLAG_OUTPUT`
const OUTPUT: u64 = 1 << 3;

nix::ioctl_readwrite!(get_line, 0xB4, 0x07, Request);
nix::ioctl_readwrite!(set_values, 0xB4, 0x0F, Values);

// The kernel's sizes are part of its numbers; a mismatch would be another call.
const _: () = assert!(size_of::<Request>() == 592);
const _: () = assert!(size_of::<Values>() == 16);

/// The line beside the cell.
#[derive(Debug)]
pub enum Line {
    /// None: the cell is all there is.
    Cell,
    /// An open line, low until the first edge.
    Gpio {
        /// Descriptor of the line.
        line: OwnedFd,
        /// Level last set.
        level: bool,
    },
}

/// Opens what the options ask for; the line is low from here on.
pub fn open(options: &Options) -> Result<Line, Trouble> {
    match &options.backend {
        Backend::Sim => Ok(Line::Cell),
        Backend::Gpio { chip, line } => open_gpio(chip, *line),
    }
}

fn open_gpio(chip: &Path, offset: u32) -> Result<Line, Trouble> {
    let device = File::open(chip).map_err(|error| Trouble::new(chip.display(), error))?;
    let mut offsets = [0; 64];
    offsets[0] = offset;
    let mut consumer = [0; 32];
    consumer[..10].copy_from_slice(b"safepair-b");
    // Without an output value attribute the kernel starts the line at 0.
    let config = Config { flags: OUTPUT, ..Config::default() };
    let mut request =
        Request { offsets, consumer, config, lines: 1, event_buffer: 0, padding: [0; 5], descriptor: -1 };
    // SAFETY: the request has the kernel's layout and outlives the call.
    unsafe { get_line(device.as_raw_fd(), &raw mut request) }
        .map_err(|error| Trouble::new(format!("{} line {offset}", chip.display()), error))?;
    // SAFETY: the kernel returned a new descriptor that nobody else owns.
    let line = unsafe { OwnedFd::from_raw_fd(request.descriptor) };
    Ok(Line::Gpio { line, level: false })
}

impl Line {
    /// Drives one cycle: a new edge toggles the line, no permit is low at once.
    pub fn drive(&mut self, inhibit: &Inhibit) {
        let Self::Gpio { line, level } = self else { return };
        let wanted = inhibit.permit & (inhibit.edges & 1 == 1);
        if wanted == *level {
            return;
        }
        let mut values = Values { bits: u64::from(wanted), mask: 1 };
        // SAFETY: the structure has the kernel's layout and outlives the call. A failed call
        // leaves the line as it is; without edges the evaluator drops the path.
        let result = unsafe { set_values(line.as_raw_fd(), &raw mut values) };
        if result.is_ok() {
            *level = wanted;
        }
    }
}

/// On every way out the line is low.
impl Drop for Line {
    fn drop(&mut self) {
        self.drive(&Inhibit::default());
    }
}
