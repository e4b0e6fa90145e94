//! A client that only listens, to what real devices sent.

use std::time::Duration;

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::frame::{Dialect, encode as frame};
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram, encode};

/// Scan counters of all scans heard; anything else than a scan fails.
fn hear(client: &mut ColaClient, bytes: &[u8]) -> Vec<u16> {
    let mut counters = Vec::new();
    for piece in bytes.chunks(1460) {
        client.handle_bytes(Duration::ZERO, piece);
        while let Some(event) = client.poll_event() {
            assert_eq!(event, HostEvent::Scan);
            counters.push(client.scan().scan_counter);
        }
    }
    assert!(client.poll_transmit().is_none() && client.poll_timeout().is_none());
    counters
}

#[test]
fn every_recorded_scan_is_heard_with_or_without_the_hosts_frames_between() {
    for recording in crate::facts::recordings() {
        let both: Vec<u8> = recording.index.iter().flat_map(|at| recording.frame(at)).copied().collect();
        for stream in [&recording.device_to_host, &both] {
            let mut client = ColaClient::listen(64 * 1024);
            let counters = hear(&mut client, stream);
            assert_eq!(counters.len() as u64, recording.json["scan_telegrams"].as_u64().unwrap());
            let first = recording.json["first_scan"]["scan_counter"].as_u64().unwrap();
            assert_eq!(u64::from(counters[0]), first, "{}", recording.name);
            assert_eq!(client.counts().bad, 0);
        }
    }
}

#[test]
fn dialects_may_alternate_and_polled_scans_count() {
    for recording in crate::facts::recordings() {
        let mut stream = Vec::new();
        let mut scans = 0;
        for at in &recording.index {
            let telegram = Telegram::parse(Dialect::B, recording.payload(at)).unwrap();
            if telegram.kind == Kind::Sn && telegram.name.starts_with("LMDscandata") {
                let scan: LmdScandata = telegram.args.decode().unwrap();
                let dialect = if scans % 2 == 0 { Dialect::A } else { Dialect::B };
                let mut payload = Vec::new();
                encode(dialect, Kind::Ra, "LMDscandata", &scan, &mut payload);
                frame(dialect, &payload, &mut stream);
                scans += 1;
            }
        }
        assert_eq!(hear(&mut ColaClient::listen(64 * 1024), &stream).len(), scans);
    }
}

/// The recorded device answers our client's own requests as it answered the recorded ones.
#[test]
fn a_recorded_device_takes_the_client_to_its_scans() {
    for recording in crate::facts::recordings().into_iter().take(2) {
        let replies = |name: &str| {
            let frames = recording.index.iter().filter(|at| at.from_device);
            frames.map(|at| recording.frame(at)).find(move |frame| {
                let telegram = Telegram::parse(Dialect::B, &frame[8..frame.len() - 1]).unwrap();
                telegram.name == name && telegram.kind != Kind::Sn
            })
        };
        let mut client = ColaClient::new(ColaConfig::default(), Dialect::B);
        let mut events = Vec::new();
        while let Some(request) = client.poll_transmit().and_then(Transmit::into_frame) {
            let name = Telegram::parse(Dialect::B, &request[8..request.len() - 1]).unwrap().name.to_owned();
            // Not asked for in the recordings; an unknown variable is refused and the start-up goes on.
            let unknown = [2, 2, 2, 2, 0, 0, 0, 5, b's', b'F', b'A', 0, 3, 0x77];
            client.handle_bytes(Duration::ZERO, replies(&name).unwrap_or(&unknown));
            events.extend(std::iter::from_fn(|| client.poll_event()));
        }
        assert!(matches!(events[0], HostEvent::Refused { command: "DeviceIdent", fatal: false, .. }));
        assert!(
            matches!(&events[1], HostEvent::Ready(info) if info.firmware.starts_with("V1.80")),
            "{events:?}"
        );
        let scans = recording.index.iter().filter(|at| at.from_device && at.len > 1000);
        let stream: Vec<u8> = scans.flat_map(|at| recording.frame(at)).copied().collect();
        assert_eq!(
            hear(&mut client, &stream).len() as u64,
            recording.json["scan_telegrams"].as_u64().unwrap()
        );
    }
}
