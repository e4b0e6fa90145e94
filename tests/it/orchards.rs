//! Orchards on the command line: what is made, written, read back, drawn, and refused.

use crate::common;

use std::path::{Path, PathBuf};

use common::binary::{self, assert_says, run};

/// A folder with files in it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, content) in files {
            std::fs::write(folder.path().join(name), content).expect("written");
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("UTF-8").to_owned()
    }
}

fn done(args: &[&str]) -> String {
    let ended = run(args);
    assert_eq!(ended.code, Some(0), "{args:?}: {}", ended.stderr);
    ended.stdout
}

fn refused(args: &[&str], parts: &[&str]) {
    assert_says(&binary::refused(args), parts);
}

fn read(path: &str) -> Vec<u8> {
    std::fs::read(path).expect("it was written")
}

/// A small row of every kind of organ: wall of leaves, wood, posts and wires.
const SMALL: &str =
    "version = 1\n[orchard]\npreset = 'fruiting_wall'\ntrees = 2\n[orchard.tree]\niterations = 7\n";

#[test]
fn text_goes_out_and_in_and_out_to_the_byte() {
    let folder = Folder::with(&[("row.toml", SMALL)]);
    let (scene, one, two) = (folder.path("row.toml"), folder.path("one"), folder.path("two"));
    done(&["orchard", "export", &scene, "--output", &one, "--write", "text,gltf"]);
    let [branches, leaves] = ["_branches.txt", "_leaves.txt"].map(|end| format!("{one}{end}"));
    done(&["orchard", "import", "--branches", &branches, "--leaves", &leaves, "--output", &two]);
    assert!(read(&leaves).len() > 10_000);
    assert!(read(&branches) == read(&format!("{two}_branches.txt")));
    assert!(read(&leaves) == read(&format!("{two}_leaves.txt")));
    assert!(read(&format!("{one}.glb")).starts_with(b"glTF"));
}

#[test]
fn meshes_go_round_and_a_scene_may_plant_them() {
    let folder = Folder::with(&[
        ("row.toml", SMALL),
        (
            "planted.toml",
            "version = 1\n[orchard]\ngenerator = 'import'\ntrees = 3\n[orchard.import]\nmesh = 'one.ply'\nstands = 'in_place'\n",
        ),
    ]);
    let (scene, one, two) = (folder.path("row.toml"), folder.path("one"), folder.path("two"));
    done(&["orchard", "export", &scene, "--output", &one, "--write", "obj,ply"]);
    for ending in [".obj", ".ply"] {
        let (first, second) = (format!("{one}{ending}"), format!("{two}{ending}"));
        done(&["orchard", "import", "--mesh", &first, "--output", &two, "--write", &ending[1..]]);
        done(&["orchard", "import", "--mesh", &second, "--output", &one, "--write", &ending[1..]]);
        // But for the name of the library of materials.
        let faces = |path: &str| {
            let content = read(path);
            let lines = content.split(|byte| *byte == b'\n').filter(|line| !line.starts_with(b"mtllib"));
            lines.map(<[u8]>::to_vec).collect::<Vec<_>>()
        };
        assert!(faces(&first) == faces(&second), "{ending}: from a mesh to the byte");
    }
    // Paths count from the scene file's folder.
    let json = done(&["orchard", "truth", &folder.path("planted.toml"), "--format", "json"]);
    let truth: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let grown = done(&["orchard", "truth", &scene, "--format", "json"]);
    let grown: serde_json::Value = serde_json::from_str(&grown).expect("JSON");
    for key in ["leaf_area_m2", "wood_area_m2", "post_area_m2"] {
        let (read, made) = (truth[key].as_f64().expect(key), grown[key].as_f64().expect(key));
        assert!((read / made - 1.0).abs() < 1e-3, "{key}: {read} {made}");
    }
}

#[test]
fn files_that_hold_no_tree_are_refused() {
    let import = |flag: &str, name: &str, content: &str, parts: &[&str]| {
        let folder = Folder::with(&[(name, content)]);
        let path = folder.path(name);
        refused(&["orchard", "import", flag, &path], &[&[path.as_str()], parts].concat());
    };
    import("--branches", "b.txt", "0 0 0 0 0 nan 0.1\n", &[":1:", "not a finite number"]);
    import("--branches", "b.txt", "# x\n1 1 1 1 1 1 0.1\n", &[":2:", "coincide"]);
    import("--branches", "b.txt", "0 0 0 0 0 1 -0.1\n", &[":1:", "positive number of metres", "-0.05"]);
    import("--leaves", "l.txt", "2 0 0 0 1 1 1\n", &[":1:", "3 vertices or more, found 2"]);
    import("--leaves", "l.txt", "3 0 0 0 1 1 1 2 2 2\n", &[":1:", "no area"]);
    import("--mesh", "t.obj", "v 0 0 0\nusemtl leaf\nf 1 2 3\n", &[":3:", "a vertex from 1 to 1", "`2`"]);
    import(
        "--mesh",
        "t.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl chrome\nf 1 2 3\n",
        &[":5:", "unknown material `chrome`", "leaf,"],
    );
    import("--mesh", "t.ply", "solid\n", &["t.ply"]);
    import("--mesh", "t.stl", "solid\n", &[".obj or .ply"]);
    let bent = "4 0 0 1 1 0 1 1 1 1.2 0 1 1\n";
    let folder = Folder::with(&[("l.txt", bent)]);
    let path = folder.path("l.txt");
    refused(
        &["orchard", "import", "--leaves", &path, "--not-plane", "refuse"],
        &[":1:", "not plane: off by"],
    );
    let cut = run(&["orchard", "import", "--leaves", &path]);
    assert!(cut.code == Some(0) && cut.stderr.contains("cut into triangles"), "{}", cut.stderr);
}

