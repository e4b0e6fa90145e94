//! Interception whose shares are formulas: a wall, a slab of random leaves, a comb, a bare row; balance and repetition for any.

use proptest::prelude::*;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::analytic::{AnalyticOverrides, Shape};
use rowscan_scenes::orchard::Preset;
use rowscan_scenes::{Cylinder, GeneratorKind, Leaf, Orchard, OrchardParameters};
use rowscan_sprayer::interception::{Settings, Sink, intercept};
use rowscan_sprayer::{Boom, Command, CommandLog, Drive, Flow, Interception, Pass, Target, oracle};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::{Course, SpeedProfile, Trajectory};

fn boom(keys: &str, sections: &[[f64; 2]]) -> Boom {
    let sections = sections.iter().enumerate().map(|(n, [from, to])| {
        format!("[[section]]\nid = \"s{n}\"\nside = \"right\"\nz_from_m = {from}\nz_to_m = {to}\n")
    });
    let text = format!(
        "version = 1\noffset_y_m = 0\n{keys}\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n{}",
        sections.collect::<String>()
    );
    Boom::read(&text).expect("a boom")
}

fn drive(start_m: f64, speed_m_s: f64, until_s: f64) -> Drive {
    let tractor = Tractor::new(Trajectory::straight(start_m, speed_m_s));
    tractor.begin(SimTime::ZERO);
    Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime((until_s * 1e9) as u64))
}

fn always() -> CommandLog {
    [Command { at: SimTime::ZERO, target: Target::All, duty: 1.0 }].into_iter().collect()
}

fn open(pass: &Pass, orchard: &Orchard) -> Interception {
    of(pass, orchard, &pass.flows(&always()))
}

fn of(pass: &Pass, orchard: &Orchard, flows: &[Flow]) -> Interception {
    intercept(pass, orchard, &[flows], &Settings::new(pass.seed())).remove(0)
}

fn share(found: &Interception, sink: Sink) -> f64 {
    found.sinks.litres(sink) / found.litres
}

fn balanced(found: &Interception) -> bool {
    (found.sinks.total() - found.litres).abs() <= 1e-9 * found.litres
}

fn panel(x: f64, [from, to]: [f64; 2], z: [f64; 2]) -> Leaf {
    Leaf::new([[x, from, z[0]], [x, to, z[0]], [x, to, z[1]], [x, from, z[1]]]).expect("a leaf")
}

/// A fan of 80° at 1 m is 1.68 m high: from 0.66 to 2.34 m.
const HEIGHT: [[f64; 2]; 1] = [[1.25, 1.75]];

#[test]
fn before_a_wall_all_is_on_leaf_and_every_leaf_gets_the_same() {
    let wall = Orchard::from_organs(vec![panel(0.0, [-40.0, 60.0], [0.0, 4.0])], Vec::new(), f64::INFINITY);
    let pass = Pass::new(boom("distance_m = 1", &HEIGHT), &wall, drive(0.0, 1.5, 8.0), 3);
    let found = open(&pass, &wall);
    assert!((share(&found, Sink::Leaf) - 1.0).abs() < 1e-9, "{found:?}");
    assert!(balanced(&found) && found.off_target_share == Some(0.0), "{found:?}");
    assert!((found.litres - 8.0 / 60.0).abs() < 1e-9);

    // In strips of a decimetre within the fan, all alike: 0.133 l on 12 m of a wall that the fan reaches over 1.68 m.
    let strips = (0..40).flat_map(|n| {
        let y = f64::from(n) * 0.5 - 4.0;
        (0..8).map(move |k| panel(0.0, [y, y + 0.5], [0.5 * f64::from(k), 0.5 * f64::from(k) + 0.5]))
    });
    let strips = Orchard::from_organs(strips.collect(), Vec::new(), f64::INFINITY);
    let leaves = open(&pass, &strips).on_leaves.expect("leaves stand there");
    let reached = 2.0 * (40.0_f64).to_radians().tan();
    // Uniform in the angle, so most in the middle: between 1 and 1.5 m lie atan(0.5) of 80°.
    let band = |from: &str| {
        let part = leaves.by_band.iter().find(|part| part.part.starts_with(from)).expect("a band");
        part.ml_m2
    };
    let middle = 0.5_f64.atan().to_degrees() / 80.0 * (8.0 / 60.0 * 1e3) / (12.0 * 0.5);
    for from in ["1.0", "1.5"] {
        // The ends of the drive reach a fan's width beyond it.
        assert!((band(from) / middle - 1.0).abs() < 0.03, "{from}: {} {middle}", band(from));
    }
    assert!(reached > 1.67 && band("3.0") == 0.0 && band("0.0") == 0.0);
    assert!(leaves.lowest.ml_m2 == 0.0 && leaves.highest.z_m >= 1.0 && leaves.highest.z_m <= 1.5);
}

