//! `rowscan emulate`

use std::sync::Arc;

use rowscan_control::{Bench, Log, StateOf};
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::stage::{Stage, StageError};
use rowscan_emulator::{
    Bound, Emulator, EmulatorConfig, Rig, ScannerView, SerialConfig, SerialEmulator, StageRow, StartWhen,
    ViewError, faulty_wire,
};
use rowscan_faults::{Language, Medium, StreamFaults};
use rowscan_protocol::device::{Device, DialectPolicy};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_recording::{About, StreamKind, Taps};
use rowscan_vehicle::Tractor;
use serde_json::{Map, Value, json};

use super::client_limits::{self, ClientLimitArgs};
use super::control::{ControlArgs, Controlled};
use super::device::DeviceArgs;
use super::ending::EndArgs;
use super::endpoint::{DEFAULT_PORTS, Place, announce_stream};
use super::events::{self, Counted, End};
use super::faulting::{FaultArgs, Faulting};
use super::interrupt::Interrupt;
use super::line::{self, LineArgs, Opened};
use super::lockstep::{LockstepArgs, Ways};
use super::output::say;
use super::recorder::{self, RecordArgs, Taping};
use super::scene::SceneArgs;
use super::tractor_outputs::TractorOutputArgs;
use super::truth_file::TruthArgs;
use super::{Failure, Format, Outcome};

/// How far apart the ports of several scanners are.
const PORTS_APART: u16 = 10;

/// Rate of a CoLa scanner's serial line out of the box, bits a second.
const COLA_RATE: u32 = 57_600;

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
    #[arg(long, value_enum, default_value_t)]
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

/// A scanner of the rig with its model.
struct Fitted {
    /// Number in the rig, from 0.
    index: usize,
    model: AnyModel,
}

impl Fitted {
    /// What its stream is called, where it is one of several.
    fn stream(&self, of: usize) -> Option<String> {
        (of > 1).then(|| format!("scanner{}", self.index))
    }

    /// Its part of the faults, if there are any.
    fn faults(&self, faulting: Option<&Faulting>, on_a_line: bool) -> Option<StreamFaults> {
        let (medium, language) = match self.model {
            AnyModel::Cola(_) if !on_a_line => (Medium::Tcp, Language::Cola),
            AnyModel::Cola(_) => (Medium::Wire, Language::Cola),
            AnyModel::Lms2xx(_) => (Medium::Wire, Language::Lms2xx),
        };
        Some(faulting?.control().stream(&self.name(), medium, language))
    }

    /// What faults and state call it.
    fn name(&self) -> String {
        format!("scanner{}", self.index)
    }
}

/// Tells what a scanner has done.
type CountsOf = Box<dyn Fn() -> Value + Send + Sync>;

/// Tells the state of all scanners, by their names.
fn state_of(streams: Vec<(String, CountsOf)>) -> StateOf {
    Arc::new(move || {
        streams.iter().map(|(name, counts)| (name.clone(), counts())).collect::<Map<_, _>>().into()
    })
}

/// A scanner that is set up, and where clients find it.
enum Running {
    Cola(Emulator),
    Lms2xx(SerialEmulator),
}

impl Running {
    /// Tells what it has done at any time, as [`Running::end`] does.
    fn counting(&self) -> CountsOf {
        match self {
            Self::Cola(emulator) => {
                let counter = emulator.counter();
                Box::new(move || json!(counter.counts().as_ref().map(Counted::cola)))
            }
            Self::Lms2xx(emulator) => {
                let counts = emulator.counting();
                Box::new(move || json!(Counted::lms2xx(counts())))
            }
        }
    }

    /// What it has done, for scripts.
    fn end<'a>(&self, stream: Option<&'a str>) -> End<'a> {
        match self {
            Self::Cola(emulator) => End::cola(stream, &emulator.counts()),
            Self::Lms2xx(emulator) => End::lms2xx(stream, emulator.counts()),
        }
    }

    /// Scans that the host was too slow for. An LMS2xx sends what it has, late.
    fn missed(&self) -> u64 {
        match self {
            Self::Cola(emulator) => emulator.counts().scans_missed,
            Self::Lms2xx(_) => 0,
        }
    }

    /// One line for people on what it has done.
    fn summary(&self) -> String {
        match self {
            Self::Cola(emulator) => {
                let counts = emulator.counts();
                format!(
                    "{} scans sent, {} dropped for slow clients, {} missed by a slow host; {}",
                    counts.scans_sent,
                    counts.scans_dropped,
                    counts.scans_missed,
                    client_limits::told(&counts)
                )
            }
            Self::Lms2xx(emulator) => {
                let counts = emulator.counts();
                format!("{} scans sent, {} bytes not taken", counts.scans_sent, counts.bytes_lost)
            }
        }
    }
}

