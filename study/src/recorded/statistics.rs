//! How the ranges of beams that stand still scatter.

use serde::Serialize;

use super::Series;

/// Scans averaged for the Allan deviations.
const AVERAGED: [usize; 4] = [1, 4, 10, 20];
/// A beam that scatters so many times as much as the middle one hangs between two surfaces, or something moves there.
const LOOSE: f64 = 3.0;
/// Median of |x| of a normal variable of standard deviation 1.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// Scatter over the beams with an echo in every scan.
#[derive(Clone, Debug, Serialize)]
pub struct Scatter {
    /// Scans.
    pub scans: usize,
    /// Beams with an echo in every scan.
    pub beams: usize,
    /// Of those, beams that scatter more than three times as much as the median; left out of what follows.
    pub loose: usize,
    /// Standard deviation of a beam, mm: quartiles over the beams.
    pub sigma_mm: [f64; 3],
    /// Kurtosis; 3 for a normal distribution. Medians over the beams, as the correlations are: something that moves must not count.
    pub kurtosis: f64,
    /// Correlation with the scan before.
    pub lag_one: f64,
    /// Correlation with the next beam.
    pub neighbour: f64,
    /// Allan deviations of means over 1, 4, 10 and 20 scans, mm; null where the series is too short.
    pub allan_mm: [Option<f64>; 4],
    /// Standard deviation of what stands still over the beams, against the mean of both neighbours, mm; roughness of the scene included.
    pub pattern_mm: Option<f64>,
}

/// None without a beam that measured all the time.
pub(super) fn scatter(series: &Series) -> Option<Scatter> {
    let beams = series.angles_deg.len();
    let columns: Vec<Option<Column>> = (0..beams).map(|beam| Column::of(series, beam)).collect();
    let mut all: Vec<f64> = columns.iter().flatten().map(|column| column.sigma_mm).collect();
    let middle_mm = quantile(&mut all, 0.5)?;
    let steady: Vec<Option<&Column>> = columns
        .iter()
        .map(|column| column.as_ref().filter(|column| column.sigma_mm <= LOOSE * middle_mm))
        .collect();
    let kept: Vec<&Column> = steady.iter().flatten().copied().filter(|c| c.sigma_mm > 0.0).collect();
    let mut sigmas: Vec<f64> = kept.iter().map(|column| column.sigma_mm).collect();
    let quartiles = [0.25, 0.5, 0.75].map(|share| quantile(&mut sigmas, share).unwrap_or(f64::NAN));
    let scans = series.scans_mm.len();
    let n = scans as f64;
    let pairs =
        || steady.windows(2).filter_map(|pair| Some((pair.first().copied()??, pair.get(1).copied()??)));
    let correlations = pairs().filter_map(|(a, b)| correlation(&a.off_mm, &b.off_mm));
    Some(Scatter {
        scans,
        beams: all.len(),
        loose: all.iter().filter(|sigma_mm| **sigma_mm > LOOSE * middle_mm).count(),
        sigma_mm: quartiles,
        kurtosis: median(kept.iter().map(|column| column.kurtosis())),
        // Taking the mean off a series of n values correlates them by −1/n.
        lag_one: median(kept.iter().filter_map(|c| correlation(&c.off_mm, c.off_mm.get(1..)?))) + 1.0 / n,
        neighbour: median(correlations),
        allan_mm: AVERAGED.map(|m| allan_mm(&kept, m)),
        pattern_mm: pattern_mm(&steady, n),
    })
}

/// One beam's series.
struct Column {
    mean_mm: f64,
    sigma_mm: f64,
    off_mm: Vec<f64>,
}

impl Column {
    fn of(series: &Series, beam: usize) -> Option<Self> {
        let values: Vec<f64> = series.scans_mm.iter().filter_map(|scan| scan.get(beam).copied()).collect();
        let mean_mm = mean(values.iter().copied());
        let off_mm: Vec<f64> = values.iter().map(|value| value - mean_mm).collect();
        let squares: f64 = off_mm.iter().map(|off| off * off).sum();
        let sigma_mm = (squares / (values.len() as f64 - 1.0)).sqrt();
        sigma_mm.is_finite().then_some(Self { mean_mm, sigma_mm, off_mm })
    }

    /// Corrected for the sample's size, as far as a normal variable needs it.
    fn kurtosis(&self) -> f64 {
        let n = self.off_mm.len() as f64;
        let moment = |power: i32| self.off_mm.iter().map(|off| off.powi(power)).sum::<f64>() / n;
        moment(4) / moment(2).powi(2) * (n + 1.0) / (n - 1.0)
    }
}

