use super::*;

fn amk(lines: &str) -> Report {
    check(&format!("profile = \"amk-kw\"\n[parameters]\n{lines}"), "set.toml")
}

fn rules(report: &Report) -> Vec<&str> {
    let errors = report.findings.iter().filter(|finding| finding.severity == Severity::Error);
    errors.map(|finding| finding.rule.trim_start_matches("AMKP-PLAUS-")).collect()
}

/// DEC-28: the delivery state passes every rule.
#[test]
fn the_delivery_state_of_amk_passes_without_a_warning() {
    let report = amk("");
    assert!(report.findings.is_empty(), "{:#?}", report.findings);
    assert!(report.passed());
}

/// AMKP-PLAUS-001: one row, its code, its line and a remedy.
#[test]
fn a_broken_row_tells_code_line_and_remedy() {
    let report = amk("Prm67 = 3000\nPrm6 = 15\nID32776 = 15");
    let first = &report.findings[0];
    assert_eq!(
        (first.rule.as_str(), first.code.as_str(), first.channel.as_str()),
        ("AMKP-PLAUS-001", "3605/7/1/0", "a")
    );
    assert_eq!((first.position.line, first.position.column), (4, 1));
    assert_eq!(first.params[0], Named { name: "Prm6".into(), value: "15".into() });
    assert!(first.remedy.contains("Prm6"));
}

/// AMKP-PLAUS-003, DEC-46: the compared values stand in the code.
#[test]
fn the_encoder_row_carries_both_values() {
    assert!(rules(&amk("Prm6 = 2048")).is_empty(), "nothing to compare with");
    let report = amk("Prm6 = 2048\nID32776 = 1024");
    assert_eq!(rules(&report), ["003"]);
    assert_eq!(report.findings[0].code, "3605/200/1024/2048");
    assert!(rules(&amk("Prm6 = 2048\nID32776 = 1024\nPrm4 = 0\nPrm5 = 0")).is_empty());
}

/// AMKP-EX-ASSIGN
#[test]
fn assignments_of_the_inputs_follow_the_example() {
    let of = |a: i32, b: i32, c: i32| amk(&format!("Prm15 = {a}\nPrm16 = {b}\nPrm17 = {c}"));
    assert!(rules(&of(16, 16, 0)).is_empty());
    assert_eq!(rules(&of(3, 3, 0)), ["043", "049"]);
    assert!(rules(&of(4, 12, 1)).is_empty());
    assert_eq!(rules(&of(5, 9, 3)), ["038", "044"]);
}

/// AMKP-EX-PULSE-RATIO, AMKP-EX-PULSE-OUT-GRID
#[test]
fn pulses_of_the_outputs_follow_the_examples() {
    let of = |pulse: i32, period: i32| {
        amk(&format!("Prm88 = {pulse}\nPrm89 = {period}\nPrm90 = {pulse}\nPrm91 = {period}"))
    };
    assert!(rules(&of(5_000, 50)).is_empty());
    assert_eq!(rules(&of(5_125, 50)), ["064", "084"]);
    assert!(rules(&of(625, 50)).is_empty());
    assert_eq!(rules(&of(600, 50)), ["063", "083"]);
}

/// DEC-52
#[test]
fn a_ramp_is_refused_below_one_and_above_ten_million_rpm_per_second() {
    assert!(rules(&amk("Prm67 = 65\nPrm3 = 22\nPrm20 = 65000")).is_empty());
    assert_eq!(rules(&amk("Prm67 = 65\nPrm3 = 22\nPrm20 = 65001")), ["114", "115", "116", "117"]);
    assert!(rules(&amk("Prm67 = 10000\nPrm3 = 1015\nPrm2 = 1050\nPrm20 = 1")).is_empty());
    assert_eq!(rules(&amk("Prm67 = 10001\nPrm20 = 1")), ["116", "117"]);
    assert_eq!(rules(&amk("Prm20 = 0")), ["113"]);
}

/// DEC-46: where one wrong value breaks several rows, all are reported; such a value still
/// makes an image, because the channels answer it with its code.
#[test]
fn a_speed_beyond_every_range_breaks_all_its_rows_and_still_compiles() {
    let report = amk("Prm67 = 60001");
    assert_eq!(rules(&report).len(), 14, "{:?}", rules(&report));
    assert!(report.diagnostics.is_empty());
    assert!(crate::parse("profile = \"amk-kw\"\n[parameters]\nPrm67 = 60001", "x").is_ok());
}

#[test]
fn a_value_outside_its_range_without_a_row_is_refused() {
    assert!(!amk("Prm9 = 0").diagnostics.is_empty());
    assert!(amk("Prm9 = 60001").diagnostics.is_empty());
    assert!(!amk("Prm4 = 2").diagnostics.is_empty());
    assert!(!amk("Prm67 = 3000000000").diagnostics.is_empty());
    assert!(rules(&amk("Prm67 = 3000000000")).contains(&"197"));
}