pub(super) async fn run(mut args: Args) -> Result<Outcome, Failure> {
    args.time_scale = Some(args.lockstep.time_scale(args.time_scale)?);
    let mut interrupt = Interrupt::watch()?;
    let parent = args.end.parent();
    let Some(stage) = interrupt.or(args.scene.stage()).await.transpose()? else { return Ok(Outcome::Done) };
    let fitted = args.fitted(&stage)?;
    let models: Vec<&str> = fitted.iter().map(|fitted| fitted.model.name()).collect();
    let taping = args.tape(&stage, &models.join(", "))?;
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), args.scale()).with_timer(Timer::system());
    let ways = Ways { bus: args.tractor_outputs.has_bus(), control: args.control.is_given() };
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
    let faulting = (script.is_some() || args.control.is_given())
        .then(|| Faulting::start(stage.scene.seed, rig.clock(), Some(row), (args.format, &log)));
    if let Some(faulting) = &faulting {
        rig.set_faults(faulting.control());
    }
    let _telling = args.tractor_outputs.open(&stage, &tractor, &mut rig, &taping.taps(), args.format).await?;
    let (mut running, mut sources) = (Vec::new(), Vec::new());
    for (place, scanner) in fitted.iter().enumerate() {
        let stream = scanner.stream(fitted.len());
        let (emulator, source) = match scanner.model {
            AnyModel::Cola(model) => {
                let set_up =
                    args.cola(&stage, &tractor, (scanner.index, model), stream.clone(), taping.taps())?;
                let (device, view, mut config) = set_up;
                config.faults = scanner.faults(faulting.as_ref(), args.addresses(&fitted, place).is_empty());
                let mut emulator = rig.scanner(device, view, config);
                let source = args.listen(&mut emulator, &fitted, place, stream.as_deref()).await?;
                (Running::Cola(emulator), source)
            }
            AnyModel::Lms2xx(model) => {
                let set_up =
                    args.lms2xx(&stage, &tractor, (scanner.index, model), stream, taping.taps()).await?;
                let (device, world, mut line, mut config) = set_up;
                if let Some(faults) = scanner.faults(faulting.as_ref(), false) {
                    let name = config.stream.as_deref().unwrap_or(model.name);
                    let tap = std::mem::take(&mut config.taps).open(name, StreamKind::Lms2xx);
                    line.wire = faulty_wire(line.wire, &faults, tap);
                }
                (Running::Lms2xx(rig.lms2xx(device, world, line.wire, config)), line.source)
            }
        };
        running.push(emulator);
        sources.extend(source.map(|source| format!(" {source}")));
    }
    if let Some(faulting) = &faulting {
        faulting.begin(script)?;
    }
    let _controlled = match &faulting {
        Some(faulting) => {
            let streams =
                running.iter().zip(&fitted).map(|(running, fitted)| (fitted.name(), running.counting()));
            let parts = vec![("streams".to_owned(), state_of(streams.collect()))];
            let bench = Bench::new(faulting.control().clone(), Arc::new(rig.control()), log, parts);
            let controlled = args.control.open(bench, args.format).await?;
            controlled.addresses().for_each(|address| rig.control().exclude(address));
            controlled
        }
        None => Controlled::default(),
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
    let mut missed = 0;
    for (scanner, fitted) in running.iter().zip(&fitted) {
        say(scanner.summary());
        scanner.end(fitted.stream(running.len()).as_deref()).tell(args.format)?;
        missed += scanner.missed();
    }
    drop((running, timeline));
    let outcome = taping.finish();
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

    /// A CoLa scanner as the flags have it.
    fn cola(
        &self,
        stage: &Stage,
        tractor: &Tractor,
        (index, model): (usize, &'static Model),
        stream: Option<String>,
        taps: Taps,
    ) -> Result<(Device, ScannerView, EmulatorConfig), Failure> {
        let (device, world) = stage.scanner_on(tractor, index, model)?;
        let (device, state, line_changes) = self.device.set_up(device, stage.scene.seed, index)?;
        let config = EmulatorConfig {
            taps,
            time_scale: self.scale(),
            dialects: self.dialect.into(),
            state,
            line_changes,
            stream,
            ..EmulatorConfig::default()
        };
        Ok((device, world, self.clients.of(config)))
    }

    /// An LMS2xx as the flags have it, with its line.
    async fn lms2xx(
        &self,
        stage: &Stage,
        tractor: &Tractor,
        (index, model): (usize, &'static lms2xx::model::Model),
        stream: Option<String>,
        taps: Taps,
    ) -> Result<(lms2xx::device::Device, ScannerView, Opened, SerialConfig), Failure> {
        let options = line::options(&self.device, &self.line, self.scale())?;
        let (mut device, world) = stage.serial_scanner_on(tractor, index, model, options)?;
        self.device.lms2xx_fields(&mut device)?;
        let state = self.device.lms2xx_state(&mut device)?;
        let rate = device.rate().bits_per_second();
        let line = self.line.open_one(&self.tcp, rate, self.format).await?;
        let config = SerialConfig { time_scale: self.scale(), state, taps, stream };
        Ok((device, world, line, config))
    }

    /// Has a CoLa scanner listen where the flags say; the source that reads it.
    async fn listen(
        &self,
        emulator: &mut Emulator,
        fitted: &[Fitted],
        place: usize,
        stream: Option<&str>,
    ) -> Result<Option<String>, Failure> {
        let mut source = None;
        for address in self.addresses(fitted, place) {
            let Bound { address } = emulator.listen(&address).await?;
            announce_stream(self.format, stream, "tcp", Place::Address(&address))?;
            source.get_or_insert_with(|| format!("tcp://{address}"));
        }
        if fitted.len() == 1 {
            for line in self.line.open(self.format, COLA_RATE).await? {
                emulator.attach(line.wire);
            }
        }
        Ok(source)
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

    /// Where the scanner at this place of those asked for listens.
    fn addresses(&self, fitted: &[Fitted], place: usize) -> Vec<String> {
        let before = fitted.iter().take(place).filter(|fitted| fitted.model.lms2xx().is_none()).count();
        match self.tcp.get(before) {
            Some(address) if fitted.len() > 1 => vec![address.clone()],
            Some(_) => self.tcp.clone(),
            None if fitted.len() == 1 && self.line.count() > 0 => Vec::new(),
            None => {
                let further = PORTS_APART.saturating_mul(u16::try_from(before).unwrap_or(u16::MAX));
                DEFAULT_PORTS.map(|port| format!("127.0.0.1:{}", port.saturating_add(further))).to_vec()
            }
        }
    }
}
