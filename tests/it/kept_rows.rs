//! Rows that an earlier study did: every number is the one of a run that keeps none, and what is new is done.

use crate::common;

use std::path::{Path, PathBuf};

use common::binary::{Ended, run, text};

/// A row that every study does in little time.
const SCENE: &str = r#"
version = 2
name = "small"

[orchard]
trees = 6
[orchard.tree]
iterations = 6

[rig]
speed_m_s = 4.0
calibration = "spindle"
[[rig.scanner]]
model = "lms111"
"#;

const CLASSES: &str = r#"
version = 1
scene = "small.toml"

[[axis]]
name = "leaf_angle"
[[axis.class]]
name = "as grown"
[[axis.class]]
name = "told too far"
told = { "rig.scanner.distance_m" = 2.4 }
"#;

const SWEEP: &str = r#"
version = 1
name = "heights"
scene = "small.toml"
repeats = 2
keep = ["truth.leaf_area_m2", "error.voxel.leaf_area_m2", "contact.leaf_area_m2", "estimate.scans"]

[[sweep]]
key = "rig.speed_m_s"
values = [3.0, 4.0]

[[sweep]]
key = "rig.scanner.height_m"
values = [1.4, 1.6]
"#;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        folder.write("small.toml", SCENE);
        folder.write("classes.toml", CLASSES);
        folder.write("sweep.toml", SWEEP);
        folder
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: &str) {
        std::fs::write(self.at(name), content).expect("written");
    }

    /// `study` and the words, of which those that end in `.toml` are files of this folder.
    fn study(&self, words: &str) -> Ended {
        let words: Vec<String> = words
            .split_whitespace()
            .map(
                |word| {
                    if word.ends_with(".toml") { text(&self.at(word)).to_owned() } else { word.to_owned() }
                },
            )
            .collect();
        let words: Vec<&str> = std::iter::once("study").chain(words.iter().map(String::as_str)).collect();
        let ended = run(&words);
        assert_eq!(ended.code, Some(0), "{words:?}: {}", ended.stderr);
        ended
    }

    /// The same with rows kept.
    fn kept(&self, words: &str) -> Ended {
        self.study(&format!("{words} --keep {}", text(&self.at("rows"))))
    }
}

/// Kept and done, as the run says.
fn counts(ended: &Ended) -> (usize, usize) {
    let line = ended.stderr.lines().find(|line| line.starts_with("rows: ")).expect("a line");
    let number =
        |text: &str| text.split_whitespace().next().and_then(|word| word.parse().ok()).expect("a number");
    let (kept, done) = (line.strip_prefix("rows: "), line.rsplit(", ").next());
    (number(kept.expect("rows")), number(done.expect("done")))
}

#[test]
fn every_study_gives_the_numbers_of_a_run_without_kept_rows_to_the_last_byte() {
    let folder = Folder::new();
    for (words, rows) in [
        ("accuracy small.toml --seeds 1..3 --lai 0.8..2 --format json", 3),
        ("calibration small.toml --seeds 1..4 --lai 0.8..2", 4),
        ("calibration small.toml --seeds 1..4 --lai 0.8..2 --wood", 4),
        ("estimators small.toml --seeds 1..2 --format json", 2),
        ("budget small.toml --seeds 1..1 --format json", 1),
        ("eye small.toml --seeds 1..2 --model lms111 --distance 2 --format json", 2),
        ("pieces small.toml --seeds 1..1 --model lms111 --distance 2 --format json", 2),
        ("sides small.toml --seeds 1..2 --model lms111 --format json", 4),
        ("physics small.toml --seeds 1..1 --model lms111 --distance 2 --format json", 1),
        ("coverage --classes classes.toml --rows 2 --format json", 4),
        ("transfer --classes classes.toml --rows 6 --format json", 12),
        ("run sweep.toml --format json", 8),
        (
            "areas --iterations 7,8 --shady 60,101 --trees 1 --dy 0.05 --pitch 0.05 --dtheta 1 --format json",
            4,
        ),
        ("resolution --orchards 1 --trees 1 --advances-mm 50,100 --angles 2 --format json", 1),
    ] {
        let straight = folder.study(words);
        let first = folder.kept(words);
        let second = folder.kept(words);
        assert_eq!(first.stdout, straight.stdout, "{words}");
        assert_eq!(second.stdout, straight.stdout, "{words}");
        assert_eq!((counts(&first), counts(&second)), ((0, rows), (rows, 0)), "{words}");
        assert!(!straight.stderr.contains("rows: "), "{words}");
    }
}

