//! The keys of the files that users write: schema, page, commented files, verdicts and drawings say the same as the readers.

use crate::common;

use std::path::{Path, PathBuf};

use common::binary::{assert_says, refused, run, text};
use rowscan::reference::{Document, Key, Kind, commented, keys, markdown};
use rowscan_scenes::files;
use rowscan_scenes::scene::VERSION;
use serde_json::{Value, json};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The TOML files of a folder.
fn toml_files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(root().join(folder)).expect("the folder is there");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("read").path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    files.sort();
    assert!(!files.is_empty(), "{folder} holds TOML files");
    files
}

/// A TOML document as a validator takes it.
fn json_of(text: &str) -> Value {
    let value: toml::Value = toml::from_str(text).expect("TOML");
    serde_json::to_value(value).expect("JSON")
}

/// What the schema says to a document: None where it is valid.
fn complaint(schema: &Value, document: &Value) -> Option<String> {
    let validator = jsonschema::draft7::new(schema).expect("a schema");
    validator.iter_errors(document).next().map(|error| format!("{}: {error}", error.instance_path()))
}

#[test]
fn every_key_is_described_and_has_a_default_or_an_example() {
    let mut count = 0;
    for document in Document::ALL {
        for key in keys(&document.schema()) {
            let place = format!("{}: {}", document.name(), key.path());
            assert!(
                key.of_faults || !key.meaning.is_empty(),
                "{place} has no description: write a doc comment on its field"
            );
            if key.kind == Kind::Value && !key.of_faults {
                let shown = key.default.is_some() || key.example.is_some();
                assert!(shown, "{place} has neither default nor example: add #[schemars(example = …)]");
            }
            count += 1;
        }
    }
    assert!(count > 300, "{count} keys");
}

#[test]
fn the_page_of_keys_is_up_to_date() {
    let path = root().join("docs/reference-keys.md");
    let kept = std::fs::read_to_string(&path).expect("the page is there");
    assert!(
        kept == markdown(),
        "docs/reference-keys.md is old: run `cargo run -- schema --markdown > docs/reference-keys.md`"
    );
}

#[test]
fn schemas_hold_for_every_file_of_the_repository() {
    let schemas: Vec<(Document, Value)> =
        Document::ALL.into_iter().map(|document| (document, document.schema())).collect();
    let schema =
        |wanted: Document| &schemas.iter().find(|(document, _)| *document == wanted).expect("there").1;
    let mut counts = [0; 7];
    for folder in [
        "sim-scenes/scenes",
        "docs/orchards",
        "docs/examples",
        "tools/scenarios",
        "tools/scenarios/sprayer",
        "study",
    ] {
        for path in toml_files(folder) {
            let document = json_of(&std::fs::read_to_string(&path).expect("read"));
            // A crate's, and what the example for clusters reads.
            let (kind, slot) = if document.get("package").is_some() || document.get("engine").is_some() {
                continue;
            } else if document.get("section").is_some() {
                (Document::Boom, 6)
            } else if document.get("axis").is_some() {
                (Document::Classes, 5)
            } else if document.get("sweep").is_some() {
                (Document::Study, 0)
            } else if document.get("knob").is_some() || document.get("seeds").is_some() {
                (Document::Search, 1)
            } else if ["expect", "device", "use"].iter().any(|key| document.get(key).is_some()) {
                (Document::Scenario, 2)
            } else if document
                .as_object()
                .is_some_and(|all| all.keys().all(|key| ["version", "name", "rig"].contains(&key.as_str())))
            {
                (Document::Rig, 4)
            } else {
                (Document::Scene, 3)
            };
            let complaint = complaint(schema(kind), &document);
            assert_eq!(complaint, None, "{} as {}", path.display(), kind.name());
            counts[slot] += 1;
        }
    }
    assert!(counts.iter().all(|count| *count > 0) && counts[2] > 20 && counts[3] > 15, "{counts:?}");
}

