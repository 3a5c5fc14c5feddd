//! Standing errors: latched, and acknowledged as their class allows (DEC-15).

use shm_schema::error::{ErrorCode, ErrorList};

/// Errors that can stand at once.
const PLACES: usize = 24;

/// What ends an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// A violated limit: acknowledged once its reaction has reached its end state.
    Limit,
    /// An own safe output does not follow: it goes off, and that is all (LNZ-OUT-03).
    Output,
    /// Acknowledged once its cause is gone; torque off until then.
    Cause,
    /// Acknowledged once its cause is gone; starts no stop of its own.
    Flaw,
    /// Ends with a restart of the set; torque off until then.
    Restart,
    /// Ends with a valid parameter set; torque off until then.
    Parameter,
    /// A warning without reaction: acknowledged at any time.
    Warning,
    /// A warning that stands as long as its cause.
    StandingWarning,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    code: ErrorCode,
    class: Class,
    fresh: bool,
}

/// Whether no entry is in use.
#[derive(Debug, Clone, Copy)]
struct Empty(bool);

impl Default for Empty {
    fn default() -> Self {
        Self(true)
    }
}

/// Errors and warnings that stand.
#[derive(Debug, Clone, Copy, Default)]
pub struct Errors {
    entries: [Option<Entry>; PLACES],
    // Most steps have none: they need not look.
    empty: Empty,
    overflown: bool,
    list: ErrorList,
    stale_list: bool,
}

impl Errors {
    /// A new step: every cause has to show itself again.
    pub fn begin_step(&mut self) {
        if self.empty.0 {
            return;
        }
        self.entries.iter_mut().flatten().for_each(|entry| entry.fresh = false);
    }

    /// `code` stands from now on, or stands still.
    pub fn raise(&mut self, code: ErrorCode, class: Class) {
        let same = |entry: &&mut Entry| (entry.code, entry.class) == (code, class);
        if let Some(entry) = self.entries.iter_mut().flatten().find(same) {
            entry.fresh = true;
            return;
        }
        self.stale_list = true;
        self.empty.0 = false;
        match self.entries.iter_mut().find(|entry| entry.is_none()) {
            Some(place) => *place = Some(Entry { code, class, fresh: true }),
            None => self.overflown = true,
        }
    }

    /// One acknowledge edge: clears every error whose class allows it.
    pub fn acknowledge(&mut self, settled: bool) {
        for place in &mut self.entries {
            let stays = place.is_some_and(|entry| match entry.class {
                Class::Limit => !settled,
                Class::Cause | Class::Flaw | Class::Output | Class::StandingWarning => entry.fresh,
                Class::Restart | Class::Parameter => true,
                Class::Warning => false,
            });
            if !stays {
                *place = None;
            }
        }
        self.empty.0 = !self.entries.iter().any(Option::is_some);
        self.overflown &= !self.empty.0;
        self.stale_list = true;
    }

    #[inline]
    fn any(&self, of: impl Fn(Class) -> bool) -> bool {
        // One that found no place stands beside as many that did.
        !self.empty.0 && self.look(of)
    }

    #[inline(never)]
    fn look(&self, of: impl Fn(Class) -> bool) -> bool {
        self.entries.iter().flatten().any(|entry| of(entry.class)) | self.overflown
    }

    /// An error stands: the status word shows it, and it keeps a reached stop (DEC-12); warnings
    /// do neither (DEC-47).
    pub fn stand(&self) -> bool {
        self.any(|class| !matches!(class, Class::Warning | Class::StandingWarning))
    }

    /// An error stands that takes the torque away by itself.
    pub fn removes_torque(&self) -> bool {
        self.any(|class| matches!(class, Class::Cause | Class::Restart | Class::Parameter))
    }

    /// An error of an own safe output stands.
    pub fn of_outputs(&self) -> bool {
        self.any(|class| class == Class::Output)
    }

    /// For the report.
    pub fn list(&mut self) -> ErrorList {
        if self.stale_list {
            self.stale_list = false;
            self.list = ErrorList::default();
            for entry in self.entries.iter().flatten() {
                self.list.insert(entry.code);
            }
            self.list.more |= self.overflown;
        }
        self.list
    }
}
