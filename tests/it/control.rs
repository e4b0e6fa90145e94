//! A running emulator in others' hands: over HTTP, by lines, by Toxiproxy's paths.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use rowscan_control::{Bench, Lines, Log, router};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, Rig, Running, StartWhen};
use rowscan_faults::{FaultControl, Language, Medium};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use serde_json::{Value, json};

use crate::common::binary::{Telling, assert_says, refused};
use crate::common::{raw_client, small_scene};

/// A rig with one scanner on a frozen clock, and its control.
struct Controlled {
    emulator: Emulator,
    lines: Lines,
    log: Log,
    _running: Running,
}

fn controlled(scale: TimeScale) -> Controlled {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let (device, view) =
        stage.scanner_on(&tractor, 0, model::by_name("lms111").expect("known")).expect("it fits");
    let mut rig = Rig::new(tractor, scale).with_start(StartWhen::Now);
    let (faults, _events) = FaultControl::new(1, rig.clock(), None);
    let stream = faults.stream("left", Medium::Tcp, Language::Cola);
    let config = EmulatorConfig { time_scale: scale, faults: Some(stream), ..EmulatorConfig::default() };
    let emulator = rig.scanner(device, view, config);
    let log = Log::default();
    let bench = Bench::new(faults, Arc::new(rig.control()), log.clone(), Vec::new());
    Controlled { emulator, lines: Lines::new(router(bench)), log, _running: rig.run() }
}

/// The answer, which must come within a second: on a frozen clock, before anything could be waited for.
async fn ask(lines: &Lines, line: &str) -> (u16, Value) {
    let answer = tokio::time::timeout(Duration::from_secs(1), lines.ask(line)).await;
    let answer = answer.unwrap_or_else(|_| panic!("{line} was not answered within a second"));
    (answer.status, answer.body.unwrap_or_default())
}

