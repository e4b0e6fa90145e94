//! Keys of an areas study, set by name.

use serde_json::Value;

use super::{AreasStudy, Setting};

/// The study with these keys set. It is written out, changed there, and read again strictly: what names nothing, or holds what it may
/// not, is refused.
pub(super) fn set(base: &AreasStudy, settings: &[Setting<'_>]) -> Result<AreasStudy, String> {
    let mut study = serde_json::to_value(base).map_err(|cause| cause.to_string())?;
    for (key, value) in settings {
        put(&mut study, key, value).map_err(|why| format!("key `{key}`: {why}"))?;
    }
    let names = || settings.iter().map(|(key, _)| *key).collect::<Vec<_>>().join("`, `");
    let study: AreasStudy =
        serde_json::from_value(study).map_err(|why| format!("key `{}`: {why}", names()))?;
    study.scene.orchard.validate().map_err(|why| why.to_string())?;
    Ok(study)
}

fn put(study: &mut Value, key: &str, value: &Value) -> Result<(), String> {
    let mut place = study;
    for name in key.split('.') {
        let Value::Object(table) = place else {
            return Err(format!("nothing lies below a value, found `{name}`"));
        };
        // A value left to the preset is not written out: reading the study again says whether it may be set.
        place = table.entry(name).or_insert_with(|| Value::Object(serde_json::Map::new()));
    }
    *place = value.clone();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn base() -> AreasStudy {
        AreasStudy::new(crate::config::load_scene("paper").expect("built in"))
    }

    #[test]
    fn every_part_of_the_study_can_be_set() {
        let mesh = json!({ "mesh": { "half_width_m": 0.002, "points": 3, "step_m": 0.001 } });
        let (eleven, far, all) = (json!([9, 10, 11]), json!(3.5), json!(true));
        let study = set(
            &base(),
            &[
                ("iterations", &eleven),
                ("lateral.distance_m", &far),
                ("lateral.wood", &mesh),
                ("whole_orchard", &all),
            ],
        )
        .expect("valid");
        assert_eq!((study.iterations.as_slice(), study.lateral.distance_m), (&[9, 10, 11][..], 3.5));
        assert!(study.whole_orchard && study.lateral.wood != study.zenith.wood);
        assert_eq!(set(&base(), &[]), Ok(base()));
    }

    #[test]
    fn what_names_nothing_is_refused_by_name() {
        for (key, value, part) in [
            ("lateral.distanse_m", json!(1), "distanse_m"),
            ("scene.orchard.tree.rulez", json!("vase"), "rulez"),
            ("scene.orchard.tree.rules", json!("vaze"), "vaze"),
            ("clearance_m.x", json!(1), "nothing lies below"),
            ("iterations", json!("many"), "iterations"),
        ] {
            let why = set(&base(), &[(key, &value)]).expect_err(key);
            assert!(why.contains(part), "{key}: {why}");
        }
    }
}
