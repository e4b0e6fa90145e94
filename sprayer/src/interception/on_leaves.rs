//! What leaves got, by cell of the row's plane, by tree, height and depth.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::bundles::Face;
use super::row::{LeafFacts, Row};
use super::{Deposits, LeafKey};
use crate::span::Spans;

/// Length of a cell along the row, metres.
const CELL_M: f64 = 0.1;
/// Height of a band, metres: that of the canopy messages on the bus.
const BAND_M: f64 = 0.5;
/// Names of the thirds of the canopy's depth, from the nozzle.
const THIRDS: [&str; 3] = ["near", "middle", "far"];
/// Millilitres of a litre.
const ML: f64 = 1e3;

/// Interception on leaves, mL a square metre of one-sided leaf area. Cells are 0.1 m along the row and 0.5 m high; those without leaves are none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OnLeaves {
    /// Leaf area that stood beside the nozzles' way, one-sided, m².
    pub leaf_area_m2: f64,
    /// Litres that fell on it.
    pub litres: f64,
    /// Mean over the leaf area, mL/m².
    pub mean_ml_m2: f64,
    /// Standard deviation of cells, weighted by their leaf area, over the mean; none where nothing fell on leaves.
    pub cv: Option<f64>,
    /// Five percent of the leaf area is in cells that got less, mL/m².
    pub p5_ml_m2: f64,
    /// Five percent is in cells that got more, mL/m².
    pub p95_ml_m2: f64,
    /// The cell that got least by leaf area.
    pub lowest: CellDeposit,
    /// The cell that got most.
    pub highest: CellDeposit,
    /// By tree, in the order of rows and places. In a row that repeats, trees count on, and those of repetitions are marked.
    pub by_tree: Vec<PartDeposit>,
    /// By band of height.
    pub by_band: Vec<PartDeposit>,
    /// By thirds of the canopy's depth from the nozzles. A row that is sprayed from both sides counts twice, each time with what came from that side.
    pub by_depth: Vec<PartDeposit>,
}

/// A cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellDeposit {
    /// Its row.
    pub row: i32,
    /// Its beginning along the row, metres.
    pub y_m: f64,
    /// Its lower end, metres.
    pub z_m: f64,
    /// What it got, mL/m².
    pub ml_m2: f64,
}

/// A part of the canopy.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartDeposit {
    /// Which.
    pub part: String,
    /// Its leaf area, m².
    pub leaf_area_m2: f64,
    /// What it got, mL/m².
    pub ml_m2: f64,
    /// True of a tree of a repetition of the row, before its beginning or behind its end.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub repeated: bool,
}

/// Leaf area, m², and litres on it.
#[derive(Clone, Copy, Debug, Default)]
struct Got(f64, f64);

impl Got {
    fn add(&mut self, area_m2: f64, litres: f64) {
        self.0 += area_m2;
        self.1 += litres;
    }

    fn ml_m2(self) -> f64 {
        self.1 / self.0 * ML
    }
}

/// Row, place along it, band.
type Cell = (i32, i64, i64);

#[derive(Default)]
struct Sums {
    cells: BTreeMap<Cell, Got>,
    /// By row and tree; the tree is marked that is of a repetition.
    trees: BTreeMap<(i32, i64, bool), Got>,
    bands: BTreeMap<i64, Got>,
    thirds: [Got; 3],
    all: Got,
}

impl OnLeaves {
    pub(super) fn of(faces: &[Face], rows: &[Row], passed: &[Spans], deposits: &Deposits) -> Option<Self> {
        let mut sums = Sums::default();
        let mut before: Option<(i32, &Spans)> = None;
        for (place, ((face, row), passed)) in faces.iter().zip(rows).zip(passed).enumerate() {
            // The two faces of a row follow each other: its leaves are there once.
            let counted = before.filter(|(number, _)| *number == face.0).map(|(_, passed)| passed);
            sums.add_face(place, *face, row, (passed, counted), deposits);
            before = Some((face.0, passed));
        }
        sums.told()
    }
}

