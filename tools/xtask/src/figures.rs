//! `cargo xtask figures [NAME…]`: every figure of the documents, made anew by the release binary.

use std::fs;
use std::path::Path;
use std::process::{Command, ExitCode};

use crate::shell;
use crate::workspace::{FULL, Workspace};

/// Figures of studies: the name below docs/figures and the study that draws it.
const STUDIES: &[(&str, &[&str])] = &[
    ("areas", &["study", "areas"]),
    ("physics", &["study", "physics", "spindle"]),
    ("resolution", &["study", "resolution"]),
    ("sensor-study", &["study", "run", "docs/examples/sensor-study.toml"]),
];
/// Pictures below docs/figures, as PNG: the name and what draws it, up to the file. `pictures` is the name of all.
const PICTURES: &[(&str, &[&str])] = &[
    ("row", &["orchard", "render", "spindle", "--size", "1200x460", "--colours", "128", "--output"]),
    (
        "winter",
        &[
            "orchard",
            "render",
            "vase",
            "--season",
            "dormant",
            "--size",
            "900x420",
            "--colours",
            "64",
            "--output",
        ],
    ),
    ("demo", &["demo", "--picture"]),
    ("scan-depth", &["scan", "spindle", "--picture"]),
    ("scan-class", &["scan", "fruiting_wall", "--colour-by", "class", "--picture"]),
];
/// A drawing below docs/orchards that is not of a built-in scene alone: its name, its scene, its further flags.
const DRAWINGS: &[(&str, &str, &[&str])] = &[
    ("spindle-scan", "spindle", &["--scan", "lateral"]),
    ("spindle-dormant", "spindle", &["--season", "dormant"]),
    ("spindle-unfolding", "spindle", &["--season", "unfolding"]),
    ("spindle-bloom", "spindle", &["--season", "bloom"]),
    ("spindle-fruit_set", "spindle", &["--season", "fruit_set"]),
    ("spindle-leaf_fall", "spindle", &["--season", "leaf_fall"]),
    ("alley", "docs/orchards/alley.toml", &["--cell", "0.04"]),
    ("vase", "vase", &["--cell", "0.12"]),
];

/// Makes the figures named, or all.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    match all(workspace, arguments) {
        Ok(made) => {
            println!("{made} figures made; look at each before it is committed");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("xtask figures: {why}");
            ExitCode::FAILURE
        }
    }
}

fn all(workspace: &Workspace, wanted: &[String]) -> Result<usize, String> {
    // Pictures need what the default leaves out.
    shell::run(workspace.cargo(&["build", "--release", "-p", "rowscan"]).args(FULL))?;
    let binary = workspace.built_binary()?;
    let is_named = |name: &str| wanted.iter().any(|other| other == name);
    let is_wanted = |name: &str| wanted.is_empty() || is_named(name);
    let mut made = 0;
    for (name, study) in STUDIES.iter().filter(|(name, _)| is_wanted(name)) {
        let file = format!("docs/figures/{name}.svg");
        draw(workspace, &binary, &[*study, &["--figure", &file][..]].concat())?;
        made += 1;
    }
    for (name, picture) in PICTURES.iter().filter(|(name, _)| is_wanted(name) || is_named("pictures")) {
        let file = format!("docs/figures/{name}.png");
        draw(workspace, &binary, &[*picture, &[file.as_str()][..]].concat())?;
        made += 1;
    }
    for name in drawings(workspace)?.iter().filter(|name| is_wanted(name)) {
        let file = format!("docs/orchards/{name}.svg");
        let special = DRAWINGS.iter().find(|(drawing, ..)| drawing == name);
        let (scene, flags) = special.map_or((name.as_str(), &[][..]), |(_, scene, flags)| (*scene, *flags));
        let is_file = |path: &str| workspace.root.join(path).is_file();
        if !is_file(scene) && !is_file(&format!("sim-scenes/scenes/{scene}.toml")) {
            println!("SKIPPED: {file}: there is no scene {scene}");
            continue;
        }
        let export = ["orchard", "export", scene, "--trees", "3", "--svg", &file];
        let cell = if flags.contains(&"--cell") { &[][..] } else { &["--cell", "0.08"] };
        draw(workspace, &binary, &[&export[..], cell, flags].concat())?;
        made += 1;
    }
    if made == 0 { Err(format!("there is no figure {}", wanted.join(", "))) } else { Ok(made) }
}

/// The drawings of orchards that the documents have or should have, by name.
fn drawings(workspace: &Workspace) -> Result<Vec<String>, String> {
    let folder = workspace.root.join("docs").join("orchards");
    let entries = fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let paths = entries.filter_map(Result::ok).map(|entry| entry.path());
    let drawn = paths.filter(|path| path.extension().is_some_and(|extension| extension == "svg"));
    let named = DRAWINGS.iter().map(|(name, ..)| (*name).to_owned());
    let mut names: Vec<String> =
        drawn.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned())).chain(named).collect();
    names.sort();
    names.dedup();
    Ok(names)
}

fn draw(workspace: &Workspace, binary: &Path, arguments: &[&str]) -> Result<(), String> {
    println!("rowscan {}", arguments.join(" "));
    shell::run(
        Command::new(binary).current_dir(&workspace.root).args(arguments).stdout(std::process::Stdio::null()),
    )
}
