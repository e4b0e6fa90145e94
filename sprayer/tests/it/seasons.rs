//! The leaf stage: the more leaves are out, the less a boom that follows them saves.

use rowscan_protocol::time::SimTime;
use rowscan_scenes::orchard::Preset;
use rowscan_scenes::season::Season;
use rowscan_scenes::{Orchard, OrchardParameters};
use rowscan_sprayer::{Boom, Drive, Pass, Score, oracle};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::trajectory::Trajectory;

/// From bare to full.
const STAGES: [Season; 6] =
    [Season::Dormant, Season::BudBurst, Season::Unfolding, Season::Bloom, Season::FruitSet, Season::FullLeaf];
const SEEDS: u64 = 20;

/// Ideal valves: what is saved is what the leaves leave.
fn boom() -> Boom {
    let sections = [0.5, 1.2, 1.9].map(|z| {
        format!("[[section]]\nid = \"{z}\"\nside = \"right\"\nz_from_m = {z}\nz_to_m = {}\n", z + 0.7)
    });
    Boom::read(&format!(
        "version = 1\noffset_y_m = 0\n[valve]\non_ms = 0\noff_ms = 0\nrise_ms = 0\nfall_ms = 0\n{}",
        sections.concat()
    ))
    .expect("a boom")
}

/// Share of the litres of a constant rate that the oracle saves.
fn saved(seed: u64, season: Season) -> f64 {
    let parameters =
        OrchardParameters { trees: Some(3), rows: Some(1), season, ..OrchardParameters::of(Preset::Paper) };
    let orchard = Orchard::grow(&parameters, seed, &|_, _| {}).expect("it grows");
    let tractor = Tractor::new(Trajectory::straight(-1.0, 1.5));
    tractor.begin(SimTime::ZERO);
    let until_s = (orchard.length_m() + 2.0) / 1.5;
    let drive = Drive::of(|at| tractor.motion(at), SimTime::ZERO, SimTime((until_s * 1e9) as u64));
    let pass = Pass::new(boom(), &orchard, drive, seed);
    let found = Score::of(&pass, &pass.flows(&oracle::commands(&pass)));
    assert!(found.recall.is_none_or(|recall| recall > 1.0 - 1e-6), "{season:?} {seed}: {found:?}");
    found.saved_litres.expect("commands were heard") / found.constant_litres
}

#[test]
fn the_saving_falls_with_every_leaf_stage() {
    let mut sums = [0.0; STAGES.len()];
    for seed in 1..=SEEDS {
        let shares = STAGES.map(|season| saved(seed, season));
        assert!((shares[0] - 1.0).abs() < 1e-9, "seed {seed}: nothing is wanted of a bare row: {shares:?}");
        assert!(shares.windows(2).all(|pair| pair[0] >= pair[1]), "seed {seed}: {shares:?}");
        sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share / SEEDS as f64);
    }
    // Of the mean each step counts.
    assert!(sums.windows(2).all(|pair| pair[0] > pair[1] + 0.01), "{sums:?}");
}
