//! The C interface: `include/safepair.h` says what each function does.
//!
//! Every function checks its pointers, and catches what must not happen: a panic never crosses
//! into C. Nothing here decides about safety (see the crate `producers`).

mod domain;
mod layout;

use std::ffi::{CStr, c_char, c_int};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

use domain::{Handle, write};
use layout::{CAnswer, CCommand, CDriveRequest, CEncoder, CInhibit, CIo, CReadback, Incoming, Outgoing};
use producers::cells::{Cell, Place, Publisher, Subscriber, Trouble};
use shm_schema::AXES_MAX;

const OK: c_int = 0;
const ARGUMENT: c_int = -1;
const AXIS: c_int = -2;
const OPEN: c_int = -3;
const DEADLINE: c_int = -4;
const NOTHING: c_int = -5;
const INTERNAL: c_int = -6;

/// What each result means, with the end that C needs.
const TEXTS: [(c_int, &CStr); 7] = [
    (OK, c"done"),
    (ARGUMENT, c"a null pointer, a text that is no UTF-8, or a value out of range"),
    (AXIS, c"an axis that was not opened, or a cell this process does not write"),
    (OPEN, c"no such domain, another layout, or another writer"),
    (DEADLINE, c"the domain did not open within two seconds"),
    (NOTHING, c"nobody has written yet, or what stands there is damaged"),
    (INTERNAL, c"a defect of this library; nothing was published"),
];

fn guarded(act: impl FnOnce() -> Result<(), c_int>) -> c_int {
    // A panic may leave a handle half used; each publish writes a whole cell or none.
    catch_unwind(AssertUnwindSafe(act)).map_or(INTERNAL, |result| result.err().unwrap_or(OK))
}

/// # Safety
/// `text` is null or a string with its end.
unsafe fn text(text: *const c_char) -> Result<String, c_int> {
    if text.is_null() {
        return Err(ARGUMENT);
    }
    // SAFETY: the caller vouches for a string with its end; it is copied before the call returns.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str().map(ToOwned::to_owned).map_err(|_| ARGUMENT)
}

/// Joins the domain of a running set.
///
/// # Safety
/// The texts are strings with their end, `axes` has `axes_count` octets, `out` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn safepair_open(
    domain: *const c_char,
    prefix: *const c_char,
    nonce: u32,
    axes: *const u8,
    axes_count: usize,
    publish: u32,
    out: *mut *mut Handle,
) -> c_int {
    guarded(|| {
        if out.is_null() {
            return Err(ARGUMENT);
        }
        // SAFETY: not null, and the caller vouches that it can be written.
        unsafe { out.write(ptr::null_mut()) };
        let sound =
            !axes.is_null() & (1..=AXES_MAX).contains(&axes_count) & (nonce != 0) & (publish <= write::ALL);
        if !sound {
            return Err(ARGUMENT);
        }
        // SAFETY: not null, and the caller vouches for `axes_count` octets.
        let axes = unsafe { std::slice::from_raw_parts(axes, axes_count) }.to_vec();
        if axes.iter().any(|axis| !(1..=AXES_MAX as u8).contains(axis)) {
            return Err(ARGUMENT);
        }
        // SAFETY: the caller vouches for both strings.
        let (domain, prefix) = unsafe { (text(domain)?, text(prefix)?) };
        let place = Place { domain: domain.into(), prefix, nonce };
        let handle = Handle::open(place, axes, publish).map_err(|trouble| match trouble {
            Trouble::Name(_) => ARGUMENT,
            Trouble::Service(..) => OPEN,
            Trouble::Deadline(_) => DEADLINE,
        })?;
        // SAFETY: as above; the caller owns the handle until safepair_close.
        unsafe { out.write(Box::into_raw(Box::new(handle))) };
        Ok(())
    })
}

/// Leaves the domain.
///
/// # Safety
/// `domain` is null or came from [`safepair_open`] and is not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn safepair_close(domain: *mut Handle) {
    guarded(|| {
        if !domain.is_null() {
            // SAFETY: it came from Box::into_raw in safepair_open, and is given back once.
            drop(unsafe { Box::from_raw(domain) });
        }
        Ok(())
    });
}

/// CLOCK_MONOTONIC, ns.
#[unsafe(no_mangle)]
pub extern "C" fn safepair_now_ns() -> u64 {
    producers::clock::now_ns()
}

/// What a result means.
#[unsafe(no_mangle)]
pub extern "C" fn safepair_text(result: c_int) -> *const c_char {
    let found = TEXTS.iter().find(|(known, _)| *known == result);
    found.map_or(c"unknown result", |(_, text)| text).as_ptr()
}

