//! `rowscan study`: many orchards, one report. One file a study.

mod accuracy;
mod areas;
mod budget;
mod calibration;
mod class_args;
mod clumping;
mod confirmed;
mod confirmed_markdown;
mod coverage;
mod estimators;
mod eye;
mod field;
mod keep;
mod merge;
mod orchards;
mod physics;
mod pieces;
mod points;
mod recording;
mod resolution;
pub(super) mod rows;
mod run;
mod search;
mod shards;
mod sides;
mod tell;
mod transfer;

use super::interrupt::Interrupt;
use super::output::say;
use super::{Failure, Outcome};

#[derive(Debug, clap::Subcommand)]
pub(super) enum Command {
    /// The paper's regressions: impacted areas of twenty orchards against their leaf area, from beside and from above
    Areas(areas::Args),
    /// How far apart scan lines may be: I_T at coarser advances against 2 mm
    Resolution(resolution::Args),
    /// A study from a file: keys of a scene or rig swept, outputs kept
    Run(run::Args),
    /// The regressions under many readings of what the paper leaves open, beside its numbers
    Search(search::Args),
    /// Join the shards of a study and report on the whole
    Merge(merge::Args),
    /// Fit a calibration to rows of known leaf area
    Calibration(calibration::Args),
    /// Hold both estimators against rows of known leaf area
    Accuracy(accuracy::Args),
    /// Take every estimator's error apart, term by term
    Budget(budget::Args),
    /// Carry calibrations from class to class: fitted on one, tried on the others
    Transfer(transfer::Args),
    /// Count how often intervals hold the truth, class by class
    Coverage(coverage::Args),
    /// Hold every estimator, and the trees found in the data, against the truth
    Estimators(estimators::Args),
    /// Leaf area through the device's optics: every estimator against the truth, by model and distance
    Eye(eye::Args),
    /// Fit a calibration to pieces of real rows whose leaf area was measured by hand, and plan such a measurement
    Field(field::Args),
    /// Single trees and metres against the truth: how far each is off beside its row, by model, distance and length
    Pieces(pieces::Args),
    /// What a row's own scans say of its clumps: the law fitted, and tried on training systems left out
    Clumping(clumping::Args),
    /// A row from one alley, from the other, and from both as one, against the truth
    Sides(sides::Args),
    /// What each stage of the scanner's eye does to the measures: one at a time and all together, by model and distance
    Physics(physics::Args),
    /// A recording of a scene that stands still beside our model of the device: noise, correlation, edges
    Recording(recording::Args),
}

pub(super) async fn run(command: Command, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    let journal = match &command {
        Command::Areas(args) => args.shards.journal(),
        Command::Resolution(args) => args.shards.journal(),
        Command::Run(args) => args.shards.journal(),
        Command::Search(args) => args.shards.journal(),
        Command::Transfer(args) => args.shards.journal(),
        Command::Coverage(args) => args.shards.journal(),
        Command::Merge(_)
        | Command::Calibration(_)
        | Command::Accuracy(_)
        | Command::Budget(_)
        | Command::Estimators(_)
        | Command::Eye(_)
        | Command::Field(_)
        | Command::Pieces(_)
        | Command::Clumping(_)
        | Command::Sides(_)
        | Command::Physics(_)
        | Command::Recording(_) => None,
    };
    let work = async {
        match command {
            Command::Areas(args) => areas::run(args).await,
            Command::Resolution(args) => resolution::run(args).await,
            Command::Run(args) => run::run(args).await,
            Command::Search(args) => search::run(args).await,
            Command::Merge(args) => merge::run(&args),
            Command::Calibration(args) => calibration::run(args).await,
            Command::Accuracy(args) => accuracy::run(args).await,
            Command::Budget(args) => budget::run(args).await,
            Command::Transfer(args) => transfer::run(args).await,
            Command::Coverage(args) => coverage::run(args).await,
            Command::Estimators(args) => estimators::run(args).await,
            Command::Eye(args) => eye::run(args).await,
            Command::Field(args) => field::run(args).await,
            Command::Pieces(args) => pieces::run(args).await,
            Command::Clumping(args) => clumping::run(args).await,
            Command::Sides(args) => sides::run(args).await,
            Command::Physics(args) => physics::run(args).await,
            Command::Recording(args) => recording::run(args).await,
        }
    };
    let ended = interrupt.finite(work).await;
    if let (Ok(Outcome::Interrupted(_)), Some(journal)) = (&ended, journal.filter(|journal| journal.exists()))
    {
        say(format_args!(
            "interrupted; what is finished stands in {}: go on with --resume",
            journal.display()
        ));
    }
    ended
}
