//! The start-ups of public LMS2xx clients, byte for byte, in simulated time: warm and from power-on, on the bench and in the field. The table of
//! how long each takes to its first scan is in docs/device.md.

pub(crate) mod line;
mod script;

use std::path::Path;
use std::time::Duration;

use line::Line;
use rowscan_protocol::device::Profile;
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::{Device, Options, Start};
use rowscan_protocol::lms2xx::{Rate, model};
use rowscan_protocol::time::SimTime;
use script::Script;

const CONDITIONS: [(Profile, Start); 4] = [
    (Profile::Bench, Start::Idle),
    (Profile::Bench, Start::PowerUp),
    (Profile::Field, Start::Idle),
    (Profile::Field, Start::PowerUp),
];

/// A client that gives up is started again, after so long and so often.
const RESTART: Duration = Duration::from_secs(1);
const ATTEMPTS: u32 = 20;

fn scripts() -> Vec<Script> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/lms2xx_start_ups");
    let mut paths: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "txt"));
    paths.sort();
    paths.iter().map(|path| Script::parse(&std::fs::read_to_string(path).unwrap())).collect()
}

fn line(model: &str, profile: Profile, start: Start) -> Line {
    let model = model::MODELS.iter().find(|known| known.name == model).unwrap();
    Line::new(Device::new(model, Options { profile, start, ..Options::default() }))
}

/// When the first scan came, and at which attempt.
type Outcome = Result<(SimTime, u32), String>;

fn play(script: &Script, model: &str, profile: Profile, start: Start) -> Outcome {
    let mut line = line(model, profile, start);
    let mut last = String::new();
    for attempt in 1..=ATTEMPTS {
        match script.play(&mut line) {
            Ok(()) => return Ok((line.first_scan.unwrap(), attempt)),
            Err(why) => last = why,
        }
        line.wait(RESTART);
    }
    Err(last)
}

/// Our own driver's session, which looks for the rate again and again by itself.
fn play_own(model: &str, profile: Profile, start: Start) -> Outcome {
    let mut line = line(model, profile, start);
    for attempt in 1..=ATTEMPTS {
        let mut client = Lms2xxClient::new(Lms2xxConfig::default());
        loop {
            while let Some(transmit) = client.poll_transmit() {
                match transmit {
                    Transmit::Rate(rate) => line.tty = rate,
                    Transmit::Frame(frame) => line.write(&frame),
                }
            }
            let due = client.poll_timeout().map(|due| SimTime(due.as_nanos() as u64));
            let bytes = line.step_to(due.unwrap_or(line.now + Duration::from_secs(1)).max(line.now));
            let now = line.now.elapsed();
            if bytes.is_empty() {
                client.handle_timeout(now);
            } else {
                client.handle_bytes(now, &bytes);
            }
            match client.poll_event() {
                Some(HostEvent::Scan) => return Ok((line.now, attempt)),
                Some(HostEvent::NoAnswer { .. }) => break,
                Some(HostEvent::Refused { fatal: true, command, .. }) => {
                    return Err(format!("{command} refused"));
                }
                _ => {}
            }
        }
        line.wait(RESTART);
    }
    Err("no answer".to_owned())
}

fn row(client: &str, model: &str, play: impl Fn(Profile, Start) -> Outcome) -> String {
    let cell = |(profile, start)| match play(profile, start) {
        Ok((at, 1)) => format!("{:.2}", at.as_secs_f64()),
        Ok((at, attempt)) => format!("{:.2} (attempt {attempt})", at.as_secs_f64()),
        Err(why) => format!("never: {why}"),
    };
    format!("| {client} | `{model}` | {} |\n", CONDITIONS.map(cell).join(" | "))
}

fn table() -> String {
    let mut table = String::from(
        "| client | model | bench, warm | bench, power-on | field, warm | field, power-on |\n|---|---|---|---|---|---|\n",
    );
    for script in scripts() {
        for model in &script.models {
            table += &row(&script.client, model, |profile, start| play(&script, model, profile, start));
        }
    }
    for model in ["lms200", "lms291", "lms291-s14"] {
        table += &row("rowscan", model, |profile, start| play_own(model, profile, start));
    }
    table
}

#[test]
fn every_client_gets_its_scans_and_the_page_says_when() {
    let table = table();
    assert!(!table.contains("never"), "{table}");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/device.md");
    let kept = std::fs::read_to_string(page).unwrap();
    assert!(kept.contains(&table), "put this table into docs/device.md, under LMS2xx:\n{table}");
}

/// ARIA's ArLMS2xx as it is published: its increment of 0 is no variant, so it reads that it is refused, and gives up.
#[test]
fn the_published_aria_is_refused_and_the_variant_stays() {
    for model in ["lms200", "lms291"] {
        let mut line = line(model, Profile::Bench, Start::Idle);
        line.send(&[0x3B, 0xB4, 0x00, 0x00, 0x00]);
        assert!(matches!(line.hear(Duration::from_secs(1)), Some(line::Heard::Ack)));
        let Some(line::Heard::Body(reply)) = line.hear(Duration::from_secs(1)) else { panic!("no reply") };
        assert_eq!(reply[..6], [0xBB, 0x00, 0xB4, 0x00, 0x32, 0x00], "{model}");
    }
}

/// A device that a client has left at a higher rate, or streaming: what searches for the rate still finds it.
#[test]
fn clients_that_search_for_the_rate_find_it() {
    let mut played = 0;
    for script in scripts() {
        let searches = ["MRPT", "CARMEN"].iter().any(|name| script.client.starts_with(name));
        for model in script.models.iter().filter(|_| searches) {
            let model = model::MODELS.iter().find(|known| known.name == model).unwrap();
            for start in [Start::Idle, Start::Streaming, Start::Installation] {
                let options = Options { start, stored_rate: Rate::R38400, ..Options::default() };
                let mut line = Line::new(Device::new(model, options));
                let ended = script.play(&mut line).or_else(|_| script.play(&mut line));
                assert_eq!(ended, Ok(()), "{} {} {start:?}", script.client, model.name);
                played += 1;
            }
        }
    }
    assert!(played >= 24, "{played}");
}
