//! The driver's side of a picoScan: REST and datagrams over real sockets, the same estimate as over CoLa and of the recording, and what goes wrong.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use rowscan_driver::{DriverConfig, DriverError, Scanner, Source};
use rowscan_recording::{About, Decoded, McapWriter, Recording, StreamKind};
use serde_json::{Value, json};

use crate::common::binary::{Telling, assert_says, rowscan, run, text};
use crate::common::recorded::{estimate, folder};
use crate::picoscan::post;

/// An emulator of a scene: its CoLa port and its REST.
struct Pico {
    telling: Telling,
    tcp: String,
    rest: String,
}

impl Pico {
    fn start(scene: &str, args: &[&str]) -> Self {
        let places = ["--model", "picoscan150", "--tcp", "127.0.0.1:0", "--rest", "127.0.0.1:0"];
        let mut telling = Telling::start("emulate", &[&[scene], &places[..], args].concat());
        let mut place = |kind: &str| {
            let told = telling.next().expect("it listens");
            assert_eq!(told["endpoint"], kind);
            told["address"].as_str().expect("an address").to_owned()
        };
        let (tcp, rest) = (place("tcp"), place("rest"));
        Self { telling, tcp, rest }
    }

    /// A free port, so that tests do not meet.
    fn source(&self) -> String {
        format!("picoscan://{}?udp=0", self.rest)
    }
}