#[test]
fn a_study_that_grew_does_only_what_is_new() {
    let folder = Folder::new();
    assert_eq!(counts(&folder.kept("accuracy small.toml --seeds 1..2 --format csv")), (0, 2));
    let more = "accuracy small.toml --seeds 1..4 --format csv";
    let grown = folder.kept(more);
    assert_eq!(counts(&grown), (2, 2), "more seeds");
    assert_eq!(grown.stdout, folder.study(more).stdout);

    assert_eq!(counts(&folder.kept("run sweep.toml --format csv")), (0, 8));
    folder.write(
        "sweep.toml",
        &SWEEP.replace("[1.4, 1.6]", "[1.3, 1.4, 1.6]").replace("[3.0, 4.0]", "[4.0, 3.0]"),
    );
    let grown = folder.kept("run sweep.toml --format csv");
    assert_eq!(counts(&grown), (8, 4), "a height more, wherever it stands");
    assert_eq!(grown.stdout, folder.study("run sweep.toml --format csv").stdout);

    assert_eq!(counts(&folder.kept("coverage --classes classes.toml --rows 1 --format csv")), (0, 2));
    folder.write(
        "classes.toml",
        &format!("{CLASSES}[[axis.class]]\nname = \"faster\"\nset = {{ \"rig.speed_m_s\" = 5.0 }}\n"),
    );
    let grown = folder.kept("coverage --classes classes.toml --rows 2 --format csv");
    assert_eq!(counts(&grown), (2, 4), "a class more, and a row of each");
    assert_eq!(grown.stdout, folder.study("coverage --classes classes.toml --rows 2 --format csv").stdout);
}

#[test]
fn shards_share_kept_rows_and_what_was_damaged_is_said_and_done_anew() {
    let folder = Folder::new();
    let one = folder.at("1.json");
    folder.kept(&format!("run sweep.toml --shard 1/2 --output {}", text(&one)));
    let straight = folder.study("run sweep.toml --format csv");
    let whole = folder.kept("run sweep.toml --format csv");
    assert_eq!((counts(&whole), &whole.stdout), ((4, 4), &straight.stdout));

    let rows: Vec<PathBuf> = paths(&folder.at("rows"));
    assert_eq!(rows.len(), 8);
    let content = std::fs::read(&rows[0]).expect("a row");
    std::fs::write(&rows[0], &content[..content.len() - 20]).expect("damaged");
    let again = folder.kept("run sweep.toml --format csv");
    assert_eq!((counts(&again), &again.stdout), ((7, 1), &straight.stdout));
    let told = "kept rows that could not be used, done anew: 1, the first: ";
    assert!(again.stderr.contains(told) && again.stderr.contains("is cut off"), "{}", again.stderr);
}

#[test]
fn another_calibration_or_scene_is_no_answer() {
    let folder = Folder::new();
    let fitted = |seeds: &str, to: &str| {
        folder.study(&format!("calibration small.toml --lai 0.8..2 --seeds {seeds} -o {to}"))
    };
    fitted("1..4", "own.toml");
    folder.write("small.toml", &SCENE.replace("\"spindle\"", &format!("{:?}", text(&folder.at("own.toml")))));
    let study = "coverage --classes classes.toml --rows 2 --format json";
    let first = folder.kept(study);
    assert_eq!((counts(&first), counts(&folder.kept(study))), ((0, 4), (4, 0)));
    fitted("11..15", "own.toml");
    let other = folder.kept(study);
    assert_eq!(counts(&other), (0, 4), "the same name, another content");
    assert_eq!(other.stdout, folder.study(study).stdout);
    assert_ne!(other.stdout, first.stdout);
    folder.write("small.toml", &SCENE.replace("iterations = 6", "iterations = 7"));
    assert_eq!(counts(&folder.kept(study)), (0, 4), "another scene");

    folder.write("file", "no folder");
    let refused = run(&["study", "run", text(&folder.at("sweep.toml")), "--keep", text(&folder.at("file"))]);
    assert!(
        refused.code == Some(2) && refused.stderr.contains("rows cannot be kept there"),
        "{}",
        refused.stderr
    );
}

#[test]
fn classes_that_are_the_same_are_done_once() {
    let folder = Folder::new();
    let twice = "\n[[axis]]\nname = \"season\"\n[[axis.class]]\nname = \"full leaf\"\n";
    let bloom = "[[axis.class]]\nname = \"bloom\"\nset = { \"orchard.season\" = \"bloom\" }\n";
    folder.write("classes.toml", &format!("{CLASSES}{twice}{bloom}"));
    let study = "coverage --classes classes.toml --rows 2 --format json";
    let found = folder.kept(study);
    assert_eq!(counts(&found), (0, 6), "eight rows, two of them again");
    let report: serde_json::Value = serde_json::from_str(&found.stdout).expect("json");
    let row = |class: &str| {
        let rows = report["rows"].as_array().expect("rows");
        let mut row = rows.iter().find(|row| row["class"] == class).expect(class).clone();
        (row["n"].take(), row["bias"].take(), row["rmse"].take())
    };
    assert_eq!(row("full leaf"), row("as grown"));
    assert_ne!(row("full leaf"), row("told too far"));
    // In parts, where the two stand in different ones, the rows are the same.
    let files = ["1", "2"].map(|part| {
        let file = folder.at(&format!("{part}.json"));
        let shard =
            format!("coverage --classes classes.toml --rows 2 --shard {part}/2 --output {}", text(&file));
        folder.study(&shard);
        file
    });
    let merged = run(&["study", "merge", text(&files[0]), text(&files[1]), "--format", "json"]);
    assert_eq!(merged.stdout, found.stdout);
}

fn paths(folder: &Path) -> Vec<PathBuf> {
    std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()).collect()
}
