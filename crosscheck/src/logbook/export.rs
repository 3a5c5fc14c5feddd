//! The logbook for people and programs: CSV, JSON lines.

use std::fmt::Write as _;
use std::format;
use std::string::String;
use std::vec::Vec;

use shm_schema::error::ErrorCode;

use super::moment::Moment;
use super::record::{Entry, Hash, Record};
use super::verify::Findings;

/// Column names of [`to_csv`].
pub const CSV_HEADER: &str = "number,unix_ns,kind,axis,monotonic_ns,exchange,torque,status_a,status_b,status,\
position_a,position_b,speed_a_mrpm,speed_b_mrpm,errors_a,errors_b,errors_crosscheck,text";

/// One line for each record; the second of a trip follows it as lines of kind `second`.
pub fn to_csv(findings: &Findings) -> String {
    let mut out = String::from(CSV_HEADER);
    out.push('\n');
    for record in &findings.records {
        let front = format!("{},{}", record.number, record.unix_ns);
        match &record.entry {
            Some(Entry::Change(moment)) => csv_moment(&mut out, &front, "change", moment),
            Some(Entry::Trip { moment, second }) => {
                csv_moment(&mut out, &front, "trip", moment);
                for moment in second {
                    csv_moment(&mut out, &front, "second", moment);
                }
            }
            other => {
                let (kind, text) = words(other.as_ref());
                let _ = writeln!(out, "{front},{kind},,,,,,,,,,,,,,,\"{}\"", text.replace('"', "\"\""));
            }
        }
    }
    out
}

fn csv_moment(out: &mut String, front: &str, kind: &str, moment: &Moment) {
    let [sa, sb, sc] = moment.status;
    let [pa, pb] = moment.positions;
    let [va, vb] = moment.speeds_mrpm;
    let [ea, eb, ec] = moment.errors.map(|codes| codes_of(&codes).join(" "));
    let Moment { axis, now_ns, exchange, torque, .. } = moment;
    let _ = writeln!(
        out,
        "{front},{kind},{axis},{now_ns},{exchange},{torque},0x{sa:X},0x{sb:X},0x{sc:X},{pa},{pb},{va},{vb},{ea},{eb},{ec},"
    );
}

/// One JSON object for each record, and a last one that says what the whole proves.
pub fn to_json_lines(findings: &Findings) -> String {
    let mut out = String::new();
    for record in &findings.records {
        let _ = writeln!(out, "{}", json_record(record));
    }
    let faults: Vec<String> = findings.faults.iter().map(|fault| quoted(fault)).collect();
    let _ = writeln!(
        out,
        "{{\"kind\":\"proof\",\"records\":{},\"torn_octets\":{},\"faults\":[{}],\"hash\":\"{}\"}}",
        findings.records.len(),
        findings.torn_octets,
        faults.join(","),
        hexadecimal(&findings.hash)
    );
    out
}

/// One record as a JSON object on one line.
pub fn json_record(record: &Record) -> String {
    let front = format!("{{\"number\":{},\"unix_ns\":{},", record.number, record.unix_ns);
    let back = format!(",\"hash\":\"{}\"}}", hexadecimal(&record.hash));
    match &record.entry {
        Some(Entry::Change(moment)) => format!("{front}\"kind\":\"change\",{}{back}", json_moment(moment)),
        Some(Entry::Trip { moment, second }) => {
            let second: Vec<String> =
                second.iter().map(|moment| format!("{{{}}}", json_moment(moment))).collect();
            let second = second.join(",");
            format!("{front}\"kind\":\"trip\",{},\"second\":[{second}]{back}", json_moment(moment))
        }
        other => {
            let (kind, text) = words(other.as_ref());
            format!("{front}\"kind\":\"{kind}\",\"text\":{}{back}", quoted(&text))
        }
    }
}

fn json_moment(moment: &Moment) -> String {
    let [sa, sb, sc] = moment.status;
    let [pa, pb] = moment.positions;
    let [va, vb] = moment.speeds_mrpm;
    let [ea, eb, ec] = moment.errors.map(|codes| {
        let codes: Vec<String> = codes_of(&codes).iter().map(|code| quoted(code)).collect();
        codes.join(",")
    });
    let Moment { axis, now_ns, exchange, torque, .. } = moment;
    format!(
        "\"axis\":{axis},\"monotonic_ns\":{now_ns},\"exchange\":{exchange},\"torque\":{torque},\
         \"status\":[\"0x{sa:X}\",\"0x{sb:X}\",\"0x{sc:X}\"],\"position\":[{pa},{pb}],\"speed_mrpm\":[{va},{vb}],\
         \"errors\":[[{ea}],[{eb}],[{ec}]]"
    )
}

/// Kind and text of a record without a moment.
pub fn words(entry: Option<&Entry>) -> (&'static str, String) {
    match entry {
        Some(Entry::Start { version, nonce, axes }) => {
            let axes: Vec<String> = axes
                .iter()
                .map(|(axis, profile, signature)| {
                    format!("axis {axis} profile {profile} signature {signature:08X}")
                })
                .collect();
            ("start", format!("{version}, boot nonce {nonce}, {}", axes.join(", ")))
        }
        Some(Entry::Intervention(text)) => ("intervention", text.clone()),
        Some(Entry::Lost { moments, changes }) => {
            ("lost", format!("{moments} moments did not fit, {changes} changes came too fast"))
        }
        Some(Entry::End) => ("end", String::new()),
        Some(Entry::Change(_) | Entry::Trip { .. }) => ("moment", String::new()),
        None => ("unknown", String::new()),
    }
}

fn codes_of(codes: &[ErrorCode]) -> Vec<String> {
    let standing = codes.iter().filter(|code| !code.is_none());
    standing.map(|code| format!("{}/{}/{}/{}", code.code, code.info1, code.info2, code.info3)).collect()
}

/// A hash in hexadecimal.
pub fn hexadecimal(hash: &Hash) -> String {
    hash.iter().fold(String::new(), |mut text, octet| {
        let _ = write!(text, "{octet:02x}");
        text
    })
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for character in text.chars() {
        match character {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c < ' ' => {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
