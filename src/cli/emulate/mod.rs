//! `rowscan emulate`

mod fitted;
mod running;
mod stand;

use std::path::Path;
use std::sync::Arc;

use rowscan_control::{Bench, Log, StateOf};
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::stage::{Stage, StageError};
use rowscan_emulator::{LineWatch, Rig, SeenRig, StageRow, StartWhen, ViewError};
use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_recording::{About, Taps};
use tokio::runtime::Handle;
use tokio::task::JoinSet;

use super::client_limits::ClientLimitArgs;
use super::control::{ControlArgs, Controlled};
use super::device::DeviceArgs;
use super::ending::EndArgs;
use super::event_format;
use super::events::{self};
use super::faulting::{FaultArgs, Faulting};
use super::files_apart::FilesApart;
use super::interrupt::Interrupt;
use super::line::LineArgs;
use super::lockstep::{LockstepArgs, Ways};
use super::output::say;
use super::recorder::{self, RecordArgs, Taping};
use super::scene::SceneArgs;
use super::stream_states::state_of;
use super::tractor_outputs::TractorOutputArgs;
use super::truth_file::TruthArgs;
use super::web::{Opened, Watching, WebArgs};
use super::{Failure, Format, Outcome};
use fitted::{Fitted, which};
use running::Running;
use stand::Stand;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Listen on this address; repeatable; port 0 takes a free one [default: 127.0.0.1:2111 and 127.0.0.1:2112; of a second scanner 2121 and 2122, and so on]
    #[arg(long, value_name = "ADDR")]
    tcp: Vec<String>,
    /// Simulated seconds a second, or `max`: as fast as the clients take it; at most 64 KiB and two telegrams a client wait to be sent, and what the
    /// client's own system buffers comes on top [default: 1]
    #[arg(long, value_name = "K")]
    time_scale: Option<TimeScale>,
    #[command(flatten)]
    lockstep: LockstepArgs,
    /// Exit with 1 if the host was too slow for a scan
    #[arg(long)]
    strict_time: bool,
    /// What sets the tractor going: the first scanner with a taker, all scanners with takers, or the start of the process [default: first; at --time-scale max: all]
    #[arg(long, value_name = "first|all|now")]
    start_when: Option<StartWhen>,
    /// Dialects answered
    #[arg(long, value_enum, default_value_t)]
    dialect: DialectArg,
    /// The rig's scanner to be, from 0; repeated, several scanners of one tractor, each with its own --tcp, in the same order; one of them may be an LMS2xx on a serial line [default: 0]
    #[arg(long, value_name = "N")]
    scanner: Vec<usize>,
    /// Be the tractor alone: GNSS and CAN without any scanner
    #[arg(long, conflicts_with = "scanner")]
    no_scanner: bool,
    #[command(flatten)]
    clients: ClientLimitArgs,
    /// How to tell where it listens; jsonl writes one object an endpoint to standard output
    #[arg(long, default_value = "table", value_parser = event_format::parser())]
    format: Format,
    #[command(flatten)]
    line: LineArgs,
    #[command(flatten)]
    tractor_outputs: TractorOutputArgs,
    #[command(flatten)]
    faults: FaultArgs,
    #[command(flatten)]
    control: ControlArgs,
    #[command(flatten)]
    web: WebArgs,
    #[command(flatten)]
    end: EndArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    record: RecordArgs,
    #[command(flatten)]
    truth: TruthArgs,
}

/// Dialects a virtual scanner answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum DialectArg {
    /// Each connection's first valid frame decides
    #[default]
    Auto,
    /// CoLa A only; silent in CoLa B
    A,
    /// CoLa B only; silent in CoLa A
    B,
}

impl From<DialectArg> for DialectPolicy {
    fn from(arg: DialectArg) -> Self {
        match arg {
            DialectArg::Auto => Self::Auto,
            DialectArg::A => Self::Strict(Dialect::A),
            DialectArg::B => Self::Strict(Dialect::B),
        }
    }
}

