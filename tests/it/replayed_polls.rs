//! Polls of a replayed scanner, and recordings of clients that poll. On a frozen clock.

use crate::common;

use std::time::Duration;

use common::replayed::{Packets, Replayed, connect, next_scan, played, replay, subscribed, ticking, write};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::replay::Survey;
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_recording::{Side, Taps};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::sleep;

/// Asks, and gives what is answered.
async fn ask(client: &mut DuplexStream, request: &str) -> String {
    let mut bytes = Vec::new();
    encode(Dialect::A, request.as_bytes(), &mut bytes);
    client.write_all(&bytes).await.expect("taken");
    let mut reply = Vec::new();
    while reply.last() != Some(&3) {
        reply.push(client.read_u8().await.expect("a byte"));
    }
    String::from_utf8_lossy(&reply[1..reply.len() - 1]).into_owned()
}

/// The telegram counter of a polled scan.
async fn poll(client: &mut DuplexStream) -> u16 {
    let reply = ask(client, "sRN LMDscandata").await;
    assert!(reply.starts_with("sRA LMDscandata 1 "), "{reply}");
    u16::from_str_radix(reply.split(' ').nth(7).expect("a counter"), 16).expect("hex")
}

fn folder() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    (folder, path)
}

/// A client that polled `scans` times, ten times a second, and was answered at once.
fn polling(scans: u16) -> Packets {
    let framed = |body: &str| {
        let mut bytes = Vec::new();
        encode(Dialect::A, body.as_bytes(), &mut bytes);
        bytes
    };
    let mut packets = vec![(Duration::ZERO, Side::Host, framed("sRN DeviceIdent"))];
    packets.push((Duration::from_millis(1), Side::Device, framed("sRA DeviceIdent 6 LMS111 5 V1.30")));
    for scan in 0..scans {
        let at = Duration::from_millis(100 * u64::from(scan + 1));
        let body = format!(
            "sRA LMDscandata 1 1 16F4C7A 0 0 {scan:X} {scan:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 \
             0 7D0 0 0 0 0 0 0",
            u32::from(scan) * 100_000
        );
        packets.push((at, Side::Host, framed("sRN LMDscandata")));
        packets.push((at + Duration::from_millis(2), Side::Device, framed(&body)));
    }
    packets
}

fn start(path: &std::path::Path, scale: TimeScale) -> Replayed {
    replay(path, None, scale, played(), Taps::default())
}

