//! What the studies of rows driven past share: a range of seeds, one trial each.

use std::path::Path;
use std::str::FromStr;

use rowscan_canopy::Calibration;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::{Scene, files};

use super::keep::KeptRows;
use crate::cli::blocking::off_runtime;
use crate::cli::output::say;
use crate::cli::{Failure, progress};
use rowscan_study::foliage::LaiRange;
use rowscan_study::trial::{Trial, TrialError, Wanted, run_all};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A range of seeds, both ends in it: `1..20`.
#[derive(Clone, Debug)]
pub(in crate::cli) struct Seeds(pub(in crate::cli) Vec<u64>);

/// Rows one study may hold; each is grown and scanned whole.
const MAX_SEEDS: u64 = 100_000;

impl FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || format!("expected seeds as FIRST..LAST, such as 1..20, found `{text}`");
        let (first, last) = text.split_once("..").ok_or_else(refuse)?;
        let first: u64 = first.parse().map_err(|_| refuse())?;
        let last: u64 = last.trim_start_matches('=').parse().map_err(|_| refuse())?;
        match last.checked_sub(first) {
            Some(count) if count < MAX_SEEDS => Ok(Self((first..=last).collect())),
            Some(_) => Err(format!("expected at most {MAX_SEEDS} seeds, found `{text}`")),
            None => Err(format!("expected the first seed not above the last, found `{text}`")),
        }
    }
}

/// Distances from the mirror to the row plane, metres: refused where no scanner stands so.
pub(super) fn distances_m(asked: &[f64]) -> Result<Vec<f64>, Failure> {
    match asked.iter().find(|metres| !(0.2..=50.0).contains(*metres)) {
        Some(metres) => Err(Failure::Usage(format!("--distance: expected 0.2 to 50 metres, found {metres}"))),
        None => Ok(asked.to_vec()),
    }
}

/// The scenes that are tried, each with a name to tell it by: its own, else its file's.
pub(super) fn named_scenes(names: &[String]) -> Result<Vec<Scene>, Failure> {
    names.iter().map(|name| Ok(named(files::load_scene(name, say)?, name))).collect()
}

/// A scene with its own name, else that of the file it was read from.
pub(super) fn named(scene: Scene, file: &str) -> Scene {
    if !scene.name.is_empty() {
        return scene;
    }
    let stem = Path::new(file).file_stem().unwrap_or(file.as_ref());
    Scene { name: stem.to_string_lossy().into_owned(), ..scene }
}

/// Which rows of a scene are tried.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pub(super) seeds: Vec<u64>,
    /// How much leaf they carry; as they grew where absent.
    pub(super) lai: Option<LaiRange>,
}

impl Rows {
    fn scenes(&self, scene: &Scene) -> Vec<Scene> {
        let row = |&seed| match self.lai {
            Some(lai) => lai.dress(scene, seed),
            None => Scene { seed, ..scene.clone() },
        };
        self.seeds.iter().map(row).collect()
    }

    /// Says where the seeds leave most of the asked leaf area indices without a row.
    fn tell(&self) {
        let Some(lai) = self.lai else { return };
        if let Some((low, high)) = lai.narrowed_to(&self.seeds) {
            say(format_args!(
                "--lai {lai}: these {} seeds draw {low:.2} to {high:.2} only; more or other seeds fill the range",
                self.seeds.len()
            ));
        }
    }
}

/// Tries one row a seed, off the runtime's threads, with a progress bar, and takes of each what is wanted: `name` says what, for rows that are kept.
pub(super) async fn tries<T>(
    scene: &Scene,
    rows: &Rows,
    model: AnyModel,
    calibration: Option<Calibration>,
    kept: KeptRows,
    name: String,
    take: impl Fn(&Trial) -> T + Send + Sync + 'static,
) -> Result<Vec<T>, Failure>
where
    T: Serialize + DeserializeOwned + PartialEq + Send + 'static,
{
    let bar = progress::bar("trying", "rows", rows.seeds.len() as u64);
    rows.tell();
    let scenes = rows.scenes(scene);
    let work = move || -> Result<Vec<T>, TrialError> {
        let wanted = Wanted { name: &name, take: &take };
        let trials = run_all(&scenes, model, calibration.as_ref(), &wanted, &kept.archive, &|| bar.inc(1));
        bar.finish_and_clear();
        kept.tell();
        trials
    };
    off_runtime("try the rows", work).await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_are_a_range_with_both_ends() {
        assert_eq!("3..5".parse::<Seeds>().map(|seeds| seeds.0), Ok(vec![3, 4, 5]));
        for (text, reason) in [
            ("5", "FIRST..LAST"),
            ("5..3", "not above"),
            ("1..x", "FIRST..LAST"),
            ("0..18446744073709551615", "at most"),
        ] {
            let message = text.parse::<Seeds>().expect_err(text);
            assert!(message.contains(reason), "{text}: {message}");
        }
    }
}
