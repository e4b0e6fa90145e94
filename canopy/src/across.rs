//! Where the canopy lies across the row, held against the axis that the rig tells.
//!
//! What no beam reaches is taken to be the mirror image, about the axis, of what was seen: an axis that is 0.2 m off moves the leaf area by a quarter, and up
//! to two thirds. Near faces of crowns are seen best, far ones through what stands before them; still, whatever the training and however dense, the middle of
//! the two lies on the axis or a little before it.

/// What stands lower tells nothing of crowns: weeds, grass, stumps; metres above the ground.
pub(crate) const LOWEST_M: f64 = 0.5;
/// Width of a bin, metres.
const BIN_M: f64 = 0.05;
/// How far from the axis bins reach, metres.
const REACH_M: f64 = 5.0;
const BINS: usize = 200;
/// Returns before which nothing is told: as many as some metres of row give.
const LEAST: u64 = 2000;
/// Share of the returns beyond either face: strays, and twigs that stand out.
const BEYOND: f64 = 0.02;
/// Share of the returns that stand out of the depth of the crowns, on either side.
const OUT_OF_DEPTH: f64 = 0.1;
/// Returns before which the depth is not told: a few small trees have so many.
const LEAST_OF_DEPTH: u64 = 300;
/// How far the middle of the faces may lie behind the axis, metres and as a share of half the depth. Seven training systems of leaf area indices from 0.6 to 5,
/// by rays and by spots, from 1.9 and 3 m: 0.02 m and 0.03 at most; 0.18 m and 0.6 where the distance is told 0.2 m too small.
const BEHIND: (f64, f64) = (0.12, 0.25);
/// How far before it. The same rows: 0.57 of half the depth at most; 0.9 where the distance is told 0.2 m too large.
const BEFORE: (f64, f64) = (0.2, 0.7);

/// Leaves nearer to the scanner's way than this stand where it drives, metres: tractors keep clear of crowns, and most scanners measure from 0.5 m on.
pub(crate) const NEAR_SCANNER_M: f64 = 0.35;
/// Share of the canopy there from which on it is driven through. Seven training systems of 0.7 to 2 times their leaf area, by rays and by an LMS111's spots:
/// 0.08 at most where the row is 0.4 m beside the way, and 0.25 to 0.6 of vases 1.5 m and less away, of which a third to a half was told.
const DRIVEN_THROUGH: f64 = 0.25;

/// Low returns farther before the crowns than this stand in the alley, metres: the lowest branches of a crown reach no farther.
const BEFORE_CROWNS_M: f64 = 0.2;
/// Share of the canopy's returns that stand there from which on that is told. Seven training systems on bare ground: 0.001 at most.
const GROWTH_SHARE: f64 = 0.01;
/// Share of the returns in a band above [`LOWEST_M`] from which on growth that was found below reaches into that band.
const TALL_SHARE: f64 = 0.002;
/// Height of such a band, metres.
const BAND_M: f64 = 0.25;
/// Bands in which growth is looked for: up to [`LOWEST_M`], and four above. What is taller stands as high as young crowns.
pub(crate) const GROWTH_BANDS: usize = 5;

/// Canopy returns by how far they lie behind the row axis.
#[derive(Clone, Debug)]
pub(crate) struct Across {
    bins: Vec<u64>,
    returns: u64,
    /// The same in each band in which growth is looked for, the lowest one first.
    growth_bins: [Vec<u64>; GROWTH_BANDS],
    /// Returns below [`LOWEST_M`].
    low_returns: u64,
}

/// Grass and weeds in the alley.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Growth {
    /// Share of the canopy's returns that are low ones in the alley.
    pub(crate) share: f64,
    /// How many bands it reaches, from the lowest one on.
    pub(crate) bands: usize,
}

/// The band in which a height above the ground lies, metres; `None` above all of them.
pub(crate) fn growth_band(above_m: f64) -> Option<usize> {
    let band = ((above_m - LOWEST_M) / BAND_M).floor() + 1.0;
    Some(band.max(0.0) as usize).filter(|band| *band < GROWTH_BANDS)
}

/// The faces of a canopy that does not stand about the axis, metres behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Faces {
    pub(crate) near_m: f64,
    pub(crate) far_m: f64,
}

impl Default for Across {
    fn default() -> Self {
        let growth_bins = std::array::from_fn(|_| vec![0; BINS]);
        Self { bins: vec![0; BINS], returns: 0, growth_bins, low_returns: 0 }
    }
}

