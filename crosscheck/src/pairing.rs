//! Following each channel's reports and finding the two of one exchange.
//!
//! A and B are compared only on the same encoder sample (design 5). Each follower keeps the
//! last reports, so that one that comes a cycle late still finds its partner.

use shm_schema::exchange::{Received, Sampled};
use shm_schema::report::Report;

/// Cycles without news after which a channel is lost (DEC-23), in the strict timing.
const SILENT_MAX: u8 = 3;

/// Cycles without news after which a channel is lost; `age_factor` as in the setup.
pub fn silent_max(age_factor: u8) -> u8 {
    SILENT_MAX.saturating_mul(age_factor.max(1))
}

/// Error acknowledge and the drive's non-safe clear command (AMK-ACK-02).
const ACKNOWLEDGE: u32 = 0b101;
/// Reports kept; a power of two.
const KEPT: usize = 4;
/// Exchanges a report may lie behind the newest and still be compared.
const LATE_MAX: u64 = 2;

/// One channel as crosscheck hears it.
#[derive(Debug, Clone, Copy)]
pub struct Follower {
    kept: [Option<Sampled<Report>>; KEPT],
    newest: usize,
    silent: u8,
    silent_max: u8,
    heard: bool,
    advanced: bool,
    levels: u32,
    edge: bool,
}

impl Follower {
    /// `heard`: the channel counts as present before its first report (settled start).
    pub const fn new(heard: bool, silent_max: u8) -> Self {
        Self {
            kept: [None; KEPT],
            newest: 0,
            silent: 0,
            silent_max,
            heard,
            advanced: false,
            // DEC-16: a level that is high from the beginning is no edge.
            levels: u32::MAX,
            edge: false,
        }
    }

    /// Takes in what the channel shows in this cycle. `due`: the newest encoder sample.
    pub fn follow(&mut self, received: &Received<Report>, due: Option<u64>, now_ns: u64, cycle_ns: u64) {
        self.edge = false;
        self.advanced = false;
        match received {
            Ok(sampled) if self.is_news(sampled, due, now_ns, cycle_ns) => self.accept(sampled),
            _ => self.miss(),
        }
    }

    fn accept(&mut self, sampled: &Sampled<Report>) {
        let levels = sampled.payload.acknowledgements;
        self.edge = levels & !self.levels & ACKNOWLEDGE != 0;
        self.levels = levels;
        self.newest = self.newest.wrapping_add(1) % KEPT;
        if let Some(place) = self.kept.get_mut(self.newest) {
            *place = Some(*sampled);
        }
        self.silent = 0;
        self.heard = true;
        self.advanced = true;
    }

    fn miss(&mut self) {
        self.silent = self.silent.saturating_add(1);
        if self.is_lost() {
            // DEC-16: after a loss a 0 must be seen again.
            self.levels = u32::MAX;
        }
    }

    /// Whether this report says something new: both its own sequence and, unless the
    /// producer stands still, its exchange number went on, neither into the future.
    fn is_news(&self, sampled: &Sampled<Report>, due: Option<u64>, now_ns: u64, cycle_ns: u64) -> bool {
        let exchange = sampled.payload.exchange;
        let possible = due.is_none_or(|due| exchange <= due.saturating_add(1));
        let present = sampled.timestamp_ns <= now_ns.saturating_add(cycle_ns);
        let newer = self.newest().is_none_or(|last| {
            let written = sampled.sequence > last.sequence;
            let computed = exchange > last.payload.exchange;
            let same_sample = exchange == last.payload.exchange;
            let producer_stands = due.is_none_or(|due| due <= exchange);
            let computed_again = same_sample & producer_stands;
            let said_something = computed | computed_again;
            written & said_something
        });
        possible & present & newer
    }

    /// The newest report accepted.
    pub fn newest(&self) -> Option<&Sampled<Report>> {
        self.kept.get(self.newest)?.as_ref()
    }

    /// Whether this cycle brought a report.
    pub const fn advanced(&self) -> bool {
        self.advanced
    }

    /// Whether this cycle's report shows an acknowledge edge.
    pub const fn edge(&self) -> bool {
        self.edge
    }

    /// Whether the channel was there and is not any more (DEC-23).
    pub const fn is_lost(&self) -> bool {
        self.heard && (self.silent >= self.silent_max)
    }

    /// Whether the channel is there.
    pub const fn is_present(&self) -> bool {
        self.heard && (self.silent < self.silent_max)
    }

    /// The newest report kept that was computed from `exchange`.
    fn of_exchange(&self, exchange: u64) -> Option<&Sampled<Report>> {
        let same = |report: &&Sampled<Report>| report.payload.exchange == exchange;
        self.kept.iter().flatten().filter(same).max_by_key(|report| report.sequence)
    }
}

/// The reports of both channels on one exchange.
#[derive(Debug, Clone, Copy)]
pub struct Pair {
    /// Report of A.
    pub a: Sampled<Report>,
    /// Report of B.
    pub b: Sampled<Report>,
}

impl Pair {
    /// The reports of A and B on the newest exchange both have reported on, unless `last` is
    /// just that.
    pub fn find<'a>(
        a: &'a Follower,
        b: &'a Follower,
        last: Option<&Self>,
    ) -> Option<[&'a Sampled<Report>; 2]> {
        let newest_a = a.newest()?;
        let newest_b = b.newest()?;
        let exchange = newest_a.payload.exchange.min(newest_b.payload.exchange);
        let ahead = newest_a.payload.exchange.max(newest_b.payload.exchange);
        if ahead.saturating_sub(exchange) > LATE_MAX {
            return None;
        }
        let (a, b) = (a.of_exchange(exchange)?, b.of_exchange(exchange)?);
        let known = last.is_some_and(|last| last.sequences() == (a.sequence, b.sequence));
        (!known).then_some([a, b])
    }

    const fn sequences(&self) -> (u64, u64) {
        (self.a.sequence, self.b.sequence)
    }

    /// The exchange number.
    pub const fn exchange(&self) -> u64 {
        self.a.payload.exchange
    }
}
