//! Each source of `estimate` is read by what its own recording says: its model, and whether its scene is the one that the truth is of.

use serde_json::Value;

use crate::common::binary::{Emulator, Ended, Telling, assert_says, run};
use crate::common::recorded::folder;

fn json(ended: &Ended) -> Value {
    serde_json::from_str(&ended.stdout).unwrap_or_else(|_| panic!("{}", ended.stderr))
}

/// An estimate as JSON, whatever it withholds, and what was said beside it.
fn estimated(args: &[&str]) -> (Value, String) {
    let ended = run(&[&["estimate", "--format", "json"], args].concat());
    (json(&ended), ended.stderr)
}

/// An emulated scanner of this model in front of the scene, and its source.
fn emulated(scene: &str, model: &str, scale: &str) -> (Telling, String) {
    let has_rest = ["picoscan", "multiscan"].iter().any(|family| model.starts_with(family));
    let rest = if has_rest { &["--rest", "127.0.0.1:0"][..] } else { &[] };
    let args = [&[scene, "--model", model, "--tcp", "127.0.0.1:0", "--time-scale", scale], rest].concat();
    let mut emulator = Telling::start("emulate", &args);
    let tcp = emulator.address();
    let source =
        if has_rest { format!("picoscan://{}?udp=0", emulator.address()) } else { format!("tcp://{tcp}") };
    (emulator, source)
}

/// An estimate without what tells of its place among others.
fn alone(mut told: Value) -> Value {
    if let Some(told) = told.as_object_mut() {
        told.retain(|key, _| !["scanner", "source"].contains(&key.as_str()));
        if let Some(Value::Array(warnings)) = told.get_mut("warnings") {
            warnings
                .retain(|warning| !warning.as_str().is_some_and(|told| told.starts_with("streams_left_out")));
        }
    }
    told
}

/// Three scanners in one file, all of them the rig's scanner 0: what one of them is changes nothing for the others.
#[test]
fn every_stream_is_read_by_its_own_model_whatever_is_read_beside_it() {
    let (_folder, file) = folder();
    let (rig, recorded) = (file("device.toml"), file("three.mcap"));
    // Through a device's beams an area goes by the model.
    let scene = std::fs::read_to_string(file("row.toml")).expect("written");
    std::fs::write(&rig, scene + "[optics]\nstages = \"device\"\n").expect("written");
    let streams = [("aa", "tim561"), ("mm", "lms111"), ("zz", "picoscan150")];
    let scanners = streams.map(|(name, model)| (name, emulated(&rig, model, "1")));
    let sources: Vec<String> =
        scanners.iter().map(|(name, (_, source))| format!("{name}={source}")).collect();
    let sources: Vec<&str> = sources.iter().map(String::as_str).collect();
    let ended = run(&[&["record", "-o", &recorded, "--scans", "30"], &sources[..]].concat());
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let named = streams.map(|(name, model)| (format!("{recorded}#{name}"), model));
    let apart = named.clone().map(|(source, model)| {
        let (told, _) = estimated(&[&source, "--rig", &rig]);
        assert_eq!(told, estimated(&[&source, "--rig", &rig, "--model", model]).0, "{source} is a {model}");
        told
    });
    // Where none is named, the first by name is read.
    let (first, _) = estimated(&[&recorded, "--rig", &rig]);
    assert_eq!(alone(first), alone(apart[0].clone()));
    // In every order.
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        let sources = order.map(|place| named[place].0.as_str());
        let zero = ["--scanner", "0", "--scanner", "0", "--scanner", "0", "--rig", &rig];
        let (together, _) = estimated(&[&sources[..], &zero].concat());
        let all = together["scanners"].as_array().unwrap_or_else(|| panic!("{together}"));
        for (told, place) in all.iter().zip(order) {
            assert_eq!(alone(told.clone()), alone(apart[place].clone()), "{order:?}: {}", named[place].0);
        }
    }
    // Each is played where its sort of places is given, and nowhere else.
    for (stream, place) in [("zz", "--rest"), ("mm", "--tcp")] {
        let mut playing = Telling::start("replay", &[&recorded, "--stream", stream, place, "127.0.0.1:0"]);
        assert!(playing.address().starts_with("127.0.0.1:"), "{stream}");
    }
    // The wrong twin: one model for all.
    let wrong = [0, 2].map(|place| estimated(&[&named[place].0, "--rig", &rig, "--model", "lms111"]).0);
    assert!(wrong[0] != apart[0] && wrong[1] != apart[2], "{wrong:?}");
    let key = "leaf_area_contact_raw_m2";
    assert!(apart[0][key].is_number() && wrong[0][key] != apart[0][key], "the model is of no effect");
}

