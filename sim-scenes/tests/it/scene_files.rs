//! The scene file format.

use rowscan_scenes::growth::{MatrixSource, TreeParameters};
use rowscan_scenes::orchard::Preset;
use rowscan_scenes::scene::VERSION;
use rowscan_scenes::trained::Form;
use rowscan_scenes::{GeneratorKind, Scene, SceneError, builtin};

fn read(text: &str) -> Scene {
    toml::from_str(text).unwrap()
}

fn refusal(text: &str) -> String {
    read(text).validate().unwrap_err().to_string()
}

#[test]
fn every_built_in_scene_is_valid_and_survives_a_round_trip() {
    assert_eq!(builtin::names().next(), Some(builtin::DEFAULT));
    for name in builtin::names() {
        let scene = read(builtin::text(name).unwrap());
        scene.validate().unwrap();
        assert_eq!((scene.name.as_str(), scene.seed, scene.version), (name, 1, VERSION));
        assert_eq!(read(&toml::to_string(&scene).unwrap()), scene);
        let is_preset = Preset::NAMES.contains(&name);
        assert!(!is_preset || scene.orchard.preset.to_string() == name);
    }
    assert_eq!(builtin::text("nonesuch"), None);
}

#[test]
fn a_scene_of_version_1_is_read_as_one_of_version_2_that_means_the_same() {
    let scanners = |roofs: [&str; 2]| {
        let [right, left] = roofs;
        format!(
            "[[rig.scanner]]\nroof = '{right}'\n[[rig.scanner]]\nrow = 'left'\nroof = '{left}'\n[[rig.scanner]]\n"
        )
    };
    let old = read(&format!("version = 1\n{}", scanners(["forward", "backward"])));
    assert_eq!(old, read(&format!("version = 2\n{}", scanners(["backward", "backward"]))));
    assert_eq!(read(&toml::to_string(&old).unwrap()), old);
    assert_eq!(read("version = 1"), read("version = 2"));
    // Within another document, as studies hold them.
    let within: std::collections::BTreeMap<String, Scene> = toml::from_str(&format!(
        "[base]\nversion = 1\n{}",
        scanners(["forward", "backward"]).replace("[[rig", "[[base.rig")
    ))
    .unwrap();
    assert_eq!(within["base"], old);
    assert!(!toml::to_string(&read("version = 1")).unwrap().contains("roof"));
}

#[test]
fn the_default_scene_is_the_one_that_the_documents_describe() {
    let scene = read(builtin::text(builtin::DEFAULT).unwrap());
    let rig = scene.resolved_rig();
    assert_eq!((rig.trees, rig.tree_spacing_m, rig.row_spacing_m), (Some(12), Some(1.5), Some(4.0)));
    assert_eq!((rig.speed_m_s, rig.start_m), (1.0, 0.0));
    let mount = &rig.scanners[0];
    assert_eq!((mount.model.as_str(), mount.height_m, mount.distance_m), ("lms111", 1.6, 1.9));
    assert_eq!(scene.orchard.generator(), GeneratorKind::Trained);
    assert_eq!(scene.orchard.training_parameters().form, Form::Spindle);
}

#[test]
fn a_rig_keeps_what_it_says_itself() {
    let scene = read("version = 1\n[orchard]\npreset = 'paper'\n[rig]\ntree_spacing_m = 2.5\n");
    let rig = scene.resolved_rig();
    assert_eq!((rig.trees, rig.tree_spacing_m, rig.row_spacing_m), (Some(3), Some(2.5), Some(5.0)));
}

/// As steep as a ground may be, a rig may know it.
#[test]
fn a_rig_knows_the_slope_of_its_scenes_ground() {
    let told = |ground: &str, rig: &str| {
        let scene = read(&format!("version = 2\n[orchard.ground]\n{ground}\n[rig]\n{rig}\n"));
        scene.validate().unwrap();
        scene.resolved_rig().ground_slope_deg
    };
    for slope_deg in [-45.0, -6.0, 2.5, 45.0] {
        let ground = format!("slope_deg = {slope_deg}");
        assert_eq!(told(&ground, ""), Some(slope_deg));
        assert_eq!(told(&ground, "ground_slope_deg = 0"), Some(0.0), "a rig keeps what it says itself");
    }
    // A rig that says nothing has level ground: rigs of level scenes stay as they were.
    assert_eq!(told("roughness_m = 0.02", ""), None);
    assert!(read("version = 2\n[rig]\nground_slope_deg = 46\n").validate().is_err());
}

