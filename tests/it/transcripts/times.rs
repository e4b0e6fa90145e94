//! How long each start-up takes to its first scan, in virtual time; the table is in docs/device.md.

use std::path::Path;
use std::time::Duration;

use rowscan_emulator::stage::Stage;
use rowscan_protocol::device::{DialectPolicy, Options, Profile, Start};
use rowscan_protocol::model::{self, Model};

use super::script::Script;
use super::{Run, scripts};
use crate::common::small_scene;

const CONDITIONS: [(Profile, Start); 4] = [
    (Profile::Bench, Start::Streaming),
    (Profile::Bench, Start::PowerUp),
    (Profile::Field, Start::Streaming),
    (Profile::Field, Start::PowerUp),
];

/// Not in the table: no running client was captured, and the other's first line holds only until it has switched the scanner over.
const UNTIMED: [&str; 2] = ["Player-like", "sick_scan_xd, dialect unknown"];

/// A client that gives up is started again, after so long and so often.
const RESTART: Duration = Duration::from_secs(1);
const ATTEMPTS: u32 = 60;

/// Seconds, and at which attempt; why not, where there never was a scan.
async fn cell(stage: &Stage, script: &Script, model: &'static Model, condition: (Profile, Start)) -> String {
    let (profile, start) = condition;
    let dialect = script.dialects[0];
    let policy = script.device.map_or(DialectPolicy::Auto, DialectPolicy::Strict);
    let options = Options { profile, start, ..Options::default() };
    let mut run = Run::new(stage, script, model, dialect, policy, options);
    let patience = run.within;
    let mut last = String::new();
    for attempt in 1..=ATTEMPTS {
        (run.within, run.scan_limit, run.dialect) = (patience, patience, dialect);
        let ended = run.play().await;
        match (ended, run.first_scan) {
            (Ok(()), Some(at)) if attempt == 1 => return format!("{:.2}", at.as_secs_f64()),
            (Ok(()), Some(at)) => return format!("{:.2} (attempt {attempt})", at.as_secs_f64()),
            (Ok(()), None) => return "no scans asked for".to_owned(),
            (Err(why), _) => last = why,
        }
        run.first_scan = None;
        tokio::time::sleep(RESTART).await;
        run.reconnect();
    }
    format!("never: {last}")
}

async fn table() -> String {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let mut table = String::from(
        "| client | model | bench, warm | bench, power-on | field, warm | field, power-on |\n|---|---|---|---|---|---|\n",
    );
    for (_, script) in scripts().into_iter().filter(|(_, script)| !UNTIMED.contains(&script.client.as_str()))
    {
        let Some(model) = script.models.iter().find_map(|name| model::by_name(name)) else { continue };
        table += &format!("| {} | `{}` |", script.client, model.name);
        for condition in CONDITIONS {
            table += &format!(" {} |", cell(&stage, &script, model, condition).await);
        }
        table += "\n";
    }
    table
}

#[tokio::test(start_paused = true)]
async fn every_client_gets_its_scans_and_the_page_says_when() {
    let table = table().await;
    assert!(!table.contains("never"), "{table}");
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/device.md");
    let kept = std::fs::read_to_string(page).expect("the page is there");
    assert!(kept.contains(&table), "put this table into docs/device.md, under CoLa:\n{table}");
}
