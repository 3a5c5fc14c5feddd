//! Diagnosis codes as they travel in reports.

use crate::layout;

layout! {
    /// A diagnosis code. AMK: `code/info1/info2/info3` with 0 for an empty field; other
    /// profiles use `code` alone (Lenze message number, ATV SME number, ETG
    /// `function << 16 | instance << 8 | E`, E the row of the function's error table).
    /// The order is the order in which lists are shown.
    #[derive(PartialOrd, Ord, Hash)]
    pub struct ErrorCode {
        /// 3605, 3606, 3607, 3609, 3610, or the profile's single code.
        pub code: u32,
        /// Info1
        pub info1: u32,
        /// Info2
        pub info2: u32,
        /// Info3
        pub info3: u32,
    }
}

impl ErrorCode {
    /// An AMK code.
    pub const fn amk(code: u32, info1: u32, info2: u32, info3: u32) -> Self {
        Self { code, info1, info2, info3 }
    }

    /// The single code of another profile.
    pub const fn single(code: u32) -> Self {
        Self { code, info1: 0, info2: 0, info3: 0 }
    }

    /// Whether this is an empty place of a list.
    pub const fn is_none(&self) -> bool {
        self.code == 0
    }
}

/// Codes one report carries.
pub const ERRORS_MAX: usize = 8;

layout! {
    /// Standing errors and warnings (DEC-47), sorted, without duplicates; empty places last.
    pub struct ErrorList {
        /// The codes.
        pub codes: [ErrorCode; 8],
        /// More stand than fit.
        pub more: bool,
    }
}

impl ErrorList {
    /// Adds `code` in its place; the largest code makes room when the list is full.
    pub fn insert(&mut self, code: ErrorCode) {
        let mut carried = code;
        for place in &mut self.codes {
            if place.is_none() {
                *place = carried;
                return;
            }
            if *place == carried {
                return;
            }
            if *place > carried {
                core::mem::swap(place, &mut carried);
            }
        }
        self.more = true;
    }

    /// The codes in use, in order.
    pub fn iter(&self) -> impl Iterator<Item = &ErrorCode> {
        self.codes.iter().take_while(|code| !code.is_none())
    }

    /// Whether `code` stands.
    pub fn contains(&self, code: ErrorCode) -> bool {
        self.iter().any(|standing| *standing == code)
    }

    /// Whether nothing stands.
    pub const fn is_empty(&self) -> bool {
        self.codes[0].is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_keeps_order_refuses_doubles_and_says_when_it_is_full() {
        let mut list = ErrorList::default();
        for info in [5, 3, 9, 3] {
            list.insert(ErrorCode::amk(3606, 13, info, 0));
        }
        let order: [u32; 3] = core::array::from_fn(|i| list.codes[i].info2);
        assert_eq!(order, [3, 5, 9]);
        assert!(!list.more);
        for code in 1..=8 {
            list.insert(ErrorCode::single(code));
        }
        assert!(list.more);
    }
}
