//! Makes a failing scenario small: fewer rows, an earlier end, rounder speeds.

use super::scenario::{Row, Scenario};

/// The smallest scenario found for which `fails` still holds.
pub fn smallest(scenario: Scenario, fails: &dyn Fn(&Scenario) -> bool) -> Scenario {
    let mut best = scenario;
    loop {
        let shorter = shorten(&best, fails);
        let fewer = drop_rows(shorter, fails);
        let simpler = at_zero(simplify_rows(fewer, fails), fails);
        if simpler == best {
            return best;
        }
        best = simpler;
    }
}

/// The earliest end that still fails, by halving.
fn shorten(scenario: &Scenario, fails: &dyn Fn(&Scenario) -> bool) -> Scenario {
    let (mut passing, mut failing) = (-1, scenario.last);
    while failing - passing > 1 {
        let middle = passing + (failing - passing) / 2;
        if fails(&cut(scenario, middle)) { failing = middle } else { passing = middle }
    }
    let candidate = cut(scenario, failing);
    if fails(&candidate) { candidate } else { scenario.clone() }
}

/// From position 0, where a trace begins, if that fails too.
fn at_zero(best: Scenario, fails: &dyn Fn(&Scenario) -> bool) -> Scenario {
    let candidate = Scenario { origin: 0, ..best.clone() };
    if fails(&candidate) { candidate } else { best }
}

fn cut(scenario: &Scenario, last: i64) -> Scenario {
    Scenario { last, ..scenario.clone() }
}

/// Without every row that is not needed; the first one stays.
fn drop_rows(mut best: Scenario, fails: &dyn Fn(&Scenario) -> bool) -> Scenario {
    let mut size = best.rows.len() / 2;
    while size > 0 {
        let mut start = 1;
        while start < best.rows.len() {
            let mut candidate = best.clone();
            let end = (start + size).min(candidate.rows.len());
            candidate.rows.drain(start..end);
            if fails(&candidate) {
                best = candidate;
            } else {
                start += size;
            }
        }
        size /= 2;
    }
    best
}

/// Each row with one field less, or a speed in whole rpm.
fn simplify_rows(mut best: Scenario, fails: &dyn Fn(&Scenario) -> bool) -> Scenario {
    let changes: [fn(&mut Row); 7] = [
        |row| row.speed_mrpm = None,
        |row| row.control = None,
        |row| row.lines = None,
        |row| row.clear_error = None,
        |row| row.torque_percent = None,
        |row| row.acceleration_rpm_s = None,
        |row| row.speed_mrpm = row.speed_mrpm.map(|speed| speed / 1000 * 1000),
    ];
    for at in 0..best.rows.len() {
        for change in changes {
            let mut candidate = best.clone();
            change(&mut candidate.rows[at]);
            if candidate != best && fails(&candidate) {
                best = candidate;
            }
        }
    }
    best
}
