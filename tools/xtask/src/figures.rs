//! `cargo xtask figures [NAME…]`: every figure of the documents, made anew by the release binary. `--check` draws them elsewhere and compares: the step
//! `figures` of `ci` does so with all that take seconds, so that no figure in the documents is older than the program.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use crate::shell;
use crate::steps::Outcome;
use crate::workspace::{FULL, Workspace};

/// Figures of studies: the name below docs/figures and the study that draws it.
const STUDIES: &[(&str, &[&str])] = &[
    ("areas", &["study", "areas"]),
    ("physics", &["study", "physics", "spindle"]),
    ("resolution", &["study", "resolution"]),
    ("sensor-study", &["study", "run", "docs/examples/sensor-study.toml"]),
    ("spray-study", &["study", "run", "docs/examples/spray-study.toml"]),
];
/// Pictures below docs/figures: the file and what draws it, up to the file's name. `pictures` is the name of all. What has letters is SVG: its bytes do not
/// depend on this machine's fonts.
const PICTURES: &[(&str, &[&str])] = &[
    ("row.png", &["orchard", "render", "spindle", "--size", "1200x460", "--colours", "128", "--output"]),
    (
        "winter.png",
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
    ("demo.svg", &["demo", "--picture"]),
    ("demo-spray.svg", &["demo", "--spray", "--picture"]),
    ("scan-depth.svg", &["scan", "spindle", "--picture"]),
    ("scan-class.svg", &["scan", "fruiting_wall", "--colour-by", "class", "--picture"]),
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

/// One figure of the documents.
struct Figure {
    /// What it is asked for by.
    name: String,
    /// From the repository's root.
    file: String,
    /// What draws it, up to the file's name.
    arguments: Vec<String>,
    /// It takes minutes.
    is_study: bool,
}

/// What stands before names to compare instead of drawing.
const CHECK: &str = "--check";

/// Makes the figures named, or all; or compares them.
pub fn command(workspace: &Workspace, arguments: &[String]) -> ExitCode {
    let (flags, names): (Vec<String>, Vec<String>) =
        arguments.iter().cloned().partition(|argument| argument == CHECK);
    let done = match flags.is_empty() {
        true => all(workspace, &names),
        false => build(workspace).and_then(|binary| compare(workspace, &binary, &names)),
    };
    match done {
        Ok(made) => {
            println!("{made}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("xtask figures: {why}");
            ExitCode::FAILURE
        }
    }
}

/// The step of `ci`: every figure that takes seconds is what the program draws now.
pub fn check(workspace: &Workspace) -> Outcome {
    let compared = workspace.built_binary().and_then(|binary| compare(workspace, &binary, &[]));
    Outcome::from_result(compared.map(|told| println!("    {told}")))
}

/// Pictures need what the default leaves out.
fn build(workspace: &Workspace) -> Result<PathBuf, String> {
    shell::run(workspace.cargo(&["build", "--release", "-p", "rowscan"]).args(FULL))?;
    workspace.built_binary()
}

fn all(workspace: &Workspace, wanted: &[String]) -> Result<String, String> {
    let binary = build(workspace)?;
    let figures = wanted_of(workspace, wanted, true)?;
    for figure in &figures {
        draw(workspace, &binary, figure, &figure.file)?;
    }
    Ok(format!("{} figures made; look at each before it is committed", figures.len()))
}

/// Draws figures elsewhere, and names those that differ.
fn compare(workspace: &Workspace, binary: &Path, wanted: &[String]) -> Result<String, String> {
    let folder = workspace.scratch("figures")?;
    let figures = wanted_of(workspace, wanted, !wanted.is_empty())?;
    let mut old = Vec::new();
    for figure in &figures {
        let drawn = folder.join(Path::new(&figure.file).file_name().unwrap_or_default());
        draw(workspace, binary, figure, &drawn.display().to_string())?;
        let read = |path: &Path| fs::read(path).map_err(|error| format!("{}: {error}", path.display()));
        if read(&drawn)? != read(&workspace.root.join(&figure.file))? {
            old.push(format!("{} ({})", figure.file, figure.name));
        }
    }
    match old.is_empty() {
        true => Ok(format!("{} figures are what the program draws", figures.len())),
        false => Err(format!(
            "no longer what the program draws: {}; `cargo xtask figures NAME` makes them anew",
            old.join(", ")
        )),
    }
}

/// The figures of these names; all without any, those of studies if asked for.
fn wanted_of(workspace: &Workspace, wanted: &[String], with_studies: bool) -> Result<Vec<Figure>, String> {
    let is_wanted = |figure: &Figure| match wanted.is_empty() {
        true => with_studies || !figure.is_study,
        false => {
            let is_picture = figure.file.starts_with("docs/figures/") && !figure.is_study;
            wanted.iter().any(|name| *name == figure.name || is_picture && name == "pictures")
        }
    };
    let figures: Vec<Figure> = figures(workspace)?.into_iter().filter(is_wanted).collect();
    if figures.is_empty() { Err(format!("there is no figure {}", wanted.join(", "))) } else { Ok(figures) }
}

/// Every figure there is.
fn figures(workspace: &Workspace) -> Result<Vec<Figure>, String> {
    let owned = |arguments: &[&str]| arguments.iter().map(|argument| (*argument).to_owned()).collect();
    let mut figures = Vec::new();
    for (name, study) in STUDIES {
        let arguments = owned(&[*study, &["--figure"]].concat());
        let file = format!("docs/figures/{name}.svg");
        figures.push(Figure { name: (*name).to_owned(), file, arguments, is_study: true });
    }
    for (file, picture) in PICTURES {
        let name = file.split('.').next().unwrap_or_default().to_owned();
        let (file, arguments) = (format!("docs/figures/{file}"), owned(picture));
        figures.push(Figure { name, file, arguments, is_study: false });
    }
    for name in drawings(workspace)? {
        let file = format!("docs/orchards/{name}.svg");
        let special = DRAWINGS.iter().find(|(drawing, ..)| *drawing == name);
        let (scene, flags) = special.map_or((name.as_str(), &[][..]), |(_, scene, flags)| (*scene, *flags));
        let is_file = |path: &str| workspace.root.join(path).is_file();
        if !is_file(scene) && !is_file(&format!("sim-scenes/scenes/{scene}.toml")) {
            println!("SKIPPED: {file}: there is no scene {scene}");
            continue;
        }
        let cell = if flags.contains(&"--cell") { &[][..] } else { &["--cell", "0.08"] };
        let export = ["orchard", "export", scene, "--trees", "3"];
        let arguments = owned(&[&export[..], cell, flags, &["--svg"]].concat());
        figures.push(Figure { name, file, arguments, is_study: false });
    }
    Ok(figures)
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

fn draw(workspace: &Workspace, binary: &Path, figure: &Figure, file: &str) -> Result<(), String> {
    println!("rowscan {} {file}", figure.arguments.join(" "));
    let mut command = Command::new(binary);
    command.current_dir(&workspace.root).args(&figure.arguments).arg(file);
    shell::run(command.stdout(Stdio::null()).stderr(Stdio::null()))
}
