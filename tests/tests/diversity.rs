//! The channels share nothing but `shm-schema` (design 3.1). Fails when they come to
//! share more: a workspace crate, a library for a job that has two, or lines of code.

use std::{
    collections::{BTreeSet, HashMap},
    fs,
    path::{Path, PathBuf},
};

/// Libraries both channels may use: the transport the set has in common, raw kernel
/// constants, and logging outside the cycle.
const COMMON: [&str; 5] = ["shm-schema", "iceoryx2", "libc", "tracing", "tracing-subscriber"];

/// Equal lines in a row that are no coincidence.
const RUN: usize = 6;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the project").to_path_buf()
}

fn dependencies(channel: &str) -> BTreeSet<String> {
    let manifest = fs::read_to_string(root().join(channel).join("Cargo.toml")).expect("a channel");
    let table: toml::Table = manifest.parse().expect("a manifest");
    table["dependencies"].as_table().expect("dependencies").keys().cloned().collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        // The vectors of the documents are the same for everybody.
        let test = path.file_stem().is_some_and(|name| name == "tests" || name == "testing");
        if test {
            continue;
        }
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
    found
}

/// Lines that say something: no comments, imports, attributes, lone punctuation, or bare
/// names (states and codes have the names of the standard in both).
fn lines(path: &Path) -> Vec<String> {
    let text = fs::read_to_string(path).expect("a source file");
    let says = |line: &&str| {
        let plain = !line.starts_with("//") && !line.starts_with("use ") && !line.starts_with('#');
        let bare = line.trim_end_matches(',').chars().all(|c| c.is_alphanumeric() || c == '_');
        plain && !bare && line.chars().filter(|c| c.is_alphanumeric()).count() > 3
    };
    text.lines().map(str::trim).filter(says).map(ToOwned::to_owned).collect()
}

#[test]
fn the_channels_depend_on_different_libraries_for_the_same_job() {
    let (a, b) = (dependencies("channel-a"), dependencies("channel-b"));
    let shared: Vec<_> = a.intersection(&b).filter(|name| !COMMON.contains(&name.as_str())).collect();
    assert!(shared.is_empty(), "both channels use {shared:?}");
    let of_ours = |names: &BTreeSet<String>| {
        names.iter().filter(|n| root().join(n).is_dir()).cloned().collect::<Vec<_>>()
    };
    assert_eq!(of_ours(&a), ["shm-schema"]);
    assert_eq!(of_ours(&b), ["shm-schema"]);
}

#[test]
fn the_channels_have_no_run_of_lines_in_common() {
    let mut known: HashMap<Vec<String>, PathBuf> = HashMap::new();
    for path in sources(&root().join("channel-a/src")) {
        for window in lines(&path).windows(RUN) {
            known.insert(window.to_vec(), path.clone());
        }
    }
    assert!(known.len() > 1_000, "channel A was read");
    for path in sources(&root().join("channel-b/src")) {
        for window in lines(&path).windows(RUN) {
            let twin = known.get(window);
            assert!(
                twin.is_none(),
                "{} and {} share:\n{}",
                twin.unwrap().display(),
                path.display(),
                window.join("\n")
            );
        }
    }
}

#[test]
fn the_channels_are_built_by_different_profiles() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).expect("the workspace");
    let table: toml::Table = manifest.parse().expect("a manifest");
    let packages = &table["profile"]["release"]["package"];
    assert_ne!(packages["channel-a"]["opt-level"], packages["channel-b"]["opt-level"]);
}