#[test]
fn scenes_that_cannot_grow_are_refused() {
    let grow = |body: &str, files: &[(&str, &str)], parts: &[&str]| {
        let scene = format!("version = 1\n{body}");
        let folder = Folder::with(&[&[("row.toml", scene.as_str())], files].concat());
        refused(&["orchard", "grow", &folder.path("row.toml")], parts);
    };
    let matrix = [("p.txt", "0.5 0.2 0.2 0.2\n0 0 0 1\n0 0 0 1\n1 0 0 0\n")];
    let by_file = "[orchard.tree]\ntransitions = { file = 'p.txt' }\n";
    grow(by_file, &matrix, &["orchard.tree.transitions", "row L must sum to 1"]);
    grow(by_file, &[], &["p.txt", "No such file"]);
    grow(by_file, &[("p.txt", "a b c d\n")], &["p.txt:1: numbers expected, found `a b c d`"]);
    grow(
        "[orchard]\ngenerator = 'lsystem'\n[orchard.lsystem]\nrules = ['axiom: A', 'A -> A A']\niterations = 60\n",
        &[],
        &["exceeds 2000000 letters in season 21 of 60", "orchard.lsystem.max_symbols"],
    );
    grow("[orchard]\ngenerator = 'lsistem'\n", &[], &["row.toml:3", "did you mean `lsystem`?"]);
    grow(
        "[orchard]\nseason = 'dormant'\ntarget_lai = 1.0\n",
        &[],
        &["orchard.target_lai 1 cannot be reached"],
    );
    grow("[orchard.trellis]\nwires = 1000\n", &[], &["orchard.trellis.wires must be 0 to 100"]);
}

#[test]
fn a_row_that_was_divided_by_its_sum_is_said() {
    let scene = "version = 1\n[orchard]\ngenerator = 'hmt'\ntrees = 1\n[orchard.tree]\niterations = 3\nrenormalise = true\n\
                 transitions = [[0.5, 0.2, 0.2, 0.2], [0, 0, 0, 1], [0, 0, 0, 1], [1, 0, 0, 0]]\n";
    let folder = Folder::with(&[("row.toml", scene)]);
    let ended = run(&["orchard", "grow", &folder.path("row.toml")]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert!(ended.stderr.contains("row L sums to 1.0999"), "{}", ended.stderr);
}

#[test]
fn a_drawing_of_a_scan_goes_to_standard_output_and_repeats() {
    let draw = || done(&["orchard", "export", "gap_wall", "--svg", "-", "--scan", "lateral", "--trees", "2"]);
    let drawn = draw();
    assert!(drawn.starts_with("<svg") && drawn.matches("<g ").count() == 3);
    assert_eq!(drawn, draw());
}

/// The lines of the table that begins with `header`.
fn table<'a>(page: &'a str, header: &str) -> impl Iterator<Item = Vec<&'a str>> {
    let from = page.find(header).expect("the table is there");
    let lines = page[from..].lines().skip(2).take_while(|line| line.starts_with('|'));
    lines.map(|line| line.trim_matches('|').split(" | ").map(str::trim).collect())
}

#[test]
fn the_defaults_in_the_page_of_orchards_are_those_of_the_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/orchards.md");
    let page = std::fs::read_to_string(path).expect("the page is there");
    let json = done(&["orchard", "parameters", "paper", "--format", "json"]);
    let known: Vec<serde_json::Value> = serde_json::from_str(&json).expect("JSON");
    let mut questions = std::collections::BTreeSet::new();
    for row in table(&page, "| # | question |") {
        let [number, question, key, default, ..] = row.as_slice() else { panic!("{row:?}") };
        let key = key.trim_matches('`');
        let of = |table: &str| known.iter().find(|row| row["key"] == format!("{table}.{key}"));
        let row =
            of("orchard.tree").or_else(|| of("orchard")).unwrap_or_else(|| panic!("no parameter {key}"));
        assert_eq!(row["value"].as_str(), Some(*default), "{question}");
        questions.insert(number.parse::<u32>().expect("a number"));
    }
    assert!(questions.into_iter().eq(1..=13), "every open question has a row");
}

#[test]
fn every_generator_and_training_system_has_its_picture_and_its_numbers() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/orchards.md")).expect("the page is there");
    let known: Vec<&str> = table(&page, "| scene | trees | leaves a tree |").map(|row| row[0]).collect();
    let mut bytes = 0;
    for scene in rowscan_scenes::builtin::names() {
        assert!(known.contains(&scene), "{scene} has no row of statistics");
        let picture: PathBuf = root.join(format!("docs/orchards/{scene}.svg"));
        assert!(page.contains(&format!("orchards/{scene}.svg")), "{scene} is not shown");
        bytes += std::fs::metadata(picture).expect("a picture").len();
    }
    assert!(bytes < 500_000, "{bytes} bytes of pictures");
}
