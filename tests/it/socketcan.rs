//! CAN interfaces of the system. `ROWSCAN_CAN` names one that is up and has nobody else on it; `cargo xtask vcan` runs these in a machine
//! that has one.
#![cfg(target_os = "linux")]
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test fails by panicking and says what it skips"
)]

use std::process::Command;
use std::time::Duration;

use rowscan_bus::link::PortEvent;
use rowscan_bus::{Bus, BusAddress, BusLoss, CanFrame, CanId, Inbox};
use rowscan_protocol::time::SimTime;
use socketcan::{CanErrorFrame, CanSocket, Socket};
use tokio::sync::{Mutex, MutexGuard};

/// The interface, and the right to be alone on it.
async fn interface() -> Option<(String, MutexGuard<'static, ()>)> {
    static ALONE: Mutex<()> = Mutex::const_new(());
    let Ok(name) = std::env::var("ROWSCAN_CAN") else {
        eprintln!("SKIPPED: ROWSCAN_CAN names no CAN interface; `cargo xtask vcan` has one");
        return None;
    };
    Some((name, ALONE.lock().await))
}

async fn open(interface: &str) -> (Bus, Inbox) {
    let addresses = [BusAddress::Socketcan(interface.to_owned())];
    Bus::open(&addresses, &mut |_| {}).await.expect("it opens")
}

async fn next(inbox: &mut Inbox) -> PortEvent {
    let heard = tokio::time::timeout(Duration::from_secs(10), inbox.recv()).await;
    heard.expect("something is heard in time").expect("the bus is open").1
}

/// `ip link set INTERFACE up|down`
fn set(interface: &str, state: &str) {
    let status = Command::new("ip").args(["link", "set", interface, state]).status().expect("ip runs");
    assert!(status.success(), "ip link set {interface} {state}: {status}");
}

#[tokio::test]
async fn frames_of_every_kind_arrive_in_order_at_whoever_is_on_the_interface() {
    let Some((interface, _alone)) = interface().await else { return };
    let ((here, mut ours), (_there, mut theirs)) = (open(&interface).await, open(&interface).await);
    let ids = [(0, false), (0x7FF, false), (0, true), (0x1FFF_FFFF, true)];
    let mut sent = Vec::new();
    for id in ids.map(|(bits, extended)| CanId::new(bits, extended).unwrap()) {
        for len in 0..=8u8 {
            sent.extend(CanFrame::new(id, &[0xA5, 1, 2, 3, 4, 5, 6, 0xFF][..len.into()]));
            sent.extend(CanFrame::remote(id, len));
        }
    }
    assert_eq!(sent.len(), 72);
    for frame in &sent {
        here.send((SimTime::ZERO, *frame), None, rowscan_ports::Delivery::Patient).await;
    }
    here.written().await;
    for frame in sent {
        assert_eq!(next(&mut theirs).await, PortEvent::Frame(frame));
    }
    assert!(ours.try_recv().is_err(), "nobody hears himself");
}

#[tokio::test]
async fn bus_off_and_restart_are_heard_as_the_kernel_tells_them() {
    let Some((interface, _alone)) = interface().await else { return };
    let (_bus, mut inbox) = open(&interface).await;
    let kernel = CanSocket::open(&interface).expect("a socket");
    for (bits, expected) in [(0x40, PortEvent::Lost(BusLoss::BusOff)), (0x100, PortEvent::Opened)] {
        kernel.write_frame(&CanErrorFrame::new_error(bits, &[]).unwrap()).expect("it is sent");
        assert_eq!(next(&mut inbox).await, expected);
    }
}

#[tokio::test]
async fn an_interface_that_goes_down_is_told_refused_and_taken_again_when_it_is_up() {
    let Some((interface, _alone)) = interface().await else { return };
    let ((bus, mut inbox), frame) =
        (open(&interface).await, CanFrame::new(CanId::Standard(1), &[1]).unwrap());
    set(&interface, "down");
    // The next frame finds it down.
    bus.send((SimTime::ZERO, frame), None, rowscan_ports::Delivery::Patient).await;
    assert_eq!(next(&mut inbox).await, PortEvent::Lost(BusLoss::Down));
    // Frames sent meanwhile are lost and hold nobody up.
    bus.send((SimTime::ZERO, frame), None, rowscan_ports::Delivery::Patient).await;
    tokio::time::timeout(Duration::from_secs(10), bus.written()).await.expect("not held up");
    let refused = Bus::open(&[BusAddress::Socketcan(interface.clone())], &mut |_| {}).await;
    let message = refused.expect_err("it is down").to_string();
    assert!(message.contains("no CAN carrier") && message.contains("ip link"), "{message}");
    set(&interface, "up");
    assert_eq!(next(&mut inbox).await, PortEvent::Opened);
    let (_there, mut theirs) = open(&interface).await;
    bus.send((SimTime::ZERO, frame), None, rowscan_ports::Delivery::Patient).await;
    assert_eq!(next(&mut theirs).await, PortEvent::Frame(frame));
}
