//! The matrix: fitted on one class, tried on another.

use rowscan_canopy::{ClassKey, ScanGeometry};
use serde::Serialize;

use super::fits::{ESTIMATORS, Fits};
use super::{TransferRow, TransferStudy};
use crate::{Header, Unit};

/// What the study found.
#[derive(Clone, Debug, Serialize)]
pub struct TransferReport {
    /// Version, seed, scene, settings.
    pub provenance: Header<TransferStudy>,
    /// Every axis' matrix, estimator by estimator: fitted on one class, tried on one.
    pub matrix: Vec<Carried>,
    /// Fitted on all classes of the axis but one, tried on that.
    pub left_out: Vec<LeftOut>,
    /// How far apart the classes of an axis are.
    pub between_class: Vec<BetweenRow>,
}

/// One cell of a matrix.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Carried {
    /// The axis.
    pub axis: String,
    /// The estimator.
    pub estimator: &'static str,
    /// The class it was fitted on.
    pub train: String,
    /// The class it was tried on.
    pub test: String,
    /// What was found.
    #[serde(flatten)]
    pub error: Error,
}

/// One class left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LeftOut {
    /// The axis.
    pub axis: String,
    /// The class left out, and tried on.
    pub test: String,
    /// The estimator.
    pub estimator: &'static str,
    /// What was found.
    #[serde(flatten)]
    pub error: Error,
}

/// Relative errors of some rows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Error {
    /// Rows.
    pub n: usize,
    /// Mean of estimate / truth − 1; null where the estimator could not be fitted.
    pub bias: Option<f64>,
    /// Root mean square of the same.
    pub rmse: Option<f64>,
}

/// How far apart the classes of an axis are for an estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BetweenRow {
    /// The axis.
    pub axis: String,
    /// The estimator.
    pub estimator: &'static str,
    /// Root mean square of the bias over all ordered pairs of different classes; of one without a fit, over the classes.
    pub relative_sd: f64,
    /// How far apart those classes are in the property, root mean square ([`ClassKey::apart`]); of an estimator without a fit, from what it assumes.
    /// `None` where the axis is no number of a class.
    pub apart: Option<f64>,
}

impl Error {
    fn of<'a>(fits: &Fits, estimator: &str, rows: impl Iterator<Item = &'a TransferRow>) -> Self {
        let relative = |row: &TransferRow| {
            (row.truth_m2 > 0.0).then_some(fits.leaf_area_m2(estimator, row)? / row.truth_m2 - 1.0)
        };
        let errors: Vec<f64> = rows.filter_map(relative).filter(|error| error.is_finite()).collect();
        let n = errors.len();
        let mean = |of: fn(f64) -> f64| {
            (n > 0).then(|| errors.iter().map(|error| of(*error)).sum::<f64>() / n as f64)
        };
        Self { n, bias: mean(|error| error), rmse: mean(|error| error * error).map(f64::sqrt) }
    }
}

/// The rows of a study, class by class.
struct Rows<'a> {
    units: &'a [Unit<TransferRow>],
    a_class: usize,
}

impl<'a> Rows<'a> {
    /// A class's rows to fit on, or to try on.
    fn half(&self, class: usize, fitted: bool) -> impl Iterator<Item = &'a TransferRow> + Clone + use<'a> {
        let (from, rows) = (class * self.a_class, self.a_class);
        let own = move |unit: &&Unit<TransferRow>| {
            (from..from + rows).contains(&unit.index) && (unit.index - from < rows / 2) == fitted
        };
        self.units.iter().filter(own).map(|unit| &unit.result)
    }

    /// A property's mean over a class's rows.
    fn number(&self, class: usize, key: ClassKey) -> Option<f64> {
        let rows = [true, false].into_iter().flat_map(|fitted| self.half(class, fitted));
        let numbers: Option<Vec<f64>> = rows
            .map(|row| {
                let TransferRow { distance_m, height_m, line_spacing_m, crown_depth_m, .. } = *row;
                let geometry = ScanGeometry { distance_m, height_m, line_spacing_m, crown_depth_m };
                key.number(&row.canopy, geometry)
            })
            .collect();
        numbers
            .filter(|numbers| !numbers.is_empty())
            .map(|numbers| rowscan_canopy::regression::mean(&numbers))
    }
}

