//! The page beside `rowscan check`: every run at one address, and no verdict depends on who looks.

use std::net::{SocketAddr, TcpListener};

use crate::common::binary::{Telling, assert_says, refused, run, text};
use crate::web::{http, json};

/// Two seconds of scans, by this program's own driver; time goes as on the wall.
const SCENARIO: &str = "version = 1\nscene = \"spindle\"\nseed = 7\nrepeat = { seeds = 2 }\n\
    clock = { mode = \"paced\" }\nend = { s = 4 }\n\
    [[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
    [[run]]\nid = \"sut\"\ncommand = [\"{rowscan}\", \"estimate\", \"tcp://{left.tcp}\", \"--scans\", \"100\"]\n\
    ready = { alive_s = 0 }\n\
    [[expect]]\nwhat = \"scans_lost\"\nequals = 0\n[[expect]]\nwhat = \"exit_code\"\n";

fn scenario(folder: &std::path::Path) -> std::path::PathBuf {
    let path = folder.join("seen.toml");
    std::fs::write(&path, SCENARIO).expect("written");
    path
}

#[tokio::test(flavor = "multi_thread")]
async fn every_run_is_shown_at_the_same_address() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scenario(folder.path());
    let mut telling = Telling::start("check", &["--web", "127.0.0.1:0", text(&path)]);
    let mut addresses = Vec::new();
    for seed in ["7", "8"] {
        let address = loop {
            let line = telling.next().expect("the page of every run");
            if line["event"] == "listening" {
                break line["address"].as_str().expect("an address").to_owned();
            }
        };
        let place: SocketAddr = address.parse().expect("an address");
        let about = json(place, "/watch/about").await;
        assert_eq!(about["title"], format!("rowscan check seen, seed {seed}"));
        assert_eq!(about["scanners"][0]["name"], "left");
        let seen = loop {
            let state = json(place, "/watch/state").await;
            if state["scanners"][0]["scans"].as_u64() > Some(0) {
                break state;
            }
        };
        assert_eq!(seen["scanners"][0]["clients"], 1, "{seen}");
        addresses.push(address);
    }
    assert_eq!(addresses[0], addresses[1]);
    let verdicts: Vec<_> =
        std::iter::from_fn(|| telling.next()).filter(|line| line["verdict"].is_string()).collect();
    assert!(verdicts.len() >= 2 && verdicts.iter().all(|line| line["verdict"] == "passed"), "{verdicts:?}");
}

/// The same drive with the reference controller and a boom.
const SPRAYS: &str = "version = 1\nscene = \"spindle\"\nseed = 7\nclock = { mode = \"paced\" }\nend = { s = 6 }\n\
    sprayer = { boom = \"boom.toml\", bus = \"can0\" }\n\
    [[device]]\nid = \"left\"\nmodel = \"lms111\"\n[[bus]]\nid = \"can0\"\nport = \"socketcand:127.0.0.1:0\"\n\
    [[run]]\nid = \"sut\"\ncommand = [\"{rowscan}\", \"spray\", \"tcp://{left.tcp}\", \"--rig\", \"spindle\", \"--can\", \"socketcand-client:{can0.address}/can0\", \"--boom\", \"{scenario}/boom.toml\"]\n\
    ready = { line = \"ready\" }\n[[expect]]\nwhat = \"recall\"\nabove = 0\n";

#[tokio::test(flavor = "multi_thread")]
async fn what_the_sprayer_has_done_so_far_is_drawn_while_it_drives() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("sprays.toml");
    std::fs::write(&path, SPRAYS).expect("written");
    std::fs::write(folder.path().join("boom.toml"), include_str!("../../tools/scenarios/sprayer/boom.toml"))
        .expect("written");
    let mut telling = Telling::start("check", &["--web", "127.0.0.1:0", text(&path)]);
    let address: SocketAddr = loop {
        let line = telling.next().expect("the page");
        if line["event"] == "listening" {
            break line["address"].as_str().and_then(|address| address.parse().ok()).expect("an address");
        }
    };
    assert_eq!(json(address, "/watch/about").await["has_map"], true);
    let map = loop {
        let (status, head, body) = http(address, "GET /watch/map HTTP/1.1", "").await;
        let body = String::from_utf8(body).expect("text");
        if status == 200 {
            assert!(head.contains("image/svg+xml"), "{head}");
            break body;
        }
        assert!(status == 404 && body.contains("has not begun"), "{status} {body}");
    };
    assert!(map.contains("so far: recall") && map.contains("wanted and sprayed"), "{map}");
}

#[test]
fn a_page_that_cannot_be_is_told_before_anything_runs() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scenario(folder.path());
    let taken = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("bound").to_string();
    assert_says(&refused(&["check", text(&path), "--web", &address]), &["cannot listen on", &address]);
    let several = refused(&["check", text(&path), text(&path), "-j", "2", "--web", "127.0.0.1:0"]);
    assert_says(&several, &["--web shows one run at a time", "-j 1", "-j 2"]);
    // And looking is no flag that a check needs.
    assert_eq!(run(&["check", "--markdown"]).code, Some(0));
}
