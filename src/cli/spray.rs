//! `rowscan spray`: the reference controller between a scanner and the valves of a boom.

use std::path::PathBuf;

use rowscan_bus::name::Name;
use rowscan_bus::pgn::gnss::COURSE_RAPID;
use rowscan_bus::pgn::network::ADDRESS_CLAIMED;
use rowscan_bus::pgn::sprayer::{NOZZLE_DUTY, NOZZLES, SECTION_DUTIES, SECTIONS};
use rowscan_bus::pgn::tractor::{GROUND_SPEED, ground_speed_m_s};
use rowscan_bus::{Bus, BusAddress, CanFrame, J1939Id, PortEvent};
use rowscan_driver::{DriverConfig, DriverError, Scanner, Source};
use rowscan_ports::Delivery;
use rowscan_ports::task;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::files;
use rowscan_sprayer::controller::LEAST_BEAMS;
use rowscan_sprayer::{Boom, Controller, nozzles_ahead_m};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::interrupt::Interrupt;
use super::output::{print, say};
use super::{Failure, Outcome};

/// The largest file of a boom.
const LARGEST: u64 = 1024 * 1024;
/// Scans that may wait to be taken.
const QUEUE: usize = 4;
/// Its address on the bus, that of the example controllers.
const ADDRESS: u8 = 0x27;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// tcp://HOST:PORT, picoscan://HOST:PORT?udp=2115, serial:/dev/ttyUSB0?baud=38400 or rfc2217://HOST:PORT; one for each scanner of the rig, in its order
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<Source>,
    /// The bus with the tractor's speed and the valves: socketcan:can0, socketcand-client:HOST:PORT/can0, udp:239.74.163.2:43113, slcan:LINK
    #[arg(long, value_name = "PORT", required = true)]
    can: BusAddress,
    /// The file that describes the boom
    #[arg(long, value_name = "FILE", required = true)]
    boom: PathBuf,
    /// Where the scanners sit: a rig file, a scene file or a built-in scene's name; without it one on the right, 1.9 m before the row's axis and 1.6 m high
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// From the end of a scan until a valve hears of it, milliseconds: computing, and the bus
    #[arg(long, value_name = "MS", default_value_t = 20.0, value_parser = late_ms)]
    late_ms: f64,
    /// Beams of a scan in a nozzle's share of height that are taken for canopy
    #[arg(long, value_name = "N", default_value_t = LEAST_BEAMS, value_parser = clap::value_parser!(u16).range(1..=1000))]
    least_beams: u16,
    /// Wait for scanner and bus however long they are silent: for a bench whose time is not the host's
    #[arg(long)]
    patient: bool,
}

fn late_ms(text: &str) -> Result<f64, String> {
    let expected = || format!("expected milliseconds from 0 to 2000, found `{text}`");
    let value: f64 = text.parse().map_err(|_| expected())?;
    (0.0..=2000.0).contains(&value).then_some(value).ok_or_else(expected)
}

/// Reads the file of a boom.
pub(super) fn read_boom(path: &std::path::Path) -> Result<Boom, Failure> {
    let what = || path.display().to_string();
    let bytes = rowscan_files::read(path, LARGEST).map_err(|cause| Failure::Read { what: what(), cause })?;
    let refused = |why: &dyn std::fmt::Display| Failure::Usage(format!("{}: {why}", what()));
    let text =
        String::from_utf8(bytes).map_err(|_| refused(&"expected text, found bytes that are not UTF-8"))?;
    Boom::read(&text).map_err(|error| refused(&error))
}

/// Says where nozzles are ahead of all that sees the row for them.
pub(super) fn say_nozzles_ahead(boom: &Boom, rig: &Rig) {
    if let Some(ahead_m) = nozzles_ahead_m(boom, &rig.scanners) {
        say(format_args!(
            "nozzles are up to {ahead_m:.2} m ahead of where a scanner of their side sees the row, and open late; compare the boom's `offset_y_m` with the mount's, or set the scanner ahead of the boom"
        ));
    }
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    let boom = read_boom(&args.boom)?;
    let rig = match &args.rig {
        Some(name) => files::load_rig(name, say)?.0,
        None => Rig::default(),
    };
    if rig.scanners.len() != args.sources.len() {
        return Err(Failure::Usage(format!(
            "expected one SOURCE for each scanner of the rig, {} in all, found {}; name the others, or another --rig",
            rig.scanners.len(),
            args.sources.len()
        )));
    }
    if let Some(file) = args.sources.iter().find(|source| source.file().is_some()) {
        return Err(Failure::Usage(format!(
            "expected a live scanner, such as tcp://HOST:PORT, found the file {file}"
        )));
    }
    say_nozzles_ahead(&boom, &rig);
    let controller = Controller::new(boom, &rig.scanners, args.late_ms / 1e3)
        .map_err(|error| Failure::Usage(error.to_string()))?
        .with_ground(&rig)
        .with_least_beams(args.least_beams);
    let config = DriverConfig::default();
    let config = if args.patient { config.patient() } else { config };
    let (bus, mut heard) = Bus::open(std::slice::from_ref(&args.can), &mut |_| {}).await?;
    let mut sprayer = Sprayer { controller, bus, told: Vec::new(), at: SimTime::ZERO };
    sprayer.claim().await;
    let (scans, mut seen) = mpsc::channel(QUEUE);
    let mut tasks = JoinSet::new();
    for (number, source) in args.sources.iter().enumerate() {
        let Some(scanner) = interrupt.or(Scanner::open(source, config.clone())).await.transpose()? else {
            return Ok(Outcome::Done);
        };
        let scans = scans.clone();
        tasks.spawn(task(follow(number, scanner, scans)));
    }
    drop(scans);
    print("ready\n")?;
    loop {
        tokio::select! {
            biased;
            () = interrupt.wait() => break,
            event = heard.recv() => match event {
                Some((_, PortEvent::Frame(frame))) => sprayer.hear(&frame).await,
                Some((_, PortEvent::Lost(why))) => say(why),
                Some((_, PortEvent::Opened)) => sprayer.claim().await,
                Some((_, PortEvent::Refused(_))) => {}
                None => break,
            },
            scan = seen.recv() => match scan {
                Some((number, Ok(scan))) => sprayer.see(number, &scan).await,
                Some((number, Err(error))) => {
                    say(format_args!("scanner {number} is lost: {error}"));
                    sprayer.controller.on_scanner_lost(number);
                    sprayer.tell(false).await;
                }
                None => break,
            },
        }
    }
    // Whatever ends it, it leaves no valve open.
    sprayer.shut().await;
    Ok(Outcome::Done)
}

