//! The live page: what it is made of, that it shows what there is, and that no browser holds a scanner up.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use rowscan_control::{Bench, Guard, Log};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, LineWatch, Rig, Running, StartWhen};
use rowscan_faults::{FaultControl, Language, Medium};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::scan::Scan;
use rowscan_scenes::Orchard;
use rowscan_web::{About, Gauges, OrchardPicture, ScannerAbout, ScannerGauge, Show, Web};
use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::task::JoinSet;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Bytes, Error, HandshakeError, Message, WebSocket};

use crate::common::binary::{Telling, refused, run};
use crate::common::recorded::folder;
use crate::common::{raw_client, small_scene};

/// A scanner on a rig with a page.
struct Watched {
    emulator: Emulator,
    orchard: Arc<Orchard>,
    web: Web,
    _running: Running,
    _following: JoinSet<()>,
}

/// Knows nothing.
struct NoGauges;

impl Gauges for NoGauges {
    fn scanners(&self) -> Vec<ScannerGauge> {
        Vec::new()
    }
}

async fn watched(guard: Guard) -> Watched {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let (device, view) =
        stage.scanner_on(&tractor, 0, model::by_name("lms111").expect("known")).expect("it fits");
    let mut rig = Rig::new(tractor, TimeScale::Paced(1.0)).with_start(StartWhen::Now);
    let (faults, _events) = FaultControl::new(1, rig.clock(), None);
    let lines = LineWatch::default();
    let config = EmulatorConfig {
        faults: Some(faults.stream("scanner0", Medium::Tcp, Language::Cola)),
        lines: Some(lines.clone()),
        ..EmulatorConfig::default()
    };
    let emulator = rig.scanner(device, view, config);
    let bench = Bench::new(faults, Arc::new(rig.control()), Log::default(), Vec::new());
    let scanners = vec![ScannerAbout { name: "scanner0".to_owned(), model: "LMS111".to_owned() }];
    let about = About { title: "a test".to_owned(), scanners };
    let show = Show::new(about, Some(OrchardPicture::of(&stage.orchard)), Box::new(NoGauges));
    let mut following = JoinSet::new();
    following.spawn(show.clone().follow(0, lines.watch()));
    let web = Web::open("127.0.0.1:0", show, Some(bench), |_| guard).await.expect("it listens");
    Watched { emulator, orchard: stage.orchard, web, _running: rig.run(), _following: following }
}

