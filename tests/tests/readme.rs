//! What the README says can be done, can be done.

#[path = "live/programs.rs"]
mod programs;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("inside the project").to_path_buf()
}

fn readme() -> String {
    fs::read_to_string(root().join("README.md")).expect("a README")
}

/// The lines of every fenced `sh` block.
fn commands(text: &str) -> Vec<String> {
    let blocks = text.split("```sh\n").skip(1);
    let inside = blocks.flat_map(|block| block.split("```").next().unwrap_or("").lines());
    inside.map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect()
}

/// The text between each pair of backticks.
fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// The tasks of xtask, as its table lists them.
fn tasks() -> Vec<String> {
    let source = fs::read_to_string(root().join("xtask/src/main.rs")).expect("xtask");
    let (_, behind) = source.split_once("const TASKS").expect("the table of tasks");
    let (table, _) = behind.split_once("];").expect("the end of the table");
    let names = table.lines().filter_map(|line| line.trim().strip_prefix("(\"")?.split('"').next());
    names.map(ToOwned::to_owned).collect()
}

fn task_of(command: &str) -> Option<&str> {
    command.strip_prefix("cargo xtask ")?.split_whitespace().next()
}

#[test]
fn every_command_block_is_a_task_that_continuous_integration_runs_too() {
    let tasks = tasks();
    let commands = commands(&readme());
    assert!(!commands.is_empty(), "the README shows how to see it work");
    for command in commands {
        let task = task_of(&command).unwrap_or_else(|| panic!("{command:?} is no task of xtask"));
        assert!(tasks.iter().any(|known| known == task), "{command:?}: xtask has {tasks:?}");
    }
}

#[test]
fn every_task_named_in_the_text_exists() {
    let text = readme();
    let tasks = tasks();
    for task in quoted(&text.replace("```", "")).into_iter().filter_map(task_of) {
        assert!(tasks.iter().any(|known| known == task), "cargo xtask {task}: xtask has {tasks:?}");
    }
}

#[test]
fn every_command_of_the_table_has_help() {
    let text = readme();
    let rows = text.lines().filter(|line| line.starts_with("| `safepair "));
    let mut found = 0;
    for row in rows {
        let command = quoted(row)[0];
        // Subcommands are small letters; what follows is an option or a place for one.
        let is_word = |word: &&str| word.chars().all(|c| c.is_ascii_lowercase() || c == '-');
        let words = command.split_whitespace().skip(1).take_while(|word| !word.starts_with('-'));
        let words: Vec<&str> = words.take_while(is_word).collect();
        let output = Command::new(programs::safepair()).args(&words).arg("--help").output();
        let status = output.expect("safepair starts").status;
        assert!(status.success(), "{command}: safepair {} --help ended with {status}", words.join(" "));
        found += 1;
    }
    assert!(found > 0, "the README lists the commands");
}

#[test]
fn every_folder_and_link_of_the_readme_exists() {
    let text = readme();
    let folders = text.lines().filter(|line| line.starts_with("| `")).flat_map(quoted);
    let folders = folders.filter(|name| name.ends_with('/'));
    let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let links = links.filter(|link| !link.contains("://"));
    for name in folders.chain(links) {
        assert!(root().join(name).exists(), "{name}: named in the README, not in the project");
    }
}
