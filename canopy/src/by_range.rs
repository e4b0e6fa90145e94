//! What depends on the range alone, worked out once: it costs too much for every beam.

/// Values by range.
#[derive(Clone, Debug, Default)]
pub(crate) struct ByRange {
    values: Vec<f64>,
}

/// Ranges are told apart by so much, metres, up to 20 m.
const STEP_M: f64 = 0.1;
const STEPS: usize = 200;

impl ByRange {
    /// Of a function of metres.
    pub(crate) fn of(value: impl Fn(f64) -> f64) -> Self {
        Self { values: (0..STEPS).map(|step| value((step as f64 + 0.5) * STEP_M)).collect() }
    }

    /// `None` beyond the farthest range.
    pub(crate) fn at(&self, range_m: f64) -> Option<f64> {
        self.values.get((range_m / STEP_M) as usize).copied()
    }
}
