//! A client of a socketcand server: the bus is elsewhere, at a gateway or in another program.

use std::fmt::Write as _;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use rowscan_ports::{clock, keep_alive};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::mpsc;

use super::{BusError, PortListener};
use crate::port_event::{BusLoss, OutgoingFrame, PortEvent};
use crate::{CanFrame, CanId};

/// Host time until the server must have opened its bus.
const PATIENCE: Duration = Duration::from_secs(10);
/// No element of a classic frame is longer.
const LONGEST: usize = 128;

/// How far the server has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Greeting,
    Opening,
    Raw,
    Streaming,
}

/// The conversation with a server.
#[derive(Clone, Debug)]
pub struct ClientConversation {
    bus: String,
    step: Step,
    element: Vec<u8>,
    inside: bool,
}

impl ClientConversation {
    /// Opens the server's bus of this name.
    pub fn new(bus: &str) -> Self {
        Self { bus: bus.to_owned(), step: Step::Greeting, element: Vec::new(), inside: false }
    }

    /// True once frames pass.
    pub fn is_streaming(&self) -> bool {
        self.step == Step::Streaming
    }

    /// Takes bytes from the server; appends what to say next, and the frames. What a server refuses with is the error.
    pub fn handle_bytes(
        &mut self,
        bytes: &[u8],
        requests: &mut String,
        heard: &mut Vec<PortEvent>,
    ) -> Result<(), String> {
        for &byte in bytes {
            match byte {
                b'<' => {
                    self.inside = true;
                    self.element.clear();
                }
                b'>' if self.inside => {
                    self.inside = false;
                    let element = std::mem::take(&mut self.element);
                    self.element_in(&String::from_utf8_lossy(&element), requests, heard)?;
                }
                _ if self.inside && self.element.len() < LONGEST => self.element.push(byte),
                // Longer ones are none of a classic frame.
                _ => self.inside = false,
            }
        }
        Ok(())
    }

    fn element_in(
        &mut self,
        text: &str,
        requests: &mut String,
        heard: &mut Vec<PortEvent>,
    ) -> Result<(), String> {
        let mut words = text.split_whitespace();
        match (self.step, words.next()) {
            (Step::Greeting, Some("hi")) => {
                let _ = write!(requests, "< open {} >", self.bus);
                self.step = Step::Opening;
            }
            (Step::Opening, Some("ok")) => {
                requests.push_str("< rawmode >");
                self.step = Step::Raw;
            }
            (Step::Raw, Some("ok")) => self.step = Step::Streaming,
            (Step::Streaming, Some("frame")) => heard.extend(received(words).map(PortEvent::Frame)),
            // A frame it could not send is lost, as on a bus.
            (Step::Streaming, _) => {}
            (_, Some("error")) => return Err(format!("the server says `{}`", text.trim())),
            _ => {}
        }
        Ok(())
    }

    /// Appends a frame for the bus; nothing before frames pass. Remote frames have no form in this protocol.
    pub fn frame(&self, frame: &CanFrame, out: &mut String) {
        if !self.is_streaming() || frame.remote {
            return;
        }
        let _ = match frame.id {
            CanId::Standard(id) => write!(out, "< send {id:03X} {} ", frame.len()),
            CanId::Extended(id) => write!(out, "< send {id:08X} {} ", frame.len()),
        };
        for byte in frame.data() {
            let _ = write!(out, "{byte:02X} ");
        }
        out.push('>');
    }
}

/// `18FE4980 1.500001 01FF`: identifier (eight digits: 29 bits), time, bytes, together or apart.
fn received<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<CanFrame> {
    let id = words.next().filter(|id| (1..=8).contains(&id.len()))?;
    let id = CanId::new(u32::from_str_radix(id, 16).ok()?, id.len() > 3)?;
    words.next()?;
    let digits: Vec<u8> = words.flat_map(str::bytes).collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    let data: Vec<u8> = digits.chunks(2).map(byte).collect::<Option<_>>()?;
    CanFrame::new(id, &data).filter(|_| digits.len().is_multiple_of(2))
}

/// A connection to a server, whose bus is open.
#[derive(Debug)]
pub struct SocketcandClientLink {
    place: String,
    bus: String,
    address: SocketAddr,
    connection: Connection,
}

#[derive(Debug)]
struct Connection {
    stream: TcpStream,
    conversation: ClientConversation,
    /// Heard before anyone listened.
    heard: Vec<PortEvent>,
}