#[test]
fn schemas_take_scenes_and_rigs_of_both_versions() {
    for version in ["version = 1\n", "version = 2\n", ""] {
        let rig = format!("{version}name = \"mast\"\n[[rig.scanner]]\nroof = \"forward\"\n");
        assert_eq!(complaint(&Document::Rig.schema(), &json_of(&rig)), None, "{rig}");
        if !version.is_empty() {
            assert_eq!(complaint(&Document::Scene.schema(), &json_of(&rig)), None, "{rig}");
        }
    }
}

#[test]
fn what_the_reader_refuses_the_schema_refuses() {
    for (document, bad, about) in [
        (Document::Scene, "version = 1\n[orchard]\ntree_spacing = 1.5\n", "an unknown key"),
        (Document::Scene, "version = 3\n", "another version"),
        (Document::Rig, "version = 3\n[rig]\n", "another version"),
        (Document::Scene, "version = 1\n[orchard]\npreset = \"spindel\"\n", "an unknown name"),
        (Document::Scene, "version = 1\n[drive]\nslip = 1.0\n", "a number out of range"),
        (Document::Scene, "version = 1\n[[rig.scanner]]\nheight_m = \"high\"\n", "a text for a number"),
        (Document::Scene, "version = 1\n[[drive.legs]]\nseconds = 1\n", "a leg without speed"),
        (Document::Scene, "[orchard]\n", "no version"),
        (Document::Rig, "[rig]\nspeed_m_s = 1\n[[rig.scanner]]\nyaw_deg = 60\n", "a mount turned too far"),
        (
            Document::Scenario,
            "version = 1\nscene = \"spindle\"\nclock = { mode = \"fast\" }\n",
            "an unknown mode",
        ),
        (Document::Scenario, "version = 1\n[[fault]]\nname = \"flop\"\n", "an unknown fault"),
        (
            Document::Scenario,
            "version = 1\n[[fault]]\nname = \"stall\"\nbytes = 3\n",
            "another fault's parameter",
        ),
        (Document::Scenario, "version = 1\n[[expect]]\nwhat = \"scans_los\"\n", "an unknown expectation"),
        (Document::Boom, "version = 1\n", "a boom without sections"),
        (
            Document::Boom,
            "version = 1\n[[section]]\nid = \"a\"\nside = \"up\"\nz_from_m = 1\nz_to_m = 2\n",
            "a side that is none",
        ),
        (Document::Study, "version = 1\nscene = \"spindle\"\n", "a study without a sweep"),
        (Document::Search, "version = 1\nscene = \"paper\"\n", "a search without seeds"),
        (
            Document::Classes,
            "version = 1\nscene = \"paper\"\n[[axis]]\nname = \"a\"\n",
            "an axis without classes",
        ),
    ] {
        assert!(
            complaint(&document.schema(), &json_of(bad)).is_some(),
            "{}: {about} passes the schema",
            document.name()
        );
        if matches!(document, Document::Scene) {
            assert!(files::scene_from_text(bad, |_| {}).is_err(), "{about} passes the reader");
        }
    }
}

/// Sets one key of a scene, with the tables on the way.
fn with_key(key: &Key, value: f64, all: &[Key]) -> Value {
    let whole = key.takes == "integer";
    let mut set = if whole { json!(value as i64) } else { json!(value) };
    let mut name = key.name.clone();
    let mut table = key.table.clone();
    loop {
        let mut made = json!({ name: set });
        let beside = all.iter().filter(|other| {
            other.table == table && other.required && other.kind == Kind::Value && !table.is_empty()
        });
        for other in beside.filter(|other| !(other.name == key.name && other.table == key.table)) {
            made[&other.name] = other.example.clone().expect("an example");
        }
        let Some(holder) = all.iter().find(|other| other.path() == table) else { return made };
        set = if holder.kind == Kind::Tables { json!([made]) } else { made };
        (name, table) = (holder.name.clone(), holder.table.clone());
    }
}

