//! Answers to SICK's device search, from the scanner's lock and nobody else's.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;

use rowscan_ports::clock::retry_pause;
use rowscan_protocol::search::{Interface, Search};
use tokio::net::UdpSocket;

use crate::shared::Shared;

/// Longer than any request.
const MAX_DATAGRAM: usize = 64;

/// Answers whoever asks at `socket`, as a scanner found at `address`. A scanner that is off or still starts up says nothing.
pub(crate) async fn answer(shared: Arc<Shared>, socket: UdpSocket, address: SocketAddr) {
    let address = match address.ip() {
        IpAddr::V4(address) => address.octets(),
        // The answer has room for four bytes.
        IpAddr::V6(_) => [127, 0, 0, 1],
    };
    let mut bytes = [0; MAX_DATAGRAM];
    loop {
        let Ok((length, peer)) = socket.recv_from(&mut bytes).await else {
            retry_pause().await;
            continue;
        };
        let Some(search) = bytes.get(..length).and_then(Search::parse) else { continue };
        let answer = {
            let device = shared.device();
            let is_heard = !device.is_silent(shared.clock.now());
            let serial_number = device.serial_number();
            is_heard.then(|| {
                search.answer(&Interface {
                    address,
                    mask: [255, 255, 255, 0],
                    gateway: [0; 4],
                    serial_number,
                })
            })
        };
        if let Some(answer) = answer {
            // Who asks may have gone.
            let _ = socket.send_to(&answer, peer).await;
        }
    }
}
