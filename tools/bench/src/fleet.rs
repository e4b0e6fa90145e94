//! Many scanners, and many clients of one, at 50 Hz over loopback TCP: what they cost, and how late their scans come.
//!
//! All scanners run on one thread, all clients on another. Lateness is host time from the instant the mirror passes its zero
//! index until a client has read the whole telegram. A third thread only sleeps to the same kind of deadline: what it
//! is late by is the machine's doing.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig};
use rowscan_protocol::model;
use rowscan_protocol::time::SimTime;
use rustix::process::{Resource, getrlimit, setrlimit};
use rustix::time::{ClockId, clock_gettime};
use tokio::sync::oneshot;
use tokio::task::JoinSet;

use crate::loopback::{
    CONTROL, lateness, monotonic, quantile_ms, reading, runtime, sleep_to, sleep_until, subscribe,
};
use crate::measure::{Case, Report};

const PERIOD: Duration = Duration::from_millis(20);
/// Time for all to connect and settle, and time measured.
const WARM_UP: Duration = Duration::from_secs(2);
const MEASURED: Duration = Duration::from_secs(5);
/// From one scanner's start to the next one's, in periods: the golden ratio's share, whose multiples lie evenly wherever one stops.
const PHASE: f64 = 0.038_196_601_125;

const SIZES: [usize; 3] = [100, 500, 1000];
const CORE: &str = "one core";
const BUDGET: &str = "a thousandth of a core at 50 Hz";

/// Runs all cases.
///
/// `scanners N`, `parked N` or `clients N` among the arguments runs that case alone.
pub fn run(report: &mut Report, arguments: &[String]) {
    raise_descriptor_limit();
    let stage = |speed_m_s| {
        let mut scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("a built-in scene");
        scene.rig.speed_m_s = speed_m_s;
        Stage::grow(scene, &|_, _| {}).expect("the built-in scene grows")
    };
    let (driving, parked) = (stage(1.0), stage(0.0));
    let asked = |what: &str| {
        let size = arguments.windows(2).find(|pair| pair[0] == what)?[1].parse().ok()?;
        Some(vec![size])
    };
    let wanted = ["scanners", "parked", "clients"].map(asked);
    let [scanners, standing, clients] = match wanted {
        [None, None, None] => [const { SIZES }; 3].map(Vec::from),
        wanted => wanted.map(Option::unwrap_or_default),
    };
    for scanners in scanners {
        measure(
            report,
            &driving,
            Fleet { scanners, clients_each: 1, what: "driving scanners with a client each" },
        );
    }
    for scanners in standing {
        measure(
            report,
            &parked,
            Fleet { scanners, clients_each: 1, what: "parked scanners with a client each" },
        );
    }
    for clients_each in clients {
        measure(report, &driving, Fleet { scanners: 1, clients_each, what: "clients of one scanner" });
    }
}

#[derive(Clone, Copy)]
struct Fleet {
    scanners: usize,
    clients_each: usize,
    what: &'static str,
}

/// What a scanner's clients need: where it listens, and when its simulated time began.
struct Berth {
    address: String,
    epoch: Instant,
}

fn measure(report: &mut Report, stage: &Stage, fleet: Fleet) {
    let (berths, moored) = mpsc::channel();
    let (start_seen, started) = oneshot::channel();
    thread::scope(|threads| {
        let scanners = threads.spawn(move || {
            runtime().block_on(async {
                let emulators = launch(stage, fleet, &berths).await;
                drop(berths);
                // They are taken in meanwhile.
                started.await.expect("the clients are there");
                tokio::time::sleep(WARM_UP).await;
                let (wall, cpu) = (Instant::now(), thread_time());
                tokio::time::sleep(MEASURED).await;
                let cores = (thread_time() - cpu).as_secs_f64() / wall.elapsed().as_secs_f64();
                drop(emulators);
                cores
            })
        });
        let control = threads.spawn(sleep_to_deadlines);
        let berths: Vec<Berth> = moored.iter().collect();
        let lateness = runtime().block_on(listen(berths, fleet.clients_each, || {
            start_seen.send(()).expect("the scanners wait for it");
        }));
        let cores = scanners.join().expect("the scanners end well");
        let control = control.join().expect("the control ends well");
        tell(report, fleet, Figures { cores, lateness, control });
    });
}

