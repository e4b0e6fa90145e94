//! The command line: one file a subcommand.

mod blocking;
mod bus;
mod check;
mod check_jobs;
mod check_page;
mod client_limits;
mod completions;
mod control;
mod datagrams;
mod decode;
mod demo;
mod device;
mod emulate;
mod ending;
mod endpoint;
mod estimate;
mod estimators;
mod event_format;
mod events;
pub mod examples;
mod export;
mod faulting;
mod faults;
mod grid;
mod interrupt;
mod line;
mod link_events;
mod link_options;
mod lockstep;
mod models;
mod named;
mod orchard;
mod output;
mod page_args;
mod pictured;
mod progress;
mod proxy;
mod record;
mod recorded_speed;
mod recorded_stream;
mod recorder;
mod recording_file;
mod repair;
mod replay;
mod scan;
mod scene;
mod schema;
mod score;
mod sensor;
mod service;
mod spray;
mod spray_demo;
mod stream_states;
mod study;
mod table_file;
mod tractor_outputs;
mod truth_file;
mod user_files;
mod warnings;
mod web;

use std::ffi::OsString;
use std::io;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};

use rowscan_driver::DriverError;
use rowscan_files::{KeptApart, missing_file, remove_leftovers};
use rowscan_protocol::plural::plural;
use rowscan_recording::ReadError;
use rowscan_study::calibrations::ConfigError;

use crate::reference::Document;
use interrupt::Interrupt;
use output::say;

/// A virtual SICK LMS laser scanner in a virtual orchard, and the driver and canopy estimator that cannot tell it from the real thing.
#[derive(Debug, Parser)]
#[command(name = "rowscan", version, propagate_version = true, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Emulator, driver and estimate over loopback TCP on a built-in row; ends with the estimate beside the truth
    Demo(demo::Args),
    /// Be a scanner that drives past an orchard
    Emulate(Box<emulate::Args>),
    /// Run scenarios against a controller and judge what it does: a test bench for CI; exit code 0 passed, 1 failed, 2 not judged
    Check(check::Args),
    /// How well a run of a sprayer that `check --keep` kept fits the leaves, beside the best that its boom can do
    Score(score::Args),
    /// Be the reference controller of a sprayer: scans of live scanners in, duties of sections out on the CAN bus
    Spray(spray::Args),
    /// Estimate leaf area from a live scanner or a recording
    #[command(after_long_help = estimators::list())]
    Estimate(estimate::Args),
    /// Look at scanners, or a recording, on a live page: `estimate --web 127.0.0.1:8080 --wait`, recordings at the pace they had
    Watch(estimate::Args),
    /// Grow orchards and measure what is really there
    #[command(subcommand)]
    Orchard(orchard::Command),
    /// Scan a row offline in one of the paper's six ways: areas, matrix L, labelled points
    Scan(scan::Args),
    /// Studies over many orchards
    #[command(subcommand)]
    Study(study::Command),
    /// Keep the bytes of live scanners, both ways, in one MCAP file; convert, repair and describe recordings
    Record(record::Args),
    /// Be the scanner that a recording was made with: it answers, and streams on time
    Replay(replay::Args),
    /// Scans, points or shots of a recording as CSV, PLY, LAS, NPY, Parquet or AMAPVox's text
    Export(export::Args),
    /// Recorded telegrams in words: MCAP, pcap, pcapng, raw bytes, hex text, telegrams as text
    Decode(decode::Args),
    /// The messages on the CAN bus: DBC file, tables, logs in words
    #[command(subcommand)]
    Bus(bus::Command),
    /// Stand between a scanner and its client, and have things go wrong on the way
    Proxy(proxy::Args),
    /// List the faults that can go into a file for --faults
    Faults(page_args::PageArgs),
    /// Scene files: a commented one, a verdict, what one means
    #[command(subcommand)]
    Scene(user_files::Command),
    /// Rig files, and the rigs of scenes: the same, with a drawing of mounts and beams
    #[command(subcommand)]
    Rig(user_files::Command),
    /// The keys of scene, rig, scenario and study files as JSON Schema, for completion in editors
    Schema(schema::Args),
    /// Completions of this command line for a shell: `rowscan completions bash > ~/.local/share/bash-completion/completions/rowscan`
    Completions(completions::CompletionArgs),
    /// The manual's pages, one a subcommand
    Man(completions::ManArgs),
    /// List the scanner models, what each emulates and what not
    Models(models::Args),
}

