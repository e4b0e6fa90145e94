//! Edges between two surfaces less than a pulse apart: how many beams hang between them, and what width of a spot that means.
//!
//! A beam that lies by the share f on the near surface reports the power-weighted mean of both ranges, power going by 1/r². Over the angle f falls as a
//! straight edge cuts a uniform disc. Place of the edge and diameter of the disc are fitted.

use std::f64::consts::PI;

use rowscan_protocol::optics::Spot;
use serde::Serialize;

use super::Series;

/// Gaps that blend, mm.
const GAPS_MM: [f64; 2] = [250.0, 850.0];
/// Beams of a surface that its line is laid through; those next to the edge may be on the ramp.
const SKIPPED: usize = 2;
const FITTED: usize = 6;
/// Most beams that a ramp may take.
const WIDEST: usize = 10;

/// An edge between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Edge {
    /// Where, degrees.
    pub angle_deg: f64,
    /// Range of the near surface, mm.
    pub near_mm: f64,
    /// Range of the far one, mm.
    pub far_mm: f64,
    /// Beams with a share between 10 and 90 %.
    pub beams: usize,
    /// Diameter of the uniform disc that fits, over the nominal spot's.
    pub diameter_ratio: f64,
    /// Root mean square of what the shares are off it.
    pub rms_share: f64,
    /// First and last beam of the ramp, both still on a surface.
    #[serde(skip)]
    pub(super) ends: (usize, usize),
    /// The near surface lies at smaller angles.
    #[serde(skip)]
    pub(super) near_first: bool,
}

/// The edges of a series, in the order of the beams.
pub(super) fn edges(series: &Series, spot: &Spot) -> Vec<Edge> {
    let means_mm = series.means_mm();
    let mut edges: Vec<Edge> = Vec::new();
    let mut beam = SKIPPED + FITTED;
    while beam + WIDEST + SKIPPED + FITTED < means_mm.len() {
        match ramp(&means_mm, beam).and_then(|end| fit(series, &means_mm, (beam, end), spot)) {
            Some(edge) => {
                beam = edge.ends.1 + 1;
                edges.push(edge);
            }
            None => beam += 1,
        }
    }
    edges
}

/// Whether two neighbours belong to one smooth surface.
fn joined(a_mm: f64, b_mm: f64) -> bool {
    (a_mm - b_mm).abs() < 12.0 + 0.012 * a_mm.min(b_mm)
}

/// The beam after a ramp that begins behind `from`: ranges rise or fall all the way by a gap that blends.
fn ramp(means_mm: &[f64], from: usize) -> Option<usize> {
    let at = |beam: usize| means_mm.get(beam).copied().filter(|mm| mm.is_finite());
    if joined(at(from)?, at(from + 1)?) || !joined(at(from - 1)?, at(from)?) {
        return None;
    }
    let rising = at(from + 1)? > at(from)?;
    let mut end = from + 1;
    while end < from + WIDEST && !joined(at(end)?, at(end + 1)?) {
        if (at(end + 1)? > at(end)?) != rising {
            return None;
        }
        end += 1;
    }
    let gap_mm = (at(end)? - at(from)?).abs();
    (gap_mm > GAPS_MM[0] && gap_mm < GAPS_MM[1] && end < from + WIDEST).then_some(end)
}

/// The straight line of ranges over beams through `beams`, if they lie on one.
fn line(means_mm: &[f64], beams: std::ops::Range<usize>) -> Option<(f64, f64)> {
    let points: Vec<(f64, f64)> =
        beams.map(|beam| Some((beam as f64, *means_mm.get(beam)?))).collect::<Option<_>>()?;
    let n = points.len() as f64;
    let (x, y) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let sxy: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let sxx: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    let (slope, middle) = (sxy / sxx, y - sxy / sxx * x);
    let off = points.iter().map(|p| (p.1 - middle - slope * p.0).abs()).fold(0.0, f64::max);
    (off < 15.0).then_some((middle, slope))
}

