//! Parameters of one axis by code and subcode.

use std::collections::BTreeMap;
use std::rc::Rc;

use shm_schema::facts::lenze_sm301::PARAMETERS;
use shm_schema::profile::lenze_key;

use super::stops::Target;

/// Parameters by code and subcode, over the delivery state (DEC-28, DEC-49).
#[derive(Debug, Clone)]
pub struct Parameters(Rc<BTreeMap<u32, i32>>);

impl Parameters {
    /// The given values over the delivery state.
    pub fn new(given: &BTreeMap<u32, i32>) -> Self {
        let mut all: BTreeMap<u32, i32> = PARAMETERS.iter().map(|row| (row.key, row.default)).collect();
        all.extend(given);
        Self(Rc::new(all))
    }

    /// A code without subcode.
    pub fn code(&self, code: u32) -> i64 {
        self.sub(code, 0)
    }

    /// A code with subcode.
    pub fn sub(&self, code: u32, sub: u32) -> i64 {
        self.0.get(&lenze_key(code, sub)).map_or(0, |value| i64::from(*value))
    }

    /// 0 STO, 1 SS1, 2 SS2.
    pub fn reaction(&self, code: u32, sub: u32) -> Target {
        match self.sub(code, sub) {
            1 => Target::Ss1,
            2 => Target::Ss2,
            _ => Target::Sto,
        }
    }
}
