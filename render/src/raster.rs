//! Which samples of a raster a triangle covers.

use std::ops::Range;

/// Where on the raster, in samples from its upper left corner, and how near; nearness is linear in between.
pub(crate) type Vertex = [f64; 3];

/// Calls `put(column, row, nearness)` for every sample whose middle the triangle covers, within the rows given.
///
/// A sample on an edge that two triangles share may be given to both.
pub(crate) fn fill(
    [a, b, c]: [Vertex; 3],
    width: usize,
    rows: Range<usize>,
    mut put: impl FnMut(usize, usize, f64),
) {
    let least = |axis: usize| a[axis].min(b[axis]).min(c[axis]);
    let most = |axis: usize| a[axis].max(b[axis]).max(c[axis]);
    let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if twice == 0.0 || !twice.is_finite() {
        return;
    }
    // Sample k has its middle at k + ½. A float to integer cast saturates.
    let first = |low: f64| (low - 0.5).ceil().max(0.0) as usize;
    let beyond = |high: f64, end: usize| ((high - 0.5).floor() + 1.0).clamp(0.0, end as f64) as usize;
    let columns = first(least(0))..beyond(most(0), width);
    // Weights of the corners are linear: their change from column to column and from row to row.
    let scale = 1.0 / twice;
    let (ux, uy) = ((c[1] - a[1]) * scale, -(c[0] - a[0]) * scale);
    let (vx, vy) = (-(b[1] - a[1]) * scale, (b[0] - a[0]) * scale);
    for row in first(least(1)).max(rows.start)..beyond(most(1), rows.end) {
        let down = row as f64 + 0.5 - a[1];
        for column in columns.clone() {
            let right = column as f64 + 0.5 - a[0];
            let (u, v) = (ux * right + uy * down, vx * right + vy * down);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                put(column, row, a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_of_two_triangles_covers_its_area_and_keeps_its_depth() {
        let corner = |x: f64, y: f64| [x, y, 2.0 * x + 3.0 * y];
        let (a, b, c, d) = (corner(2.2, 3.1), corner(12.2, 3.1), corner(12.2, 8.1), corner(2.2, 8.1));
        for turn in [[[a, b, c], [a, c, d]], [[c, b, a], [d, c, a]]] {
            let mut covered = vec![0; 400];
            for triangle in turn {
                fill(triangle, 20, 0..20, |column, row, nearness| {
                    covered[row * 20 + column] |= 1;
                    let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                    assert!((nearness - 2.0 * x - 3.0 * y).abs() < 1e-9);
                });
            }
            assert_eq!(covered.iter().sum::<i32>(), 50);
        }
    }

    #[test]
    fn what_lies_off_the_raster_or_is_no_triangle_covers_nothing() {
        let mut count = 0;
        fill([[-9.0, -9.0, 1.0], [-1.0, -9.0, 1.0], [-9.0, -1.0, 1.0]], 5, 0..5, |_, _, _| count += 1);
        fill([[1.0, 1.0, 1.0], [3.0, 3.0, 1.0], [2.0, 2.0, 1.0]], 5, 0..5, |_, _, _| count += 1);
        fill([[f64::NAN, 1.0, 1.0], [3.0, 3.0, 1.0], [2.0, 0.0, 1.0]], 5, 0..5, |_, _, _| count += 1);
        assert_eq!(count, 0);
    }
}
