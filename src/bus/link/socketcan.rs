//! A CAN interface of the system (Linux): `can0`, `vcan0`, a `slcan` interface.

use tokio::sync::mpsc;

use super::{BusError, Ear};
use crate::bus::join::Stamped;

#[cfg(target_os = "linux")]
mod linux {
    use std::io;

    use socketcan::tokio::CanSocket;
    use socketcan::{
        CanDataFrame, CanFrame as SocketFrame, CanRemoteFrame, EmbeddedFrame, ExtendedId, Frame, Id,
        StandardId,
    };

    use super::{BusError, Ear, Stamped, mpsc};
    use crate::bus::join::Heard;
    use crate::bus::{CanFrame, CanId};

    /// A raw socket on an interface.
    #[derive(Debug)]
    pub struct SocketcanLink {
        socket: CanSocket,
        interface: String,
    }

    impl SocketcanLink {
        pub(in crate::bus::link) fn open(interface: &str) -> Result<Self, BusError> {
            let carrier = |cause: io::Error| BusError::Carrier {
                interface: interface.to_owned(),
                cause: cause.to_string(),
            };
            let socket = CanSocket::open(interface).map_err(carrier)?;
            Ok(Self { socket, interface: interface.to_owned() })
        }

        pub(in crate::bus::link) fn interface(&self) -> &str {
            &self.interface
        }

        pub(in crate::bus::link) async fn run(self, mut queue: mpsc::Receiver<Stamped>, ear: Ear) {
            loop {
                tokio::select! {
                    received = self.socket.read_frame() => match received {
                        Ok(frame) => {
                            if let Some(frame) = from_socket(&frame) {
                                ear.hear(Heard::Frame(frame)).await;
                            }
                        }
                        // The interface went down or off the bus; it may come back.
                        Err(cause) => {
                            tracing::debug!(%cause, interface = self.interface, "nothing received");
                            crate::clock::breathe().await;
                        }
                    },
                    frame = queue.recv() => {
                        let Some((_, frame)) = frame else { return };
                        let Some(frame) = to_socket(&frame) else { continue };
                        if let Err(cause) = self.socket.write_frame(frame).await {
                            tracing::debug!(%cause, interface = self.interface, "a frame was not sent");
                            crate::clock::breathe().await;
                        }
                        ear.wrote(1);
                    }
                }
            }
        }
    }

    fn to_socket(frame: &CanFrame) -> Option<SocketFrame> {
        let id = match frame.id {
            CanId::Standard(id) => Id::Standard(StandardId::new(id)?),
            CanId::Extended(id) => Id::Extended(ExtendedId::new(id)?),
        };
        if frame.remote {
            CanRemoteFrame::new_remote(id, usize::from(frame.len())).map(SocketFrame::Remote)
        } else {
            CanDataFrame::new(id, frame.data()).map(SocketFrame::Data)
        }
    }

    fn from_socket(frame: &SocketFrame) -> Option<CanFrame> {
        let id = CanId::new(frame.raw_id() & 0x1FFF_FFFF, frame.is_extended())?;
        match frame {
            SocketFrame::Data(data) => CanFrame::new(id, data.data()),
            SocketFrame::Remote(remote) => CanFrame::remote(id, u8::try_from(remote.dlc()).ok()?),
            SocketFrame::Error(_) => None,
        }
    }
}

#[cfg(target_os = "linux")]
pub use linux::SocketcanLink;

/// There are no CAN interfaces on this system.
#[cfg(not(target_os = "linux"))]
#[derive(Debug)]
pub enum SocketcanLink {}

#[cfg(not(target_os = "linux"))]
impl SocketcanLink {
    pub(super) fn open(interface: &str) -> Result<Self, BusError> {
        let cause = "this system has no CAN interfaces".to_owned();
        Err(BusError::Carrier { interface: interface.to_owned(), cause })
    }

    pub(super) fn interface(&self) -> &str {
        match *self {}
    }

    pub(super) async fn run(self, _: mpsc::Receiver<Stamped>, _: Ear) {
        match self {}
    }
}
