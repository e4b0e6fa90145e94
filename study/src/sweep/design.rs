//! Points of a sweep: every combination, or a Latin hypercube.

use rowscan_protocol::random::Stream;
use serde::{Deserialize, Serialize};
use toml::Value;

use crate::{Setting, fingerprint};

/// How axes are combined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Design {
    /// Every value of every axis with every other.
    Grid,
    /// So many points; each axis is cut in as many even parts, and every part is used once (McKay et al. 1979, Technometrics 21:239).
    LatinHypercube {
        /// Points.
        points: usize,
    },
}

/// One thing that is swept: a key, or several keys that go together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// The keys set.
    pub keys: Vec<String>,
    /// What they are set to.
    pub span: Span,
}

/// The values of an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Span {
    /// One list a value: as many entries as keys.
    Values(Vec<Vec<Value>>),
    /// From one number to another; in a grid, at so many even steps.
    Range {
        /// Smallest.
        from: f64,
        /// Greatest.
        to: f64,
        /// Values in a grid, both ends among them; parts that a report cuts the range of another design in.
        steps: usize,
        /// The keys take whole numbers alone.
        #[serde(default)]
        whole: bool,
    },
}

impl Axis {
    /// What it is called: its keys without their tables.
    pub fn name(&self) -> String {
        let names: Vec<&str> =
            self.keys.iter().map(|key| key.rsplit('.').next().unwrap_or(key.as_str())).collect();
        names.join(" + ")
    }

    fn steps(&self) -> usize {
        match &self.span {
            Span::Values(values) => values.len(),
            Span::Range { steps, .. } => *steps,
        }
    }

    /// The value at a place in [0, 1).
    fn at(&self, place: f64) -> Vec<Value> {
        match &self.span {
            Span::Values(values) => {
                let index = ((place * values.len() as f64) as usize).min(values.len().saturating_sub(1));
                values.get(index).cloned().unwrap_or_default()
            }
            Span::Range { from, to, whole: true, .. } => {
                vec![
                    Value::Integer((from + (place * (to - from + 1.0)).floor()).min(*to) as i64);
                    self.keys.len()
                ]
            }
            Span::Range { from, to, .. } => vec![Value::Float(from + place * (to - from)); self.keys.len()],
        }
    }

    /// The value at a step of a grid.
    pub(super) fn step(&self, step: usize) -> Vec<Value> {
        match &self.span {
            Span::Values(values) => values.get(step).cloned().unwrap_or_default(),
            Span::Range { from, to, steps, whole } => {
                let value = from + (to - from) * step as f64 / (steps.saturating_sub(1)).max(1) as f64;
                let value = if *whole { Value::Integer(value.round() as i64) } else { Value::Float(value) };
                vec![value; self.keys.len()]
            }
        }
    }

    /// The same axis of whole numbers, where its ends and, in a grid, its steps are such.
    pub(super) fn whole(&self, design: Design) -> Option<Self> {
        let Span::Range { from, to, steps, .. } = self.span else { return None };
        let between =
            if design == Design::Grid { (to - from) / (steps.saturating_sub(1)).max(1) as f64 } else { 1.0 };
        let are_whole = [from, to, between].iter().all(|number| number.fract() == 0.0);
        are_whole
            .then(|| Self { keys: self.keys.clone(), span: Span::Range { from, to, steps, whole: true } })
    }
}

impl Design {
    /// How many points there are.
    pub fn points(self, axes: &[Axis]) -> usize {
        match self {
            Self::Grid => axes.iter().map(Axis::steps).fold(1, usize::saturating_mul),
            Self::LatinHypercube { points } => points,
        }
    }

    /// The keys at a point with their values.
    pub fn settings(self, axes: &[Axis], point: usize, seed: u64) -> Vec<Setting<'_>> {
        let mut rest = point;
        let mut settings = Vec::new();
        for axis in axes {
            let values = match self {
                Self::Grid => {
                    let step = rest % axis.steps().max(1);
                    rest /= axis.steps().max(1);
                    axis.step(step)
                }
                Self::LatinHypercube { points } => axis.at(latin(&axis.name(), seed, point, points)),
            };
            settings.extend(axis.keys.iter().map(String::as_str).zip(values));
        }
        settings
    }
}

