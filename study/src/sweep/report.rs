//! What a sweep found: every unit as a row, and each axis' effect on each output.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Map, Value as Json, json};
use toml::Value;

use super::design::{Axis, Design, Span};
use super::{SweepStudy, Tried};
use crate::{Header, Unit};

/// What the study found.
#[derive(Clone, Debug, Serialize)]
pub struct SweepReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<SweepStudy>,
    /// Units that could not be tried.
    pub refused: usize,
    /// One object a unit: point, repeat, seed, the swept keys, the outputs, and where it comes from.
    pub rows: Vec<Map<String, Json>>,
    /// Each axis' effect on each output, all other axes at whatever they were.
    pub effects: Vec<Effect>,
}

/// An output at one value (or part of the range) of one axis, over all else.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// The axis.
    pub axis: String,
    /// The value, or the part of the range.
    pub at: String,
    /// The middle of the part, or the value, if it is a number.
    pub x: Option<f64>,
    /// The output.
    pub output: String,
    /// Units with a value.
    pub n: usize,
    /// Orchards among them, by their seeds: one that stands at several points is one sample of what orchards differ by.
    pub orchards: usize,
    /// Units that were tried there: of the others the output is withheld or unknown, and the mean is not theirs.
    pub of: usize,
    /// Mean; not a number where no unit has a value.
    pub mean: f64,
    /// Its standard error, over orchards: units of one orchard err together. None of fewer than two orchards.
    pub mean_se: Option<f64>,
    /// Standard deviation; none of fewer than two values.
    pub sd: Option<f64>,
    /// Mean of the absolute values.
    pub mean_abs: f64,
    /// Standard error of the mean of the absolute values, over orchards as well.
    pub mean_abs_se: Option<f64>,
}

/// Sums a whole study up.
pub fn report(provenance: Header<SweepStudy>, units: &[Unit<Tried>]) -> SweepReport {
    let study = &provenance.settings;
    let points: Vec<Settings<'_>> = (0..study.points()).map(|point| study.settings(point)).collect();
    let of = |unit: &Unit<Tried>| points.get(study.case(unit.index).0).map_or(&[][..], Vec::as_slice);
    let rows = units.iter().map(|unit| row(&provenance, unit, of(unit))).collect();
    let refused = units.iter().filter(|unit| unit.result.refused.is_some()).count();
    let mut effects = Vec::new();
    let mut first = 0;
    for axis in &study.sweep {
        let own = |unit: &Unit<Tried>| -> Vec<&Value> {
            of(unit).iter().skip(first).take(axis.keys.len()).map(|(_, value)| value).collect()
        };
        for (column, output) in study.keep.iter().enumerate() {
            for part in &parts(axis, study.design) {
                let there = || units.iter().filter(|unit| part.holds(&own(unit)));
                let value = |unit: &Unit<Tried>| {
                    Some((unit.result.seed, unit.result.kept.get(column).copied().flatten()?))
                };
                let values: Vec<(u64, f64)> = there().filter_map(value).collect();
                let of = there().count();
                if of > 0 {
                    effects.push(Effect { of, ..Effect::of(axis, part, output.name(), &values) });
                }
            }
        }
        first += axis.keys.len();
    }
    SweepReport { refused, rows, effects, provenance }
}

/// The keys set at a point.
type Settings<'a> = Vec<(&'a str, Value)>;

fn row(provenance: &Header<SweepStudy>, unit: &Unit<Tried>, settings: &[(&str, Value)]) -> Map<String, Json> {
    let study = &provenance.settings;
    let (point, repeat) = study.case(unit.index);
    let mut row = Map::new();
    row.insert("point".to_owned(), json!(point));
    row.insert("repeat".to_owned(), json!(repeat));
    row.insert("orchard_seed".to_owned(), json!(unit.result.seed));
    for (key, value) in settings {
        row.insert((*key).to_owned(), json!(value));
    }
    for (output, value) in study.keep.iter().zip(&unit.result.kept) {
        row.insert(output.name().to_owned(), json!(value));
    }
    row.insert("refused".to_owned(), json!(unit.result.refused));
    row.insert("study".to_owned(), json!(study.name));
    row.insert("study_seed".to_owned(), json!(provenance.seed));
    row.insert("scene_hash".to_owned(), json!(provenance.scene_hash));
    row.insert("rowscan".to_owned(), json!(provenance.rowscan));
    row
}

/// One value of an axis, or one part of its range.
enum Part {
    Value(Vec<Value>),
    Range { from: f64, to: f64, last: bool },
}

/// What an axis is told at: the values that were computed, or where each point has its own, parts of the range.
fn parts(axis: &Axis, design: Design) -> Vec<Part> {
    match (&axis.span, design) {
        (Span::Values(values), _) => values.iter().cloned().map(Part::Value).collect(),
        (Span::Range { steps, .. }, Design::Grid) => {
            (0..*steps).map(|step| Part::Value(axis.step(step))).collect()
        }
        (Span::Range { from, to, steps, .. }, Design::LatinHypercube { .. }) => {
            let edge = |k: usize| from + (to - from) * k as f64 / *steps as f64;
            (0..*steps)
                .map(|k| Part::Range { from: edge(k), to: edge(k + 1), last: k + 1 == *steps })
                .collect()
        }
    }
}