impl Connection {
    async fn open(place: &str, bus: &str) -> io::Result<Self> {
        let opening = async {
            let mut stream = TcpStream::connect(place).await?;
            let _ = keep_alive(&stream);
            let mut conversation = ClientConversation::new(bus);
            let (mut bytes, mut requests, mut heard) = ([0; 512], String::new(), Vec::new());
            while !conversation.is_streaming() {
                let count = stream.read(&mut bytes).await?;
                if count == 0 {
                    return Err(io::Error::other("it closed the connection: is it a socketcand server?"));
                }
                let bytes = bytes.get(..count).unwrap_or_default();
                conversation.handle_bytes(bytes, &mut requests, &mut heard).map_err(io::Error::other)?;
                stream.write_all(requests.as_bytes()).await?;
                requests.clear();
            }
            Ok(Self { stream, conversation, heard })
        };
        let late = || io::Error::other(format!("it did not open `{bus}` within {PATIENCE:?}"));
        clock::within(PATIENCE, opening).await.unwrap_or_else(|| Err(late()))
    }
}

impl SocketcandClientLink {
    pub(super) async fn open(place: &str, bus: &str) -> Result<Self, BusError> {
        let failed = |cause| BusError::Network {
            what: "the CAN bus of a socketcand server",
            address: format!("{place}/{bus}"),
            cause,
        };
        let connection = Connection::open(place, bus).await.map_err(failed)?;
        let address = connection.stream.peer_addr().map_err(failed)?;
        Ok(Self { place: place.to_owned(), bus: bus.to_owned(), address, connection })
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) async fn run(self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let Self { place, bus, mut connection, .. } = self;
        loop {
            if !carry(connection, &mut queue, &ear).await {
                return;
            }
            ear.hear(PortEvent::Lost(BusLoss::ServerGone)).await;
            let opening = async {
                loop {
                    match Connection::open(&place, &bus).await {
                        Ok(connection) => return connection,
                        Err(_) => clock::retry_pause().await,
                    }
                }
            };
            tokio::pin!(opening);
            connection = loop {
                tokio::select! {
                    connection = &mut opening => break connection,
                    // Frames sent meanwhile are lost.
                    frame = queue.recv() => if frame.is_none() { return },
                }
            };
            ear.hear(PortEvent::Opened).await;
        }
    }
}

