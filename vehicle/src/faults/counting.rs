//! What the encoder counts while it has faults: from each begin or end on, the wheel's way times a factor, from the count that was.

use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::vehicle::EncoderFault;

use super::spans::{REMEMBERED, Spans};

/// One more tick than a 32-bit counter holds.
const WRAP: f64 = 4_294_967_296.0;
/// Ticks before the wrap at which the count is set.
const SHORT_OF_WRAP: f64 = 10.0;

/// From an instant on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Leg {
    from: SimTime,
    /// Metres that the wheel had rolled.
    wheel_m: f64,
    /// Metres that were counted then.
    counted_m: f64,
    /// Counted metres a metre rolled.
    factor: f64,
    /// The count is to pass a wrap just behind here.
    wraps: bool,
}

/// The faults of one encoder.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Counting {
    spans: Spans<EncoderFault>,
    legs: Vec<Leg>,
}

impl Counting {
    /// A fault begins when the wheel has rolled `wheel_m`.
    pub(crate) fn begin(&mut self, key: u64, fault: EncoderFault, at: SimTime, wheel_m: f64) {
        self.spans.begin(key, fault, at);
        self.leg(at, wheel_m, fault.wrap);
    }

    /// False if there is none of this key.
    pub(crate) fn end(&mut self, key: u64, at: SimTime, wheel_m: f64) -> bool {
        let ended = self.spans.end(key, at);
        if ended {
            self.leg(at, wheel_m, false);
        }
        ended
    }

    fn leg(&mut self, at: SimTime, wheel_m: f64, wraps: bool) {
        let counted_m = self.counted_m(at, wheel_m);
        let factor = self.spans.at(at).map(|span| factor(&span.fault)).product();
        if self.legs.len() >= REMEMBERED {
            self.legs.remove(0);
        }
        self.legs.push(Leg { from: at, wheel_m, counted_m, factor, wraps });
    }

    /// Metres of wheel that are counted at `at`, when it has rolled `wheel_m`.
    pub(crate) fn counted_m(&self, at: SimTime, wheel_m: f64) -> f64 {
        let leg = self.legs.iter().rev().find(|leg| leg.from <= at);
        leg.map_or(wheel_m, |leg| leg.counted_m + (wheel_m - leg.wheel_m) * leg.factor)
    }

    /// What the count is ahead by at `at`, because it was to wrap; `ticks` gives those of metres counted.
    pub(crate) fn wrapped(&self, at: SimTime, ticks: impl Fn(f64) -> f64) -> f64 {
        self.legs.iter().filter(|leg| leg.wraps && leg.from <= at).fold(0.0, |ahead, leg| {
            let here = ticks(leg.counted_m) + ahead;
            ahead + WRAP - SHORT_OF_WRAP - here.rem_euclid(WRAP)
        })
    }
}

fn factor(fault: &EncoderFault) -> f64 {
    if fault.stuck || fault.cable_out {
        return 0.0;
    }
    let counted = (1.0 - fault.missed + fault.extra) / (1.0 - fault.slip);
    if fault.reversed { -counted } else { counted }
}
