//! The raw leaf areas of the last whole slices.

use crate::recent::{BAND_M, BANDS};

/// The leaf areas of a window stand for so much row at least, metres: the fewest whole slices that reach it.
const WINDOW_M: f64 = 0.5;
/// Slices kept: a slice is 0.05 m long at least.
pub(super) const MOST: usize = 10;

/// One slice's raw leaf area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SliceLeaf {
    /// Its faces along the row, metres.
    pub(crate) y_m: [f64; 2],
    /// Metres of it that were scanned.
    pub(crate) length_m: f64,
    /// By contact frequency and height, the lowest band first, m².
    pub(crate) contact_m2: [f64; BANDS],
    /// By the shares of spots.
    pub(crate) share_m2: [f64; BANDS],
}

/// The last slices that have ended, the latest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct Slices {
    kept: [SliceLeaf; MOST],
    count: usize,
}

impl Slices {
    pub(crate) fn push(&mut self, slice: SliceLeaf) {
        self.kept.rotate_right(1);
        let [latest, ..] = &mut self.kept;
        *latest = slice;
        self.count = (self.count + 1).min(MOST);
    }

    /// None has ended.
    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The slices of a window, the latest first: the fewest that reach [`WINDOW_M`], without a gap between them; before the first has ended, the open one.
    pub(crate) fn window(&self, open: Option<SliceLeaf>) -> impl Iterator<Item = SliceLeaf> + '_ {
        let ended = self.kept.iter().take(self.count).copied();
        let mut reached_m = 0.0;
        let mut before: Option<SliceLeaf> = None;
        open.into_iter().chain(ended).take_while(move |slice| {
            let [from_m, to_m] = slice.y_m;
            let joins = before.is_none_or(|before| (before.y_m[0] - to_m).abs() < 1e-6);
            let wanted = joins && reached_m < WINDOW_M - 1e-9;
            reached_m += to_m - from_m;
            before = Some(*slice);
            wanted
        })
    }
}

/// Shares a layer of leaf area out to the bands that it lies in, by height.
pub(crate) fn by_band(bands: &mut [f64; BANDS], [from_m, to_m]: [f64; 2], leaf_m2: f64) {
    let height_m = to_m - from_m;
    if height_m.is_nan() || height_m <= 0.0 {
        return;
    }
    for (number, band) in bands.iter_mut().enumerate() {
        // The lowest band holds what is below it too, the highest what is above.
        let low_m = if number == 0 { f64::NEG_INFINITY } else { number as f64 * BAND_M };
        let high_m = if number + 1 == BANDS { f64::INFINITY } else { (number + 1) as f64 * BAND_M };
        let inside_m = to_m.min(high_m) - from_m.max(low_m);
        if inside_m > 0.0 {
            *band += leaf_m2 * inside_m / height_m;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slice(from_m: f64, to_m: f64) -> SliceLeaf {
        SliceLeaf { y_m: [from_m, to_m], length_m: to_m - from_m, ..SliceLeaf::default() }
    }

    #[test]
    fn a_layer_is_shared_out_by_height_and_nothing_is_lost() {
        let mut bands = [0.0; BANDS];
        by_band(&mut bands, [0.4, 1.6], 1.2);
        let expected = [0.1, 0.5, 0.5, 0.1, 0.0, 0.0, 0.0, 0.0];
        assert!(bands.iter().zip(expected).all(|(found, is)| (found - is).abs() < 1e-12), "{bands:?}");
        // Below the ground, and above the highest band.
        by_band(&mut bands, [-0.2, -0.1], 3.0);
        by_band(&mut bands, [4.0, 4.5], 2.0);
        assert!((bands[0] - 3.1).abs() < 1e-12 && (bands[7] - 2.0).abs() < 1e-12, "{bands:?}");
    }

    #[test]
    fn a_window_is_the_fewest_whole_slices_that_reach_half_a_metre() {
        let mut slices = Slices::default();
        let faces = |slices: &Slices, open| -> Vec<[f64; 2]> { slices.window(open).map(|s| s.y_m).collect() };
        assert_eq!(faces(&slices, None), Vec::<[f64; 2]>::new());
        let open = Some(slice(0.0, 0.3));
        assert_eq!(faces(&slices, open), [[0.0, 0.3]], "before the first has ended");
        slices.push(slice(0.0, 0.3));
        assert_eq!(faces(&slices, None), [[0.0, 0.3]]);
        slices.push(slice(0.3, 0.6));
        slices.push(slice(0.6, 0.9));
        assert_eq!(faces(&slices, None), [[0.6, 0.9], [0.3, 0.6]]);
        // A piece of row was not scanned.
        slices.push(slice(1.5, 1.8));
        assert_eq!(faces(&slices, None), [[1.5, 1.8]]);
        slices.push(slice(2.0, 3.0));
        assert_eq!(faces(&slices, None), [[2.0, 3.0]], "one that is longer than a window");
    }

    #[test]
    fn the_shortest_slices_fill_a_window() {
        let mut slices = Slices::default();
        for number in 0..40 {
            let from_m = f64::from(number) * 0.05;
            slices.push(slice(from_m, from_m + 0.05));
        }
        let length_m: f64 = slices.window(None).map(|slice| slice.length_m).sum();
        assert!((length_m - 0.5).abs() < 1e-9, "{length_m}");
    }
}