#[test]
fn a_slab_of_random_leaves_keeps_what_beer_and_lambert_say() {
    for (density, depth_m) in [(1.0, 1.0), (2.0, 1.0), (2.0, 2.0)] {
        let parameters = OrchardParameters {
            generator: Some(GeneratorKind::Analytic),
            trees: Some(10),
            tree_spacing_m: Some(2.0),
            analytic: AnalyticOverrides {
                shape: Some(Shape::Slab),
                from_m: Some(0.0),
                to_m: Some(4.0),
                depth_m: Some(depth_m),
                density_m2_m3: Some(density),
                leaf_m: Some(0.04),
                ..AnalyticOverrides::default()
            },
            ..OrchardParameters::default()
        };
        let slab = Orchard::grow(&parameters, 5, &|_, _| {}).expect("it grows");
        // Level rays at many heights: every way through the slab is as long as it is deep.
        let keys = "distance_m = 2\nfan_deg = 0\nwidth_deg = 0";
        let mut boom = boom(keys, &[[0.6, 3.4]]);
        boom.sections[0].nozzles = Some(64);
        let pass = Pass::new(boom, &slab, drive(0.0, 1.0, 20.0), 1);
        let settings = Settings { rays: 4, ..Settings::new(1) };
        let flows = pass.flows(&always());
        let found = intercept(&pass, &slab, &[&flows], &settings).remove(0);
        let expected = 1.0 - (-0.5 * density * depth_m).exp();
        let kept = share(&found, Sink::Leaf);
        assert!((kept / expected - 1.0).abs() < 0.02, "{density} {depth_m}: {kept}, {expected}");
        assert!(balanced(&found));
        // What is in front shields: a third of the depth lets through exp of a third.
        let thirds = found.on_leaves.expect("leaves").by_depth;
        let [near, middle, far] = [0, 1, 2].map(|n: usize| thirds[n].ml_m2);
        let shade = (-0.5 * density * depth_m / 3.0).exp();
        assert!((middle / near / shade - 1.0).abs() < 0.06, "{near} {middle} {shade}");
        assert!((far / middle / shade - 1.0).abs() < 0.06, "{middle} {far} {shade}");
    }
}

#[test]
fn a_comb_keeps_its_share_of_teeth_and_the_rest_is_gaps_that_a_controller_can_spare() {
    // Teeth of 0.4 m, gaps of 0.6 m: on squares of a decimetre.
    let teeth = (0..24).map(|n| f64::from(n) - 2.0).map(|y| panel(0.0, [y, y + 0.4], [0.0, 4.0]));
    let comb = Orchard::from_organs(teeth.collect(), Vec::new(), f64::INFINITY);
    let keys = "distance_m = 1\nstrip_m = 0\njoin_m = 0\nwidth_deg = 0";
    let pass = Pass::new(boom(keys, &HEIGHT), &comb, drive(0.0, 1.0, 20.0), 3);
    let found = open(&pass, &comb);
    assert!((share(&found, Sink::Leaf) - 0.4).abs() < 1e-3, "{found:?}");
    // Behind the gaps the lowest rays come to the ground sooner than to the next alley.
    let gaps = share(&found, Sink::Gap) + share(&found, Sink::GroundInRow);
    assert!((gaps - 0.6).abs() < 1e-3 && balanced(&found), "{found:?}");
    assert!((found.off_target_share.expect("it sprays") - 0.6).abs() < 1e-3);
    // Who knows the gaps spares them; who opens in the gaps only hits nothing.
    let best = of(&pass, &comb, &pass.flows(&oracle::commands(&pass)));
    assert!(best.off_target_share.expect("it sprays") < 1e-3, "{best:?}");
    let contrary: CommandLog = oracle::commands(&pass)
        .all()
        .iter()
        .map(|command| Command { duty: 1.0 - command.duty, ..*command })
        .collect();
    let worst = of(&pass, &comb, &pass.flows(&contrary));
    assert!(worst.off_target_share.expect("it sprays") > 0.95, "{worst:?}");
    // A fan that is wide along the row sprays gaps whoever controls it.
    let wide = Pass::new(
        boom(&keys.replace("width_deg = 0", "width_deg = 40"), &HEIGHT),
        &comb,
        drive(0.0, 1.0, 20.0),
        3,
    );
    let blurred = of(&wide, &comb, &wide.flows(&oracle::commands(&wide)));
    assert!(blurred.off_target_share.expect("it sprays") > 0.1, "{blurred:?}");
}