/// AMKP-EX-PRM2, AMKP-EX-PRM3
#[test]
fn recommendations_are_warnings() {
    let warned =
        |lines: &str| amk(lines).findings.iter().map(|finding| finding.rule.clone()).collect::<Vec<_>>();
    assert!(warned("Prm67 = 4000\nPrm2 = 450\nPrm3 = 415").is_empty());
    assert_eq!(warned("Prm67 = 4000\nPrm2 = 449\nPrm3 = 414"), ["AMKP-EX-PRM2", "AMKP-EX-PRM3"]);
    let report = amk("Prm67 = 4000");
    assert!(report.passed());
}

fn other(profile: &str, lines: &str) -> Vec<String> {
    let report = check(&format!("profile = \"{profile}\"\n[parameters]\n{lines}"), "set.toml");
    assert!(report.diagnostics.is_empty(), "{:?}", report.diagnostics);
    let errors = report.findings.into_iter().filter(|finding| finding.severity == Severity::Error);
    errors.map(|finding| finding.rule).collect()
}

/// LNZ-SPD-10, LNZ-OMS-19, LNZ-ES-02, LNZ-CAS-09, LNZ-CAS-10
#[test]
fn lenze_sets_are_judged_by_the_module_s_plausibility() {
    assert!(other("lenze-sm301", "").is_empty());
    assert!(other("lenze-sm301", "C15400 = 0").contains(&"LNZ-SPD-10".into()));
    assert!(other("lenze-sm301", "\"C15030/1\" = 1\n\"C15031/1\" = 2").contains(&"LNZ-OMS-19".into()));
    assert!(
        !other("lenze-sm301", "\"C15030/1\" = 1\n\"C15031/1\" = 2\nC15113 = 0xFFFFF7FF")
            .contains(&"LNZ-OMS-19".into())
    );
    assert!(other("lenze-sm301", "C15035 = 4").contains(&"LNZ-CAS-09".into()));
}

/// ATV-SS1-20, ATV-SLS-04, ATV-SMS-05
#[test]
fn atv_sets_are_judged_by_type_and_mode() {
    assert!(other("atv340", "").is_empty());
    let base = "SC01 = \"Asynchronous Motor\"\nSC02 = 2\nSC05 = \"No encoder used\"\nSC66 = \"Safety function used via fieldbus\"\nSC40 = 10.0\nSC48 = 20.0\nSC50 = 10.0\n";
    assert!(other("atv340", &format!("{base}SC39 = \"SLS Type 2\"")).is_empty());
    assert_eq!(other("atv340", &format!("{base}SC39 = \"SLS Type 3\"")), ["ATV-SS1-20"]);
    assert_eq!(
        other(
            "atv340",
            &format!("{base}SC39 = \"SLS Type 4\"\nSC56 = \"1 threshold\"\nSC57 = 15.0\nSC58 = 30.0")
        ),
        ["ATV-SLS-04"]
    );
    assert_eq!(
        other(
            "atv340",
            "SC01 = \"Asynchronous Motor\"\nSC02 = 2\nSC05 = \"No encoder used\"\nSC56 = \"2 thresholds\"\nSC57 = 15.0\nSC58 = 30.0\nSC59 = 20.0"
        ),
        ["ATV-SMS-05"]
    );
}

/// ETG-GEN-04, ETG-SS2-02
#[test]
fn generic_sets_are_judged_by_their_objects_conditions() {
    assert!(other("etg-6100-2", "").is_empty());
    assert_eq!(other("etg-6100-2", "SS1_1.velocity_zero_window = 5"), ["ETG-GEN-04"]);
    assert!(other("etg-6100-2", "SS1_1.time_to_sto = 800").is_empty());
    assert_eq!(other("etg-6100-2", "SS2_1.time_to_sos = 800"), ["ETG-SS2-02"]);
    assert_eq!(
        other("etg-6100-2", "SSR_1.velocity_upper_limit = 5\nSSR_1.velocity_lower_limit = 6"),
        ["DEC-31"]
    );
    assert_eq!(
        other("etg-6100-2", "SLS_1.velocity_limit = 5\nSLS_1.error_reaction = \"SLS_1\""),
        ["ETG-GEN-04"]
    );
}

/// A set that is no file any more is judged alike.
#[test]
fn a_set_is_judged_like_its_file() {
    for profile in definition::PROFILES {
        let set = AxisSet::delivery(profile, 1, "S");
        let file = check(&format!("profile = \"{}\"", profile.name()), "");
        assert_eq!(check_set(&set), file.findings, "{}", profile.name());
    }
}
