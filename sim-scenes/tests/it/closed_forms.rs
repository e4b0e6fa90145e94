//! Scenes whose answer is known on paper: wall, post, leaf, random slab, and the identities of impacted areas.

use std::f64::consts::PI;

use rowscan_protocol::scan::Pose;
use rowscan_scenes::caster::brute::Oracle;
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::seed::Purpose;
use rowscan_scenes::{BeamFan, Caster, Class, Cylinder, Leaf, Orchard, Return, Scratch};

/// Forward form of a beam's impacted area over the advance: l · (sin(θ + Δ) − sin θ).
fn forward(range_m: f64, theta: f64, step: f64) -> f64 {
    range_m * ((theta + step).sin() - theta.sin())
}

/// Midpoint form: 2 l sin(Δ/2) cos θ.
fn midpoint(range_m: f64, theta: f64, step: f64) -> f64 {
    2.0 * range_m * (step / 2.0).sin() * theta.cos()
}

/// Casts lines from (−D, y, z0) and hands over every return with its θ.
fn scan(
    orchard: &Orchard,
    [distance_m, z_m]: [f64; 2],
    ys: impl Iterator<Item = f64>,
    fan: &BeamFan,
    mut each: impl FnMut(f64, &Return),
) {
    let caster = Caster::new(orchard);
    let mut scratch = Scratch::default();
    let mut out = vec![Return::MISS; fan.len()];
    for y_m in ys {
        caster.cast(Pose { x_m: -distance_m, y_m, z_m }, fan, &mut scratch, &mut out);
        out.iter().enumerate().for_each(|(beam, hit)| each(fan.theta_rad(beam), hit));
    }
}

fn is_impact(hit: &Return) -> bool {
    matches!(hit.class, Class::Leaf | Class::Wood)
}

#[test]
fn a_wall_gives_both_forms_of_equation_3_exactly() {
    // A wall at distance x0 wide enough along Y, of which N beams from −30° on by 0.5° meet every one.
    let (distance_m, z_m, x0) = (1.9, 1.6, 2.3);
    let x = x0 - distance_m;
    let wall = Leaf::new(vec![[x, -1.0, 0.01], [x, 3.0, 0.01], [x, 3.0, 9.0], [x, -1.0, 9.0]]).unwrap();
    let orchard = Orchard::from_organs(vec![wall], vec![], f64::INFINITY);
    let (step_deg, beams, lines, advance_m) = (0.5, 181, 100, 0.02);
    let step = f64::to_radians(step_deg);
    let fan = BeamFan::from_degrees(-30.0, step_deg, beams);
    let (mut by_forward, mut by_midpoint, mut tangents, mut met) = (0.0, 0.0, 0.0, 0);
    scan(&orchard, [distance_m, z_m], (0..lines).map(|i| f64::from(i) * advance_m), &fan, |theta, hit| {
        assert_eq!(hit.class, Class::Leaf);
        assert!((hit.range_m * theta.cos() - x0).abs() < 1e-12);
        assert!((f64::from(hit.cos_incidence) - theta.cos()).abs() < 1e-6);
        by_forward += advance_m * forward(hit.range_m, theta, step);
        by_midpoint += advance_m * midpoint(hit.range_m, theta, step);
        tangents += theta.tan();
        met += 1;
    });
    assert_eq!(met, beams * lines as usize);
    let width_m = advance_m * f64::from(lines);
    let n = beams as f64;
    let tangents = tangents / f64::from(lines);
    let expected = width_m * x0 * (n * step.sin() - (1.0 - step.cos()) * tangents);
    assert!((by_forward / expected - 1.0).abs() < 1e-12, "{by_forward} {expected}");
    let expected = width_m * x0 * 2.0 * n * (step / 2.0).sin();
    assert!((by_midpoint / expected - 1.0).abs() < 1e-12, "{by_midpoint} {expected}");
}

