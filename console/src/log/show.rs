//! The records as a list that a person reads.

use std::{
    process::ExitCode,
    time::{SystemTime, UNIX_EPOCH},
};

use crosscheck::logbook::{
    Entry, Findings, Moment, Record,
    export::{self, json_record},
};
use shm_schema::profile::Profile;
use sim::replay::code_text;

use super::{Book, time, warn};

/// Options of `show`.
#[derive(Debug, clap::Args)]
pub struct Show {
    #[command(flatten)]
    pub(super) book: Book,
    /// Only records of this axis.
    #[arg(long)]
    axis: Option<u8>,
    /// Only records with this code: 3606, 3606/13/6, SME0A9.
    #[arg(long)]
    code: Option<String>,
    /// Only records since: 2026-11-22, 2026-11-22T14:05, or so long ago: 15m, 2h, 7d.
    #[arg(long)]
    since: Option<String>,
}

/// What is shown.
#[derive(Debug, Default)]
pub struct Filter {
    axis: Option<u8>,
    code: Option<String>,
    since_ns: u64,
}

impl Show {
    /// The filter of the options, or what is wrong with them.
    pub fn filter(&self) -> Result<Filter, String> {
        let now_ns = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos() as u64);
        let since_ns = match &self.since {
            None => 0,
            Some(text) => time::parse(text, now_ns).ok_or_else(|| {
                format!("--since {text}: expected a date (2026-11-22T14:05) or a span (90s, 15m, 2h, 7d)")
            })?,
        };
        Ok(Filter { axis: self.axis, code: self.code.clone(), since_ns })
    }
}

/// Profiles of the axes as the newest start before a record says.
#[derive(Default)]
struct Profiles(Vec<(u8, u8)>);

impl Profiles {
    fn learn(&mut self, entry: &Entry) {
        if let Entry::Start { axes, .. } = entry {
            self.0 = axes.iter().map(|(axis, profile, _)| (*axis, *profile)).collect();
        }
    }

    fn of(&self, axis: u8) -> Profile {
        let known = self.0.iter().find(|(number, _)| *number == axis);
        let number = known.map_or(Profile::AmkKw as u8, |(_, profile)| *profile);
        let all = params::definition::PROFILES.into_iter();
        all.clone().find(|profile| *profile as u8 == number).unwrap_or(Profile::AmkKw)
    }

    fn codes(&self, moment: &Moment) -> Vec<String> {
        let mut codes: Vec<String> = Vec::new();
        for (_, code) in moment.codes() {
            let mut text = String::new();
            code_text(&mut text, self.of(moment.axis), &code);
            if !codes.contains(&text) {
                codes.push(text);
            }
        }
        codes
    }
}

/// Prints the records that pass the filter, newest last.
pub fn list(findings: &Findings, filter: &Filter, json: bool) -> ExitCode {
    warn(findings);
    let mut profiles = Profiles::default();
    for record in &findings.records {
        if let Some(entry) = &record.entry {
            profiles.learn(entry);
        }
        if !filter.passes(record, &profiles) {
            continue;
        }
        if json {
            println!("{}", json_record(record));
        } else {
            println!("{}", line(record, &profiles));
        }
    }
    ExitCode::SUCCESS
}

impl Filter {
    fn passes(&self, record: &Record, profiles: &Profiles) -> bool {
        let moment = moment(record);
        let axis = self.axis.is_none_or(|axis| moment.is_some_and(|moment| moment.axis == axis));
        let code = self.code.as_ref().is_none_or(|wanted| {
            moment.is_some_and(|moment| profiles.codes(moment).iter().any(|code| begins(code, wanted)))
        });
        let since = record.unix_ns >= self.since_ns;
        [axis, code, since].into_iter().all(|part| part)
    }
}

/// `3606/13` is every code that begins with these fields.
fn begins(code: &str, wanted: &str) -> bool {
    let mut fields = code.split('/');
    wanted.split('/').all(|field| fields.next().is_some_and(|own| own.eq_ignore_ascii_case(field)))
}

fn moment(record: &Record) -> Option<&Moment> {
    match record.entry.as_ref()? {
        Entry::Change(moment) | Entry::Trip { moment, .. } => Some(moment),
        _ => None,
    }
}

fn line(record: &Record, profiles: &Profiles) -> String {
    let front = format!("{:>7} {}", record.number, time::text(record.unix_ns));
    match &record.entry {
        Some(Entry::Change(moment)) => format!("{front} {}", state("change", moment, profiles)),
        Some(Entry::Trip { moment, second }) => {
            let ms = second.first().map_or(0, |first| moment.now_ns.saturating_sub(first.now_ns) / 1_000_000);
            let kept = second.len();
            format!("{front} {}; {kept} moments of the {ms} ms before", state("TRIP", moment, profiles))
        }
        other => {
            let (kind, text) = export::words(other.as_ref());
            format!("{front} {kind:<12} {text}")
        }
    }
}

fn state(kind: &str, moment: &Moment, profiles: &Profiles) -> String {
    let [_, _, status] = moment.status;
    let [position, _] = moment.positions;
    let [speed, _] = moment.speeds_mrpm;
    let torque = if moment.torque { "torque on" } else { "torque off" };
    let codes = profiles.codes(moment);
    let codes = if codes.is_empty() { String::new() } else { format!(", codes {}", codes.join(" ")) };
    format!(
        "{kind:<12} axis {}, cycle {}, {torque}, status 0x{status:08X}, {:.1} rpm, position {position}{codes}",
        moment.axis,
        moment.exchange,
        f64::from(speed) / 1_000.0,
    )
}