/// What is drawn for a point on an axis: the order of its part, and its place within it.
const ORDER: u64 = 0;
const PLACE: u64 = 1;

/// Where a point lies on an axis: its part by a random order of the parts, and a random place within the part.
fn latin(axis: &str, seed: u64, point: usize, points: usize) -> f64 {
    // A fingerprint tells keys apart; numbers in sequence are ordered by one lattice for every key, and the axes would go together.
    let key = fingerprint::seed(axis, seed, 0);
    let draw = |k: usize, what: u64| Stream::keyed(key, &[k as u64, what]).unit();
    let own = draw(point, ORDER);
    let part = (0..points).filter(|other| (draw(*other, ORDER), *other) < (own, point)).count();
    let within = draw(point, PLACE);
    (part as f64 + within) / points as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes() -> Vec<Axis> {
        let value = |v: f64| vec![Value::Float(v)];
        vec![
            Axis { keys: vec!["rig.a".into()], span: Span::Values(vec![value(1.0), value(2.0), value(3.0)]) },
            Axis {
                keys: vec!["rig.b".into()],
                span: Span::Range { from: 0.0, to: 1.0, steps: 2, whole: false },
            },
        ]
    }

    #[test]
    fn a_grid_holds_every_combination_once() {
        let axes = axes();
        assert_eq!(Design::Grid.points(&axes), 6);
        let mut all: Vec<String> =
            (0..6).map(|point| format!("{:?}", Design::Grid.settings(&axes, point, 1))).collect();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), 6);
    }

    #[test]
    fn a_latin_hypercube_uses_every_part_of_every_axis_once() {
        let (axes, points) = (axes(), 30);
        let design = Design::LatinHypercube { points };
        let settings: Vec<_> = (0..points).map(|point| design.settings(&axes, point, 7)).collect();
        for value in [1.0, 2.0, 3.0] {
            assert_eq!(settings.iter().filter(|s| s[0].1 == Value::Float(value)).count(), 10);
        }
        let mut parts: Vec<usize> =
            settings.iter().map(|s| (s[1].1.as_float().unwrap_or(-1.0) * 30.0) as usize).collect();
        parts.sort_unstable();
        assert_eq!(parts, (0..points).collect::<Vec<_>>());
        assert_ne!(settings, (0..points).map(|p| design.settings(&axes, p, 8)).collect::<Vec<_>>());
    }

    /// What an axis does is told over all values of the others: that needs axes that do not go together.
    #[test]
    fn axes_of_a_latin_hypercube_do_not_go_together() {
        let span = || Span::Range { from: 0.0, to: 1.0, steps: 2, whole: false };
        let names = ["rig.speed_m_s", "sprayer.sections", "rig.scanner.height_m", "a", "b"];
        let axes: Vec<Axis> = names.map(|name| Axis { keys: vec![name.into()], span: span() }).into();
        let points = 60;
        let mut squares = Vec::new();
        for seed in 1..=10 {
            let column = |axis: usize| -> Vec<f64> {
                let place =
                    |point| Design::LatinHypercube { points }.settings(&axes, point, seed)[axis].1.clone();
                (0..points).map(|point| place(point).as_float().unwrap_or(f64::NAN) - 0.5).collect()
            };
            let columns: Vec<Vec<f64>> = (0..axes.len()).map(column).collect();
            let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            for (n, a) in columns.iter().enumerate() {
                for b in &columns[..n] {
                    let r = product(a, b) / (product(a, a) * product(b, b)).sqrt();
                    // Independent orders have a standard deviation of 1/√59 = 0.13.
                    assert!(r.abs() < 0.52, "seed {seed}: {r}");
                    squares.push(r * r);
                }
            }
        }
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((0.10..0.16).contains(&rms), "{rms}");
    }
}
