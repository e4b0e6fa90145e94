//! What goes wrong on a tractor: the fix is lost, a reader goes, it stands for an hour.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use crate::common;

use std::time::Duration;

use bytes::Bytes;
use common::small_scene;
use rowscan_bus::nmea::{GnssEpochs, NmeaLine, NmeaPlace, SpeedReader};
use rowscan_bus::pgn::tractor::GROUND_SPEED;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{CanFrame, J1939Id};
use rowscan_canopy::{AdvanceSource, GroundSpeed, Pipeline, Warning};
use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::{EncoderReading, Scan};
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::gnss::{FixQuality, GnssEvent};
use rowscan_vehicle::trajectory::{Drive, Leg};
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::net::TcpStream;

const SECOND: u64 = 1_000_000_000;
/// Scans a second.
const RATE: u64 = 50;

#[test]
fn a_fix_lost_for_ten_seconds_is_bridged_by_the_last_speed_and_told() {
    let mut scene = small_scene();
    let event = GnssEvent { from_s: 3.0, to_s: 13.0, quality: FixQuality::None, noise_m: None };
    scene.gnss.events = vec![event];
    scene.drive = Drive { legs: vec![leg(0.0, 0.8), leg(60.0, 0.8)], ..Drive::default() };
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let (device, world) = stage.scanner_on(&tractor, 0, model::by_name("lms111").unwrap()).unwrap();
    let mut nmea = GnssEpochs::new(tractor.clone(), stage.receiver());
    let (mut reader, mut speed_m_s) = (SpeedReader::default(), None);
    let (mut offline, mut scan) = (Offline::new(device, world), Scan::default());
    let mut pipeline = Pipeline::new(Some(&stage.rig), 0, None).unwrap();
    for turn in 1..=20 * RATE {
        assert!(offline.scan_into(&mut scan).unwrap());
        while nmea.next() <= SimTime(turn * SECOND / RATE) {
            for told in nmea.next_epoch().lines().filter_map(|line| reader.line(line)) {
                speed_m_s = told;
            }
        }
        pipeline.push_at_speed(&scan, GroundSpeed { source: AdvanceSource::Gnss, speed_m_s });
    }
    let estimate = pipeline.finish();
    assert_eq!(estimate.advance_source, Some(AdvanceSource::Gnss), "it goes on by the same source");
    let held = estimate.warnings.iter().find_map(|warning| match warning {
        Warning::SpeedHeld { seconds } => Some(*seconds),
        _ => None,
    });
    assert!((held.expect("it is told") - 10.0).abs() < 0.3, "{held:?}");
    // Nothing is lost by it at a steady speed: 20 s at 0.8 m/s, less the tenth of a second until the first epoch that says so.
    assert!((estimate.advance_m.unwrap() - 15.92).abs() < 0.05, "{:?}", estimate.advance_m);
}

fn leg(seconds: f64, speed_m_s: f64) -> Leg {
    Leg { seconds, speed_m_s, slip: None }
}

