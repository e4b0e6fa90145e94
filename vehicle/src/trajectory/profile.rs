//! From time to distance: legs of steady acceleration, each with its own wheel slip.

use std::collections::VecDeque;

/// How many commanded legs are remembered. The oldest is dropped first; the present never depends on it.
const COMMANDS: usize = 4096;

/// Distance and speed at an instant, over ground and of the wheels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProfileState {
    /// Distance over ground since the start, metres.
    pub way_m: f64,
    /// Ground speed, m/s; negative in reverse.
    pub speed_m_s: f64,
    /// Distance that the wheels have rolled, metres.
    pub wheel_m: f64,
    /// Speed of the wheels' rims, m/s.
    pub wheel_speed_m_s: f64,
    /// Metres driven over ground, either direction counted up.
    pub driven_m: f64,
    /// Metres that the wheels have rolled, either direction counted up.
    pub rolled_m: f64,
}

impl ProfileState {
    /// After `t_s` seconds more of this acceleration, on wheels that turn `1 / grip` metres a metre of ground.
    pub(super) fn after(&self, t_s: f64, acceleration_m_s2: f64, grip: f64) -> Self {
        let speed_m_s = self.speed_m_s + acceleration_m_s2 * t_s;
        let way_m = self.speed_m_s * t_s + 0.5 * acceleration_m_s2 * t_s * t_s;
        // Where the speed changes its sign, there is as much to count to each side.
        let turns = self.speed_m_s * speed_m_s < 0.0;
        let turned_m = -0.5 * self.speed_m_s * self.speed_m_s / acceleration_m_s2;
        let driven_m = if turns { turned_m.abs() + (way_m - turned_m).abs() } else { way_m.abs() };
        Self {
            way_m: self.way_m + way_m,
            speed_m_s,
            wheel_m: self.wheel_m + way_m / grip,
            wheel_speed_m_s: speed_m_s / grip,
            driven_m: self.driven_m + driven_m,
            rolled_m: self.rolled_m + driven_m / grip,
        }
    }
}

/// From an instant on: steady acceleration until the next span begins.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    from_s: f64,
    start: ProfileState,
    acceleration_m_s2: f64,
    /// Ground distance per wheel distance: 1 − slip.
    grip: f64,
}

impl Span {
    fn at(&self, t_s: f64) -> ProfileState {
        self.start.after(t_s - self.from_s, self.acceleration_m_s2, self.grip)
    }
}

/// Speed as a function of time, in closed form.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedProfile {
    /// In the order of time, the first at 0.
    spans: Vec<Span>,
    /// When the spans repeat, seconds, and the state after one round.
    round: Option<(f64, ProfileState)>,
    commanded: VecDeque<Span>,
    grip: f64,
}

impl SpeedProfile {
    /// The same speed forever.
    pub fn constant(speed_m_s: f64) -> Self {
        Self::builder(speed_m_s, 0.0).hold()
    }

    /// Starts at `speed_m_s` with wheels that slip by this share of the distance they roll.
    pub fn builder(speed_m_s: f64, slip: f64) -> SpeedProfileBuilder {
        let start = ProfileState { speed_m_s, ..ProfileState::default() };
        SpeedProfileBuilder { spans: Vec::new(), end_s: 0.0, end: start, grip: 1.0 - slip }
    }

    /// Distance and speed after `t_s` seconds; before 0, the start at rest.
    pub fn at(&self, t_s: f64) -> ProfileState {
        if t_s < 0.0 {
            return ProfileState::default();
        }
        if let Some(span) = self.commanded.iter().rev().find(|span| span.from_s <= t_s) {
            return span.at(t_s);
        }
        let Some((period_s, made)) = self.round else { return within(&self.spans, t_s) };
        let rounds = (t_s / period_s).floor();
        let run = within(&self.spans, t_s - rounds * period_s);
        ProfileState {
            way_m: run.way_m + rounds * made.way_m,
            wheel_m: run.wheel_m + rounds * made.wheel_m,
            driven_m: run.driven_m + rounds * made.driven_m,
            rolled_m: run.rolled_m + rounds * made.rolled_m,
            ..run
        }
    }