#[tokio::test(start_paused = true)]
async fn a_recording_of_a_client_that_polls_is_that_scanner_again() {
    let (_folder, path) = folder();
    write(&path, &polling(30));
    let survey = Survey::read(&path).expect("it can be played");
    assert_eq!((survey.parts[0].scans, survey.parts[0].polled), (30, true));
    for scale in [TimeScale::Paced(1.0), TimeScale::Max] {
        let mut replayed = start(&path, scale);
        let mut client = connect(&mut replayed.emulator);
        let mut counters = Vec::new();
        for _ in 0..30 {
            counters.push(poll(&mut client).await);
            sleep(Duration::from_millis(100)).await;
        }
        assert_eq!(counters, (0..30).collect::<Vec<u16>>(), "{scale:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn polled_scans_come_to_a_subscriber_as_well() {
    let (_folder, path) = folder();
    write(&path, &polling(30));
    let mut replayed = start(&path, TimeScale::Paced(1.0));
    let mut client = subscribed(&mut replayed).await;
    for expected in 0..30 {
        assert_eq!(next_scan(&mut client).await, (expected, u32::from(expected) * 100_000));
    }
    replayed.player.ended().await;
}

/// Beside scans that the device sent by itself, polled ones are the same scans again.
#[tokio::test(start_paused = true)]
async fn what_was_polled_beside_a_subscription_is_played_once() {
    let (_folder, path) = folder();
    let mut packets = polling(5);
    let events: Packets = packets
        .iter()
        .filter(|(.., bytes)| bytes.starts_with(b"\x02sRA LMDscandata"))
        .map(|(at, side, bytes)| (*at, *side, [b"\x02sSN", &bytes[4..]].concat()))
        .collect();
    packets.extend(events);
    packets.sort_by_key(|(at, ..)| *at);
    write(&path, &packets);
    let survey = Survey::read(&path).expect("it can be played");
    assert_eq!((survey.parts[0].scans, survey.parts[0].polled), (5, false));
}

#[tokio::test(start_paused = true)]
async fn a_single_poll_is_answered_with_the_first_scan_and_starts_no_time() {
    let (_folder, path) = folder();
    ticking(&path, 30);
    let mut replayed = replay(&path, Some("lms111"), TimeScale::Paced(1.0), played(), Taps::default());
    let mut client = connect(&mut replayed.emulator);
    assert_eq!(poll(&mut client).await, 0);
    sleep(Duration::from_secs(10)).await;
    let mut subscriber = subscribed(&mut replayed).await;
    for expected in 0..30 {
        assert_eq!(next_scan(&mut subscriber).await.0, expected);
    }
}

#[tokio::test(start_paused = true)]
async fn a_client_that_polls_again_gets_the_scans_as_they_are_played() {
    let (_folder, path) = folder();
    ticking(&path, 30);
    let mut replayed = replay(&path, Some("lms111"), TimeScale::Paced(1.0), played(), Taps::default());
    let mut client = connect(&mut replayed.emulator);
    let mut counters = vec![poll(&mut client).await];
    for _ in 0..6 {
        counters.push(poll(&mut client).await);
        sleep(Duration::from_millis(1001)).await;
    }
    assert_eq!(counters, [0, 0, 1, 2, 3, 4, 5]);
}

/// A clock that waits for its clients plays a scan a poll: none goes by.
#[tokio::test(start_paused = true)]
async fn at_max_polls_miss_no_scan() {
    let (_folder, path) = folder();
    ticking(&path, 30);
    let mut replayed = replay(&path, Some("lms111"), TimeScale::Max, played(), Taps::default());
    let mut client = connect(&mut replayed.emulator);
    let mut counters = Vec::new();
    for _ in 0..31 {
        counters.push(poll(&mut client).await);
        sleep(Duration::from_secs(1)).await;
    }
    counters.dedup();
    assert_eq!(counters, (0..30).collect::<Vec<u16>>());
}

/// What a recorded scan has is all that can be served.
#[tokio::test(start_paused = true)]
async fn a_client_that_asks_for_less_gets_scans_cut_to_measure() {
    let (_folder, path) = folder();
    write(&path, &rich(20));
    let mut replayed = replay(&path, Some("lms111"), TimeScale::Paced(1.0), played(), Taps::default());
    let mut client = connect(&mut replayed.emulator);
    assert_eq!(ask(&mut client, "sMN SetAccessMode 3 F4724744").await, "sAN SetAccessMode 1");
    let full = ask(&mut client, "sRN LMDscandata").await;
    assert!(full.contains("RSSI1") && full.contains(" 7E8 "), "{full}");
    // Remission at its recorded width, and the time: what is recorded. An encoder is not.
    for (contents, answer) in [
        ("01 00 1 0 0 00 00 0 0 0 1 +1", "sWA LMDscandatacfg"),
        ("01 00 1 1 0 00 00 0 0 0 1 +1", "sFA 4"),
        ("01 00 1 0 0 01 00 0 0 0 1 +1", "sFA 4"),
        ("01 00 1 0 0 00 00 0 0 0 1 +2", "sFA 4"),
        ("01 00 0 0 0 00 00 0 0 0 0 +1", "sWA LMDscandatacfg"),
    ] {
        assert_eq!(ask(&mut client, &format!("sWN LMDscandatacfg {contents}")).await, answer, "{contents}");
    }
    assert_eq!(ask(&mut client, "sRN LMDscandatacfg").await, "sRA LMDscandatacfg 1 0 0 0 0 0 0 0 0 0 0 1");
    let cut = ask(&mut client, "sRN LMDscandata").await;
    assert!(cut.ends_with("DIST1 3F800000 00000000 FFF92230 1388 21D") || !cut.contains("RSSI1"), "{cut}");
    assert!(cut.contains(" 21D ") && !cut.contains(" 7E8 "), "{cut}");
    // Ahead only, one degree of it.
    assert_eq!(ask(&mut client, "sWN LMPoutputRange 1 1388 DBBA0 E09C0").await, "sWA LMPoutputRange");
    assert_eq!(ask(&mut client, "sEN LMDscandata 1").await, "sEA LMDscandata 1");
    let mut event = Vec::new();
    while event.last() != Some(&3) {
        event.push(client.read_u8().await.expect("a byte"));
    }
    let event = String::from_utf8_lossy(&event).into_owned();
    // Beams 270 to 274 of the recorded ones.
    assert!(event.contains(" DBBA0 1388 5 4F6 4F7 4F8 4F9 4FA 0 0 0 0 0 0"), "{event}");
    // Wider again than the recording is refused; as wide is not.
    assert_eq!(ask(&mut client, "sWN LMPoutputRange 1 1388 FFF92230 225510").await, "sWA LMPoutputRange");
}

/// Scans of 541 beams with remission and time.
fn rich(seconds: u16) -> Packets {
    let numbers = |from: u16| (0..541).map(|beam| format!(" {:X}", from + beam)).collect::<String>();
    let grey = " 7F".repeat(541);
    (0..seconds)
        .map(|scan| {
            let body = format!(
                "sSN LMDscandata 1 1 16F4C7A 0 0 {scan:X} {scan:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 21D{1} \
                 1 RSSI1 3F800000 00000000 FFF92230 1388 21D{grey} 0 0 0 1 7E8 1 1 0 0 {scan:X} 0 0",
                u32::from(scan) * 1_000_000,
                numbers(1000),
            );
            let mut bytes = Vec::new();
            encode(Dialect::A, body.as_bytes(), &mut bytes);
            (Duration::from_secs(u64::from(scan)), Side::Device, bytes)
        })
        .collect()
}
