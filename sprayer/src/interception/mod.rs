//! Interception: on which leaf each part of the liquid would fall if it flew straight from the nozzle.
//!
//! Every few millimetres of travel each nozzle sends a bundle of rays into its fan. A ray's share of the liquid lies on the first surface that the ray meets, by the
//! polygons of the leaves themselves, so that a canopy shields what is behind it. It is not a dose: there is no air, no drift, no drops, no run-off and no evaporation.
//!
//! The fate of a ray depends on no flow. So one pass of rays tells for any number of controllers what their liquid would have met.

mod bundles;
mod on_leaves;
mod organs;
mod row;

use std::collections::BTreeMap;

use rayon::prelude::*;
use rowscan_scenes::Orchard;
use serde::{Deserialize, Serialize};

use crate::boom::Nozzle;
use crate::flow::Flow;
use crate::pass::Pass;
use crate::span::{Span, Spans, total};
use bundles::{Bundle, Face};
use organs::Ray;
use row::{Kind, Row};

pub use on_leaves::{CellDeposit, OnLeaves, PartDeposit};

/// What no number of the interception knows of.
pub const NOT_MODELLED: &[&str] = &["air", "drift", "droplets", "run-off", "evaporation"];

/// Bundles that are worked through at one go: about 2 m of travel.
const AT_ONCE: usize = 200;

/// How finely it is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Rays of a bundle.
    pub rays: u32,
    /// Travel from one bundle to the next, metres.
    pub step_m: f64,
    /// Of the rays' random numbers.
    pub seed: u64,
}

impl Settings {
    /// Bundles of 32 rays every 10 mm.
    pub fn new(seed: u64) -> Self {
        Self { rays: 32, step_m: 0.01, seed }
    }
}

/// Where liquid goes: the first of these that applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sink {
    /// On a leaf.
    Leaf,
    /// On wood, a post or a wire.
    Wood,
    /// On a fruit.
    Fruit,
    /// To the ground, no farther behind the row than the nozzle is before it.
    GroundInRow,
    /// Past the row's axis above its highest leaf.
    Over,
    /// Past the axis where a square of 0.1 m holds no leaves.
    Gap,
    /// Past it between leaves, and all that is sprayed on the headland or at a row without leaves.
    Passed,
}

impl Sink {
    /// All of them, in their order.
    pub const ALL: [Self; 7] =
        [Self::Leaf, Self::Wood, Self::Fruit, Self::GroundInRow, Self::Over, Self::Gap, Self::Passed];

    /// Its name in outputs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leaf => "leaf",
            Self::Wood => "wood",
            Self::Fruit => "fruit",
            Self::GroundInRow => "ground_in_row",
            Self::Over => "over",
            Self::Gap => "gap",
            Self::Passed => "passed",
        }
    }

    /// True where it is off target.
    fn is_off_target(self) -> bool {
        matches!(self, Self::GroundInRow | Self::Over | Self::Gap | Self::Passed)
    }
}

/// Litres by sink.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sinks {
    /// On leaves.
    pub leaf: f64,
    /// On wood, posts and wires.
    pub wood: f64,
    /// On fruit.
    pub fruit: f64,
    /// To the ground in the row.
    pub ground_in_row: f64,
    /// Above the canopy.
    pub over: f64,
    /// Through cells without leaves.
    pub gap: f64,
    /// Through the row, or not at a row.
    pub passed: f64,
}

impl Sinks {
    fn of(&mut self, sink: Sink) -> &mut f64 {
        match sink {
            Sink::Leaf => &mut self.leaf,
            Sink::Wood => &mut self.wood,
            Sink::Fruit => &mut self.fruit,
            Sink::GroundInRow => &mut self.ground_in_row,
            Sink::Over => &mut self.over,
            Sink::Gap => &mut self.gap,
            Sink::Passed => &mut self.passed,
        }
    }

    /// Litres in one.
    pub fn litres(mut self, sink: Sink) -> f64 {
        *self.of(sink)
    }

    /// Litres in all.
    pub fn total(self) -> f64 {
        Sink::ALL.iter().map(|sink| self.litres(*sink)).sum()
    }
}

/// What a run's liquid has met.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interception {
    /// All that was sprayed.
    pub litres: f64,
    /// Litres by sink: together they are all.
    pub sinks: Sinks,
    /// Share of the litres that met no leaf, wood or fruit: `ground_in_row`, `over`, `gap` and `passed`; none where nothing was sprayed.
    pub off_target_share: Option<f64>,
    /// What leaves got; none where no leaf stands beside the drive.
    pub on_leaves: Option<OnLeaves>,
}

/// A leaf of a face, in one repetition of its row: face, repetition, leaf.
type LeafKey = (usize, i64, u32);
/// Litres by leaf.
type Deposits = BTreeMap<LeafKey, f64>;