#[tokio::test(start_paused = true)]
async fn it_answers_whatever_the_links_do() {
    for scale in [TimeScale::Paced(1.0), TimeScale::Max] {
        let mut bench = controlled(scale);
        // One client reads nothing more: its queue is full, and at `max` time waits for it.
        let mut client = raw_client(&mut bench.emulator, Dialect::A);
        client.next_scan().await;
        tokio::time::sleep(Duration::from_secs(5)).await;
        for fault in [r#"{"name": "half_open"}"#, r#"{"name": "stall"}"#, r#"{"name": "delay", "ms": 60000}"#]
        {
            assert_eq!(ask(&bench.lines, &format!("POST /faults {fault}")).await.0, 201, "{fault}");
        }
        let all = ask(&bench.lines, "GET /faults").await.1;
        assert_eq!(all.as_array().map(Vec::len), Some(3));
        ask(&bench.lines, r#"POST /clock {"paused": true}"#).await;
        for line in ["GET /clock", "GET /state", "GET /log", "GET /proxies", "DELETE /faults/stall"] {
            assert!(ask(&bench.lines, line).await.0 < 300, "{line}");
        }
        // Steps that cannot be taken are told as such.
        let (status, told) = ask(&bench.lines, r#"POST /step {"n": 100000}"#).await;
        assert_eq!((status, told["last"].is_u64()), (200, true));
        // At `max` what is held back by a fault is no reason to wait.
        assert!(scale == TimeScale::Max || told["done"] == false, "{told}");
        assert_eq!(ask(&bench.lines, "POST /reset").await.0, 204);
        assert_eq!(ask(&bench.lines, "GET /faults").await.1, json!([]));
    }
}

#[tokio::test(start_paused = true)]
async fn time_stands_goes_on_step_by_step_and_changes_its_pace() {
    let mut bench = controlled(TimeScale::Paced(1.0));
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    client.next_scan().await;
    ask(&bench.lines, r#"POST /clock {"paused": true}"#).await;
    let before = ask(&bench.lines, "GET /clock").await.1;
    tokio::time::sleep(Duration::from_secs(3600)).await;
    assert_eq!(ask(&bench.lines, "GET /clock").await.1, before);
    let sent = bench.emulator.counts().scans_sent;
    let (_, told) = ask(&bench.lines, r#"POST /step {"n": 7}"#).await;
    assert_eq!(told["done"], true);
    let (_, log) = ask(&bench.lines, "GET /log").await;
    let asked: Vec<&Value> =
        log["events"].as_array().expect("events").iter().map(|event| &event["what"]).collect();
    assert!(asked.contains(&&Value::from("step")), "{log}");
    tokio::time::sleep(Duration::from_secs(3600)).await;
    assert_eq!(bench.emulator.counts().scans_sent, sent + 7);
    // 50 scans a second: seven steps end within seven times 20 ms, and time stands at the last one's end.
    let now_s = |clock: &Value| clock["now_s"].as_f64().expect("a time");
    let after = ask(&bench.lines, "GET /clock").await.1;
    let passed_s = now_s(&after) - now_s(&before);
    assert!(passed_s > 0.12 && passed_s < 0.145, "{passed_s}");
    assert_eq!(ask(&bench.lines, r#"POST /clock {"scale": 0}"#).await.0, 400);
    ask(&bench.lines, r#"POST /clock {"scale": 10, "paused": false}"#).await;
    tokio::time::sleep(Duration::from_secs(6)).await;
    let faster = ask(&bench.lines, "GET /clock").await.1;
    let passed_s = now_s(&faster) - now_s(&after);
    assert!((passed_s - 60.0).abs() < 0.1, "{passed_s}");
    assert_eq!(bench.emulator.counts().scans_missed, 0, "nothing is late after a pause");
}

#[tokio::test(start_paused = true)]
async fn what_is_wrong_is_said_and_changes_nothing() {
    let bench = controlled(TimeScale::Max);
    for (line, status, says) in [
        ("GET /nowhere", 404, "/faults"),
        ("DELETE /clock", 405, "method"),
        ("POST /clock {}", 400, "expected one of"),
        (r#"POST /clock {"pause": true}"#, 400, "unknown field `pause`"),
        (r#"POST /clock {"scale": 2}"#, 409, "it has no scale"),
        (r#"POST /clock {"seek": "scan:5"}"#, 409, "replay"),
        (r#"POST /step {"n": 0}"#, 400, "found 0"),
        (r#"POST /faults {"name": "stal"}"#, 400, "did you mean `stall`"),
        (r#"POST /faults [{"name": "stall"}, {"name": "drop", "on": "right"}]"#, 400, "no stream `right`"),
        ("POST /faults nonsense", 400, "the body"),
        ("DELETE /faults/none", 404, "no fault `none`"),
        ("hello", 400, "found `hello`"),
        (r#"POST /proxies {"name": "other"}"#, 404, "no stream `other`"),
        (r#"POST /proxies/left/toxics {"type": "slow_close"}"#, 400, "half_close"),
        (r#"POST /proxies/left/toxics {"type": "limit_data"}"#, 400, "fin"),
        (r#"POST /proxies/left/toxics {"type": "latency", "toxicity": 0.5}"#, 400, "toxicity"),
        (
            r#"POST /proxies/left/toxics {"type": "latency", "attributes": {"delay": 5}}"#,
            400,
            "it has latency, jitter",
        ),
        (
            r#"POST /proxies/left/toxics {"type": "slicer", "attributes": {"size_variation": 5}}"#,
            400,
            "one size",
        ),
    ] {
        let (found, told) = ask(&bench.lines, line).await;
        assert_eq!(found, status, "{line}: {told}");
        assert_says(&told.to_string(), &[says]);
    }
    assert_eq!(ask(&bench.lines, "GET /faults").await.1, json!([]));
    assert_eq!(ask(&bench.lines, "GET /log").await.1["last"], 0);
}

#[tokio::test(start_paused = true)]
async fn toxics_are_faults() {
    let bench = controlled(TimeScale::Paced(1.0));
    for (toxic, attributes, faults) in [
        ("latency", json!({ "latency": 100 }), &["delay"][..]),
        ("latency", json!({ "latency": 100, "jitter": 20 }), &["jitter"]),
        ("bandwidth", json!({ "rate": 10 }), &["bandwidth"]),
        ("timeout", json!({ "timeout": 0 }), &["half_open"]),
        ("timeout", json!({ "timeout": 500 }), &["half_open", "rst"]),
        ("reset_peer", json!({ "timeout": 50 }), &["rst"]),
        ("slicer", json!({ "average_size": 10, "delay": 100 }), &["dribble"]),
    ] {
        for stream in ["downstream", "upstream"] {
            let order = json!({ "name": "x", "type": toxic, "stream": stream, "attributes": attributes });
            let (status, made) = ask(&bench.lines, &format!("POST /proxies/left/toxics {order}")).await;
            assert_eq!(
                (status, &made["name"], &made["attributes"]),
                (200, &json!("x"), &attributes),
                "{made}"
            );
            assert_eq!(ask(&bench.lines, "GET /proxies/left").await.1["toxics"], json!([made]));
            let list = ask(&bench.lines, "GET /faults").await.1;
            let names: Vec<_> =
                list.as_array().expect("a list").iter().map(|fault| fault["name"].clone()).collect();
            assert_eq!(names, faults, "{toxic}");
            assert_eq!(ask(&bench.lines, "DELETE /proxies/left/toxics/x").await.0, 204);
            assert_eq!(ask(&bench.lines, "GET /faults").await.1, json!([]));
        }
    }
    let order = r#"POST /proxies/left/toxics {"type": "latency", "attributes": {"latency": 100}}"#;
    assert_eq!(ask(&bench.lines, order).await.1["name"], "latency_downstream");
    assert_eq!(ask(&bench.lines, order).await.0, 409);
    let change = r#"POST /proxies/left/toxics/latency_downstream {"attributes": {"jitter": 5}}"#;
    assert_eq!(ask(&bench.lines, change).await.1["attributes"], json!({ "latency": 100, "jitter": 5 }));
    // Clients that set up their proxies find them set up.
    let populated = ask(
        &bench.lines,
        r#"POST /populate [{"name": "left", "listen": "x", "upstream": "y", "enabled": false}]"#,
    )
    .await;
    assert_eq!((populated.0, &populated.1["proxies"][0]["enabled"]), (201, &json!(false)));
    assert_eq!(ask(&bench.lines, "POST /reset").await.0, 204);
    let left = ask(&bench.lines, "GET /proxies").await.1["left"].clone();
    assert_eq!((&left["enabled"], &left["toxics"]), (&json!(true), &json!([])));
    assert!(ask(&bench.lines, "GET /version").await.1["version"].is_string());
    drop(bench.log);
}

/// One HTTP request; status and body.
fn http(address: &str, head: &str, body: &str) -> (u16, Value) {
    let mut stream = TcpStream::connect(address).expect("it listens");
    let head = format!(
        "{head}\r\nHost: {address}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n{body}",
        body.len()
    );
    stream.write_all(head.as_bytes()).expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("answered");
    let status = answer.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    let body = answer.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (status, serde_json::from_str(body).unwrap_or_default())
}

/// The endpoints that come before `ready`, in their order.
fn endpoints(telling: &mut Telling) -> Vec<(String, String)> {
    let listening = std::iter::from_fn(|| telling.next()).take_while(|line| line["event"] != "ready");
    listening
        .map(|line| {
            (
                line["endpoint"].as_str().expect("a name").to_owned(),
                line["address"].as_str().unwrap_or_default().to_owned(),
            )
        })
        .collect()
}

#[test]
fn it_is_announced_before_ready_and_bounded() {
    let mut telling =
        Telling::start("emulate", &["spindle", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let endpoints = endpoints(&mut telling);
    let names: Vec<&str> = endpoints.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["tcp", "control"]);
    let address = &endpoints[1].1;
    assert_eq!(http(address, "GET /state HTTP/1.1", "").1["streams"]["scanner0"]["scans_sent"], 0);
    // Also what the server refuses by itself is told as JSON.
    for (request, text, status) in [
        ("POST /faults HTTP/1.1", format!("[{}]", " ".repeat(70_000)), 413),
        ("GET /log?since=abc HTTP/1.1", String::new(), 400),
    ] {
        let (found, told) = http(address, request, &text);
        assert_eq!((found, told["status"].as_u64()), (status, Some(u64::from(status))), "{told}");
        assert!(told["error"].as_str().is_some_and(|error| !error.is_empty()));
    }
    assert_eq!(http(address, "GET /state HTTP/1.1\r\nOrigin: http://example.org", "").0, 403);
    // Connections that say nothing do not keep others out for long; fewer than there is room for, not at all.
    let silent: Vec<_> = (0..20).map(|_| TcpStream::connect(address).expect("it listens")).collect();
    assert_eq!(http(address, "GET /clock HTTP/1.1", "").0, 200);
    drop(silent);
    assert_eq!(http(address, "POST /faults HTTP/1.1", r#"{"name": "stall"}"#).0, 201);
    let told = telling.end();
    assert!(
        told.iter().any(|line| line["what"] == "begin") && told.iter().any(|line| line["what"] == "healed"),
        "{told:?}"
    );
}

#[test]
fn elsewhere_than_on_loopback_a_token_is_needed() {
    let arguments =
        ["spindle", "--tcp", "127.0.0.1:0", "--control", "0.0.0.0:0", "--control-token", "secret-7"];
    let mut telling = Telling::start("emulate", &arguments);
    let port = endpoints(&mut telling)[1].1.rsplit_once(':').expect("a port").1.to_owned();
    let address = format!("127.0.0.1:{port}");
    assert_eq!(http(&address, "GET /clock HTTP/1.1", "").0, 401);
    assert_eq!(http(&address, "GET /clock HTTP/1.1\r\nAuthorization: Bearer secret-8", "").0, 401);
    assert_eq!(http(&address, "GET /clock HTTP/1.1\r\nAuthorization: Bearer secret-7", "").0, 200);
    telling.end();
    let asked = refused(&["emulate", "spindle", "--control", "127.0.0.1:0", "--control-token", "short"]);
    assert_says(&asked, &["8 to 256"]);
}

/// Scans that come, until `stop` of them have.
fn scans(stream: &mut TcpStream, stop: usize) -> usize {
    let (mut count, mut chunk) = (0, [0; 4096]);
    while count < stop {
        let read = stream.read(&mut chunk).expect("it streams");
        if read == 0 {
            break;
        }
        count += chunk[..read].iter().filter(|byte| **byte == 0x03).count();
    }
    count
}

#[test]
fn time_that_is_granted_goes_no_further() {
    let level = ["--clock", "lockstep", "--ack", "clock", "--ack", "sent"];
    let arguments = ["spindle", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
    let mut telling = Telling::start("emulate", &[&arguments[..], &level[..]].concat());
    let endpoints = endpoints(&mut telling);
    let mut client = TcpStream::connect(&endpoints[0].1).expect("it listens");
    client.write_all(b"\x02sEN LMDscandata 1\x03").expect("sent");
    // The reply alone: nothing was granted.
    assert_eq!(scans(&mut client, 1), 1);
    let control = &endpoints[1].1;
    let mut granted = 0;
    for n in [1, 3, 8] {
        let (status, told) = http(control, "POST /step HTTP/1.1", &json!({ "n": n }).to_string());
        granted += n;
        assert_eq!((status, &told["last"]), (200, &json!(granted)), "{told}");
        assert_eq!(scans(&mut client, n), n);
        let clock = http(control, "GET /clock HTTP/1.1", "").1;
        assert_eq!((&clock["mode"], &clock["steps"]), (&json!("granted"), &json!(granted)), "{clock}");
        let state = http(control, "GET /state HTTP/1.1", "").1;
        assert_eq!(state["streams"]["scanner0"]["scans_sent"], granted);
    }
    let needs = refused(&["emulate", "spindle", "--clock", "lockstep", "--ack", "clock"]);
    assert_says(&needs, &["--control ADDR"]);
    let needs = refused(&["emulate", "spindle", "--clock", "lockstep", "--ack", "output:can0"]);
    assert_says(&needs, &["--can PORT"]);
}
