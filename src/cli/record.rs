//! `rowscan record`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{About, Side, StreamKind, StreamReport, Taps, account};
use rowscan_scenes::files;
use serde::Serialize;
use tokio::task::JoinSet;

use super::blocking::off_runtime;
use super::interrupt::Interrupt;
use super::link_events::LinkTeller;
use super::link_options::{Prefer, STOP_TIMEOUT, stream_kind};
use super::named::Named;
use super::output::{self, say};
use super::recorder::{self, DecodedArgs, ModelTeller};
use super::recording_file::{no_stream, open_stream, tell_capture, tell_damage, unreadable};
use super::repair;
use super::tractor_outputs::open_bus;
use super::{Failure, Format, Outcome};
use rowscan_bus::link::PortEvent;
use rowscan_bus::nmea::{NmeaReceiver, NmeaSource};
use rowscan_bus::{Bus, BusAddress, Inbox};
use rowscan_emulator::clock::{SimClock, TimeScale};
use rowscan_ports::task;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Scanners to record, or one recording of any kind to convert; `left=tcp://192.168.0.1:2112` gives a stream its name
    #[arg(required_unless_present_any = ["info", "repair", "nmea", "can"], value_name = "SOURCE")]
    sources: Vec<Named<Source>>,
    /// A GNSS receiver beside the scanners; repeatable: tcp:HOST:PORT, udp:ADDR:PORT, serial:DEV@RATE [its name: gnss]
    #[arg(long, value_name = "[NAME=]RECEIVER")]
    nmea: Vec<Named<NmeaSource>>,
    /// A port of a CAN bus beside them; repeatable: socketcan:can0, udp:GROUP:PORT, slcan:LINK, socketcand:ADDR, socketcand-client:HOST:PORT/BUS [its name: can]
    #[arg(long, value_name = "[NAME=]PORT")]
    can: Vec<Named<BusAddress>>,
    /// The file to write
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["info", "repair"])]
    output: Option<PathBuf>,
    /// Say what is inside a recording: streams, rates, gaps, clock drift
    #[arg(long, value_name = "FILE[#STREAM]", conflicts_with_all = ["sources", "nmea", "can", "output", "repair"])]
    info: Option<Source>,
    /// Write a recording anew, whole and indexed, to --output. Without it FILE must be an MCAP file that breaks off; it is kept as
    /// FILE.orig
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sources", "nmea", "can"])]
    repair: Option<PathBuf>,
    /// End after so many scans of each scanner
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    scans: Option<u64>,
    /// End after so many seconds, whether scans come or not
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// The rig the scanners sit on, kept in the file: a rig file, a scene file or a built-in scene's name
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    #[command(flatten)]
    decoded: DecodedArgs,
    /// The dialect tried first
    #[arg(long, value_enum, default_value_t)]
    prefer: Prefer,
    /// Wait for the scanners to appear instead of failing fast
    #[arg(long)]
    wait: bool,
    /// How to write --info
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds > 0.0);
    seconds.ok_or_else(|| format!("expected a number of seconds above 0, found `{text}`"))
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    match &args.info {
        Some(Source::Recording { path, stream }) => return info(path, stream.as_deref(), args.format),
        Some(live) => return Err(Failure::Usage(format!("{live} is live: `rowscan record` it first"))),
        None if matches!(args.format, Format::Csv | Format::Json) => {
            let asked = if args.format == Format::Csv { "csv" } else { "json" };
            return Err(Failure::Usage(format!(
                "--format {asked} is for --info: a command that records tells events, and events are neither rows nor one document; expected table or jsonl"
            )));
        }
        None => {}
    }
    let rig = args.rig.as_deref().map(|name| files::load_rig(name, say)).transpose()?.map(|(rig, _)| rig);
    let about = About {
        rig: rig.as_ref().and_then(recorder::rig_text),
        program: Some(recorder::program()),
        ..About::default()
    };
    if let Some(file) = args.repair.clone() {
        let work = move || repair::run(&file, args.output.as_deref(), about, args.decoded);
        return interrupt.finite(off_runtime("repair the recording", work)).await;
    }
    let Some(output) = &args.output else { return Ok(Outcome::Done) };
    if let [Named { it: Source::Recording { path, stream }, .. }] = args.sources.as_slice() {
        if args.scans.is_some() || args.seconds.is_some() {
            let why = "--scans and --seconds end what is recorded from live scanners; a recording is converted whole: leave them out";
            return Err(Failure::Usage(why.to_owned()));
        }
        let (path, stream, output, decoded) = (path.clone(), stream.clone(), output.clone(), args.decoded);
        let work = move || repair::convert(&path, stream.as_deref(), &output, about, decoded);
        return interrupt.finite(off_runtime("convert the recording", work)).await;
    }
    if let Some(Named { it: source, .. }) =
        args.sources.iter().find(|named| matches!(named.it, Source::Recording { .. }))
    {
        return Err(Failure::Usage(format!("{source} is a recording: convert recordings one at a time")));
    }
    live(&args, output, (about, rig), interrupt).await
}