/// Of two series about their means; the longer one is cut.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let sum = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let found = sum(a, b) / (sum(a, a) * sum(b, b)).sqrt();
    found.is_finite().then_some(found)
}

/// Root mean square over the beams.
fn allan_mm(kept: &[&Column], m: usize) -> Option<f64> {
    let (mut squares, mut count) = (0.0, 0.0);
    for column in kept {
        let means: Vec<f64> =
            column.off_mm.chunks_exact(m).map(|chunk| mean(chunk.iter().copied())).collect();
        for pair in means.windows(2) {
            squares += (pair.first()? - pair.get(1)?).powi(2);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (squares / (2.0 * count)).sqrt())
}

/// From second differences of the means, by their median: edges do not count. What the noise of n scans adds is taken off.
fn pattern_mm(steady: &[Option<&Column>], n: f64) -> Option<f64> {
    let bends = steady.windows(3).filter_map(|three| match three {
        [Some(a), Some(b), Some(c)] => Some((b.mean_mm - (a.mean_mm + c.mean_mm) / 2.0, b.sigma_mm)),
        _ => None,
    });
    let (mut sizes, sigmas): (Vec<f64>, Vec<f64>) = bends.map(|(bend, sigma)| (bend.abs(), sigma)).unzip();
    let spread_mm = quantile(&mut sizes, 0.5)? / MEDIAN_OF_NORMAL;
    let noise_mm2 = 1.5 * mean(sigmas.iter().map(|sigma| sigma * sigma)) / n;
    Some(((spread_mm * spread_mm - noise_mm2).max(0.0) / 1.5).sqrt())
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// NaN of no values.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(&mut values.collect::<Vec<_>>(), 0.5).unwrap_or(f64::NAN)
}

/// The value that this share lies below; sorts.
fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(((values.len().checked_sub(1)?) as f64 * share).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges of 40 beams over 400 scans: a wall, and what `off_mm` adds.
    fn series(off_mm: impl Fn(usize, usize) -> f64) -> Series {
        let scan = |scan: usize| (0..40).map(|beam| 1000.0 + off_mm(scan, beam)).collect();
        Series {
            angles_deg: (0..40).map(|beam| f64::from(beam) * 0.5).collect(),
            scans_mm: (0..400).map(scan).collect(),
        }
    }

    fn uniform(scan: usize, beam: usize) -> f64 {
        let mut stream = rowscan_protocol::random::Stream::keyed(1, &[scan as u64, beam as u64]);
        24.0 * stream.unit() - 12.0
    }

    #[test]
    fn a_uniform_noise_has_its_sigma_kurtosis_and_allan_deviations() {
        let found = scatter(&series(uniform)).expect("steady");
        let sigma_mm = 24.0 / 12.0_f64.sqrt();
        assert!((found.sigma_mm[1] / sigma_mm - 1.0).abs() < 0.03, "{found:?}");
        assert!((found.kurtosis - 1.8).abs() < 0.03, "{found:?}");
        assert!(found.lag_one.abs() < 0.02 && found.neighbour.abs() < 0.02, "{found:?}");
        let of_four = found.allan_mm[1].expect("long enough");
        assert!((of_four / (sigma_mm / 2.0) - 1.0).abs() < 0.05, "{found:?}");
        assert_eq!((found.beams, found.loose), (40, 0));
    }

    #[test]
    fn a_noise_of_two_scans_a_pattern_and_a_loose_beam_are_found() {
        let found = scatter(&series(|scan, beam| {
            let pattern_mm = if beam % 2 == 0 { 5.0 } else { -5.0 };
            let loose = if beam == 7 { 10.0 } else { 1.0 };
            pattern_mm + loose * (uniform(scan, beam) + uniform(scan + 1, beam))
        }))
        .expect("steady");
        assert!((found.lag_one - 0.5).abs() < 0.03, "{found:?}");
        assert_eq!(found.loose, 1);
        // Every beam lies 10 mm off the mean of its neighbours.
        let expected_mm = 10.0 / MEDIAN_OF_NORMAL / 1.5_f64.sqrt();
        assert!(found.pattern_mm.is_some_and(|mm| (mm / expected_mm - 1.0).abs() < 0.05), "{found:?}");
    }

    #[test]
    fn a_beam_without_an_echo_in_one_scan_is_left_out() {
        let found = scatter(&series(
            |scan, beam| {
                if (scan, beam) == (3, 5) { f64::NAN } else { uniform(scan, beam) }
            },
        ));
        assert_eq!(found.expect("steady").beams, 39);
    }
}
