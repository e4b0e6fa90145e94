//! Points of a search on seeds that had no part in choosing them.
//!
//! The nearest of many points on three seeds is near by luck as well. So what a search finds is a proposal; its report is made on other seeds, of
//! which there are at least [`LEAST_SEEDS`]. A [`ConfirmStudy`] cannot be made of seeds that the search has seen.

use rowscan_scenes::Scene;
use rowscan_scenes::parameters::SceneFile;
use serde::{Deserialize, Serialize};

use super::report::{LEAST_SEEDS, PointReport, SearchReport};
use super::{SearchStudy, Tried};
use crate::archive::Depends;
use crate::areas::AreasStudy;
use crate::notes::RowNotes;
use crate::{Header, Nursery, Study, Unit, UnitError};
use rowscan_canopy::reference::{PAPER, PaperRegression};

/// Some points of a search, each on the same fresh seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConfirmStudy {
    search: SearchStudy,
    points: Vec<usize>,
    seeds: Vec<u64>,
}

/// Why points cannot be confirmed so.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfirmError {
    /// Seeds that chose the points.
    #[error(
        "seeds {} had a part in choosing the points (`seeds` and `seen` of the search), so they cannot confirm them: expected seeds above {highest}",
        list(shared)
    )]
    SharedSeeds {
        /// Those seeds.
        shared: Vec<u64>,
        /// The highest seed that the search has seen.
        highest: u64,
    },
    /// Too few for an interval.
    #[error("expected at least {LEAST_SEEDS} different seeds, found {found}")]
    TooFewSeeds {
        /// How many.
        found: usize,
    },
    /// A point that the search does not have.
    #[error("expected points from 0 to {last}, as the search has, found {found}")]
    NoSuchPoint {
        /// The point.
        found: usize,
        /// The search's last.
        last: usize,
    },
    /// A selection made by something else.
    #[error(
        "expected results of this very search to choose points from, found others: their {differ} differ"
    )]
    OtherSearch {
        /// What differs.
        differ: &'static str,
    },
}

fn list(seeds: &[u64]) -> String {
    seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(", ")
}

impl ConfirmStudy {
    /// Those points of a search on those seeds.
    ///
    /// # Errors
    /// Seeds that the search has seen, too few of them, points that there are not.
    pub fn new(search: SearchStudy, points: Vec<usize>, seeds: Vec<u64>) -> Result<Self, ConfirmError> {
        let seen = || search.seeds.iter().chain(&search.seen);
        let shared: Vec<u64> =
            seeds.iter().copied().filter(|seed| seen().any(|other| other == seed)).collect();
        if !shared.is_empty() {
            return Err(ConfirmError::SharedSeeds {
                shared,
                highest: seen().copied().max().unwrap_or_default(),
            });
        }
        let mut different = seeds.clone();
        different.sort_unstable();
        different.dedup();
        if different.len() < LEAST_SEEDS || different.len() < seeds.len() {
            return Err(ConfirmError::TooFewSeeds { found: different.len() });
        }
        let last = search.points() - 1;
        if let Some(found) = points.iter().copied().find(|point| *point > last) {
            return Err(ConfirmError::NoSuchPoint { found, last });
        }
        Ok(Self { search, points, seeds })
    }

    /// One areas study on many seeds: a search without knobs.
    ///
    /// # Errors
    /// Too few seeds.
    pub fn of_areas(base: AreasStudy, seeds: Vec<u64>) -> Result<Self, ConfirmError> {
        Self::new(SearchStudy::of_base(base), vec![0], seeds)
    }

    /// The seeds.
    pub fn seeds(&self) -> &[u64] {
        &self.seeds
    }

    /// The search whose points they are.
    pub fn search(&self) -> &SearchStudy {
        &self.search
    }

    fn case(&self, index: usize) -> Option<(usize, u64)> {
        let count = self.seeds.len().max(1);
        Some((*self.points.get(index / count)?, *self.seeds.get(index % count)?))
    }
}

/// The base and the nearest points of a finished search.
///
/// # Errors
/// Results of another search.
pub fn nearest_points(
    search: &SearchStudy,
    found: &SearchReport,
    count: usize,
) -> Result<Vec<usize>, ConfirmError> {
    match found.provenance.difference(&Header::of(search)) {
        Some(differ) => Err(ConfirmError::OtherSearch { differ }),
        None => {
            let nearest = found.nearest().into_iter().map(|point| point.point).filter(|point| *point != 0);
            Ok(std::iter::once(0).chain(nearest.take(count)).collect())
        }
    }
}

impl Study for ConfirmStudy {
    const NAME: &'static str = "confirm";
    type Result = Tried;

    fn units(&self) -> usize {
        self.points.len() * self.seeds.len()
    }

    fn scene(&self) -> &Scene {
        self.search.scene()
    }

    fn files(&self) -> Vec<SceneFile> {
        self.search.files()
    }

    fn effort(&self, index: usize) -> f64 {
        self.case(index).map_or(0.0, |(point, seed)| self.search.effort_of(point, seed))
    }

    fn depends(&self, index: usize) -> Option<Depends> {
        let (point, seed) = self.case(index)?;
        self.search.depends_of(point, seed)
    }

    fn unit(&self, index: usize, _nursery: &Nursery, _notes: &mut RowNotes) -> Result<Tried, UnitError> {
        let nothing = Tried { orchards: Vec::new(), refused: Some("no such point".to_owned()) };
        Ok(self.case(index).map_or(nothing, |(point, seed)| self.search.tried(point, seed)))
    }
}

/// What fresh seeds say of the points.
#[derive(Clone, Debug, Serialize)]
pub struct ConfirmReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<ConfirmStudy>,
    /// How the intervals were made.
    pub interval: &'static str,
    /// The paper's regressions.
    pub paper: &'static [PaperRegression],
    /// The points, in the order in which they were asked for.
    pub points: Vec<PointReport>,
}

/// How intervals are made, in words.
pub const INTERVAL: &str = "95 %, percentile bootstrap of the median over seeds";

/// Reports on confirmed points.
pub fn report(provenance: Header<ConfirmStudy>, units: &[Unit<Tried>]) -> ConfirmReport {
    let study = &provenance.settings;
    let chunks = study.points.iter().zip(units.chunks(study.seeds.len().max(1)));
    let points = chunks.map(|(point, units)| PointReport::confirmed(&study.search, *point, units)).collect();
    ConfirmReport { provenance, interval: INTERVAL, paper: &PAPER, points }
}
