//! `rowscan-benches NAME [--format json]`: one bench, one line a case.

use std::process::ExitCode;

use rowscan_benches::measure::Report;
use rowscan_benches::{
    beside, caster, codec, fleet, hectare, lockstep, lockstep_reader, optics, proxy, replay, shady, sprayer,
    web,
};

/// A bench: its name and what runs it with the arguments after it.
type Bench = (&'static str, fn(&mut Report, &[String]));

const BENCHES: &[Bench] = &[
    ("caster", caster::run),
    ("codec", codec::run),
    ("fleet", fleet::run),
    ("hectare", hectare::run),
    ("lockstep", lockstep::run),
    ("optics", optics::run),
    ("proxy", proxy::run),
    ("replay", replay::run),
    ("shady", shady::run),
    ("sprayer", sprayer::run),
    ("web", web::run),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let wanted = arguments.first().map(String::as_str);
    if wanted == Some(lockstep_reader::NAME) {
        lockstep_reader::run(&arguments[1..]);
        return ExitCode::SUCCESS;
    }
    if wanted == Some(beside::NAME) {
        return match beside::run(&arguments[1..]) {
            Ok(()) => ExitCode::SUCCESS,
            Err(why) => {
                eprintln!("rowscan-benches beside: {why}");
                ExitCode::FAILURE
            }
        };
    }
    let Some((_, run)) = BENCHES.iter().find(|(name, _)| Some(*name) == wanted) else {
        let names: Vec<&str> = BENCHES.iter().map(|(name, _)| *name).collect();
        eprintln!("usage: rowscan-benches NAME [--format json]; benches: {}", names.join(", "));
        return ExitCode::from(2);
    };
    let json = arguments.windows(2).any(|pair| pair[0] == "--format" && pair[1] == "json");
    run(&mut Report::new(json), &arguments[1..]);
    ExitCode::SUCCESS
}