/// Carries frames until the server is gone; false once the bus has closed.
async fn carry(
    connection: Connection,
    queue: &mut mpsc::Receiver<OutgoingFrame>,
    ear: &PortListener,
) -> bool {
    let Connection { mut stream, mut conversation, mut heard } = connection;
    let (mut reader, mut writer) = stream.split();
    let (mut bytes, mut out) = ([0; 512], String::new());
    loop {
        for heard in heard.drain(..) {
            ear.hear(heard).await;
        }
        tokio::select! {
            read = reader.read(&mut bytes) => match read {
                Ok(0) | Err(_) => return true,
                Ok(count) => {
                    let bytes = bytes.get(..count).unwrap_or_default();
                    if conversation.handle_bytes(bytes, &mut out, &mut heard).is_err() {
                        return true;
                    }
                }
            },
            frame = queue.recv() => {
                let Some(OutgoingFrame { what, pending, .. }) = frame else { return false };
                let Some(frame) = what.frame() else { continue };
                conversation.frame(frame, &mut out);
                if writer.write_all(out.as_bytes()).await.is_err() {
                    return true;
                }
                out.clear();
                drop(pending);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::socketcand::Conversation;
    use crate::{Bus, BusAddress};
    use rowscan_ports::Delivery;
    use rowscan_protocol::time::SimTime;

    #[test]
    fn a_client_reaches_raw_mode_with_our_own_server_and_frames_go_both_ways() {
        let (mut client, mut server) = (ClientConversation::new("can0"), Conversation::default());
        let (mut said, mut requests) = (Conversation::GREETING.to_owned(), String::new());
        let (mut at_server, mut at_client) = (Vec::new(), Vec::new());
        while !client.is_streaming() {
            client.handle_bytes(said.as_bytes(), &mut requests, &mut at_client).unwrap();
            said.clear();
            server.handle_bytes(requests.as_bytes(), &mut said, &mut at_server);
            requests.clear();
        }
        assert_eq!(at_server, [PortEvent::Opened]);
        for (bits, extended, data) in
            [(0x7FF, false, &[][..]), (0x18FE_4980, true, &[1, 0xFF, 3, 4, 5, 6, 7, 8])]
        {
            let frame = CanFrame::new(CanId::new(bits, extended).unwrap(), data).unwrap();
            (said, requests, at_server, at_client) = Default::default();
            server.frame(SimTime(5), &frame, &mut said);
            client.handle_bytes(said.as_bytes(), &mut requests, &mut at_client).unwrap();
            client.frame(&frame, &mut requests);
            server.handle_bytes(requests.as_bytes(), &mut said, &mut at_server);
            assert_eq!(
                (at_client.as_slice(), at_server.as_slice()),
                (&[PortEvent::Frame(frame)][..], &[PortEvent::Frame(frame)][..])
            );
        }
        // The original server writes the bytes apart.
        at_client.clear();
        client.handle_bytes(b"< frame 123 23.424242 11 22 >", &mut requests, &mut at_client).unwrap();
        assert_eq!(
            at_client,
            [PortEvent::Frame(CanFrame::new(CanId::Standard(0x123), &[0x11, 0x22]).unwrap())]
        );
    }

    #[test]
    fn a_refusal_and_nonsense_are_no_frames() {
        let (mut requests, mut heard) = (String::new(), Vec::new());
        let mut client = ClientConversation::new("can7");
        let refused = client.handle_bytes(b"< hi >< error could not open bus >", &mut requests, &mut heard);
        assert!(refused.unwrap_err().contains("could not open bus"));
        let mut client = ClientConversation::new("can0");
        client.handle_bytes(b"< hi >< ok >< ok >", &mut requests, &mut heard).unwrap();
        assert!(client.is_streaming());
        for nonsense in [
            "< frame >",
            "< frame 123 >",
            "< frame XYZ 1.0 00 >",
            "< frame 123 1.0 0 >",
            "< frame 123 1.0 001122334455667788 >",
            "< error >",
        ] {
            client.handle_bytes(nonsense.as_bytes(), &mut requests, &mut heard).unwrap();
        }
        client
            .handle_bytes(&[b"<".as_slice(), &[b'f'; 1000], b">"].concat(), &mut requests, &mut heard)
            .unwrap();
        assert_eq!(heard, []);
    }

    /// The next frame, past what is opened and lost.
    async fn next_frame(inbox: &mut crate::Inbox) -> CanFrame {
        loop {
            if let (_, PortEvent::Frame(frame)) = inbox.recv().await.expect("the bus is open") {
                return frame;
            }
        }
    }

    #[tokio::test]
    async fn two_buses_are_joined_over_tcp() {
        let mut address = None;
        let server = [BusAddress::Socketcand("127.0.0.1:0".to_owned())];
        let (there, mut theirs) = Bus::open(&server, &mut |link| address = Some(link.found())).await.unwrap();
        let Some(crate::link::Found::Address(address)) = address else { panic!("an address") };
        let client = format!("socketcand-client:{address}/can0").parse::<BusAddress>().unwrap();
        let (here, mut ours) = Bus::open(&[client], &mut |_| {}).await.unwrap();
        assert_eq!(theirs.recv().await.map(|(_, heard)| heard), Some(PortEvent::Opened));
        let frame = CanFrame::new(CanId::new(0x18FE_4980, true).unwrap(), &[1, 2, 3]).unwrap();
        here.send((SimTime::ZERO, frame), None, Delivery::Patient).await;
        assert_eq!(next_frame(&mut theirs).await, frame);
        there.send((SimTime::ZERO, frame), None, Delivery::Patient).await;
        assert_eq!(next_frame(&mut ours).await, frame);
        // A server that goes is told.
        drop((there, theirs));
        assert_eq!(ours.recv().await.map(|(_, heard)| heard), Some(PortEvent::Lost(BusLoss::ServerGone)));
    }

    #[tokio::test]
    async fn what_is_no_server_is_an_error_with_its_place() {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let place = listener.local_addr().unwrap().to_string();
        let accepting = tokio::spawn(async move { drop(listener.accept().await) });
        let failed = SocketcandClientLink::open(&place, "can0").await.unwrap_err().to_string();
        assert!(
            failed.contains(&format!("{place}/can0")) && failed.contains("socketcand server"),
            "{failed}"
        );
        accepting.await.unwrap();
    }
}
