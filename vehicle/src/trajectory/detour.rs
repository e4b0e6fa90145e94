//! Times in which the tractor does not drive as its profile says: it makes for another speed, and later for its own again. Behind the last
//! one it drives its profile, as far behind or ahead as it then is.

use super::profile::{ProfileState, SpeedProfile};

/// How many legs are remembered. The oldest is forgotten first; the present never depends on it.
const LEGS: usize = 4096;

/// Wheels roll as far as the tractor drives.
const GRIP: f64 = 1.0;

/// From an instant on, until the next leg begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Leg {
    /// The speed changes steadily, from this state.
    Steady { start: ProfileState, change_m_s2: f64 },
    /// As the profile, with its distances shifted: what it was in this state when the profile was in that one.
    Own { here: ProfileState, own: ProfileState },
}

/// What was told by whom: its key, the speed, and how fast the speed changes.
type Wanted = (u64, f64, f64);

/// The detours of one drive; they begin and end in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Detours {
    legs: Vec<(f64, Leg)>,
    active: Vec<Wanted>,
}

impl Detours {
    /// Distance and speed after `t_s` seconds.
    pub(super) fn at(&self, profile: &SpeedProfile, t_s: f64) -> ProfileState {
        let leg = self.legs.iter().rev().find(|(from_s, _)| *from_s <= t_s);
        let Some((from_s, leg)) = leg else { return profile.at(t_s) };
        match leg {
            Leg::Steady { start, change_m_s2 } => start.after(t_s - from_s, *change_m_s2, GRIP),
            Leg::Own { here, own } => {
                let now = profile.at(t_s);
                ProfileState {
                    way_m: now.way_m + (here.way_m - own.way_m),
                    wheel_m: now.wheel_m + (here.wheel_m - own.wheel_m),
                    driven_m: now.driven_m + (here.driven_m - own.driven_m),
                    rolled_m: now.rolled_m + (here.rolled_m - own.rolled_m),
                    ..now
                }
            }
        }
    }

    /// Told at 0, before the drive, it starts from rest.
    pub(super) fn begin(&mut self, profile: &SpeedProfile, wanted: Wanted, t_s: f64) {
        if t_s <= 0.0 && self.legs.is_empty() {
            let start = ProfileState { speed_m_s: 0.0, wheel_speed_m_s: 0.0, ..profile.at(0.0) };
            self.legs.push((0.0, Leg::Steady { start, change_m_s2: 0.0 }));
        }
        self.active.push(wanted);
        let (_, speed_m_s, change_m_s2) = wanted;
        self.make_for(profile, t_s, speed_m_s, change_m_s2);
    }

    /// False if there is none of this key.
    pub(super) fn end(&mut self, profile: &SpeedProfile, key: u64, t_s: f64) -> bool {
        let Some(number) = self.active.iter().position(|(other, ..)| *other == key) else { return false };
        let was_last = number + 1 == self.active.len();
        let (_, _, change_m_s2) = self.active.remove(number);
        match self.active.last().copied() {
            _ if !was_last => {}
            Some((_, speed_m_s, change_m_s2)) => drop(self.make_for(profile, t_s, speed_m_s, change_m_s2)),
            None if t_s <= 0.0 => self.legs.clear(),
            None => {
                let own = profile.at(t_s);
                let there_s = self.make_for(profile, t_s, own.speed_m_s, change_m_s2);
                let (here, own) = (self.at(profile, there_s), profile.at(there_s));
                self.push(there_s, Leg::Own { here, own });
            }
        }
        true
    }

    /// Changes the speed from `t_s` on and keeps it; when it is reached.
    fn make_for(&mut self, profile: &SpeedProfile, t_s: f64, speed_m_s: f64, change_m_s2: f64) -> f64 {
        let start = self.at(profile, t_s);
        let change_m_s = speed_m_s - start.speed_m_s;
        let there_s = t_s + change_m_s.abs() / change_m_s2;
        let change_m_s2 = change_m_s2.copysign(change_m_s);
        self.push(t_s, Leg::Steady { start, change_m_s2 });
        let there = start.after(there_s - t_s, change_m_s2, GRIP);
        let there = ProfileState { speed_m_s, wheel_speed_m_s: speed_m_s, ..there };
        self.push(there_s, Leg::Steady { start: there, change_m_s2: 0.0 });
        there_s
    }

    /// What was to come from `from_s` on does not.
    fn push(&mut self, from_s: f64, leg: Leg) {
        while self.legs.last().is_some_and(|(other_s, _)| *other_s >= from_s) {
            self.legs.pop();
        }
        if self.legs.len() >= LEGS {
            self.legs.remove(0);
        }
        self.legs.push((from_s, leg));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_costs_its_time_and_the_way_has_no_jump() {
        let profile = SpeedProfile::constant(1.0);
        let mut detours = Detours::default();
        detours.begin(&profile, (1, 0.0, 0.5), 10.0);
        assert!((detours.at(&profile, 12.0).way_m - 11.0).abs() < 1e-12);
        assert_eq!(detours.at(&profile, 60.0).way_m, detours.at(&profile, 12.0).way_m);
        assert!(detours.end(&profile, 1, 20.0) && !detours.end(&profile, 1, 20.0));
        // Two seconds each to stop and to go, half the way lost in each, eight seconds stood: ten metres behind.
        assert!((detours.at(&profile, 100.0).way_m - 90.0).abs() < 1e-9);
        let mut before = detours.at(&profile, 0.0).way_m;
        for ms in 1..30_000 {
            let here = detours.at(&profile, f64::from(ms) / 1000.0).way_m;
            assert!((-1e-9..0.0011).contains(&(here - before)), "{ms}: {before} to {here}");
            before = here;
        }
        assert_eq!(detours.at(&profile, 9.0).way_m, 9.0, "what was before stays");
    }

    #[test]
    fn in_reverse_the_way_and_the_wheel_go_back() {
        let profile = SpeedProfile::constant(1.0);
        let mut detours = Detours::default();
        detours.begin(&profile, (1, -1.0, 1.0), 5.0);
        // A metre's half ahead and a half back in two seconds, then a metre a second.
        let back = detours.at(&profile, 9.0);
        assert!((back.way_m - 3.0).abs() < 1e-12 && back.wheel_m == back.way_m && back.speed_m_s == -1.0);
        // Each metre counts, also once it drives its own profile again.
        assert!((back.driven_m - 8.0).abs() < 1e-12 && back.rolled_m == back.driven_m);
        assert!(detours.end(&profile, 1, 9.0));
        let ahead = detours.at(&profile, 13.0);
        assert!((ahead.way_m - 5.0).abs() < 1e-12 && (ahead.driven_m - 11.0).abs() < 1e-12, "{ahead:?}");
    }

    #[test]
    fn the_last_of_several_counts_and_the_earlier_one_goes_on() {
        let profile = SpeedProfile::constant(1.0);
        let mut detours = Detours::default();
        detours.begin(&profile, (1, 2.0, 100.0), 1.0);
        detours.begin(&profile, (2, 0.0, 100.0), 2.0);
        assert!(detours.end(&profile, 2, 3.0));
        assert!((detours.at(&profile, 5.0).speed_m_s - 2.0).abs() < 1e-12);
        assert!(detours.end(&profile, 1, 6.0));
        assert!((detours.at(&profile, 7.0).speed_m_s - 1.0).abs() < 1e-12);
    }
}
