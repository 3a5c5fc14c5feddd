//! The four safe inputs: what each of them is for, and its two lines (LNZ-IN-01).

use super::super::Outside;
use super::contacts::Contact;
use super::{CASCADE_HARDWARE, PAIRS};
use crate::engine::places::Places;
use crate::errors::{Class, Errors};
use crate::inputs::Newest;
use shm_schema::error::ErrorCode;
use shm_schema::io::Io;

/// First of the four codes for a discrepancy, and for a signal at a deactivated input.
const DISCREPANCY: u32 = 49;
const UNEXPECTED_SIGNAL: u32 = 57;

/// The role of a safe input (C15031, C15032).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Not connected.
    Deactivated,
    /// Bits of the control word that OFF requests.
    Request(u32),
    /// Operation mode selector.
    Mode,
    /// Enable switch.
    Enable,
    /// Input of the cascade.
    Cascade,
}

/// One safe input.
#[derive(Debug, Clone, Copy)]
struct Pair {
    role: Role,
    contact: Contact,
}

/// All of them.
#[derive(Debug, Clone)]
pub struct Pairs {
    each: [Pair; PAIRS],
    /// Those with a role.
    used: Places,
    /// Those that are looked at: during the initialisation all of them.
    watched: Places,
    samples: Option<u64>,
}

impl Pairs {
    /// Nothing seen yet.
    pub fn new(roles: [Role; PAIRS], contacts: [Contact; PAIRS]) -> Self {
        let mut each = roles.map(|role| Pair { role, contact: Contact::default() });
        let (mut used, mut watched) = (Places::NONE, Places::NONE);
        for ((pair, contact), place) in each.iter_mut().zip(contacts).zip(0..) {
            pair.contact = contact;
            used = used.with(Places::when(pair.role != Role::Deactivated, place));
            watched = watched.with(Places::of(place));
        }
        Self { each, used, watched, samples: None }
    }

    /// The valuations of this instant, bit by bit.
    #[inline]
    pub fn take(&mut self, outside: &Outside, acknowledged: bool, errors: &mut Errors) -> u32 {
        if self.watched.is_empty() { 0 } else { self.value(outside, acknowledged, errors) }
    }

    fn value(&mut self, outside: &Outside, acknowledged: bool, errors: &mut Errors) -> u32 {
        let Some(io) = outside.io else {
            self.samples = None;
            self.each.iter_mut().for_each(|pair| pair.contact.settle(false, false));
            return 0;
        };
        let before = self.samples.replace(io.samples).unwrap_or(io.samples);
        let newest = Newest::new(io.samples.wrapping_sub(before));
        let mut valued = 0;
        for place in self.watched {
            let Some(pair) = self.each.get_mut(usize::from(place)) else { continue };
            let fault = pair.take(place, (io, newest), acknowledged, outside);
            let on = self.used.has(place) & pair.contact.is_on();
            valued |= u32::from(on).wrapping_shl(place.into());
            if let Some((number, class)) = fault {
                errors.raise(ErrorCode::single(number), class);
            }
        }
        if outside.operational | outside.settle {
            self.watched = self.used;
        }
        valued
    }

    /// Bits of the control word that the inputs request.
    pub fn asked(&self) -> u32 {
        self.in_use().fold(0, |asked, pair| match pair.role {
            Role::Request(bits) if !pair.contact.is_on() => asked | bits,
            _ => asked,
        })
    }

    /// The input with this role.
    pub fn with(&self, role: Role) -> Option<&Contact> {
        self.in_use().find(|pair| pair.role == role).map(|pair| &pair.contact)
    }

    fn in_use(&self) -> impl Iterator<Item = &Pair> {
        self.used.into_iter().filter_map(|place| self.each.get(usize::from(place)))
    }
}

impl Pair {
    /// New samples of both lines, and what is wrong with them.
    fn take(
        &mut self,
        place: u8,
        (io, newest): (&Io, Newest),
        acknowledged: bool,
        outside: &Outside,
    ) -> Option<(u32, Class)> {
        let at = usize::from(place);
        let (own, other) = io.line_1.get(at).zip(io.line_2.get(at))?;
        if outside.settle {
            self.contact.settle(own & 1 == 1, other & 1 == 1);
        }
        if acknowledged {
            self.contact.acknowledge();
        }
        let faulty = self.contact.take((*own, *other), newest, outside.now_ns);
        match self.role {
            // LNZ-IN-03: only during initialisation.
            Role::Deactivated => {
                let live = self.contact.has_signal() & !outside.settle;
                live.then_some((UNEXPECTED_SIGNAL.saturating_add(place.into()), Class::Cause))
            }
            // LNZ-CAS-13: at the cascade input the discrepancy is an STO of its own.
            Role::Cascade => faulty.then_some((CASCADE_HARDWARE, Class::Cause)),
            _ => faulty.then_some((DISCREPANCY.saturating_add(place.into()), Class::Flaw)),
        }
    }
}