#[test]
fn a_bare_row_lets_all_pass_or_fall_to_the_ground() {
    let bare = Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY);
    let pass = Pass::new(boom("distance_m = 1", &HEIGHT), &bare, drive(0.0, 1.5, 8.0), 3);
    let found = open(&pass, &bare);
    // From 1.5 m the ground within 2 m across is below atan(1.5 / 2): 36.87° of the lower 40° are above it.
    let ground = (40.0 - (1.5_f64 / 2.0).atan().to_degrees()) / 80.0;
    assert!((share(&found, Sink::GroundInRow) - ground).abs() < 2e-3, "{found:?}");
    assert!((share(&found, Sink::GroundInRow) + share(&found, Sink::Passed) - 1.0).abs() < 1e-9);
    assert!((found.off_target_share.expect("it sprays") - 1.0).abs() < 1e-9 && found.on_leaves.is_none());
    let silent = of(&pass, &bare, &pass.flows(&CommandLog::default()));
    assert_eq!((silent.litres, silent.off_target_share), (0.0, None), "unknown, and not 0");
}

#[test]
fn what_is_above_the_canopy_goes_over_it_and_wood_and_fruit_are_their_own() {
    let post = |y: f64| Cylinder::new([-0.3, y, 0.0], [-0.3, y, 4.0], 0.2).expect("wood");
    let leaves = vec![panel(0.0, [-5.0, 20.0], [0.0, 1.5])];
    let orchard = Orchard::from_organs(leaves, (0..12).map(|n| post(f64::from(n))).collect(), f64::INFINITY);
    let keys = "distance_m = 1\nwidth_deg = 0\nfan_deg = 60";
    let pass = Pass::new(boom(keys, &HEIGHT), &orchard, drive(0.0, 1.0, 10.0), 3);
    let found = open(&pass, &orchard);
    // Posts of 0.4 m each metre, seen square to the row; half of the rest passes over.
    assert!((share(&found, Sink::Wood) - 0.4).abs() < 2e-3, "{found:?}");
    assert!((share(&found, Sink::Over) - 0.3).abs() < 5e-3 && (share(&found, Sink::Leaf) - 0.3).abs() < 5e-3);
    assert!((found.off_target_share.expect("it sprays") - share(&found, Sink::Over)).abs() < 1e-12);
}

#[test]
fn a_row_that_repeats_is_one_that_was_written_out() {
    let tree = |y: f64| {
        vec![panel(0.1, [y - 0.1, y + 0.7], [0.5, 1.4]), panel(-0.2, [y + 0.9, y + 1.3], [1.0, 2.2])]
    };
    let once = Orchard::from_organs(tree(0.0), Vec::new(), 2.0);
    let many = Orchard::from_organs(
        (-6..12).flat_map(|n| tree(2.0 * f64::from(n))).collect(),
        Vec::new(),
        f64::INFINITY,
    );
    let boom = boom("distance_m = 1\nwidth_deg = 40", &HEIGHT);
    let found = [&once, &many].map(|orchard| {
        let pass = Pass::new(boom.clone(), orchard, drive(-1.3, 1.5, 7.0), 3);
        open(&pass, orchard)
    });
    for sink in Sink::ALL {
        assert!((share(&found[0], sink) - share(&found[1], sink)).abs() < 1e-3, "{sink:?}: {found:?}");
    }
    let means = found.map(|found| found.on_leaves.expect("leaves"));
    assert!((means[0].leaf_area_m2 - means[1].leaf_area_m2).abs() < 1e-9);
    assert!((means[0].mean_ml_m2 / means[1].mean_ml_m2 - 1.0).abs() < 1e-3);
    assert_eq!(means[0].by_band.len(), means[1].by_band.len());
}

