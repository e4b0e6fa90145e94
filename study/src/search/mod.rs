//! A search for the paper's orchards: the areas study under many settings, each on the same seeds, beside the paper's numbers.
//!
//! What the paper's text leaves open (its tables are lost) are [`Knob`]s: keys of an [`AreasStudy`] and the values they may have besides
//! the base's. Point 0 is the base; then every value of every knob is tried alone; then come points that draw every knob by lot, each
//! value (the base's among them) as likely as the others. All points see the same seeds, given in the search's file, and a point is told
//! by its medians over them: no seed can be picked. A point that is picked for its result is picked for its luck too, so it counts as
//! unconfirmed until a [`ConfirmStudy`] has tried it on other seeds.

mod bootstrap;
mod confirm;
mod file;
mod report;

use crate::notes::RowNotes;
use rayon::prelude::*;
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_scenes::parameters::SceneFile;
use serde::{Deserialize, Serialize};
use toml::Value;

pub use confirm::{
    ConfirmError, ConfirmReport, ConfirmStudy, INTERVAL, nearest_points, report as report_confirmed,
};
pub use file::{read, schema};
pub use report::{LEAST_SEEDS, PointReport, Regression, SearchReport, report};

use super::archive::Depends;
use super::areas::{AreasStudy, Orchard};
use super::settings::{self, Shelf};
use super::{Nursery, Setting, Study, UnitError, fingerprint};

/// A search: all that its results depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchStudy {
    /// What to call it.
    pub name: String,
    /// The study that the points depart from.
    pub base: AreasStudy,
    /// What may be turned.
    pub knobs: Vec<Knob>,
    /// Try every value of every knob alone.
    pub one_at_a_time: bool,
    /// Points with every knob drawn by lot.
    pub joint: usize,
    /// Seeds of the areas study; every point sees all.
    pub seeds: Vec<u64>,
    /// Seeds that base and knobs were chosen on before: they confirm nothing either.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub seen: Vec<u64>,
    /// What its scenes name.
    #[serde(skip)]
    files: Shelf,
}

/// One thing that may be turned: a key of the areas study, or several that go together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Knob {
    /// Keys, such as `scene.orchard.tree.rules` or `lateral.distance_m`.
    pub keys: Vec<String>,
    /// What they may be besides the base's: a list a value, an entry a key.
    pub values: Vec<Vec<Value>>,
}

/// The areas study at one point and seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tried {
    /// The orchards; none where the point cannot be.
    pub orchards: Vec<Orchard>,
    /// Why the point cannot be, if it cannot.
    pub refused: Option<String>,
}

