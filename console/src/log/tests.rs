use std::{env, path::PathBuf, process};

use crosscheck::logbook::{Book, Entry, Moment, Size};
use shm_schema::error::ErrorCode;

use super::*;

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = env::temp_dir().join(format!("safepair-log-{name}-{}", process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a temporary folder");
        Self(path)
    }

    fn book(&self) -> PathBuf {
        let path = self.0.join("book");
        if !path.exists() {
            let mut book = Book::open(&path, Size::default()).expect("opens");
            let mut trip = Moment { axis: 2, exchange: 7, ..Moment::default() };
            trip.errors[0][0] = ErrorCode::amk(3606, 112, 3, 0);
            let entries = [
                Entry::Start { version: "1".into(), nonce: 1, axes: vec![(2, 1, 5)] },
                Entry::Change(Moment { axis: 2, torque: true, ..Moment::default() }),
                Entry::Trip { moment: trip, second: vec![trip; 3] },
                Entry::End,
            ];
            entries.iter().for_each(|entry| book.append(entry).expect("appends"));
        }
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn exit(line: &[&str]) -> String {
    let args = Args::parse_from([&["log"], line].concat());
    format!("{:?}", run(&args))
}

fn code(code: u8) -> String {
    format!("{:?}", ExitCode::from(code))
}

#[test]
fn a_whole_book_verifies_and_every_cut_falls_short() {
    let folder = Folder::new("verify");
    let book = folder.book();
    let file = book.to_str().expect("a name");
    assert_eq!(exit(&["verify", file]), code(0));
    assert_eq!(exit(&["verify", file, "--json"]), code(0));
    let whole = fs::read(&book).expect("there");
    for cut in 0..whole.len() {
        fs::write(&book, &whole[..cut]).expect("writes");
        assert_eq!(exit(&["verify", file, "--json"]), code(1), "cut at {cut}");
        assert_eq!(exit(&["ten", file, "--json"]), code(0), "cut at {cut}: it still opens");
    }
    assert_eq!(exit(&["verify", "no such file"]), code(2));
}

#[test]
fn every_view_reads_a_book_and_bad_options_are_refused() {
    let folder = Folder::new("views");
    let book = folder.book();
    let file = book.to_str().expect("a name");
    let csv = folder.0.join("out.csv");
    let out = csv.to_str().expect("a name");
    assert_eq!(exit(&["export", file, "--format", "csv", "--out", out]), code(0));
    assert_eq!(fs::read_to_string(&csv).expect("written").lines().count(), 1 + 4 + 3);
    assert_eq!(exit(&["show", file, "--axis", "2", "--code", "3606/112", "--since", "2h"]), code(0));
    assert_eq!(exit(&["show", file, "--since", "long ago"]), code(2));
    assert_eq!(exit(&["ten", file, "--axis", "2"]), code(0));
}
