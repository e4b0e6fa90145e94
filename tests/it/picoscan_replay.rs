//! A recorded picoScan that is played: REST and datagrams, the same estimate as of the file, and what a recording cannot be.

use std::net::UdpSocket;
use std::path::Path;
use std::time::Duration;

use rowscan_recording::{Recording, Side};
use serde_json::{Value, json};

use crate::common::binary::{Telling, assert_says, refused, rowscan};
use crate::common::captured::pcap;
use crate::common::recorded::{estimate, folder};
use crate::picoscan::{ask, post};

const SCANS: [&str; 4] = ["--model", "picoscan150", "--scans", "60"];
/// For a datagram that never comes.
const PATIENCE: Duration = Duration::from_secs(30);

/// A replay with REST alone, and where that is.
fn replay(args: &[&str]) -> (Telling, String) {
    let mut telling =
        Telling::start("replay", &[args, &["--rest", "127.0.0.1:0", "--time-scale", "4"]].concat());
    let rest = telling.address();
    (telling, rest)
}

/// A row over UDP, recorded as the driver reads it; its estimate.
fn recorded(scene: &str, file: &str) -> String {
    let args =
        ["--model", "picoscan150", "--rest", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--time-scale", "4"];
    let mut telling = Telling::start("emulate", &[&[scene], &args[..]].concat());
    assert_eq!(telling.next().expect("TCP")["endpoint"], "tcp");
    let rest = telling.address();
    estimate(&format!("picoscan://{rest}?udp=0"), scene, &[&SCANS[..], &["--record", file]].concat())
}

/// The device's datagrams in a recording, with their times.
fn datagrams(file: &Path) -> Vec<(u64, Vec<u8>)> {
    let mut recording = Recording::open(file).expect("it opens");
    let mut all = Vec::new();
    while let Some(packet) = recording.next_packet().expect("it reads") {
        if packet.from == Some(Side::Device) {
            all.push((packet.at_ns.expect("a time"), packet.bytes));
        }
    }
    all
}

/// UDP in an Ethernet packet.
fn packet(bytes: &[u8]) -> Vec<u8> {
    let mut packet = vec![0_u8; 12];
    packet.extend([0x08, 0x00, 0x45, 0]);
    packet.extend((28 + bytes.len() as u16).to_be_bytes());
    packet.extend([0, 0, 0x40, 0, 64, 17, 0, 0, 192, 168, 0, 1, 192, 168, 0, 100]);
    packet.extend([2115_u16, 2115, 8 + bytes.len() as u16, 0].iter().flat_map(|word| word.to_be_bytes()));
    packet.extend(bytes);
    packet
}

#[test]
fn a_replay_gives_the_estimate_of_its_file_to_the_last_figure() {
    let (_folder, path) = folder();
    let (scene, file, capture) = (path("row.toml"), path("row.mcap"), path("row.pcap"));
    let live = recorded(&scene, &file);
    // The file may hold a turn more: the scanner sends until the end of the stream is answered.
    assert_eq!(estimate(&file, &scene, &SCANS), live);
    let packets = datagrams(Path::new(&file)).into_iter().map(|(at_ns, bytes)| (at_ns, packet(&bytes)));
    std::fs::write(&capture, pcap(packets)).expect("written");
    for played in [&file, &capture] {
        let (telling, rest) = replay(&[played]);
        let told = estimate(&format!("picoscan://{rest}?udp=0"), &scene, &SCANS);
        assert!(told == live, "{played}: {told}\nlive: {live}");
        drop(telling);
    }

    loses_what_is_damaged_alone(&path, &file);
    goes_where_it_may(&path, &file, &scene);
}

/// A datagram that is damaged is not sent, and the one behind it is.
fn loses_what_is_damaged_alone(path: &impl Fn(&str) -> String, file: &str) {
    let mut all: Vec<(u64, Vec<u8>)> =
        datagrams(Path::new(file)).into_iter().filter(|(_, bytes)| bytes.len() > 100).take(120).collect();
    let damaged = 50;
    let byte = &mut all[damaged].1[90];
    *byte = !*byte;
    let capture = path("damaged.pcap");
    let packets = all.iter().map(|(at_ns, bytes)| (*at_ns, packet(bytes)));
    std::fs::write(&capture, pcap(packets)).expect("written");
    let taker = UdpSocket::bind("127.0.0.1:0").expect("a port");
    taker.set_read_timeout(Some(PATIENCE)).expect("set");
    let to = taker.local_addr().expect("bound").to_string();
    let telling = Telling::start("replay", &[&capture, "--udp", &to, "--time-scale", "2"]);
    let mut bytes = vec![0; 65_536];
    for (number, (_, sent)) in all.iter().enumerate().filter(|(number, _)| *number != damaged) {
        let read = taker.recv(&mut bytes).expect("a datagram");
        assert!(bytes[..read] == sent[..], "datagram {number}");
    }
    drop(telling);
}

/// What is sent, when, where; and what is refused.
fn goes_where_it_may(path: &impl Fn(&str) -> String, file: &str, scene: &str) {
    // The encoder's, which are shorter than any segment, go to a port of their own, and only where somebody has asked for them.
    let segments = |file: &str| -> Vec<(u64, Vec<u8>)> {
        datagrams(Path::new(file)).into_iter().filter(|(_, bytes)| bytes.len() > 100).collect()
    };
    let recorded = segments(file);
    let taker = UdpSocket::bind("127.0.0.1:0").expect("a port");
    taker.set_read_timeout(Some(PATIENCE)).expect("set");
    let to = taker.local_addr().expect("bound").to_string();
    let again = path("again.mcap");
    // Slow enough that what waits for this test fits its socket: about 90 datagrams, which is 100 ms of the recording.
    let telling = Telling::start("replay", &[file, "--udp", &to, "--time-scale", "2", "--record", &again]);
    let mut bytes = vec![0; 65_536];
    for (number, (_, sent)) in recorded.iter().enumerate() {
        let read = taker.recv(&mut bytes).expect("a datagram");
        assert!(bytes[..read] == sent[..], "datagram {number}");
    }
    let ended = telling.end();
    let end = ended.iter().find(|line| line.get("datagrams_sent").is_some()).expect("it counts datagrams");
    assert_eq!(end["datagrams_sent"], recorded.len(), "{end}");
    let played = segments(&again);
    assert!(played.iter().map(|(_, bytes)| bytes).eq(recorded.iter().map(|(_, bytes)| bytes)));
    let span_s = |all: &[(u64, Vec<u8>)]| (all[all.len() - 1].0 - all[0].0) as f64 * 1e-9;
    assert!((span_s(&played) - span_s(&recorded)).abs() < 1.0, "{} s", span_s(&played));

    // A foreign destination is kept, and nothing is sent.
    let (telling, rest) = replay(&[file]);
    let (_, ident) = ask(&rest, "GET /api/PerformanceProfileNumber", b"");
    assert_eq!(ident["data"]["PerformanceProfileNumber"], 2, "as recorded");
    let serial = recorded_serial(&recorded[0].1);
    let (_, told) = ask(&rest, "GET /api/SerialNumber", b"");
    assert_eq!(told["data"]["SerialNumber"], serial.to_string());
    let place = json!({ "Protocol": 1, "IPAddress": [192, 0, 2, 7], "Port": 2115 });
    assert_eq!(post(&rest, "ScanDataEthSettings", &place), (200, json!(0)));
    assert_eq!(post(&rest, "ScanDataEnable", &Value::Bool(true)), (200, json!(0)));
    // What was recorded with one echo and 15 Hz is not sent otherwise.
    for (name, value) in [("PerformanceProfileNumber", 8), ("FREchoFilter", 1)] {
        assert_eq!(post(&rest, name, &json!(value)), (400, json!(9)), "{name}");
        let (_, told) = ask(&rest, &format!("GET /api/{name}"), b"");
        assert_ne!(told["data"][name], value, "{name} stays");
    }
    assert_eq!(post(&rest, "FREchoFilter", &json!(2)), (200, json!(0)), "which echo it was nobody can tell");
    let ended = telling.end();
    let end = ended.iter().find(|line| line.get("datagrams_sent").is_some()).expect("it counts datagrams");
    assert_eq!(
        (&end["datagrams_sent"], &end["destination_not_allowed"]),
        (&json!(0), &json!("192.0.2.7:2115"))
    );

    assert_says(
        &refused(&["replay", file, "--rest", "127.0.0.1:0", "--stamps", "now"]),
        &["stamps of Compact telegrams stay as recorded"],
    );
    for (args, said) in [
        (["--time-scale", "max"], "nothing holds back who sends them at --time-scale max"),
        (["--model", "lms111"], "LMS111 does not speak"),
    ] {
        let ended =
            rowscan().args(["replay", file, "--rest", "127.0.0.1:0"]).args(args).output().expect("it runs");
        assert!(!ended.status.success(), "{args:?}");
        assert_says(&String::from_utf8(ended.stderr).expect("text"), &[said]);
    }
    // A replay can be begun at a scan.
    let (telling, rest) = replay(&[file, "--from", "scan:20"]);
    let args = ["--model", "picoscan150", "--scans", "30"];
    let told: Value =
        serde_json::from_str(&estimate(&format!("picoscan://{rest}?udp=0"), scene, &args)).expect("JSON");
    assert_eq!((&told["scans"], &told["segments_lost"]), (&json!(30), &json!(0)));
    drop(telling);
}

fn recorded_serial(datagram: &[u8]) -> u32 {
    use rowscan_protocol::compact::Telegram;
    match Telegram::decode(datagram) {
        Ok(Telegram::Scan(scan)) => scan.modules.0[0].sender_id,
        other => panic!("{other:?}"),
    }
}
