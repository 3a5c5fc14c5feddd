//! What was seen, held against what had to happen.

use serde::Serialize;
use shm_schema::word::Word;

use super::{Expectation, Probe};

/// A change of a source, as replay shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Time, ms.
    pub t_ms: f64,
    /// `a`, `b` or `crosscheck`.
    pub source: &'static str,
    /// Status word.
    pub status: Word,
    /// Safe outputs as the controller asks for them, and the release of the brake in bit 7.
    pub outputs: u8,
    /// Torque.
    pub torque: bool,
    /// Standing codes.
    pub errors: Vec<String>,
    /// Speed, 1/min.
    pub rpm: f64,
    /// Position, increments.
    pub position: i64,
}

/// What was measured for an expectation.
#[derive(Clone, Debug, Serialize)]
pub struct Measured {
    /// When it happened, ms; `None`: not at all.
    pub t_ms: Option<f64>,
    /// Speed then, 1/min.
    pub rpm: Option<f64>,
    /// Position then, increments.
    pub position: Option<i64>,
    /// What was seen, in words.
    pub text: String,
    /// It is as expected.
    pub right: bool,
}

/// Judges one expectation by everything that was seen.
pub fn judge(expectation: &Expectation, seen: &[Seen]) -> Measured {
    let (from, to) = expectation.window_ms;
    let of = |source: &'static str| seen.iter().filter(move |seen| seen.source == source);
    match &expectation.probe {
        Probe::TorqueOff => edge(of("crosscheck"), from, to, |seen| !seen.torque),
        Probe::LaterOff => edge(since(of("crosscheck"), from), from, to, |seen| !seen.torque),
        Probe::LaterBit(bit) => edge(since(of("crosscheck"), from), from, to, |seen| seen.status.bit(*bit)),
        Probe::Bit(bit, on) => edge(of("crosscheck"), from, to, |seen| seen.status.bit(*bit) == *on),
        Probe::Output(bit, on) => {
            edge(of("crosscheck"), from, to, |seen| (seen.outputs >> (bit & 7) & 1 == 1) == *on)
        }
        Probe::Code(code) => {
            both(&[edge_of_code(of("a"), code, from, to), edge_of_code(of("b"), code, from, to)])
        }
        Probe::Combined(code) => edge_of_code(of("crosscheck"), code, from, to),
        Probe::Quiet => quiet(seen, from, to),
        Probe::TorqueOn => torque_on(of("crosscheck"), from, to),
        Probe::Recovered => recovered(of("crosscheck"), to),
    }
}

/// The first time a condition comes true after it was false.
fn edge<'a>(
    seen: impl Iterator<Item = &'a Seen>,
    from: f64,
    to: f64,
    condition: impl Fn(&Seen) -> bool,
) -> Measured {
    let mut before = None;
    for now in seen {
        let holds = condition(now);
        // What holds from the start on is no reaction.
        if before == Some(false) && holds && now.t_ms >= from - 1.5 {
            return happened(now, (from - 0.05..=to + 0.05).contains(&now.t_ms), String::new());
        }
        before = Some(holds);
    }
    missed("did not happen")
}

/// What stood when the window began, and what came later.
fn since<'a>(seen: impl Iterator<Item = &'a Seen>, from: f64) -> impl Iterator<Item = &'a Seen> {
    let all: Vec<_> = seen.collect();
    let before = all.iter().take_while(|seen| seen.t_ms < from - 1.5).count().saturating_sub(1);
    all.into_iter().skip(before)
}

fn edge_of_code<'a>(seen: impl Iterator<Item = &'a Seen>, code: &str, from: f64, to: f64) -> Measured {
    let carries = |seen: &Seen| seen.errors.iter().any(|error| begins(error, code));
    let mut last = Vec::new();
    let mut first = None;
    for now in seen {
        if carries(now) && first.is_none() {
            first = Some(now);
        }
        last.extend(now.errors.iter().cloned());
    }
    last.sort();
    last.dedup();
    match first {
        Some(now) => {
            let own = now.errors.iter().filter(|error| begins(error, code)).cloned().collect::<Vec<_>>();
            happened(now, (from - 0.05..=to + 0.05).contains(&now.t_ms), own.join(" "))
        }
        None if last.is_empty() => missed("no code"),
        None => missed(&format!("other codes: {}", last.join(" "))),
    }
}