pub(super) async fn run(mut args: Args) -> Result<Outcome, Failure> {
    args.time_scale = Some(args.lockstep.time_scale(args.time_scale)?);
    let mut interrupt = Interrupt::watch()?;
    let parent = args.end.parent();
    let Some(stage) = interrupt.or(args.scene.stage()).await.transpose()? else { return Ok(Outcome::Done) };
    let fitted = args.fitted(&stage)?;
    args.files().check()?;
    let models: Vec<&str> = fitted.iter().map(|fitted| fitted.model.name()).collect();
    let taping = args.tape(&stage, &models.join(", "))?;
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), args.scale()).with_timer(Timer::system());
    let ways = Ways { bus: args.tractor_outputs.has_bus(), control: args.is_handled() };
    rig = args.lockstep.apply(rig, &ways, args.format).await?;
    if let Some(end) = args.end.end(&stage) {
        rig = rig.until(end);
    }
    if let Some(start) = args.start_when {
        rig = rig.with_start(start);
    }
    let first = fitted.first().map(|fitted| fitted.index);
    let (mut rig, truth) = args.truth.start(&stage, first, rig)?;
    let (script, log) = (args.faults.read()?, Log::default());
    let row = Arc::new(StageRow::new(tractor.clone(), &stage.orchard));
    let faulting = (script.is_some() || args.is_handled())
        .then(|| Faulting::start(stage.scene.seed, rig.clock(), Some(row), (args.format, &log)));
    if let Some(faulting) = &faulting {
        rig.set_faults(faulting.control());
    }
    let watching = args.web.is_given().then(|| Watching::new(rig.clock()));
    let lines: Vec<LineWatch> = watching.iter().flat_map(|_| &fitted).map(|_| LineWatch::default()).collect();
    let outputs = args.tractor_outputs.open(&stage, &tractor, &mut rig, &taping.taps(), args.format).await?;
    let (mut running, mut sources) = (Vec::new(), Vec::new());
    let stand = Stand {
        args: &args,
        stage: &stage,
        tractor: &tractor,
        fitted: &fitted,
        taps: watching.as_ref().map_or_else(Taps::default, Watching::taps).and(taping.taps()),
        faulting: faulting.as_ref(),
        lines: &lines,
    };
    for (place, scanner) in fitted.iter().enumerate() {
        let standing = stand.open(place, scanner, &mut rig).await?;
        running.push(standing.running);
        sources.extend(standing.source.map(|source| format!(" {source}")));
        rig.read_by(standing.untaken);
    }
    if let Some(faulting) = &faulting {
        faulting.begin(script)?;
    }
    let streams = running.iter().zip(&fitted).map(|(running, fitted)| (fitted.name(), running.counts()));
    let bench = faulting.as_ref().map(|faulting| bench_of(faulting, &rig, log, state_of(streams)));
    let _controlled = match &bench {
        Some(bench) => args.hand_over(bench.clone(), &rig).await?,
        None => Controlled::default(),
    };
    let mut watched = JoinSet::new();
    let _opened = match watching.zip(bench) {
        Some((watching, bench)) => {
            let scanners = fitted.iter().zip(&running).zip(lines);
            let shown = SeenRig {
                title: format!("rowscan emulate {}", args.scene.name),
                stage: &stage,
                tractor: rig.tractor(),
                clock: rig.clock(),
                scanners: scanners.map(|((fitted, running), lines)| fitted.seen(running, lines)).collect(),
            };
            let show = watching.show(shown, &mut watched, &Handle::current());
            let opened = args.web.open(show, Some(bench), args.format).await?;
            opened.addresses().for_each(|address| rig.control().exclude(address));
            opened
        }
        None => Opened::default(),
    };
    args.tell(&stage, &fitted, &sources);
    events::ready(args.format)?;
    let mut timeline = rig.run();
    let failed = tokio::select! {
        () = interrupt.wait() => None,
        () = parent.gone() => None,
        ended = timeline.ended() => ended.err(),
    };
    if let Some(faulting) = faulting {
        faulting.finish().await?;
    }
    let missed = args.tell_end(&running, &fitted)?;
    drop((running, timeline));
    let outcome = if taping.finish() == Outcome::Done { outputs.outcome() } else { Outcome::Finding };
    truth.finish().await?;
    match failed {
        Some(error) => Err(error.into()),
        None if args.strict_time && missed > 0 => {
            say(format_args!("--strict-time: {missed} scans were missed because the host was too slow"));
            Ok(Outcome::Finding)
        }
        None => Ok(outcome),
    }
}

/// The rig in others' hands.
fn bench_of(faulting: &Faulting, rig: &Rig, log: Log, streams: StateOf) -> Bench {
    let parts = vec![("streams".to_owned(), streams)];
    Bench::new(faulting.control().clone(), Arc::new(rig.control()), log, parts)
}

impl Args {
    fn scale(&self) -> TimeScale {
        self.time_scale.unwrap_or(TimeScale::Paced(1.0))
    }

    /// The scanners asked for, with their models.
    fn fitted(&self, stage: &Stage) -> Result<Vec<Fitted>, Failure> {
        let asked = match (self.no_scanner, self.scanner.is_empty()) {
            (true, _) => &[][..],
            (false, true) => &[0][..],
            (false, false) => &self.scanner,
        };
        let mut fitted = Vec::new();
        for &index in asked {
            if stage.rig.scanners.get(index).is_none() {
                let found = stage.rig.scanners.len();
                return Err(StageError::from(ViewError::NoSuchScanner { index, found }).into());
            }
            fitted.push(Fitted { index, model: self.scene.any_model(&stage.rig, index)? });
        }
        self.check(&fitted)?;
        Ok(fitted)
    }