#[test]
fn overrides_depart_from_the_preset_and_leave_the_rest() {
    let scene = read(
        "version = 1\n[orchard]\npreset = 'mature'\ntrees = 7\nmissing = [2]\n[orchard.tree]\nshady_percent = 70\n\
         transitions = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\nrules = ['>>>>','>>>>','>>>>','++++']\n\
         branching_transitions = 'P_fuji_branching'\n",
    );
    scene.validate().unwrap();
    let tree = scene.orchard.tree_parameters();
    let mature = Preset::Mature.tree(GeneratorKind::Trained);
    assert_eq!((tree.shady_percent, tree.iterations, tree.pruned), (70.0, mature.iterations, mature.pruned));
    assert!(matches!(tree.transitions, MatrixSource::Inline(_)));
    assert_eq!((scene.orchard.layout().trees, scene.orchard.layout().row_spacing_m), (7, 4.0));
    assert_eq!(read(&toml::to_string(&scene).unwrap()), scene);
}

#[test]
fn unknown_keys_are_refused_everywhere() {
    for text in [
        "version = 1\nsead = 2",
        "version = 1\n[orchard]\ntreess = 3",
        "version = 1\n[orchard.tree]\niteration = 3",
        "version = 1\n[rig]\nspeed = 3",
        "version = 1\n[[rig.scanner]]\nhight_m = 3",
    ] {
        let error = toml::from_str::<Scene>(text).unwrap_err().to_string();
        assert!(error.contains("unknown field"), "{text}: {error}");
    }
}

#[test]
fn values_without_meaning_are_refused_by_key_expected_and_found() {
    assert_eq!(refusal("version = 3"), "version must be 1 or 2, found 3");
    let in_orchard = |line: &str| refusal(&format!("version = 1\n[orchard]\n{line}"));
    let in_tree = |line: &str| refusal(&format!("version = 1\n[orchard.tree]\n{line}"));
    assert_eq!(in_orchard("trees = 0"), "orchard.trees must be 1 to 100000, found 0");
    assert_eq!(
        in_orchard("tree_spacing_m = -1.5"),
        "orchard.tree_spacing_m must be a positive number of metres, found -1.5"
    );
    assert_eq!(in_orchard("missing = [3, 12]"), "orchard.missing must be places from 0 to 11, found 12");
    assert!(
        in_orchard("trees = 3\norder = [0, 1, 1]")
            .starts_with("orchard.order must be every number from 0 to 2 once")
    );
    assert_eq!(in_tree("iterations = 0"), "orchard.tree.iterations must be 1 to 40, found 0");
    assert!(in_tree("leaf_length_m = nan").starts_with("orchard.tree.leaf_length_m must be a number from"));
    let matrix = in_tree("transitions = [[0.25,0.25,0.25,0.25],[1,0,0,0],[0.5,0.4,0,0],[0,0,0,1]]");
    assert!(matrix.starts_with("orchard.tree.transitions must be"), "{matrix}");
    assert!(matrix.ends_with("found row S must sum to 1 within 1e-6, its sum is 0.9"), "{matrix}");
    let named = in_tree("transitions = 'P_golden'");
    assert!(named.contains("P_fuji, P_mapplet_mean") && named.contains("`P_golden`"), "{named}");
    assert!(in_tree("rules = 'espalier'").contains("vase, floral_only"));
    assert!(in_tree("rules = ['++>>', '++>>', '++>x', '++++']").contains("row S, found `++>x`"));
    assert!(matches!(read("version = 1\n[rig]\nscanner = []").validate(), Err(SceneError::Rig(_))));
}

#[test]
fn every_parameter_explains_itself() {
    let table = TreeParameters::default().table();
    assert!(table.len() >= 38);
    for line in &table {
        assert!(!line.meaning.is_empty() && !line.reason.is_empty() && !line.unit.is_empty(), "{line:?}");
    }
    let value = |key: &str| table.iter().find(|line| line.key == key).unwrap().value.clone();
    assert_eq!(
        (value("transitions"), value("power_rule"), value("internode_m")),
        ("P_fuji".into(), "literal".into(), "0.035".into())
    );
    // The table writes what a scene file reads.
    let text: String = table
        .iter()
        .map(|line| match line.value.parse::<f64>().is_ok() || line.value == "false" {
            true => format!("{} = {}\n", line.key, line.value),
            false => format!("{} = '{}'\n", line.key, line.value),
        })
        .collect();
    let scene = read(&format!("version = 1\n[orchard]\npreset = 'spindle'\n[orchard.tree]\n{text}"));
    assert_eq!(scene.orchard.tree_parameters(), TreeParameters::default());
}
