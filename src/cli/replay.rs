//! `rowscan replay`

use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use rowscan_protocol::device::Device;
use rowscan_protocol::model::{self, AnyModel};
use rowscan_protocol::rig::Rig;
use rowscan_recording::StreamKind;
use tokio::sync::mpsc;

use super::endpoint::{Place, announce};
use super::interrupt::Interrupt;
use super::output::say;
use super::recorder::RecordArgs;
use super::{Failure, Format, Outcome, models};
use crate::clock::{SimClock, TimeScale, Timer};
use crate::config;
use crate::emulator::{Bound, Emulator, EmulatorConfig, MAX_CLIENTS};
use crate::line::Pty;
use crate::replay::{Part, Played, Playhead, ReplayError, Stamps, Survey, Tape, device_of, model_of};

/// Where a SICK scanner listens; both ports take the same commands.
const DEFAULT_ENDPOINTS: [&str; 2] = ["127.0.0.1:2111", "127.0.0.1:2112"];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording: MCAP, pcap, pcapng, raw bytes, hex text, CSV of ranges
    file: PathBuf,
    /// Listen on this address; repeatable, one a stream, in the order of the streams; port 0 takes a free one [default: 127.0.0.1:2111 and
    /// 127.0.0.1:2112]
    #[arg(long, value_name = "ADDR")]
    tcp: Vec<String>,
    /// Be a serial port of this name; repeatable, one a stream, behind those of --tcp
    #[arg(long, value_name = "LINK")]
    pty: Vec<PathBuf>,
    /// Which stream to be; repeatable [default: the first ones with scans, as many as there are endpoints]
    #[arg(long, value_name = "NAME")]
    stream: Vec<String>,
    /// Scanner model that answers what was not recorded [default: the recorded one]
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Send what was recorded, replies too, to whoever connects, and listen to nobody
    #[arg(long)]
    verbatim: bool,
    /// Recorded seconds a second, or `max`: as fast as the clients take it
    #[arg(long, value_name = "K", default_value = "1")]
    time_scale: TimeScale,
    /// Begin anew at the end
    #[arg(long = "loop")]
    repeat: bool,
    /// Where to begin: `12.5s` from the first event, `scan:100`, `metre:3.2` of the row
    #[arg(long, value_name = "PLACE")]
    from: Option<Seek>,
    /// Where to end; as --from
    #[arg(long, value_name = "PLACE")]
    until: Option<Seek>,
    /// Counters and device times
    #[arg(long, value_enum, default_value_t)]
    stamps: StampsArg,
    /// The rig that `metre:` goes by, instead of the recorded one
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// Take `pause`, `play` and `seek PLACE` from standard input, a line each
    #[arg(long)]
    control: bool,
    /// Clients served at once by each stream
    #[arg(long, value_name = "N", default_value_t = MAX_CLIENTS)]
    max_clients: usize,
    /// How to tell where it listens; jsonl writes one object an endpoint to standard output
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    #[command(flatten)]
    record: RecordArgs,
}

/// What becomes of counters and device times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum StampsArg {
    /// As recorded
    #[default]
    Keep,
    /// As a scanner would send them now; the calendar stays as recorded
    Now,
}

/// A place in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Seek {
    Seconds(f64),
    Scan(u64),
    Metre(f64),
}

