//! `rowscan watch FILE`: the recording stands, goes to a place, and goes back; what is told is of what was read to there.

use std::net::SocketAddr;

use serde_json::Value;

use crate::common::binary::{Telling, refused, text};
use crate::common::replayed::ticking;
use crate::web::{http, json};

/// Sends an order to the clock; the status, and what is answered.
async fn clock(place: SocketAddr, order: &str) -> (u16, Value) {
    let (status, _, body) =
        http(place, "POST /clock HTTP/1.1\r\nContent-Type: application/json", order).await;
    (status, serde_json::from_slice(&body).expect("json"))
}

/// The first scanner, once `is_so` of it.
async fn scanner(place: SocketAddr, is_so: impl Fn(&Value) -> bool) -> Value {
    loop {
        let found = json(place, "/watch/state").await["scanners"][0].clone();
        if is_so(&found) {
            return found;
        }
        tokio::task::yield_now().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_recording_goes_to_a_place_and_back_while_it_stands() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    // A scan a second.
    ticking(&path, 60);
    let mut watch = Telling::start("watch", &[text(&path), "--web", "127.0.0.1:0"]);
    let place: SocketAddr = watch.address().parse().expect("an address");
    assert_eq!(clock(place, r#"{"paused": true}"#).await.0, 200);
    while json(place, "/clock").await["recorded_span_s"] != serde_json::json!([0.0, 59.0]) {
        tokio::task::yield_now().await;
    }
    // Forward: nothing on the way is left out. Back: it is read anew. At the end: it can still be sent back.
    for (to, scans, ended) in
        [("50s", 51, false), ("10.5s", 11, false), ("59s", 60, true), ("5.2s", 6, false), ("0s", 1, false)]
    {
        let (status, told) = clock(place, &format!(r#"{{"seek": "{to}"}}"#)).await;
        assert_eq!(status, 200, "{to}: {told}");
        assert_eq!(format!("{}s", told["recorded_s"]).replace(".0s", "s"), to, "it stands there");
        scanner(place, |found| found["scans"] == scans && found["ended"] == ended).await;
    }
    for (wrong, says) in [("61s", "ends after 59.000 s"), ("scan:3", "rowscan replay"), ("-1s", "12.5s")] {
        let (status, told) = clock(place, &format!(r#"{{"seek": "{wrong}"}}"#)).await;
        assert_eq!(status, 409, "{wrong}: {told}");
        assert!(told["error"].as_str().expect("words").contains(says), "{told}");
    }
    let rest = watch.end();
    let estimate = rest.iter().find(|line| line["scans"].is_number()).expect("an estimate");
    assert_eq!(estimate["scans"], 1, "of what was read since it was sent back");
}

#[test]
fn what_is_not_there_is_not_watched() {
    let message = refused(&["watch", "/nowhere/none.mcap", "--web", "127.0.0.1:0"]);
    assert!(message.contains("/nowhere/none.mcap"), "{message}");
}