/// What the rays of a pass have met for several runs: each with one flow a nozzle. Every run's litres are shared out exactly as they were sprayed.
pub fn intercept(pass: &Pass, orchard: &Orchard, runs: &[&[Flow]], settings: &Settings) -> Vec<Interception> {
    let bundles: Vec<(&Nozzle, Vec<Bundle>)> = pass
        .nozzles()
        .par_iter()
        .map(|nozzle| (nozzle, Bundle::of(nozzle, pass.drive(), settings.step_m, orchard.foot_m(1))))
        .collect();
    let mut faces: Vec<Face> =
        bundles.iter().flat_map(|(_, bundles)| bundles.iter().filter_map(|bundle| bundle.face)).collect();
    faces.sort_unstable();
    faces.dedup();
    let rows: Vec<Row> = faces.par_iter().map(|(row, _)| Row::of(orchard, *row)).collect();
    let work: Vec<(&Nozzle, &[Bundle])> = bundles
        .iter()
        .flat_map(|(nozzle, bundles)| bundles.chunks(AT_ONCE).map(|chunk| (*nozzle, chunk)))
        .collect();
    // Parts come back in the order of the list, whoever has done them: the same sums on any number of threads.
    let met: Vec<Vec<(Sinks, Deposits)>> = work
        .par_iter()
        .map(|(nozzle, chunk)| follow(nozzle, chunk, (&faces, &rows), runs, settings))
        .collect();
    let mut all: Vec<(Sinks, Deposits)> = vec![(Sinks::default(), Deposits::new()); runs.len()];
    for part in met {
        for ((sinks, deposits), (more, onto)) in all.iter_mut().zip(part) {
            for sink in Sink::ALL {
                *sinks.of(sink) += more.litres(sink);
            }
            for (leaf, litres) in onto {
                *deposits.entry(leaf).or_default() += litres;
            }
        }
    }
    // By face, where along the row nozzles have passed.
    let passed: Vec<Spans> = faces
        .iter()
        .map(|face| {
            let own = bundles.iter().flat_map(|(_, bundles)| bundles).filter(|b| b.face == Some(*face));
            Spans::of(own.map(Bundle::along)).joined(1e-9)
        })
        .collect();
    let each = all.into_iter().zip(runs);
    each.map(|((sinks, deposits), flows)| {
        let litres = total(flows.iter().map(Flow::litres));
        let off: f64 =
            total(Sink::ALL.iter().filter(|sink| sink.is_off_target()).map(|sink| sinks.litres(*sink)));
        Interception {
            litres,
            sinks,
            off_target_share: (litres > 0.0).then(|| (off / litres).clamp(0.0, 1.0)),
            on_leaves: OnLeaves::of(&faces, &rows, &passed, &deposits),
        }
    })
    .collect()
}

/// Follows the rays of some bundles of a nozzle, for each run.
fn follow(
    nozzle: &Nozzle,
    bundles: &[Bundle],
    (faces, rows): (&[Face], &[Row]),
    runs: &[&[Flow]],
    settings: &Settings,
) -> Vec<(Sinks, Deposits)> {
    let mut met = vec![(Sinks::default(), Deposits::new()); runs.len()];
    for bundle in bundles {
        let time = Spans::of([Span::new(bundle.time.from, bundle.time.to)]);
        let litres: Vec<f64> = runs
            .iter()
            .map(|flows| flows.get(nozzle.number).map_or(0.0, |flow| flow.litres_in(&time)))
            .collect();
        if litres.iter().all(|litres| *litres <= 0.0) {
            continue;
        }
        let place = bundle.face.and_then(|face| faces.binary_search(&face).ok());
        let Some((place, row)) = place.and_then(|place| Some((place, rows.get(place)?))) else {
            met.iter_mut().zip(&litres).for_each(|((sinks, _), litres)| sinks.passed += litres);
            continue;
        };
        for ray in bundle.rays(nozzle, row.axis_m, settings) {
            let (sink, leaf) = fate(row, ray, nozzle.jet.distance_m);
            for ((sinks, deposits), litres) in met.iter_mut().zip(&litres) {
                let share = litres / f64::from(settings.rays);
                *sinks.of(sink) += share;
                if let (Some((period, leaf)), true) = (leaf, share > 0.0) {
                    *deposits.entry((place, period, leaf)).or_default() += share;
                }
            }
        }
    }
    met
}

/// Where a ray ends, and the leaf where that is one: its repetition and number.
fn fate(row: &Row, ray: Ray, distance_m: f64) -> (Sink, Option<(i64, u32)>) {
    let ground = if ray.along.z < 0.0 { -ray.from.z / ray.along.z } else { f64::INFINITY };
    if let Some(met) = row.first(ray).filter(|met| met.t <= ground) {
        return match met.kind {
            Kind::Leaf(leaf) => (Sink::Leaf, Some((met.period, leaf))),
            Kind::Wood => (Sink::Wood, None),
            Kind::Fruit => (Sink::Fruit, None),
        };
    }
    if ground.is_finite() && (ray.at(ground).x - row.axis_m).abs() <= distance_m {
        return (Sink::GroundInRow, None);
    }
    let Some(top_m) = row.top_m else { return (Sink::Passed, None) };
    let at = ray.at(distance_m / ray.along.x.abs());
    // Who sprays away from the row, upwards, sprays over it.
    let is_away = (row.axis_m - ray.from.x) * ray.along.x <= 0.0;
    if at.z > top_m || is_away && ray.along.z > 0.0 {
        return (Sink::Over, None);
    }
    let is_gap = !is_away && !row.has_leaves(at.y, at.z);
    (if is_gap { Sink::Gap } else { Sink::Passed }, None)
}