/// # Safety
/// `domain` is null or an open handle of this thread, `value` is null or one structure.
unsafe fn publish<C: Incoming<Payload: Cell>>(
    domain: *mut Handle,
    axis: u8,
    value: *const C,
    moment: (u64, u64),
    cells: fn(&mut Handle) -> &mut Vec<Publisher<C::Payload>>,
) -> c_int {
    guarded(|| {
        // SAFETY: null is refused; otherwise the caller vouches for a handle nobody else uses now.
        let handle = unsafe { domain.as_mut() }.ok_or(ARGUMENT)?;
        // SAFETY: null is refused; otherwise the caller vouches for one structure.
        let payload = unsafe { value.as_ref() }.and_then(Incoming::payload).ok_or(ARGUMENT)?;
        let place = handle.at(axis).ok_or(AXIS)?;
        let cell = cells(handle).get_mut(place).ok_or(AXIS)?;
        let (latched_ns, cycles) = moment;
        cell.publish(&payload, latched_ns, cycles);
        Ok(())
    })
}

macro_rules! publishers {
    ($($name:ident, $type:ty, $cells:ident;)*) => {$(
        /// Publishes one cell.
        ///
        /// # Safety
        /// `domain` is null or an open handle of this thread, `value` is null or one structure.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            domain: *mut Handle,
            axis: u8,
            value: *const $type,
            latched_ns: u64,
            cycles: u64,
        ) -> c_int {
            // SAFETY: the caller vouches for the same.
            unsafe { publish(domain, axis, value, (latched_ns, cycles), |handle| &mut handle.$cells) }
        }
    )*};
}
publishers! {
    safepair_publish_encoder, CEncoder, encoder;
    safepair_publish_io, CIo, io;
    safepair_publish_readback, CReadback, readback;
    safepair_publish_command, CCommand, command;
}

/// The readers of one kind: of A and B, or one for all.
type Readers<T> = fn(&Handle) -> &[Vec<Subscriber<T>>];

/// # Safety
/// `domain` is null or an open handle, `value` and `written_ns` are null or can be written.
unsafe fn read<C: Outgoing<Payload: Cell>>(
    domain: *const Handle,
    (axis, channel): (u8, c_int),
    (value, written_ns): (*mut C, *mut u64),
    readers: Readers<C::Payload>,
) -> c_int {
    guarded(|| {
        // SAFETY: null is refused; otherwise the caller vouches for an open handle.
        let handle = unsafe { domain.as_ref() }.ok_or(ARGUMENT)?;
        if value.is_null() {
            return Err(ARGUMENT);
        }
        let channel = usize::try_from(channel).map_err(|_| ARGUMENT)?;
        let cells = readers(handle).get(channel).ok_or(ARGUMENT)?;
        let cell = handle.at(axis).and_then(|place| cells.get(place)).ok_or(AXIS)?;
        let (header, payload) = cell.read().ok_or(NOTHING)?;
        // SAFETY: not null, and the caller vouches that it can be written.
        unsafe { value.write(C::of(&payload)) };
        if !written_ns.is_null() {
            // SAFETY: likewise.
            unsafe { written_ns.write(header.timestamp_ns) };
        }
        Ok(())
    })
}

/// Reads what a channel drives.
///
/// # Safety
/// `domain` is null or an open handle, `value` and `written_ns` are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn safepair_read_inhibit(
    domain: *const Handle,
    axis: u8,
    channel: c_int,
    value: *mut CInhibit,
    written_ns: *mut u64,
) -> c_int {
    // SAFETY: the caller vouches for the same.
    unsafe { read(domain, (axis, channel), (value, written_ns), |handle| &handle.inhibit) }
}

/// Reads what the drive is asked.
///
/// # Safety
/// `domain` is null or an open handle, `value` and `written_ns` are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn safepair_read_drive_request(
    domain: *const Handle,
    axis: u8,
    value: *mut CDriveRequest,
    written_ns: *mut u64,
) -> c_int {
    // SAFETY: the caller vouches for the same.
    unsafe { read(domain, (axis, 0), (value, written_ns), |handle| std::slice::from_ref(&handle.request)) }
}

/// Reads a channel's answer to a black-channel frame.
///
/// # Safety
/// `domain` is null or an open handle, `value` and `written_ns` are null or can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn safepair_read_answer(
    domain: *const Handle,
    axis: u8,
    channel: c_int,
    value: *mut CAnswer,
    written_ns: *mut u64,
) -> c_int {
    // SAFETY: the caller vouches for the same.
    unsafe { read(domain, (axis, channel), (value, written_ns), |handle| &handle.answer) }
}
