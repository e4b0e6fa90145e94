//! `rowscan emulate`

use std::sync::Arc;

use rowscan_bench::{Bench, BenchScanner, BenchSpec, Endpoint, ScannerSpec, TimeSpec};
use rowscan_bus::link::candump::LogCut;
use rowscan_control::Log;
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::stage::{Stage, StageError};
use rowscan_emulator::{StartWhen, ViewError};
use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_recording::{About, Taps};
use rowscan_study::calibrations::load_calibration_for;
use tokio::runtime::Handle;
use tokio::task::JoinSet;

use super::client_limits::ClientLimitArgs;
use super::control::{ControlArgs, Controlled};
use super::datagrams::DatagramArgs;
use super::device::DeviceArgs;
use super::ending::EndArgs;
use super::endpoint::{DEFAULT_PORTS, announce_all};
use super::event_format;
use super::events::{self, End};
use super::faulting::{FaultArgs, Faulting};
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

/// How far apart the ports of several scanners are.
const PORTS_APART: u16 = 10;

/// A scanner of the rig that is asked for, with its model.
struct Fitted {
    /// Number in the rig, from 0.
    index: usize,
    model: AnyModel,
}

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Listen on this address; repeatable; port 0 takes a free one [default: 127.0.0.1:2111 and 127.0.0.1:2112; of a second scanner 2121 and 2122, and so on]
    #[arg(long, value_name = "ADDR")]
    tcp: Vec<String>,
    /// Answer SICK's device search at this UDP address, such as 127.0.0.1:30718; repeatable, in the order of the scanners. The form is not verified (docs/device.md)
    #[arg(long, value_name = "ADDR")]
    search: Vec<String>,
    /// Its serial number, which its telegrams hold; repeatable, in the order of the scanners; an LMS2xx tells none [default: by model, scanner and seed]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    serial_number: Vec<u32>,
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
    /// How to tell where it listens and what happens; jsonl writes one object an event to standard output, json one document at the end
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
    datagrams: DatagramArgs,
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

pub(super) async fn run(mut args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    args.time_scale = Some(args.lockstep.time_scale(args.time_scale)?);
    let parent = args.end.parent();
    let Some(stage) = interrupt.or(args.scene.stage()).await.transpose()? else { return Ok(Outcome::Done) };
    let fitted = args.fitted(&stage)?;
    let scanners = args.scanners(&fitted)?;
    // What is read is read first: nothing that is written may take its place.
    let (script, log) = (args.faults.read()?, Log::default());
    let taping = args.tape(&stage, &scanners)?;
    let (moments, truth) = args.truth.start(&stage, fitted.first().map(|fitted| fitted.index))?;
    let mut spec = BenchSpec::new(&stage, args.scale());
    let watching = args.web.is_given().then(|| Watching::new(spec.clock()));
    let ways = Ways { bus: args.tractor_outputs.has_bus(), control: args.is_handled() };
    spec.time = TimeSpec {
        timer: Timer::system(),
        start: args.start_when,
        end: args.end.end(&stage),
        step: args.lockstep.step(),
        lockstep: args.lockstep.open(&ways, args.format).await?,
        held: false,
    };
    spec.faults = script.is_some() || args.is_handled();
    spec.taps = watching.as_ref().map_or_else(Taps::default, Watching::taps).and(taping.taps());
    spec.watched = watching.is_some();
    spec.moments = moments;
    spec.scanners = scanners;
    let mut telling = JoinSet::new();
    args.tractor_outputs.add_to(&mut spec, &taping.taps(), &mut telling);
    let mut bench = Bench::open(spec).await?;
    let several = fitted.len() > 1;
    let is_scanner = |part: &str| bench.scanners().iter().any(|scanner| scanner.id == part);
    announce_all(args.format, bench.places(), |part| Some(part).filter(|part| several && is_scanner(part)))?;
    let faulting = bench.faults().cloned().zip(bench.take_fault_events());
    let faulting = faulting.map(|handles| Faulting::tell(handles, (args.format, &log)));
    if let Some(faulting) = &faulting {
        faulting.begin(script)?;
    }
    let in_hand = faulting.as_ref().map(|faulting| in_hand(faulting, &bench, log));
    let _controlled = match &in_hand {
        Some(in_hand) => args.hand_over(in_hand.clone(), &bench).await?,
        None => Controlled::default(),
    };
    let mut watched = JoinSet::new();
    let _opened = match watching.zip(in_hand) {
        Some((watching, in_hand)) => {
            let shown = bench.seen(format!("rowscan emulate {}", args.scene.name), &stage);
            let show = watching.show(shown, &mut watched, &Handle::current());
            let opened = args.web.open(show, Some(in_hand), args.format).await?;
            opened.addresses().for_each(|address| bench.control().exclude(address));
            opened
        }
        None => Opened::default(),
    };
    args.tell(&stage, &fitted, &bench);
    events::ready(args.format)?;
    bench.run();
    let failed = tokio::select! {
        () = interrupt.wait() => None,
        () = parent.gone() => None,
        ended = bench.ended() => ended.err(),
    };
    if let Some(faulting) = faulting {
        faulting.finish().await?;
    }
    bench.let_go().await;
    let missed = args.tell_end(bench.scanners())?;
    let logs = bench.logs().to_vec();
    // A recording ends after all that it records.
    bench.close().await;
    let is_whole = taping.finish() == Outcome::Done && !logs.iter().any(LogCut::is_cut);
    truth.finish().await?;
    match failed {
        Some(error) => Err(error.into()),
        None if args.strict_time && missed > 0 => {
            say(format_args!("--strict-time: {missed} scans were missed because the host was too slow"));
            Ok(Outcome::Finding)
        }
        None if is_whole => Ok(Outcome::Done),
        None => Ok(Outcome::Finding),
    }
}

