//! `emulate --model picoscan150`: datagrams on the wire, REST beside them, and a destination that nobody has allowed.

use std::io::{Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::time::Duration;

use rowscan_protocol::challenge::{PASSWORD, REALM, USER, response};
use rowscan_protocol::compact::Telegram;
use serde_json::{Value, json};

use crate::common::binary::{Telling, assert_says, refused, run, text};

const MODEL: [&str; 6] = ["--model", "picoscan150", "--tcp", "127.0.0.1:0", "--rest", "127.0.0.1:0"];
/// For a datagram that never comes.
const PATIENCE: Duration = Duration::from_secs(30);

fn start(args: &[&str]) -> (Telling, String) {
    let mut telling = Telling::start("emulate", &[&["spindle"], &MODEL[..], args].concat());
    let places = [telling.next().expect("TCP"), telling.next().expect("REST")];
    assert_eq!(places.each_ref().map(|place| place["endpoint"].as_str().expect("named")), ["tcp", "rest"]);
    (telling, places[1]["address"].as_str().expect("an address").to_owned())
}

/// A request over HTTP: its code and its body.
pub(crate) fn ask(address: &str, head: &str, body: &[u8]) -> (u16, Value) {
    let mut stream = TcpStream::connect(address).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    let head = format!(
        "{head} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Length: {}\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes()).expect("sent");
    // A body that is too large may be refused before all of it was taken.
    let _ = stream.write_all(body);
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    let (head, body) = answer.split_once("\r\n\r\n").expect("a head and a body");
    let code = head.split(' ').nth(1).and_then(|code| code.parse().ok()).expect("a code");
    (code, serde_json::from_str(body).expect("JSON"))
}

/// Writes a variable as a client does: the code and the status of the answer.
pub(crate) fn post(address: &str, name: &str, value: &Value) -> (u16, Value) {
    let (_, told) = ask(address, "POST /api/getChallenge", br#"{"data":{"user":"Service"}}"#);
    let challenge = &told["challenge"];
    let word = |key: &str| challenge[key].as_str().expect("a word");
    let byte = |byte: &Value| byte.as_u64().and_then(|byte| u8::try_from(byte).ok()).expect("a byte");
    let salt: Vec<u8> = challenge["salt"].as_array().expect("a list").iter().map(byte).collect();
    let header = json!({
        "user": USER, "realm": REALM, "nonce": word("nonce"), "opaque": word("opaque"),
        "response": response(USER, PASSWORD, &salt, word("nonce"), name),
    });
    let body = json!({ "header": header, "data": { name: value } }).to_string();
    let (code, told) = ask(address, &format!("POST /api/{name}"), body.as_bytes());
    (code, told["header"]["status"].clone())
}

#[test]
fn segments_go_out_in_order_and_decode_reads_the_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("run.mcap");
    let taker = UdpSocket::bind("127.0.0.1:0").expect("a port");
    taker.set_read_timeout(Some(PATIENCE)).expect("set");
    let to = taker.local_addr().expect("bound").to_string();
    let (telling, rest) = start(&["--udp", &to, "--start", "streaming", "--record", text(&file)]);
    let (mut scans, mut bytes) = (Vec::new(), [0; 65_536]);
    while scans.len() < 25 {
        let read = taker.recv(&mut bytes).expect("a datagram");
        let telegram = Telegram::decode(&bytes[..read]).expect("a telegram");
        let mut again = Vec::new();
        telegram.encode(&mut again).expect("it is encoded");
        assert_eq!(again, bytes[..read]);
        if let Telegram::Scan(scan) = telegram {
            scans.push(scan);
        }
    }
    for pair in scans.windows(2) {
        let [one, next] = pair else { continue };
        assert_eq!(next.telegram_counter, one.telegram_counter + 1);
        let place = |scan: &rowscan_protocol::compact::ScanTelegram| {
            let module = &scan.modules.0[0];
            10 * module.frame_number + module.segment_counter
        };
        assert_eq!(place(next), place(one) + 1, "ten segments a turn");
    }
    let (code, told) = ask(&rest, "GET /api/ScanDataEthSettings", b"");
    let port: u16 = taker.local_addr().expect("bound").port();
    assert_eq!((code, &told["data"]["ScanDataEthSettings"]["Port"]), (200, &port.into()), "{told}");
    let ended = telling.end();
    let end = ended.iter().find(|line| line.get("datagrams_sent").is_some()).expect("it counts datagrams");
    assert!(
        end["datagrams_sent"].as_u64().expect("a count") >= 25 && end["datagrams_withheld"] == 0,
        "{end}"
    );
    let decoded = run(&["decode", text(&file)]);
    assert_eq!(decoded.code, Some(0), "{}", decoded.stderr);
    assert_says(&decoded.stdout, &["device Compact scan telegram_counter: 1,", "scan telegram_counter: 25,"]);
    // What programs read that do not know Compact: every turn that the file holds, the last one, too.
    let held = std::fs::read(&file).expect("it is there");
    let topics = mcap::MessageStream::new(&held)
        .expect("MCAP")
        .map(|message| message.expect("sound").channel.topic.clone());
    let turns = topics.filter(|topic| topic.ends_with("/scan")).count();
    let mut recording = rowscan_recording::Recording::open(&file).expect("it opens");
    let [report] = &rowscan_recording::account(&mut recording).expect("it reads")[..] else {
        panic!("one stream")
    };
    assert!(turns >= 2, "{turns} turns of 25 segments");
    assert_eq!(turns as u64, report.scans);
}

#[test]
fn a_destination_that_nobody_has_allowed_is_kept_and_nothing_is_sent() {
    let (telling, rest) = start(&["--start", "streaming"]);
    let (_, told) = ask(&rest, "GET /api/ScanDataEthSettings", b"");
    let delivered: Value = serde_json::json!([192, 168, 0, 100]);
    assert_eq!(told["data"]["ScanDataEthSettings"]["IPAddress"], delivered);
    let ended = telling.end();
    let end = ended.iter().find(|line| line.get("datagrams_sent").is_some()).expect("it counts datagrams");
    assert_eq!(
        (&end["datagrams_sent"], &end["destination_not_allowed"]),
        (&0.into(), &"192.168.0.100:2115".into())
    );
}

#[test]
fn rest_is_bounded_and_keeps_its_numbers_over_http() {
    let (telling, rest) = start(&[]);
    // Connections that say nothing make room for one that does.
    let silent: Vec<_> = (0..48).map(|_| TcpStream::connect(&rest).expect("it is taken")).collect();
    for (head, body, code, status) in [
        ("GET /api/SCdevicestate", b"".as_slice(), 200, 0),
        ("GET /api/FindMe", b"", 400, 1),
        ("GET /api/Unheard", b"", 404, 5),
        ("GET /other", b"", 404, 5),
        ("PUT /api/ScanDataEnable", b"{}", 400, 1),
        ("POST /api/ScanDataEnable", br#"{"data":{"ScanDataEnable":true}}"#, 401, 10),
        ("POST /api/getChallenge", br#"{"data":{"user":"Run"}}"#, 403, 4),
        ("POST /api/ScanDataEnable", &[b' '; 65 * 1024], 400, 7),
    ] {
        let (found, told) = ask(&rest, head, body);
        assert_eq!((found, told["header"]["status"].as_u64()), (code, Some(status)), "{head}: {told}");
    }
    drop(silent);
    telling.end();
}

#[test]
fn what_cannot_be_is_refused_at_once() {
    for flags in
        [["--rest", "127.0.0.1:0"], ["--udp", "127.0.0.1:2115"], ["--allow-destination", "192.0.2.1"]]
    {
        let args =
            [&["emulate", "spindle", "--model", "lms111", "--tcp", "127.0.0.1:0"], &flags[..]].concat();
        assert_says(&refused(&args), &["--model picoscan150"]);
    }
}

/// The page names every variable, and says what it does as the table does.
#[test]
fn the_page_has_every_variable() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/picoscan.md");
    let page = std::fs::read_to_string(path).expect("the page is there");
    for variable in rowscan_protocol::device::variable::VARIABLES {
        let is_told = page.lines().any(|line| {
            line.starts_with(&format!("| {}", variable.name))
                && line.ends_with(&format!(" | {} |", variable.effect))
        });
        assert!(is_told, "{}", variable.name);
    }
}
