//! Whether the points of scans are where the leaves are that their beams met.

use rowscan_canopy::Placing;
use rowscan_protocol::scan::Scan;
use rowscan_scenes::{Class, Orchard, Return};

/// How points are held against an orchard.
pub struct Leaves<'a> {
    pub orchard: &'a Orchard,
    /// How far a point may be beside its leaf, metres.
    pub beside_m: f64,
    /// The orchard stands again so many times before and behind itself.
    pub periods: i32,
}

impl Leaves<'_> {
    /// Points of a scan that were leaves, and those of them on the leaf that the beam met.
    pub fn points(&self, placing: &mut Placing, scan: &Scan, returns: &[Return]) -> (u32, u32) {
        let trees: Vec<_> = self.orchard.trees().collect();
        let placed = placing.line(scan);
        let (mut all, mut on) = (0, 0);
        for (beam, met) in returns.iter().enumerate().filter(|(_, met)| met.class == Class::Leaf) {
            let range_m = scan.echoes[0].range_m[beam];
            if !range_m.is_finite() {
                continue;
            }
            all += 1;
            let point = placing.place(&placed, beam, range_m);
            let leaf = &trees[met.tree as usize].leaves[met.organ as usize];
            let within = |axis: usize, shift_m: f64| {
                let at = |corner: &[f64; 3]| corner[axis] + shift_m;
                let low = leaf.outline().iter().map(at).fold(f64::INFINITY, f64::min);
                let high = leaf.outline().iter().map(at).fold(f64::NEG_INFINITY, f64::max);
                (low - self.beside_m..=high + self.beside_m).contains(&point[axis])
            };
            let period_m = self.orchard.length_m();
            let along = (-self.periods..=self.periods).any(|period| within(1, f64::from(period) * period_m));
            on += u32::from(within(0, 0.0) && within(2, 0.0) && along);
        }
        (all, on)
    }
}
