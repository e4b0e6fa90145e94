//! Which way a roof looks: where each device angle points, by the definition of the angle alone, in files of either version; and what a user is
//! told of files whose words meant something else.

use std::path::Path;

use rowscan_emulator::offline::Offline;
use rowscan_emulator::stage::Stage;
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::model;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::Scan;
use rowscan_recording::{About, Recording, copy};
use rowscan_scenes::files::{rig_from_text, rig_text, scene_from_text};
use rowscan_scenes::{Leaf, Orchard};
use serde_json::Value;

use crate::common::binary::{assert_says, refused, run, text};

type Vector = [f64; 3];

// Of the tractor.
const RIGHT: Vector = [1.0, 0.0, 0.0];
const AHEAD: Vector = [0.0, 1.0, 0.0];
const UP: Vector = [0.0, 0.0, 1.0];

fn minus(a: Vector) -> Vector {
    a.map(|part| -part)
}

fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn cross([a, b, c]: Vector, [x, y, z]: Vector) -> Vector {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

/// A way to sit, in the words of a file.
#[derive(Clone, Copy, Debug)]
struct Sits {
    orientation: &'static str,
    row: &'static str,
    roof: Option<&'static str>,
    version: Option<u32>,
}

impl Sits {
    fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for orientation in ["side", "up"] {
            for row in ["right", "left"] {
                for roof in [None, Some("forward"), Some("backward")] {
                    for version in [None, Some(1), Some(2)] {
                        all.push(Self { orientation, row, roof, version });
                    }
                }
            }
        }
        all
    }

    fn file(&self) -> String {
        let version = self.version.map_or(String::new(), |version| format!("version = {version}\n"));
        let roof = self.roof.map_or(String::new(), |roof| format!("roof = \"{roof}\"\n"));
        let Self { orientation, row, .. } = self;
        format!("{version}[[rig.scanner]]\norientation = \"{orientation}\"\nrow = \"{row}\"\n{roof}")
    }

    /// Where the device looks: at the row, or at the sky.
    fn device_ahead(&self) -> Vector {
        match (self.orientation, self.row) {
            ("up", _) => UP,
            (_, "right") => RIGHT,
            _ => minus(RIGHT),
        }
    }

    /// Where device angle 0° points.
    fn device_right(&self) -> Vector {
        let roof = match (self.version, self.orientation, self.roof) {
            // Version 1 told nothing of the housing: 0° points down or up, and to the tractor's right of a device that looks at the sky.
            (None | Some(1), "side", Some("forward")) => return minus(UP),
            (None | Some(1), "side", Some("backward")) => return UP,
            (None | Some(1), "up", Some(_)) => return RIGHT,
            (_, _, Some("forward")) => AHEAD,
            (_, _, Some("backward")) => minus(AHEAD),
            // Without a word, as in all versions.
            (_, "up", _) => return RIGHT,
            _ => return minus(UP),
        };
        cross(self.device_ahead(), roof)
    }

    /// The device angle at which a post in this direction stands, degrees: counted from the device's right over its ahead.
    fn alpha_deg(&self, post: Vector) -> f64 {
        dot(post, self.device_ahead()).atan2(dot(post, self.device_right())).to_degrees()
    }

    /// What is warned of: the word that version 2 has, where it is another.
    fn warning(&self) -> Option<String> {
        let word = self.roof.filter(|_| self.version != Some(2))?;
        let roof = cross(self.device_right(), self.device_ahead());
        let means = if dot(roof, AHEAD) > 0.0 { "forward" } else { "backward" };
        (word != means).then(|| {
            format!(
                "scanner 0: `roof = \"{word}\"` in version 1 means what version 2 calls `roof = \"{means}\"`"
            )
        })
    }
}

/// The directions of the posts around the mirror.
const POSTS: [Vector; 4] = [RIGHT, [-1.0, 0.0, 0.0], UP, [0.0, 0.0, -1.0]];

fn read(sits: Sits) -> (Rig, Vec<String>) {
    let mut told = Vec::new();
    let rig = rig_from_text(&sits.file(), |old| told.push(old.to_string())).expect("sound");
    (rig, told)
}

