//! Noise against the recorded static scenes (OPTICS.md 7).

use super::bench::{Bench, fan, optics, plate, settings};

/// Errors of 41 beams over `scans` lines at a flat plate, mm, beam by beam.
fn errors(model: &str, scans: u64) -> Vec<Vec<f64>> {
    let mut bench = Bench::new(&optics(model), 1, &settings("noise"), vec![plate(1.5)], &fan(0.5, 41));
    let mut beams = vec![Vec::new(); 41];
    for scan in 0..scans {
        for (series, echoes) in beams.iter_mut().zip(bench.look(scan)) {
            series.push(f64::from(echoes[0].range_mm) - 1e3 * echoes[0].range_m);
        }
    }
    beams
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

fn moment(series: &[f64], power: i32) -> f64 {
    let middle = mean(series.iter().copied());
    mean(series.iter().map(|value| (value - middle).powi(power)))
}

#[test]
fn sigma_kurtosis_and_correlations_are_the_recorded_ones() {
    for (model, sigma, kurtosis) in [("lms111", 8.3, 2.4), ("lms511", 3.6, 2.9), ("tim781s", 11.3, 3.0)] {
        let beams = errors(model, 400);
        let mut sigmas: Vec<f64> = beams.iter().map(|series| moment(series, 2).sqrt()).collect();
        sigmas.sort_by(f64::total_cmp);
        let median = sigmas[20];
        assert!((median / sigma - 1.0).abs() < 0.10, "{model}: sigma {median}");
        let found = mean(beams.iter().map(|series| moment(series, 4) / moment(series, 2).powi(2)));
        assert!((found - kurtosis).abs() < 0.2, "{model}: kurtosis {found}");
        let product = |one: &[f64], other: &[f64]| {
            let (a, b) = (mean(one.iter().copied()), mean(other.iter().copied()));
            mean(one.iter().zip(other).map(|(x, y)| (x - a) * (y - b))) / median.powi(2)
        };
        let lag = mean(beams.iter().map(|series| product(&series[1..], &series[..399])));
        let neighbours = mean(beams.windows(2).map(|pair| product(&pair[0], &pair[1])));
        assert!(lag.abs() < 0.03 && neighbours.abs() < 0.03, "{model}: {lag}, {neighbours}");
    }
}

#[test]
fn the_allan_deviation_falls_as_recorded() {
    for (model, expected) in [("lms111", 2.4), ("lms511", 1.0), ("tim781s", 3.4)] {
        let beams = errors(model, 400);
        let adev = mean(beams.iter().map(|series| {
            let means: Vec<f64> = series.chunks_exact(10).map(|ten| mean(ten.iter().copied())).collect();
            mean(means.windows(2).map(|pair| (pair[1] - pair[0]).powi(2) / 2.0))
        }))
        .sqrt();
        // 15 %, and the recorded figure's last digit.
        assert!((adev - expected).abs() < 0.15 * expected + 0.05, "{model}: {adev} mm");
    }
}

#[test]
fn the_fixed_pattern_is_the_units_and_the_systematic_error_stays_within_half_of_its_bound() {
    let pattern = |unit| {
        let settings = rowscan_scenes::optics::OpticsSettings { unit: Some(unit), ..settings("noise") };
        let mut bench = Bench::new(&optics("tim781s"), 1, &settings, vec![plate(2.0)], &fan(0.5, 41));
        let mut sums = vec![0.0; 41];
        for scan in 0..300 {
            for (sum, echoes) in sums.iter_mut().zip(bench.look(scan)) {
                *sum += (f64::from(echoes[0].range_mm) - 1e3 * echoes[0].range_m) / 300.0;
            }
        }
        sums
    };
    let (one, same, other) = (pattern(1), pattern(1), pattern(2));
    assert_eq!(one, same);
    assert_ne!(one, other);
    // 1.8 mm, and 11.3 mm / √300 of noise that is left.
    let sd = moment(&one, 2).sqrt();
    assert!((1.3..2.5).contains(&sd), "{sd}");
    assert!(mean(one.iter().copied()).abs() <= 30.0 + 2.0);
}

#[test]
fn a_miss_stays_a_miss() {
    let mut bench = Bench::new(&optics("lms111"), 2, &settings("device"), vec![], &fan(0.5, 11));
    for scan in 0..50 {
        assert!(bench.look(scan).iter().flatten().all(|echo| echo.range_mm == 0 && echo.remission == 0));
    }
}