/// One HTTP request; status, head and body.
pub(super) async fn http(address: SocketAddr, head: &str, body: &str) -> (u16, String, Vec<u8>) {
    let request = format!("{head}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}", body.len());
    let request = if head.contains("Host:") {
        request
    } else {
        request.replacen("\r\n", &format!("\r\nHost: {address}\r\n"), 1)
    };
    let asked = move || {
        let mut stream = TcpStream::connect(address).expect("it listens");
        stream.write_all(request.as_bytes()).expect("sent");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("answered");
        answer
    };
    let answer = tokio::task::spawn_blocking(asked).await.expect("answered");
    let end = answer.windows(4).position(|bytes| bytes == b"\r\n\r\n").expect("a head");
    let head = String::from_utf8_lossy(&answer[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    (status, head, answer[end + 4..].to_vec())
}

pub(super) async fn json(address: SocketAddr, path: &str) -> Value {
    let (status, head, body) = http(address, &format!("GET {path} HTTP/1.1"), "").await;
    assert_eq!(status, 200, "{path}: {head}");
    serde_json::from_slice(&body).expect("json")
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
}

/// Counter, ranges, remissions, numbers of classes.
pub(super) type Shown = (u16, Vec<f32>, Vec<u16>, Vec<u8>);

/// The first line of a picture.
pub(super) fn line_of(picture: &[u8]) -> Option<Shown> {
    assert_eq!(&picture[..4], b"RWP1");
    if u32_at(picture, 8) == 0 {
        return None;
    }
    let line = &picture[44..];
    let (beams, counter, flags) = (u32_at(line, 4) as usize, u32_at(line, 8), u32_at(line, 12));
    assert_eq!(flags & 6, 6, "classes and sight");
    let range = (0..beams).map(|beam| f32_at(line, 80 + 4 * beam)).collect();
    let mut at = 80 + 4 * beams;
    let remissions = if flags & 1 == 1 { beams } else { 0 };
    let remission = (0..remissions)
        .map(|beam| u16::from_le_bytes([line[at + 2 * beam], line[at + 2 * beam + 1]]))
        .collect();
    at += 2 * remissions;
    let classes = line[at..at + beams].to_vec();
    Some((u16::try_from(counter).expect("16 bits"), range, remission, classes))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_page_is_served_whole_and_may_ask_nobody_else() {
    let bench = watched(Guard::open()).await;
    let address = bench.web.address();
    let (status, head, body) = http(address, "GET / HTTP/1.1", "").await;
    let (head, html) = (head.to_ascii_lowercase(), String::from_utf8(body).expect("text"));
    assert_eq!(status, 200);
    for rule in ["default-src 'none'", "script-src 'self'", "connect-src 'self'", "frame-ancestors 'none'"] {
        assert!(head.contains(rule), "{head}");
    }
    assert!(!head.contains("unsafe-inline") && !html.contains("<style") && !html.contains("onclick"));
    let named = html.split(['"', '\'']).filter(|word| word.starts_with("/page/"));
    let mut count = 0;
    for path in named {
        let (status, head, body) = http(address, &format!("GET {path} HTTP/1.1"), "").await;
        assert!(status == 200 && !body.is_empty() && head.contains("nosniff"), "{path}: {head}");
        count += 1;
    }
    assert!(count >= 3, "{html}");
    assert_eq!(http(address, "GET /page/none.js HTTP/1.1", "").await.0, 404);
    assert_eq!(json(address, "/watch/about").await["scanners"][0]["model"], "LMS111");
    let table = json(address, "/fault-table").await;
    assert!(table["faults"].as_array().is_some_and(|faults| faults.len() > 30));
    assert_eq!(table["streams"], serde_json::json!(["scanner0", "tractor", "encoder", "gnss"]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_orchard_is_the_scenes_leaf_by_leaf() {
    let bench = watched(Guard::open()).await;
    let (status, _, body) = http(bench.web.address(), "GET /watch/orchard HTTP/1.1", "").await;
    assert_eq!((status, &body[..4]), (200, &b"RWO1"[..]));
    let length = u32_at(&body, 4) as usize;
    let head: Value = serde_json::from_slice(&body[8..8 + length]).expect("a head");
    let trees: Vec<_> = bench.orchard.trees().collect();
    let leaves: usize = trees.iter().map(|tree| tree.leaves.len()).sum();
    assert!(leaves > 100, "{leaves}");
    assert_eq!(head["leaves"], leaves);
    let area = |number: usize| f32_at(&body, 8 + length + 28 * number + 24);
    let mut sent: Vec<f32> = (0..leaves).map(area).collect();
    let mut there: Vec<f32> =
        trees.iter().flat_map(|tree| &tree.leaves).map(|leaf| leaf.area_m2() as f32).collect();
    sent.sort_by(f32::total_cmp);
    there.sort_by(f32::total_cmp);
    assert_eq!(sent, there);
    let told = head["leaf_area_m2"].as_f64().expect("an area");
    assert!((told / bench.orchard.truth().leaf_area_m2 - 1.0).abs() < 1e-12);
    // A blade's ellipse has its polygon's area, to the tenth of a millimetre that sizes are told in.
    for number in 0..leaves {
        let at = 8 + length + 28 * number + 20;
        let size = |at: usize| f64::from(u16::from_le_bytes([body[at], body[at + 1]])) * 1e-4;
        let ellipse = std::f64::consts::FRAC_PI_4 * size(at) * size(at + 2);
        let area = f64::from(area(number));
        assert!((ellipse - area).abs() < 1e-4 * (size(at) + size(at + 2)), "{number}: {ellipse} of {area}");
    }
    let wood: usize = trees.iter().map(|tree| tree.wood.len()).sum();
    let sticks = wood + bench.orchard.supports().len();
    assert_eq!(body.len(), 8 + length + 28 * leaves + 32 * sticks);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_latest_scan_is_what_a_client_reads() {
    let mut bench = watched(Guard::open()).await;
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let mut scans: Vec<Scan> = Vec::new();
    for _ in 0..5 {
        scans.push(client.next_scan().await);
    }
    let address = bench.web.address();
    let (status, ..) = http(address, "POST /clock HTTP/1.1", r#"{"paused": true}"#).await;
    assert_eq!(status, 200);
    let (_, _, picture) = http(address, "GET /watch/scan HTTP/1.1", "").await;
    let (counter, range, remission, classes) = line_of(&picture).expect("a line");
    // What was sent before time stood is still on its way to the client.
    while scans.last().map(|scan| scan.telegram_counter) != Some(counter) {
        scans
            .push(tokio::time::timeout(Duration::from_secs(20), client.next_scan()).await.expect("it comes"));
    }
    let read = &scans.last().expect("one").echoes[0];
    assert_eq!(range, read.range_m.iter().map(|range| *range as f32).collect::<Vec<_>>());
    assert_eq!(remission, read.remission);
    let leaf = classes.iter().filter(|class| **class == 1).count();
    assert!(leaf > 0, "beside a row");
    for (range, class) in range.iter().zip(&classes) {
        assert_eq!(range.is_finite(), *class != 0, "a beam that met nothing is of no class");
    }
    let state = json(address, "/watch/state").await;
    assert_eq!(
        (&state["scanners"][0]["counter"], &state["clock"]["paused"]),
        (&counter.into(), &true.into())
    );
}

/// How long a browser waits for a picture that must not come: many times what one takes.
const NONE_COMES: Duration = Duration::from_millis(800);

/// A browser's socket; it reads when it is told to.
struct Browser(WebSocket<TcpStream>);

impl Browser {
    /// Opens it with these headers besides; or the status of the refusal.
    fn open(address: SocketAddr, headers: &[(&'static str, &str)]) -> Result<Self, u16> {
        let mut request = format!("ws://{address}/watch/live").into_client_request().expect("an address");
        for (name, value) in headers {
            request.headers_mut().insert(*name, value.parse().expect("a header"));
        }
        let stream = TcpStream::connect(address).expect("it listens");
        match tungstenite::client(request, stream) {
            Ok((socket, _)) => Ok(Self(socket)),
            Err(HandshakeError::Failure(Error::Http(answer))) => Err(answer.status().as_u16()),
            Err(other) => panic!("{other}"),
        }
    }

    /// The next picture; none if none comes within `limit`.
    fn picture(&mut self, limit: Duration) -> Option<Bytes> {
        self.0.get_mut().set_read_timeout(Some(limit)).expect("set");
        loop {
            match self.0.read() {
                Ok(Message::Binary(bytes)) => return Some(bytes),
                Ok(_) => {}
                Err(Error::Io(_)) => return None,
                Err(other) => panic!("{other}"),
            }
        }
    }

    fn drawn(&mut self) {
        self.0.send(Message::text("drawn")).expect("sent");
    }
}

const SOON: Duration = Duration::from_secs(20);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_browser_that_draws_nothing_gets_two_pictures_and_then_the_newest() {
    let bench = watched(Guard::open()).await;
    let address = bench.web.address();
    tokio::task::block_in_place(|| {
        let mut slow = Browser::open(address, &[]).expect("open");
        let mut quick = Browser::open(address, &[]).expect("open");
        let counter = |picture: &[u8]| line_of(picture).map(|(counter, ..)| counter);
        let mut last = None;
        for _ in 0..2 {
            last = slow.picture(SOON).and_then(|picture| counter(&picture));
        }
        // Meanwhile another draws as fast as it may, and is not held up.
        for _ in 0..20 {
            quick.picture(SOON).expect("it comes");
            quick.drawn();
        }
        assert_eq!(slow.picture(NONE_COMES), None, "it has two that it has not drawn");
        let newest = quick.picture(SOON).and_then(|picture| counter(&picture)).expect("a line");
        slow.drawn();
        let next = slow.picture(SOON).and_then(|picture| counter(&picture)).expect("a line");
        assert!(next >= newest && Some(next) > last.map(|last| last + 20), "{last:?} {newest} {next}");
    });
    assert_eq!(bench.emulator.counts().scans_dropped, 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn so_many_browsers_and_no_more() {
    let bench = watched(Guard::open()).await;
    let address = bench.web.address();
    tokio::task::block_in_place(|| {
        let mut browsers: Vec<Browser> =
            (0..rowscan_web::BROWSERS).map(|_| Browser::open(address, &[]).expect("a place")).collect();
        assert_eq!(Browser::open(address, &[]).err(), Some(503));
        let mut gone = browsers.pop().expect("one");
        gone.0.close(None).expect("closed");
        while gone.0.read().is_ok() {}
        drop(gone);
        let again = (0..200).find_map(|_| {
            std::thread::sleep(Duration::from_millis(20));
            Browser::open(address, &[]).ok()
        });
        assert!(again.is_some(), "its place is free");
    });
}

/// In simulated time: pictures go on coming, and the browser says nothing to any of them.
#[tokio::test(start_paused = true)]
async fn a_browser_that_never_answers_loses_its_seat() {
    let bench = watched(Guard::open()).await;
    let address = bench.web.address();
    let mut socket = tokio::net::TcpStream::connect(address).await.expect("it listens");
    let request = format!(
        "GET /watch/live HTTP/1.1\r\nHost: {address}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    );
    socket.write_all(request.as_bytes()).await.expect("sent");
    let mut said = Vec::new();
    let gone = tokio::time::timeout(Duration::from_secs(120), socket.read_to_end(&mut said)).await;
    assert!(said.starts_with(b"HTTP/1.1 101"), "{}", String::from_utf8_lossy(&said));
    assert!(gone.is_ok(), "it still has its seat after two minutes");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_of_other_sites_learn_and_do_nothing() {
    let bench = watched(Guard::open()).await;
    let address = bench.web.address();
    let evil = "\r\nOrigin: http://evil.example";
    for path in [
        "/watch/about",
        "/watch/orchard",
        "/watch/scan",
        "/watch/state",
        "/watch/log",
        "/watch/strip",
        "/watch/map",
    ] {
        let (status, ..) = http(address, &format!("GET {path} HTTP/1.1{evil}"), "").await;
        assert_eq!(status, 403, "{path}");
    }
    assert_eq!(http(address, &format!("POST /clock HTTP/1.1{evil}"), r#"{"paused": true}"#).await.0, 403);
    assert_eq!(http(address, "GET /watch/state HTTP/1.1\r\nHost: evil.example", "").await.0, 403);
    let own = format!("http://{address}");
    tokio::task::block_in_place(|| {
        assert_eq!(Browser::open(address, &[("origin", "http://evil.example")]).err(), Some(403));
        assert!(Browser::open(address, &[("origin", &own)]).is_ok());
    });
    assert_eq!(json(address, "/clock").await["paused"], false);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_opens_everything_but_the_page_itself() {
    let bench = watched(Guard::token("secret-7".to_owned())).await;
    let address = bench.web.address();
    assert_eq!(http(address, "GET / HTTP/1.1", "").await.0, 200);
    assert_eq!(http(address, "GET /page/main.js HTTP/1.1", "").await.0, 200);
    for path in ["/watch/about", "/watch/orchard", "/watch/scan", "/watch/state", "/faults", "/clock"] {
        assert_eq!(http(address, &format!("GET {path} HTTP/1.1"), "").await.0, 401, "{path}");
        let shown = format!("GET {path} HTTP/1.1\r\nAuthorization: Bearer secret-7");
        assert_eq!(http(address, &shown, "").await.0, 200, "{path}");
    }
    tokio::task::block_in_place(|| {
        assert_eq!(Browser::open(address, &[]).err(), Some(401));
        let offers = |token: &str| [("sec-websocket-protocol", format!("rowscan, bearer.{token}"))];
        let [(name, wrong)] = offers("secret-8");
        assert_eq!(Browser::open(address, &[(name, &wrong)]).err(), Some(401));
        let [(name, right)] = offers("secret-7");
        let mut browser = Browser::open(address, &[(name, &right)]).expect("it is the token");
        assert!(browser.picture(SOON).is_some());
    });
}

#[test]
fn emulate_tells_where_its_page_is_and_what_it_needs() {
    let mut telling = Telling::start(
        "emulate",
        &["spindle", "--tcp", "127.0.0.1:0", "--web", "127.0.0.1:0", "--start-when", "now"],
    );
    let listening: Vec<Value> =
        std::iter::from_fn(|| telling.next()).take_while(|line| line["event"] != "ready").collect();
    let names: Vec<&str> = listening.iter().filter_map(|line| line["endpoint"].as_str()).collect();
    assert_eq!(names, ["tcp", "web"]);
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let address: SocketAddr = listening[1]["address"].as_str().expect("told").parse().expect("an address");
    runtime.block_on(async {
        assert_eq!(json(address, "/watch/about").await["title"], "rowscan emulate spindle");
        // A client's first words are in the log, in words.
        let client = listening[0]["address"].as_str().expect("told").to_owned();
        let mut client = TcpStream::connect(client).expect("it listens");
        client.write_all(b"\x02sRN DeviceIdent\x03").expect("sent");
        assert!(client.read(&mut [0; 256]).expect("answered") > 0);
        let mut telegrams = Vec::new();
        for _ in 0..200 {
            telegrams = json(address, "/watch/log").await["telegrams"].as_array().expect("a list").clone();
            if telegrams.len() > 1 {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let said: Vec<_> =
            telegrams.iter().map(|spoken| (&spoken["telegram"], &spoken["by_device"])).collect();
        assert_eq!(
            said,
            [(&"sRN DeviceIdent".into(), &false.into()), (&"sRA DeviceIdent".into(), &true.into())]
        );
        // The tractor starts at once, which is after the page.
        let mut state = Value::Null;
        for _ in 0..200 {
            state = json(address, "/watch/state").await;
            if state["tractor"]["speeds"]["ground_m_s"].as_f64() > Some(0.5) {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        assert_eq!(state["scanners"][0]["clients"], 1);
        assert!(state["tractor"]["speeds"]["ground_m_s"].as_f64() > Some(0.5), "{state}");
        let strip = json(address, "/watch/strip").await;
        assert!(strip["strip"]["truth"].as_array().is_some_and(|columns| columns.len() > 20));
        // The axis of heights: bands end where the row does.
        let number = |key: &str| strip["strip"][key].as_f64().expect("known");
        let bands = strip["strip"]["truth"][0]["leaf_area_m2"].as_array().expect("bands").len();
        let top_m = number("z_from_m") + bands as f64 * number("band_m");
        let truth: Value =
            serde_json::from_str(&run(&["orchard", "truth", "spindle", "--format", "json"]).stdout)
                .expect("json");
        let heights =
            truth["trees"].as_array().expect("trees").iter().filter_map(|tree| tree["height_m"].as_f64());
        let highest_m = heights.fold(0.0, f64::max);
        assert!((highest_m..highest_m + number("band_m")).contains(&top_m), "{top_m} beside {highest_m}");
    });
    telling.end();
    assert!(
        refused(&["emulate", "spindle", "--web", "127.0.0.1:0", "--web-token", "short"]).contains("8 to 256")
    );
}

/// Asks for a state until it is as wanted.
pub(super) async fn state_when(address: SocketAddr, is_wanted: impl Fn(&Value) -> bool) -> Value {
    for _ in 0..500 {
        let state = json(address, "/watch/state").await;
        if is_wanted(&state) {
            return state;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    panic!("it never is: {}", json(address, "/watch/state").await);
}

/// Origin, first angle and step of the newest line's sight, as docs of the picture's bytes have it (`web/src/picture.rs`).
async fn sight_of_first_line(page: SocketAddr) -> Vec<f64> {
    let (status, _, body) = http(page, "GET /watch/scan HTTP/1.1", "").await;
    assert_eq!(status, 200);
    // Behind the picture's own 44 bytes.
    let line = &body[44..];
    let flags = u32::from_le_bytes(line[12..16].try_into().expect("four bytes"));
    assert_eq!(flags & 4, 4, "a sight is told");
    let at = |place: usize| f32::from_le_bytes(line[32 + 4 * place..][..4].try_into().expect("four bytes"));
    (0..5).map(|place| (f64::from(at(place)) * 1e6).round() / 1e6).collect()
}

/// The page's address among what a command tells before `until`.
pub(super) fn page_of(telling: &mut Telling) -> SocketAddr {
    let web = std::iter::from_fn(|| telling.next()).find(|line| line["endpoint"] == "web").expect("told");
    web["address"].as_str().expect("told").parse().expect("an address")
}

#[test]
fn a_recording_is_watched_at_its_own_pace_and_replayed_under_the_pages_clock() {
    let (_folder, path) = folder();
    let (scene, recording) = (path("row.toml"), path("run.mcap"));
    let emulator =
        super::common::binary::Emulator::start(&[&scene, "--model", "lms111", "--time-scale", "4"]);
    let recorded = run(&["record", &emulator.url(), "-o", &recording, "--scans", "150"]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    emulator.end();
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let mut watching = Telling::start("watch", &[&recording, "--rig", &scene, "--web", "127.0.0.1:0"]);
        let page = page_of(&mut watching);
        let about = json(page, "/watch/about").await;
        assert_eq!((&about["has_orchard"], &about["has_control"]), (&false.into(), &true.into()));
        let state = state_when(page, |state| state["scanners"][0]["scans"].as_u64() >= Some(150)).await;
        assert_eq!((&state["scanners"][0]["lost"], &state["scanners"][0]["bad"]), (&0.into(), &0.into()));
        assert!(state["scanners"][0]["clients"].is_null(), "nobody knows");
        let state = state_when(page, |state| state["scanners"][0]["ended"] == true).await;
        assert!(state["scanners"][0]["scans"].as_u64() >= Some(150), "it has ended and not before: {state}");
        // The rig says where the scanner sits: its fan is drawn as it stands, the row to the right.
        let sight = sight_of_first_line(page).await;
        assert_eq!(sight[..3], [-1.9, 0.0, 1.6], "{sight:?}");
        let (first, step) = ((-135_f64).to_radians(), 0.5_f64.to_radians());
        assert!((sight[3] - first).abs() < 1e-5 && (sight[4] - step).abs() < 1e-5, "0 is level: {sight:?}");
        let strip = json(page, "/watch/strip").await;
        let metres = strip["strip"]["measured"][0].as_array().expect("measured").clone();
        assert!(metres.iter().any(|metre| metre["impacted_m2"].as_f64() > Some(0.0)), "{strip}");
        let clock = json(page, "/clock").await;
        assert!(clock["recorded_span_s"][1].as_f64() > Some(0.5), "its time line: {clock}");
        let (status, ..) =
            http(page, "POST /faults HTTP/1.1", r#"{"name": "stall", "on": "scanner0", "for": {"s": 1}}"#)
                .await;
        assert_eq!(
            (status, &json(page, "/fault-table").await["streams"]),
            (400, &serde_json::json!([])),
            "nothing goes wrong with a file"
        );
        let log = json(page, "/watch/log").await;
        let said: Vec<&Value> = log["telegrams"].as_array().expect("a list").iter().collect();
        let has = |by_device: bool, name: &str| {
            said.iter().any(|said| {
                said["by_device"] == by_device
                    && said["telegram"].as_str().is_some_and(|told| told.contains(name))
            })
        };
        assert!(has(false, "DeviceIdent") && has(true, "DeviceIdent") && has(true, "LMDscandata"), "{log}");
        // It stays until it is told to go.
        watching.end();

        let places = [
            "--tcp",
            "127.0.0.1:0",
            "--web",
            "127.0.0.1:0",
            "--loop",
            "--rig",
            &scene,
            "--until",
            "scan:145",
        ];
        let mut replaying = Telling::start("replay", &[&[recording.as_str()][..], &places].concat());
        let scanner = replaying.address();
        let page = page_of(&mut replaying);
        let mut client = TcpStream::connect(scanner).expect("it listens");
        client.write_all(b"\x02sEN LMDscandata 1\x03").expect("sent");
        let reading =
            std::thread::spawn(move || while client.read(&mut [0; 4096]).is_ok_and(|read| read > 0) {});
        state_when(page, |state| state["scanners"][0]["lines"].as_u64() > Some(5)).await;
        let (status, ..) = http(page, "POST /clock HTTP/1.1", r#"{"paused": true}"#).await;
        assert_eq!(status, 200);
        std::thread::sleep(NONE_COMES);
        let before = json(page, "/watch/state").await;
        std::thread::sleep(NONE_COMES);
        let after = json(page, "/watch/state").await;
        assert_eq!(before["scanners"][0]["lines"], after["scanners"][0]["lines"]);
        assert!(after["clock"]["recorded_s"].is_number(), "{after}");
        assert_eq!(before["clock"]["now_s"], after["clock"]["now_s"], "faults go by it");
        let (status, ..) = http(page, "POST /clock HTTP/1.1", r#"{"seek": "scan:147"}"#).await;
        assert_eq!(status, 409, "it ends before");
        let (status, ..) =
            http(page, "POST /clock HTTP/1.1", r#"{"seek": "scan:100", "paused": false}"#).await;
        assert_eq!(status, 200);
        state_when(page, |state| {
            state["scanners"][0]["lines"].as_u64() > after["scanners"][0]["lines"].as_u64()
        })
        .await;
        // Each round is measured anew, and a strip of one that has just begun is empty.
        let mut strip = Value::Null;
        let has_canopy = |strip: &Value| {
            let measured = strip["strip"]["measured"][0].as_array();
            measured.is_some_and(|metres| metres.iter().any(|m| m["impacted_m2"].as_f64() > Some(0.0)))
        };
        for _ in 0..500 {
            strip = json(page, "/watch/strip").await;
            if has_canopy(&strip) {
                break;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(has_canopy(&strip), "by the rig: {strip}");
        replaying.end();
        reading.join().expect("it ends");
    });
}
