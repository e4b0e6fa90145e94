//! How long growing the default row and scanning it once takes, on one thread.
//!
//! `cargo run --release -p rowscan-scenes --example caster_speed`

#![allow(clippy::print_stdout, missing_docs)]

use std::time::Instant;

use rowscan_protocol::scan::Pose;
use rowscan_scenes::orchard::OrchardParameters;
use rowscan_scenes::{BeamFan, Caster, GrowError, Orchard, Return, Scratch};

fn main() -> Result<(), GrowError> {
    let started = Instant::now();
    let orchard = Orchard::grow(&OrchardParameters::default(), 1, &|_, _| {})?;
    let leaves: usize = orchard.trees().map(|tree| tree.leaves.len()).sum();
    println!("grow    {:9.4} s  {leaves} leaves, all threads", started.elapsed().as_secs_f64());
    let started = Instant::now();
    let truth = orchard.truth();
    println!("truth   {:9.4} s  {:.2} m²", started.elapsed().as_secs_f64(), truth.leaf_area_m2);
    let started = Instant::now();
    let caster = Caster::new(&orchard);
    println!("sort    {:9.4} s", started.elapsed().as_secs_f64());
    for (title, fan) in [
        ("541 beams of 0.5°", BeamFan::from_degrees(-135.0, 0.5, 541)),
        ("1141 beams of 1/6°", BeamFan::from_degrees(-95.0, 1.0 / 6.0, 1141)),
    ] {
        let mut scratch = Scratch::default();
        let mut out = vec![Return::MISS; fan.len()];
        let mut seconds: Vec<f64> = (0..9)
            .map(|_| {
                let started = Instant::now();
                let mut hits = 0;
                for line in 0..900 {
                    let pose = Pose { x_m: -1.9, y_m: f64::from(line) * 0.02, z_m: 1.6 };
                    caster.cast(pose, &fan, &mut scratch, &mut out);
                    hits += usize::from(out[fan.len() / 2].is_hit());
                }
                assert!(hits > 0);
                started.elapsed().as_secs_f64()
            })
            .collect();
        seconds.sort_by(f64::total_cmp);
        let rays = 900.0 * fan.len() as f64;
        println!(
            "cast    {:9.4} s  900 lines of {title}, median of 9: {:.1} Mrays/s",
            seconds[4],
            rays / seconds[4] * 1e-6
        );
    }
    Ok(())
}