/// A grown orchard, with turns: rows from both sides, headland, standstill.
fn grown(seed: u64) -> (Orchard, Drive) {
    let parameters =
        OrchardParameters { trees: Some(3), rows: Some(2), ..OrchardParameters::of(Preset::Paper) };
    let orchard = Orchard::grow(&parameters, seed, &|_, _| {}).expect("it grows");
    let profile = SpeedProfile::builder(1.5, 0.0).leg(2.0, 1.5, 0.0).leg(1.0, 0.0, 0.0).steady(0.5, 0.0, 0.0);
    let profile = profile.leg(1.0, 2.0, 0.0).hold();
    let spacing_m = orchard.row_spacing_m().unwrap_or(4.0);
    let row_m = orchard.length_m();
    let course =
        Course { start_m: -1.0, row_spacing_m: spacing_m, turns: Some((3, row_m)), ..Course::default() };
    let tractor = Tractor::new(Trajectory::new(profile, course, 0.5));
    tractor.begin(SimTime::ZERO);
    (orchard, Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime(16_000_000_000)))
}

fn both_sides() -> Boom {
    let section = |id: &str, side: &str, z: f64| {
        format!("[[section]]\nid = \"{id}\"\nside = \"{side}\"\nz_from_m = {z}\nz_to_m = {}\n", z + 0.7)
    };
    let text = format!(
        "version = 1\noffset_y_m = 1\n[valve]\nkind = \"pwm\"\n{}{}{}",
        section("l", "left", 0.5),
        section("r", "right", 0.5),
        section("top", "right", 1.2)
    );
    Boom::read(&text).expect("a boom")
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    let (orchard, drive) = grown(2);
    let pass = Pass::new(both_sides(), &orchard, drive, 9);
    let flows = pass.flows(&always());
    let best = pass.flows(&oracle::commands(&pass));
    let on = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            intercept(&pass, &orchard, &[&flows, &best], &Settings { rays: 6, ..Settings::new(seed) })
        })
    };
    let (one, many) = (on(1, 9), on(7, 9));
    assert_eq!(format!("{one:?}"), format!("{many:?}"));
    assert_ne!(one, on(1, 10));
    // Two runs at once are each alone.
    let alone = intercept(&pass, &orchard, &[&best], &Settings { rays: 6, ..Settings::new(9) });
    assert_eq!(alone[0], one[1]);
    // The headland is sprayed by who leaves all open, and off target.
    assert!(one[0].off_target_share > one[1].off_target_share, "{one:?}");
    assert!(one.iter().all(balanced));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever is commanded, the sinks hold what was sprayed.
    #[test]
    fn the_sinks_sum_to_what_was_sprayed(seed in 1u64..4, log in prop::collection::vec((0.0..16.0f64, 1u16..4, 0.0..1.0f64), 0..30), rays in 1u32..9, pitch in -60.0..60.0f64, fan in 0.0..170.0f64, width in 0.0..120.0f64) {
        let (orchard, drive) = grown(seed);
        let mut boom = both_sides();
        (boom.fan_deg, boom.width_deg) = (fan, width);
        let mut nozzle = rowscan_sprayer::boom::NozzleTable::between(0.5, 1.5);
        (nozzle.pitch_deg, nozzle.out_m) = (pitch, 0.4);
        boom.sections[0].each = vec![nozzle];
        boom.validate().expect("sound");
        let pass = Pass::new(boom, &orchard, drive, seed);
        let log: CommandLog = log.iter().map(|(at, number, duty)| Command {
            at: SimTime((at * 1e9) as u64), target: Target::Section(*number), duty: *duty,
        }).collect();
        let flows = pass.flows(&log);
        let found = intercept(&pass, &orchard, &[&flows], &Settings { rays, ..Settings::new(seed) }).remove(0);
        let litres: f64 = flows.iter().map(Flow::litres).sum();
        prop_assert!((found.sinks.total() - litres).abs() <= 1e-9 * litres.max(1e-12), "{:?}", found);
        // What leaves got by part is what fell on leaves that were passed: never more.
        if let Some(leaves) = &found.on_leaves {
            prop_assert!(leaves.litres <= found.sinks.leaf * (1.0 + 1e-9));
            for parts in [&leaves.by_tree, &leaves.by_band, &leaves.by_depth] {
                let sum: f64 = parts.iter().map(|part| part.ml_m2 * part.leaf_area_m2 / 1e3).sum();
                prop_assert!((sum - leaves.litres).abs() <= 1e-9 * leaves.litres.max(1e-12));
            }
        }
    }
}
