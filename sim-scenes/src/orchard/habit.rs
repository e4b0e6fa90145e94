//! What an orchard's trees have of their own, beside what their preset gives them.

use std::fmt;

use super::OrchardParameters;
use crate::generator::kind::GeneratorKind;
use crate::parameters::ParameterDoc;

/// Keys of `[orchard.tree]` that other properties of a class know: angle and size of leaves, share of wood, how deep and how high crowns are seen.
const KNOWN_OTHERWISE: [&str; 20] = [
    "iterations",
    "replanted_seasons",
    "leaf_length_m",
    "leaf_width_m",
    "leaf_angle",
    "leaf_angle_chi",
    "leaf_angle_mean_deg",
    "leaf_angle_sd_deg",
    "fruits_per_cluster",
    "fruit_diameter_m",
    "petiole_radius_m",
    "pipe_exponent",
    "terminal_radius_m",
    "terminal_radius_long_m",
    "wood_floor_radius_m",
    "trunk_floor_diameter_m",
    "envelope_half_width_m",
    "envelope_top_half_width_m",
    "envelope_top_m",
    "max_metamers",
];

/// Keys of `[orchard.tree]` that trees which are trained season by season do not look at: how hidden Markov trees grow.
pub(crate) const UNHEEDED_BY_TRAINED: [&str; 15] = [
    "initial_state",
    "transitions",
    "branching_transitions",
    "renormalise",
    "rules",
    "power_rule",
    "max_new_axes",
    "axes_limit",
    "attachment",
    "child_draw",
    "internodes",
    "long_age_offset",
    "branching_angle_deg",
    "leaf_rank_scale",
    "leaf_lifetime",
];

/// Keys that are set, and that what makes the trees does not look at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WithoutEffect {
    /// With their tables.
    pub keys: Vec<String>,
    /// What makes the trees.
    pub generator: GeneratorKind,
    /// Of whose trees they are.
    pub of: GeneratorKind,
}

impl fmt::Display for WithoutEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { keys, generator, of } = self;
        let (verb, them) = if keys.len() == 1 { ("has", "it") } else { ("have", "them") };
        write!(
            f,
            "`{}` {verb} no effect on trees of `generator = \"{generator}\"`; leave {them} out, or write `[orchard] generator = \"{of}\"`",
            keys.join("`, `")
        )
    }
}

impl OrchardParameters {
    /// Keys of `[orchard.tree]`, then of `[orchard.training]`, that have another value than the preset gives them.
    fn own_keys(&self) -> [Vec<ParameterDoc>; 2] {
        let (preset, generator) = (self.preset, self.generator());
        [
            (self.tree_parameters().table(), preset.tree(generator).table()),
            (self.training_parameters().table(), preset.training().table()),
        ]
        .map(|(own, of_preset)| {
            let differs = |(own, of_preset): (ParameterDoc, ParameterDoc)| (own != of_preset).then_some(own);
            own.into_iter().zip(of_preset).filter_map(differs).collect()
        })
    }

    /// Keys that are set otherwise than the preset has them, and change nothing; `None` where there are none.
    pub fn without_effect(&self) -> Option<WithoutEffect> {
        let [tree, training] = self.own_keys();
        let keys = |table: &str, own: Vec<ParameterDoc>, is_unheeded: fn(&str) -> bool| -> Vec<String> {
            let unheeded = own.iter().filter(|doc| is_unheeded(doc.key));
            unheeded.map(|doc| format!("{table}.{}", doc.key)).collect()
        };
        let (keys, of) = match self.generator() {
            GeneratorKind::Trained => {
                (keys("orchard.tree", tree, |key| UNHEEDED_BY_TRAINED.contains(&key)), GeneratorKind::Hmt)
            }
            GeneratorKind::Hmt => (keys("orchard.training", training, |_| true), GeneratorKind::Trained),
            _ => return None,
        };
        (!keys.is_empty()).then(|| WithoutEffect { keys, generator: self.generator(), of })
    }