/// How data are written to standard output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people
    #[default]
    Table,
    /// One JSON document, SI units
    Json,
    /// One JSON object a line, SI units
    Jsonl,
    /// Comma-separated values with a header
    Csv,
}

/// How a command that did its work ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All is well.
    Done,
    /// The work was done, and it found something wrong.
    Finding,
    /// A signal of this number ended it before it had a result.
    Interrupted(u8),
}

/// Why a command could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A command line that is none, or that asks for help.
    #[error(transparent)]
    Arguments(#[from] clap::Error),
    /// A scene or rig.
    #[error(transparent)]
    Load(#[from] rowscan_scenes::files::LoadError),
    /// A calibration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A clock in lockstep could not begin.
    #[error(transparent)]
    LockstepOpen(#[from] rowscan_emulator::lockstep::LockstepOpenError),
    /// A step was not acknowledged.
    #[error(transparent)]
    Lockstep(#[from] rowscan_emulator::lockstep::LockstepError),
    /// Scenarios that could not be tried.
    #[error(transparent)]
    Check(#[from] rowscan_check::CheckError),
    /// Expectations that the bench could not judge.
    #[error("{} could not be judged; each says why", plural(*errors as u64, "expectation", "expectations"))]
    Unjudged {
        /// How many.
        errors: usize,
    },
    /// A sprayer's run that cannot be scored.
    #[error(transparent)]
    Score(#[from] rowscan_check::KeptError),
    /// A name that is no scanner model.
    #[error(transparent)]
    UnknownModel(#[from] rowscan_protocol::model::UnknownModel),
    /// An orchard that cannot be grown.
    #[error("the orchard cannot be grown: {0}")]
    Grow(#[from] rowscan_scenes::GrowError),
    /// A scanner that does not fit the rig.
    #[error(transparent)]
    Stage(#[from] rowscan_emulator::stage::StageError),
    /// A row that could not be tried.
    #[error(transparent)]
    Trial(#[from] rowscan_study::trial::TrialError),
    /// Rows that tell nothing of how leaves stand.
    #[error(transparent)]
    Clumping(#[from] rowscan_study::clumping::ClumpingError),
    /// A row that could not be scanned from both alleys.
    #[error(transparent)]
    Sides(#[from] rowscan_study::sides::SidesError),
    /// A GNSS receiver.
    #[error(transparent)]
    Nmea(#[from] rowscan_bus::nmea::NmeaError),
    /// A virtual rig that cannot be put together.
    #[error(transparent)]
    Bench(rowscan_bench::BenchError),
    /// A serial line.
    #[error(transparent)]
    SerialLine(#[from] rowscan_ports::PortError),
    /// A control.
    #[error(transparent)]
    Control(#[from] rowscan_control::ServerError),
    /// A part that this build leaves out.
    #[error(transparent)]
    Feature(#[from] crate::feature::MissingFeature),
    /// A server for Foxglove.
    #[cfg(feature = "foxglove")]
    #[error(transparent)]
    Foxglove(#[from] rowscan_web::foxglove::FoxgloveError),
    /// A port of the CAN bus.
    #[error(transparent)]
    Bus(#[from] rowscan_bus::BusError),
    /// The link to a scanner, or a recording.
    #[error(transparent)]
    Driver(#[from] rowscan_driver::DriverError),
    /// A recording that cannot be written.
    #[error(transparent)]
    Record(#[from] rowscan_recording::RecordError),
    /// A recording that cannot be played.
    #[error(transparent)]
    Replay(#[from] rowscan_emulator::replay::ReplayError),
    /// A rig the estimator cannot work with.
    #[error(transparent)]
    Reading(#[from] rowscan_study::reading::ReadingError),
    /// Points of a search that cannot be confirmed so.
    #[error(transparent)]
    Confirm(#[from] rowscan_study::search::ConfirmError),
    /// A figure that cannot be written.
    #[error(transparent)]
    Figure(#[from] crate::export::FigureError),
    /// A picture that cannot be drawn.
    #[error(transparent)]
    Render(#[from] rowscan_render::RenderError),
    /// Samples no calibration can be fitted to.
    #[error(transparent)]
    Fit(#[from] rowscan_canopy::FitError),
    /// A fault that does not fit.
    #[error("{file}: {cause}")]
    Fault {
        /// The file it stands in.
        file: String,
        /// Why not.
        cause: rowscan_faults::FaultError,
    },
    /// Standard input or a file.
    #[error("cannot read {what}: {cause}")]
    Read {
        /// What was being read.
        what: String,
        /// What the system said.
        #[source]
        cause: io::Error,
    },
    /// A scan that cannot be laid out.
    #[error(transparent)]
    Scan(#[from] rowscan_scenes::scan::ScanError),
    /// A wood test that cannot be.
    #[error(transparent)]
    Mesh(#[from] rowscan_scenes::scan::MeshError),
    /// A row that cannot be scanned so.
    #[error(transparent)]
    RowScan(#[from] rowscan_study::row_scan::RowScanError),
    /// A study that did not end.
    #[error(transparent)]
    Study(#[from] rowscan_study::RunError),
    /// A folder that rows cannot be kept in.
    #[error(transparent)]
    Archive(#[from] rowscan_study::archive::ArchiveError),
    /// A study's description that is none.
    #[error(transparent)]
    Described(#[from] rowscan_study::StudyFileError),
    /// Shards that make no whole.
    #[error(transparent)]
    Merge(#[from] rowscan_study::MergeError),
    /// A shard or journal that cannot be used.
    #[error("{path} {cause}")]
    StudyFile {
        /// The file.
        path: String,
        /// What is wrong with it.
        cause: String,
    },
    /// Standard output or a file.
    #[error("cannot write {what}: {cause}")]
    Write {
        /// What was being written.
        what: String,
        /// What the system said.
        cause: io::Error,
    },
    /// Flags that do not go together.
    #[error("{0}")]
    Usage(String),
    /// The system refused something basic.
    #[error("cannot {what}: {cause}")]
    System {
        /// What was tried.
        what: &'static str,
        /// What the system said.
        cause: io::Error,
    },
}

impl From<rowscan_bench::BenchError> for Failure {
    fn from(error: rowscan_bench::BenchError) -> Self {
        use rowscan_bench::BenchError::{Fields, TooManyFields};
        match error {
            Fields(_) | TooManyFields { .. } => Self::Usage(format!("--field: {error}")),
            error => Self::Bench(error),
        }
    }
}

impl Failure {
    /// 1 where the input is understood and holds nothing of what was asked for, else 2.
    fn exit_code(&self) -> u8 {
        match self {
            Self::Driver(DriverError::NoScan { .. })
            | Self::Driver(DriverError::Recording {
                cause: ReadError::Foreign { .. } | ReadError::Archive(_),
                ..
            }) => 1,
            _ => 2,
        }
    }
}

/// What tasks get to end in, once a command has.
const SHUTDOWN_TIMEOUT: std::time::Duration = std::time::Duration::from_millis(300);

/// A number below zero is an option's value, and refused as such by name; it is no flag.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|arg| {
        let takes_values = arg.get_action().takes_values();
        if takes_values { arg.allow_negative_numbers(true) } else { arg }
    });
    command.mut_subcommands(with_negative_numbers)
}

/// The command line as its parser knows it. The types that it is parsed to are not for others: what nobody else can call is not compiled.
pub fn command() -> clap::Command {
    with_negative_numbers(examples::ended(Cli::command()))
}

/// Runs one command line to its end; the first argument is the program's name.
///
/// # Errors
/// The command line is none, or its command could not do its work.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Outcome, Failure> {
    let matches = command().try_get_matches_from(arguments)?;
    run_command(Cli::from_arg_matches(&matches)?.command)
}

/// Not generic: it would be compiled with all that it calls wherever it is called.
fn run_command(command: Command) -> Result<Outcome, Failure> {
    warnings::tell();
    let _files = KeptApart::begin();
    let interrupt = Interrupt::watch()?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()
        .map_err(|cause| Failure::System { what: "start the runtime", cause })?;
    let outcome = runtime.block_on(async {
        let _file_size = interrupt::FileSizeLimit::watch();
        // Commands that do not take the interrupt are ended by a signal at once.
        match command {
            Command::Demo(args) => demo::run(args, interrupt).await,
            Command::Emulate(args) => emulate::run(*args, interrupt).await,
            Command::Check(args) => check::run(args, interrupt).await,
            Command::Score(args) => score::run(&args),
            Command::Spray(args) => spray::run(args, interrupt).await,
            Command::Estimate(args) => estimate::run(args, interrupt).await,
            Command::Watch(args) => estimate::watch(args, interrupt).await,
            Command::Orchard(command) => orchard::run(command, interrupt).await,
            Command::Scan(args) => scan::run(args, interrupt).await,
            Command::Study(command) => study::run(command, interrupt).await,
            Command::Record(args) => record::run(args, interrupt).await,
            Command::Replay(args) => replay::run(args, interrupt).await,
            Command::Export(args) => export::run(args, interrupt).await,
            Command::Decode(args) => decode::run(args),
            Command::Bus(command) => bus::run(command),
            Command::Proxy(args) => proxy::run(args, interrupt).await,
            Command::Faults(args) => faults::run(args),
            Command::Scene(command) => user_files::run(Document::Scene, command),
            Command::Rig(command) => user_files::run(Document::Rig, command),
            Command::Schema(args) => schema::run(&args),
            Command::Completions(args) => completions::completions(&args),
            Command::Man(args) => completions::man(&args),
            Command::Models(args) => models::run(args),
        }
    });
    // Tasks take their links and files with them; an interrupted command does not wait for the orchard that was growing.
    runtime.shutdown_timeout(SHUTDOWN_TIMEOUT);
    // Of an interrupted command, whose tasks may not have ended; one that finished has none.
    remove_leftovers();
    outcome
}

/// Tells the user how it ended, once, and turns it into an exit code: 0 done, 1 a finding, 2 bad input, 128 and the signal's number
/// where a signal came before the result.
pub fn report(ended: Result<Outcome, Failure>) -> ExitCode {
    match ended {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::Finding) => ExitCode::from(1),
        Ok(Outcome::Interrupted(signal)) => ExitCode::from(128 + signal),
        // A reader that has read enough (`| head`) is not a failure.
        Err(Failure::Write { cause, .. }) if is_closed_pipe(&cause) => ExitCode::SUCCESS,
        Err(Failure::Arguments(error)) => {
            // Help goes to standard output; nothing is left to be done if nobody takes it.
            let _ = error.print();
            ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
        }
        Err(failure) => {
            let remedy = missing_file(&failure).unwrap_or_default();
            say(format_args!("rowscan: {failure}{remedy}"));
            ExitCode::from(failure.exit_code())
        }
    }
}

/// True if nobody reads any more what is written, as the system said, or as a library did that was told so.
fn is_closed_pipe(cause: &io::Error) -> bool {
    let mut next = cause.get_ref().map(|inner| inner as &(dyn std::error::Error + 'static));
    let below = std::iter::from_fn(|| {
        let this = next?;
        next = this.source();
        Some(this)
    });
    let is_pipe = |cause: &io::Error| cause.kind() == io::ErrorKind::BrokenPipe;
    is_pipe(cause) || below.into_iter().any(|cause| cause.downcast_ref().is_some_and(is_pipe))
}
