//! Sends Compact telegrams as UDP datagrams.

use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::sync::Arc;

use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap};
use tokio::net::UdpSocket;

use crate::firing::Firing;
use crate::shared::Shared;

/// Destinations that sockets are kept for.
const MAX_SOCKETS: usize = 8;

/// Sends them when their instants come.
#[derive(Debug)]
pub(crate) struct DatagramSource {
    shared: Arc<Shared>,
    sockets: BTreeMap<SocketAddrV4, UdpSocket>,
    tap: Tap,
}

impl DatagramSource {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        let name = shared.config.stream.clone().unwrap_or_else(|| shared.device().model().name.to_owned());
        let tap = shared.config.taps.open(&format!("{name}-udp"), StreamKind::Compact);
        Self { shared, sockets: BTreeMap::new(), tap }
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        self.shared.datagrams.next()
    }

    /// Sends what is due. Nothing waits for its reader: UDP has no back-pressure.
    pub(crate) async fn fire(&mut self, firing: Firing) {
        let shared = Arc::clone(&self.shared);
        while let Some(datagram) = shared.datagrams.take(firing.at) {
            let Some((to, bytes)) = shared.device().send(datagram) else { continue };
            if !shared.datagrams.may_go_to(*to.ip()) {
                shared.datagrams.count_withheld();
                continue;
            }
            self.tap.record(Side::Device, &bytes);
            match self.send(to, &bytes).await {
                Ok(()) => shared.datagrams.count_sent(),
                Err(cause) => {
                    tracing::debug!(%cause, "a datagram to {to} is lost");
                    shared.datagrams.count_failed();
                }
            }
        }
    }

    /// A socket a destination, so that the system can tell the lockstep clock who has read what.
    async fn send(&mut self, to: SocketAddrV4, bytes: &[u8]) -> std::io::Result<()> {
        if !self.sockets.contains_key(&to) {
            if self.sockets.len() >= MAX_SOCKETS {
                self.sockets.clear();
            }
            let own = if to.ip().is_loopback() { Ipv4Addr::LOCALHOST } else { Ipv4Addr::UNSPECIFIED };
            let socket = UdpSocket::bind(SocketAddrV4::new(own, 0)).await?;
            socket.connect(to).await?;
            self.sockets.insert(to, socket);
        }
        let Some(socket) = self.sockets.get(&to) else { return Ok(()) };
        match socket.send(bytes).await {
            // What the one before met: nobody listened. This one goes out.
            Err(cause) if cause.kind() == std::io::ErrorKind::ConnectionRefused => {
                socket.send(bytes).await.or_else(|cause| match cause.kind() {
                    std::io::ErrorKind::ConnectionRefused => Ok(0),
                    _ => Err(cause),
                })?;
            }
            sent => {
                sent?;
            }
        }
        Ok(())
    }
}
