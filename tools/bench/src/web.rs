//! What a page costs those who are watched: two scanners at 50 Hz with a client each, and none, one or twenty browsers that draw as fast as they may.
//!
//! Scanners, page and its server run on two threads, as in the command; each browser is a thread that reads a picture and says that it has drawn it.
//! Lateness is host time from the instant the mirror passes its zero index until the client has read the whole telegram.

use std::fs;
use std::net::{SocketAddr, TcpStream};
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rowscan_control::Guard;
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{EmulatorConfig, LineWatch, Rig, StartWhen};
use rowscan_protocol::model;
use rowscan_protocol::time::SimTime;
use rowscan_web::{About, Gauges, OrchardPicture, ScannerAbout, ScannerGauge, Show, Web};
use tokio::runtime::Builder;
use tokio::sync::oneshot;
use tokio::task::JoinSet;
use tungstenite::Message;

use crate::loopback::{CONTROL, lateness, quantile_ms, runtime, sleep_to, subscribe};
use crate::measure::{Case, Report};

const SCANNERS: usize = 2;
const BROWSERS: [usize; 3] = [0, 1, 20];
const PERIOD: Duration = Duration::from_millis(20);
const WARM_UP: Duration = Duration::from_secs(2);
const MEASURED: Duration = Duration::from_secs(20);
/// The threads whose work counts.
const WATCHED: &str = "watched";
/// Of the ticks in which the system counts a thread's work, a second.
const TICKS_A_SECOND: f64 = 100.0;

/// Runs all cases, or with `browsers N` one.
pub fn run(report: &mut Report, arguments: &[String]) {
    let asked = arguments.windows(2).find(|pair| pair[0] == "browsers").and_then(|pair| pair[1].parse().ok());
    let scene = rowscan_scenes::files::load_scene("spindle", |_| {}).expect("a built-in scene");
    let stage = Stage::grow(scene, &|_, _| {}).expect("the built-in scene grows");
    for browsers in asked.map_or(BROWSERS.to_vec(), |browsers| vec![browsers]) {
        let figures = measure(&stage, browsers);
        tell(report, browsers, &figures);
    }
}

/// Nothing to tell but lines.
struct NoGauges;

impl Gauges for NoGauges {
    fn scanners(&self) -> Vec<ScannerGauge> {
        Vec::new()
    }
}

struct Figures {
    lateness: Vec<Duration>,
    control: Vec<Duration>,
    /// Of the watched threads.
    cores: f64,
    bytes: u64,
    pictures: u64,
}

/// Where scanners and page are, and when simulated time began.
struct Place {
    scanners: Vec<String>,
    epoch: Instant,
    page: SocketAddr,
}

fn measure(stage: &Stage, browsers: usize) -> Figures {
    let watched = Builder::new_multi_thread().worker_threads(2).thread_name(WATCHED).enable_all().build();
    let watched = watched.expect("a runtime");
    let (end, ended) = oneshot::channel::<()>();
    let (told, place) = std::sync::mpsc::channel();
    let (bytes, pictures) = (AtomicU64::new(0), AtomicU64::new(0));
    let counts = (&bytes, &pictures);
    thread::scope(|threads| {
        let watched = &watched;
        let served = threads.spawn(move || watched.block_on(serve(stage, told, ended)));
        let place = place.recv().expect("it listens");
        let from = Instant::now() + WARM_UP;
        let (until, page) = (from + MEASURED, place.page);
        let control = threads.spawn(|| {
            let turns = (WARM_UP + MEASURED).div_duration_f64(PERIOD) as u32;
            sleep_to((1..=turns).map(|turn| PERIOD * turn))
        });
        let looking: Vec<_> =
            (0..browsers).map(|_| threads.spawn(move || look(page, from, until, counts))).collect();
        let work = threads.spawn(move || {
            thread::sleep(from.saturating_duration_since(Instant::now()));
            let before = ticks();
            thread::sleep(until.saturating_duration_since(Instant::now()));
            (ticks() - before) / TICKS_A_SECOND / MEASURED.as_secs_f64()
        });
        let lateness = runtime().block_on(async {
            let mut clients = JoinSet::new();
            for address in &place.scanners {
                let stream = subscribe(address).await;
                clients.spawn(lateness(stream, place.epoch, from..until, |scan| scan.scan_time_us));
            }
            clients.join_all().await.concat()
        });
        looking.into_iter().for_each(|browser| browser.join().expect("a browser ends well"));
        let cores = work.join().expect("counted");
        end.send(()).expect("it is served until now");
        served.join().expect("it ends well");
        let control = control.join().expect("the control ends well");
        Figures {
            lateness,
            control,
            cores,
            bytes: bytes.load(Ordering::Relaxed),
            pictures: pictures.load(Ordering::Relaxed),
        }
    })
}