impl Across {
    /// Adds a canopy return, so far behind the axis and above the ground.
    pub(crate) fn add(&mut self, behind_m: f64, above_m: f64) {
        let bin = ((behind_m + REACH_M) / BIN_M).clamp(0.0, BINS as f64 - 1.0) as usize;
        let count = |bins: &mut Vec<u64>| bins.get_mut(bin).map(|count| *count += 1);
        growth_band(above_m).and_then(|band| self.growth_bins.get_mut(band)).and_then(count);
        if above_m < LOWEST_M {
            self.low_returns += 1;
        } else {
            count(&mut self.bins);
            self.returns += 1;
        }
    }

    /// Grass and weeds in the alley: low returns before the crowns. `None` where they are few.
    pub(crate) fn growth_in_alley(&self) -> Option<Growth> {
        let near_m = self.within_m(BEYOND) - BEFORE_CROWNS_M;
        let all = (self.returns + self.low_returns).max(1) as f64;
        let mut shares = self.growth_bins.iter().map(|bins| before(bins, near_m) as f64 / all);
        let share = shares.next().filter(|share| self.returns >= LEAST && *share >= GROWTH_SHARE)?;
        Some(Growth { share, bands: 1 + shares.take_while(|share| *share >= TALL_SHARE).count() })
    }

    /// The canopy's faces, where they do not lie about the axis.
    pub(crate) fn elsewhere(&self) -> Option<Faces> {
        let (near_m, far_m) = (self.within_m(BEYOND), self.within_m(1.0 - BEYOND));
        let (middle_m, half_m) = (0.5 * (near_m + far_m), 0.5 * (far_m - near_m));
        let is_off = |(least_m, share): (f64, f64), off_m: f64| off_m > least_m.max(share * half_m);
        let elsewhere = is_off(BEHIND, middle_m) || is_off(BEFORE, -middle_m);
        (self.returns >= LEAST && elsewhere).then_some(Faces { near_m, far_m })
    }

    /// How deep across the row the canopy's returns lie, metres: from the place that a tenth of them lies before to the one that a tenth lies behind.
    /// `None` of few returns. What is hidden does not count: rows of one kind differ by how dense they are, too.
    pub(crate) fn depth_m(&self) -> Option<f64> {
        let [near_m, far_m] = [OUT_OF_DEPTH, 1.0 - OUT_OF_DEPTH].map(|share| self.between_bins_m(share));
        (self.returns >= LEAST_OF_DEPTH).then_some(far_m - near_m).filter(|depth_m| *depth_m > 0.0)
    }

    /// Share of the canopy within [`NEAR_SCANNER_M`] of the scanner's way, which is `distance_m` before the axis; `None` where it is small.
    pub(crate) fn at_scanner(&self, distance_m: f64) -> Option<f64> {
        let near = before(&self.bins, NEAR_SCANNER_M - distance_m);
        let share = near as f64 / self.returns.max(1) as f64;
        (self.returns >= LEAST && share >= DRIVEN_THROUGH).then_some(share)
    }

    /// What this share of the returns lies before, metres behind the axis.
    fn within_m(&self, share: f64) -> f64 {
        (self.reached(share).0 as f64 + 0.5) * BIN_M - REACH_M
    }

    /// The same, returns taken to lie evenly within a bin.
    fn between_bins_m(&self, share: f64) -> f64 {
        let (bin, part) = self.reached(share);
        (bin as f64 + part) * BIN_M - REACH_M
    }

    /// The bin in which this share of the returns is reached, and the part of it that is needed.
    fn reached(&self, share: f64) -> (usize, f64) {
        let mut rest = share * self.returns as f64;
        for (bin, count) in self.bins.iter().enumerate() {
            let count = *count as f64;
            if rest < count {
                return (bin, rest / count);
            }
            rest -= count;
        }
        (BINS, 0.0)
    }
}

