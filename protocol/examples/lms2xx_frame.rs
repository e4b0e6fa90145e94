//! A classic LMS2xx: a request as a frame, and the frames that a virtual device answers with, without a serial line:
//! `cargo run -p rowscan-protocol --example lms2xx_frame`

#![allow(clippy::print_stdout, reason = "an example prints")]

use std::error::Error;
use std::time::Duration;

use rowscan_protocol::lms2xx::device::{Device, Options};
use rowscan_protocol::lms2xx::frame::{FrameDecoder, Listener, Received};
use rowscan_protocol::lms2xx::telegram::Request;
use rowscan_protocol::lms2xx::{Rate, model};
use rowscan_protocol::time::SimTime;

fn main() -> Result<(), Box<dyn Error>> {
    let request = Request::Type.to_frame();
    println!("request {request:02X?}");
    for answer in ask(&request)? {
        println!("answer  {answer}");
    }
    Ok(())
}

/// What an LMS291 answers within ten seconds of simulated time.
pub(crate) fn ask(request: &[u8]) -> Result<Vec<String>, Box<dyn Error>> {
    let model = model::MODELS.iter().find(|model| model.name == "lms291").ok_or("no such model")?;
    let mut device = Device::new(model, Options::default());
    let mut decoder = FrameDecoder::new(Listener::Host);
    let mut now = SimTime::ZERO;
    device.handle_bytes(now, Rate::R9600.transmission(1), request);
    let mut answers = Vec::new();
    for _ in 0..10_000 {
        while let Some(bytes) = device.poll_transmit(now) {
            now = now + device.rate().transmission(bytes.len());
            device.transmitted(now);
            decoder.push(&bytes);
        }
        while let Some(received) = decoder.next_received() {
            answers.push(match received {
                Received::Ack => "ACK".to_owned(),
                Received::Nak => "NAK".to_owned(),
                Received::Broken => "a frame with a wrong checksum".to_owned(),
                Received::CutOff { len, .. } => format!("{len} bytes of a frame that a request has cut off"),
                Received::Frame(frame) => {
                    format!("{:02X}: {}", frame.body[0], frame.body[1..].escape_ascii())
                }
            });
        }
        now = now + Duration::from_millis(1);
        device.handle_timeout(now);
    }
    Ok(answers)
}
