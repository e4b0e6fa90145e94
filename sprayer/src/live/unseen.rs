//! What one reader of a boom has not seen yet.

use crate::flow::Flow;
use crate::span::{Span, Spans};

/// What was since a reader's last look.
#[derive(Clone, Debug, Default)]
pub(super) struct Seen {
    /// How long that is.
    pub(super) long_s: f64,
    /// What the valves would have let through at the nominal pressure, litres by nozzle.
    pub(super) open_l: Vec<f64>,
    /// The same while there was something in the tank.
    pub(super) sprayed_l: Vec<f64>,
    /// What the flow meter told.
    pub(super) metered_l: f64,
}

/// The same while it grows.
#[derive(Clone, Debug)]
pub(super) struct Unseen {
    since_s: f64,
    so_far: Seen,
}

impl Unseen {
    pub(super) fn new(at_s: f64, nozzles: usize) -> Self {
        Self { since_s: at_s, so_far: Seen::nothing(nozzles) }
    }

    /// `span` has passed.
    pub(super) fn add(&mut self, span: Span, (open, sprayed): (&[Flow], &[Flow]), metered_l: f64) {
        let times = Spans::of([span]);
        let add = |sums: &mut [f64], flows: &[Flow]| {
            sums.iter_mut().zip(flows).for_each(|(sum, flow)| *sum += flow.litres_in(&times));
        };
        add(&mut self.so_far.open_l, open);
        add(&mut self.so_far.sprayed_l, sprayed);
        self.so_far.metered_l += metered_l;
    }

    /// All of it, at `at_s`.
    pub(super) fn take(&mut self, at_s: f64) -> Seen {
        let nothing = Seen::nothing(self.so_far.open_l.len());
        let seen = std::mem::replace(&mut self.so_far, nothing);
        Seen { long_s: at_s - std::mem::replace(&mut self.since_s, at_s), ..seen }
    }
}

impl Seen {
    fn nothing(nozzles: usize) -> Self {
        Self { long_s: 0.0, open_l: vec![0.0; nozzles], sprayed_l: vec![0.0; nozzles], metered_l: 0.0 }
    }
}