struct Figures {
    cores: f64,
    lateness: Vec<Duration>,
    control: Vec<Duration>,
}

fn tell(report: &mut Report, fleet: Fleet, figures: Figures) {
    let Figures { cores, lateness, control } = figures;
    let streams = fleet.scanners * fleet.clients_each;
    let name = format!("{streams} {}, 50 Hz", fleet.what);
    let scans = streams as f64 * MEASURED.div_duration_f64(PERIOD);
    let case = |what: &str, unit, peer| Case {
        name: format!("{name}: {what}"),
        unit,
        peer,
        threads: 1,
        work: [0.0; 2],
    };
    report.more_is_better(&case("scans taken", "of those due", "all"), lateness.len() as f64 / scans, 1.0);
    report.less_is_better(&case("CPU of the scanners' thread", "cores", CORE), cores, 1.0);
    let a_scan_us = cores * MEASURED.as_secs_f64() * 1e6 / lateness.len() as f64;
    report.less_is_better(&case("CPU a scan taken", "µs", BUDGET), a_scan_us, 20.0);
    for (what, fraction) in [("lateness p50", 0.5), ("lateness p99", 0.99)] {
        let (ours, control) = (quantile_ms(&lateness, fraction), quantile_ms(&control, fraction));
        report.less_is_better(&case(what, "ms", CONTROL), ours, control);
    }
}

/// Starts the scanners one after the other, their phases spread evenly over a period: each comes so much later than the one before that
/// no number of them falls into step.
async fn launch(stage: &Stage, fleet: Fleet, berths: &mpsc::Sender<Berth>) -> Vec<Emulator> {
    let model = model::by_name("lms111").expect("a model");
    let timer = Timer::system();
    let mut due = monotonic();
    let mut emulators = Vec::with_capacity(fleet.scanners);
    for _ in 0..fleet.scanners {
        let (device, world) = stage.scanner(0, model).expect("the rig has a scanner");
        let config = EmulatorConfig {
            time_scale: TimeScale::Paced(1.0),
            timer: timer.clone(),
            max_clients: fleet.clients_each,
            ..EmulatorConfig::default()
        };
        while due < monotonic() {
            due += PERIOD;
        }
        sleep_until(due);
        due += PERIOD.mul_f64(PHASE);
        let mut emulator = Emulator::start(device, world, config);
        let address = emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string();
        let epoch = emulator.clock().due(SimTime::ZERO).expect("a paced clock");
        berths.send(Berth { address, epoch }).expect("the clients wait");
        emulators.push(emulator);
    }
    emulators
}

/// Connects every client, then collects how late each scan of the measured time comes.
async fn listen(berths: Vec<Berth>, clients_each: usize, connected: impl FnOnce()) -> Vec<Duration> {
    let mut streams = Vec::new();
    for Berth { address, epoch } in &berths {
        for _ in 0..clients_each {
            streams.push((subscribe(address).await, *epoch));
        }
    }
    connected();
    let from = Instant::now() + WARM_UP;
    let mut clients: JoinSet<Vec<Duration>> = streams
        .into_iter()
        .map(|(stream, epoch)| lateness(stream, epoch, from..from + MEASURED, |scan| scan.scan_time_us))
        .collect();
    let mut all = Vec::new();
    while let Some(one) = clients.join_next().await {
        all.extend(one.expect("a client ends well"));
    }
    all
}

fn sleep_to_deadlines() -> Vec<Duration> {
    let turns = (WARM_UP + MEASURED).div_duration_f64(PERIOD) as u32;
    sleep_to((1..=turns).map(|turn| PERIOD * turn))
}

/// CPU time of this thread.
fn thread_time() -> Duration {
    reading(clock_gettime(ClockId::ThreadCPUTime))
}

/// A thousand scanners hold some four thousand descriptors.
fn raise_descriptor_limit() {
    let mut limit = getrlimit(Resource::Nofile);
    limit.current = limit.maximum;
    if let Err(cause) = setrlimit(Resource::Nofile, limit) {
        eprintln!("fleet: the limit of open files stays as it is: {cause}");
    }
}
