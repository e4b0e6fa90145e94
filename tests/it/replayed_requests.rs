//! What a real client once asked a real scanner, asked again of the emulated one: the same kinds of replies in the same order, and the same
//! bytes wherever a reply carries neither time, counters, serial numbers nor stored fields. What differs stands below, with the reason, and in
//! `docs/replay-differences.md`.

use crate::common;

use std::collections::BTreeSet;
use std::path::Path;

use common::facts;
use rowscan_protocol::device::{Device, DialectPolicy, Identity, Session};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::telegram::{Kind, Telegram};
use rowscan_protocol::time::SimTime;
use serde_json::Value;

/// Recording and the model it is of.
const RECORDINGS: [(&str, &str); 3] =
    [("lms111_startup_first88", "lms111"), ("lms511_20210302", "lms511"), ("tim781s_20210125", "tim781s")];

/// Replies whose bytes differ: model, first part of the command's name, why.
const DIFFERENCES: &[(&str, &str, &str)] = &[
    ("lms111", "ODoprh", "counts operating hours"),
    ("lms111", "ODpwrc", "counts power-ups"),
    (
        "lms111",
        "LMPoutputRange",
        "read before its client wrote the same: an earlier client had left it; ours is as delivered",
    ),
    ("lms111", "field0", "ten stored evaluation fields; ours are unused"),
    ("lms511", "ODoprh", "counts operating hours"),
    ("lms511", "ODpwrc", "counts power-ups"),
    ("lms511", "LocationName", "a stored name that holds the serial number"),
    ("lms511", "field0", "ten stored evaluation fields; ours are unused"),
    ("lms511", "LIDinputstate", "carries the time since power-up and the time of day"),
    ("tim781s", "ODoprh", "counts operating hours"),
    ("tim781s", "ODpwrc", "counts power-ups"),
    ("tim781s", "field0", "48 stored evaluation fields; ours are unused"),
    (
        "tim781s",
        "LIDinputstate",
        "input 1 was on while it was recorded; ours is off until the scene switches it",
    ),
];

/// A recorded frame.
struct Recorded {
    from_device: bool,
    bytes: Vec<u8>,
}

impl Recorded {
    fn telegram(&self) -> Telegram<'_> {
        Telegram::parse(Dialect::B, payload(&self.bytes)).expect("a telegram")
    }

    fn is_event(&self) -> bool {
        self.telegram().kind == Kind::Sn
    }
}

fn payload(frame: &[u8]) -> &[u8] {
    &frame[8..frame.len() - 1]
}

fn load(folder: &Path, name: &str) -> Vec<Recorded> {
    let read = |suffix: &str| std::fs::read(folder.join(format!("{name}{suffix}"))).expect("recorded");
    let about: Value = serde_json::from_slice(&read(".json")).expect("json");
    let (to_device, to_host) = (read(".h2d.bin"), read(".d2h.bin"));
    let place = |value: &Value| usize::try_from(value.as_u64().expect("a place")).expect("small");
    let frame = |at: &Value| {
        let from_device = at[1] == "d2h";
        let stream = if from_device { &to_host } else { &to_device };
        let (offset, len) = (place(&at[2]), place(&at[3]));
        Recorded { from_device, bytes: stream[offset..offset + len].to_vec() }
    };
    about["index"].as_array().expect("listed").iter().map(frame).collect()
}

/// Requests with their replies. A frame that was captured twice is one reply.
fn conversation(recorded: &[Recorded]) -> Vec<(&Recorded, &Recorded)> {
    let mut open: Vec<&Recorded> = Vec::new();
    let mut pairs: Vec<(&Recorded, &Recorded)> = Vec::new();
    for frame in recorded.iter().filter(|frame| !frame.from_device || !frame.is_event()) {
        if !frame.from_device {
            open.push(frame);
            continue;
        }
        let answers = |request: &Recorded| {
            let reply = frame.telegram();
            reply.kind == Kind::Fa || reply.name == request.telegram().name
        };
        match open.first() {
            Some(request) if answers(request) => pairs.push((open.remove(0), frame)),
            _ => {
                let last = pairs.last().expect("a reply comes after a request");
                assert_eq!(last.1.bytes, frame.bytes, "a reply that nobody asked for");
            }
        }
    }
    assert!(open.is_empty(), "{} requests without a reply", open.len());
    pairs
}

#[test]
fn the_emulated_scanner_answers_a_recorded_client_as_the_real_one_did() {
    let Some(facts) = facts("replaying recorded requests") else { return };
    let mut faults = Vec::new();
    let mut seen = BTreeSet::new();
    for (recording, model) in RECORDINGS {
        let recorded = load(&facts.join("protocol/recordings"), recording);
        let mut device = Device::new(model::by_name(model).expect("known"), Identity::default());
        let mut session = Session::new(DialectPolicy::Auto);
        let (mut equal, mut total) = (0, 0);
        for (request, expected) in conversation(&recorded) {
            let mut replies = Vec::new();
            session.handle_bytes(&mut device, SimTime::ZERO, &request.bytes, &mut replies);
            let about = |reply: &[u8]| payload(reply).escape_ascii().to_string();
            let name = request.telegram().name;
            // The reply; what follows it at once is an event.
            let Some(reply) = replies.first().map(|reply| &reply.bytes) else {
                faults.push(format!("{model}: no reply to {}", about(&request.bytes)));
                continue;
            };
            let events = replies.iter().skip(1).map(|reply| payload(&reply.bytes));
            assert!(
                events.clone().all(|event| event.starts_with(b"sSN ")),
                "{model}: several replies to {name}"
            );
            let heads = |reply: &[u8]| {
                let telegram = Telegram::parse(Dialect::B, payload(reply)).expect("a telegram");
                (telegram.kind, telegram.name.to_owned())
            };
            total += 1;
            if heads(reply) != heads(&expected.bytes) {
                faults.push(format!("{model}: recorded {}, got {}", about(&expected.bytes), about(reply)));
                continue;
            }
            if *reply == expected.bytes {
                equal += 1;
                continue;
            }
            match DIFFERENCES.iter().find(|(of, start, _)| *of == model && name.starts_with(start)) {
                Some(difference) => {
                    seen.insert(*difference);
                }
                None => {
                    faults.push(format!("{model}: recorded {}, got {}", about(&expected.bytes), about(reply)))
                }
            }
        }
        eprintln!("{model}: {equal} of {total} replies equal byte for byte");
        assert!(total > 40, "{recording}: only {total} requests");
    }
    assert!(faults.is_empty(), "{} unexplained:\n{}", faults.len(), faults.join("\n"));
    for difference in DIFFERENCES {
        assert!(seen.contains(difference), "no longer different: {difference:?}");
    }
}

#[test]
fn the_document_lists_every_difference() {
    let document = include_str!("../../docs/replay-differences.md");
    for (model, command, why) in DIFFERENCES {
        let row = format!("| {model} | `{command}` | {why} |");
        assert!(document.contains(&row), "docs/replay-differences.md lacks: {row}");
    }
}