impl Sums {
    fn add_face(
        &mut self,
        place: usize,
        (number, towards_x): Face,
        row: &Row,
        (passed, counted): (&Spans, Option<&Spans>),
        deposits: &Deposits,
    ) {
        let xs = row.leaves.iter().map(|leaf| leaf.at.x);
        let (low, high) =
            xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let trees = row.leaves.iter().map(|leaf| i64::from(leaf.tree) + 1).max().unwrap_or(0);
        for (leaf, facts, period, y_m) in images(row, passed) {
            let key: LeafKey = (place, period, leaf);
            let litres = deposits.get(&key).copied().unwrap_or(0.0);
            let into = if towards_x { facts.at.x - low } else { high - facts.at.x };
            let third = if high > low { ((into / (high - low) * 3.0) as usize).min(2) } else { 0 };
            self.thirds[third].add(facts.area_m2, litres);
            // What came from the other side is in that face's turn; the area only once.
            let area_m2 = if counted.is_some_and(|counted| counted.has(y_m)) { 0.0 } else { facts.area_m2 };
            let band = (facts.at.z / BAND_M).floor() as i64;
            let cell = (number, (y_m / CELL_M).floor() as i64, band);
            self.cells.entry(cell).or_default().add(area_m2, litres);
            self.trees
                .entry((number, i64::from(facts.tree) + period * trees, period != 0))
                .or_default()
                .add(area_m2, litres);
            self.bands.entry(band).or_default().add(area_m2, litres);
            self.all.add(area_m2, litres);
        }
    }

    fn told(self) -> Option<OnLeaves> {
        let Self { cells, trees, bands, thirds, all } = self;
        let mut cells: Vec<(Cell, Got)> = cells.into_iter().filter(|(_, got)| got.0 > 0.0).collect();
        cells.sort_by(|(_, a), (_, b)| a.ml_m2().total_cmp(&b.ml_m2()));
        let told = |((row, along, band), got): (Cell, Got)| CellDeposit {
            row,
            y_m: along as f64 * CELL_M,
            z_m: band as f64 * BAND_M,
            ml_m2: got.ml_m2(),
        };
        let mean = all.ml_m2();
        let square: f64 = cells.iter().map(|(_, got)| got.0 * (got.ml_m2() - mean).powi(2)).sum();
        let below = |share: f64| {
            let mut area_m2 = 0.0;
            let found = cells.iter().find(|(_, got)| {
                area_m2 += got.0;
                area_m2 >= share * all.0
            });
            found.or(cells.last()).map_or(0.0, |(_, got)| got.ml_m2())
        };
        let part = |part: String, got: Got| PartDeposit {
            part,
            leaf_area_m2: got.0,
            ml_m2: got.ml_m2(),
            repeated: false,
        };
        Some(OnLeaves {
            leaf_area_m2: all.0,
            litres: all.1,
            mean_ml_m2: mean,
            cv: (mean > 0.0).then(|| (square / all.0).sqrt() / mean),
            p5_ml_m2: below(0.05),
            p95_ml_m2: below(0.95),
            lowest: told(*cells.first()?),
            highest: told(*cells.last()?),
            by_tree: trees
                .into_iter()
                .filter(|(_, got)| got.0 > 0.0)
                .map(|((row, tree, repeated), got)| PartDeposit {
                    repeated,
                    ..part(format!("row {row}, tree {tree}"), got)
                })
                .collect(),
            by_band: bands
                .into_iter()
                .map(|(band, got)| {
                    let from_m = band as f64 * BAND_M;
                    part(format!("{from_m:.1} to {:.1} m", from_m + BAND_M), got)
                })
                .collect(),
            by_depth: THIRDS
                .iter()
                .zip(thirds)
                .filter(|(_, got)| got.0 > 0.0)
                .map(|(name, got)| part((*name).to_owned(), got))
                .collect(),
        })
    }
}

/// The leaves of a row, in every repetition in which they stand beside the nozzles' way: number, facts, repetition, place along the row.
fn images<'a>(row: &'a Row, passed: &'a Spans) -> impl Iterator<Item = (u32, &'a LeafFacts, i64, f64)> + 'a {
    let length_m = row.length_m;
    let ends = passed.iter().map(|span| (span.from, span.to));
    let (from, to) =
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (a, b)| (low.min(a), high.max(b)));
    (0..).zip(&row.leaves).flat_map(move |(number, facts)| {
        let periods = if length_m.is_finite() && from <= to {
            let period = |y: f64| ((y - facts.at.y) / length_m).floor() as i64;
            period(from)..=period(to)
        } else {
            0..=0
        };
        periods.filter_map(move |period| {
            let y_m = if period == 0 { facts.at.y } else { facts.at.y + period as f64 * length_m };
            passed.has(y_m).then_some((number, facts, period, y_m))
        })
    })
}
