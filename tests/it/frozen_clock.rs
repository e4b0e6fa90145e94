//! The emulator with the host's clock frozen: pacing, slow clients and many clients are facts of simulated time.

use crate::common;

use std::time::Duration;

use common::{bench, raw_client, small_scene};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, EndWhen, Rig};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::model;
use tokio::time::Instant;

/// tokio's timer wheel ticks in milliseconds and rounds up.
const TICK: Duration = Duration::from_millis(1);

fn paced(scale: f64) -> EmulatorConfig {
    EmulatorConfig { time_scale: TimeScale::Paced(scale), ..EmulatorConfig::default() }
}

#[tokio::test(start_paused = true)]
async fn scans_leave_at_absolute_deadlines() {
    for (model, scale, period) in [
        ("lms111", 1.0, Duration::from_millis(20)),
        ("lms511", 1.0, Duration::from_millis(40)),
        ("lms111", 0.1, Duration::from_millis(200)),
    ] {
        let (device, world) = bench(model);
        let mut emulator = Emulator::start(device, world, paced(scale));
        let mut client = raw_client(&mut emulator, Dialect::B);
        let first = client.next_scan().await;
        let start = Instant::now();
        for n in 1..200_u32 {
            let scan = client.next_scan().await;
            assert_eq!(scan.telegram_counter, first.telegram_counter.wrapping_add(n as u16));
            let late = start.elapsed().abs_diff(period * n);
            assert!(late <= TICK, "{model} x{scale}: scan {n} is off by {late:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn a_slow_host_leaves_turns_out_and_counts_them() {
    let (device, world) = bench("lms111");
    let mut emulator = Emulator::start(device, world, paced(1.0));
    let mut client = raw_client(&mut emulator, Dialect::B);
    let mut last = client.next_scan().await;
    for (busy_ms, expected) in [(150, 0..=0), (1000, 45..=50)] {
        let missed = emulator.counts().scans_missed;
        // Something else has the host for so long.
        tokio::time::advance(Duration::from_millis(busy_ms)).await;
        let mut missing = 0;
        for _ in 0..60 {
            let scan = client.next_scan().await;
            assert_eq!(scan.telegram_counter, last.telegram_counter.wrapping_add(1));
            let turns = scan.scan_counter.wrapping_sub(last.scan_counter);
            let due_us = last.scan_time_us + 20_000 * u32::from(turns);
            assert_eq!(scan.scan_time_us, due_us, "scans keep to their instants");
            missing += u64::from(turns) - 1;
            last = scan;
        }
        assert_eq!(missing, emulator.counts().scans_missed - missed);
        assert!(expected.contains(&missing), "{busy_ms} ms: {missing} missing");
    }
}

#[tokio::test(start_paused = true)]
async fn a_slow_client_loses_counted_scans_and_delays_nobody() {
    let (device, world) = bench("lms111");
    let mut emulator = Emulator::start(device, world, paced(1.0));
    let mut quick = raw_client(&mut emulator, Dialect::B);
    let mut slow = raw_client(&mut emulator, Dialect::A);
    slow.next_scan().await;
    let first = quick.next_scan().await;
    let start = Instant::now();
    // Ten seconds in which the slow client reads nothing.
    for n in 1..=500_u16 {
        let scan = quick.next_scan().await;
        assert_eq!(scan.telegram_counter, first.telegram_counter.wrapping_add(n));
    }
    assert!(start.elapsed().abs_diff(Duration::from_secs(10)) <= TICK);
    let dropped = emulator.counts().scans_dropped;
    assert!(dropped > 300, "the slow client's queue is bounded, yet only {dropped} scans were dropped");

    // Back at work it sees gaps in the counter, as long as the emulator says, until it has caught up.
    drop(quick);
    let mut last = slow.next_scan().await.telegram_counter;
    let (mut missing, mut in_step) = (0, 0);
    while in_step < 200 {
        let counter = slow.next_scan().await.telegram_counter;
        let gap = counter.wrapping_sub(last) - 1;
        in_step = if gap == 0 { in_step + 1 } else { 0 };
        missing += u64::from(gap);
        last = counter;
    }
    assert_eq!(missing, emulator.counts().scans_dropped);
}

#[tokio::test(start_paused = true)]
async fn thirty_two_clients_in_both_dialects_see_the_same_scans() {
    let (device, world) = bench("lms111");
    let mut emulator = Emulator::start(device, world, paced(1.0));
    let mut clients: Vec<_> = (0..32)
        .map(|n| raw_client(&mut emulator, if n % 2 == 0 { Dialect::A } else { Dialect::B }))
        .collect();
    let mut first = Vec::new();
    for client in &mut clients {
        first.push(client.next_scan().await);
    }
    let meet = first.iter().map(|scan| scan.telegram_counter).max().expect("clients") + 1;
    let mut seen = Vec::new();
    for client in &mut clients {
        loop {
            let scan = client.next_scan().await;
            if scan.telegram_counter == meet {
                seen.push(scan);
                break;
            }
        }
    }
    for scan in &seen {
        assert_eq!(scan, &seen[0]);
    }
    assert_eq!(emulator.counts().scans_dropped, 0);
}

#[tokio::test(start_paused = true)]
async fn at_max_time_stands_still_until_someone_listens_and_nothing_is_lost() {
    let (device, world) = bench("lms111");
    let config = EmulatorConfig { time_scale: TimeScale::Max, ..EmulatorConfig::default() };
    let mut emulator = Emulator::start(device, world, config);
    tokio::time::sleep(Duration::from_secs(60)).await;
    let mut client = raw_client(&mut emulator, Dialect::B);
    let first = client.next_scan().await;
    assert!(first.scan_time_us < 1_000_000, "time ran on without a client: {} µs", first.scan_time_us);
    for n in 1..2_000_u16 {
        let scan = client.next_scan().await;
        assert_eq!(scan.telegram_counter, first.telegram_counter.wrapping_add(n));
        assert_eq!(scan.scan_time_us, first.scan_time_us + u32::from(n) * 20_000);
    }
    assert_eq!(emulator.counts().scans_dropped, 0);
}

#[tokio::test(start_paused = true)]
async fn scans_come_only_while_measuring_and_subscribed() {
    let (device, world) = bench("lms111");
    let mut emulator = Emulator::start(device, world, paced(1.0));
    let mut client = raw_client(&mut emulator, Dialect::B);
    client.next_scan().await;
    client.connection.stop();
    loop {
        match client.next_event().await {
            HostEvent::Stopped => break,
            HostEvent::Scan => {}
            other => panic!("{other:?}"),
        }
    }
    let sent = emulator.counts().scans_sent;
    tokio::time::sleep(Duration::from_secs(5)).await;
    assert_eq!(emulator.counts().scans_sent, sent, "a stopped scanner sent scans");
}

#[tokio::test(start_paused = true)]
async fn at_max_a_client_that_is_gone_leaves_time_standing_still() {
    let (device, world) = bench("lms111");
    let config = EmulatorConfig { time_scale: TimeScale::Max, ..EmulatorConfig::default() };
    let mut emulator = Emulator::start(device, world, config);
    let mut gone = raw_client(&mut emulator, Dialect::B);
    for _ in 0..10 {
        gone.next_scan().await;
    }
    drop(gone);
    tokio::time::sleep(Duration::from_secs(1)).await;
    let sent = emulator.counts().scans_sent;
    tokio::time::sleep(Duration::from_secs(60)).await;
    assert_eq!(emulator.counts().scans_sent, sent);
    let mut next = raw_client(&mut emulator, Dialect::B);
    let first = next.next_scan().await;
    assert!(first.scan_time_us < 10_000_000, "time ran on without a client: {} µs", first.scan_time_us);
}

#[tokio::test(start_paused = true)]
async fn scans_that_leave_while_the_tractor_stands_do_not_bring_the_end_of_its_drive() {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let model = model::by_name("lms111").expect("known");
    let (device, view) = stage.scanner_on(&tractor, 0, model).expect("it fits");
    let mut rig = Rig::new(tractor.clone(), TimeScale::Paced(1.0)).until(EndWhen::Scans(5));
    let hold = rig.hold();
    let mut emulator = rig.scanner(device, view, paced(1.0));
    let mut client = raw_client(&mut emulator, Dialect::B);
    let mut running = rig.run();
    for _ in 0..20 {
        client.next_scan().await;
    }
    assert_eq!(tractor.began(), None, "it is held");
    let before = emulator.counts().scans_sent;
    hold.release();
    running.ended().await.expect("the clock holds");
    assert!(tractor.began().is_some());
    assert_eq!(emulator.counts().scans_sent - before, 5);
}
