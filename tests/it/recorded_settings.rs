//! What an earlier client had set that takes something from the scans of a recording: every scan knows it, and an estimate tells it.

use crate::common;

use common::replayed::{Packets, write};
use common::talk::Talk;
use rowscan_canopy::Warning;
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::{self, MODELS};
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_recording::Side;
use rowscan_study::reading::{CalibrationChoice, Reading};

/// A setting in CoLa A: its name, a value that takes something, and one that takes nothing.
const SETTINGS: &[(&str, &str, &str)] = &[
    ("LFPmeanfilter", "1 +3 0", "0 +3 0"),
    ("LFPmedianfilter", "1 +3", "0 +3"),
    ("LFPparticle", "1 +500", "0 +500"),
    ("MSsuppmode", "1", "0"),
    ("ScanLayerFilter", "4 0 1 0 0", "4 1 1 1 1"),
];

/// What scans of a recording know, and the codes and words of an estimate's warnings of it.
async fn read(talk: Talk) -> (Vec<Vec<&'static str>>, Vec<String>) {
    let model = talk.device.model().name;
    read_packets(&talk.recorded(0), model).await
}

async fn read_packets(packets: &Packets, model: &str) -> (Vec<Vec<&'static str>>, Vec<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("said.mcap");
    write(&path, packets);
    let rig = Rig { scanners: vec![Mount { model: model.into(), ..Mount::default() }], ..Rig::default() };
    let reading =
        Reading::of_recording(Some(&rig), 0, true, CalibrationChoice::Given(None)).expect("it reads");
    let source: Source = path.to_str().expect("text").parse().expect("a file");
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it opens");
    let (mut pipeline, mut known) = (reading.pipeline, Vec::new());
    while let Some(record) = scanner.next().await.expect("it reads") {
        known.push(record.scan.leftovers.iter().map(|(_, setting)| setting.name).collect());
        pipeline.push(record.scan);
    }
    let told = |warning: &Warning| (warning.code() == "setting_left_on").then(|| warning.to_string());
    (known, pipeline.finish().warnings.iter().filter_map(told).collect())
}

#[tokio::test]
async fn a_recording_tells_what_was_taken_from_its_scans_while_it_was() {
    let mut tried = 0;
    for model in MODELS.iter().filter(|model| model.compact.is_none()) {
        for (name, on, off) in SETTINGS {
            let [on, off] = [on, off].map(|value| format!("sWN {name} {value}"));
            let mut talk = Talk::with(model, Dialect::A);
            talk.scans(3);
            if !talk.ask(on.as_bytes()).starts_with(b"sWA") {
                // The wrong twin: what is refused takes nothing.
                talk.scans(3);
                let (known, told) = read(talk).await;
                assert!(
                    known.iter().all(Vec::is_empty) && told.is_empty(),
                    "{} {name}: {told:?}",
                    model.name
                );
                continue;
            }
            tried += 1;
            talk.scans(6);
            let is_off = talk.ask(off.as_bytes()).starts_with(b"sWA");
            assert!(is_off, "{} {off}", model.name);
            talk.scans(3);
            let (known, told) = read(talk).await;
            let taken = known.iter().filter(|names| names.as_slice() == [*name]).count();
            let untouched = known.iter().filter(|names| names.is_empty()).count();
            assert!(
                taken > 0 && untouched >= 6 && taken + untouched == known.len(),
                "{} {name}: {known:?}",
                model.name
            );
            assert!(known.first().is_some_and(Vec::is_empty) && known.last().is_some_and(Vec::is_empty));
            let [words] = told.as_slice() else { panic!("{} {name}: {told:?}", model.name) };
            assert!(words.contains(name) && words.contains(&format!(" {taken} scan")), "{words}");
        }
    }
    assert!(tried >= 8, "{tried}");
}

/// A client that sends all its requests at once, with the login, before the scanner has said a word.
#[tokio::test]
async fn settings_that_are_sent_at_once_are_heard_as_well() {
    let mut talk = Talk::with(model::by_name("lms111").expect("known"), Dialect::A);
    assert!(talk.ask(b"sWN LFPmeanfilter 1 +3 0").starts_with(b"sWA"));
    let said = talk.recorded(12);
    let (asked, answered): (Packets, Packets) =
        said.into_iter().partition(|(_, from, _)| *from == Side::Host);
    let at = asked[0].0;
    let at_once = asked.into_iter().flat_map(|(.., bytes)| bytes).collect();
    let packets: Packets = [(at, Side::Host, at_once)].into_iter().chain(answered).collect();
    let (known, told) = read_packets(&packets, "lms111").await;
    assert!(known.len() >= 4 && known.iter().all(|names| names.as_slice() == ["LFPmeanfilter"]), "{known:?}");
    assert_eq!(told.len(), 1, "{told:?}");
}
