//! The text contract of `black-channel answer`.

use clap::Parser;

use super::*;

#[derive(Debug, Parser)]
struct Line {
    #[command(flatten)]
    args: AnswerArgs,
}

fn answer_to(options: &str, text: &str) -> Result<String, String> {
    let words = ["answer"].into_iter().chain(options.split_whitespace());
    let line = Line::try_parse_from(words).expect("options");
    let mut out = Vec::new();
    match answer(&line.args, &mut text.as_bytes(), &mut out) {
        Ok(()) => Ok(String::from_utf8(out).expect("text")),
        Err(Stop::Input(line)) => Err(line),
        Err(Stop::Output(error)) => panic!("{error}"),
    }
}

const AMK: &str = "--profile amk-kw --session-id 0x1234 --address 5";

#[test]
fn both_channels_and_the_split_frame_answer_a_reset_alike() {
    // Reset of a master with code 0; check sums by channel A's own reference.
    let reset = "2a 00 00 00 00 00 00 00 00 00 00".replace(' ', "");
    let answers: Vec<_> =
        ["a", "b", "split"].map(|c| answer_to(&format!("{AMK} --channel {c}"), &reset)).into();
    assert_eq!(answers[0], answers[1]);
    assert_eq!(answers[0], answers[2]);
}

#[test]
fn an_image_identical_to_the_last_is_no_event() {
    let frame = "2a00000000000000000000\n";
    let twice = answer_to(AMK, &format!("{frame}{frame}")).expect("answers");
    assert_eq!(twice.lines().nth(1), Some("-"));
}

#[test]
fn text_that_is_no_frame_is_refused_with_its_line() {
    let refused = answer_to(AMK, "\n2a00zz").expect_err("no hexadecimal");
    assert!(refused.starts_with("line 2: expected a frame in hexadecimal"), "{refused}");
    let refused = answer_to(AMK, "2a00").expect_err("too short");
    assert!(refused.starts_with("line 1: expected a frame of this device's length"), "{refused}");
    let refused = answer_to(AMK, "+x").expect_err("no number");
    assert!(refused.contains("whole milliseconds"), "{refused}");
}