impl Part {
    fn holds(&self, own: &[&Value]) -> bool {
        match self {
            Self::Value(values) => values.iter().eq(own.iter().copied()),
            Self::Range { from, to, last } => own
                .first()
                .and_then(|value| value.as_float().or_else(|| value.as_integer().map(|value| value as f64)))
                .is_some_and(|value| value >= *from && (value < *to || (*last && value <= *to))),
        }
    }

    fn name(&self) -> String {
        match self {
            Self::Value(values) => {
                let text = |value: &Value| match value {
                    Value::String(text) => text.clone(),
                    // A step between two numbers has rounding errors that nobody set.
                    Value::Float(value) => format!("{}", (value * 1e9).round() / 1e9),
                    other => other.to_string(),
                };
                // Keys that go together by one range have one value.
                let mut texts: Vec<String> = values.iter().map(text).collect();
                if values.windows(2).all(|two| two[0] == two[1]) {
                    texts.truncate(1);
                }
                texts.join(" ")
            }
            Self::Range { from, to, .. } => format!("{from:.3} to {to:.3}"),
        }
    }

    fn x(&self) -> Option<f64> {
        match self {
            Self::Value(values) => match values.as_slice() {
                [first, rest @ ..] if rest.iter().all(|value| value == first) => {
                    first.as_float().or_else(|| first.as_integer().map(|value| value as f64))
                }
                _ => None,
            },
            Self::Range { from, to, .. } => Some((from + to) / 2.0),
        }
    }
}

impl Effect {
    /// Of these values, each with its orchard's seed.
    fn of(axis: &Axis, part: &Part, output: &str, of_orchards: &[(u64, f64)]) -> Self {
        let values: Vec<f64> = of_orchards.iter().map(|(_, value)| *value).collect();
        let sizes: Vec<(u64, f64)> = of_orchards.iter().map(|(seed, value)| (*seed, value.abs())).collect();
        let (mean, orchards) = mean_of_orchards(of_orchards);
        let (mean_abs, _) = mean_of_orchards(&sizes);
        Self {
            axis: axis.name(),
            at: part.name(),
            x: part.x(),
            output: output.to_owned(),
            n: values.len(),
            orchards,
            of: values.len(),
            mean: mean.value,
            mean_se: mean.standard_error,
            sd: deviation(&values),
            mean_abs: mean_abs.value,
            mean_abs_se: mean_abs.standard_error,
        }
    }
}

/// A mean, and how far it may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mean {
    value: f64,
    standard_error: Option<f64>,
}

/// The mean of values, each with its orchard's seed, and how many orchards there are. Values of one orchard are no samples of their own: what an orchard's values are off by
/// together counts once (the variance of a mean of clusters, with G/(G − 1) for G of them). Where each value has an orchard of its own, it is sd/√n.
fn mean_of_orchards(values: &[(u64, f64)]) -> (Mean, usize) {
    let n = values.len() as f64;
    let mean = values.iter().map(|(_, value)| value).sum::<f64>() / n;
    let mut off: BTreeMap<u64, f64> = BTreeMap::new();
    for (seed, value) in values {
        *off.entry(*seed).or_default() += value - mean;
    }
    let orchards = off.len() as f64;
    let squares: f64 = off.values().map(|off| off * off).sum();
    let standard_error = (orchards > 1.0).then(|| (orchards / (orchards - 1.0) * squares).sqrt() / n);
    (Mean { value: mean, standard_error }, off.len())
}

/// The standard deviation; none of fewer than two values, which say nothing of their spread.
fn deviation(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (n > 1.0).then(|| (squares / (n - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_orchard_that_stands_at_several_points_is_one_sample() {
        let values = [(1, 3.0), (2, 5.0), (3, 4.0), (4, 9.0)];
        let (once, orchards) = mean_of_orchards(&values);
        let alone: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
        let of_single = deviation(&alone).expect("four") / 2.0;
        assert!((once.standard_error.expect("four") - of_single).abs() < 1e-12 && orchards == 4);
        // However often each is tried, nothing more is known of orchards.
        for times in [2, 3, 10] {
            let (again, orchards) = mean_of_orchards(&values.repeat(times));
            assert_eq!((again.value, orchards), (once.value, 4), "{times}");
            assert!((again.standard_error.expect("four") - of_single).abs() < 1e-12, "{times}");
        }
        assert_eq!(mean_of_orchards(&[(7, 1.0), (7, 2.0)]).0.standard_error, None, "one orchard");
    }

    #[test]
    fn the_deviation_of_one_value_is_unknown_and_no_zero() {
        assert_eq!((deviation(&[]), deviation(&[3.0])), (None, None));
        assert_eq!((deviation(&[3.0, 3.0]), deviation(&[1.0, 3.0])), (Some(0.0), Some(2.0_f64.sqrt())));
    }
}
