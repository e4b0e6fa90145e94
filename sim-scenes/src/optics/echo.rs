//! From what a beam's parts met to echoes: returns closer than a pulse are one blended range.

use rowscan_protocol::optics::{FogFilter, Pulse};

use super::touch::Touch;

/// One echo of a beam, before it is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Echo {
    /// Power-weighted mean.
    pub(super) range_m: f64,
    pub(super) power: f64,
    /// Share of the beam that went there.
    pub(super) share: f64,
    /// Two standard deviations of the ranges in it.
    pub(super) spread_m: f64,
    /// The ray that returned most.
    pub(super) ray: u32,
}

/// What becomes an echo.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) merged_m: f64,
    pub(super) apart_m: f64,
    /// Least power that is detected in this shot.
    pub(super) least_power: f64,
    /// Least share of the spot.
    pub(super) min_share: f64,
    /// What else is suppressed.
    pub(super) fog: FogFilter,
    /// Echoes that the receiver tells apart.
    pub(super) most: usize,
}

impl Rules {
    pub(super) fn of(pulse: &Pulse, min_share: f64, most: usize) -> Self {
        let (merged_m, apart_m) = (pulse.merged_m.value, pulse.apart_m.value);
        Self { merged_m, apart_m, least_power: 0.0, min_share, fog: FogFilter::None, most }
    }

    pub(super) fn detects(&self, echo: &Echo) -> bool {
        let least_power = self.least_power * self.fog.times_least_power(echo.range_m);
        let least_share = self.min_share.max(self.fog.least_share());
        echo.power > 0.0 && echo.power >= least_power && echo.share >= least_share
    }

    /// The echoes of a beam, nearest first. `touches` may be sorted.
    pub(super) fn echoes(&self, touches: &mut [Touch], echoes: &mut Vec<Echo>) {
        echoes.clear();
        let nearest_m = touches.iter().map(|touch| touch.range_m).fold(f64::INFINITY, f64::min);
        let farthest_m = touches.iter().map(|touch| touch.range_m).fold(f64::NEG_INFINITY, f64::max);
        if farthest_m - nearest_m > self.merged_m {
            self.split(touches, echoes);
        } else {
            echoes.extend(Group::of(touches).echo());
        }
        echoes.retain(|echo| self.detects(echo));
        self.disturb(echoes);
        echoes.truncate(self.most);
    }

    /// Groups in the order of their ranges: a return joins as long as it is near the group's mean.
    fn split(&self, touches: &mut [Touch], echoes: &mut Vec<Echo>) {
        touches.sort_unstable_by(|a, b| a.range_m.total_cmp(&b.range_m).then(a.ray.cmp(&b.ray)));
        let mut group = Group::default();
        for touch in touches {
            if group.power > 0.0 && touch.range_m - group.mean_m() > self.merged_m {
                echoes.extend(group.echo());
                group = Group::default();
            }
            group.add(touch);
        }
        echoes.extend(group.echo());
    }

    /// Echoes that are not far apart draw the nearer one farther away.
    fn disturb(&self, echoes: &mut [Echo]) {
        for near in 1..echoes.len() {
            let Some([near, far]) = echoes.get_mut(near - 1..=near) else { break };
            let gap_m = far.range_m - near.range_m;
            if gap_m < self.apart_m {
                let weight = far.power / (near.power + far.power);
                near.range_m += weight * gap_m * (self.apart_m - gap_m) / (self.apart_m - self.merged_m);
            }
        }
    }
}

/// What a beam without echo formation reports: the nearest surface that it touches.
pub(super) fn nearest(touches: &[Touch], echoes: &mut Vec<Echo>) {
    echoes.clear();
    let share: f64 = touches.iter().map(|touch| touch.share).sum();
    let first = touches.iter().filter(|touch| touch.power > 0.0);
    echoes.extend(first.min_by(|a, b| a.range_m.total_cmp(&b.range_m)).map(|touch| Echo {
        range_m: touch.range_m,
        power: touches.iter().map(|touch| touch.power).sum(),
        share,
        spread_m: 0.0,
        ray: touch.ray,
    }));
}

/// Sums over the returns of an echo. Ranges count from the first one, so that the spread keeps its digits.
#[derive(Clone, Copy, Debug, Default)]
struct Group {
    from_m: f64,
    power: f64,
    share: f64,
    first: f64,
    second: f64,
    strongest: f64,
    ray: u32,
}

impl Group {
    fn of(touches: &[Touch]) -> Self {
        let mut group = Self::default();
        touches.iter().for_each(|touch| group.add(touch));
        group
    }

