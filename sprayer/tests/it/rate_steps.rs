//! A change of speed is a step of the rate, whether the speed jumps or takes its time.

use proptest::prelude::*;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Orchard;
use rowscan_sprayer::rate::Settling;
use rowscan_sprayer::{Boom, Command, CommandLog, Drive, Pass, Rate, Target};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::{Course, SpeedProfile, Trajectory};

/// The error is less than this share at speeds that are right.
const BAND: f64 = 0.1;

/// The rate of a flow that is constant and right at 1 m/s. Every 3 s a change to the next of `speeds` begins, and takes `ramp_s`.
fn rate(speeds: &[f64], ramp_s: f64) -> Rate {
    let mut profile = SpeedProfile::builder(speeds[0], 0.0).steady(3.0, speeds[0], 0.0);
    for speed in &speeds[1..] {
        profile = profile.leg(ramp_s, *speed, 0.0).steady(3.0 - ramp_s, *speed, 0.0);
    }
    let profile = profile.hold();
    let tractor = Tractor::new(Trajectory::new(profile, Course::default(), 0.5));
    tractor.begin(SimTime::ZERO);
    let end = SimTime(3_000_000_000 * speeds.len() as u64);
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, end);
    let text = format!(
        "version = 1\n[rate]\nat_m_s = 1\nband = {BAND}\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n\
         [[section]]\nid = \"s\"\nside = \"right\"\nz_from_m = 0.5\nz_to_m = 1\nnozzles = 2\n"
    );
    let boom = Boom::read(&text).expect("a boom");
    let keys = boom.rate.expect("a rate");
    let orchard = Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY);
    let pass = Pass::new(boom, &orchard, drive, 5);
    let open = Command { at: SimTime(500_000_000), target: Target::Section(1), duty: 1.0 };
    let log: CommandLog = [open].into_iter().collect();
    Rate::of(&pass, &keys, &pass.flows(&log), 0.0)
}

#[test]
fn a_jump_of_speed_is_a_step_behind_which_the_rate_is_off() {
    for ramp_s in [0.0, 0.02, 0.2] {
        // Behind the first jump all is too little until the second one.
        let found = rate(&[1.0, 2.0, 1.0], ramp_s);
        assert_eq!(
            (found.steps, found.unsettled, found.settling),
            (3, 1, Settling::NotSettled),
            "{ramp_s}: {found:?}"
        );
    }
    // A drive without a jump has the opening only.
    assert_eq!(rate(&[1.0, 1.0, 1.0], 0.0).steps, 1);
    assert_eq!(rate(&[1.0, 1.0, 1.0], 0.2).steps, 1);
}

/// A boom that does not regulate is right again as soon as the speed is: it took as long as the speed was another.
#[test]
fn a_ramp_there_and_back_is_no_instant() {
    let found = rate(&[1.0, 2.0, 1.0, 1.0], 3.0);
    assert_eq!((found.steps, found.settling), (2, Settling::Settled), "{found:?}");
    // Too little by a tenth from 0.33 s of the ramp on, until 0.33 s before its end.
    assert!(found.settling_s.is_some_and(|s| (5.5..5.9).contains(&s)), "{found:?}");
    // Who follows is right all the time.
    let level = rate(&[1.0, 1.05, 1.0, 1.0], 3.0);
    assert_eq!((level.settling, level.settling_s), (Settling::Settled, Some(0.0)), "{level:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// How long a ramp takes does not decide whether it is a step, nor whether the rate settles behind it.
    #[test]
    fn steps_and_settling_do_not_hang_on_the_length_of_a_ramp(
        speeds in prop::collection::vec(prop::sample::select(vec![0.5, 0.8, 1.0, 1.05, 1.4, 2.0]), 1..5),
    ) {
        let counts = |ramp_s| {
            let rate = rate(&speeds, ramp_s);
            (rate.steps, rate.unsettled, rate.unsettled_at_end, rate.unjudged, rate.settling)
        };
        let changes = speeds.windows(2).filter(|pair| pair[0] != pair[1]).count();
        let jumped = counts(0.0);
        prop_assert_eq!(jumped.0, 1 + changes);
        for ramp_s in [0.02, 0.2] {
            prop_assert_eq!(counts(ramp_s), jumped, "a ramp of {} s", ramp_s);
        }
    }
}