#[test]
fn the_ends_of_a_range_are_valid_and_what_lies_beyond_is_refused() {
    let schema = Document::Scene.schema();
    let all = keys(&schema);
    let property = |key: &Key| {
        let path: Vec<&str> =
            key.table.split('.').filter(|part| !part.is_empty()).chain([key.name.as_str()]).collect();
        path.iter().fold(&schema, |at, name| {
            let at = if at.get("items").is_some() { &at["items"] } else { at };
            &at["properties"][*name]
        })
    };
    // What the reader says of the key, whatever makes the trees: sizes of an L-system matter only to one.
    let reader = |key: &Key, value: f64| {
        for generator in ["trained", "hmt", "lsystem", "analytic"] {
            let mut document = with_key(key, value, &all);
            document["version"] = json!(VERSION);
            if key.path() != "orchard.generator" {
                document["orchard"]["generator"] = json!(generator);
            }
            let scene: Result<rowscan_scenes::Scene, _> = serde_json::from_value(document);
            let said = scene.map_err(|error| error.to_string());
            said.and_then(|scene| scene.validate().map_err(|error| error.to_string()))?;
        }
        Ok::<(), String>(())
    };
    let mut held = 0;
    for key in
        all.iter().filter(|key| key.allowed.is_some() && key.kind == Kind::Value && !key.table.is_empty())
    {
        let property = property(key);
        let (low, high) = (property["minimum"].as_f64(), property["maximum"].as_f64());
        if let Some(end) = property["exclusiveMinimum"].as_f64() {
            assert!(reader(key, end).is_err(), "{} = {end} is refused", key.path());
            held += 1;
        }
        for (end, beyond) in [(low, -1.0), (high, 1.0)] {
            let Some(end) = end else { continue };
            let past = if key.takes == "integer" {
                end + beyond
            } else {
                end + beyond * (end.abs() * 1e-9).max(1e-9)
            };
            let refusal = reader(key, past).expect_err(&format!("{} = {past} is refused", key.path()));
            assert!(!refusal.is_empty());
            // Another rule may forbid the end itself: then the refusal names that one.
            if let Err(why) = reader(key, end) {
                let words = key.allowed.as_deref().unwrap_or_default();
                assert!(
                    !why.starts_with(&format!("{} must be {words}", key.path())),
                    "{} = {end}: {why}",
                    key.path()
                );
            }
            held += 1;
        }
    }
    assert!(held > 60, "{held} ends");
}

/// The commented file with every default made live.
fn live(text: &str) -> String {
    let is_default =
        |line: &str| line.starts_with('#') && line[1..].starts_with(|c: char| c.is_ascii_lowercase());
    text.lines()
        .map(|line| if is_default(line) { format!("{}\n", &line[1..]) } else { format!("{line}\n") })
        .collect()
}

#[test]
fn a_new_scene_passes_and_means_the_default_as_it_stands_and_with_every_default_live() {
    let folder = tempfile::tempdir().expect("a folder");
    let default = files::scene_from_text("version = 2\n", |_| {}).expect("sound").spelled_out();
    let file = folder.path().join("scene.toml");
    assert_eq!(run(&["scene", "new", text(&file)]).code, Some(0));
    let written = std::fs::read_to_string(&file).expect("written");
    assert_eq!(written, commented(Document::Scene));
    for (name, content) in [("as it stands", written.clone()), ("live", live(&written))] {
        std::fs::write(&file, &content).expect("written");
        let checked = run(&["scene", "check", text(&file)]);
        assert_eq!((checked.code, checked.stderr.as_str()), (Some(0), ""), "{name}");
        assert_says(&checked.stdout, &["scene.toml: sound: spindle, 1 row(s) of", "lms111 at 1 m/s"]);
        assert_eq!(files::load_scene(text(&file), |_| {}).expect("sound").spelled_out(), default, "{name}");
    }
    assert!(live(&written).lines().filter(|line| !line.starts_with('#') && line.contains('=')).count() > 150);
    assert_says(&refused(&["scene", "new", text(&file)]), &["is there already"]);
    assert_eq!(complaint(&Document::Scene.schema(), &json_of(&live(&written))), None);
}

