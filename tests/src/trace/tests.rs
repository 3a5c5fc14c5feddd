//! The trace judged, and what it says of this project.

use super::*;

#[test]
fn ids_are_found_alone_in_ranges_and_in_lists() {
    let found = |line: &str| ids::in_line(line);
    assert_eq!(found("/// AMK-SLS-04, DEC-05."), ["AMK-SLS-04", "DEC-05"]);
    assert_eq!(found("(AMK-SEM-04 to 06)"), ["AMK-SEM-04", "AMK-SEM-05", "AMK-SEM-06"]);
    assert_eq!(found("ATV-SMS-03, 04, 08 and 10."), ["ATV-SMS-03", "ATV-SMS-04", "ATV-SMS-08", "ATV-SMS-10"]);
    assert_eq!(found("DEC-02 to DEC-07"), ["DEC-02", "DEC-07"]);
    // One letter may follow, two may not.
    let split = format!("LNZ-SS1-03{}", "A");
    assert_eq!(found(&format!("{split} x-DEC-1 AMK-EX-SS1-1 {split}b")), [split]);
    assert_eq!(found("DEC-21, 120 ms"), ["DEC-21"]);
}

#[test]
fn what_follows_the_test_mark_is_a_test() {
    let text = "// DEC-01\n#[cfg(test)]\nmod tests { // DEC-02\n}";
    let found = cited::in_file("channel/src/lib.rs", text);
    assert!(found.contains(&("DEC-01".to_string(), Role::Code)));
    assert!(found.contains(&("DEC-02".to_string(), Role::Test)));
    assert!(cited::in_file("a/tests/b.rs", text).contains(&("DEC-01".to_string(), Role::Test)));
    assert!(cited::in_file("docs/b.md", "DEC-01").contains(&("DEC-01".to_string(), Role::Document)));
}

#[test]
fn the_catalogues_give_every_requirement_and_decision_once() {
    let (requirements, known) = catalogue::read();
    let ids: BTreeSet<&str> = requirements.iter().map(|one| one.id.as_str()).collect();
    assert_eq!(ids.len(), requirements.len());
    assert!(ids.contains("DEC-01") && ids.contains("DEC-52") && ids.contains("AMK-SLS-04"));
    assert!(known.contains("AMKP-PLAUS-004"));
    assert!(requirements.iter().any(|one| !one.is_for_software()));
}

#[test]
fn every_rule_of_the_classes_is_about_some_requirement() {
    let (requirements, _) = catalogue::read();
    for rule in catalogue::rules() {
        let holds = requirements.iter().any(|one| rule.holds_for(&one.id, &one.kind));
        assert!(holds, "no requirement begins with {}", rule.prefix);
    }
}

/// Design 12: a new gap fails the build.
#[test]
fn no_requirement_has_lost_its_test() {
    let root = root();
    let accepted = baseline(&root);
    let trace = Trace::read(&root);
    let new: Vec<String> =
        trace.gaps().iter().map(Gap::to_string).filter(|gap| !accepted.contains(gap)).collect();
    assert!(
        new.is_empty(),
        "new gaps; close them, or accept them with `cargo run -p system-tests --bin trace -- --accept`:\n{}",
        new.join("\n")
    );
}