    /// The files that it reads and writes.
    fn files(&self) -> FilesApart<'_> {
        let written = self.record.file().into_iter().chain(self.truth.file());
        FilesApart {
            read: [Path::new(&self.scene.name)].into_iter().chain(self.faults.file()).collect(),
            written: written.chain(self.tractor_outputs.files()).collect(),
        }
    }

    /// Starts the recording that is asked for, of scanners of these models.
    fn tape(&self, stage: &Stage, models: &str) -> Result<Taping, Failure> {
        let about = About {
            model: Some(models.to_owned()),
            scene: Some(self.scene.name.clone()),
            rig: recorder::rig_text(&stage.rig),
            seed: Some(stage.scene.seed),
            ..About::default()
        };
        // A clock that waits for its clients can wait for the disk too.
        self.record.start(about, self.scale().delivery().is_patient())
    }

    /// Says what runs where, and how to read it.
    fn tell(&self, stage: &Stage, fitted: &[Fitted], sources: &[String]) {
        let titles: Vec<&str> = fitted.iter().map(|fitted| fitted.model.title()).collect();
        let titles = if titles.is_empty() { "no scanner".to_owned() } else { titles.join(" and ") };
        let (scene, seed) = (&self.scene.name, stage.scene.seed);
        let start = self.start_when.unwrap_or(StartWhen::default_at(self.scale()));
        let starts = match (start, fitted.len()) {
            (StartWhen::Now, _) => "the tractor starts now",
            (_, 0) => "the tractor starts with the first client",
            (StartWhen::All, 2..) => "the tractor starts when every scanner has a client",
            _ => "the tractor starts with the first scan sent",
        };
        say(format_args!("{titles} on {scene}, seed {seed}; {starts}"));
        if !sources.is_empty() && sources.len() == fitted.len() {
            let sources = sources.concat();
            say(format_args!("estimate with: rowscan estimate{sources} --rig {scene}{}", which(fitted)));
        }
    }

    /// Others may have a hand in it: scripts or people.
    fn is_handled(&self) -> bool {
        self.control.is_given() || self.web.is_given()
    }

    /// Gives scripts a handle to the rig.
    async fn hand_over(&self, bench: Bench, rig: &Rig) -> Result<Controlled, Failure> {
        let controlled = self.control.open(bench, self.format).await?;
        controlled.addresses().for_each(|address| rig.control().exclude(address));
        Ok(controlled)
    }

    /// Says what the scanners have done; how many scans the host was too slow for.
    fn tell_end(&self, running: &[Running], fitted: &[Fitted]) -> Result<u64, Failure> {
        for (scanner, fitted) in running.iter().zip(fitted) {
            say(scanner.summary());
            scanner.end(fitted.stream(running.len()).as_deref()).tell(self.format)?;
        }
        Ok(running.iter().map(Running::missed).sum())
    }

    /// Refuses what the scanners cannot share.
    fn check(&self, fitted: &[Fitted]) -> Result<(), Failure> {
        let refused = |why: String| Err(Failure::Usage(why));
        let serial: Vec<_> = fitted.iter().filter_map(|fitted| fitted.model.lms2xx()).collect();
        let network = fitted.len() - serial.len();
        match (serial.as_slice(), fitted.len()) {
            (_, 0) if self.tractor_outputs.is_empty() => refused(
                "--no-scanner leaves GNSS and CAN, and neither is asked for: add --can PORT or --nmea PLACE"
                    .to_owned(),
            ),
            ([model], 1) => self.line.check(model, &self.tcp),
            ([], 0 | 1) => Ok(()),
            ([_, _, ..], _) => refused(
                "only one LMS2xx can be emulated at a time: give the others an `emulate` of their own"
                    .to_owned(),
            ),
            ([model], _) if self.line.count() != 1 => refused(format!(
                "{} has one serial line: give one of --pty LINK, --serial DEV, --rfc2217 ADDR",
                model.title
            )),
            ([], _) if self.line.count() > 0 => refused(
                "--pty, --serial and --rfc2217 are one scanner's: leave them out, or give one --scanner"
                    .to_owned(),
            ),
            _ if self.device.keeps_state() => {
                refused("--state is one scanner's: leave it out, or give one --scanner".to_owned())
            }
            _ if !self.tcp.is_empty() && self.tcp.len() != network => refused(format!(
                "expected one --tcp for each of the {network} scanners, in their order, found {}",
                self.tcp.len()
            )),
            _ => Ok(()),
        }
    }
}
