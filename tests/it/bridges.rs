//! Buses by UDP for programs without a CAN interface: the bridge of AgOpenGPS's task controller, there and here.

use std::net::UdpSocket;
use std::time::Duration;

use rowscan_bus::link::bridge::{LENGTH, decode, encode};
use rowscan_bus::{CanFrame, CanId, J1939Id};

use crate::common::binary::{Emulator, listening};

/// The PGN of a request, and of what is asked for: a claimed address.
const REQUEST: u32 = 59_904;
const ADDRESS_CLAIMED: u32 = 60_928;

fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.set_read_timeout(Some(Duration::from_secs(20))).expect("set");
    socket
}

/// `Request` for claimed addresses, from 0x26 to everyone.
fn request() -> [u8; LENGTH] {
    let id = CanId::new(0x18EA_FF26, true).expect("29 bits");
    assert_eq!(J1939Id::of(id).map(|id| id.pgn), Some(REQUEST));
    encode(&CanFrame::new(id, &[0x00, 0xEE, 0x00]).expect("a frame")).expect("no remote frame")
}

/// Waits for the tractor's claim; who sent it.
fn claim(socket: &UdpSocket) -> std::net::SocketAddr {
    let mut bytes = [0; 64];
    loop {
        let (count, from) = socket.recv_from(&mut bytes).expect("the tractor claims its address");
        let frame = decode(&bytes[..count]).expect("a frame of 13 bytes");
        if J1939Id::of(frame.id).is_some_and(|id| id.pgn == ADDRESS_CLAIMED) {
            return from;
        }
    }
}

#[test]
fn a_bridge_that_listens_elsewhere_hears_the_rig_and_is_heard() {
    let bridge = socket();
    let can = format!("udp-aog:{}", bridge.local_addr().expect("bound"));
    let emulator = Emulator::on_a_line("emulate", &["--tcp", "127.0.0.1:0", "--can", &can]);
    let rig = claim(&bridge);
    // What is no frame is told, and changes nothing.
    bridge.send_to(&[7; 12], rig).expect("sent");
    bridge.send_to(&request(), rig).expect("sent");
    claim(&bridge);
    emulator.end();
}

#[test]
fn a_bridge_that_listens_here_answers_who_spoke_last() {
    let args = ["--tcp", "127.0.0.1:0", "--can", "udp-aog-listen:127.0.0.1:0"];
    let (child, endpoints) = listening("emulate", &args, 2);
    let _emulator = Emulator { child, address: String::new() };
    let place = endpoints.iter().find(|endpoint| endpoint["endpoint"] == "udp-aog-listen").expect("told");
    let place = place["address"].as_str().expect("an address");
    let (first, second) = (socket(), socket());
    for peer in [&first, &second] {
        peer.send_to(&request(), place).expect("sent");
        claim(peer);
    }
}