/// Records live scanners and what is beside them until the user, or every scanner's count, ends it.
async fn live(
    args: &Args,
    output: &Path,
    (about, rig): (About, Option<Rig>),
    mut interrupt: Interrupt,
) -> Result<Outcome, Failure> {
    let beside = interrupt.or(Beside::open(args)).await.transpose()?;
    let Some(beside) = beside else { return Ok(Outcome::Done) };
    let sources = args.sources.iter().map(|named| named.it.to_string()).collect::<Vec<_>>();
    let mounts = mounts(rig.as_ref(), &args.sources);
    let about = About { source: Some(sources.join(" ")), mounts, ..about };
    let taping = recorder::start(output, args.decoded.into(), about, false)?;
    let limits = Limits { scans: args.scans, seconds: args.seconds };
    let _beside = beside.follow(&taping.taps());
    let mut scanners = JoinSet::new();
    for (place, named) in args.sources.iter().enumerate() {
        let mount = rig.as_ref().and_then(|rig| rig.scanners.get(place));
        let taken_for = mount.and_then(|mount| AnyModel::by_name(&mount.model));
        let config = DriverConfig { wait: args.wait, prefer: args.prefer.into(), ..DriverConfig::default() };
        let models = taping.models(args.sources.len());
        scanners.spawn(task(follow(named.clone(), config, (taping.taps(), models, taken_for), limits)));
    }
    if args.sources.is_empty() {
        scanners.spawn(task(limits.pass()));
    }
    let ended = tokio::select! {
        ended = all(&mut scanners) => ended,
        // It was told when it happened.
        () = taping.failed() => Ok(()),
        () = interrupt.wait() => Ok(()),
    };
    scanners.shutdown().await;
    // Dropped on the way out, the recording goes if nothing has come.
    ended?;
    Ok(taping.finish())
}

/// What the stream of a scanner is called.
fn stream_name(named: &Named<Source>) -> String {
    named.name.clone().unwrap_or_else(|| match &named.it {
        Source::Tcp { address } => address.clone(),
        Source::Picoscan(place) => place.address.clone(),
        other => other.to_string(),
    })
}

/// Which of the rig's scanners each source is, in its order, where there is one for each; with fewer nobody says which.
fn mounts(rig: Option<&Rig>, sources: &[Named<Source>]) -> BTreeMap<String, usize> {
    let is_whole = rig.is_some_and(|rig| rig.scanners.len() == sources.len());
    let named = sources.iter().map(stream_name).zip(0..).filter(|_| is_whole);
    named.collect()
}

/// What is recorded beside the scanners, opened.
struct Beside {
    receivers: Vec<(String, NmeaReceiver)>,
    buses: Vec<(String, Bus, Inbox)>,
}

impl Beside {
    /// Opens it all, so that what is missing is told before anything is written. Ports of one name are one bus.
    async fn open(args: &Args) -> Result<Self, Failure> {
        let (mut receivers, mut buses) = (Vec::new(), Vec::new());
        for Named { name, it } in &args.nmea {
            let name = name.clone().unwrap_or_else(|| "gnss".to_owned());
            receivers.push((name, it.clone().open().await?));
        }
        let mut ports: BTreeMap<&str, Vec<BusAddress>> = BTreeMap::new();
        for Named { name, it } in &args.can {
            ports.entry(name.as_deref().unwrap_or("can")).or_default().push(it.clone());
        }
        for (name, ports) in ports {
            let (bus, inbox) = open_bus(&ports, Some(name), args.format).await?;
            buses.push((name.to_owned(), bus, inbox));
        }
        Ok(Self { receivers, buses })
    }

    /// Records until the tasks are dropped.
    fn follow(self, taps: &Taps) -> JoinSet<()> {
        let mut tasks = JoinSet::new();
        for (name, mut receiver) in self.receivers {
            let tap = taps.open(&name, StreamKind::Nmea);
            tasks.spawn(task(async move {
                loop {
                    let heard = receiver.hear().await;
                    if !heard.is_empty() {
                        tap.record(Side::Device, heard);
                    }
                }
            }));
        }
        for (name, bus, mut inbox) in self.buses {
            let tap = taps.open(&name, StreamKind::Can);
            let clock = SimClock::start(TimeScale::Paced(1.0));
            tasks.spawn(task(async move {
                while let Some((port, heard)) = inbox.recv().await {
                    if let PortEvent::Frame(frame) = heard {
                        tap.record(Side::Device, frame.to_text().as_bytes());
                        // Several ports are one bus: each hears the others.
                        bus.send((clock.now(), frame), Some(port), rowscan_ports::Delivery::Paced).await;
                    }
                }
            }));
        }
        tasks
    }
}

/// Waits for every scanner; the first that fails ends the others.
async fn all(scanners: &mut JoinSet<Result<(), Failure>>) -> Result<(), Failure> {
    while let Some(ended) = scanners.join_next().await {
        match ended {
            Ok(ended) => ended?,
            Err(cause) => {
                return Err(Failure::System {
                    what: "follow a scanner",
                    cause: std::io::Error::other(cause),
                });
            }
        }
    }
    Ok(())
}