#[test]
fn walls_of_touching_panels_have_neither_gaps_nor_doubles() {
    // A hundred random panels that tile x = 0.4: every beam that the whole wall stops is stopped by exactly one.
    let mut stream = Purpose::Growth.stream(3, 1, 1);
    let mut cuts = |n: usize, length: f64| {
        let mut at: Vec<f64> = (0..n).map(|_| stream.unit() * length).chain([0.0, length]).collect();
        at.sort_by(f64::total_cmp);
        at
    };
    let (ys, zs) = (cuts(9, 1.0), cuts(9, 4.0));
    let panels = ys.windows(2).flat_map(|y| {
        zs.windows(2).map(|z| {
            let corners = vec![[0.4, y[0], z[0]], [0.4, y[1], z[0]], [0.4, y[1], z[1]], [0.4, y[0], z[1]]];
            Leaf::new(corners).unwrap()
        })
    });
    let orchard = Orchard::from_organs(panels.collect(), vec![], 1.0);
    // Steps of 1/64° are exact: beam 2048 is horizontal, and from the height of a seam runs exactly into it.
    let fan = BeamFan::from_degrees(-32.0, 1.0 / 64.0, 4000);
    let lines: Vec<f64> =
        ys.iter().copied().chain((0..40).map(|i| f64::from(i) * 0.025)).filter(|y| *y < 1.0).collect();
    let mut met = 0;
    for height_m in zs[1..10].iter().copied() {
        scan(&orchard, [1.9, height_m], lines.iter().copied(), &fan, |theta, hit| {
            let reaches = 2.3 * theta.tan() + height_m;
            if reaches > 1e-9 && reaches < 4.0 - 1e-9 {
                assert_eq!(hit.class, Class::Leaf, "{theta}");
                assert!((hit.range_m * theta.cos() - 2.3).abs() < 1e-12);
                met += 1;
            }
        });
    }
    assert!(met > 100_000, "{met}");
}

#[test]
fn a_post_gives_its_integral() {
    // Vertical, radius r at distance D: I_T = ∫ x(y) [θ2(y) − θ1(y)] dy, x = D − sqrt(r² − y²), θ = atan((z − z0) / x).
    let (distance_m, z0, r, [low, high]) = (1.9, 1.6, 0.15, [0.4, 2.6]);
    let post = Cylinder::new([0.0, 1.0, low], [0.0, 1.0, high], r).unwrap();
    let orchard = Orchard::from_organs(vec![], vec![post], f64::INFINITY);
    let (step_deg, lines) = (0.02, 600);
    let step = f64::to_radians(step_deg);
    let fan = BeamFan::from_degrees(-60.0, step_deg, 6000);
    let advance_m = 2.0 * r / f64::from(lines);
    let mut area = 0.0;
    let middles = (0..lines).map(|i| 1.0 - r + (f64::from(i) + 0.5) * advance_m);
    scan(&orchard, [distance_m, z0], middles, &fan, |theta, hit| {
        // The near face only: ends seen at a slant (the top from above) are not in the integral.
        let on_side = f64::from(hit.cos_incidence) > 0.0 && hit.class == Class::Wood && {
            let z = z0 + hit.range_m * theta.sin();
            z > low + 1e-9 && z < high - 1e-9
        };
        if on_side {
            area += advance_m * midpoint(hit.range_m, theta, step);
        }
    });
    // The same midpoint rule in y (that part of the error cancels), the angle exact: what is left is one beam at each end of the
    // angular interval, at most Δθ / (θ2 − θ1) of it, and half of that on the average over 600 lines.
    let integral: f64 = (0..lines)
        .map(|i| {
            let y = -r + (f64::from(i) + 0.5) * advance_m;
            let x = distance_m - (r * r - y * y).sqrt();
            advance_m * x * (((high - z0) / x).atan() - ((low - z0) / x).atan())
        })
        .sum();
    let seen = ((high - z0) / (distance_m - r)).atan() - ((low - z0) / (distance_m - r)).atan();
    assert!((area / integral - 1.0).abs() < 0.5 * step / seen, "{area} {integral}");
    // Against the true integral in y: substitute y = r sin u, where the integrand is smooth; 2000 midpoints are exact to 1e-6.
    let smooth: f64 = (0..2000)
        .map(|i| {
            let u = -PI / 2.0 + (f64::from(i) + 0.5) * PI / 2000.0;
            let x = distance_m - r * u.cos();
            PI / 2000.0 * r * u.cos() * x * (((high - z0) / x).atan() - ((low - z0) / x).atan())
        })
        .sum();
    // The midpoint rule meets a square-root end at both edges: its error falls as lines^-1.5.
    assert!((area / smooth - 1.0).abs() < 1e-3, "{area} {smooth}");
}