    /// From `t_s` on, accelerates to `target_m_s` and holds it.
    pub(super) fn command(&mut self, t_s: f64, target_m_s: f64, acceleration_m_s2: f64) {
        let start = self.at(t_s);
        self.forget_from(t_s);
        let change_m_s = target_m_s - start.speed_m_s;
        let ramp = Span {
            from_s: t_s,
            start,
            acceleration_m_s2: acceleration_m_s2.copysign(change_m_s),
            grip: self.grip,
        };
        let reached_s = t_s + change_m_s.abs() / acceleration_m_s2;
        let reached = ProfileState { speed_m_s: target_m_s, ..ramp.at(reached_s) };
        self.commanded.push_back(ramp);
        self.commanded.push_back(Span {
            from_s: reached_s,
            start: reached,
            acceleration_m_s2: 0.0,
            grip: self.grip,
        });
        while self.commanded.len() > COMMANDS {
            self.commanded.pop_front();
        }
    }

    /// From `t_s` on, stands still.
    pub(super) fn halt(&mut self, t_s: f64) {
        let start = ProfileState { speed_m_s: 0.0, wheel_speed_m_s: 0.0, ..self.at(t_s) };
        self.forget_from(t_s);
        self.commanded.push_back(Span { from_s: t_s, start, acceleration_m_s2: 0.0, grip: self.grip });
    }

    fn forget_from(&mut self, t_s: f64) {
        while self.commanded.back().is_some_and(|span| span.from_s >= t_s) {
            self.commanded.pop_back();
        }
    }
}

/// The last span continues forever beyond its start.
fn within(spans: &[Span], t_s: f64) -> ProfileState {
    let index = spans.partition_point(|span| span.from_s <= t_s).saturating_sub(1);
    spans.get(index).map_or_else(ProfileState::default, |span| span.at(t_s))
}

/// Builds a profile span by span.
#[derive(Clone, Debug)]
pub struct SpeedProfileBuilder {
    spans: Vec<Span>,
    end_s: f64,
    end: ProfileState,
    grip: f64,
}

impl SpeedProfileBuilder {
    /// For `seconds`, the speed changes linearly to `speed_m_s`; wheels slip by `slip`. With 0 seconds it changes at once.
    #[must_use]
    pub fn leg(mut self, seconds: f64, speed_m_s: f64, slip: f64) -> Self {
        if seconds > 0.0 {
            let span = Span {
                from_s: self.end_s,
                start: self.end,
                acceleration_m_s2: (speed_m_s - self.end.speed_m_s) / seconds,
                grip: 1.0 - slip,
            };
            self.spans.push(span);
            self.end_s += seconds;
            self.end = span.at(self.end_s);
        }
        self.end.speed_m_s = speed_m_s;
        self
    }

    /// For `seconds`, this speed, reached at once.
    #[must_use]
    pub fn steady(mut self, seconds: f64, speed_m_s: f64, slip: f64) -> Self {
        self.end.speed_m_s = speed_m_s;
        self.leg(seconds, speed_m_s, slip)
    }

    /// Keeps the last speed forever.
    pub fn hold(mut self) -> SpeedProfile {
        let (from_s, start) = (self.end_s, self.end);
        self.spans.push(Span { from_s, start, acceleration_m_s2: 0.0, grip: self.grip });
        SpeedProfile { spans: self.spans, round: None, commanded: VecDeque::new(), grip: self.grip }
    }

