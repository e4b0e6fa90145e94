//! What the beams of the open slice did, by band of height.
//!
//! A passage is one beam's way through one band: from the column in which it enters the band to that in which it leaves it, or ends. Which columns are the slice's
//! canopy space is known when it ends only; so first and last columns are counted, and of those the passages that touch any range of columns follow.

use super::ladder::Ladder;
use crate::estimator::Sighting;

/// Sums of the open slice.
#[derive(Clone, Debug)]
pub(super) struct OpenSlice {
    columns: usize,
    /// By band and column: Σ line weight over passages that begin in the column, end there or go on from there, and over beams that end there.
    first: Vec<f64>,
    last: Vec<f64>,
    ended: Vec<f64>,
    /// By band: Σ line weight over beams aimed at it in the row plane, and over those that the canopy let pass.
    pub(super) aimed: Vec<f64>,
    pub(super) through: Vec<f64>,
    /// By band: impacted area, m².
    pub(super) impacted_m2: Vec<f64>,
    /// Σ line weight over returns, by layer + band: where in a layer they lie.
    in_layer: Vec<f64>,
}

impl OpenSlice {
    pub(super) fn new(ladder: &Ladder) -> Self {
        let (columns, cells) = (ladder.region.nx, ladder.region.nx * ladder.count);
        let (of_bands, of_cells) = (vec![0.0; ladder.count], vec![0.0; cells]);
        Self {
            columns,
            first: of_cells.clone(),
            last: of_cells.clone(),
            ended: of_cells,
            aimed: of_bands.clone(),
            through: of_bands.clone(),
            impacted_m2: of_bands,
            in_layer: vec![0.0; ladder.region.nz + ladder.count],
        }
    }

    /// Adds a beam of a line of this weight.
    pub(super) fn add(&mut self, ladder: &Ladder, sighting: &Sighting, weight_m: f64) {
        let Sighting { beam, canopy } = sighting;
        let rise = beam.sin / beam.cos;
        if let Some(band) = ladder.band(ladder.height_m + ladder.distance_m * rise) {
            add(&mut self.aimed, band, weight_m);
            add(&mut self.through, band, if canopy.is_none() { weight_m } else { 0.0 });
        }
        if let Some(contact) = canopy
            && let Some(band) = ladder.band(contact.z_m.max(0.0))
        {
            add(&mut self.impacted_m2, band, weight_m * contact.range_m * beam.area_factor);
            add(&mut self.in_layer, ladder.layer(contact.z_m) + band, weight_m);
        }
        self.pass(ladder, rise, canopy.map(|contact| contact.x_m), weight_m);
    }

    /// Follows a beam from band to band, to where it ends or leaves the voxels.
    fn pass(&mut self, ladder: &Ladder, rise: f64, end_m: Option<f64>, weight_m: f64) {
        let Ladder { band_m, height_m, region, .. } = *ladder;
        let leaves_m = region.x_m + region.nx as f64 * region.dx_m;
        let (end_m, ends) = match end_m {
            Some(end_m) if end_m < leaves_m => (end_m, true),
            _ => (leaves_m, false),
        };
        let mut from_m = region.x_m.max(0.0);
        let mut z_m = height_m + from_m * rise;
        let top_m = ladder.count as f64 * band_m;
        if z_m >= top_m && rise < 0.0 {
            // A hair below the top, that it is in the highest band.
            z_m = top_m * (1.0 - 1e-12);
            from_m = (z_m - height_m) / rise;
        }
        let Some(mut band) = ladder.band(z_m) else { return };
        while from_m <= end_m {
            let edge = if rise > 0.0 { band + 1 } else { band };
            let edge_m = (edge as f64 * band_m - height_m) / rise;
            let to_m = if rise == 0.0 { end_m } else { edge_m.min(end_m) };
            let (entered, left) = (ladder.column(from_m), ladder.column(to_m));
            add(&mut self.first, band * self.columns + entered, weight_m);
            add(&mut self.last, band * self.columns + left, weight_m);
            if to_m >= end_m {
                add(&mut self.ended, band * self.columns + left, if ends { weight_m } else { 0.0 });
                return;
            }
            let next = if rise > 0.0 { Some(band + 1) } else { band.checked_sub(1) };
            let Some(next) = next.filter(|next| *next < ladder.count) else { return };
            (band, from_m) = (next, to_m);
        }
    }

    /// How many columns from the row plane beams ended in a band.
    pub(super) fn columns_out(&self, ladder: &Ladder, band: usize) -> usize {
        let ended = self.ended.chunks(self.columns).nth(band).unwrap_or_default().iter().enumerate();
        let out = ended.filter(|(_, ended)| **ended > 0.0).map(|(column, _)| ladder.columns_out(column));
        out.max().unwrap_or(0)
    }

    /// Σ line weight over the passages of a band that touch these columns, and over beams that end in them.
    pub(super) fn passages(&self, band: usize, columns: std::ops::Range<usize>) -> (f64, f64) {
        let of = |sums: &[f64], part: std::ops::Range<usize>| -> f64 {
            let at = band * self.columns;
            sums.get(at + part.start..at + part.end).map_or(0.0, |sums| sums.iter().sum())
        };
        // What begins before their end, but for what is over before their beginning.
        let passed = of(&self.first, 0..columns.end) - of(&self.last, 0..columns.start);
        (passed.max(0.0), of(&self.ended, columns))
    }

