//! The start-ups that were recorded of real scanners, asked again of ours: the replies that differ are known, each with its reason.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::facts::{Recording, recordings};
use rowscan_protocol::device::{Device, DialectPolicy, Identity, Options, Profile, Session};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::by_name;
use rowscan_protocol::telegram::Telegram;
use rowscan_protocol::time::SimTime;

/// A recorded start-up, and the requests that ours answers otherwise.
struct StartUp {
    recording: &'static str,
    model: &'static str,
    requests: usize,
    differ: &'static [&'static str],
}

const START_UPS: &[StartUp] = &[
    StartUp {
        recording: "lms111_startup_first88",
        model: "lms111",
        requests: 49,
        differ: &["LMPoutputRange", "field000", "field001", "field002"],
    },
    StartUp {
        recording: "lms511_20210302",
        model: "lms511",
        requests: 49,
        differ: &["LIDinputstate", "LocationName", "field000", "field001", "field002", "field003"],
    },
    StartUp {
        recording: "tim781s_20210125",
        model: "tim781s",
        requests: 66,
        differ: &["LIDinputstate", "field001", "field002", "field003", "field004", "field005"],
    },
    StartUp {
        recording: "mrs1104_20210722",
        model: "mrs1000",
        requests: 38,
        differ: &["InertialMeasurementUnit", "LMPoutputRange", "SerialNumber"],
    },
];

/// The name that a payload carries after its kind.
fn name(payload: &[u8]) -> String {
    Telegram::parse(Dialect::B, payload).map_or_else(|_| String::new(), |telegram| telegram.name.to_owned())
}

/// Requests in their order, with the reply to each: the first of its name that no earlier one has taken.
fn exchanges(recording: &Recording) -> Vec<(Vec<u8>, Vec<u8>)> {
    let mut requests: Vec<Vec<u8>> = Vec::new();
    let mut replies: BTreeMap<String, Vec<Vec<u8>>> = BTreeMap::new();
    for at in &recording.index {
        let payload = recording.payload(at).to_vec();
        if !at.from_device {
            requests.push(payload);
        } else if !payload.starts_with(b"sSN ") {
            let told = replies.entry(name(&payload)).or_default();
            // The converter that made the file kept some replies twice.
            if told.last() != Some(&payload) {
                told.push(payload);
            }
        }
    }
    let reply = |request: Vec<u8>| {
        let told = replies.get_mut(&name(&request)).filter(|told| !told.is_empty());
        // One that reads what it read before was told once.
        let reply =
            told.map_or_else(Vec::new, |told| if told.len() > 1 { told.remove(0) } else { told[0].clone() });
        (request, reply)
    };
    requests.into_iter().map(reply).collect()
}

#[test]
fn recorded_start_ups_are_answered_as_they_were() {
    let recordings = recordings();
    for StartUp { recording, model, requests, differ } in START_UPS {
        let Some(recording) = recordings.iter().find(|found| found.name == *recording) else { continue };
        let model = by_name(model).unwrap();
        let mut device = Device::new(model, Identity::of(model, 0));
        let mut session = Session::new(DialectPolicy::Auto);
        let exchanges = exchanges(recording);
        assert_eq!(exchanges.len(), *requests, "{}", model.name);
        let mut found = BTreeSet::new();
        for (number, (request, reply)) in exchanges.into_iter().enumerate() {
            let mut frame = Vec::new();
            rowscan_protocol::frame::encode(Dialect::B, &request, &mut frame);
            let mut replies = Vec::new();
            // It has been on for a while.
            let now = SimTime(60_000_000_000 + number as u64 * 1_000_000);
            session.handle_bytes(&mut device, now, &frame, &mut replies);
            let ours = replies.first().map(|reply| &reply.bytes[8..reply.bytes.len() - 1]);
            if ours != Some(reply.as_slice()) {
                found.insert(name(&request));
            }
        }
        let expected: BTreeSet<String> = differ.iter().map(|name| (*name).to_owned()).collect();
        assert_eq!(found, expected, "{}", model.name);
    }
}

/// A real MRS1104 was stopped, started, and asked each second whether it was ready: so long ours takes, too, within that second.
#[test]
fn an_mrs1000_is_ready_between_the_polls_between_which_a_real_one_was() {
    let recordings = recordings();
    let Some(recording) = recordings.iter().find(|found| found.name == "mrs1104_20210722") else { return };
    let options = Options { profile: Profile::Field, ..Options::default() };
    let mut device = Device::new(by_name("mrs1000").unwrap(), Identity::default()).with_options(options);
    let mut session = Session::new(DialectPolicy::Auto);
    let (mut states, mut ours) = (Vec::new(), None);
    for at in &recording.index {
        let payload = recording.payload(at);
        if !at.from_device {
            let mut frame = Vec::new();
            rowscan_protocol::frame::encode(Dialect::B, payload, &mut frame);
            // It has been on for a while, as the recorded one had.
            let now = SimTime(60_000_000_000 + (at.seconds * 1e9) as u64);
            let mut answers = Vec::new();
            session.handle_bytes(&mut device, now, &frame, &mut answers);
            ours = answers.first().map(|reply| reply.bytes[8..reply.bytes.len() - 1].to_vec());
        } else if payload.starts_with(b"sRA SCdevicestate") {
            // The converter kept some replies twice.
            let Some(ours) = ours.take() else { continue };
            assert_eq!(ours, payload, "at {} s", at.seconds);
            states.extend(payload.last());
        }
    }
    // Stopped, then 15 times not yet, then ready.
    assert_eq!((states.len(), states.last()), (17, Some(&1)));
    assert!(states.iter().take(16).all(|state| *state == 0));
}

/// docs/device.md has the counts, and why each reply differs.
#[test]
fn the_docs_tell_each_reply_that_differs() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/device.md");
    let page = std::fs::read_to_string(page).unwrap();
    for StartUp { model, requests, differ, .. } in START_UPS {
        let line = format!("| `{model}` | {} of {requests} |", requests - differ.len());
        let row = page.lines().find(|row| row.starts_with(&line)).unwrap_or_else(|| panic!("{line}"));
        for name in *differ {
            assert!(row.contains(name), "{model}: {name} in {row}");
        }
    }
}
