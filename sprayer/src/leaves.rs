//! The leaves of a row within a band of height: where along the row there are any, and how much area lies before a place.

use rowscan_scenes::polygon::{Keep, clip, vector_area};
use rowscan_scenes::{Leaf, Orchard};

use crate::span::{Span, Spans};

/// X, Y and Z of a corner.
const Y: usize = 1;
const Z: usize = 2;

/// The part of a leaf within the band.
#[derive(Clone, Debug)]
struct Blade {
    along: Span,
    area_m2: f64,
    outline: Vec<[f64; 3]>,
    normal: [f64; 3],
}

/// Leaf area, one-sided, m².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Area {
    /// All of it.
    pub all_m2: f64,
    /// What of it the row's own trees have; the rest is of repetitions of the row.
    pub own_m2: f64,
}

impl std::ops::AddAssign for Area {
    fn add_assign(&mut self, other: Self) {
        self.all_m2 += other.all_m2;
        self.own_m2 += other.own_m2;
    }
}

/// The leaves of one row in one band of height. The row repeats with its period.
#[derive(Clone, Debug)]
pub struct BandLeaves {
    /// Infinite where the row does not repeat.
    length_m: f64,
    /// By where they begin.
    blades: Vec<Blade>,
    /// Area of all blades before each, and of all.
    sums_m2: Vec<f64>,
    /// The longest blade along the row.
    longest_m: f64,
}

impl BandLeaves {
    /// Those of row `row` between two heights; none where there is no such row.
    pub fn of(orchard: &Orchard, row: i32, height: Span) -> Self {
        let (mut blades, mut scratch, mut part) = (Vec::new(), Vec::new(), Vec::new());
        for tree in usize::try_from(row).into_iter().flat_map(|row| orchard.trees_from_foot(row)) {
            for leaf in &tree.leaves {
                cut(leaf, height, &mut scratch, &mut part);
                blades.extend(blade(leaf, &part));
            }
        }
        blades.sort_by(|a: &Blade, b| a.along.from.total_cmp(&b.along.from));
        let mut sum_m2 = 0.0;
        let mut sums_m2 = vec![sum_m2];
        for blade in &blades {
            sum_m2 += blade.area_m2;
            sums_m2.push(sum_m2);
        }
        let longest_m = blades.iter().map(|blade| blade.along.length()).fold(0.0, f64::max);
        Self { length_m: orchard.period_m(), blades, sums_m2, longest_m }
    }

    /// True where the band is empty.
    pub fn is_empty(&self) -> bool {
        self.blades.is_empty()
    }

    /// Where a strip of `strip_m` along the row holds leaves, gaps shorter than `join_m` joined, between two places: places of the strip's middle, metres.
    pub fn wanted(&self, (strip_m, join_m): (f64, f64), between: Span) -> Spans {
        let widened = |shift_m: f64| {
            self.blades.iter().map(move |blade| {
                Span::new(
                    blade.along.from - strip_m / 2.0 + shift_m,
                    blade.along.to + strip_m / 2.0 + shift_m,
                )
            })
        };
        if !self.length_m.is_finite() {
            return Spans::of(widened(0.0)).joined(join_m).within(between);
        }
        // One period, with what reaches into it from before and after.
        let around =
            Spans::of([-1.0, 0.0, 1.0].into_iter().flat_map(|period| widened(period * self.length_m)));
        let one = around.joined(join_m).within(Span::new(0.0, self.length_m));
        let first = (between.from / self.length_m).floor() as i64;
        let last = (between.to / self.length_m).floor() as i64;
        let repeated = (first..=last).flat_map(|period| {
            let shift_m = period as f64 * self.length_m;
            one.iter().map(move |span| Span::new(span.from + shift_m, span.to + shift_m))
        });
        // Rounding must not open a seam.
        Spans::of(repeated).joined(1e-9).within(between)
    }

    /// Leaf area between two places along the row.
    pub fn area(&self, between: Span) -> Area {
        let own = |y_m: f64| self.once_before_m2(y_m);
        Area {
            all_m2: self.before_m2(between.to) - self.before_m2(between.from),
            own_m2: own(between.to) - own(between.from),
        }
    }

    /// Leaf area before `y_m`, up to a constant.
    fn before_m2(&self, y_m: f64) -> f64 {
        if !self.length_m.is_finite() {
            return self.once_before_m2(y_m);
        }
        let periods = (y_m / self.length_m).floor();
        let (into_m, total_m2) = (y_m - periods * self.length_m, self.sums_m2.last().copied().unwrap_or(0.0));
        // Leaves reach into their neighbours' periods.
        let copies = [-1.0, 0.0, 1.0].map(|period| self.once_before_m2(into_m - period * self.length_m));
        periods * total_m2 + copies.iter().sum::<f64>()
    }