#[test]
fn a_new_rig_passes_and_means_the_default() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("rig.toml");
    let written = run(&["rig", "new"]).stdout;
    for content in [written.clone(), live(&written)] {
        std::fs::write(&file, content).expect("written");
        assert_eq!(run(&["rig", "check", text(&file)]).code, Some(0));
        let (rig, scene) = files::load_rig(text(&file), |_| {}).expect("sound");
        assert_eq!((rig, scene), (rowscan_protocol::rig::Rig::default(), None));
    }
    assert!(written.contains("#height_m = 1.6") && written.contains("[m; a positive number]"), "{written}");
}

#[test]
fn a_wrong_file_is_refused_with_line_key_and_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("rig.toml");
    for (content, says) in [
        ("[rig]\nspeed = 1.0\n", "rig.toml:2: unknown key `speed`; did you mean `speed_m_s`?"),
        ("[rgi]\nspeed_m_s = 1.0\n", "rig.toml:1: unknown key `rgi`; valid here: version, name, rig\n"),
        ("[rig]\n[[scanner]]\n", "rig.toml:2: unknown key `scanner`; valid here: version, name, rig\n"),
        ("speed_m_s = 1.0\n", "rig.toml:1: unknown key `speed_m_s`; valid here: version, name, rig\n"),
        // With a table of a scene it is one.
        (
            "[rig]\n[drive]\n[rgi]\n",
            "rig.toml:3: unknown key `rgi`; valid here: version, name, seed, orchard, rig",
        ),
        ("[[rig.scanner]]\norientation = \"upp\"\n", "rig.toml:2: unknown value `upp`"),
        ("[[rig.scanner]]\nheight_m = -1\n", "rig.scanner.height_m must be a positive number, found -1"),
        ("[[rig.scanner]]\nmodel = \"lms112\"\n", "scanner 0: unknown scanner model `lms112`"),
        ("[[rig.scanner]]\nahead_of_previous_m = 0.9\n", "the first has none; give `offset_y_m`"),
        (
            "[[rig.scanner]]\n[[rig.scanner]]\nahead_of_previous_m = 0.9\noffset_y_m = 1.0\n",
            "both say where the scanner sits; leave one of them out",
        ),
    ] {
        std::fs::write(&file, content).expect("written");
        assert_says(&(refused(&["rig", "check", text(&file)]) + "\n"), &[says]);
    }
    assert_says(&refused(&["scene", "check", "spindel"]), &["did you mean `spindle`?"]);
}

#[test]
fn distances_between_scanners_are_places_and_are_told_and_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("rig.toml");
    let content = "[rig]\nrow_spacing_m = 4.0\ntree_spacing_m = 1.5\n[[rig.scanner]]\noffset_y_m = 0.3\nheight_m = 1.2\n\
                   [[rig.scanner]]\nahead_of_previous_m = 0.9\nabove_previous_m = 0.5\nroll_deg = 10\n";
    std::fs::write(&file, content).expect("written");
    let (rig, _) = files::load_rig(text(&file), |_| {}).expect("sound");
    assert_eq!((rig.scanners[1].offset_y_m, rig.scanners[1].height_m), (0.3 + 0.9, 1.2 + 0.5));
    let drawing = folder.path().join("rig.svg");
    let shown = run(&["rig", "show", text(&file), "--svg", text(&drawing)]);
    assert_eq!(shown.code, Some(0), "{}", shown.stderr);
    assert_says(
        &shown.stdout,
        &[
            "scanner 1 beside scanner 0: 0.90 m ahead of it, 0.50 m above it, 1.03 m apart",
            "roll 10°",
            "1.7 m high",
        ],
    );
    let svg = std::fs::read_to_string(&drawing).expect("drawn");
    assert_says(
        &svg,
        &[
            "<svg",
            "0.90 m apart",
            "distance_m 1.9",
            "tree_spacing_m 1.5",
            "alley 0",
            ">90°<",
            ">roof<",
            "roof backward (0° points down",
        ],
    );
    let rows = run(&["rig", "show", text(&file), "--format", "csv"]).stdout;
    assert_says(
        &rows,
        &["key,value,unit,is_default", "rig.scanner[1].height_m,1.7,m,false", "rig.start_m,0.0,m,true"],
    );
}