    /// Repeats all legs; without any, keeps the starting speed.
    pub fn again(self) -> SpeedProfile {
        if self.spans.is_empty() {
            return self.hold();
        }
        let round = Some((self.end_s, self.end));
        SpeedProfile { spans: self.spans, round, commanded: VecDeque::new(), grip: self.grip }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distance by small steps: an independent check of the closed form.
    fn way_by_steps(profile: &SpeedProfile, until_s: f64) -> f64 {
        let step_s = 1e-4;
        (0..(until_s / step_s).round() as u64)
            .map(|step| profile.at((step as f64 + 0.5) * step_s).speed_m_s * step_s)
            .sum()
    }

    #[test]
    fn way_is_the_sum_of_speed() {
        let ramp =
            SpeedProfile::builder(0.0, 0.0).leg(2.0, 1.5, 0.0).leg(3.0, 1.5, 0.0).leg(4.0, -0.5, 0.0).hold();
        for until_s in [0.5, 2.0, 4.0, 6.5, 9.0, 12.0] {
            assert!((ramp.at(until_s).way_m - way_by_steps(&ramp, until_s)).abs() < 1e-6, "{until_s}");
        }
    }

    #[test]
    fn rounds_repeat_without_drift() {
        let stop_and_go = SpeedProfile::builder(0.0, 0.0)
            .leg(1.0, 1.0, 0.0)
            .leg(3.0, 1.0, 0.0)
            .leg(1.0, 0.0, 0.0)
            .leg(2.0, 0.0, 0.0);
        let stop_and_go = stop_and_go.again();
        for round in [0.0, 1.0, 5000.0] {
            let run = stop_and_go.at(round * 7.0 + 2.0);
            assert!((run.way_m - (round * 4.0 + 1.5)).abs() < 1e-9, "{run:?}");
            assert!(stop_and_go.at(round * 7.0 + 6.0).speed_m_s.abs() < 1e-12);
        }
    }

    #[test]
    fn what_was_driven_counts_up_ahead_and_back() {
        // Ahead, through rest into reverse with slipping wheels, and ahead again at once.
        let legs =
            SpeedProfile::builder(1.0, 0.0).leg(2.0, 1.0, 0.0).leg(4.0, -1.0, 0.2).steady(1.0, 0.5, 0.0);
        let profile = legs.again();
        for (t_s, driven_m, rolled_m) in [
            (2.0, 2.0, 2.0),
            (4.0, 3.0, 2.0 + 1.0 / 0.8),
            (6.0, 4.0, 2.0 + 2.0 / 0.8),
            (7.0, 4.5, 2.5 + 2.0 / 0.8),
            (7000.0 + 4.0, 4503.0, 4502.0 + 1.0 / 0.8 + 1000.0 * (2.0 / 0.8 - 2.0)),
        ] {
            let run = profile.at(t_s);
            assert!((run.driven_m - driven_m).abs() < 1e-6, "{t_s} s: {run:?}");
            assert!((run.rolled_m - rolled_m).abs() < 1e-6, "{t_s} s: {run:?}");
        }
        // A command that turns it counts on.
        let mut commanded = SpeedProfile::constant(1.0);
        commanded.command(3.0, -1.0, 0.5);
        let back = commanded.at(9.0);
        assert!((back.way_m - 1.0).abs() < 1e-12 && (back.driven_m - 7.0).abs() < 1e-12, "{back:?}");
    }

    /// Whatever the order of ahead, back and stand: what was driven is the sum of steps without their sign, within each leg as well.
    #[test]
    fn what_was_driven_is_the_sum_of_the_steps_without_their_sign() {
        let speeds = [-1.5, -0.3, 0.0, 0.4, 1.0];
        for (before, then, after) in
            speeds.iter().flat_map(|b| speeds.iter().flat_map(move |t| speeds.map(|a| (*b, *t, a))))
        {
            let legs = SpeedProfile::builder(before, 0.0).leg(2.0, then, 0.1).leg(3.0, after, 0.1);
            let mut commanded = SpeedProfile::constant(before);
            commanded.command(1.0, then, 0.7);
            commanded.command(3.0, after, 1.1);
            for (profile, grip) in [(legs.hold(), 0.9), (commanded, 1.0)] {
                let (mut driven_m, step_s) = (0.0, 1e-3);
                for step in 1..=5_000 {
                    let at_s = f64::from(step) * step_s;
                    driven_m += profile.at(at_s - 0.5 * step_s).speed_m_s.abs() * step_s;
                    let run = profile.at(at_s);
                    let case = format!("{before}, {then}, {after} m/s at {at_s} s: {run:?}");
                    assert!((run.driven_m - driven_m).abs() < 1e-5, "{driven_m} m; {case}");
                    assert!((run.rolled_m - driven_m / grip).abs() < 1e-5, "{driven_m} m; {case}");
                }
            }
        }
    }

    #[test]
    fn wheels_that_slip_roll_farther_than_the_tractor_drives() {
        let slipping = SpeedProfile::builder(1.0, 0.0).leg(10.0, 1.0, 0.2).hold();
        let run = slipping.at(20.0);
        assert!((run.way_m - 20.0).abs() < 1e-12);
        assert!((run.wheel_m - (10.0 / 0.8 + 10.0)).abs() < 1e-12, "{run:?}");
    }

    #[test]
    fn many_commands_take_no_more_room() {
        let mut profile = SpeedProfile::constant(1.0);
        for k in 0..100_000 {
            profile.command(f64::from(k) * 0.1, f64::from(k % 3), 0.5);
        }
        assert!(profile.commanded.len() <= COMMANDS);
    }
}