/// Fits place and diameter to the ramp between two beams.
fn fit(series: &Series, means_mm: &[f64], (from, end): (usize, usize), spot: &Spot) -> Option<Edge> {
    let before = line(means_mm, (from + 1).checked_sub(SKIPPED + FITTED)?..(from + 1) - SKIPPED)?;
    let after = line(means_mm, end + SKIPPED..end + SKIPPED + FITTED)?;
    let on = |(middle, slope): (f64, f64), beam: usize| middle + slope * beam as f64;
    let centre = usize::midpoint(from, end);
    let (a_mm, b_mm) = (on(before, centre), on(after, centre));
    let near_first = a_mm < b_mm;
    let (near, far) = if near_first { (before, after) } else { (after, before) };
    let (near_mm, far_mm) = (a_mm.min(b_mm), a_mm.max(b_mm));
    let gap_mm = far_mm - near_mm;
    if !(gap_mm > GAPS_MM[0] && gap_mm < GAPS_MM[1]) {
        return None;
    }
    let beams = from.saturating_sub(1)..(end + 2).min(means_mm.len());
    let mut shares = Vec::new();
    for beam in beams {
        let (near_mm, far_mm) = (on(near, beam), on(far, beam));
        // Shares of power, then of the spot.
        let power = ((far_mm - means_mm.get(beam)?) / (far_mm - near_mm)).clamp(0.0, 1.0);
        let (n2, f2) = (near_mm * near_mm, far_mm * far_mm);
        let share = power * n2 / (power * n2 + (1.0 - power) * f2);
        shares.push((*series.angles_deg.get(beam)?, share));
    }
    let hanging = shares.iter().filter(|(_, share)| (0.1..=0.9).contains(share)).count();
    if hanging == 0 {
        return None;
    }
    let (first, last) = (shares.first()?.0, shares.last()?.0);
    let sense = if near_first { 1.0 } else { -1.0 };
    let mut best: Option<Edge> = None;
    for step in 0..=60 {
        let ratio = 0.4 + 0.02 * f64::from(step);
        let disc = Disc::of(spot, near_mm, ratio);
        for place in 0..=400 {
            let angle_deg = first + (last - first) * f64::from(place) / 400.0;
            let off = |(at_deg, share): &(f64, f64)| {
                (share - disc.share(sense * (angle_deg - at_deg).to_radians() * near_mm)).powi(2)
            };
            let rms_share = (shares.iter().map(off).sum::<f64>() / shares.len() as f64).sqrt();
            if best.is_none_or(|best| rms_share < best.rms_share) {
                let (beams, diameter_ratio, ends) = (hanging, ratio, (from, end));
                best = Some(Edge {
                    angle_deg,
                    near_mm,
                    far_mm,
                    beams,
                    diameter_ratio,
                    rms_share,
                    ends,
                    near_first,
                });
            }
        }
    }
    best
}

/// A uniform disc, swept over a box in the scan plane.
struct Disc {
    radius_mm: f64,
    swept_mm: f64,
}

impl Disc {
    fn of(spot: &Spot, range_mm: f64, ratio: f64) -> Self {
        let range_m = 1e-3 * range_mm;
        Self {
            radius_mm: 500.0 * ratio * spot.nominal_m(range_m),
            swept_mm: spot.sweep_mrad.value * range_m * ratio,
        }
    }

    /// Share on the near surface where the edge lies so far beyond the beam's middle.
    fn share(&self, beyond_mm: f64) -> f64 {
        let parts = if self.swept_mm > 0.0 { 9 } else { 1 };
        let of = |part: i32| {
            let shift_mm = self.swept_mm * ((f64::from(part) + 0.5) / f64::from(parts) - 0.5);
            let m = ((beyond_mm + shift_mm) / self.radius_mm).clamp(-1.0, 1.0);
            0.5 + (m * (1.0 - m * m).sqrt() + m.asin()) / PI
        };
        (0..parts).map(of).sum::<f64>() / f64::from(parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::optics::Fact;

    #[test]
    fn the_disc_that_made_a_ramp_is_found() {
        let spot = Spot {
            exit_mm: Fact::assumed(8.0),
            divergence_mrad: Fact::assumed(15.0),
            sweep_mrad: Fact::assumed(0.0),
            effective: Fact::assumed(1.0),
        };
        let (near_mm, far_mm): (f64, f64) = (1000.0, 1600.0);
        for (ratio, near_first) in [(0.9, true), (0.7, true), (0.9, false)] {
            let disc = Disc::of(&spot, near_mm, ratio);
            let angles_deg: Vec<f64> = (0..60).map(|beam| f64::from(beam) * 0.25).collect();
            let range = |at_deg: &f64| {
                let beyond_mm: f64 = (7.33 - at_deg).to_radians() * near_mm;
                let f = disc.share(if near_first { beyond_mm } else { -beyond_mm });
                let (n, o) = (f / (near_mm * near_mm), (1.0 - f) / (far_mm * far_mm));
                (n * near_mm + o * far_mm) / (n + o)
            };
            let scan: Vec<f64> = angles_deg.iter().map(range).collect();
            let found = edges(&Series { angles_deg, scans_mm: vec![scan] }, &spot);
            let [edge] = found[..] else { panic!("one edge: {found:?}") };
            assert!((edge.diameter_ratio - ratio).abs() < 0.03, "{edge:?}");
            assert!((edge.angle_deg - 7.33).abs() < 0.05 && edge.rms_share < 0.01, "{edge:?}");
            assert!((edge.near_mm - near_mm).abs() < 1.0 && edge.near_first == near_first, "{edge:?}");
        }
    }
}