    /// Of a layer's returns, the share that lies in a band; `None` without returns.
    pub(super) fn share_of_layer(&self, ladder: &Ladder, layer: usize, band: usize) -> Option<f64> {
        let at = |band: usize| self.in_layer.get(layer + band).copied().unwrap_or(0.0);
        let sum: f64 = ladder.bands_of(ladder.layer_m(layer)).map(|(band, _)| at(band)).sum();
        (sum > 0.0).then(|| at(band) / sum)
    }

    /// Empties the slice.
    pub(super) fn clear(&mut self) {
        let Self { first, last, ended, aimed, through, impacted_m2, in_layer, .. } = self;
        for sums in [first, last, ended, aimed, through, impacted_m2, in_layer] {
            sums.fill(0.0);
        }
    }
}

fn add(sums: &mut [f64], at: usize, value: f64) {
    if let Some(sum) = sums.get_mut(at) {
        *sum += value;
    }
}

#[cfg(test)]
mod tests {
    use super::super::ladder::tests::ladder;
    use super::*;
    use crate::estimator::Contact;
    use crate::geometry::Beam;

    fn sighting(ladder: &Ladder, deg: f64, range_m: Option<f64>) -> Sighting {
        let (sin, cos) = deg.to_radians().sin_cos();
        let beam =
            Beam { cos, sin, theta_rad: deg.to_radians(), area_factor: 0.01, ahead: 0.0, shift_m: 0.0 };
        let canopy = range_m.map(|range_m| Contact {
            range_m,
            x_m: range_m * cos,
            z_m: ladder.height_m + range_m * sin,
            fresh: true,
        });
        Sighting { beam, canopy }
    }

    #[test]
    fn a_passage_counts_where_it_touches_the_space_and_ends_where_the_beam_does() {
        let ladder = ladder(0.25);
        let all = 0..ladder.region.nx;
        let level = ladder.band(ladder.height_m).unwrap();
        // Level, through; level, to 1 m.
        let mut open = OpenSlice::new(&ladder);
        open.add(&ladder, &sighting(&ladder, 0.0, None), 0.5);
        open.add(&ladder, &sighting(&ladder, 0.0, Some(1.0)), 0.25);
        assert_eq!(open.passages(level, all.clone()), (0.75, 0.25));
        let behind = ladder.column(1.0) + 1..ladder.region.nx;
        assert_eq!(open.passages(level, behind), (0.5, 0.0), "the one that ended before does not come there");
        assert_eq!(open.passages(level + 1, all.clone()), (0.0, 0.0));
        // Steep: one passage a band on its way, none where it never is.
        open.clear();
        open.add(&ladder, &sighting(&ladder, 45.0, None), 1.0);
        for band in 0..ladder.count {
            let expected = if band >= level { 1.0 } else { 0.0 };
            assert_eq!(open.passages(band, all.clone()).0, expected, "band {band}");
        }
        // Of a narrow space round the row plane, only the bands at which it crosses it.
        let z_m = ladder.height_m + ladder.distance_m;
        let crossed: Vec<usize> =
            (0..ladder.count).filter(|band| open.passages(*band, ladder.columns_within(1)).0 > 0.0).collect();
        assert!(crossed.contains(&ladder.band(z_m).unwrap()) && crossed.len() <= 4, "{crossed:?}");
    }

    #[test]
    fn of_many_beams_every_band_has_what_a_walk_in_small_steps_finds() {
        let ladder = ladder(0.3);
        let mut open = OpenSlice::new(&ladder);
        let mut expected = vec![0.0; ladder.count];
        let columns = ladder.columns_within(3);
        let faces_m = [columns.start, columns.end].map(|k| ladder.region.x_m + k as f64 * ladder.region.dx_m);
        for number in 0..170 {
            let (deg, range_m) = (-85.0 + f64::from(number) + 0.37, 0.5 + f64::from(number % 7) * 0.4);
            let seen = sighting(&ladder, deg, (number % 3 == 0).then_some(range_m));
            open.add(&ladder, &seen, 1.0);
            let end_m = seen.canopy.map_or(4.0, |contact| contact.x_m);
            let mut met = vec![false; ladder.count];
            for step in 0..8000 {
                let x_m = f64::from(step) * 0.0005;
                let z_m = ladder.height_m + x_m * seen.beam.sin / seen.beam.cos;
                if x_m > end_m || z_m < 0.0 {
                    break;
                }
                if (faces_m[0]..faces_m[1]).contains(&x_m)
                    && let Some(band) = ladder.band(z_m)
                {
                    met[band] = true;
                }
            }
            met.iter().zip(&mut expected).for_each(|(met, sum)| *sum += f64::from(u8::from(*met)));
        }
        for (band, expected) in expected.iter().enumerate() {
            let (found, _) = open.passages(band, columns.clone());
            assert!((found - expected).abs() <= 2.0, "band {band}: {found}, expected {expected}");
        }
    }
}
