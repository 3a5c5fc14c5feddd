//! The text of a line; what the cores do is tested with the cores.

use shm_schema::error::{ErrorCode, ErrorList};
use shm_schema::profile::{Profile, common};
use shm_schema::word::Word;

use super::*;
use crate::machine::Codes;

fn words(profile: Profile) -> Words {
    Words::of(&AxisSet::delivery(profile, 1, "SIM-0001"))
}

fn json(profile: Profile, at_ns: i64, view: &View) -> String {
    let mut text = String::new();
    Line { at_ns, axis: 1, source: Source::Crosscheck, words: &words(profile), view }.json(&mut text);
    text
}

fn codes(all: &[ErrorCode]) -> Codes {
    let mut list = ErrorList::default();
    for code in all {
        list.insert(*code);
    }
    let mut codes = Codes::default();
    codes.unite(&[&list, &list]);
    codes
}

#[test]
fn a_line_is_the_one_of_the_contract() {
    let view = View {
        status: Word::from_u32(0x1000_0081),
        errors: codes(&[ErrorCode::amk(3606, 13, 6, 0)]),
        position: 123_480,
        speed_mrpm: 1_499_760,
        ..View::default()
    };
    let expected = concat!(
        r#"{"t_ms":813.0,"axis":1,"source":"crosscheck","status":"0x10000081","torque":false,"path":false,"#,
        r#""errors":["3606/13/6/0"],"position":123480,"speed":1499.8}"#
    );
    assert_eq!(json(Profile::AmkKw, 813_000_000, &view), expected);
}

#[test]
fn codes_are_written_as_their_profile_writes_them() {
    let view = View { errors: codes(&[ErrorCode::single(0x0A9)]), speed_mrpm: -40, ..View::default() };
    let atv = json(Profile::Atv340, 0, &view);
    assert!(atv.contains(r#""status":"0x0000""#) & atv.contains(r#"["SME0A9"]"#), "{atv}");
    assert!(atv.ends_with(r#""speed":0.0}"#), "{atv}");
    assert!(json(Profile::LenzeSm301, 0, &view).contains(r#"["169"]"#));
}

#[test]
fn assigned_words_widen_the_status_and_stay_unrequested() {
    let mut set = AxisSet::delivery(Profile::Etg61002, 1, "SIM-0001");
    set.values.insert(common::CONTROL_WORD + 32, 5);
    set.values.insert(common::STATUS_WORD + 40, 5);
    let words = Words::of(&set);
    assert_eq!(words.status_octets, 6);
    assert_eq!((words.neutral.0[0], words.neutral.0[1]), (0x0F7F_FF7F, 1));
}

#[test]
fn the_summary_closes_the_output() {
    let mut text = String::new();
    line::end_json(&mut text, 900, &Summary { cycles: 901, trips: 2 });
    assert_eq!(text, r#"{"t_ms":900.0,"source":"end","cycles":901,"trips":2}"#);
}

#[test]
fn an_axis_the_parameter_file_does_not_have_is_refused() {
    let axes = vec![AxisSet::delivery(Profile::AmkKw, 1, "SIM-0001")];
    let machine = Machine { file: "set.toml".into(), axes };
    let trace = crate::trace::parse("t_ms,axis\n0,2\n").expect("sound");
    let error = replay(&machine, &trace, ReplayOptions::default(), |_| Ok(()));
    assert!(matches!(error, Err(ReplayError::Axis(2))));
}