/// Scanners and page, until the end.
async fn serve(stage: &Stage, told: std::sync::mpsc::Sender<Place>, ended: oneshot::Receiver<()>) {
    let scale = TimeScale::Paced(1.0);
    let tractor = stage.tractor();
    let mut rig = Rig::new(tractor.clone(), scale).with_timer(Timer::system()).with_start(StartWhen::Now);
    let about = About {
        title: "bench".to_owned(),
        scanners: (0..SCANNERS)
            .map(|number| ScannerAbout { name: format!("scanner{number}"), model: "LMS111".to_owned() })
            .collect(),
    };
    let show = Show::new(about, Some(OrchardPicture::of(&stage.orchard)), Box::new(NoGauges));
    let (mut emulators, mut scanners, mut following) = (Vec::new(), Vec::new(), JoinSet::new());
    for number in 0..SCANNERS {
        let model = model::by_name("lms111").expect("a model");
        let (device, world) = stage.scanner_on(&tractor, 0, model).expect("the rig has it");
        let lines = LineWatch::default();
        let config =
            EmulatorConfig { time_scale: scale, lines: Some(lines.clone()), ..EmulatorConfig::default() };
        let mut emulator = rig.scanner(device, world, config);
        scanners.push(emulator.listen("127.0.0.1:0").await.expect("a free port").address.to_string());
        following.spawn(show.clone().follow(number, lines.watch()));
        emulators.push(emulator);
    }
    let web = Web::open("127.0.0.1:0", show, None, |_| Guard::open()).await.expect("a free port");
    let epoch = rig.clock().due(SimTime::ZERO).expect("a paced clock");
    let running = rig.run();
    told.send(Place { scanners, epoch, page: web.address() }).expect("somebody waits");
    let _ = ended.await;
    drop((running, web, emulators));
}

/// One browser: says of every picture at once that it is drawn.
fn look(page: SocketAddr, from: Instant, until: Instant, (bytes, pictures): (&AtomicU64, &AtomicU64)) {
    let stream = TcpStream::connect(page).expect("it listens");
    let (mut socket, _) = tungstenite::client(format!("ws://{page}/watch/live"), stream).expect("a place");
    loop {
        let message = socket.read().expect("it goes on");
        let now = Instant::now();
        if now >= until {
            return;
        }
        if now >= from {
            bytes.fetch_add(message.len() as u64, Ordering::Relaxed);
        }
        if message.is_binary() {
            pictures.fetch_add(u64::from(now >= from), Ordering::Relaxed);
        }
        socket.send(Message::text(if message.is_binary() { "drawn" } else { "taken" })).expect("it listens");
    }
}

/// What the watched threads have worked, in the system's ticks.
fn ticks() -> f64 {
    let tasks = fs::read_dir("/proc/self/task").expect("a system that tells").flatten();
    let stats = tasks.filter_map(|task| fs::read_to_string(task.path().join("stat")).ok());
    let of_thread = |stat: String| {
        let (head, fields) = stat.rsplit_once(')')?;
        let fields: Vec<f64> = fields.split_whitespace().filter_map(|field| field.parse().ok()).collect();
        // Behind the state, which is no number: user time is the eleventh of these, system time the twelfth.
        head.ends_with(WATCHED)
            .then(|| fields.get(10).zip(fields.get(11)).map_or(0.0, |(user, system)| user + system))
    };
    stats.filter_map(of_thread).sum()
}

fn tell(report: &mut Report, browsers: usize, figures: &Figures) {
    let name = format!("{SCANNERS} scanners at 50 Hz, {browsers} browsers");
    let case = |what: &str, unit, peer| Case {
        name: format!("{name}: {what}"),
        unit,
        peer,
        threads: 2,
        work: [0.0; 2],
    };
    for (what, share) in [("lateness p50", 0.5), ("lateness p99", 0.99)] {
        let (ours, control) = (quantile_ms(&figures.lateness, share), quantile_ms(&figures.control, share));
        report.less_is_better(&case(what, "ms", CONTROL), ours, control);
    }
    report.less_is_better(&case("CPU of scanners and page", "cores", "one core"), figures.cores, 1.0);
    if browsers > 0 {
        let each = |count: u64| count as f64 / browsers as f64 / MEASURED.as_secs_f64();
        report.more_is_better(&case("pictures a second, each", "1/s", "all"), each(figures.pictures), 25.0);
        report.less_is_better(
            &case("to a browser", "kB/s", "a megabyte a second"),
            each(figures.bytes) / 1e3,
            1e3,
        );
    }
}