/// Returns of these bins that lie before a place, which is so far behind the axis.
fn before(bins: &[u64], behind_m: f64) -> u64 {
    let end = ((behind_m + REACH_M) / BIN_M).clamp(0.0, BINS as f64) as usize;
    bins.iter().take(end).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns spread evenly from one face to the other.
    fn between(near_m: f64, far_m: f64, above_m: f64) -> Option<Faces> {
        let mut across = Across::default();
        for n in 0..2 * LEAST {
            across.add(near_m + (far_m - near_m) * n as f64 / (2 * LEAST) as f64, above_m);
        }
        across.elsewhere()
    }

    #[test]
    fn a_canopy_about_the_axis_is_where_it_should_be_and_one_beside_it_is_told_with_its_faces() {
        for (near_m, far_m) in [(-0.8, 0.5), (-1.7, 0.5), (-0.4, 0.3), (-0.15, 0.1), (-0.9, 0.3), (0.0, 0.0)]
        {
            assert_eq!(between(near_m, far_m, 1.0), None, "{near_m} {far_m}");
            // Half a metre to either side.
            for off_m in [-0.5, 0.5] {
                let told = between(near_m + off_m, far_m + off_m, 1.0);
                let is_told = told.is_some_and(|faces| {
                    (faces.near_m - near_m - off_m).abs() < 0.15 && (faces.far_m - far_m - off_m).abs() < 0.15
                });
                // A wide crown whose far face is hidden may stand nearer.
                assert!(is_told || (near_m, off_m) == (-1.7, 0.5), "{near_m} {far_m} {off_m}: {told:?}");
            }
        }
        assert_eq!(between(-1.8, -1.2, 0.2), None, "grass in the alley");
        assert!(between(-9.0, -8.0, 1.0).is_some() && between(7.0, 8.0, 1.0).is_some(), "beyond all bins");
    }

    #[test]
    fn the_depth_of_crowns_is_of_what_stands_high_wherever_the_axis_is_told() {
        for (near_m, far_m) in [(-0.8, 0.5), (-0.33, 0.12), (-0.1, 0.02), (0.4, 1.1)] {
            let mut across = Across::default();
            let returns = 10 * LEAST_OF_DEPTH;
            for n in 0..returns {
                assert_eq!(across.depth_m().is_some(), n >= LEAST_OF_DEPTH, "{n}");
                across.add(near_m + (far_m - near_m) * (n as f64 + 0.5) / returns as f64, 1.0);
                across.add(-3.0, 0.2);
            }
            let depth_m = across.depth_m().expect("enough");
            assert!((depth_m - 0.8 * (far_m - near_m)).abs() < 0.02, "{near_m} {far_m}: {depth_m}");
        }
    }

    #[test]
    fn a_scanner_in_the_crowns_is_told_and_one_beside_them_is_not() {
        let share = |near_m: f64, distance_m: f64| {
            let mut across = Across::default();
            for n in 0..2 * LEAST {
                across.add(near_m + 1.5 * n as f64 / (2 * LEAST) as f64, 1.0);
            }
            across.at_scanner(distance_m)
        };
        // A crown from 1 m before the axis to 0.5 m behind it.
        for distance_m in [1.3, 1.9, 4.9, 30.0] {
            assert_eq!(share(-1.0, distance_m), None, "{distance_m}");
        }
        let driven = share(-1.0, 0.7);
        assert!(driven.is_some_and(|share| (share - 0.65 / 1.5).abs() < 0.04), "{driven:?}");
    }

    #[test]
    fn what_grows_in_the_alley_is_told_and_low_leaves_of_the_row_are_not() {
        let share = |low_at_m: f64, low: u64| {
            let mut across = Across::default();
            for n in 0..2 * LEAST {
                across.add(-0.5 + n as f64 / (2 * LEAST) as f64, 1.0);
            }
            (0..low).for_each(|_| across.add(low_at_m, 0.3));
            across.growth_in_alley().map(|growth| growth.share)
        };
        let grass = share(-1.2, LEAST);
        assert!(grass.is_some_and(|share| (share - 1.0 / 3.0).abs() < 1e-9), "{grass:?}");
        // Beneath the crowns, and of a few blades, nothing is told.
        assert_eq!(
            [share(-0.4, LEAST), share(0.2, LEAST), share(-1.2, LEAST / 100), share(-1.2, 0)],
            [None; 4]
        );
    }

    #[test]
    fn growth_reaches_as_high_as_it_stands_in_the_alley() {
        let bands = |top_m: f64, at_m: f64| {
            let mut across = Across::default();
            for n in 0..10 * LEAST {
                across.add(-0.5 + n as f64 / (10 * LEAST) as f64, 2.0);
            }
            // 3 % of the returns, evenly from the ground up.
            for n in 0..LEAST / 3 {
                across.add(at_m, top_m * (n as f64 + 0.5) / (LEAST / 3) as f64);
            }
            across.growth_in_alley().map(|growth| growth.bands)
        };
        assert_eq!([bands(0.3, -1.2), bands(0.6, -1.2), bands(1.0, -1.2)], [Some(1), Some(2), Some(3)]);
        assert_eq!(bands(1.0, 0.0), None, "beneath the crowns");
        assert_eq!(
            [growth_band(0.1), growth_band(0.5), growth_band(1.49), growth_band(1.5)],
            [Some(0), Some(1), Some(4), None]
        );
    }

    #[test]
    fn a_few_returns_tell_nothing() {
        let mut across = Across::default();
        for _ in 0..LEAST - 1 {
            across.add(-1.0, 1.0);
        }
        assert_eq!(across.elsewhere(), None);
        across.add(-1.0, 1.0);
        assert!(across.elsewhere().is_some());
    }
}
