//! The shipped calibrations are what their commands make.

use crate::common;

use common::binary::run;
use rowscan_canopy::{Calibration, shipped};

/// Coefficients may move in the last bits from machine to machine, and a range that sits on half a millimetre may then round the
/// other way; a thousandth is far above that and far below any change of method.
const AGREE: f64 = 1e-3;

fn assert_made_by_its_command(name: &str) {
    let shipped: Calibration = toml::from_str(shipped::text(name).expect(name)).expect(name);
    let command: Vec<&str> = shipped.provenance.command.split(' ').skip(1).collect();
    let made = run(&command);
    assert_eq!(made.code, Some(0), "{command:?}: {}", made.stderr);
    let made: Calibration = toml::from_str(&made.stdout).expect("a calibration");
    assert_eq!(made.class, shipped.class, "{name}");
    assert_eq!(made.provenance, shipped.provenance, "{name}");
    for (key, made, shipped) in [
        ("linear.a", made.linear.a_m2_per_m, shipped.linear.a_m2_per_m),
        ("linear.b", made.linear.b, shipped.linear.b),
        ("power.c", made.power.c, shipped.power.c),
        ("power.p", made.power.p, shipped.power.p),
        ("contact.k", made.contact.k, shipped.contact.k),
        ("contact.p", made.contact.p, shipped.contact.p),
        ("mean", made.training.mean_leaf_area_m2_per_m, shipped.training.mean_leaf_area_m2_per_m),
    ] {
        let off = ((made - shipped) / shipped).abs();
        assert!(
            off < AGREE,
            "{name}: {key} is {made}, shipped is {shipped}; make it again with `rowscan {}`",
            command.join(" ")
        );
    }
}

/// One of each family; all of them where `cargo xtask full` asks for that.
fn asked() -> Vec<&'static str> {
    match std::env::var_os("ROWSCAN_ALL_CALIBRATIONS") {
        Some(_) => shipped::names().collect(),
        None => vec!["paper-lms111", "paper-lms291"],
    }
}

#[test]
fn shipped_calibrations_are_what_their_commands_make() {
    asked().into_iter().for_each(assert_made_by_its_command);
}

#[test]
fn a_calibration_lies_beside_the_file_that_names_it() {
    let folder = tempfile::tempdir().expect("sound");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let rig = "version = 2\n[rig]\ncalibration = \"mine.toml\"\n[[rig.scanner]]\nmodel = \"lms111\"\n";
    std::fs::write(path("rig.toml"), rig).expect("sound");
    std::fs::write(path("scene.toml"), format!("{rig}[orchard]\ntrees = 3\n")).expect("sound");
    let named = || {
        ["rig.toml", "scene.toml"].map(|name| {
            rowscan_scenes::files::load_rig(&path(name), |_| {}).expect("sound").0.calibration.expect("sound")
        })
    };
    assert_eq!(named(), ["mine.toml", "mine.toml"], "it is not there");
    std::fs::write(path("mine.toml"), "").expect("sound");
    assert_eq!(named(), [path("mine.toml"), path("mine.toml")]);
}
