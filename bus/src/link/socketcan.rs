//! A CAN interface of the system (Linux): `can0`, `vcan0`, a `slcan` interface.

use tokio::sync::mpsc;

use super::{BusError, PortListener};
use crate::port_event::OutgoingFrame;

#[cfg(target_os = "linux")]
mod linux {
    use std::io;

    use socketcan::tokio::CanSocket;
    use socketcan::{
        CanDataFrame, CanErrorFrame, CanFrame as SocketFrame, CanRemoteFrame, EmbeddedFrame, ExtendedId,
        Frame, Id, SocketOptions, StandardId,
    };

    use super::{BusError, OutgoingFrame, PortListener, mpsc};
    use crate::error_frame::ErrorFrame;
    use crate::port_event::BusLoss;
    use crate::port_event::Outgoing;
    use crate::port_event::PortEvent;
    use crate::{CanFrame, CanId};

    /// Error frames asked for, as linux/can/error.h numbers them: bus-off, and back from it.
    const CAN_ERR_BUSOFF: u32 = 0x40;
    const CAN_ERR_RESTARTED: u32 = 0x100;

    /// A raw socket on an interface.
    #[derive(Debug)]
    pub struct SocketcanLink {
        socket: CanSocket,
        interface: String,
    }

    impl SocketcanLink {
        pub(in crate::link) fn open(interface: &str) -> Result<Self, BusError> {
            let refused = |cause: io::Error| BusError::Carrier {
                interface: interface.to_owned(),
                cause: cause.to_string(),
            };
            let socket = connect(interface).map_err(refused)?;
            Ok(Self { socket, interface: interface.to_owned() })
        }

        pub(in crate::link) fn interface(&self) -> &str {
            &self.interface
        }

        pub(in crate::link) async fn run(
            mut self,
            mut queue: mpsc::Receiver<OutgoingFrame>,
            ear: PortListener,
        ) {
            loop {
                let carried = tokio::select! {
                    received = self.socket.read_frame() => match received {
                        Ok(frame) => {
                            if let Some(heard) = heard(&frame) {
                                ear.hear(heard).await;
                            }
                            Ok(())
                        }
                        Err(cause) => Err(cause),
                    },
                    frame = queue.recv() => {
                        let Some(OutgoingFrame { what, pending: _pending, .. }) = frame else { return };
                        let frame = match &what {
                            Outgoing::Frame(frame) => to_socket(frame),
                            Outgoing::Error(error) => error_to_socket(error),
                        };
                        match frame {
                            Some(frame) => self.socket.write_frame(frame).await,
                            None => Ok(()),
                        }
                    }
                };
                if let Err(cause) = carried {
                    tracing::debug!(%cause, interface = self.interface, "no frame carried");
                    // A full queue passes by itself; anything else is asked of the interface.
                    if !has_carrier(&self.interface) && !self.return_of(&mut queue, &ear).await {
                        return;
                    }
                    rowscan_ports::clock::retry_pause().await;
                }
            }
        }

        /// Waits until the interface is up again, perhaps another one of that name; frames sent meanwhile are lost. `false` if the bus closes.
        async fn return_of(&mut self, queue: &mut mpsc::Receiver<OutgoingFrame>, ear: &PortListener) -> bool {
            ear.hear(PortEvent::Lost(BusLoss::Down)).await;
            loop {
                let mut rest = std::pin::pin!(rowscan_ports::clock::retry_pause());
                while let Some(frame) = tokio::select! {
                    () = &mut rest => None,
                    frame = queue.recv() => Some(frame),
                } {
                    if frame.is_none() {
                        return false;
                    }
                }
                if let Ok(socket) = connect(&self.interface) {
                    self.socket = socket;
                    ear.hear(PortEvent::Opened).await;
                    return true;
                }
            }
        }
    }

    fn connect(interface: &str) -> io::Result<CanSocket> {
        let socket = CanSocket::open(interface)?;
        if !has_carrier(interface) {
            return Err(io::Error::new(io::ErrorKind::NetworkDown, "the interface is down or bus-off"));
        }
        socket.set_error_filter(CAN_ERR_BUSOFF | CAN_ERR_RESTARTED)?;
        Ok(socket)
    }

    /// Whether the interface is up and on its bus: a socket can be had on one that is not. Reading the file fails while it is down.
    fn has_carrier(interface: &str) -> bool {
        // An interface's name holds no slash; who writes one asks for another file.
        let file = format!("/sys/class/net/{interface}/carrier");
        !interface.contains('/') && std::fs::read_to_string(file).is_ok_and(|carrier| carrier.trim() == "1")
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

    /// On a virtual interface others then read it, as if their controller had told it.
    fn error_to_socket(error: &ErrorFrame) -> Option<SocketFrame> {
        CanErrorFrame::new_error(error.class, &error.data).ok().map(SocketFrame::Error)
    }

    fn heard(frame: &SocketFrame) -> Option<PortEvent> {
        let id = || CanId::new(frame.raw_id() & 0x1FFF_FFFF, frame.is_extended());
        Some(match frame {
            SocketFrame::Data(data) => PortEvent::Frame(CanFrame::new(id()?, data.data())?),
            SocketFrame::Remote(remote) => {
                PortEvent::Frame(CanFrame::remote(id()?, u8::try_from(remote.dlc()).ok()?)?)
            }
            SocketFrame::Error(error) if error.error_bits() & CAN_ERR_BUSOFF != 0 => {
                PortEvent::Lost(BusLoss::BusOff)
            }
            SocketFrame::Error(error) if error.error_bits() & CAN_ERR_RESTARTED != 0 => PortEvent::Opened,
            SocketFrame::Error(_) => return None,
        })
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

    pub(super) async fn run(self, _: mpsc::Receiver<OutgoingFrame>, _: PortListener) {
        match self {}
    }
}