impl FromStr for Seek {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("expected a place such as `12.5s`, `scan:100` or `metre:3.2`, found `{text}`");
        let number = |text: &str| text.parse::<f64>().ok().filter(|n| n.is_finite() && *n >= 0.0 && *n < 1e9);
        if let Some(scan) = text.strip_prefix("scan:") {
            return scan.parse().map(Self::Scan).map_err(|_| wrong());
        }
        if let Some(metre) = text.strip_prefix("metre:") {
            return number(metre).map(Self::Metre).ok_or_else(wrong);
        }
        text.strip_suffix('s').and_then(number).map(Self::Seconds).ok_or_else(wrong)
    }
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut interrupt = Interrupt::watch()?;
    let asked = args.model.as_deref().map(cola_model).transpose()?;
    let survey = Survey::read(&args.file)?;
    if let Some(torn) = &survey.torn {
        say(format_args!("{}: {torn}; what comes before is played", args.file.display()));
    }
    let endpoints = (args.tcp.len() + args.pty.len()).max(1);
    let parts = survey.choose(&args.stream, endpoints)?;
    let begins_ns = parts.iter().filter_map(|part| part.begins_ns).min().unwrap_or_default();
    let ends_ns = parts.iter().map(|part| part.ends_ns).max().unwrap_or_default();
    let places = Places { args: &args, survey: &survey, part: parts.first().copied(), begins_ns, ends_ns };
    let from_ns = args.from.map_or(Ok(0), |place| places.find(place))?;
    let until_ns = args.until.map_or(Ok(u64::MAX), |place| places.find(place))?;
    let start_ns = from_ns.max(begins_ns);
    // From the last event to the first of the next round passes as long as between two scans.
    let period_ns = parts.iter().map(|part| part.period_ns()).min().unwrap_or(1);
    let every_ns = until_ns.min(ends_ns.saturating_add(period_ns)).saturating_sub(start_ns).max(1);
    let played = Played {
        from_ns,
        until_ns,
        every_ns: args.repeat.then_some(every_ns),
        stamps: match args.stamps {
            StampsArg::Keep => Stamps::Keep,
            StampsArg::Now => Stamps::Now,
        },
        verbatim: args.verbatim,
    };
    let clock = Arc::new(SimClock::start(args.time_scale));
    let playhead = Arc::new(Playhead::new(parts.len(), start_ns));
    let taping = args.record.start(survey.about.clone(), args.time_scale == TimeScale::Max)?;
    let mut emulators = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        let device = device(&args, &survey, part, asked)?;
        let config = EmulatorConfig {
            time_scale: args.time_scale,
            timer: Timer::System,
            max_clients: args.max_clients,
            taps: taping.taps(),
            ..EmulatorConfig::default()
        };
        let tape = Tape::open(survey.path.clone(), part, played)?;
        let seat = (Arc::clone(&playhead), number);
        let script = Arc::clone(&part.script);
        emulators.push(Emulator::replay(device, &part.name, script, tape, seat, Arc::clone(&clock), config));
    }
    listen(&args, &mut emulators).await?;
    for part in &parts {
        let answers = part.script.len();
        say(format_args!("{}: {} scans, {answers} recorded answers", part.name, part.scans));
    }
    say("it begins with the first taker of every stream");
    let mut orders = args.control.then(read_orders);
    loop {
        tokio::select! {
            () = all_ended(&emulators) => break,
            () = interrupt.wait() => break,
            order = next_order(&mut orders) => match order {
                Order::Pause(paused) => playhead.pause(paused, clock.now()),
                Order::Seek(place) => match places.find(place) {
                    Ok(to_ns) => playhead.seek(to_ns.max(start_ns), clock.now()),
                    Err(error) => say(error),
                },
                Order::Unknown(text) => {
                    say(format_args!("expected `pause`, `play` or `seek PLACE`, found `{text}`"));
                }
            },
        }
    }
    for (emulator, part) in emulators.iter().zip(&parts) {
        let counts = emulator.counts();
        let late = |fraction| emulator.lateness(fraction).unwrap_or_default();
        say(format_args!(
            "{}: {} telegrams sent, {} dropped for slow clients; late by {:?} (p50), {:?} (p99)",
            part.name,
            counts.scans_sent,
            counts.scans_dropped,
            late(0.5),
            late(0.99)
        ));
    }
    drop(emulators);
    Ok(taping.finish())
}

/// The model called `name`, if it speaks CoLa.
fn cola_model(name: &str) -> Result<&'static model::Model, Failure> {
    match models::find(name)? {
        AnyModel::Cola(model) => Ok(model),
        AnyModel::Lms2xx(model) => {
            let title = model.title;
            Err(Failure::Usage(format!(
                "{title} speaks no CoLa, which is what can be replayed; `rowscan models` lists those that do"
            )))
        }
    }
}

/// The device that answers what the recording does not.
fn device(
    args: &Args,
    survey: &Survey,
    part: &Part,
    asked: Option<&'static model::Model>,
) -> Result<Device, Failure> {
    // Nobody is answered.
    let silent = args.verbatim || part.kind != StreamKind::Cola;
    let model = match model_of(survey, part, asked) {
        Err(ReplayError::UnknownModel { .. }) if silent => cola_model("lms111")?,
        found => found?,
    };
    if !silent && part.ident.is_none() && asked.is_none() && survey.about.model.is_none() {
        say(format_args!("{}: taken for an {} by its beams; --model says otherwise", part.name, model.title));
    }
    Ok(device_of(part, model))
}

