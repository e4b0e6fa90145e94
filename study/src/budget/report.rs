//! Budgets of many rows, summed up: percent of the truth.

use serde::Serialize;

use super::{Budget, Term};

/// The terms of every estimator.
#[derive(Clone, Debug, Serialize)]
pub struct BudgetReport {
    /// The scene.
    pub scene: String,
    /// The scanner.
    pub model: String,
    /// One row a term, estimator by estimator: the terms in their order, `rest`, `total`.
    pub terms: Vec<TermSummary>,
    /// Row by row.
    pub rows: Vec<Budget>,
}

/// One term of one estimator over all rows, relative to the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermSummary {
    /// The estimator.
    pub estimator: &'static str,
    /// The term, or `rest`, or `total`.
    pub term: &'static str,
    /// Rows.
    pub n: usize,
    /// Mean over the rows.
    pub mean: Option<f64>,
    /// Standard deviation over the rows.
    pub sd: Option<f64>,
}

/// Sums budgets up.
pub fn report(scene: &str, model: &str, rows: Vec<Budget>) -> BudgetReport {
    let mut estimators: Vec<&'static str> = Vec::new();
    for row in &rows {
        if !estimators.contains(&row.estimator) {
            estimators.push(row.estimator);
        }
    }
    let mut terms = Vec::new();
    for estimator in estimators {
        let own: Vec<&Budget> =
            rows.iter().filter(|row| row.estimator == estimator && row.truth_m2 > 0.0).collect();
        let mut add = |term, of: &dyn Fn(&Budget) -> Option<f64>| {
            let values: Vec<f64> = own.iter().filter_map(|row| of(row).map(|m2| m2 / row.truth_m2)).collect();
            terms.push(summary(estimator, term, &values));
        };
        for (number, term) in Term::ALL.into_iter().enumerate() {
            add(term.name(), &|row| row.terms_m2.get(number).copied().flatten());
        }
        add("rest", &|row| Some(row.rest_m2));
        add("total", &|row| Some(row.estimate_m2 - row.truth_m2));
    }
    BudgetReport { scene: scene.to_owned(), model: model.to_owned(), terms, rows }
}

fn summary(estimator: &'static str, term: &'static str, values: &[f64]) -> TermSummary {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    TermSummary {
        estimator,
        term,
        n,
        mean: (n > 0).then_some(mean),
        sd: (n > 1).then(|| (squares / (n as f64 - 1.0)).sqrt()),
    }
}