#[test]
fn an_hour_at_standstill_adds_nothing_and_nothing_drifts() {
    const HOUR_S: u64 = 3600;
    let mut scene = small_scene();
    let legs = vec![
        leg(0.0, 1.0),
        leg(1.0, 1.0),
        leg(0.0, 0.0),
        leg(HOUR_S as f64, 0.0),
        leg(0.0, 1.0),
        leg(60.0, 1.0),
    ];
    scene.drive = Drive { legs, ..Drive::default() };
    let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
    let (tractor, mut frames) = (stage.tractor(), Vec::new());
    tractor.begin(SimTime::ZERO);
    let mut ecu = TractorEcu::new(tractor.clone(), stage.receiver());
    ecu.open(SimTime::ZERO, &mut frames);
    let mut nmea = GnssEpochs::new(tractor.clone(), stage.receiver());

    // A wall, so that what an hour of it would add is known: 2 m a metre.
    let rig = Rig { encoder_ticks_per_m: Some(1000.0), ..stage.rig.clone() };
    let wall = common::wall(&rig);
    let estimate = |standing_s: u64| {
        let mut pipeline = Pipeline::new(Some(&rig), 0, None).unwrap();
        let mut scan = wall.clone();
        for turn in 0..(2 + standing_s) * RATE {
            let driven = turn.min(RATE) + turn.saturating_sub((1 + standing_s) * RATE);
            scan.telegram_counter = turn as u16;
            scan.scan_time_us = (turn * 20_000) as u32;
            scan.encoders = vec![EncoderReading { position_ticks: (driven * 20) as u32, speed: 0 }];
            pipeline.push(&scan);
        }
        pipeline.finish()
    };
    let (without, with) = (estimate(0), estimate(HOUR_S));
    assert_eq!(with.scans, (2 + HOUR_S) * RATE);
    assert_eq!((with.scans_repeated, with.scans_lost), (0, Some(0)));
    let (before_m2, after_m2) =
        (without.impacted_total_area_m2.unwrap(), with.impacted_total_area_m2.unwrap());
    assert!((after_m2 - before_m2).abs() < 1e-9 * before_m2, "{before_m2} {after_m2}");
    assert_eq!(without.advance_m, with.advance_m);
    assert_eq!(without.warnings, with.warnings);

    // The other voices tell the hour and stand: speed 0, distance held, a sentence and a frame for every period of it.
    let (mut epochs, mut told) = (0, Vec::new());
    let mut now = SimTime::ZERO;
    let end = SimTime((HOUR_S + 1) * SECOND);
    while now < end {
        ecu.poll(now, &mut frames);
        for frame in frames.drain(..).filter(|frame| pgn(frame) == GROUND_SPEED.pgn) {
            told.push(GROUND_SPEED.decode(frame.data()));
        }
        while nmea.next() <= now {
            let _ = nmea.next_epoch();
            epochs += 1;
        }
        now = ecu.next().expect("it has its address");
    }
    assert_eq!(told.len() as u64, HOUR_S * 10 + 7, "every 100 ms from 300 ms to an hour and 0.9 s");
    assert_eq!(epochs, (HOUR_S + 1) * 10);
    let standing = told.get(20..).unwrap();
    assert!(
        standing.iter().all(|values| values.starts_with(&[Some(0.0), Some(1.0)])),
        "{:?}",
        standing.first()
    );
}

fn pgn(frame: &CanFrame) -> u32 {
    J1939Id::of(frame.id).map_or(0, |id| id.pgn)
}

/// The next whole line a client reads.
async fn line(client: &mut BufReader<TcpStream>) -> String {
    let mut line = String::new();
    let read = tokio::time::timeout(Duration::from_secs(10), client.read_line(&mut line)).await;
    assert!(read.expect("in time").expect("it is read") > 0);
    line
}

#[tokio::test]
async fn a_reader_of_nmea_that_goes_takes_nothing_with_it_and_may_come_back() {
    let server = NmeaLine::open(&"tcp:127.0.0.1:0".parse().unwrap(), 10.0).await.unwrap();
    let &NmeaPlace::Address(address) = server.place() else { panic!("a TCP server has an address") };
    let connect = || async { BufReader::new(TcpStream::connect(address).await.unwrap()) };
    // A client hears what is said once the server knows of it, which nobody tells us: so it is said until it does.
    let hears = |epoch: &'static str, mut client: BufReader<TcpStream>| {
        let server = &server;
        async move {
            loop {
                server.send(Bytes::from_static(epoch.as_bytes()), rowscan_ports::Delivery::Paced).await;
                let heard = tokio::time::timeout(Duration::from_millis(20), line(&mut client)).await;
                if heard.is_ok_and(|line| line == epoch) {
                    return client;
                }
            }
        }
    };
    let stays = hears("$one\r\n", connect().await).await;
    let goes = hears("$two\r\n", connect().await).await;
    drop(goes);
    let stays = hears("$three\r\n", stays).await;
    let back = hears("$four\r\n", connect().await).await;
    drop((hears("$five\r\n", stays).await, back));
    // Nobody there: what is said waits for nobody.
    server.send(Bytes::from_static(b"$six\r\n"), rowscan_ports::Delivery::Patient).await;
}
