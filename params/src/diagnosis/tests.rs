use super::*;

fn one(code: &str) -> Explanation {
    let mut found = explain(code);
    assert_eq!(found.len(), 1, "{code}");
    found.remove(0)
}

/// DEC-45
#[test]
fn a_code_of_the_replay_is_put_into_words() {
    let explanation = one("3606/13/6/0");
    assert_eq!(explanation.profile, "amk-kw");
    assert_eq!(explanation.class, "Error");
    assert!(explanation.reaction.contains("STO"));
    let meanings: Vec<_> = explanation.infos.iter().map(|info| info.meaning.as_str()).collect();
    assert!(
        meanings.iter().any(|meaning| meaning.contains("speed") || meaning.contains("velocity")),
        "{meanings:?}"
    );
    assert!(!explanation.remedy.is_empty());
}

#[test]
fn fields_may_be_left_out_from_the_right() {
    assert!(explain("3605").len() > 10);
    assert!(one("3605/7").infos.len() >= 2);
    assert_eq!(one("3605/7/1").infos.len(), 1);
}

/// AMKP-PLAUS-003: the fields carry the compared values.
#[test]
fn a_field_that_carries_a_value_is_explained_as_such() {
    let infos = one("3605/200/1024/2048").infos;
    assert_eq!(infos[0].meaning, "value of ID32776");
    assert_eq!((infos[0].value.as_str(), infos[1].value.as_str()), ("1024", "2048"));
}

#[test]
fn the_other_profiles_answer_to_their_own_codes() {
    assert_eq!(one("SME152").profile, "atv340");
    assert_eq!(one("sme0a9").code, "SME0A9");
    assert_eq!(one("SLS-E1").profile, "etg-6100-2");
    assert_eq!(one("167").title, "Parameter set - plausibility error");
    assert_eq!(one("0xA7").code, "167");
}

#[test]
fn an_unknown_code_has_no_explanation() {
    for code in ["", "3606/255", "SMEFFF", "9999", "x/y"] {
        assert!(explain(code).is_empty(), "{code}");
    }
}

#[test]
fn every_code_of_every_profile_says_reaction_and_remedy() {
    for profile in crate::definition::PROFILES {
        let all = all(profile);
        assert!(all.len() > 20, "{}", profile.name());
        for explanation in all {
            assert!(!explanation.reaction.is_empty(), "{}", explanation.code);
            assert!(!explanation.remedy.is_empty(), "{}", explanation.code);
        }
    }
}

#[test]
fn an_unknown_code_finds_the_ones_that_were_probably_meant() {
    assert_eq!(nearest("SME0A8").len(), 3);
    assert!(nearest("SLS-E3").contains(&"SLS-E1".to_string()));
    assert!(nearest("3606/12/6").iter().all(|code| code.starts_with("3606/")), "{:?}", nearest("3606/12/6"));
    assert!(nearest("1677").contains(&"167".to_string()));
}

#[test]
fn a_field_without_a_catalogued_meaning_says_so() {
    let infos = one("3606/13/99").infos;
    assert_eq!(infos.len(), 1);
    assert!(infos[0].meaning.contains("no meaning"), "{}", infos[0].meaning);
}

/// Every code of every catalogue is found by its own name.
#[test]
fn every_catalogued_code_is_explained() {
    for profile in crate::definition::PROFILES {
        for known in all(profile) {
            let found = explain(&known.code);
            assert!(
                found.iter().any(|found| found.profile == profile.name() && found.code == known.code),
                "{} {}",
                profile.name(),
                known.code
            );
        }
    }
}