/// What a live estimate went by is in its recording: read again by a rig of another model it is the same one.
#[test]
fn a_recorded_estimate_keeps_the_model_that_it_was_made_by() {
    let (_folder, file) = folder();
    let other = file("row.toml");
    let scene = std::fs::read_to_string(&other).expect("written");
    for model in ["lms111", "lms511", "lms500", "lms1000", "tim561", "mrs1000", "picoscan150", "picoscan120"]
    {
        let (own, recorded, exported) =
            (file("own.toml"), file(&format!("{model}.mcap")), file(&format!("{model}.csv")));
        std::fs::write(&own, format!("{scene}[[rig.scanner]]\nmodel = \"{model}\"\n")).expect("written");
        let (_emulator, source) = emulated(&own, model, "1");
        let (live, _) = estimated(&[&source, "--rig", &own, "--scans", "15", "--record", &recorded]);
        // The wrong twin is the rig of the other model: an LMS111's, or of an LMS111 a TiM571's.
        let other = if model == "lms111" {
            let other = file("tim571.toml");
            std::fs::write(&other, format!("{scene}[[rig.scanner]]\nmodel = \"tim571\"\n")).expect("written");
            other
        } else {
            other.clone()
        };
        let (again, said) = estimated(&[&recorded, "--rig", &other, "--scans", "15"]);
        assert_says(&said, &[&format!("names the model {model}, and is read as one")]);
        for key in ["impacted_total_area_m2", "leaf_area_m2", "calibration", "points_per_scan"] {
            assert_eq!(again[key], live[key], "{model}: {key}\n{again}");
        }
        let ended = run(&["export", &recorded, "--to", "csv", "--what", "scans", "-o", &exported]);
        if model == "mrs1000" {
            assert_says(&ended.stderr, &["one table takes one layer"]);
            continue;
        }
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let head = std::fs::read_to_string(&exported).expect("written");
        assert_says(head.lines().next().unwrap_or_default(), &[&format!("model {model}")]);
    }
}