fn parsed(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

const SCANS: [&str; 4] = ["--model", "picoscan150", "--scans", "60"];

/// The ranges of a recording's scans by their telegram counters, as text.
fn ranges(recording: &str, table: &str) -> BTreeMap<u64, String> {
    let shown = run(&["export", recording, "--to", "csv", "--what", "scans", "-o", table]);
    assert_eq!(shown.code, Some(0), "{}", shown.stderr);
    let text = std::fs::read_to_string(table).expect("written");
    // time_s, telegram_counter, scan_time_us, ranges
    let row = |line: &str| {
        let mut cells = line.splitn(4, ',').skip(1);
        let counter = cells.next()?.parse().ok()?;
        Some((counter, cells.nth(1)?.to_owned()))
    };
    text.lines().skip(2).filter_map(row).collect()
}

/// Two runs of one drive that begins with the process: what both have heard of it is the same.
#[test]
fn a_scan_is_the_same_over_udp_and_over_cola() {
    let (_base, path) = folder();
    let scene = path("row.toml");
    let heard = |name: &str, source: &dyn Fn(&Pico) -> String| {
        let pico = Pico::start(&scene, &["--time-scale", "4", "--start-when", "now"]);
        let file = path(&format!("{name}.mcap"));
        let ended = run(&["record", &source(&pico), "-o", &file, "--scans", "240"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        ranges(&file, &path(&format!("{name}.csv")))
    };
    let udp = heard("udp", &Pico::source);
    let cola = heard("cola", &|pico| format!("tcp://{}", pico.tcp));
    let both: Vec<_> =
        udp.iter().filter_map(|(counter, ranges)| Some((counter, ranges, cola.get(counter)?))).collect();
    assert!(both.len() > 20, "{} and {} scans have {} in common", udp.len(), cola.len(), both.len());
    for (counter, udp, cola) in &both {
        assert_eq!(udp, cola, "scan {counter}");
    }
    let unlike = both.windows(2).filter(|pair| pair[0].1 != pair[1].1).count();
    assert!(unlike > 5, "the tractor drives past something");
}

#[test]
fn a_row_is_the_same_live_over_udp_and_from_recordings() {
    let (base, path) = folder();
    let (scene, live, kept) = (path("row.toml"), path("live.mcap"), path("kept.mcap"));
    let pico = Pico::start(&scene, &["--time-scale", "4"]);
    let over_udp = estimate(&pico.source(), &scene, &[&SCANS[..], &["--record", &live]].concat());
    drop(pico.telling);
    let udp = parsed(&over_udp);
    assert_eq!(
        (&udp["scans"], &udp["segments_lost"], &udp["scans_lost"]),
        (&60.into(), &0.into(), &0.into())
    );
    // The file may hold a turn more: the scanner sends until the end of the stream is answered.
    assert_eq!(estimate(&live, &scene, &SCANS), over_udp, "the recording, to the byte");

    let pico = Pico::start(&scene, &["--time-scale", "4"]);
    let ended = run(&["record", &pico.source(), "-o", &kept, "--scans", "20", "--format", "jsonl"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    drop(pico);
    let ended = run(&["record", "--info", &kept, "--format", "json"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let told = parsed(&ended.stdout);
    let stream = &told["streams"][0];
    assert_eq!((&stream["kind"], &stream["scans"]), (&"compact".into(), &20.into()), "{told}");
    let shown = run(&["export", &kept, "--to", "csv", "-o", &path("scans.csv")]);
    assert_eq!(shown.code, Some(0), "{}", shown.stderr);
    let lines = std::fs::read_to_string(path("scans.csv")).expect("written");
    assert!(lines.lines().count() > 20, "{lines}");

    lost_segments_are_told(base.path(), &live, &scene, &udp);
}

/// The same recording without every ninth datagram from the 30th on, within the 600 of its first 60 scans.
fn lost_segments_are_told(folder: &Path, file: &str, scene: &str, whole: &Value) {
    let mut recording = Recording::open(Path::new(file)).expect("it opens");
    let about = About { source: recording.about().source.clone(), ..About::default() };
    let mut writer =
        McapWriter::new(std::io::Cursor::new(Vec::new()), &about, Decoded::default()).expect("begun");
    let stream = writer.add_stream("scanner", StreamKind::Compact).expect("added");
    let (mut number, mut dropped) = (0, 0);
    while let Some(packet) = recording.next_packet().expect("it reads") {
        // The encoder's are shorter than any segment.
        number += usize::from(packet.bytes.len() > 100);
        if packet.bytes.len() > 100 && (31..=540).contains(&number) && number % 9 == 0 {
            dropped += 1;
            continue;
        }
        let (from, at) = (packet.from.expect("a side"), packet.at_ns.expect("a time"));
        writer.write(stream, from, at, 0, &packet.bytes).expect("written");
    }
    writer.finish().expect("finished");
    let file = folder.join("lossy.mcap");
    std::fs::write(&file, writer.into_inner().into_inner()).expect("kept");
    let told = parsed(&estimate(text(&file), scene, &SCANS));
    assert_eq!((&told["scans"], &told["segments_lost"]), (&60.into(), &dropped.into()));
    let warnings = told["warnings"].to_string();
    assert!(warnings.contains("segments_lost"), "{warnings}");
    // Beams that are not known are neither returns nor misses.
    let count = |told: &Value, key: &str| told["ranges"][key].as_u64().expect("a count");
    let all = |told: &Value| count(told, "returns") + count(told, "misses") + count(told, "invalid");
    assert_eq!(all(&told), all(whole));
    let share = count(&told, "invalid") as f64 / all(&told) as f64;
    assert!((share - f64::from(dropped) / 600.0).abs() < 0.01, "{share}");
    let ratio = |key: &str| told[key].as_f64().expect("known") / whole[key].as_f64().expect("known");
    assert!((ratio("leaf_area_contact_raw_m2") - 1.0).abs() < 0.1, "{}", ratio("leaf_area_contact_raw_m2"));
    let impacted = ratio("impacted_total_area_m2");
    assert!((0.8..0.97).contains(&impacted), "an eleventh of the beams is missing: {impacted}");
}

#[test]
fn what_goes_wrong_is_told_with_its_remedy() {
    let (_folder, path) = folder();
    let scene = path("row.toml");
    let pico = Pico::start(&scene, &[]);
    let fails = |source: &str| {
        let ended =
            rowscan().args(["estimate", source, "--rig", &scene, "--scans", "1"]).output().expect("it runs");
        assert!(!ended.status.success(), "{source}");
        String::from_utf8(ended.stderr).expect("text")
    };
    let wrong = fails(&format!("picoscan://{}?udp=0&password=servicelevle", pico.rest));
    assert_says(&wrong, &["refused the login of `Service`", "status 10, HTTP 401", "password=PASSWORD"]);
    assert!(!wrong.contains("servicelevle"), "{wrong}");
    let taken = std::net::UdpSocket::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port();
    let busy = fails(&format!("picoscan://{}?udp={port}", pico.rest));
    assert_says(&busy, &[&format!("cannot receive datagrams at 127.0.0.1:{port}"), "?udp=PORT"]);
    let cola = fails(&format!("picoscan://{}?udp=0", pico.tcp));
    assert_says(&cola, &["/api/DeviceIdent", "HTTP port of a picoScan"]);
    let ended = run(&["proxy", &pico.source(), "--tcp", "127.0.0.1:0"]);
    assert_eq!(ended.code, Some(2));
    assert_says(&ended.stderr, &["sends datagrams", "expected tcp://HOST:PORT"]);
}

/// What another client has left on takes beams away that look like misses: the driver switches it off, and says so.
#[test]
fn filters_that_another_client_left_cost_nothing_and_are_told() {
    let (_folder, path) = folder();
    let scene = path("row.toml");
    let args = ["--model", "picoscan150", "--scans", "20"];
    let pico = Pico::start(&scene, &[]);
    let whole = parsed(&estimate(&pico.source(), &scene, &args));
    for (name, value) in [
        (
            "LFPangleRangeFilter",
            json!({ "bEnable": true, "fThetaStart": -200_000, "fThetaStop": 150_000, "fPhiStart": -900_000, "fPhiStop": 900_000, "uiBeamIncrement": 3 }),
        ),
        ("LFPradialDistanceRangeFilter", json!({ "bEnable": true, "ulDistMin": 0, "ulDistMax": 1000 })),
        ("LFPintervalFilter", json!({ "bEnable": true, "uiReductionFactor": 5 })),
    ] {
        let pico = Pico::start(&scene, &[]);
        assert_eq!(post(&pico.rest, name, &value), (200, json!(0)), "{name}");
        let ended =
            run(&[&["estimate", &pico.source(), "--rig", &scene, "--format", "json"], &args[..]].concat());
        assert_says(&ended.stderr, &[name, "that is undone for this run"]);
        let found = parsed(&ended.stdout);
        assert_eq!(found["ranges"]["misses"], whole["ranges"]["misses"], "{name}");
        assert_eq!(found["leaf_area_m2"], whole["leaf_area_m2"], "{name}");
    }
}

/// A scanner whose datagrams are all lost on their way has accepted all settings.
#[tokio::test]
async fn datagrams_that_never_come_are_told() {
    let (base, path) = folder();
    let pico = faulty(&path("row.toml"), base.path(), "name = \"udp_loss\"\np = 1.0");
    let source: Source = pico.source().parse().expect("a source");
    let patience = Duration::from_millis(700);
    let config = DriverConfig { first_datagram_timeout: patience, ..DriverConfig::default() };
    let Err(cause) = Scanner::open(&source, config).await else { panic!("nothing streams") };
    assert!(matches!(&cause, DriverError::NoDatagrams { timeout, .. } if *timeout == patience), "{cause}");
    assert_says(
        &cause.to_string(),
        &["no Compact telegram came to UDP 127.0.0.1:", "firewall", "--allow-destination"],
    );
}

/// An emulator with one fault from the start of time.
fn faulty(scene: &str, folder: &Path, fault: &str) -> Pico {
    let file = folder.join("faults.toml");
    std::fs::write(&file, format!("[[fault]]\nat = {{ s = 0 }}\n{fault}\n")).expect("written");
    Pico::start(scene, &["--faults", text(&file), "--time-scale", "4"])
}

/// What each fault of datagrams costs: segments lost of 40 turns of ten, and whether that is told.
#[test]
fn faults_of_datagrams_cost_what_they_say() {
    let (base, path) = folder();
    let scene = path("row.toml");
    for (fault, lost) in [
        ("name = \"udp_loss\"\np = 0.1", 15..=80),
        ("name = \"udp_loss\"\npb = 0.02\npg = 0.25", 5..=90),
        ("name = \"udp_dup\"\np = 0.5", 0..=0),
        ("name = \"udp_reorder\"\nbehind = 3\np = 0.2", 0..=0),
        ("name = \"udp_reorder\"\nbehind = 9\np = 0.2", 10..=80),
        ("name = \"udp_late\"\nms = 80\np = 0.1", 10..=80),
        // Telegrams of the default profile need one packet of 1500 bytes, and three of 576.
        ("name = \"udp_fragment\"\np = 0.05", 0..=0),
        ("name = \"udp_fragment\"\nmtu = 576\np = 0.05", 20..=110),
    ] {
        let pico = faulty(&scene, base.path(), fault);
        let told = parsed(&estimate(&pico.source(), &scene, &["--model", "picoscan150", "--scans", "40"]));
        let found = told["segments_lost"].as_u64().expect("a count");
        assert!(lost.contains(&found), "{fault}: {found}");
        assert_eq!((&told["scans_repeated"], &told["telegrams_bad"]), (&0.into(), &0.into()), "{fault}");
        assert_eq!(told["warnings"].to_string().contains("segments_lost"), found > 0, "{fault}");
    }
}

/// What REST refuses is told, or waited for.
#[test]
fn faults_of_rest_are_told_or_waited_for() {
    let (base, path) = folder();
    let scene = path("row.toml");
    let estimated = |fault: &str| {
        let pico = faulty(&scene, base.path(), fault);
        let args = ["estimate", &pico.source(), "--rig", &scene, "--model", "picoscan150", "--scans", "5"];
        run(&args)
    };
    for (fault, said) in [
        ("name = \"login\"", ["refused the login of `Service`", "status 10, HTTP 401"]),
        ("name = \"nonce_stale\"", ["challenges go stale", "status 10, HTTP 401"]),
        ("name = \"too_many_requests\"", ["takes no more requests (too many requests, HTTP 429)", "30 s"]),
    ] {
        let ended = estimated(fault);
        assert!(ended.code != Some(0), "{fault}");
        assert_says(&ended.stderr, &said);
    }
    // Over in a second of the host: the second pause outlasts it.
    let ended = estimated("name = \"too_many_requests\"\nfor = { s = 4 }");
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let lms = base.path().join("faults.toml");
    std::fs::write(&lms, "[[fault]]\nname = \"nonce_stale\"\nat = { s = 0 }\n").expect("written");
    let args = ["emulate", "spindle", "--tcp", "127.0.0.1:0", "--faults", text(&lms)];
    assert_says(&crate::common::binary::refused(&args), &["no REST interface", "picoscan150"]);
}

/// What the inertial measurement unit and the encoder tell is asked for by the address, kept, and counted; without that there is none.
#[test]
fn readings_of_imu_and_encoder_are_in_the_recording_of_who_asks_for_them() {
    let (_base, path) = folder();
    let scene = path("row.toml");
    let recorded = |name: &str, keys: &str| {
        let pico = Pico::start(&scene, &["--time-scale", "4", "--start-when", "now"]);
        let file = path(&format!("{name}.mcap"));
        let ended = run(&["record", &format!("{}{keys}", pico.source()), "-o", &file, "--scans", "60"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let ended = run(&["record", "--info", &file, "--format", "json"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let told = parsed(&ended.stdout);
        let count = |key: &str| told["streams"][0][key].as_u64().expect("a count");
        assert_eq!(count("scans"), 60);
        let shown = run(&["decode", &file]);
        (["imu_readings", "encoder_readings", "readings_bad"].map(count), shown.stdout)
    };
    let ([imu, wheel, bad], shown) = recorded("both", "&imu=on&encoder=on");
    // One of the encoder a turn; of the unit more.
    assert!((55..=65).contains(&wheel), "{wheel}");
    assert!(imu > wheel && bad == 0, "{imu} and {bad}");
    assert!(shown.contains("acceleration_m_s2") && shown.contains("tick_ref1"), "decode shows them");
    let (none, shown) = recorded("none", "");
    assert_eq!(none, [0, 0, 0]);
    assert!(!shown.contains("acceleration_m_s2"));
    let wrong = run(&["record", "picoscan://127.0.0.1:1?imu=yes", "-o", &path("x.mcap")]);
    assert_eq!(wrong.code, Some(2), "{}", wrong.stderr);
    assert!(wrong.stderr.contains("`imu` is `on` or `off`, found `yes`"), "{}", wrong.stderr);
}