/// `3606/112` is the begin of `3606/112/3/0`, and not of `3606/1123`.
fn begins(code: &str, wanted: &str) -> bool {
    let fields: Vec<_> = code.split('/').collect();
    wanted.is_empty() || wanted.split('/').zip(&fields).all(|(wanted, field)| wanted == *field)
}

fn both(channels: &[Measured; 2]) -> Measured {
    let [a, b] = channels;
    let text = if a.text == b.text { a.text.clone() } else { format!("A: {}; B: {}", a.text, b.text) };
    Measured { right: a.right && b.right, text, ..if b.t_ms > a.t_ms { b.clone() } else { a.clone() } }
}

fn quiet(seen: &[Seen], from: f64, to: f64) -> Measured {
    let disturbed = seen.iter().find(|seen| {
        let inside = (from..=to).contains(&seen.t_ms);
        let bad = !seen.torque || !seen.errors.is_empty();
        inside && bad
    });
    match disturbed {
        None => Measured { t_ms: None, rpm: None, position: None, text: "as expected".into(), right: true },
        Some(seen) => {
            let torque = if seen.torque { "" } else { "torque off " };
            happened(seen, false, format!("{torque}{} ({})", seen.errors.join(" "), seen.source))
        }
    }
}

fn torque_on<'a>(seen: impl Iterator<Item = &'a Seen>, from: f64, to: f64) -> Measured {
    let mut on = false;
    let mut lost = None;
    for now in seen.take_while(|now| now.t_ms <= to) {
        on = now.torque;
        if now.t_ms >= from && !on {
            lost = lost.or(Some(now));
        }
    }
    match lost {
        Some(now) => happened(now, false, "torque off".into()),
        None if on => {
            Measured { t_ms: None, rpm: None, position: None, text: "as expected".into(), right: true }
        }
        None => missed("torque was off before"),
    }
}

fn recovered<'a>(seen: impl Iterator<Item = &'a Seen>, to: f64) -> Measured {
    let Some(last) = seen.take_while(|seen| seen.t_ms <= to).last() else {
        return missed("nothing was seen");
    };
    let right = last.torque && last.errors.is_empty();
    let text = if right {
        "torque on, no code".into()
    } else {
        format!("torque {}, {}", if last.torque { "on" } else { "off" }, last.errors.join(" "))
    };
    happened(last, right, text)
}

fn happened(seen: &Seen, right: bool, text: String) -> Measured {
    Measured { t_ms: Some(seen.t_ms), rpm: Some(seen.rpm), position: Some(seen.position), text, right }
}

fn missed(text: &str) -> Measured {
    Measured { t_ms: None, rpm: None, position: None, text: text.into(), right: false }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(t_ms: f64, source: &'static str, torque: bool, errors: &[&str]) -> Seen {
        let errors = errors.iter().map(ToString::to_string).collect();
        Seen {
            t_ms,
            source,
            status: Word::from_u32(u32::from(!torque)),
            outputs: 0,
            torque,
            errors,
            rpm: 500.0,
            position: 0,
        }
    }

    #[test]
    fn a_reaction_counts_in_its_window_only() {
        let seen = [at(0.0, "crosscheck", true, &[]), at(12.0, "crosscheck", false, &[])];
        let judged = |from, to, probe| judge(&Expectation::new("", from, to, probe), &seen);
        assert!(judged(11.0, 13.0, Probe::TorqueOff).right);
        assert!(!judged(13.0, 14.0, Probe::TorqueOff).right);
        assert!(!judged(1.0, 3.0, Probe::TorqueOff).right);
        assert!(judged(12.0, 12.0, Probe::Bit(0, true)).right);
        assert!(judged(0.0, 11.0, Probe::Quiet).right);
        assert!(!judged(0.0, 12.0, Probe::Quiet).right);
        assert!(!judged(0.0, 20.0, Probe::Recovered).right);
    }

    #[test]
    fn a_code_has_to_come_from_both_channels() {
        let mut seen = vec![at(5.0, "a", false, &["3606/112/3/0"])];
        let code = |seen: &[Seen]| {
            judge(&Expectation::new("", 4.0, 6.0, Probe::Code("3606/112".into())), seen).right
        };
        assert!(!code(&seen));
        seen.push(at(6.0, "b", false, &["3606/112/3/0"]));
        assert!(code(&seen));
        seen[1].errors = vec!["3606/1120/3/0".into()];
        assert!(!code(&seen));
    }
}