/// Hands on the scans of one scanner, and why no more come.
async fn follow(
    number: usize,
    mut scanner: Scanner,
    scans: mpsc::Sender<(usize, Result<Scan, DriverError>)>,
) {
    loop {
        let next = match scanner.next().await {
            Ok(Some(record)) => Ok(record.scan.clone()),
            Ok(None) => return,
            Err(error) => Err(error),
        };
        let is_over = next.is_err();
        if scans.send((number, next)).await.is_err() || is_over {
            return;
        }
    }
}

/// The controller on its bus.
struct Sprayer {
    controller: Controller,
    bus: Bus,
    /// What the valves were told.
    told: Vec<f64>,
    at: SimTime,
}

impl Sprayer {
    async fn hear(&mut self, frame: &CanFrame) {
        match J1939Id::of(frame.id).map(|id| id.pgn) {
            Some(pgn) if pgn == GROUND_SPEED.pgn => {
                self.controller.on_speed(ground_speed_m_s(frame.data()));
                // Each speed is a heartbeat, for a watchdog at the valves.
                self.tell(true).await;
            }
            Some(pgn) if pgn == COURSE_RAPID.pgn => {
                if let Some(course_rad) = COURSE_RAPID.decode(frame.data()).get(2).copied().flatten() {
                    self.controller.on_course(course_rad);
                    self.tell(false).await;
                }
            }
            _ => {}
        }
    }

    async fn see(&mut self, number: usize, scan: &Scan) {
        self.controller.on_scan(number, scan);
        self.tell(false).await;
    }

    /// Tells the valves what is to be done, where that is news or `always`.
    async fn tell(&mut self, always: bool) {
        let duties = self.controller.duties();
        if always || duties != self.told {
            self.send(&duties).await;
            self.told = duties;
        }
    }

    async fn shut(&mut self) {
        let shut = vec![0.0; self.controller.boom().sections.len()];
        self.send(&shut).await;
        self.bus.written().await;
    }

    async fn claim(&self) {
        let id = J1939Id { destination: 0xFF, ..ADDRESS_CLAIMED.id(ADDRESS) };
        let frame = CanFrame::new(id.id(), &Name::sprayer_controller().0.to_le_bytes());
        if let Some(frame) = frame {
            self.bus.send((self.at, frame), None, Delivery::Patient).await;
        }
    }

    /// Sections 1 to 16 by `SectionDuty` and `MoreSectionDuty`; nozzles of others by `NozzleDuty`.
    async fn send(&self, duties: &[f64]) {
        for frame in frames(self.controller.boom(), duties) {
            self.bus.send((self.at, frame), None, Delivery::Patient).await;
        }
    }
}

/// The messages that tell a boom's sections these duties.
fn frames(boom: &Boom, duties: &[f64]) -> Vec<CanFrame> {
    let percent = |section: usize| duties.get(section).map(|duty| duty * 100.0);
    let numbers: Vec<u16> = boom.numbers().collect();
    let place = |number: usize| numbers.iter().position(|own| usize::from(*own) == number);
    let of_sections = SECTION_DUTIES.iter().filter_map(|(first, message)| {
        let own = usize::from(*first)..usize::from(*first) + SECTIONS;
        let values: Vec<Option<f64>> = own.map(|number| percent(place(number)?)).collect();
        values.iter().any(Option::is_some).then(|| {
            let data = message.encode(&values);
            CanFrame::new(message.id(ADDRESS).id(), data.bytes())
        })
    });
    let mut nozzles: Vec<[Option<f64>; NOZZLES]> = Vec::new();
    for nozzle in boom.nozzles() {
        let is_beyond = |number: &u16| usize::from(*number) > SECTION_DUTIES.len() * SECTIONS;
        if numbers.get(nozzle.section).is_some_and(is_beyond) {
            let frame = nozzle.number / NOZZLES;
            nozzles.resize(nozzles.len().max(frame + 1), [None; NOZZLES]);
            nozzles[frame][nozzle.number % NOZZLES] = percent(nozzle.section);
        }
    }
    let of_nozzles = nozzles.iter().enumerate().filter(|(_, duties)| duties.iter().any(Option::is_some)).map(
        |(frame, duties)| {
            let first = [Some((frame * NOZZLES) as f64)];
            let values: Vec<Option<f64>> = first.into_iter().chain(duties.iter().copied()).collect();
            CanFrame::new(NOZZLE_DUTY.id(ADDRESS).id(), NOZZLE_DUTY.encode(&values).bytes())
        },
    );
    of_sections.chain(of_nozzles).flatten().collect()
}