    /// The same of the row's own leaves, without their repetitions.
    fn once_before_m2(&self, y_m: f64) -> f64 {
        let begun = self.blades.partition_point(|blade| blade.along.from < y_m);
        let ended = self.blades.partition_point(|blade| blade.along.from < y_m - self.longest_m);
        let mut scratch = Vec::new();
        let parts = self.blades.get(ended..begun).unwrap_or_default().iter().map(|blade| {
            if blade.along.to <= y_m {
                return blade.area_m2;
            }
            clip(&blade.outline, Y, y_m, Keep::Below, &mut scratch);
            vector_area(&scratch).dot(blade.normal.into())
        });
        self.sums_m2.get(ended).copied().unwrap_or(0.0) + parts.sum::<f64>()
    }
}

/// The part of a leaf within a band of height, in `part`.
fn cut(leaf: &Leaf, height: Span, scratch: &mut Vec<[f64; 3]>, part: &mut Vec<[f64; 3]>) {
    let heights = leaf.outline().iter().map(|corner| corner[Z]);
    let (low, high) =
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    part.clear();
    if low >= height.from && high <= height.to {
        part.extend_from_slice(leaf.outline());
    } else if low < height.to && high > height.from {
        clip(leaf.outline(), Z, height.from, Keep::Above, scratch);
        clip(scratch, Z, height.to, Keep::Below, part);
    }
}

fn blade(leaf: &Leaf, part: &[[f64; 3]]) -> Option<Blade> {
    let ys = part.iter().map(|corner| corner[Y]);
    let along = ys.fold(Span::new(f64::INFINITY, f64::NEG_INFINITY), |span, y| {
        Span::new(span.from.min(y), span.to.max(y))
    });
    let area_m2 = vector_area(part).dot(leaf.normal().into());
    (area_m2 > 0.0).then(|| Blade { along, area_m2, outline: part.to_vec(), normal: leaf.normal() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(y: [f64; 2], z: [f64; 2]) -> Leaf {
        Leaf::new([[0.0, y[0], z[0]], [0.0, y[1], z[0]], [0.0, y[1], z[1]], [0.0, y[0], z[1]]])
            .expect("a leaf")
    }

    fn spans(found: &Spans) -> Vec<(f64, f64)> {
        found.iter().map(|span| ((span.from * 1e6).round() / 1e6, (span.to * 1e6).round() / 1e6)).collect()
    }

    #[test]
    fn leaves_are_cut_at_the_band_and_repeat_with_the_row() {
        // One reaches over the row's end; a triangle has half its area before its middle.
        let triangle = Leaf::new([[0.0, 1.0, 1.0], [0.0, 1.4, 1.0], [0.0, 1.2, 2.0]]).expect("a leaf");
        let orchard = Orchard::from_organs(vec![panel([1.8, 2.2], [0.5, 1.5]), triangle], Vec::new(), 2.0);
        let band = BandLeaves::of(&orchard, 0, Span::new(1.0, 2.0));
        let exactly = band.wanted((0.0, 0.0), Span::new(0.0, 4.0));
        assert_eq!(spans(&exactly), [(0.0, 0.2), (1.0, 1.4), (1.8, 2.2), (3.0, 3.4), (3.8, 4.0)]);
        assert!((band.area(Span::new(0.0, 2.0)).all_m2 - (0.2 + 0.2)).abs() < 1e-12);
        assert!((band.area(Span::new(1.0, 1.2)).all_m2 - 0.1).abs() < 1e-12);
        assert!(
            (band.area(Span::new(-3.9, 4.2)).all_m2 - (4.0 * 0.4 + 0.05)).abs() < 1e-12,
            "{}",
            band.area(Span::new(-3.9, 4.2)).all_m2
        );
        // The row's own trees are there once, with the leaf that reaches over its end; repetitions before and behind are not theirs.
        let own_m2 = |from, to| band.area(Span::new(from, to)).own_m2;
        assert!((own_m2(-3.9, 4.2) - 0.4).abs() < 1e-12 && (own_m2(0.0, 2.0) - 0.3).abs() < 1e-12);
        assert!(own_m2(-4.0, 0.9).abs() < 1e-12 && (own_m2(2.0, 9.0) - 0.1).abs() < 1e-12);
        assert!(BandLeaves::of(&orchard, 0, Span::new(2.5, 3.0)).is_empty());
        assert!(
            BandLeaves::of(&orchard, 1, Span::new(1.0, 2.0)).is_empty()
                && BandLeaves::of(&orchard, -1, Span::new(1.0, 2.0)).is_empty()
        );
    }

    #[test]
    fn the_strip_widens_leaves_and_short_gaps_are_joined() {
        let leaves = vec![
            panel([0.0, 1.0], [0.0, 1.0]),
            panel([1.04, 1.5], [0.0, 1.0]),
            panel([1.6, 2.0], [0.0, 1.0]),
        ];
        let orchard = Orchard::from_organs(leaves, Vec::new(), f64::INFINITY);
        let band = BandLeaves::of(&orchard, 0, Span::new(0.0, 1.0));
        // 40 mm less a strip of 20 mm is below 30 mm.
        assert_eq!(spans(&band.wanted((0.02, 0.03), Span::new(-1.0, 9.0))), [(-0.01, 1.51), (1.59, 2.01)]);
        assert_eq!(band.wanted((0.02, 0.01), Span::new(-1.0, 9.0)).len(), 3);
    }
}
