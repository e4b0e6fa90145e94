//! Whether a recording was made in the scene that a rig belongs to.

use std::path::Path;

use rowscan_recording::About;

/// Keys of a rig that go by where its scene's trees stand: other values are another orchard.
const OF_ORCHARD: [&str; 5] = ["row_spacing_m", "tree_spacing_m", "trees", "distance_m", "row"];

/// Why the scene called `name` is not the one that a recording was made in that says this, with a rig that differs in these keys; none where nothing speaks
/// against it. A scene's file may have been moved.
pub(super) fn other_scene(about: &About, name: &str, differences: &[String]) -> Option<String> {
    let recorded = about.scene.as_deref().filter(|recorded| stem(recorded) != stem(name));
    if let Some(recorded) = recorded {
        return Some(format!("it was made in the scene {recorded}, and --rig names {name}"));
    }
    let of_orchard = |told: &&String| OF_ORCHARD.contains(&told.split(' ').next().unwrap_or_default());
    let others: Vec<&str> = differences.iter().filter(of_orchard).map(String::as_str).collect();
    let others = others.join(", ");
    (!others.is_empty()).then(|| format!("it was made where {others} of the scene that --rig names"))
}

/// A scene's name without its folder and its file's ending.
fn stem(name: &str) -> Option<&std::ffi::OsStr> {
    Path::new(name).file_stem()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_scene_is_the_same_one_and_another_orchard_is_not() {
        let about = |scene: Option<&str>| About { scene: scene.map(str::to_owned), ..About::default() };
        let none: &[&str] = &[];
        for (scene, name, differences, is_other) in [
            (None, "spindle", none, false),
            (Some("spindle"), "spindle", none, false),
            (Some("rows/a.toml"), "elsewhere/a.toml", none, false),
            (Some("rows/a.toml"), "rows/a.toml", &["speed_m_s 1.0 (here 2.0)", "height_m 1 (here 2)"], false),
            // The wrong twins.
            (Some("rows/a.toml"), "rows/b.toml", none, true),
            (Some("vase"), "spindle", none, true),
            (Some("a.toml"), "a.toml", &["speed_m_s 1.0 (here 2.0)", "row_spacing_m 4.0 (here 3.0)"], true),
            (None, "a.toml", &["tree_spacing_m 1.0 (here 1.5)"], true),
            (None, "a.toml", &["trees 2 (here 3)"], true),
            (None, "a.toml", &["distance_m 1.9 (here 2.5)"], true),
            (None, "a.toml", &["row \"left\" (here \"right\")"], true),
        ] {
            let differences: Vec<String> = differences.iter().map(|told| (*told).to_owned()).collect();
            let found = other_scene(&about(scene), name, &differences);
            assert_eq!(found.is_some(), is_other, "{scene:?}, {name}, {differences:?}: {found:?}");
        }
    }
}
