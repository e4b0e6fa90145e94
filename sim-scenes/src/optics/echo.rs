//! From groups of returns to echoes: returns closer than a pulse are one blended range.

use rowscan_protocol::optics::{FogFilter, Pulse};

use super::groups::Sums;
use super::parts::Parts;
use super::settings::{Blend, OpticsSettings};
use super::touch::{Echo, NO_RAY, Touch};
use super::waveform::Waveform;

/// What becomes an echo.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) blend: Blend,
    /// Of `Blend::Pulse`.
    pub(super) waveform: Waveform,
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
    pub(super) fn of(pulse: &Pulse, settings: &OpticsSettings, most: usize) -> Self {
        Self {
            blend: settings.blend,
            waveform: Waveform::new(settings.pulse_m),
            merged_m: pulse.merged_m.value,
            apart_m: pulse.apart_m.value,
            least_power: 0.0,
            min_share: settings.min_share,
            fog: FogFilter::None,
            most,
        }
    }

    /// Whether echoes are made of groups of returns.
    pub(super) fn groups_returns(&self) -> bool {
        self.blend != Blend::Pulse
    }

    pub(super) fn detects(&self, echo: &Echo) -> bool {
        let least_power = self.least_power * self.fog.times_least_power(echo.range_m);
        let least_share = self.min_share.max(self.fog.least_share());
        echo.power > 0.0 && echo.power >= least_power && echo.share >= least_share
    }

    /// The echoes of beam `lane`, nearest first, of the groups that its parts are in.
    pub(super) fn echoes(&self, groups: &[Sums], parts: &Parts, lane: usize, echoes: &mut Vec<Echo>) {
        echoes.clear();
        let in_groups =
            |nearest| groups.iter().filter_map(move |group| Echo::of(group, parts, lane, nearest));
        match self.blend {
            Blend::Mean => echoes.extend(in_groups(false)),
            Blend::Nearest => echoes.extend(in_groups(true)),
            Blend::Pulse => self.waveform.echoes(&mut parts.beam(lane).collect(), echoes),
        }
        echoes.retain(|echo| self.detects(echo));
        if self.blend == Blend::Mean {
            self.disturb(echoes);
        }
        echoes.truncate(self.most);
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
pub(super) fn nearest(touches: impl Iterator<Item = Touch>, echoes: &mut Vec<Echo>) {
    echoes.clear();
    let mut echo = Echo { range_m: f64::INFINITY, power: 0.0, share: 0.0, spread_m: 0.0, ray: NO_RAY };
    for Touch { range_m, share, power, ray } in touches {
        if power > 0.0 && range_m < echo.range_m {
            (echo.range_m, echo.ray) = (range_m, ray);
        }
        echo.power += power;
        echo.share += share;
    }
    echoes.extend((echo.power > 0.0).then_some(echo));
}

impl Echo {
    /// Of one beam's returns in a group, at their mean or at the nearest of them. None without power.
    fn of(group: &Sums, parts: &Parts, lane: usize, nearest: bool) -> Option<Self> {
        let Sums { from_m, power, share, first, second, column } = group;
        let [from_m, power, share, first, second, column] = [from_m, power, share, first, second, column]
            .map(|row| row.0.get(lane).copied().unwrap_or_default());
        (power > 0.0).then(|| Self {
            range_m: if nearest { from_m } else { from_m + first / power },
            power,
            share,
            spread_m: Self::spread_m(power, first, second),
            ray: parts.ray(column as usize, lane),
        })
    }
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;

    use super::*;
    use crate::lanes::WIDTH;
    use crate::optics::groups::Grouping;

    const RULES: Rules = Rules {
        blend: Blend::Mean,
        waveform: Waveform::new(0.75),
        merged_m: 1.0,
        apart_m: 2.0,
        least_power: 0.0,
        min_share: 0.0,
        fog: FogFilter::None,
        most: 5,
    };

    /// Of a beam that met this; beams beside it meet half of it, or nothing.
    fn echoes(rules: Rules, touches: &[Touch]) -> Vec<Echo> {
        let mut parts = Parts::default();
        for (lane, number) in (0..WIDTH).flat_map(|lane| (0..touches.len()).map(move |number| (lane, number)))
        {
            if lane == 3 || (lane + number) % 2 == 1 {
                parts.add(lane, touches[number]);
            }
        }
        let [mut wide, mut single] = [Vec::new(), Vec::new()];
        let merged_m = rules.merged_m;
        pulp::Arch::new().dispatch(Grouping { parts: &parts, merged_m, groups: &mut wide });
        Grouping { parts: &parts, merged_m, groups: &mut single }.with_simd(pulp::Scalar::new());
        let mut found = Vec::new();
        for lane in 0..WIDTH {
            let mut again = Vec::new();
            rules.echoes(&wide, &parts, lane, &mut found);
            rules.echoes(&single, &parts, lane, &mut again);
            assert_eq!(found, again, "on other registers");
        }
        rules.echoes(&wide, &parts, 3, &mut found);
        found
    }

    /// Half of the spot at either range, 1/r² weights.
    fn two(near_m: f64, far_m: f64, rules: Rules) -> Vec<Echo> {
        let touch = |range_m: f64, ray| Touch { range_m, share: 0.5, power: 0.5 / (range_m * range_m), ray };
        echoes(rules, &[touch(far_m, 1), touch(near_m, 0)])
    }

    #[test]
    fn surfaces_within_a_pulse_are_one_range_by_power_and_the_range_has_no_jump() {
        let [echo] = two(1.0, 1.6, RULES)[..] else { panic!("one echo") };
        let (near, far) = (1.0, 1.0 / 2.56);
        assert!((echo.range_m - (near + far * 1.6) / (near + far)).abs() < 1e-12);
        assert!((echo.share - 1.0).abs() < 1e-12);
        let before = two(2.0, 2.9999, RULES)[0].range_m;
        let after = two(2.0, 3.0001, RULES);
        assert!((before - after[0].range_m).abs() < 1e-3 && after.len() == 2, "{before} {after:?}");
    }

    /// One rule is as good as another where nothing blends; where something does, the mean is the farthest and the first rise the nearest.
    #[test]
    fn the_rules_differ_where_returns_share_a_pulse_and_nowhere_else() {
        let by = |blend, near_m, far_m| two(near_m, far_m, Rules { blend, ..RULES });
        let forms = [Blend::Nearest, Blend::Pulse, Blend::Mean];
        let [nearest, pulse, mean] = forms.map(|blend| by(blend, 2.0, 2.5)[0]);
        assert!((nearest.range_m - 2.0).abs() < 1e-12 && nearest.range_m < pulse.range_m);
        assert!(pulse.range_m < mean.range_m, "{pulse:?} {mean:?}");
        for echo in [nearest, pulse] {
            assert!((echo.power - mean.power).abs() < 1e-12 && (echo.share - mean.share).abs() < 1e-12);
        }
        for echoes in forms.map(|blend| by(blend, 2.0, 4.5)) {
            let ranges = echoes.iter().map(|echo| (1e6 * echo.range_m).round()).collect::<Vec<_>>();
            assert_eq!(ranges, [2e6, 4.5e6]);
        }
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
        let seen = |fog, touches: &[Touch]| {
            let rules = Rules { least_power: 0.01, fog, ..RULES };
            echoes(rules, touches).iter().map(|echo| echo.range_m).collect::<Vec<_>>()
        };
        // A drop, a leaf's rim, a wall; the last two within reach of a level 3 or beyond it.
        let parts =
            [touch(2.0, 0.0, 0.05), touch(6.0, 0.05, 0.05), touch(10.0, 0.9, 0.2), touch(20.0, 0.9, 0.05)];
        assert_eq!(seen(FogFilter::None, &parts), [2.0, 6.0, 10.0, 20.0]);
        let small = FogFilter::SmallPulses { share: Fact::assumed(0.06) };
        assert_eq!(seen(small, &parts), [10.0, 20.0]);
        let weak = FogFilter::LeastPower { times: Fact::assumed(8.0), within_m: Fact::assumed(16.0) };
        assert_eq!(seen(weak, &parts), [10.0, 20.0]);
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