/// When a scanner has been recorded enough.
#[derive(Clone, Copy, Debug)]
struct Limits {
    scans: Option<u64>,
    seconds: Option<f64>,
}

impl Limits {
    /// Waits for the limit in time; for ever without one.
    async fn pass(self) -> Result<(), Failure> {
        match self.seconds {
            Some(seconds) => {
                let clock = SimClock::start(TimeScale::Paced(1.0));
                clock.reach(SimTime((seconds.clamp(0.0, 1e9) * 1e9) as u64)).await;
                Ok(())
            }
            None => std::future::pending().await,
        }
    }
}

async fn follow(
    named: Named<Source>,
    config: DriverConfig,
    (taps, models, taken_for): (Taps, ModelTeller, Option<AnyModel>),
    limits: Limits,
) -> Result<(), Failure> {
    let name = stream_name(&named);
    let config = DriverConfig { tap: taps.open(&name, stream_kind(&named.it)), ..config };
    let mut scanner = Scanner::open(&named.it, config).await?;
    models.tell(&name, &scanner.models(), taken_for);
    models.check_mount(&name, &scanner.models(), taken_for);
    let _telling = LinkTeller::start(&scanner, named.name.clone(), None);
    let mut scans = 0;
    let counted = async {
        while scanner.next().await?.is_some() {
            scans += 1;
            if limits.scans.is_some_and(|most| scans >= most) {
                break;
            }
        }
        Ok(())
    };
    // A scanner that has gone does not hold up the end.
    tokio::select! {
        ended = counted => ended,
        passed = limits.pass() => passed,
    }?;
    scanner.stop(STOP_TIMEOUT).await;
    Ok(())
}

/// All that is known of a recording.
#[derive(Debug, Serialize)]
struct Info {
    format: String,
    model: Option<String>,
    /// Of each stream, by its name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    models: BTreeMap<String, String>,
    /// The models that each stream's scanner can be, where it names a family.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    candidates: BTreeMap<String, String>,
    /// Which of the rig's scanners each stream is of, from 0.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    mounts: BTreeMap<String, usize>,
    scene: Option<String>,
    seed: Option<u64>,
    /// When the drive of a run began, nanoseconds since 1970 in log time, or `awaited`.
    #[serde(skip_serializing_if = "Option::is_none")]
    drive: Option<String>,
    source: Option<String>,
    program: Option<String>,
    rig: Option<String>,
    torn: Option<String>,
    streams: Vec<StreamReport>,
}

/// Tells what is inside. A file that breaks off is a finding.
fn info(file: &Path, stream: Option<&str>, format: Format) -> Result<Outcome, Failure> {
    let mut recording = open_stream(file, stream)?;
    let mut streams = account(&mut recording).map_err(|cause| unreadable(file, cause))?;
    tell_damage(file, (recording.format(), recording.main_kind()), recording.soundness())?;
    let lacks = tell_capture(file, &recording);
    if let Some(wanted) = stream {
        let found = streams.iter().map(|report| report.stream.clone()).collect();
        streams.retain(|report| report.stream == wanted);
        if streams.is_empty() {
            return Err(no_stream(file, wanted.to_owned(), found));
        }
    }
    let about = recording.about().clone();
    let torn = recording.torn().map(ToString::to_string);
    if let Some(torn) = &torn {
        let name = file.display();
        // Only MCAP is repaired in its place.
        let to = if recording.format() == rowscan_recording::Format::Mcap { "" } else { " -o NEW.mcap" };
        let is_behind = recording.torn().is_some_and(rowscan_recording::Torn::is_behind);
        let remedy = format!("; `rowscan record --repair {name}{to}` writes it anew");
        say(format_args!("{name}: {torn}{}", if is_behind { "" } else { &remedy }));
    }
    let outcome = if torn.is_some() { Outcome::Finding } else { lacks };
    let About {
        model,
        models,
        candidates,
        mounts,
        scene,
        rig,
        seed,
        drive,
        by_device_clock: _,
        source,
        program,
    } = about;
    let kind = recording.format().to_string();
    match format {
        Format::Json => {
            output::print_json(
                format,
                &Info {
                    format: kind,
                    model,
                    models,
                    candidates,
                    mounts,
                    scene,
                    seed,
                    drive: drive.map(|drive| drive.to_string()),
                    source,
                    program,
                    rig,
                    torn,
                    streams,
                },
            )?;
        }
        _ => {
            let known = [("model", model), ("scene", scene), ("source", source), ("written by", program)];
            let known = known.into_iter().filter_map(|(key, value)| Some(format!("{key} {}", value?)));
            say(std::iter::once(kind).chain(known).collect::<Vec<_>>().join(", "));
            output::print_rows(format, &streams)?;
        }
    }
    Ok(outcome)
}