/// An areas study with these keys set.
fn with(base: &AreasStudy, settings: &[Setting<'_>]) -> Result<AreasStudy, String> {
    settings::set(base, settings, |text| {
        let study: AreasStudy = files::from_toml(text).map_err(|trouble| trouble.message)?;
        study.scene.validate().map_err(|why| why.to_string())?;
        Ok(study)
    })
}

impl SearchStudy {
    /// A base that nothing is turned of, and that no seed has chosen.
    fn of_base(base: AreasStudy) -> Self {
        Self {
            name: base.scene.name.clone(),
            files: Shelf::of_scene(&base.scene),
            base,
            knobs: Vec::new(),
            one_at_a_time: false,
            joint: 0,
            seeds: Vec::new(),
            seen: Vec::new(),
        }
    }

    /// Points, the base among them.
    pub fn points(&self) -> usize {
        1 + self.singles() + self.joint
    }

    fn singles(&self) -> usize {
        if self.one_at_a_time { self.knobs.iter().map(|knob| knob.values.len()).sum() } else { 0 }
    }

    /// True if the point turns one knob alone.
    pub fn is_single(&self, point: usize) -> bool {
        (1..=self.singles()).contains(&point)
    }

    /// What a point sets; nothing for the base.
    pub fn settings(&self, point: usize) -> Vec<Setting<'_>> {
        let Some(number) = point.checked_sub(1) else { return Vec::new() };
        if let Some(joint) = number.checked_sub(self.singles()) {
            return self.knobs.iter().flat_map(|knob| knob.drawn(self.base.scene.seed, joint)).collect();
        }
        let all = self.knobs.iter().flat_map(|knob| knob.values.iter().map(|value| knob.set_to(value)));
        all.map(Iterator::collect).nth(number).unwrap_or_default()
    }

    /// The areas study of a point with a seed of the list.
    ///
    /// # Errors
    /// What about the settings cannot be.
    fn study_at(&self, point: usize, seed: u64) -> Result<AreasStudy, String> {
        let mut study = with(&self.base, &self.settings(point))?;
        self.files.serve(&mut study.scene)?;
        study.scene.seed = seed;
        Ok(study)
    }

    /// How long a point takes at a seed.
    fn effort_of(&self, point: usize, seed: u64) -> f64 {
        let of = |study: AreasStudy| -> f64 {
            let layout = study.scene.orchard.layout();
            let trees = f64::from(layout.trees) * f64::from(layout.rows);
            trees * (0..study.units()).map(|unit| study.effort(unit)).sum::<f64>() / 1000.0
        };
        self.study_at(point, seed).map_or(0.0, of)
    }

    /// A point at a seed. A combination that cannot be is a finding of the search, not its end.
    fn tried(&self, point: usize, seed: u64) -> Tried {
        let refused = |why: String| Tried { orchards: Vec::new(), refused: Some(why) };
        let study = match self.study_at(point, seed) {
            Ok(study) => study,
            Err(why) => return refused(why),
        };
        let orchards: Result<Vec<Orchard>, UnitError> =
            (0..study.units()).into_par_iter().map(|unit| study.scanned(unit)).collect();
        match orchards {
            Ok(orchards) => Tried { orchards, refused: None },
            Err(why) => refused(why.to_string()),
        }
    }

    /// All that a point depends on at a seed.
    fn depends_of(&self, point: usize, seed: u64) -> Option<Depends> {
        let study = self.study_at(point, seed).ok()?;
        Some(Depends::on_scene(&study.scene).and("settings", &study))
    }

    /// Point and seed of a unit.
    pub fn case(&self, index: usize) -> (usize, u64) {
        let seeds = self.seeds.len().max(1);
        (index / seeds, self.seeds.get(index % seeds).copied().unwrap_or_default())
    }
}

impl Knob {
    fn set_to<'a>(&'a self, value: &'a [Value]) -> impl Iterator<Item = Setting<'a>> {
        self.keys.iter().map(String::as_str).zip(value.iter().cloned())
    }

    /// The value drawn for a joint point; nothing where it is the base's.
    fn drawn(&self, seed: u64, joint: usize) -> Vec<Setting<'_>> {
        let lot = fingerprint::seed(&self.keys.join(","), seed, joint) as usize % (self.values.len() + 1);
        let value = lot.checked_sub(1).and_then(|place| self.values.get(place));
        value.map_or_else(Vec::new, |value| self.set_to(value).collect())
    }
}

impl Study for SearchStudy {
    const NAME: &'static str = "search";
    type Result = Tried;

    fn units(&self) -> usize {
        self.points() * self.seeds.len()
    }

    fn scene(&self) -> &Scene {
        &self.base.scene
    }

    fn files(&self) -> Vec<SceneFile> {
        self.files.files()
    }

    fn effort(&self, index: usize) -> f64 {
        let (point, seed) = self.case(index);
        self.effort_of(point, seed)
    }

    fn depends(&self, index: usize) -> Option<Depends> {
        let (point, seed) = self.case(index);
        self.depends_of(point, seed)
    }

