//! Scans of the analytic scenes give what their formulas say.

use rowscan_scenes::scan::{Sampling, ScanAreas, ScanKind, ScanPlan, ScanSettings, Target};
use rowscan_scenes::{Caster, Class, Orchard, Scene, builtin};

const CELLS: f64 = 6.0;
const CELL_M: f64 = 2.0;
const HEIGHT_M: f64 = 2.5;

fn orchard(name: &str) -> Orchard {
    let scene: Scene = toml::from_str(builtin::text(name).unwrap()).unwrap();
    Orchard::grow(&scene.orchard, scene.seed, &|_, _| {}).unwrap()
}

fn plan(orchard: &Orchard) -> ScanPlan {
    let settings = ScanSettings {
        kind: ScanKind::LateralOrthogonal,
        dy_m: 0.005,
        pitch_m: 0.005,
        sampling: Sampling::Centre,
        distance_m: 1.9,
        ..ScanSettings::default()
    };
    ScanPlan::new(&Target::row(orchard, 0).unwrap(), &settings).unwrap()
}

fn areas(orchard: &Orchard) -> ScanAreas {
    plan(orchard).areas(&Caster::new(orchard))
}

#[test]
fn walls_are_seen_as_large_as_they_are() {
    let wall = CELLS * CELL_M * HEIGHT_M;
    for (name, share) in [("wall", 1.0), ("gap_wall", 1.0 - 0.075 / CELL_M), ("checker", 0.5)] {
        let orchard = orchard(name);
        let seen = areas(&orchard);
        assert!((seen.leaf_m2 / (wall * share) - 1.0).abs() < 1e-9, "{name}: {}", seen.leaf_m2);
        assert!((orchard.truth().leaf_area_m2 / (wall * share) - 1.0).abs() < 1e-12, "{name}");
    }
}

#[test]
fn a_cylinder_shows_its_silhouette() {
    let seen = areas(&orchard("cylinder"));
    assert!((seen.total_m2 / (CELLS * 0.5 * HEIGHT_M) - 1.0).abs() < 0.011, "{}", seen.total_m2);
    assert_eq!(seen.leaf_m2, 0.0);
}

#[test]
fn a_post_is_a_post_and_no_wood() {
    let orchard = orchard("post");
    assert_eq!(areas(&orchard).total_m2, 0.0);
    let hits: usize = plan(&orchard)
        .lines(&Caster::new(&orchard), 0, |line| {
            line.layers.nearest().iter().filter(|hit| hit.class == Class::Post).count()
        })
        .into_iter()
        .sum();
    let silhouette = hits as f64 * 0.005 * 0.005;
    assert!((silhouette / (CELLS * 0.1 * HEIGHT_M) - 1.0).abs() < 0.06, "{silhouette}");
    let truth = orchard.truth();
    assert_eq!((truth.leaf_area_m2, truth.wood_area_m2), (0.0, 0.0));
    assert!((truth.post_area_m2 - CELLS * std::f64::consts::TAU * 0.05 * HEIGHT_M).abs() < 1e-9);
}

#[test]
fn the_slab_lets_through_what_beer_and_lambert_say() {
    let scene: Scene = toml::from_str(builtin::text("slab").unwrap()).unwrap();
    // Beams through one scene are correlated: the mean of independent scenes, and their own spread, decide.
    let gaps: Vec<f64> = (1..=30)
        .map(|seed| {
            let mut parameters = scene.orchard.clone();
            (parameters.trees, parameters.analytic.density_m2_m3) = (Some(1), Some(1.5));
            let orchard = Orchard::grow(&parameters, seed, &|_, _| {}).unwrap();
            let settings = ScanSettings {
                dy_m: 0.05,
                pitch_m: 0.05,
                range: Some((0.7, 2.8)),
                ..plan(&orchard).settings().clone()
            };
            let plan = ScanPlan::new(&Target::row(&orchard, 0).unwrap(), &settings).unwrap();
            let lines = plan.lines(&Caster::new(&orchard), 0, |line| {
                let nearest = line.layers.nearest();
                (nearest.iter().filter(|hit| !hit.is_hit()).count(), nearest.len())
            });
            let (through, all) = lines.into_iter().fold((0, 0), |sum, line| (sum.0 + line.0, sum.1 + line.1));
            through as f64 / all as f64
        })
        .collect();
    let count = gaps.len() as f64;
    let mean = gaps.iter().sum::<f64>() / count;
    let error =
        (gaps.iter().map(|gap| (gap - mean) * (gap - mean)).sum::<f64>() / (count - 1.0) / count).sqrt();
    // G = 1/2, level beams through one metre.
    let expected = f64::exp(-0.5 * 1.5);
    assert!((mean - expected).abs() < 3.5 * error, "{mean} ± {error}, {expected}");
    assert!(error < 0.02);
}