    /// The training system, as a calibration's class and a row's have it: the preset, with every key of its trees that sets otherwise how leaves and wood stand to each
    /// other; of trees that no preset makes, what makes them.
    pub fn training_system(&self) -> String {
        let generator = self.generator();
        if !matches!(generator, GeneratorKind::Hmt | GeneratorKind::Trained) {
            return generator.to_string();
        }
        let unheeded = self.without_effect().map(|found| found.keys).unwrap_or_default();
        let [tree, training] = self.own_keys();
        let tree = tree.into_iter().filter(|doc| !KNOWN_OTHERWISE.contains(&doc.key));
        let own: Vec<String> = (tree.map(|doc| ("orchard.tree", doc)))
            .chain(training.into_iter().map(|doc| ("orchard.training", doc)))
            .filter(|(table, doc)| !unheeded.contains(&format!("{table}.{}", doc.key)))
            .map(|(_, doc)| format!("{} = {}", doc.key, doc.value))
            .collect();
        match own.as_slice() {
            [] => self.preset.to_string(),
            own => format!("{} with {}", self.preset, own.join(", ")),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::growth::{TreeOverrides, TreeParameters};
    use crate::orchard::{Orchard, Preset};

    /// A value that this key takes beside its own; `None` of names of tables.
    fn another(doc: &ParameterDoc, own: &Value) -> Option<Value> {
        match own {
            Value::Bool(own) => Some((!own).into()),
            Value::Number(own) => own.as_u64().map(|own| (own + 1).into()).or_else(|| {
                let own = own.as_f64()?;
                Some((own * 1.1 + if own == 0.0 { 0.3 } else { 0.0 }).into())
            }),
            Value::String(own) => {
                let mut names = doc.unit.split(" | ");
                names.find(|name| name != own && doc.unit.contains('|')).map(|name| name.into())
            }
            _ => None,
        }
    }

    /// A tree with fruit, petioles, beta angles, shade, a hollow and a replanted neighbour, so that every key may have a say.
    fn busy(preset: Preset) -> OrchardParameters {
        let mut orchard = OrchardParameters { trees: Some(3), ..OrchardParameters::of(preset) };
        orchard.replanted = serde_json::from_value(serde_json::json!([1])).expect("a place");
        orchard.tree.fruits_per_cluster = Some(1);
        orchard.tree.petiole_radius_m = Some(0.001);
        orchard.tree.shady_percent = Some(70.0);
        orchard.tree.hollow_deg = Some(5.0);
        orchard
    }

    fn grown(orchard: &OrchardParameters) -> Vec<u64> {
        let grown = Orchard::grow(orchard, 4, &|_, _| {}).expect("it grows");
        let truth = grown.truth();
        let of_trees = truth.trees.iter().flat_map(|tree| [tree.leaf_area_m2, tree.leaves as f64]);
        let of_row = [
            truth.wood_area_m2,
            truth.fruit_area_m2,
            truth.leaf_angle_mean_deg.unwrap_or_default(),
            form_of(&grown),
        ];
        of_trees.chain(of_row).map(f64::to_bits).collect()
    }

    fn form_of(grown: &Orchard) -> f64 {
        crate::CanopyForm::of_row(grown, 0)
            .map_or(0.0, |form| form.height_m + form.width_m + form.gap_fraction)
    }

    #[test]
    fn trained_trees_look_at_every_key_but_those_that_are_told() {
        let base = busy(Preset::Spindle);
        let plain = grown(&base);
        let own = serde_json::to_value(base.tree_parameters().as_overrides()).expect("keys");
        // Of laws of angles that are not chosen, and limits that are not reached.
        let idle_here = ["leaf_angle_chi", "leaf_angle_mean_deg", "leaf_angle_sd_deg", "max_metamers"];
        let mut wrong = Vec::new();
        for doc in base.tree_parameters().table() {
            let Some(value) = another(&doc, &own[doc.key]) else { continue };
            let mut set = serde_json::to_value(&base.tree).expect("keys");
            set[doc.key] = value;
            let tree: TreeOverrides = serde_json::from_value(set).expect(doc.key);
            let changed = OrchardParameters { tree, ..base.clone() };
            let is_heeded = grown(&changed) != plain;
            let told = changed
                .without_effect()
                .is_some_and(|idle| idle.keys.contains(&format!("orchard.tree.{}", doc.key)));
            assert_eq!(told, UNHEEDED_BY_TRAINED.contains(&doc.key), "{}", doc.key);
            if is_heeded == told && !idle_here.contains(&doc.key) {
                wrong.push((doc.key, is_heeded));
            }
        }
        assert_eq!(wrong, [], "keys, and whether they change anything");
        let known: Vec<&str> = TreeParameters::default().table().iter().map(|doc| doc.key).collect();
        for key in KNOWN_OTHERWISE.iter().chain(&UNHEEDED_BY_TRAINED) {
            assert!(known.contains(key), "{key}");
        }
    }

    #[test]
    fn a_training_system_is_its_preset_and_what_sets_leaves_otherwise() {
        for preset in Preset::ALL {
            let own = OrchardParameters::of(*preset);
            assert_eq!(own.training_system(), preset.to_string());
            assert_eq!(own.spelled_out().training_system(), preset.to_string());
            assert_eq!(own.without_effect(), None);
        }
        let with = |key: &str, value: Value| {
            let mut orchard = OrchardParameters::of(Preset::Spindle);
            orchard.tree = serde_json::from_value(serde_json::json!({ key: value })).expect("a key");
            orchard.training_system()
        };
        assert_eq!(with("petiole_m", 0.06.into()), "spindle with petiole_m = 0.06");
        assert_eq!(with("leaf_droop_deg", 60.0.into()), "spindle with leaf_droop_deg = 60");
        for known in ["leaf_length_m", "envelope_half_width_m"] {
            assert_eq!(with(known, 0.5.into()), "spindle", "{known}");
        }
        assert_eq!(with("leaf_rank_scale", "linear".into()), "spindle", "it changes nothing");
        let mut tufts = OrchardParameters::of(Preset::Spindle);
        tufts.training.spur_leaves = Some(14);
        assert_eq!(tufts.training_system(), "spindle with spur_leaves = 14");
        let import = OrchardParameters { generator: Some(GeneratorKind::Import), ..tufts };
        assert_eq!(import.training_system(), "import");
    }
}