#[test]
fn a_leafs_mean_over_start_offsets_is_its_projected_area() {
    // Parallel beams on a grid of cells Δy × Δz: with stratified offsets the mean of the hit count is the area up to the finer grid.
    let outline = vec![
        [0.02, 0.10, 1.0],
        [-0.03, 0.31, 1.05],
        [0.05, 0.22, 1.16],
        [0.0, 0.33, 1.31],
        [-0.02, 0.12, 1.22],
        [0.03, 0.18, 1.1],
    ];
    let leaf = Leaf::new(outline.clone()).unwrap();
    let [nx, ..] = leaf.normal();
    let projected = leaf.area_m2() * nx.abs();
    let orchard = Orchard::from_organs(vec![leaf], vec![], f64::INFINITY);
    let (cell_m, offsets) = (0.02, 20);
    let oracle = Oracle::new(&orchard);
    let mut hits = 0;
    for (oy, oz) in (0..offsets).flat_map(|a| (0..offsets).map(move |b| (a, b))) {
        let offset = |k: i32| (f64::from(k) + 0.5) / f64::from(offsets) * cell_m;
        for (i, j) in (0..20).flat_map(|i| (0..20).map(move |j| (i, j))) {
            let (y, z) = (f64::from(i) * cell_m + offset(oy), 0.95 + f64::from(j) * cell_m + offset(oz));
            hits += u32::from(oracle.ray([-1.9, y, z], [1.0, 0.0, 0.0]).class == Class::Leaf);
        }
    }
    let mean = f64::from(hits) * cell_m * cell_m / f64::from(offsets * offsets);
    // All offsets together sample on a 1 mm grid: off by less than the perimeter (about 0.9 m) times half a millimetre.
    assert!((mean - projected).abs() < 0.9 * 0.5e-3, "{mean} {projected}");
    assert!((mean / projected - 1.0).abs() < 5e-3, "{mean} {projected}");
}

/// Horizontal leaf squares strewn in a slab above the ground, as many as a Poisson variable says, seen from below through it.
fn random_slab(scene: u32, lai: f64, side_m: f64, half_width_m: f64, length_m: f64) -> Orchard {
    let mut stream = Purpose::Growth.stream(41, 9, scene);
    let mean = lai * 2.0 * half_width_m * length_m / (side_m * side_m);
    // Knuth's product of uniforms, taken in parts that do not underflow.
    let mut count = 0;
    let mut left = mean;
    while left > 0.0 {
        let limit = (-left.min(500.0)).exp();
        let mut product = stream.unit();
        while product > limit {
            count += 1;
            product *= stream.unit();
        }
        left -= 500.0;
    }
    let leaves = (0..count).map(|_| {
        let (x, y, z) =
            ((2.0 * stream.unit() - 1.0) * half_width_m, stream.unit() * length_m, 1.0 + stream.unit());
        let (sin, cos) = (stream.unit() * 2.0 * PI).sin_cos();
        let corner = |a: f64, b: f64| {
            let h = side_m / 2.0;
            [x + h * (a * cos - b * sin), y + h * (a * sin + b * cos), z]
        };
        Leaf::new(vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]).unwrap()
    });
    Orchard::from_organs(leaves.collect(), vec![], length_m)
}