/// Sums a whole study up.
pub fn report(provenance: Header<TransferStudy>, units: &[Unit<TransferRow>]) -> TransferReport {
    let study = &provenance.settings;
    let rows = Rows { units, a_class: study.rows };
    let classes = &study.classes.classes;
    let (mut matrix, mut left_out, mut between_class) = (Vec::new(), Vec::new(), Vec::new());
    for axis in study.classes.axes() {
        let own: Vec<usize> =
            (0..classes.len()).filter(|k| classes.get(*k).is_some_and(|c| c.axis == axis)).collect();
        let name = |k: usize| classes.get(k).map(|class| class.name.clone()).unwrap_or_default();
        let fits: Vec<(usize, Fits)> = own.iter().map(|k| (*k, Fits::on(rows.half(*k, true)))).collect();
        let first = matrix.len();
        for estimator in ESTIMATORS {
            for (train, fit) in &fits {
                matrix.extend(own.iter().map(|test| Carried {
                    axis: axis.to_owned(),
                    estimator,
                    train: name(*train),
                    test: name(*test),
                    error: Error::of(fit, estimator, rows.half(*test, false)),
                }));
            }
        }
        for test in &own {
            let others: Vec<&TransferRow> =
                own.iter().filter(|k| *k != test).flat_map(|k| rows.half(*k, true)).collect();
            let fit = Fits::on(others.iter().copied());
            left_out.extend(ESTIMATORS.map(|estimator| LeftOut {
                axis: axis.to_owned(),
                test: name(*test),
                estimator,
                error: Error::of(&fit, estimator, rows.half(*test, false)),
            }));
        }
        let cells = matrix.get(first..).unwrap_or_default();
        let key = ClassKey::by_name(axis);
        let number = |name: &str| {
            let class = own.iter().find(|k| classes.get(**k).is_some_and(|class| class.name == name))?;
            rows.number(*class, key?)
        };
        between_class.extend(ESTIMATORS.iter().filter_map(|estimator| {
            let (relative_sd, pairs) = between(estimator, cells)?;
            let apart = key.and_then(|key| apart(key, &pairs, number));
            Some(BetweenRow { axis: axis.to_owned(), estimator, relative_sd, apart })
        }));
    }
    TransferReport { matrix, left_out, between_class, provenance }
}

/// Two classes: the one fitted on, none where nothing is fitted, and the one tried.
type Pair<'a> = (Option<&'a str>, &'a str);

/// Root mean square of an estimator's biases, and the classes that each is between.
fn between<'a>(estimator: &str, cells: &'a [Carried]) -> Option<(f64, Vec<Pair<'a>>)> {
    let fitted = estimator != "contact_raw";
    let counts = |cell: &&Carried| cell.estimator == estimator && (!fitted || cell.train != cell.test);
    let pair = |cell: &'a Carried| (fitted.then_some(cell.train.as_str()), cell.test.as_str());
    let (biases, pairs): (Vec<f64>, Vec<Pair<'_>>) =
        cells.iter().filter(counts).filter_map(|cell| Some((cell.error.bias?, pair(cell)))).unzip();
    root_mean_square(&biases).map(|sd| (sd, pairs))
}

/// How far apart the classes of these pairs are; what nothing is fitted on is what the contact frequency assumes.
fn apart(key: ClassKey, pairs: &[(Option<&str>, &str)], number: impl Fn(&str) -> Option<f64>) -> Option<f64> {
    let of_pair = |(train, test): &(Option<&str>, &str)| {
        let expected = train.map_or_else(|| key.assumed(), &number)?;
        Some(key.apart(expected, number(test)?)).filter(|apart| apart.is_finite())
    };
    let apart: Option<Vec<f64>> = pairs.iter().map(of_pair).collect();
    root_mean_square(&apart?)
}

fn root_mean_square(values: &[f64]) -> Option<f64> {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    Some((squares / values.len() as f64).sqrt()).filter(|found| found.is_finite())
}

impl TransferReport {
    /// The table that intervals take their between-class term from: canopy's `between-class.csv`.
    pub fn between_class_csv(&self, command: &str) -> String {
        let header = &self.provenance;
        let mut text = format!(
            "# {command}\n# rowscan {}, seed {}, scene {} ({}), {} rows a class\nproperty,estimator,relative_sd,apart\n",
            header.rowscan, header.seed, header.scene, header.scene_hash, header.settings.rows
        );
        let kept = |row: &&BetweenRow| {
            ClassKey::by_name(&row.axis).is_some_and(|key| !key.is_number() || row.apart.is_some())
                && ["contact", "contact_raw"].contains(&row.estimator)
        };
        for row in self.between_class.iter().filter(kept) {
            let apart = row.apart.map(|apart| format!("{apart:.4}")).unwrap_or_default();
            text.push_str(&format!("{},{},{:.4},{apart}\n", row.axis, row.estimator, row.relative_sd));
        }
        text
    }
}
