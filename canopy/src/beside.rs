//! A ground speed that was measured beside the way that an estimate goes by: whether both tell the same way.

use crate::odometry::{AdvanceSource, GroundSpeed};
use crate::warning::Warning;

/// A speed may be told so late, seconds: the way by it lies behind by the speed times this.
const LATE_S: f64 = 0.3;
/// Share of the way by which both may differ: tyres, and speeds as receivers tell them.
const SHARE: f64 = 0.03;
/// And so far, metres.
const APART_M: f64 = 0.05;
/// Over a longer time between two lines neither way is known.
const LONGEST_S: f64 = 2.0;

/// The way by the estimate and the way by the speed beside it, from line to line.
#[derive(Clone, Debug, Default)]
pub(crate) struct Beside {
    last: Option<Line>,
    source: Option<AdvanceSource>,
    way_m: f64,
    beside_m: f64,
    fastest_m_s: f64,
    /// How far both were apart at most, and whether that was more than speeds and tyres explain.
    apart_m: f64,
    differs: bool,
}

#[derive(Clone, Copy, Debug)]
struct Line {
    travel_s: f64,
    y_m: f64,
    speed_m_s: f64,
}

impl Beside {
    /// A line at `y_m` by `way`, taken `travel_s` after the first, and what the speed was then; none while nobody knows it.
    pub(crate) fn observe(
        &mut self,
        travel_s: f64,
        (y_m, way): (f64, Option<AdvanceSource>),
        speed: Option<GroundSpeed>,
    ) {
        let Some((GroundSpeed { source, .. }, speed_m_s)) =
            speed.and_then(|speed| Some((speed, speed.speed_m_s.filter(|speed| speed.is_finite())?)))
        else {
            self.last = None;
            return;
        };
        self.source = Some(source);
        let Some(last) = self.last.replace(Line { travel_s, y_m, speed_m_s }) else { return };
        let passed_s = travel_s - last.travel_s;
        if !(0.0..=LONGEST_S).contains(&passed_s) {
            return;
        }
        let (way_m, beside_m) = (y_m - last.y_m, (speed_m_s + last.speed_m_s) / 2.0 * passed_s);
        // A receiver does not tell which way the tractor goes.
        let is_unsigned = source == AdvanceSource::Gnss || way == Some(AdvanceSource::Gnss);
        let signed = |way_m: f64| if is_unsigned { way_m.abs() } else { way_m };
        self.way_m += signed(way_m);
        self.beside_m += signed(beside_m);
        self.fastest_m_s = self.fastest_m_s.max(speed_m_s.abs());
        let apart_m = (self.way_m - self.beside_m).abs();
        self.apart_m = self.apart_m.max(apart_m);
        let explained_m =
            APART_M + LATE_S * self.fastest_m_s + SHARE * self.way_m.abs().max(self.beside_m.abs());
        self.differs |= apart_m > explained_m;
    }

    /// Says that both differ, if they do, in an estimate by `way`.
    pub(crate) fn doubt(&self, way: AdvanceSource) -> Option<Warning> {
        let &Self { source, way_m, beside_m, apart_m, differs, .. } = self;
        let beside = source.filter(|_| differs)?;
        Some(Warning::WaysDiffer { way, way_m, beside, beside_m, apart_m })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 s at 50 lines a second and 1 m/s by the speed, which comes late; the way by `wheel` at a time.
    fn doubt(source: AdvanceSource, late_s: f64, wheel: impl Fn(f64) -> f64) -> Option<Warning> {
        let (mut beside, mut y_m) = (Beside::default(), 0.0);
        for line in 0..1000 {
            let t_s = f64::from(line) * 0.02;
            // From standstill to 1 m/s within a second.
            let real = |t_s: f64| (t_s - 1.0).clamp(0.0, 1.0);
            y_m += real(t_s) * wheel(t_s) * 0.02;
            let told = GroundSpeed { source, speed_m_s: Some(real(t_s - late_s)) };
            beside.observe(t_s, (y_m, None), Some(told));
        }
        beside.doubt(AdvanceSource::Encoder)
    }

    /// A way by a receiver counts up in reverse: against a bus that tells the direction only what both know is held.
    #[test]
    fn a_way_by_a_receiver_is_held_against_a_bus_without_the_direction() {
        let doubt = |way: AdvanceSource, held_m_s: Option<f64>| {
            let (mut beside, mut y_m) = (Beside::default(), 0.0);
            for line in 0..1000 {
                let t_s = f64::from(line) * 0.02;
                // Back for five seconds, and faster at the end, which the way does not see.
                let real_m_s: f64 =
                    if (5.0..10.0).contains(&t_s) { -1.0 } else { 1.0 } * if t_s > 15.0 { 1.5 } else { 1.0 };
                y_m += held_m_s.filter(|_| t_s > 15.0).unwrap_or(real_m_s.abs()) * 0.02;
                let told = GroundSpeed { source: AdvanceSource::Can, speed_m_s: Some(real_m_s) };
                beside.observe(t_s, (y_m, Some(way)), Some(told));
            }
            beside.doubt(way)
        };
        assert_eq!(doubt(AdvanceSource::Gnss, None), None);
        assert!(doubt(AdvanceSource::Gnss, Some(1.0)).is_some(), "a speed that was held while it grew");
        assert!(doubt(AdvanceSource::Encoder, None).is_some(), "an encoder tells the direction");
    }

    #[test]
    fn slip_and_a_wrong_scale_are_told_and_lateness_and_tyres_are_not() {
        for source in [AdvanceSource::Gnss, AdvanceSource::Can] {
            assert_eq!(doubt(source, 0.2, |_| 1.0), None);
            assert_eq!(doubt(source, 0.0, |_| 1.03), None);
            let slips = |t_s: f64| if (5.0..10.0).contains(&t_s) { 1.25 } else { 1.0 };
            let Some(Warning::WaysDiffer { way_m, beside_m, apart_m, .. }) = doubt(source, 0.2, slips) else {
                panic!("a wheel that slips for 5 s is told");
            };
            assert!((way_m - beside_m - apart_m).abs() < 0.3 && (1.0..1.6).contains(&apart_m), "{apart_m}");
            assert!(doubt(source, 0.2, |_| 1.1).is_some());
        }
        // Backwards: only a bus tells the direction.
        assert!(doubt(AdvanceSource::Can, 0.0, |_| -1.0).is_some());
        assert_eq!(doubt(AdvanceSource::Gnss, 0.0, |_| -1.0), None);
    }

    #[test]
    fn while_nobody_knows_the_speed_nothing_is_compared() {
        let mut beside = Beside::default();
        let known = |speed_m_s| Some(GroundSpeed { source: AdvanceSource::Can, speed_m_s });
        for (t_s, y_m, speed) in [
            (0.0, 0.0, known(Some(1.0))),
            (1.0, 1.0, known(None)),
            (2.0, 9.0, None),
            (3.0, 10.0, known(Some(1.0))),
        ] {
            beside.observe(t_s, (y_m, None), speed);
        }
        assert_eq!(beside.doubt(AdvanceSource::Encoder), None);
        // Neither over a long time without a line.
        beside.observe(9.0, (30.0, None), known(Some(1.0)));
        assert_eq!(beside.doubt(AdvanceSource::Encoder), None);
    }
}
