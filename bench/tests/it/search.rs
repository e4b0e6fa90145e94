//! A scanner that is searched for answers where it listens, and while it hears.

use std::time::Duration;

use rowscan_bench::{Bench, BenchSpec, DeviceSpec, Endpoint, ScannerSpec, StartState};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::device::{Profile, Start};
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::files::load_scene;
use tokio::net::UdpSocket;
use tokio::time::timeout;

/// The request of SICK's guide, with a number of ours.
const REQUEST: [u8; 24] =
    [16, 0, 0, 8, 255, 255, 255, 255, 255, 255, 9, 8, 7, 6, 1, 0, 127, 0, 0, 1, 255, 0, 0, 0];

/// The answer of an LMS111 in this state; none within the patience.
async fn answer(device: DeviceSpec) -> Result<Option<Vec<u8>>, Box<dyn std::error::Error>> {
    let stage = Stage::grow(load_scene("spindle", |_| {})?, &|_, _| {})?;
    let mut spec = BenchSpec::new(&stage, TimeScale::Paced(1.0));
    let scanner = ScannerSpec::new(0, AnyModel::named("lms111")?).at(Endpoint::Tcp("127.0.0.1:0".to_owned()));
    spec.scanners.push(ScannerSpec { search: Some("127.0.0.1:0".to_owned()), device, ..scanner });
    let mut bench = Bench::open(spec).await?;
    bench.run();
    let place = bench.places().iter().find(|place| place.kind == "search").ok_or("it is announced")?;
    let socket = UdpSocket::bind("127.0.0.1:0").await?;
    let mut bytes = [0; 256];
    // What is no request is not answered.
    for datagram in [&b"anybody there?"[..], &REQUEST] {
        socket.send_to(datagram, place.at.to_string()).await?;
    }
    let heard = timeout(Duration::from_millis(500), socket.recv_from(&mut bytes)).await;
    Ok(heard.ok().transpose()?.map(|(length, _)| bytes[..length].to_vec()))
}

#[tokio::test]
async fn a_search_finds_a_scanner_unless_it_still_starts_up() -> Result<(), Box<dyn std::error::Error>> {
    let found = answer(DeviceSpec::default()).await?.ok_or("an answer")?;
    assert_eq!(found[..4], [0x90, 0, 0, 39]);
    assert_eq!(found[10..14], [9, 8, 7, 6], "the request's number");
    assert!(found[16..].starts_with(b"EIPa\x7F\0\0\x01"), "{found:?}");
    let starting = DeviceSpec {
        profile: Profile::Field,
        start: Some(StartState::Cola(Start::PowerUp)),
        ..DeviceSpec::default()
    };
    assert_eq!(answer(starting).await?, None, "15 s long it says nothing");
    Ok(())
}
