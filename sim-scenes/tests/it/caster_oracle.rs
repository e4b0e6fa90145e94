//! The caster against the oracle, return by return, in scenes made to be awkward.

use proptest::prelude::*;
use rowscan_protocol::rig::Attitude;
use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::brute::Oracle;
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::seed::{Purpose, Stream};
use rowscan_scenes::{
    BeamFan, Beams, Caster, Class, Cylinder, Layers, Leaf, Orchard, ParallelBeams, Registers, Return, Scratch,
};

/// A source of random values for scenes.
struct Dice(Stream);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(Purpose::Growth.stream(seed, 77, 77))
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.unit()
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.0.unit() * from.len() as f64) as usize]
    }

    fn direction(&mut self) -> [f64; 3] {
        if self.0.unit() < 0.3 {
            return self.pick(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]);
        }
        let z = self.between(-1.0, 1.0);
        let turn = self.between(0.0, std::f64::consts::TAU);
        let flat = (1.0 - z * z).sqrt();
        [flat * turn.cos(), flat * turn.sin(), z]
    }

    /// A star with 3 to 12 corners, mostly non-convex, in any plane.
    fn leaf(&mut self) -> Leaf {
        let normal = self.direction();
        let least = if normal[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let u = unit(cross(normal, least));
        let v = cross(normal, u);
        let middle = [self.between(-1.5, 1.5), self.between(0.0, 6.0), self.between(-0.3, 3.5)];
        let size = self.pick(&[0.03, 0.08, 0.3, 1.5]);
        let corners = self.between(3.0, 13.0) as usize;
        let outline: Vec<[f64; 3]> = (0..corners)
            .map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / corners as f64;
                let radius = size * self.between(0.15, 1.0);
                let (a, b) = (radius * angle.cos(), radius * angle.sin());
                std::array::from_fn(|i| middle[i] + a * u[i] + b * v[i])
            })
            .collect();
        Leaf::new(outline).unwrap()
    }

    /// Copies of a few blades, turned, stretched and mirrored, some of them with one vertex elsewhere; and stars.
    fn foliage(&mut self) -> Orchard {
        let shapes: [Vec<[f64; 2]>; 3] = std::array::from_fn(|_| {
            let corners = self.between(5.0, 13.0) as usize;
            let angles = (0..corners).map(|k| std::f64::consts::TAU * k as f64 / corners as f64);
            let (wide, off) = (self.between(0.2, 1.0), self.between(-0.4, 0.4));
            angles.map(|angle| [angle.cos(), wide * (angle + off * angle.sin()).sin()]).collect()
        });
        let blade = |dice: &mut Self, shape: &[[f64; 2]]| {
            let (along, other) = (dice.direction(), dice.direction());
            let across = cross(along, if dot(along, other).abs() > 0.9 { [0.6, 0.0, 0.8] } else { other });
            let length = dice.pick(&[0.03, 0.08, 0.3]);
            let width =
                length * dice.between(0.4, 1.0) * dice.pick(&[-1.0, 1.0]) / dot(across, across).sqrt();
            let middle = [dice.between(-1.5, 1.5), dice.between(0.0, 2.0), dice.between(-0.3, 3.5)];
            let bend = dice.pick(&[1.0, 1.0, 1.0, 0.9]);
            let at = |(i, [a, b]): (usize, &[f64; 2])| {
                let b = if i == 1 { b * bend } else { *b };
                std::array::from_fn(|i| middle[i] + length * a * along[i] + width * b * across[i])
            };
            Leaf::new(shape.iter().enumerate().map(at).collect::<Vec<[f64; 3]>>()).unwrap()
        };
        let mut leaves: Vec<Leaf> =
            (0..600).map(|number| blade(self, &shapes[number % shapes.len()])).collect();
        leaves.extend((0..30).map(|_| self.leaf()));
        let wood = (0..8).map(|_| self.branch()).collect();
        Orchard::from_organs(leaves, wood, 2.0)
    }

    fn branch(&mut self) -> Cylinder {
        let base = [self.between(-1.5, 1.5), self.between(0.0, 6.0), self.between(-0.3, 3.0)];
        let direction = self.direction();
        let length = self.pick(&[0.02, 0.3, 2.5]) * self.between(0.3, 1.0);
        let radius = self.pick(&[0.001, 0.01, 0.2]) * self.between(0.5, 1.0);
        Cylinder::new(base, std::array::from_fn(|i| base[i] + length * direction[i]), radius).unwrap()
    }

    fn scene(&mut self) -> Orchard {
        let leaves = (0..self.between(0.0, 60.0) as usize).map(|_| self.leaf()).collect();
        let wood = (0..self.between(0.0, 15.0) as usize).map(|_| self.branch()).collect();
        let length = self.pick(&[f64::INFINITY, 0.4, 2.0, 6.0]);
        Orchard::from_organs(leaves, wood, length)
    }

    fn pose(&mut self) -> Pose {
        Pose { x_m: self.between(-3.0, 2.0), y_m: self.between(-8.0, 14.0), z_m: self.between(-0.5, 5.0) }
    }

    fn fan(&mut self) -> BeamFan {
        let step = self.pick(&[0.5, -0.5, 1.0 / 3.0, 1.3, -7.0]);
        BeamFan::from_degrees(
            self.between(-400.0, 400.0),
            step,
            self.between(1.0, 420.0 / f64::abs(step)) as usize,
        )
    }

    /// A fan whose scanner moves, mostly by millimetres a turn, now and then by whole periods.
    fn moving_fan(&mut self) -> BeamFan {
        let fan = self.fan();
        let travel = self.pick(&[0.015, 0.04, -0.04, 0.8, 11.0]);
        let advance = travel / fan.len() as f64;
        fan.advancing(advance)
    }

    /// The same fan in a plane that leans, mostly by degrees.
    fn leaning(&mut self, fan: BeamFan) -> BeamFan {
        let most = self.pick(&[0.02, 0.2, 0.7]);
        let mut angle = || self.between(-most, most);
        let attitude = Attitude { yaw_rad: angle(), pitch_rad: angle(), roll_rad: angle() };
        fan.leaning(attitude.axes())
    }

    fn parallel(&mut self) -> ParallelBeams {
        let make = self.pick(&[ParallelBeams::lateral, ParallelBeams::opposite, ParallelBeams::zenith]);
        make(self.between(-3.0, 0.5), self.pick(&[0.005, 0.031, -0.02]), self.between(1.0, 400.0) as usize)
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|c| c / length)
}

