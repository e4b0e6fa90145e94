//! Whatever a client does to the line of an LMS2xx: a valid request afterwards is answered. All sequences of five, in simulated time.

use std::time::Duration;

use crate::lms2xx_start_ups::line::{Heard, Line};
use rowscan_protocol::device::Profile;
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::device::{Device, Options, Start};
use rowscan_protocol::lms2xx::frame::encode;
use rowscan_protocol::lms2xx::model::MODELS;

/// What a client may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Act {
    Open,
    Close,
    /// Asks at another rate than the device's.
    WrongRate,
    /// Breaks off inside a request.
    Cut,
    Junk,
    Request,
    Pause,
}

const ACTS: [Act; 7] = [Act::Open, Act::Close, Act::WrongRate, Act::Cut, Act::Junk, Act::Request, Act::Pause];
const LONGEST: u32 = 5;

/// The status, and values of the Quick Manual's kind.
const STATUS: [u8; 1] = [0x31];

fn act(line: &mut Line, act: Act) {
    match act {
        Act::Open => line.closed = false,
        Act::Close => line.closed = true,
        Act::Pause => line.wait(Duration::from_millis(1_300)),
        // Who has not opened the port cannot write.
        _ if line.closed => {}
        Act::WrongRate => {
            line.tty = Rate::R19200;
            line.send(&STATUS);
            line.tty = Rate::R9600;
        }
        Act::Cut => {
            let mut request = Vec::new();
            encode(0, b"\x20\x00SICK_LMS", &mut request);
            line.write(&request[..6]);
        }
        // A start among it claims ten bytes.
        Act::Junk => line.write(&[0x55, 0x02, 0x00, 0x0A, 0x00, 0x13]),
        Act::Request => line.send(&STATUS),
    }
}

/// Whether the request is acknowledged and answered; an answer to an earlier one may come first.
fn is_answered(line: &mut Line) -> bool {
    line.closed = false;
    line.send(&STATUS);
    let mut acknowledged = false;
    for _ in 0..40 {
        match line.hear(Duration::from_millis(400)) {
            Some(Heard::Ack) => acknowledged = true,
            Some(Heard::Body(body)) if acknowledged && body[0] == 0xB1 => return true,
            Some(_) => {}
            None => return false,
        }
    }
    false
}

fn prove(profile: Profile, start: Start, longest: u32) {
    let model = MODELS.iter().find(|model| model.name == "lms200").expect("known");
    let mut played = 0;
    for length in 0..=longest {
        for number in 0..ACTS.len().pow(length) {
            let acts = (0..length).map(|place| ACTS[number / ACTS.len().pow(place) % ACTS.len()]);
            let options = Options { profile, start, ..Options::default() };
            let mut line = Line::new(Device::new(model, options));
            // It is at work on a telegram when the client comes, if it streams.
            line.wait(Duration::from_millis(200));
            acts.clone().for_each(|what| act(&mut line, what));
            let acts: Vec<Act> = acts.collect();
            assert!(is_answered(&mut line), "{profile:?}, {start:?}: no answer after {acts:?}");
            played += 1;
        }
    }
    assert!(played > ACTS.len().pow(longest));
}

#[test]
fn a_silent_device_answers_whatever_came_before() {
    prove(Profile::Bench, Start::Idle, LONGEST);
    prove(Profile::Field, Start::Idle, LONGEST - 1);
}

#[test]
fn a_streaming_device_answers_whatever_came_before() {
    prove(Profile::Bench, Start::Streaming, LONGEST);
    prove(Profile::Field, Start::Streaming, LONGEST - 1);
}