#[test]
fn the_beam_that_meets_a_post_is_the_one_that_points_there() {
    let mut warned = 0;
    for sits in Sits::all() {
        let (rig, told) = read(sits);
        assert_eq!(told, sits.warning().into_iter().collect::<Vec<_>>(), "{sits:?}");
        warned += told.len();
        let mount = &rig.scanners[0];
        for post in POSTS {
            // The scene's X points to the row, so θ of what is on the far side of the row is 0.
            let to_row = if sits.row == "right" { RIGHT } else { minus(RIGHT) };
            let theta_deg = dot(post, UP).atan2(dot(post, to_row)).to_degrees();
            let off_deg = mount.theta_deg(sits.alpha_deg(post)) - theta_deg;
            assert!(off_deg.rem_euclid(360.0) == 0.0, "{sits:?}, post {post:?}: off by {off_deg}");
        }
        let roof = cross(sits.device_right(), sits.device_ahead());
        assert_eq!(mount.roof_sense(), dot(roof, AHEAD), "{sits:?}");
        // What is written is read as it was meant, without a word.
        let again = rig_from_text(&rig_text(&rig).expect("TOML"), |old| panic!("{sits:?}: {old}"));
        assert_eq!(again, Ok(rig), "{sits:?}");
    }
    // Both words of a side mount that looks right, `forward` of both up mounts; of version 1 by its number and without one.
    assert_eq!(warned, 2 * (2 + 2));
}

/// A scan from the middle of thin strips, 1 m away from the mirror.
fn seen(sits: Sits) -> Scan {
    let scene = sits.file().replace("version = 1\n", "").replace("version = 2\n", "");
    let version = sits.version.expect("a scene has one");
    let text = format!(
        "version = {version}\n[orchard]\nrows = 2\ntrees = 1\n[rig]\nspeed_m_s = 0\nstart_m = 2\n{scene}"
    );
    let mut scene = scene_from_text(&text, |_| {}).expect("sound");
    // Out of reach of the ground.
    scene.rig.scanners[0].height_m = 60.0;
    let mount = scene.rig.scanners[0].clone();
    // The row is at X = 0, and the tractor drives beside it towards +Y.
    let x_m = if sits.row == "right" { -mount.distance_m } else { mount.distance_m };
    let strips = POSTS.map(|post| {
        let across = cross(post, AHEAD).map(|part| 0.02 * part);
        let corner = |y_m: f64, side: f64| {
            let at = |i: usize| post[i] + side * across[i];
            [x_m + at(0), y_m, mount.height_m + at(2)]
        };
        let corners = vec![corner(0.0, -1.0), corner(4.0, -1.0), corner(4.0, 1.0), corner(0.0, 1.0)];
        Leaf::new(corners).expect("a strip")
    });
    let stage = Stage::of_orchard(scene, Orchard::from_organs(strips.to_vec(), Vec::new(), 4.0));
    let (device, view) = stage.scanner(0, model::by_name("lms111").expect("known")).expect("it fits");
    let mut offline = Offline::new(device, view);
    offline.set_up(ColaConfig::default()).expect("taken");
    let mut scan = Scan::default();
    assert!(offline.scan_into(&mut scan).expect("a scan"));
    scan
}

#[test]
fn an_emulated_scanner_sees_posts_where_its_roof_turns_them() {
    for sits in Sits::all().into_iter().filter(|sits| sits.version.is_some()) {
        let scan = seen(sits);
        // As far as the field of an LMS111 goes, a strip is 2.3° wide.
        let angles = POSTS.map(|post| (sits.alpha_deg(post) + 45.0).rem_euclid(360.0) - 45.0);
        let in_field = |angle_deg: &f64| *angle_deg <= 225.0;
        let mut met = 0;
        for beam in 0..scan.beams.len() {
            let (angle_deg, range_m) = (scan.beams.angle_deg(beam), scan.echoes[0].range_m[beam]);
            let nearest =
                angles.map(|post| (post - angle_deg).abs()).into_iter().fold(f64::INFINITY, f64::min);
            assert_eq!(range_m.is_finite(), nearest < 1.2, "{sits:?}: {range_m} m at {angle_deg}°");
            met += usize::from(range_m.is_finite());
        }
        let posts = angles.iter().filter(|angle| in_field(angle)).count();
        assert!(posts == 3 && met >= 4 * posts, "{sits:?}: {met} beams met {posts} posts of {angles:?}");
    }
}

const OLD_RIG: &str = "[rig]\nrow_spacing_m = 4\n[[rig.scanner]]\nroof = \"forward\"\n";
const SAYS: &str = "scanner 0: `roof = \"forward\"` in version 1 means what version 2 calls `roof = \"backward\"`; \
                    write that, and `version = 2`";

/// The lines of a command that warn.
fn warnings(stderr: &str) -> Vec<&str> {
    stderr.lines().filter(|line| line.contains("in version 1 means")).collect()
}

/// One telegram of an LMS111 in a file.
fn telegram(path: &Path) {
    let scan = "sSN LMDscandata 1 1 16F4C7A 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0";
    let mut bytes = Vec::new();
    rowscan_protocol::frame::encode(rowscan_protocol::frame::Dialect::A, scan.as_bytes(), &mut bytes);
    std::fs::write(path, bytes).expect("written");
}