/// The rig in others' hands.
fn in_hand(faulting: &Faulting, bench: &Bench, log: Log) -> rowscan_control::Bench {
    let streams = bench.scanners().iter().map(|scanner| (scanner.id.clone(), scanner.counts()));
    let parts = vec![("streams".to_owned(), state_of(streams))];
    rowscan_control::Bench::new(faulting.control().clone(), Arc::new(bench.control().clone()), log, parts)
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
        if self.search.len() > fitted.len() {
            return Err(Failure::Usage(format!(
                "expected one --search for a scanner at most, found {} for {}",
                self.search.len(),
                fitted.len()
            )));
        }
        if self.serial_number.len() > fitted.len() {
            return Err(Failure::Usage(format!(
                "expected one --serial-number for a scanner at most, found {} for {}",
                self.serial_number.len(),
                fitted.len()
            )));
        }
        self.check(&fitted)?;
        Ok(fitted)
    }

    /// The same as a bench has them.
    fn scanners(&self, fitted: &[Fitted]) -> Result<Vec<ScannerSpec>, Failure> {
        let several = fitted.len() > 1;
        let (max_clients, idle_limit) = self.clients.limits();
        let spec = |(place, scanner): (usize, &Fitted)| {
            let mut device = self.device.spec(scanner.model)?;
            let on_this_mount =
                fitted.iter().take(place).filter(|other| other.index == scanner.index).count();
            let spec = ScannerSpec::new(scanner.index, scanner.model).after(on_this_mount);
            let is_serial = scanner.model.lms2xx().is_some();
            if is_serial {
                device = self.line.over(device)?;
            }
            device.serial_number = self.serial_number.get(place).copied();
            let before = fitted.iter().take(place).filter(|other| other.model.lms2xx().is_none()).count();
            Ok(ScannerSpec {
                endpoints: if is_serial { self.one_line() } else { self.endpoints(before, several) },
                search: self.search.get(place).cloned(),
                stream: several.then(|| spec.id.clone()),
                device,
                dialects: self.dialect.into(),
                max_clients,
                idle_limit,
                ..spec
            })
        };
        let mut specs = fitted.iter().enumerate().map(spec).collect::<Result<Vec<_>, Failure>>()?;
        self.datagrams.add_to(&mut specs)?;
        Ok(specs)
    }

    /// Where a network scanner is found that has so many others before it.
    fn endpoints(&self, before: usize, several: bool) -> Vec<Endpoint> {
        let lines = self.line.endpoints().filter(|_| !several);
        let addresses = match self.tcp.get(before) {
            Some(address) if several => vec![address.clone()],
            Some(_) => self.tcp.clone(),
            None if !several && self.line.count() > 0 => Vec::new(),
            None => {
                let further = PORTS_APART.saturating_mul(u16::try_from(before).unwrap_or(u16::MAX));
                DEFAULT_PORTS.map(|port| format!("127.0.0.1:{}", port.saturating_add(further))).to_vec()
            }
        };
        addresses.into_iter().map(Endpoint::Tcp).chain(lines).collect()
    }

    /// The line of an LMS2xx: a serial one, or its bare bytes over TCP.
    fn one_line(&self) -> Vec<Endpoint> {
        match self.line.endpoints().next() {
            Some(line) => vec![line],
            None => self.tcp.first().cloned().map(Endpoint::Tcp).into_iter().collect(),
        }
    }

    /// Starts the recording that is asked for, of these scanners.
    fn tape(&self, stage: &Stage, scanners: &[ScannerSpec]) -> Result<Taping, Failure> {
        let about = About {
            scene: Some(self.scene.name.clone()),
            // What its beams are, whatever the rig is told.
            rig: recorder::rig_text(&Rig {
                optics: Some(stage.scene.optics.beam_width()),
                ..stage.rig.clone()
            }),
            seed: Some(stage.scene.seed),
            ..About::default()
        };
        let about =
            about.of_scanners(scanners.iter().map(|spec| (spec.model.name(), spec.mount, spec.streams())));
        // A clock that waits for its clients can wait for the disk too.
        self.record.start(about, self.scale().delivery().is_patient())
    }

    /// Says what runs where, and how to read it.
    fn tell(&self, stage: &Stage, fitted: &[Fitted], bench: &Bench) {
        let sources: Vec<String> =
            bench.scanners().iter().filter_map(|scanner| bench.source_of(&scanner.id)).collect();
        let titles: Vec<&str> = fitted.iter().map(|fitted| fitted.model.title()).collect();
        let titles = if titles.is_empty() { "no scanner".to_owned() } else { titles.join(" and ") };
        let (scene, seed) = (&self.scene.name, stage.scene.seed);
        let start = self.start_when.unwrap_or(StartWhen::default_at(self.scale()));
        let starts = match (start, fitted.len()) {
            (StartWhen::Now, 1..) if self.scale() == TimeScale::Max => {
                "the tractor starts now, but at --time-scale max time waits for a client that takes scans"
            }
            (StartWhen::Now, _) => "the tractor starts now",
            (_, 0) => "the tractor and its time start with the first client",
            (StartWhen::All, 2..) => "the tractor and its time start when every scanner has a client",
            _ => "the tractor and its time start with the first scan sent",
        };
        say(format_args!("{titles} on {scene}, seed {seed}; {starts}"));
        if !sources.is_empty() && sources.len() == fitted.len() {
            let sources = sources.join(" ");
            // The scene's file does not know of the flag.
            let width = stage.scene.optics.beam_width().name();
            let optics = if self.scene.tells_optics() { format!(" --optics {width}") } else { String::new() };
            let which = which(fitted);
            say(format_args!("estimate with: rowscan estimate {sources} --rig {scene}{which}{optics}"));
            let named = stage.rig.calibration.as_deref().zip(fitted.first());
            let unreadable = named.and_then(|(name, first)| {
                load_calibration_for(name, first.model.name(), stage.rig.optics).err()
            });
            if let Some(cause) = unreadable {
                say(format_args!("warning: an estimate by this rig is refused: {cause}"));
            }
        }
    }

    /// Others may have a hand in it: scripts or people.
    fn is_handled(&self) -> bool {
        self.control.is_given() || self.web.is_given()
    }

    /// Gives scripts a handle to the rig.
    async fn hand_over(&self, in_hand: rowscan_control::Bench, bench: &Bench) -> Result<Controlled, Failure> {
        let controlled = self.control.open(in_hand, self.format).await?;
        controlled.addresses().for_each(|address| bench.control().exclude(address));
        Ok(controlled)
    }

    /// Says what the scanners have done; how many scans the host was too slow for.
    fn tell_end(&self, scanners: &[BenchScanner]) -> Result<u64, Failure> {
        let (mut missed, mut ends) = (0, Vec::new());
        for scanner in scanners {
            let counts = scanner.counts().counts().unwrap_or_default();
            say(events::told(&counts));
            let stream = (scanners.len() > 1).then_some(scanner.id.as_str());
            ends.push(End::of(stream, counts));
            missed += counts.scans_missed.unwrap_or(0);
        }
        if let (1.., TimeScale::Paced(scale)) = (missed, self.scale()) {
            say(format_args!(
                "this machine is too slow for this pace: let it run slower (--time-scale {}), or as fast as it can (--time-scale max)",
                scale / 2.0
            ));
        }
        events::tell_ends(self.format, &ends)?;
        Ok(missed)
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

/// The flags that tell an estimate which scanners these are; models that differ are the rig's own.
fn which(scanners: &[Fitted]) -> String {
    let mut flags = String::new();
    if let Some(first) = scanners.first()
        && scanners.iter().all(|fitted| fitted.model.name() == first.model.name())
    {
        flags += &format!(" --model {}", first.model.name());
    }
    if scanners.iter().enumerate().any(|(place, fitted)| fitted.index != place) {
        scanners.iter().for_each(|fitted| flags += &format!(" --scanner {}", fitted.index));
    }
    flags
}
