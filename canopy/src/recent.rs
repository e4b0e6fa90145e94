//! The sums of the canopy just driven past, before any leaf area is made of it.
//!
//! A window is the last `CELLS` tenths of a metre of row, the one being driven included; it moves on a tenth at a time. Memory is fixed.

use crate::profile::Outline;

/// Bands of height.
pub const BANDS: usize = 8;
/// Height of a band, metres; the highest holds what is above it too.
pub const BAND_M: f64 = 0.5;
/// Length of a cell along the row, metres.
const CELL_M: f64 = 0.1;
/// Cells in a window.
const CELLS: usize = 5;

/// Sums over a stretch of row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct WindowSums {
    /// Metres of row scanned.
    pub(crate) length_m: f64,
    /// Impacted area by height, the lowest band first, m².
    pub(crate) bands_m2: [f64; BANDS],
    /// Highest canopy return, metres above the ground.
    pub(crate) height_m: Option<f64>,
    /// Volume between the outline of the side seen and the row axis, m³.
    pub(crate) volume_m3: f64,
}

impl WindowSums {
    fn add(&mut self, cell: &Self) {
        self.length_m += cell.length_m;
        for (band, more) in self.bands_m2.iter_mut().zip(cell.bands_m2) {
            *band += more;
        }
        self.height_m = self.height_m.into_iter().chain(cell.height_m).reduce(f64::max);
        self.volume_m3 += cell.volume_m3;
    }
}

/// Fills windows, line by line.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recent {
    cells: [WindowSums; CELLS],
    key: i64,
    /// Of the open cell, as the row's volume has it: seen from the row axis.
    outline: Outline,
}

impl Recent {
    /// A line at `y_m` of weight `weight_m` begins.
    pub(crate) fn line(&mut self, y_m: f64, weight_m: f64) {
        let key = (y_m / CELL_M).floor() as i64;
        let passed = key.saturating_sub(self.key).clamp(0, CELLS as i64);
        self.key = key;
        if passed > 0 {
            self.close();
        }
        for _ in 0..passed {
            self.cells.rotate_right(1);
            self.open(|cell| *cell = WindowSums::default());
        }
        self.outline.add_line(weight_m);
        self.open(|cell| cell.length_m += weight_m);
    }

    /// A canopy return of that line: its height, its depth before the row axis, its area.
    pub(crate) fn hit(&mut self, z_m: f64, depth_m: f64, area_m2: f64) {
        let band = ((z_m / BAND_M).max(0.0) as usize).min(BANDS - 1);
        self.outline.add(-depth_m, z_m);
        self.open(|cell| {
            if let Some(band) = cell.bands_m2.get_mut(band) {
                *band += area_m2;
            }
            cell.height_m = Some(cell.height_m.map_or(z_m, |height| height.max(z_m)));
        });
    }

    /// The window up to the latest line.
    pub(crate) fn window(&self) -> WindowSums {
        let mut window = WindowSums::default();
        for cell in &self.cells {
            window.add(cell);
        }
        window.volume_m3 += self.open_volume_m3();
        window
    }

    fn open(&mut self, change: impl FnOnce(&mut WindowSums)) {
        let [open, ..] = &mut self.cells;
        change(open);
    }

    fn open_volume_m3(&self) -> f64 {
        // Of the side seen.
        0.5 * self.outline.section(0.0).volume_m3()
    }

    fn close(&mut self) {
        let volume_m3 = self.open_volume_m3();
        self.outline.clear();
        self.open(|cell| cell.volume_m3 = volume_m3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_has_its_area_height_and_volume_and_passes_by() {
        let mut recent = Recent::default();
        // 2 m high, half a metre before the axis, from y = 0 to 3 m; 20 mm a line, five hits a band: one in each cell of 0.1 m.
        for line in 0..250 {
            let y_m = f64::from(line) * 0.02;
            recent.line(y_m, 0.02);
            if y_m < 3.0 {
                for hit in 0..20 {
                    let z_m = (f64::from(hit) + 0.5) * 0.1;
                    recent.hit(z_m, 0.5, 0.1 * 0.02);
                }
            }
            let window = recent.window();
            if (0.5..2.99).contains(&y_m) {
                let per_metre = |quantity: f64| quantity / window.length_m;
                assert!((per_metre(window.bands_m2.iter().sum()) - 2.0).abs() < 1e-9, "{y_m}");
                assert!((per_metre(window.bands_m2[3]) - 0.5).abs() < 1e-9 && window.bands_m2[4] == 0.0);
                assert!((per_metre(window.volume_m3) - 1.0).abs() < 1e-9, "{y_m} {window:?}");
                assert!(window.height_m.is_some_and(|height_m| (height_m - 1.95).abs() < 1e-12));
                assert!((0.37..=0.53).contains(&window.length_m), "{}", window.length_m);
            }
        }
        assert_eq!(recent.window().height_m, None, "behind the wall");
    }
}