    fn unit(&self, index: usize, _nursery: &Nursery, _notes: &mut RowNotes) -> Result<Tried, UnitError> {
        let (point, seed) = self.case(index);
        Ok(self.tried(point, seed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search() -> SearchStudy {
        let scene = files::load_scene("paper", |_| {}).expect("built in");
        let knob = |key: &str, values: &[Value]| Knob {
            keys: vec![key.to_owned()],
            values: values.iter().map(|value| vec![value.clone()]).collect(),
        };
        SearchStudy {
            name: "test".to_owned(),
            base: AreasStudy::new(scene),
            knobs: vec![
                knob("scene.orchard.trees", &[Value::Integer(1), Value::Integer(6)]),
                knob("scene.orchard.tree.rules", &[Value::String("floral_only".to_owned())]),
            ],
            one_at_a_time: true,
            joint: 60,
            seeds: vec![4, 9],
            seen: vec![30],
            files: Shelf::default(),
        }
    }

    #[test]
    fn every_part_of_the_study_can_be_set() {
        let settings: toml::Table = toml::from_str(
            r#"
            iterations = [9, 10, 11]
            whole_orchard = true
            "lateral.distance_m" = 3.5
            "lateral.wood" = { mesh = { half_width_m = 0.002, points = 3, step_m = 0.001 } }
            "#,
        )
        .expect("TOML");
        let settings: Vec<Setting<'_>> =
            settings.iter().map(|(key, value)| (key.as_str(), value.clone())).collect();
        let base = search().base;
        let study = with(&base, &settings).expect("valid");
        assert_eq!((study.iterations.as_slice(), study.lateral.distance_m), (&[9, 10, 11][..], 3.5));
        assert!(study.whole_orchard && study.lateral.wood != study.zenith.wood);
        assert_eq!(with(&base, &[]), Ok(base));
    }

    #[test]
    fn points_are_the_base_then_single_knobs_then_lots() {
        let search = search();
        assert_eq!((search.points(), search.units()), (64, 128));
        assert_eq!(search.settings(0), []);
        assert_eq!(search.settings(2), [("scene.orchard.trees", Value::Integer(6))]);
        assert_eq!(
            search.settings(3),
            [("scene.orchard.tree.rules", Value::String("floral_only".to_owned()))]
        );
        assert!(search.is_single(3) && !search.is_single(0) && !search.is_single(4));
        let with = |key: &str| {
            (4..64).filter(|point| search.settings(*point).iter().any(|(name, _)| *name == key)).count()
        };
        assert!((25..=55).contains(&with("scene.orchard.trees")), "two lots of three");
        assert!((15..=45).contains(&with("scene.orchard.tree.rules")), "one lot of two");
        assert_eq!(search.case(7), (3, 9));
        let study = search.study_at(3, 9).expect("valid");
        assert_eq!(study.scene.orchard.tree_parameters().rules.to_string(), "floral_only");
        assert_eq!((study.scene.seed, study.scene.orchard.layout().trees), (9, 3));
    }

    #[test]
    fn seeds_that_chose_a_point_cannot_confirm_it() {
        let confirm =
            |points: &[usize], seeds: &[u64]| ConfirmStudy::new(search(), points.to_vec(), seeds.to_vec());
        let fresh: Vec<u64> = (101..=110).collect();
        let study = confirm(&[0, 3], &fresh).expect("fresh");
        assert_eq!(study.units(), 20);
        let with = |more: &[u64]| [&fresh, more].concat();
        assert_eq!(
            confirm(&[0], &with(&[9])),
            Err(ConfirmError::SharedSeeds { shared: vec![9], highest: 30 })
        );
        assert_eq!(
            confirm(&[0], &with(&[30, 4])),
            Err(ConfirmError::SharedSeeds { shared: vec![30, 4], highest: 30 })
        );
        assert_eq!(confirm(&[0], &fresh[1..]), Err(ConfirmError::TooFewSeeds { found: 9 }));
        assert_eq!(confirm(&[0], &with(&[101])), Err(ConfirmError::TooFewSeeds { found: 10 }));
        assert_eq!(confirm(&[64], &fresh), Err(ConfirmError::NoSuchPoint { found: 64, last: 63 }));
    }
}