/// The same organ at the same range; another organ only where both are met at once.
fn agree(fast: &Return, slow: &Return) -> Result<(), String> {
    let same = (fast.class, fast.tree, fast.organ) == (slow.class, slow.tree, slow.organ);
    let apart = if fast.range_m == slow.range_m { 0.0 } else { (fast.range_m - slow.range_m).abs() };
    let angles = (fast.cos_incidence - slow.cos_incidence).abs();
    if apart < if same { 1e-6 } else { 1e-9 } && (!same || angles < 1e-3) {
        Ok(())
    } else {
        Err(format!("caster {fast:?}, oracle {slow:?}"))
    }
}

fn compare(
    oracle: &Oracle<'_>,
    caster: &Caster,
    origin: Pose,
    fan: &BeamFan,
    scratch: &mut Scratch,
) -> [usize; Class::ALL.len()] {
    let mut fast = vec![Return::MISS; fan.len()];
    caster.cast(origin, fan, scratch, &mut fast);
    let slow = oracle.cast(origin, fan);
    let mut classes = [0; Class::ALL.len()];
    for (beam, (a, b)) in fast.iter().zip(&slow).enumerate() {
        classes[a.class as usize] += 1;
        if let Err(difference) = agree(a, b) {
            panic!("beam {beam} at θ = {}° from {origin:?}: {difference}", fan.theta_rad(beam).to_degrees());
        }
    }
    classes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(250))]

    #[test]
    fn every_return_is_the_oracles_in_random_scenes(seed in any::<u64>()) {
        let mut dice = Dice::new(seed);
        let orchard = dice.scene();
        let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
        let mut scratch = Scratch::default();
        for _ in 0..8 {
            let pose = dice.pose();
            for fan in [dice.fan(), dice.moving_fan()] {
                compare(&oracle, &caster, pose, &fan, &mut scratch);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn every_return_is_the_oracles_among_copies_of_a_few_blades(seed in any::<u64>()) {
        let mut dice = Dice::new(seed);
        let orchard = dice.foliage();
        let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
        let mut scratch = Scratch::default();
        for _ in 0..3 {
            let pose = dice.pose();
            for fan in [dice.fan(), dice.moving_fan()] {
                compare(&oracle, &caster, pose, &fan, &mut scratch);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn every_return_of_a_plane_that_leans_is_the_oracles(seed in any::<u64>()) {
        let mut dice = Dice::new(seed);
        let orchard = if seed % 4 == 0 { dice.foliage() } else { dice.scene() };
        let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
        let mut scratch = Scratch::default();
        for _ in 0..3 {
            let (pose, still, moving) = (dice.pose(), dice.fan(), dice.moving_fan());
            for fan in [still, moving] {
                let fan = dice.leaning(fan);
                compare(&oracle, &caster, pose, &fan, &mut scratch);
            }
        }
    }
}

#[test]
fn a_plane_that_leans_meets_copies_in_many_rows() {
    let mut dice = Dice::new(6);
    let parameters = OrchardParameters {
        trees: Some(3),
        rows: Some(3),
        distinct_trees: Some(2),
        ..OrchardParameters::of(Preset::Spindle)
    };
    let orchard = Orchard::grow(&parameters, 4, &|_, _| {}).unwrap();
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let mut scratch = Scratch::default();
    let mut classes = [0; 4];
    for _ in 0..6 {
        let fan = dice.leaning(BeamFan::from_degrees(-135.0, 5.0, 55).advancing(0.0004));
        let found = compare(&oracle, &caster, dice.pose(), &fan, &mut scratch);
        classes.iter_mut().zip(found).for_each(|(sum, count)| *sum += count);
    }
    assert!(classes[Class::Leaf as usize] > 20, "{classes:?}");
}

/// Nearest surface and first leaves of every beam; leaves met at once may come in either order.
fn compare_layers(oracle: &Oracle<'_>, origin: Pose, beams: &Beams, k: usize, out: &Layers) {
    assert_eq!(out.len(), beams.len());
    for (beam, (start, direction)) in beams.rays(origin).enumerate() {
        let slow = oracle.leaves(start, direction, k);
        let fast = out.leaves(beam);
        let nearest = agree(&out.nearest()[beam], &oracle.ray(start, direction));
        let same = fast.len() == slow.len() && fast.iter().zip(&slow).all(|(a, b)| agree(a, b).is_ok());
        assert!(
            same && nearest.is_ok(),
            "beam {beam} of {start:?} {direction:?}: {nearest:?} {fast:?} {slow:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn every_layer_is_the_oracles_in_fans_and_in_parallel_beams(seed in any::<u64>()) {
        let mut dice = Dice::new(seed);
        let orchard = dice.scene();
        let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
        let (mut scratch, mut out) = (Scratch::default(), Layers::default());
        for k in [0, 1, 3, 5] {
            let pose = dice.pose();
            for beams in [dice.fan().into(), dice.moving_fan().into(), Beams::from(dice.parallel())] {
                caster.cast_layers(pose, &beams, k, &mut scratch, &mut out);
                compare_layers(&oracle, pose, &beams, k, &out);
            }
        }
    }
}

#[test]
fn every_return_is_the_oracles_beside_above_and_within_grown_rows() {
    let mut dice = Dice::new(5);
    let mut classes = [0; 4];
    for (preset, trees, seed) in [(Preset::Spindle, 2, 1), (Preset::Paper, 1, 2), (Preset::Spindle, 1, 3)] {
        let mut parameters =
            OrchardParameters { trees: Some(trees), rows: Some(2), ..OrchardParameters::of(preset) };
        parameters.tree.iterations = Some(6);
        // A crown wider than the row is long: many images of every tree.
        parameters.tree_spacing_m = Some(0.7);
        parameters.tree.petiole_radius_m = Some(0.0006);
        let orchard = Orchard::grow(&parameters, seed, &|_, _| {}).unwrap();
        let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
        let mut scratch = Scratch::default();
        let fan = BeamFan::from_degrees(-135.0, 2.0, 136);
        for _ in 0..300 {
            let found = compare(&oracle, &caster, dice.pose(), &fan, &mut scratch);
            classes.iter_mut().zip(found).for_each(|(sum, count)| *sum += count);
        }
    }
    assert!(classes.iter().all(|count| *count > 1_000), "leaf, wood, ground, none: {classes:?}");
}

#[test]
fn the_default_row_is_the_oracles_at_full_resolution() {
    let orchard = Orchard::grow(&OrchardParameters::default(), 1, &|_, _| {}).unwrap();
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let mut scratch = Scratch::default();
    let fan = BeamFan::from_degrees(-10.0, 1.0 / 6.0, 240);
    // Beside the first tree's foot, and through the crown of the sixth.
    for y_m in [0.603, 8.27] {
        let classes = compare(&oracle, &caster, Pose { x_m: -1.9, y_m, z_m: 1.6 }, &fan, &mut scratch);
        assert!(classes[Class::Leaf as usize] > 40, "{classes:?}");
    }
}

/// A hedge so dense that its back lies behind its front: some 700 leaves cut by a line.
#[test]
fn every_return_is_the_oracles_where_leaves_hide_leaves() {
    let mut dice = Dice::new(12);
    let leaves = (0..10_000).map(|_| {
        let middle = [dice.between(-0.8, 0.8), dice.between(0.0, 0.5), dice.between(0.2, 2.5)];
        let (along, other) = (dice.direction(), dice.direction());
        let across = cross(along, if dot(along, other).abs() > 0.9 { [0.6, 0.0, 0.8] } else { other });
        let width = 0.02 / dot(across, across).sqrt();
        let blade = [[-1.0, 0.0], [-0.3, 0.9], [0.4, 0.8], [1.0, 0.1], [0.2, -0.9], [-0.6, -0.7]];
        let vertex = |[a, b]: [f64; 2]| {
            std::array::from_fn(|i| middle[i] + 0.03 * a * along[i] + width * b * across[i])
        };
        Leaf::new(blade.map(vertex).to_vec()).unwrap()
    });
    let orchard = Orchard::from_organs(leaves.collect(), vec![], 0.5);
    let (oracle, caster) = (Oracle::new(&orchard), Caster::new(&orchard));
    let (mut scratch, mut out) = (Scratch::default(), Layers::default());
    let fan = BeamFan::from_degrees(-90.0, 1.7, 106);
    let opposite = BeamFan::from_degrees(90.0, 1.7, 106).advancing(1e-4);
    for (x_m, fan) in [(-1.9, fan.clone()), (-1.4, fan.advancing(2e-5)), (1.7, opposite)] {
        let pose = Pose { x_m, y_m: dice.between(0.0, 0.5), z_m: 1.3 };
        compare(&oracle, &caster, pose, &fan, &mut scratch);
        caster.cast_layers(pose, &fan.clone().into(), 3, &mut scratch, &mut out);
        compare_layers(&oracle, pose, &fan.into(), 3, &out);
    }
}

#[test]
fn any_register_width_gives_the_same_bits() {
    let mut dice = Dice::new(21);
    for number in 0..20 {
        let wide = Caster::new(&if number % 2 == 0 { dice.scene() } else { dice.foliage() });
        let single = wide.clone().with_registers(Registers::Single);
        let (mut scratch, mut a, mut b) = (Scratch::default(), Layers::default(), Layers::default());
        let askew = [dice.fan(), dice.moving_fan()].map(|fan| Beams::from(dice.leaning(fan)));
        let level = [dice.fan().into(), dice.moving_fan().into(), Beams::from(dice.parallel())];
        for beams in level.into_iter().chain(askew) {
            let pose = dice.pose();
            wide.cast_layers(pose, &beams, 3, &mut scratch, &mut a);
            single.cast_layers(pose, &beams, 3, &mut scratch, &mut b);
            assert_eq!(a.nearest(), b.nearest());
            assert!((0..beams.len()).all(|beam| a.leaves(beam) == b.leaves(beam)));
        }
    }
}

#[test]
fn lines_in_parallel_are_the_lines_one_by_one() {
    let mut dice = Dice::new(31);
    let caster = Caster::new(&dice.scene());
    let fan = BeamFan::from_degrees(-135.0, 0.5, 541).advancing(0.015 / 541.0);
    let origins: Vec<Pose> = (0..40).map(|_| dice.pose()).collect();
    let mut together = vec![Return::MISS; 541 * origins.len()];
    caster.cast_lines(&origins, &fan, &mut together);
    let (mut scratch, mut line) = (Scratch::default(), vec![Return::MISS; 541]);
    for (origin, found) in origins.iter().zip(together.chunks(541)) {
        caster.cast(*origin, &fan, &mut scratch, &mut line);
        assert_eq!(line, found);
    }
}

#[test]
fn the_row_repeats_for_ever() {
    let mut dice = Dice::new(9);
    let orchard = dice.scene();
    let orchard = Orchard::from_trees(orchard.distinct_trees().to_vec(), 4.0, None, None);
    let caster = Caster::new(&orchard);
    let fan = BeamFan::from_degrees(-135.0, 0.5, 541);
    let mut scratch = Scratch::default();
    let (mut here, mut there) = (vec![Return::MISS; 541], vec![Return::MISS; 541]);
    let mut met = 0;
    for k in 0..64 {
        // Multiples of 1/16 are exact, so the wrapped place is too.
        let pose = Pose { x_m: -2.0, y_m: f64::from(k) / 16.0, z_m: 1.6 };
        caster.cast(pose, &fan, &mut scratch, &mut here);
        for periods in [-3.0, 1.0, 1000.0] {
            caster.cast(Pose { y_m: pose.y_m + 4.0 * periods, ..pose }, &fan, &mut scratch, &mut there);
            assert_eq!(here, there);
        }
        met += here.iter().filter(|hit| matches!(hit.class, Class::Leaf | Class::Wood)).count();
    }
    assert!(met > 1000, "{met}");
}

#[test]
fn an_origin_that_is_no_number_meets_nothing() {
    let orchard = Dice::new(1).scene();
    let fan = BeamFan::from_degrees(-135.0, 0.5, 541);
    let mut out = vec![Return::default(); 541];
    let pose = Pose { x_m: 0.0, y_m: f64::NAN, z_m: f64::NAN };
    Caster::new(&orchard).cast(pose, &fan, &mut Scratch::default(), &mut out);
    assert!(out.iter().all(|hit| !hit.is_hit()));
}
