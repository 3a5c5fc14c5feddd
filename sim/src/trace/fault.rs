//! Faults that a trace injects by name (design 10).

/// One injected fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// Channel A is not stepped: no edges, no new report.
    FreezeA,
    /// Channel B is not stepped.
    FreezeB,
    /// Crosscheck is not stepped: no new agreement.
    FreezeCrosscheck,
    /// The encoder sample repeats: sequence and time stamp stand still.
    StaleEncoder,
    /// The raw signals channel A evaluates stand still.
    FreezeEncoder1,
    /// The raw signals channel B evaluates stand still.
    FreezeEncoder2,
    /// The encoder cell fails its check sum.
    CorruptEncoder,
    /// Report A fails its check sum at both readers.
    CorruptReportA,
    /// Path A and its readback stay on.
    StuckPathA,
    /// Path B and its readback stay on.
    StuckPathB,
}

impl Fault {
    /// All faults, in the order of the table.
    pub const ALL: [Self; 10] = [
        Self::FreezeA,
        Self::FreezeB,
        Self::FreezeCrosscheck,
        Self::StaleEncoder,
        Self::FreezeEncoder1,
        Self::FreezeEncoder2,
        Self::CorruptEncoder,
        Self::CorruptReportA,
        Self::StuckPathA,
        Self::StuckPathB,
    ];

    /// Name in a trace.
    pub const fn name(self) -> &'static str {
        match self {
            Self::FreezeA => "freeze-a",
            Self::FreezeB => "freeze-b",
            Self::FreezeCrosscheck => "freeze-crosscheck",
            Self::StaleEncoder => "stale-encoder",
            Self::FreezeEncoder1 => "freeze-enc1",
            Self::FreezeEncoder2 => "freeze-enc2",
            Self::CorruptEncoder => "corrupt-encoder",
            Self::CorruptReportA => "corrupt-report-a",
            Self::StuckPathA => "stuck-path-a",
            Self::StuckPathB => "stuck-path-b",
        }
    }
}

/// A set of faults that act together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Faults(u16);

impl Faults {
    /// None.
    pub const NONE: Self = Self(0);

    /// With `fault` added.
    #[must_use]
    pub const fn with(self, fault: Fault) -> Self {
        Self(self.0 | 1 << fault as u8)
    }

    /// Whether `fault` acts.
    #[inline]
    pub const fn has(self, fault: Fault) -> bool {
        self.0 >> fault as u8 & 1 == 1
    }

    /// `none` or the name of one fault.
    pub fn named(name: &str) -> Option<Self> {
        if name == "none" {
            return Some(Self::NONE);
        }
        Fault::ALL.into_iter().find(|fault| fault.name() == name).map(|fault| Self::NONE.with(fault))
    }
}
