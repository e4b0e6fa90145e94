//! The controller of the lockstep bench, a program of its own: it waits for its streams in poll(), decides on each scan, and acknowledges where it
//! is asked to.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;

use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use rustix::event::{PollFd, PollFlags, poll};

/// What the bench calls itself with to be this program.
pub const NAME: &str = "lockstep-reader";

const MAX_PAYLOAD: usize = 64 * 1024;
/// Nearer echoes count as leaves, mm.
const NEAR_MM: u16 = 3000;

/// What a stream carries.
enum Kind {
    Scanner(Box<FrameDecoder>),
    /// Nobody decides on it.
    Lines,
    /// Steps, to be acknowledged.
    Steps(Vec<u8>),
}

struct Stream {
    socket: TcpStream,
    kind: Kind,
}

/// Reads `streams` (`NAME=ADDRESS`) until one ends.
pub fn run(streams: &[String]) {
    let (mut all, mut output) = (Vec::new(), None);
    for stream in streams {
        let (name, address) = stream.split_once('=').expect("NAME=ADDRESS");
        let mut socket = TcpStream::connect(address).expect("it listens");
        socket.set_nodelay(true).expect("a socket");
        let kind = match name {
            "output" => {
                output = Some(socket);
                continue;
            }
            "ack" => Kind::Steps(Vec::new()),
            "lms" => {
                let mut frame = Vec::new();
                encode(Dialect::B, b"sEN LMDscandata \x01", &mut frame);
                socket.write_all(&frame).expect("it reads");
                Kind::Scanner(Box::new(FrameDecoder::new(Accept::Only(Dialect::B), MAX_PAYLOAD)))
            }
            "can" => {
                socket.write_all(b"< open can0 >< rawmode >").expect("it reads");
                Kind::Lines
            }
            _ => Kind::Lines,
        };
        all.push(Stream { socket, kind });
    }
    let (mut bytes, mut scan) = (vec![0; MAX_PAYLOAD], LmdScandata::default());
    loop {
        let mut polled: Vec<PollFd<'_>> =
            all.iter().map(|stream| PollFd::new(&stream.socket, PollFlags::IN)).collect();
        poll(&mut polled, None).expect("sockets");
        let ready: Vec<bool> = polled.iter().map(|one| !one.revents().is_empty()).collect();
        let mut scanner = 0;
        for (stream, ready) in all.iter_mut().zip(ready) {
            let first = matches!(stream.kind, Kind::Scanner(_)) && std::mem::replace(&mut scanner, 1) == 0;
            if ready && !stream.take(&mut bytes, &mut scan, output.as_mut().filter(|_| first)) {
                return;
            }
        }
    }
}

impl Stream {
    /// Takes in what has come; decisions go to `output`. False once the stream has ended.
    fn take(&mut self, bytes: &mut [u8], scan: &mut LmdScandata, mut output: Option<&mut TcpStream>) -> bool {
        let read = match self.socket.read(bytes) {
            Ok(read @ 1..) => &bytes[..read],
            Err(error) if error.kind() == ErrorKind::Interrupted => return true,
            Ok(0) | Err(_) => return false,
        };
        match &mut self.kind {
            Kind::Lines => true,
            Kind::Scanner(frames) => {
                frames.push(read);
                while let Some(frame) = frames.next_frame() {
                    let telegram = Telegram::parse(frame.dialect, frame.payload).expect("a telegram");
                    if telegram.name != "LMDscandata" || telegram.args.decode_into(scan).is_err() {
                        continue;
                    }
                    let values = scan.channels16.first().map_or(&[][..], |channel| &channel.values);
                    let near = values.iter().filter(|value| (1..NEAR_MM).contains(*value)).count();
                    if let Some(output) = &mut output {
                        let sent = writeln!(output, "{} {near}", scan.scan_counter);
                        if sent.is_err() {
                            return false;
                        }
                    }
                }
                true
            }
            Kind::Steps(held) => {
                held.extend_from_slice(read);
                while let Some(end) = held.iter().position(|byte| *byte == b'\n') {
                    let line: Vec<u8> = held.drain(..=end).collect();
                    let text = String::from_utf8_lossy(&line);
                    let step = text.split_whitespace().nth(1).unwrap_or_default();
                    if self.socket.write_all(format!("ACK {step}\n").as_bytes()).is_err() {
                        return false;
                    }
                }
                true
            }
        }
    }
}
