//! Completions and the manual: every command has its page, and every shell its script.

use crate::common;

use common::binary::{refused, run, text};

#[test]
fn every_command_is_completed_and_has_a_page() {
    let folder = tempfile::tempdir().expect("a folder");
    let pages = folder.path().join("man");
    assert_eq!(run(&["man", text(&pages)]).code, Some(0));
    let scripts = ["bash", "zsh", "fish"].map(|shell| run(&["completions", shell]).stdout);
    let command = rowscan::cli::command();
    let commands: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
    assert!(commands.len() > 15, "{commands:?}");
    for name in commands {
        assert!(pages.join(format!("rowscan-{name}.1")).is_file(), "no page of {name}");
        assert!(scripts.iter().all(|script| script.contains(name)), "{name} is not completed");
    }
    let emulate = std::fs::read_to_string(pages.join("rowscan-emulate.1")).expect("there");
    assert!(emulate.contains("\\-\\-time\\-scale"), "flags stand in the page");
    assert!(refused(&["completions", "tcsh"]).contains("possible values"));
}