/// A family's name is kept as what it can be: the rig's model where it is one of these, else the first of them.
#[test]
fn a_recorded_family_is_read_as_one_of_it() {
    let (_folder, file) = folder();
    let (rig, recorded) = (file("row.toml"), file("lms5xx.mcap"));
    let (_emulator, source) = emulated(&rig, "lms511", "max");
    let ended = run(&["record", &source, "-o", &recorded, "--scans", "30"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let info = json(&run(&["record", "--info", &recorded, "--format", "json"]));
    let candidates = info["candidates"].as_object().unwrap_or_else(|| panic!("{info}"));
    let candidates: Vec<&Value> = candidates.values().collect();
    assert_eq!((&info["model"], candidates), (&Value::Null, vec![&Value::from("lms511, lms500")]));
    let (told, said) = estimated(&[&recorded, "--rig", &rig]);
    assert_says(
        &said,
        &["names the model lms511 or lms500, and is read as lms511; the rig has lms111 there"],
    );
    assert_eq!(told, estimated(&[&recorded, "--rig", &rig, "--model", "lms511"]).0);
    let own = file("own.toml");
    let scene = std::fs::read_to_string(&rig).expect("written");
    std::fs::write(&own, scene + "[[rig.scanner]]\nmodel = \"lms500\"\n").expect("written");
    let (told, said) = estimated(&[&recorded, "--rig", &own]);
    assert!(!said.contains("names the model"), "{said}");
    assert_eq!(told, estimated(&[&recorded, "--rig", &rig, "--model", "lms500"]).0);
    // The wrong twin: none of them.
    let (wrong, _) = estimated(&[&recorded, "--rig", &rig, "--model", "lms111"]);
    assert!(wrong["warnings"].to_string().contains("other_model"), "{wrong}");
}

/// The truths beside the estimators.
fn truths(told: &Value) -> Vec<&Value> {
    let rows = told["side_by_side"].as_array().unwrap_or_else(|| panic!("{told}"));
    rows.iter().map(|row| &row["truth"]).filter(|truth| !truth.is_null()).collect()
}

/// Truth is of trees that stood before the scanner: of another scene than the recorded one it is unknown.
#[test]
fn no_truth_is_told_of_a_scene_that_the_recording_was_not_made_in() {
    let (folder, file) = folder();
    let (here, recorded) = (file("row.toml"), file("run.mcap"));
    let emulator = Emulator::start(&[&here, "--time-scale", "max", "--record", &recorded]);
    let ended = run(&["estimate", &emulator.url(), "--rig", &here, "--scans", "60"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    emulator.end();
    let scene = std::fs::read_to_string(&here).expect("written");
    let elsewhere = |name: &str, scene: &str| {
        let path = folder.path().join("elsewhere").join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(&path, scene).expect("written");
        path.to_str().expect("UTF-8").to_owned()
    };
    let asked = |rig: &str, more: &[&str]| {
        estimated(&[&[recorded.as_str(), "--rig", rig, "--estimators", "voxel"], more].concat())
    };
    let (told, said) = asked(&here, &[]);
    assert!(!truths(&told).is_empty() && !said.contains("no truth is told"), "{said}");
    let (moved, said) = asked(&elsewhere("row.toml", &scene), &[]);
    assert_eq!(truths(&moved), truths(&told), "a scene's file may be moved: {said}");
    // The wrong twins: another name, and other trees under the same name.
    let renamed = elsewhere("other.toml", &scene);
    let replanted = elsewhere("row.toml", &scene.replace("trees = 2", "trees = 3"));
    for (rig, why) in [(&renamed, "--rig names"), (&replanted, "trees 2 (here 3)")] {
        let (told, said) = asked(rig, &[]);
        assert_eq!(truths(&told), Vec::<&Value>::new(), "{rig}");
        assert_says(&said, &["no truth is told", why, "--seed N"]);
        let (told, said) = asked(rig, &["--seed", "1"]);
        assert!(!truths(&told).is_empty() && !said.contains("no truth is told"), "{rig}: {said}");
    }
}

/// The truth is that of one seed: whichever it is, nothing lets a user take it for that of another.
#[test]
fn a_truth_whose_seed_is_not_the_sources_own_is_said() {
    let (_folder, file) = folder();
    let (here, own, live) = (file("row.toml"), file("own.mcap"), file("live.mcap"));
    let emulator = Emulator::start(&[&here, "--seed", "5", "--time-scale", "max", "--record", &own]);
    let ended = run(&["record", &emulator.url(), "-o", &live, "--scans", "60"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    emulator.end();
    let asked = |file: &str, more: &[&str]| {
        estimated(&[&[file, "--rig", &here, "--estimators", "voxel"], more].concat())
    };
    for (file, seed, expected) in [
        (&own, None, None),
        (&own, Some("5"), None),
        (&own, Some("6"), Some("was made with seed 5: the truth is that of")),
        // What comes over a wire tells no seed: the scene's own is 1.
        (&live, None, Some("does not tell its seed: the truth is that of")),
        (&live, Some("5"), None),
    ] {
        let (told, said) = asked(file, &seed.map_or(vec![], |seed| vec!["--seed", seed]));
        assert!(!truths(&told).is_empty(), "{file} {seed:?}: {said}");
        match expected {
            Some(words) => assert_says(&said, &[words, &format!("with seed {}", seed.unwrap_or("1"))]),
            None => assert!(!said.contains("the truth is that of"), "{said}"),
        }
    }
    let (right, wrong) = (asked(&live, &["--seed", "5"]).0, asked(&live, &[]).0);
    assert_ne!(truths(&right), truths(&wrong), "seeds 5 and 1 are two orchards");
}

/// What a table has no place for is said when it is written.
#[test]
fn an_export_without_the_encoder_says_so() {
    let (_folder, file) = folder();
    let rig = file("row.toml");
    let (recorded, plain) = (file("encoder.mcap"), file("plain.mcap"));
    let (_emulator, source) = emulated(&rig, "lms111", "max");
    estimated(&[&source, "--rig", &rig, "--scans", "20", "--record", &recorded]);
    // `record` sets no encoder.
    let (_emulator, source) = emulated(&rig, "lms111", "max");
    run(&["record", &source, "-o", &plain, "--scans", "20"]);
    for (recorded, what, is_said) in
        [(&recorded, "scans", true), (&recorded, "points", false), (&plain, "scans", false)]
    {
        let exported = file(&format!("{what}.csv"));
        let ended = run(&["export", recorded, "--to", "csv", "--what", what, "-o", &exported]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        assert_eq!(ended.stderr.contains("no place for the encoder's readings"), is_said, "{}", ended.stderr);
    }
}

/// Where nobody gives a rig, that of the recording measures; where there is none at all, areas are unknown and what says something of a rig is refused.
#[test]
fn the_rig_that_a_recording_keeps_measures_where_none_is_given() {
    let (_folder, file) = folder();
    let (rig, kept, bare) = (file("row.toml"), file("kept.mcap"), file("bare.mcap"));
    let (_emulator, source) = emulated(&rig, "lms111", "20");
    for (to, with) in [(&kept, &["--rig", rig.as_str()][..]), (&bare, &[])] {
        let ended = run(&[&["record", &source, "-o", to, "--scans", "60"], with].concat());
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    }
    let (told, said) = estimated(&[&kept]);
    assert_says(&said, &["no --rig: by the rig that", "kept.mcap keeps"]);
    let (asked, _) = estimated(&[&kept, "--rig", &rig]);
    for key in ["impacted_total_area_m2", "leaf_area_contact_raw_m2", "scanned_m", "mount"] {
        assert_eq!(told[key], asked[key], "{key}");
        assert!(!told[key].is_null(), "{key}");
    }
    let (last, _) = estimated(&[&kept, "--echo", "last"]);
    assert_eq!(last["scans"], told["scans"]);
    let (unknown, said) = estimated(&[&bare]);
    assert!(unknown["impacted_total_area_m2"].is_null(), "{unknown}");
    assert_says(&said, &["no rig given", "--rig"]);
    for of_rig in [["--echo", "last"], ["--optics", "ideal"], ["--profile", "0.25"], ["--map", "row.geojson"]]
    {
        let ended = run(&[&["estimate", &bare], &of_rig[..]].concat());
        assert_eq!(ended.code, Some(2), "{of_rig:?}: {}", ended.stderr);
        assert_says(&ended.stderr, &[of_rig[0], "no recording here keeps one", "--rig"]);
    }
}

/// A source is the scanner of the rig that its recording says, whatever its place among the sources, with a rig and without.
#[test]
fn a_recorded_scanner_is_read_by_its_own_mount() {
    let (_folder, file) = folder();
    let (rig, both, second) = (file("two.toml"), file("both.mcap"), file("second.mcap"));
    let scene = "version = 2\n[orchard]\ntrees = 2\n[orchard.tree]\niterations = 7\n[[rig.scanner]]\ndistance_m = 1.4\n\
                 [[rig.scanner]]\ndistance_m = 2.4\n";
    std::fs::write(&rig, scene).expect("written");
    let tcp = "127.0.0.1:0";
    let args = [&rig, "--scanner", "0", "--scanner", "1", "--tcp", tcp, "--tcp", tcp, "--time-scale", "20"];
    let mut emulator = Telling::start("emulate", &args);
    let sources = [(); 2].map(|()| format!("tcp://{}", emulator.address()));
    let [first, other] = sources.each_ref().map(String::as_str);
    for (to, from) in [
        (&both, &[first, other, "--scanner", "0", "--scanner", "1"][..]),
        (&second, &[other, "--scanner", "1"]),
    ] {
        let args = [&["estimate", "--rig", &rig, "--scans", "60", "--record", to], from].concat();
        let ended = run(&args);
        assert!(matches!(ended.code, Some(0 | 1)), "{}", ended.stderr);
    }
    // `record` does not know which one it hears, and a rig of two does not tell.
    let untold = file("untold.mcap");
    assert_eq!(run(&["record", other, "-o", &untold, "--rig", &rig, "--scans", "20"]).code, Some(0));
    let ended = run(&["estimate", &untold]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert_says(&ended.stderr, &["the kept rig has 2 scanners", "--scanner"]);
    let distances = |told: &Value| -> Vec<f64> {
        let of = |told: &Value| told["mount"]["distance_m"].as_f64().unwrap_or_else(|| panic!("{told}"));
        told["scanners"].as_array().map_or_else(|| vec![of(told)], |all| all.iter().map(of).collect())
    };
    let (left, right) = (format!("{both}#scanner0"), format!("{both}#scanner1"));
    for (sources, expected) in [
        (&[&left][..], &[1.4][..]),
        (&[&right], &[2.4]),
        (&[&right, &left], &[2.4, 1.4]),
        (&[&left, &right], &[1.4, 2.4]),
        (&[&second], &[2.4]),
    ] {
        for with in [&[][..], &["--rig", rig.as_str()]] {
            let args: Vec<&str> =
                sources.iter().map(|source| source.as_str()).chain(with.iter().copied()).collect();
            let (told, said) = estimated(&args);
            assert_eq!(distances(&told), expected, "{args:?}: {said}");
        }
        // The user decides.
        let args: Vec<&str> = sources.iter().flat_map(|source| [source.as_str(), "--scanner", "0"]).collect();
        assert!(distances(&estimated(&args).0).iter().all(|found| *found == 1.4), "{args:?}");
    }
}
