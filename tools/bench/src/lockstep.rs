//! The lockstep clock: simulated seconds a host second, and what a step costs, at each level of acknowledgement.
//!
//! Two LMS111 at 50 Hz pass a row of 100 m, with CAN and NMEA. The controller is a program of its own (`lockstep_reader.rs`), which waits in
//! poll() and decides on each scan. Without acknowledgements the clock runs as fast as it takes what is sent.

use std::net::SocketAddr;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use rowscan_bus::link::{Found, Link};
use rowscan_bus::nmea::{GnssEpochs, NmeaLine, NmeaPlace};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::lockstep::{Ack, Lockstep, LockstepConfig};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Compute, EmulatorConfig, EndWhen, Rig};
use rowscan_protocol::model;
use rowscan_recording::Taps;
use tokio::runtime::Builder;

use crate::lockstep_reader::NAME;
use crate::measure::{Case, Report};

const WAY_M: f64 = 100.0;
/// Scans a simulated second.
const HERTZ: f64 = 50.0;
/// Simulated seconds a host second that `idle` is wanted to reach.
const WANTED: f64 = 20.0;
const DEADLINE: Duration = Duration::from_secs(5);

/// Levels by their names on the command line; nothing is `--time-scale max`.
const LEVELS: [&str; 6] = ["", "sent", "read", "idle", "reply:127.0.0.1:0", "output:tcp:127.0.0.1:0"];

/// Runs all levels; `metres N` among the arguments shortens the drive, `level NAME` runs one.
pub fn run(report: &mut Report, arguments: &[String]) {
    let asked = |what: &str| Some(arguments.windows(2).find(|pair| pair[0] == what)?[1].clone());
    let way_m = asked("metres").and_then(|metres| metres.parse().ok()).unwrap_or(WAY_M);
    let mut scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("a built-in scene");
    scene.orchard.trees = Some((way_m / scene.orchard.layout().tree_spacing_m).ceil() as u32);
    let stage = Stage::grow(scene, &|_, _| {}).expect("the built-in scene grows");
    let chosen = asked("level");
    for level in LEVELS {
        let name = level.split(':').next().filter(|name| !name.is_empty()).unwrap_or("none");
        if chosen.as_deref().is_none_or(|chosen| chosen == name) {
            measure(report, &stage, (name, level), way_m);
        }
    }
}

fn measure(report: &mut Report, stage: &Stage, (name, level): (&str, &str), way_m: f64) {
    let runtime = Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let (simulated_s, host) = runtime.block_on(drive(stage, level, way_m));
    let case = |what: &str, unit, peer| Case {
        name: format!("{name}: {what}"),
        unit,
        peer,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
        work: [1.0; 2],
    };
    let speed = simulated_s / host.as_secs_f64();
    report.more_is_better(
        &case("simulated time", "s a host second", "what idle is wanted to reach"),
        speed,
        WANTED,
    );
    let step_ms = host.as_secs_f64() * 1e3 / (simulated_s * HERTZ);
    report.less_is_better(&case("a step", "ms", "a step of real time"), step_ms, 1e3 / HERTZ);
}

/// Drives once past the row: how long it was, simulated, and on the host.
async fn drive(stage: &Stage, level: &str, way_m: f64) -> (f64, Duration) {
    let tractor = stage.tractor();
    let mut rig =
        Rig::new(tractor.clone(), TimeScale::Max).with_timer(Timer::system()).until(EndWhen::WayM(way_m));
    let mut streams = Vec::new();
    if !level.is_empty() {
        let acks = vec![level.parse::<Ack>().expect("a level")];
        let lockstep =
            Lockstep::open(LockstepConfig { acks, deadline: DEADLINE, compute: Compute::default() })
                .await
                .expect("it opens");
        streams.extend(lockstep.endpoints().map(|(name, address)| argument(name, address)));
        rig = rig.in_lockstep(lockstep);
    }
    let mut can = None;
    let address: BusAddress = "socketcand:127.0.0.1:0".parse().expect("an address");
    let mut tell = |link: &Link| {
        if let Found::Address(address) = link.found() {
            can = Some(argument("can", address));
        }
    };
    let bus = Bus::open(&[address], &mut tell).await.expect("a free port");
    streams.extend(can);
    rig.bus("can0", TractorEcu::new(tractor.clone(), stage.receiver()), bus, None, &Taps::default());
    let address = "tcp:127.0.0.1:0".parse().expect("an address");
    let line = NmeaLine::open(&address, stage.scene.gnss.rate_hz).await.expect("a free port");
    if let NmeaPlace::Address(address) = line.place() {
        streams.push(argument("gnss", *address));
    }
    rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), vec![line], &Taps::default());
    let mut scanners = Vec::new();
    for _ in 0..2 {
        let (device, view) =
            stage.scanner(0, model::by_name("lms111").expect("a model")).expect("it is on the rig");
        let mut scanner = rig.scanner(device, view, EmulatorConfig::default());
        let bound = scanner.listen("127.0.0.1:0").await.expect("a free port");
        streams.push(argument("lms", bound.address));
        scanners.push(scanner);
    }
    let clock = rig.clock();
    let mut running = rig.run();
    let _reader = Reader::start(&streams);
    while tractor.began().is_none() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    let (from, start) = (clock.now(), Instant::now());
    running.ended().await.expect("every step is acknowledged");
    (clock.now().as_secs_f64() - from.as_secs_f64(), start.elapsed())
}

fn argument(name: &str, address: SocketAddr) -> String {
    format!("{name}={address}")
}

/// The controller, for as long as this exists.
struct Reader(Child);

impl Reader {
    fn start(streams: &[String]) -> Self {
        let program = std::env::current_exe().expect("this program has a path");
        Self(Command::new(program).arg(NAME).args(streams).spawn().expect("it starts"))
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