#[test]
fn the_drawing_of_the_documents_is_up_to_date() {
    let folder = tempfile::tempdir().expect("a folder");
    let drawing = folder.path().join("rig.svg");
    let scene = root().join("docs/examples/rig.toml");
    assert_eq!(run(&["rig", "show", text(&scene), "--svg", text(&drawing)]).code, Some(0));
    let kept = std::fs::read_to_string(root().join("docs/figures/rig.svg")).expect("there");
    let drawn = std::fs::read_to_string(&drawing).expect("drawn");
    assert!(
        kept == drawn,
        "old: run `cargo run -- rig show docs/examples/rig.toml --svg docs/figures/rig.svg`"
    );
}

#[test]
fn a_scene_is_shown_with_what_its_preset_says() {
    let shown = run(&["scene", "show", "spindle", "--format", "csv"]).stdout;
    assert_says(
        &shown,
        &[
            "orchard.trees,12,,true",
            "orchard.tree.phyllotaxis_deg,144.0,°,true",
            "rig.calibration,spindle,,false",
            "rig.tree_spacing_m,1.5,m,",
        ],
    );
}

#[test]
fn a_schema_is_printed_as_json_and_names_its_draft() {
    let printed: Value = serde_json::from_str(&run(&["schema", "rig"]).stdout).expect("JSON");
    assert_eq!(printed, Document::Rig.schema());
    assert_eq!(printed["$schema"], "http://json-schema.org/draft-07/schema#");
    assert_says(&refused(&["schema", "scnee"]), &["invalid value 'scnee'"]);
}

/// The TOML blocks of a page.
fn toml_blocks(page: &str) -> Vec<String> {
    let mut blocks = Vec::new();
    let mut open: Option<String> = None;
    for line in page.lines() {
        match (&mut open, line.trim()) {
            (None, "```toml") => open = Some(String::new()),
            (Some(_), "```") => blocks.extend(open.take()),
            (Some(block), _) => *block += &format!("{line}\n"),
            (None, _) => {}
        }
    }
    blocks
}

#[test]
fn toml_in_the_documents_is_valid() {
    let schemas = Document::ALL.map(|document| {
        // A page shows a part of a file.
        let mut schema = document.schema();
        schema.as_object_mut().expect("a schema").remove("required");
        schema
    });
    let mut count = 0;
    for entry in std::fs::read_dir(root().join("docs")).expect("there") {
        let path = entry.expect("read").path();
        let Ok(page) = std::fs::read_to_string(&path) else { continue };
        for block in toml_blocks(&page) {
            let document = json_of(&block);
            // A file of classes, which has no schema yet.
            if document.get("axis").is_some() {
                continue;
            }
            let found = schemas.each_ref().map(|schema| complaint(schema, &document));
            assert!(found.iter().any(Option::is_none), "{}: {found:?} in\n{block}", path.display());
            count += 1;
        }
    }
    assert!(count >= 9, "{count} blocks");
}

#[test]
fn a_wrong_file_does_not_hide_the_next_ones() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    std::fs::write(file("a.toml"), "version = 1\nname = \"a\"\n[orchard]\ntreez = 3\n").expect("written");
    std::fs::write(file("b.toml"), "version = 1\nname = \"b\"\n[orchard]\ntrees = -3\n").expect("written");
    for last in ["spindle", "none.toml"] {
        let ended = run(&["scene", "check", text(&file("a.toml")), "spindle", text(&file("b.toml")), last]);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        assert!(ended.stdout.contains("spindle: sound"), "{}", ended.stdout);
        assert_says(&ended.stderr, &["a.toml", "trees", "b.toml", "1 or more"]);
        assert_eq!(ended.stderr.contains("none.toml"), last == "none.toml", "{}", ended.stderr);
    }
}