    fn add(&mut self, touch: &Touch) {
        if self.power <= 0.0 {
            self.from_m = touch.range_m;
        }
        let beyond_m = touch.range_m - self.from_m;
        self.power += touch.power;
        self.share += touch.share;
        self.first += touch.power * beyond_m;
        self.second += touch.power * beyond_m * beyond_m;
        if touch.power > self.strongest {
            (self.strongest, self.ray) = (touch.power, touch.ray);
        }
    }

    fn mean_m(&self) -> f64 {
        self.from_m + self.first / self.power
    }

    /// None without power.
    fn echo(self) -> Option<Echo> {
        let mean = self.first / self.power;
        (self.power > 0.0).then(|| Echo {
            range_m: self.from_m + mean,
            power: self.power,
            share: self.share,
            spread_m: 2.0 * (self.second / self.power - mean * mean).max(0.0).sqrt(),
            ray: self.ray,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: Rules = Rules {
        merged_m: 1.0,
        apart_m: 2.0,
        least_power: 0.0,
        min_share: 0.0,
        fog: FogFilter::None,
        most: 5,
    };

    /// Half of the spot at either range, 1/r² weights.
    fn two(near_m: f64, far_m: f64, rules: Rules) -> Vec<Echo> {
        let touch = |range_m: f64, ray| Touch { range_m, share: 0.5, power: 0.5 / (range_m * range_m), ray };
        let mut echoes = Vec::new();
        rules.echoes(&mut [touch(far_m, 1), touch(near_m, 0)], &mut echoes);
        echoes
    }

    #[test]
    fn surfaces_within_a_pulse_are_one_range_by_power_and_the_range_has_no_jump() {
        let [echo] = two(1.0, 1.6, RULES)[..] else { panic!("one echo") };
        let (near, far) = (1.0, 1.0 / 2.56);
        assert!((echo.range_m - (near + far * 1.6) / (near + far)).abs() < 1e-12);
        assert!((echo.share - 1.0).abs() < 1e-12 && echo.ray == 0);
        let before = two(2.0, 2.9999, RULES)[0].range_m;
        let after = two(2.0, 3.0001, RULES);
        assert!((before - after[0].range_m).abs() < 1e-3 && after.len() == 2, "{before} {after:?}");
    }

    #[test]
    fn a_gap_of_1_6_m_moves_the_near_echo_by_part_of_it_and_one_of_2_m_by_nothing() {
        // Recorded: 6 to 13 % of the gap.
        let late = (two(1.0, 2.6, RULES)[0].range_m - 1.0) / 1.6;
        assert!((0.04..=0.13).contains(&late), "{late}");
        assert!((two(1.0, 3.0, RULES)[0].range_m - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_fog_filter_drops_small_pulses_or_weak_ones_within_its_range() {
        use rowscan_protocol::optics::Fact;
        let touch = |range_m: f64, share, power| Touch { range_m, share, power, ray: 0 };
        let seen = |fog, touches: &mut [Touch]| {
            let mut echoes = Vec::new();
            Rules { least_power: 0.01, fog, ..RULES }.echoes(touches, &mut echoes);
            echoes.iter().map(|echo| echo.range_m).collect::<Vec<_>>()
        };
        // A drop, a leaf's rim, a wall; the last two within reach of a level 3 or beyond it.
        let mut parts =
            [touch(2.0, 0.0, 0.05), touch(6.0, 0.05, 0.05), touch(10.0, 0.9, 0.2), touch(20.0, 0.9, 0.05)];
        assert_eq!(seen(FogFilter::None, &mut parts), [2.0, 6.0, 10.0, 20.0]);
        let small = FogFilter::SmallPulses { share: Fact::assumed(0.06) };
        assert_eq!(seen(small, &mut parts), [10.0, 20.0]);
        let weak = FogFilter::LeastPower { times: Fact::assumed(8.0), within_m: Fact::assumed(16.0) };
        assert_eq!(seen(weak, &mut parts), [10.0, 20.0]);
    }

    #[test]
    fn weak_echoes_vanish_and_the_receiver_keeps_the_first_ones() {
        let weak = Rules { least_power: 0.06, ..RULES };
        assert_eq!(two(1.0, 3.0, weak).len(), 1);
        let thin = Rules { min_share: 0.6, ..RULES };
        assert_eq!(two(1.0, 3.0, thin).len(), 0);
        assert_eq!(two(1.0, 1.5, thin).len(), 1);
        let single = two(1.0, 3.0, Rules { most: 1, ..RULES });
        assert!(single.len() == 1 && single[0].range_m < 1.1);
    }
}