#[test]
fn a_random_slab_lets_through_what_poisson_says() {
    // Horizontal leaves, beams up at zenith angle ζ: the path sees LAI leaves whatever ζ, so P = exp(−LAI). Beams of one scene are
    // correlated: a t-test over 40 independent scenes, two-sided at 0.1 % (t39 = 3.56), at fixed seeds.
    let (lai, scenes) = (1.2, 40);
    let fan = BeamFan::from_degrees(60.0, 0.5, 121);
    let gaps: Vec<f64> = (0..scenes)
        .map(|scene| {
            let orchard = random_slab(scene, lai, 0.08, 3.0, 1.5);
            let (mut through, mut fired) = (0.0, 0.0);
            // Zenith angles up to 30° leave the slab at most 2 tan 30° = 1.2 m aside: well within its half width.
            scan(&orchard, [0.0, 0.0], (0..50).map(|i| f64::from(i) * 0.03), &fan, |_, hit| {
                fired += 1.0;
                through += f64::from(u8::from(!hit.is_hit()));
            });
            through / fired
        })
        .collect();
    let n = f64::from(scenes);
    let mean = gaps.iter().sum::<f64>() / n;
    let deviation = (gaps.iter().map(|gap| (gap - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let t = (mean - f64::exp(-lai)) / (deviation / n.sqrt());
    assert!(t.abs() < 3.56, "mean {mean}, expected {}, t {t}", f64::exp(-lai));
    // And the test has teeth: 3 % of error in LAI would be seen.
    assert!(deviation / n.sqrt() < 0.012 * f64::exp(-lai), "standard error {}", deviation / n.sqrt());
}

#[test]
fn identities_of_impacted_areas_hold_on_grown_rows() {
    let mut parameters = OrchardParameters { trees: Some(3), ..OrchardParameters::of(Preset::Spindle) };
    parameters.tree.iterations = Some(8);
    let orchard = Orchard::grow(&parameters, 2, &|_, _| {}).unwrap();
    let step_deg = 0.5;
    let fan = BeamFan::from_degrees(-89.5, step_deg, 359);
    let areas = |orchard: &Orchard, start_m: f64| {
        let (mut leaf, mut all, mut wood_first) = (0.0, 0.0, false);
        scan(orchard, [1.9, 1.6], (0..225).map(|i| start_m + f64::from(i) * 0.02), &fan, |theta, hit| {
            let area = 0.02 * midpoint(hit.range_m, theta, f64::to_radians(step_deg));
            if is_impact(hit) {
                all += area;
            }
            match hit.class {
                Class::Leaf => leaf += area,
                Class::Wood => wood_first = true,
                _ => {}
            }
        });
        (leaf, all, wood_first)
    };
    // Off the trunks' tangents: a line that grazes a trunk may meet it on one lap and not on the next.
    let start_m = 0.0031;
    let (leaf, all, wood_first) = areas(&orchard, start_m);
    assert!(0.0 < leaf && leaf < all && wood_first);
    // A whole period on: the same to rounding of the sum. The row is 225 lines long.
    let (leaf_on, all_on, _) = areas(&orchard, start_m + orchard.length_m());
    assert!((leaf_on / leaf - 1.0).abs() < 1e-9 && (all_on / all - 1.0).abs() < 1e-9);
    // A start some lines on meets the same lines in another order.
    let (_, all_later, _) = areas(&orchard, start_m + 0.02 * 37.0);
    assert!((all_later / all - 1.0).abs() < 1e-6, "{all_later} {all}");
    // Without leaves: I_L = 0 < I_T. Without wood: I_L = I_T. Without anything: 0.
    let strip = |keep_leaves: bool, keep_wood: bool| {
        let trees = orchard.trees().map(|tree| tree.into_owned()).map(|mut tree| {
            if !keep_leaves {
                tree.leaves.clear();
            }
            if !keep_wood {
                tree.wood.clear();
            }
            tree
        });
        areas(&Orchard::from_trees(trees.collect(), orchard.length_m(), None, None), start_m)
    };
    let (bare_leaf, bare_all, _) = strip(false, true);
    assert!(bare_leaf == 0.0 && bare_all > 0.0);
    let (only_leaf, only_all, wood) = strip(true, false);
    assert!(only_leaf == only_all && only_leaf > leaf && !wood);
    assert_eq!(strip(false, false), (0.0, 0.0, false));
}

#[test]
fn the_ground_is_a_plane_and_the_sky_is_empty() {
    let orchard = Orchard::from_organs(vec![], vec![], f64::INFINITY);
    let fan = BeamFan::from_degrees(-180.0, 0.5, 720);
    let mut horizontal = 0;
    scan(&orchard, [1.9, 1.6], [0.0].into_iter(), &fan, |theta, hit| {
        horizontal += i32::from(theta.abs() < 1e-12 || (theta.abs() - PI).abs() < 1e-12);
        if theta < -1e-12 && theta > -PI + 1e-12 {
            assert_eq!(hit.class, Class::Ground);
            assert!((hit.range_m * theta.sin() + 1.6).abs() < 1e-12);
        } else {
            assert_eq!(hit.range_m, f64::INFINITY, "{theta}");
        }
    });
    assert_eq!(horizontal, 2);
}
