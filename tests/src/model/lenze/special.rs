//! Special operation: operation mode selector and enable switch (LNZ-OMS, LNZ-ES).

/// LNZ-OMS-01 to 06.
#[derive(Debug, Clone, Copy, Default)]
pub struct Special {
    /// State 2 or 3.
    pub active: bool,
    /// State 3.
    pub confirmed: bool,
    enable_before: Option<bool>,
}

/// What a cycle has changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// Nothing.
    None,
    /// ES was confirmed: the motion function begins.
    Confirmed,
    /// Back to normal operation.
    Left,
}

impl Special {
    /// One cycle; `may_confirm`: the reduced speed is kept, where one is chosen, and no
    /// emergency stop makes this state 5.
    pub fn step(&mut self, selected: bool, enable: bool, may_confirm: bool) -> Change {
        let before = self.enable_before.replace(enable).unwrap_or(enable);
        // LNZ-ES-03: only the change from 0 to 1.
        let edge = enable && !before;
        if !self.active {
            // LNZ-ES-01: in normal operation ES has no function.
            self.active = selected;
            return Change::None;
        }
        if self.confirmed {
            // LNZ-OMS-12: the way back leads through state 2 and its stop.
            self.confirmed = enable;
            return Change::None;
        }
        if !selected {
            self.active = false;
            return Change::Left;
        }
        // LNZ-OMS-22
        self.confirmed = edge && may_confirm;
        if self.confirmed { Change::Confirmed } else { Change::None }
    }
}
