//! A plane by least squares.

/// y = constant + slopes · x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    pub(crate) constant: f64,
    pub(crate) slopes: [f64; 2],
}

impl Plane {
    pub(crate) fn at(&self, x: [f64; 2]) -> f64 {
        let [a, b] = self.slopes;
        self.constant + a * x[0] + b * x[1]
    }
}

/// x, and y.
pub(crate) type Point = ([f64; 2], f64);

/// Through points by ordinary least squares; `None` where they lie on a line, or are fewer than three.
pub(crate) fn plane(points: &[Point]) -> Option<Plane> {
    let n = points.len() as f64;
    let mean = |of: &dyn Fn(&Point) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (a, b, y) = (mean(&|p| p.0[0]), mean(&|p| p.0[1]), mean(&|p| p.1));
    let (aa, bb) = (mean(&|p| (p.0[0] - a).powi(2)), mean(&|p| (p.0[1] - b).powi(2)));
    let ab = mean(&|p| (p.0[0] - a) * (p.0[1] - b));
    let (ay, by) = (mean(&|p| (p.0[0] - a) * (p.1 - y)), mean(&|p| (p.0[1] - b) * (p.1 - y)));
    let determinant = aa * bb - ab * ab;
    if points.len() < 3 || determinant.is_nan() || determinant <= 1e-9 * aa * bb {
        return None;
    }
    let slopes = [(ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant];
    Some(Plane { constant: y - slopes[0] * a - slopes[1] * b, slopes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_found_again_and_the_mean_error_is_none() {
        let truth = Plane { constant: 0.5, slopes: [-2.0, 3.0] };
        let x = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.2]];
        let off = [0.1, -0.1, -0.1, 0.1, 0.0];
        let points: Vec<_> = x.iter().zip(off).map(|(x, off)| (*x, truth.at(*x) + off)).collect();
        let found = plane(&points).expect("a plane");
        let errors: f64 = points.iter().map(|(x, y)| y - found.at(*x)).sum();
        assert!(errors.abs() < 1e-12 && (found.slopes[0] + 2.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn points_on_a_line_are_no_plane() {
        let points: Vec<_> = (0..6).map(|i| ([f64::from(i), 2.0 * f64::from(i)], f64::from(i))).collect();
        assert_eq!(plane(&points), None);
        assert_eq!(plane(&[([0.0, 0.0], 0.0), ([1.0, 0.0], 1.0)]), None);
    }
}