async fn listen(args: &Args, emulators: &mut [Emulator]) -> Result<(), Failure> {
    let last = emulators.len().saturating_sub(1);
    let mut bound = Vec::new();
    if args.tcp.is_empty() && args.pty.is_empty() {
        for (number, address) in DEFAULT_ENDPOINTS.iter().enumerate() {
            if let Some(emulator) = emulators.get_mut(number.min(last)) {
                bound.push(emulator.listen(address).await?);
            }
        }
    }
    for (number, address) in args.tcp.iter().enumerate() {
        if let Some(emulator) = emulators.get_mut(number.min(last)) {
            bound.push(emulator.listen(address).await?);
        }
    }
    for Bound { address } in &bound {
        announce(args.format, "tcp", Place::Address(address))?;
    }
    for (number, link) in args.pty.iter().enumerate() {
        if let Some(emulator) = emulators.get_mut((args.tcp.len() + number).min(last)) {
            let pty = Pty::open(link)?;
            announce(args.format, "pty", Place::Path(pty.path()))?;
            emulator.attach(pty);
        }
    }
    Ok(())
}

async fn all_ended(emulators: &[Emulator]) {
    for emulator in emulators {
        emulator.ended().await;
    }
}

/// Finds places in recorded time.
struct Places<'a> {
    args: &'a Args,
    survey: &'a Survey,
    part: Option<&'a Part>,
    begins_ns: u64,
    ends_ns: u64,
}

impl Places<'_> {
    fn find(&self, place: Seek) -> Result<u64, Failure> {
        let refuse = |what: String| ReplayError::Seek {
            what,
            scans: self.part.map_or(0, |part| part.scans),
            seconds: self.ends_ns.saturating_sub(self.begins_ns) as f64 * 1e-9,
        };
        let found = match place {
            Seek::Seconds(seconds) => Some(self.begins_ns.saturating_add((seconds * 1e9) as u64)),
            Seek::Scan(number) => match self.part {
                Some(part) => self.survey.scan_at(part, number)?,
                None => None,
            },
            Seek::Metre(metre) => {
                let rig = self.rig()?.ok_or_else(|| {
                    refuse("a place in the row needs a rig, and none is recorded: say --rig".to_owned())
                })?;
                self.part.and_then(|part| part.at_metre(&rig, metre))
            }
        };
        let found = found.filter(|found| *found <= self.ends_ns);
        Ok(found.ok_or_else(|| refuse(format!("there is no {}", told(place))))?)
    }

    fn rig(&self) -> Result<Option<Rig>, Failure> {
        if let Some(name) = &self.args.rig {
            return Ok(Some(config::load_rig(name)?.0));
        }
        Ok(self.survey.about.rig.as_deref().and_then(|text| toml::from_str(text).ok()))
    }
}

fn told(place: Seek) -> String {
    match place {
        Seek::Seconds(seconds) => format!("second {seconds}"),
        Seek::Scan(number) => format!("scan {number} (they are counted from 0)"),
        Seek::Metre(metre) => format!("metre {metre}"),
    }
}

/// What the user tells a running replay.
enum Order {
    Pause(bool),
    Seek(Seek),
    Unknown(String),
}

/// Reads orders on a thread of its own: standard input cannot be waited for otherwise.
fn read_orders() -> mpsc::Receiver<Order> {
    let (orders, taken) = mpsc::channel(16);
    std::thread::spawn(move || {
        for line in std::io::stdin().lines().map_while(Result::ok) {
            let order = match line.trim() {
                "" => continue,
                "pause" => Order::Pause(true),
                "play" => Order::Pause(false),
                other => match other.strip_prefix("seek ").map(|place| place.trim().parse()) {
                    Some(Ok(place)) => Order::Seek(place),
                    _ => Order::Unknown(other.to_owned()),
                },
            };
            if orders.blocking_send(order).is_err() {
                return;
            }
        }
    });
    taken
}

/// The next order; never, where none can come. Cancel safe.
async fn next_order(orders: &mut Option<mpsc::Receiver<Order>>) -> Order {
    if let Some(taken) = orders {
        if let Some(order) = taken.recv().await {
            return order;
        }
        *orders = None;
    }
    std::future::pending().await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_a_time_a_scan_or_a_metre() {
        assert_eq!("12.5s".parse(), Ok(Seek::Seconds(12.5)));
        assert_eq!("scan:100".parse(), Ok(Seek::Scan(100)));
        assert_eq!("metre:3.2".parse(), Ok(Seek::Metre(3.2)));
        for nonsense in ["", "12", "-1s", "nans", "scan:x", "metre:-1", "tree:4"] {
            assert!(nonsense.parse::<Seek>().expect_err(nonsense).contains("scan:100"));
        }
    }
}
