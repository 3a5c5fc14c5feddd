//! What a logbook proves, and what it misses.

use std::process::ExitCode;

use crosscheck::logbook::{Entry, Findings, export::hexadecimal, verify::files};
use serde_json::json;

use super::{Book, time};

/// Says what is proved; 0 when nothing is damaged, missing or unfinished.
pub fn verify(book: &Book, findings: &Findings, json: bool) -> ExitCode {
    let (proved, hash) = findings.proved;
    let first = findings.records.first().map_or(0, |record| record.number);
    let last = findings.records.last();
    let count = files(&book.file).map_or(0, |files| files.len());
    if json {
        println!(
            "{}",
            json!({
                "file": book.file.display().to_string(),
                "files": count,
                "whole": findings.is_whole(),
                "records": findings.records.len(),
                "first": first,
                "last": last.map_or(0, |record| record.number),
                "proved_to": proved,
                "proved_hash": hexadecimal(&hash),
                "sound_octets": findings.sound_octets,
                "torn_octets": findings.torn_octets,
                "faults": findings.faults,
                "notes": notes(findings),
            })
        );
    } else {
        println!("{}: {} records in {count} files", book.file.display(), findings.records.len());
        match findings.records.iter().find(|record| record.number == proved) {
            Some(record) => println!(
                "proved: records {first} to {proved}, of {}, hash {}",
                time::text(record.unix_ns),
                hexadecimal(&hash)
            ),
            None => println!("proved: nothing"),
        }
        if let Some(last) = last.filter(|last| last.number > proved) {
            println!("readable behind the first fault, not proved: up to record {}", last.number);
        }
        findings.faults.iter().for_each(|fault| println!("FAULT {fault}"));
        if findings.torn_octets > 0 {
            println!("TORN {}", torn(findings));
        }
        notes(findings).iter().for_each(|note| println!("note: {note}"));
        println!("{}", if findings.is_whole() { "whole" } else { "NOT whole" });
    }
    if findings.is_whole() { ExitCode::SUCCESS } else { ExitCode::from(1) }
}

/// What octets that are no whole record mean.
pub fn torn(findings: &Findings) -> String {
    format!(
        "{} octets behind record {} are no whole record: a write that a loss of power ended, a cut, or damage",
        findings.torn_octets,
        findings.next_number.saturating_sub(1)
    )
}

fn notes(findings: &Findings) -> Vec<String> {
    let mut notes = findings.notes.clone();
    let open = findings.records.last().filter(|last| last.entry != Some(Entry::End));
    if let Some(last) = open {
        notes.push(format!("record {} is no end of a run: it runs, or it did not end in order", last.number));
    }
    notes
}