#[test]
fn every_command_that_reads_an_old_roof_says_what_it_is_called_now() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, content: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("written");
        text(&path).to_owned()
    };
    let rig = file("rig.toml", OLD_RIG);
    let scene = format!("version = 1\n[orchard]\ntrees = 1\n[orchard.tree]\niterations = 5\n{OLD_RIG}");
    let scene = file("scene.toml", &scene);
    let study = file(
        "study.toml",
        "version = 1\nscene = \"scene.toml\"\nkeep = [\"truth.leaf_area_m2\"]\n[[sweep]]\nkey = \"rig.scanner.height_m\"\nvalues = [1.2]\n",
    );
    let scenario = file(
        "scenario.toml",
        "version = 1\nscene = \"scene.toml\"\nend = { s = 1 }\nrepeat = { seeds = 2 }\n[[device]]\nid = \"left\"\nmodel = \"lms111\"\n\
         [[run]]\nid = \"sut\"\ncommand = [\"true\"]\n[[expect]]\nwhat = \"exit_code\"\n",
    );
    let (bytes, out) = (folder.path().join("scans.bin"), folder.path().join("out"));
    telegram(&bytes);
    let (bytes, out) = (text(&bytes), text(&out));
    for args in [
        &["rig", "check", &rig][..],
        &["rig", "show", &rig],
        &["rig", "check", &scene],
        &["scene", "check", &scene],
        &["scene", "show", &scene],
        &["orchard", "truth", &scene],
        &["scan", &scene],
        &["study", "run", &study],
        &["estimate", bytes, "--rig", &rig],
        &["export", bytes, "--rig", &rig, "--what", "points", "--to", "csv", "-o", "-"],
        &["record", bytes, "--rig", &rig, "-o", out],
        &["check", &scenario],
    ] {
        let ended = run(args);
        let told = warnings(&ended.stderr);
        assert_eq!(told.len(), 1, "{args:?}: {}", ended.stderr);
        assert!(told[0].ends_with(&format!(".toml: {SAYS}")), "{args:?}: {}", told[0]);
    }
    // Told what to write, the user writes it and hears no more; the angles stay.
    let new = file("new.toml", &format!("version = 2\n{}", OLD_RIG.replace("forward", "backward")));
    let shown = run(&["rig", "show", &new]);
    assert_eq!((shown.code, shown.stderr.as_str()), (Some(0), ""));
    let words = |shown: &str| shown.lines().find(|line| line.starts_with("scanner 0")).map(str::to_owned);
    let old = run(&["rig", "show", &rig]).stdout;
    assert_eq!(words(&shown.stdout), words(&old));
    assert_says(&old, &["roof backward (0° points down, angles grow upwards), row on the right"]);
    let wrong = file("three.toml", &format!("version = 3\n{OLD_RIG}"));
    assert_says(&refused(&["rig", "check", &wrong]), &["three.toml: version must be 1 or 2, found 3"]);
}

#[test]
fn a_recording_keeps_the_angles_of_its_rig_whenever_it_was_made() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let (bytes, rig, new) = (path("scans.bin"), path("rig.toml"), path("new.mcap"));
    telegram(&bytes);
    std::fs::write(&rig, OLD_RIG).expect("written");
    let recorded = run(&["record", text(&bytes), "--rig", text(&rig), "-o", text(&new)]);
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    let info = run(&["record", "--info", text(&new), "--format", "json"]).stdout;
    let info: Value = serde_json::from_str(&info).expect("JSON");
    let kept = info["rig"].as_str().expect("its rig");
    assert!(kept.starts_with("version = 2\n") && kept.contains("roof = \"backward\""), "{kept}");
    // As it was written before there was a version 2.
    let about = About {
        rig: Some("speed_m_s = 1.0\n[[scanner]]\nmodel = \"lms111\"\nroof = \"forward\"\n".to_owned()),
        ..About::default()
    };
    let old = path("old.mcap");
    let mut out = std::fs::File::create(&old).expect("made");
    copy(Recording::open(&bytes).expect("opened"), None, &mut out, about, Default::default())
        .expect("copied");
    // There is no metre 1 in them; their rig was read to find out.
    let told = |recording: &Path| {
        let ended = run(&["replay", text(recording), "--model", "lms111", "--from", "metre:1"]);
        assert_says(&ended.stderr, &["there is no metre 1"]);
        ended.stderr
    };
    assert!(warnings(&told(&new)).is_empty());
    let of_old = told(&old);
    let [warning] = warnings(&of_old)[..] else { panic!("{of_old}") };
    assert_says(warning, &["old.mcap: its rig: scanner 0: `roof = \"forward\"`", "`roof = \"backward\"`"]);
}
