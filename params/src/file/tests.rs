use shm_schema::profile::{Profile, common, etg_key, lenze_key, reference};

use super::*;
use crate::AxisSet;

fn one(text: &str) -> AxisSet {
    let machine = parse(text, "set.toml").unwrap_or_else(|errors| panic!("{}", join(&errors)));
    machine.axes.into_iter().next().expect("one axis")
}

fn join(errors: &[Diagnostic]) -> String {
    let lines: Vec<_> = errors.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

fn errors(text: &str) -> String {
    join(&parse(text, "set.toml").expect_err("the file is wrong"))
}

#[test]
fn an_empty_amk_set_is_the_delivery_state_of_dec_28() {
    let set = one("profile = \"amk-kw\"");
    assert_eq!(set, AxisSet::delivery(Profile::AmkKw, 1, ""));
    assert_eq!((set.value(67), set.value(34), set.value(105)), (1, -1, 7));
}

#[test]
fn every_spelling_of_a_profile_reaches_its_key() {
    let amk = one("profile = \"amk-kw\"\nserial = \"SIM-0001\"\n[parameters]\nPrm67 = 3000\nID33203 = 0");
    assert_eq!((amk.value(67), amk.value(33_203)), (3_000, 0));
    let lenze = one(
        "profile = \"lenze-sm301\"\n[parameters]\nC15320 = 1500\n\"C15330/1\" = 500\nC15113 = 0xFFFFF7FF\n[common]\ncc_factor = 9",
    );
    assert_eq!((lenze.value(lenze_key(15_320, 0)), lenze.value(lenze_key(15_330, 1))), (1_500, 500));
    assert_eq!(lenze.value(lenze_key(15_113, 0)) as u32, 0xFFFF_F7FF);
    assert_eq!(lenze.value(common::CC_FACTOR), 9);
    let atv = one(
        "profile = \"atv340\"\n[parameters]\nSC57 = 50.0\nSC58 = 7\nSC39 = \"SLS Type 2\"\nSC56 = \"1 threshold\"\nSC46 = \"Inactive\"",
    );
    assert_eq!([57, 58, 39, 56, 46].map(|key| atv.value(key)), [500, 70, 2, 1, 0]);
}

/// DEC-40, DEC-51
#[test]
fn generic_keys_may_be_dotted_or_quoted_with_or_without_width() {
    let set = one(
        "profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit = 500\n\"SLS_2.velocity_limit_u16\" = 600\nSLS_1.error_reaction = \"SS1_1\"\nSS1.time_to_sto = 800\nSMS.velocity_maximum_positive_i32 = 3000\n[words]\ncontrol.32 = \"SLS_5\"\n",
    );
    assert_eq!(set.value(etg_key(8, 1, 2)), 500);
    assert_eq!(set.value(etg_key(8, 2, 2)), 600);
    assert_eq!(set.value(etg_key(8, 1, 6)), reference(2, 1));
    assert_eq!(set.value(etg_key(2, 1, 1)), 800);
    assert_eq!(set.value(common::CONTROL_WORD + 32), reference(8, 5));
    // Not said, and still so: a violation leads to STO, a restart needs its acknowledge (DEC-12).
    assert_eq!(set.value(etg_key(8, 2, 6)), reference(1, 1));
    assert_eq!(set.value(etg_key(1, 1, 1)), 1);
}

#[test]
fn all_errors_come_at_once_with_place_and_expectation() {
    let text = "profile = \"amk-kw\"\n[parameters]\nPrm067 = 3000\nPrm3 = \"high\"\nPrm2 = 3000000000\nPrm18 = 70000\n";
    let all = errors(text);
    let lines: Vec<_> = all.lines().collect();
    assert_eq!(lines[0], "set.toml:3:1: unknown parameter Prm067; expected Prm67?");
    assert_eq!(lines[1], "set.toml:4:8: Prm3 cannot be this; expected a number, 0 to 60000 rpm");
    assert_eq!(lines[2], "set.toml:5:8: Prm2 is out of range; expected 0 to 2147483647 Incr");
}

#[test]
fn a_parameter_named_twice_is_refused() {
    assert!(
        errors(
            "profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit = 5\n\"SLS.velocity_limit_u16\" = 5"
        )
        .contains("set.toml:4:1: SLS.velocity_limit_u16 names a parameter again, first in line 3")
    );
    assert!(errors("profile = \"amk-kw\"\n[parameters]\nPrm67 = 1\nPrm67 = 1").contains("set.toml:4:1:"));
}

#[test]
fn a_width_is_checked() {
    assert!(
        errors("profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit_u16 = 70000")
            .contains("an unsigned number of 16 bits")
            || errors("profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit_u16 = 70000")
                .contains("a unsigned number of 16 bits")
    );
    assert!(
        errors("profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit_i16 = 7").contains("u16, u32")
    );
}

/// DEC-31
#[test]
fn a_sign_that_contradicts_its_side_is_refused() {
    assert!(
        errors("profile = \"etg-6100-2\"\n[parameters]\nSMS.velocity_maximum_negative = -500")
            .contains("0 to")
    );
    assert!(
        errors("profile = \"etg-6100-2\"\n[parameters]\nSMA.deceleration_maximum = 500").contains("to 0")
    );
}

/// A reaction that is not configured would be no reaction at all.
#[test]
fn a_reaction_to_a_function_that_nothing_names_is_refused() {
    let all = errors(
        "profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit = 5\nSLS_1.error_reaction = \"SS1_1\"",
    );
    assert!(
        all.starts_with("set.toml:4:7: SLS_1.error_reaction refers to SS1_1, which no parameter names"),
        "{all}"
    );
}

#[test]
fn words_of_an_enumeration_are_suggested() {
    let all = errors("profile = \"atv340\"\n[parameters]\nSC39 = \"SLS type 2\"\nSC57 = 50.05\nSC49 = 3.0");
    assert!(all.contains("\"SLS Type 2\"?"), "{all}");
    assert!(all.contains("at most one decimal place"), "{all}");
    assert!(all.contains("the value of SC48"), "{all}");
}

#[test]
fn several_axes_have_numbers_and_profiles_of_their_own() {
    let text = "[[axis]]\nnumber = 2\nprofile = \"atv340\"\n[axis.parameters]\nSC02 = 2\n[[axis]]\nnumber = 1\nprofile = \"amk-kw\"\nserial = \"A\"\n";
    let machine = parse(text, "m.toml").expect("right");
    let axes: Vec<_> = machine.axes.iter().map(|axis| (axis.number, axis.profile)).collect();
    assert_eq!(axes, [(1, Profile::AmkKw), (2, Profile::Atv340)]);
    assert!(errors(&text.replace("number = 2", "number = 1")).contains("used twice"));
    assert!(errors(&text.replace("number = 2", "number = 65")).contains("1 to 64"));
}

#[test]
fn text_that_is_no_toml_says_where() {
    assert!(errors("profile = \"amk-kw\"\n[parameters\n").starts_with("set.toml:2:"));
    assert!(errors("").contains("no profile is named"));
}

/// Whatever a file holds, reading it answers; it never ends the program.
#[test]
fn no_damaged_file_ends_the_reader() {
    let texts = crate::definition::PROFILES.map(|profile| crate::create::new_file(profile, "SIM-0001"));
    let short = "profile = \"etg-6100-2\"\n[parameters]\nSLS_1.velocity_limit_u16 = 5\n\"SS1_2.time_to_sto\" = 7\n[words]\ncontrol.32 = \"SLS_5\"\n";
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for round in 0..300 {
        let text = if round < 20 { &texts[round % texts.len()] } else { short };
        let mut octets = text.as_bytes().to_vec();
        for _ in 0..=random(3) {
            let at = random(octets.len());
            octets[at] = [b'.', b'_', b'"', b'=', b'[', b'9', b'-', b'\n', 0xC3, b'e'][random(10)];
        }
        let text = String::from_utf8_lossy(&octets);
        let report = crate::check(&text, "x");
        assert_eq!(report.diagnostics.is_empty(), parse(&text, "x").is_ok());
    }
}
