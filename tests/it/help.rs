//! The end of every command's help: two examples that the parser takes, and a page that is there; and what shells complete.

use std::collections::BTreeSet;
use std::path::Path;

use clap::Command;
use rowscan::cli::{command, examples::EXAMPLES};

/// Commands that have none below them, by their words.
fn leaves(command: &Command, words: &str, found: &mut BTreeSet<String>) {
    if command.get_subcommands().next().is_none() {
        found.insert(words.to_owned());
    }
    for inner in command.get_subcommands() {
        leaves(inner, format!("{words} {}", inner.get_name()).trim(), found);
    }
}

#[test]
fn every_command_has_two_examples_that_parse_and_a_page() {
    let mut found = BTreeSet::new();
    leaves(&command(), "", &mut found);
    let told: BTreeSet<String> = EXAMPLES.iter().map(|of| of.words.to_owned()).collect();
    assert_eq!((found, told.len()), (told, EXAMPLES.len()), "each command once");
    for of in EXAMPLES {
        let page = format!("docs/{}.md", of.page);
        assert!(Path::new(env!("CARGO_MANIFEST_DIR")).join(&page).is_file(), "{}: no {page}", of.words);
        assert_ne!(of.lines[0], of.lines[1], "{}", of.words);
        for line in of.lines {
            assert!(line.starts_with(&format!("rowscan {}", of.words)), "{line}");
            // What stands behind `>` is the shell's.
            let words = line.split(" > ").next().expect("a command").split(' ');
            if let Err(why) = command().try_get_matches_from(words) {
                panic!("{line}: {why}");
            }
        }
    }
}

/// Every command's help, short and long, with the commands that only have others below them.
fn helps(command: &mut Command, found: &mut Vec<(String, [String; 2])>) {
    // The parser's own, which tells of the others.
    if command.get_name() == "help" {
        return;
    }
    let help = [command.render_help().to_string(), command.render_long_help().to_string()];
    found.push((command.get_name().to_owned(), help));
    command.get_subcommands_mut().for_each(|inner| helps(inner, found));
}

#[test]
fn every_help_ends_with_examples_and_a_page() {
    let mut found = Vec::new();
    helps(&mut command(), &mut found);
    assert!(found.len() > EXAMPLES.len() + 4, "{}", found.len());
    for (name, helps) in found {
        for help in helps {
            let (_, end) = help.split_once("\nExamples:\n").unwrap_or_else(|| panic!("{name}: {help}"));
            assert_eq!(end.lines().filter(|line| line.starts_with("  rowscan ")).count(), 2, "{name}: {end}");
            assert!(end.trim_end().ends_with(".md"), "{name}: {end}");
        }
    }
}

/// Arguments that take a model's name, by command.
fn models_taken(command: &Command, found: &mut Vec<(String, usize)>) {
    for argument in command.get_arguments().filter(|argument| argument.get_long() == Some("model")) {
        found.push((command.get_name().to_owned(), argument.get_possible_values().len()));
    }
    command.get_subcommands().for_each(|inner| models_taken(inner, found));
}

#[test]
fn every_flag_that_takes_a_model_is_completed_by_the_models() {
    let models = rowscan_protocol::model::AnyModel::all().count();
    let mut found = Vec::new();
    models_taken(&command(), &mut found);
    assert!(found.len() > 8, "{found:?}");
    for (name, values) in found {
        assert_eq!(values, models, "{name} --model");
    }
}
