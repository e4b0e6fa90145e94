//! Where the picture is taken from.

use glam::DVec3;

use crate::error::RenderError;

/// Most pixels of a side.
pub(crate) const MOST_SIDE: u32 = 10_000;

/// What is nearer than this to the lens is not drawn, metres.
pub(crate) const NEAR_M: f64 = 0.05;

/// A camera: place, direction, lens, size of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) forward: DVec3,
    lens: Lens,
    size: (u32, u32),
}

/// How points come onto the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Lens {
    /// Half of the picture's width at distance 1.
    Perspective { half: f64 },
    /// Half of the picture's width, metres.
    Parallel { half_m: f64 },
}

/// A point as the camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Pixels from the upper left corner, to the right and down.
    pub(crate) at: [f64; 2],
    /// The larger, the nearer; linear on the picture along any straight line.
    pub(crate) nearness: f64,
}

/// A line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ray {
    pub(crate) from: DVec3,
    /// Of unit length.
    pub(crate) to: DVec3,
}

impl Camera {
    /// A camera that stands at one point and looks at another, with the angle of view from left to right in degrees.
    ///
    /// # Errors
    /// A size, angle or direction that no camera has.
    pub fn at(from: [f64; 3], look: [f64; 3], fov_deg: f64, size: (u32, u32)) -> Result<Self, RenderError> {
        if !(1.0..=150.0).contains(&fov_deg) {
            return Err(RenderError::Angle { found: fov_deg });
        }
        let towards = DVec3::from_array(look) - DVec3::from_array(from);
        let camera = Self::facing(towards, size)?.ok_or(RenderError::Direction { from, look })?;
        if !DVec3::from_array(from).is_finite() {
            return Err(RenderError::Direction { from, look });
        }
        let half = libm::tan(0.5 * fov_deg.to_radians());
        Ok(Self { eye: DVec3::from_array(from), lens: Lens::Perspective { half }, ..camera })
    }

    /// A camera without perspective, far off along −`towards`: `width_m` metres from left to right, `middle` in the middle.
    ///
    /// # Errors
    /// A size, width or direction that no camera has.
    pub fn parallel(
        middle: [f64; 3],
        towards: [f64; 3],
        width_m: f64,
        size: (u32, u32),
    ) -> Result<Self, RenderError> {
        let nowhere = RenderError::Direction { from: middle, look: towards };
        let camera = Self::facing(DVec3::from_array(towards), size)?.ok_or(nowhere.clone())?;
        let middle = DVec3::from_array(middle);
        if !(middle.is_finite() && width_m.is_finite() && width_m > 0.0) {
            return Err(nowhere);
        }
        // So far off that everything is before it.
        let eye = middle - camera.forward * 1000.0;
        Ok(Self { eye, lens: Lens::Parallel { half_m: 0.5 * width_m }, ..camera })
    }

    /// A camera without perspective that draws as a chart does: `right` and `up` are the axes to the right and up, and need not be those that
    /// somebody who looks that way would have. So a row seen from the scanner's side can begin on the left.
    ///
    /// # Errors
    /// A size, width or direction that no camera has.
    pub fn chart(
        middle: [f64; 3],
        [right, up, towards]: [[f64; 3]; 3],
        width_m: f64,
        size: (u32, u32),
    ) -> Result<Self, RenderError> {
        let camera = Self::parallel(middle, towards, width_m, size)?;
        Ok(Self { right: DVec3::from_array(right), up: DVec3::from_array(up), ..camera })
    }

    /// None for a direction that is none.
    pub(crate) fn facing(towards: DVec3, size: (u32, u32)) -> Result<Option<Self>, RenderError> {
        let (width, height) = size;
        if !((1..=MOST_SIDE).contains(&width) && (1..=MOST_SIDE).contains(&height)) {
            return Err(RenderError::Size { most: MOST_SIDE, width, height });
        }
        let Some(forward) = towards.try_normalize() else { return Ok(None) };
        // Straight down, up on the picture is +X: the row lies across it.
        let level = forward.cross(DVec3::Z).try_normalize().filter(|_| forward.z.abs() < 0.9999);
        let right = level.unwrap_or(-DVec3::Y * forward.z.signum());
        let up = right.cross(forward);
        let lens = Lens::Perspective { half: 1.0 };
        Ok(Some(Self { eye: DVec3::ZERO, right, up, forward, lens, size }))
    }

    /// The same camera where the points are just within its picture, at a margin given as a share of it.
    #[must_use]
    pub(crate) fn fitted(self, points: &[DVec3], margin: f64) -> Self {
        let Lens::Perspective { half } = self.lens else { return self };
        let (half_x, half_y) = (half * (1.0 - margin), half * self.aspect() * (1.0 - margin));
        let along = |axis: DVec3| points.iter().map(move |point| (point.dot(axis), point.dot(self.forward)));
        // The lines of sight through the outermost points bound where the eye may be.
        let bounds = |axis: DVec3, half: f64| {
            let low = along(axis).map(|(x, z)| x - half * z).fold(f64::NEG_INFINITY, f64::max);
            let high = along(axis).map(|(x, z)| x + half * z).fold(f64::INFINITY, f64::min);
            (low, high)
        };
        let ((low_x, high_x), (low_y, high_y)) = (bounds(self.right, half_x), bounds(self.up, half_y));
        let nearest = along(self.right).map(|(_, z)| z).fold(f64::INFINITY, f64::min) - 2.0 * NEAR_M;
        let z = ((high_x - low_x) / (2.0 * half_x)).min((high_y - low_y) / (2.0 * half_y)).min(nearest);
        let eye = self.right * 0.5 * (low_x + high_x) + self.up * 0.5 * (low_y + high_y) + self.forward * z;
        Self { eye, ..self }
    }

    /// The same camera elsewhere.
    #[must_use]
    pub(crate) fn moved(self, eye: DVec3) -> Self {
        Self { eye, ..self }
    }

    /// The same camera with an angle of view from left to right, degrees.
    #[must_use]
    pub(crate) fn with_angle(self, fov_deg: f64) -> Self {
        Self { lens: Lens::Perspective { half: libm::tan(0.5 * fov_deg.to_radians()) }, ..self }
    }

    /// Width and height of the picture, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Where it stands, metres.
    pub fn eye(&self) -> [f64; 3] {
        self.eye.to_array()
    }

    /// Height over width.
    fn aspect(&self) -> f64 {
        f64::from(self.size.1) / f64::from(self.size.0)
    }

    /// Where a point is on the picture, pixels from the upper left corner; None behind the camera. May lie off the picture.
    pub fn project(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let local = self.local(DVec3::from_array(point));
        (local.z >= NEAR_M).then(|| self.seen(local).at)
    }

    /// A point in the camera's axes: right, up, forward.
    pub(crate) fn local(&self, point: DVec3) -> DVec3 {
        let off = point - self.eye;
        DVec3::new(off.dot(self.right), off.dot(self.up), off.dot(self.forward))
    }

    /// A point in the camera's axes on the picture; not nearer than [`NEAR_M`].
    pub(crate) fn seen(&self, local: DVec3) -> Seen {
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let (scale, nearness) = match self.lens {
            Lens::Perspective { half } => (0.5 * width / (half * local.z), 1.0 / local.z),
            Lens::Parallel { half_m } => (0.5 * width / half_m, -local.z),
        };
        Seen { at: [0.5 * width + local.x * scale, 0.5 * height - local.y * scale], nearness }
    }

    /// The line of sight through a place of the picture, pixels.
    pub(crate) fn ray(&self, [x, y]: [f64; 2]) -> Ray {
        let (width, height) = (f64::from(self.size.0), f64::from(self.size.1));
        let (right, up) = ((2.0 * x - width) / width, (height - 2.0 * y) / width);
        match self.lens {
            Lens::Perspective { half } => {
                let to = self.forward + self.right * (right * half) + self.up * (up * half);
                Ray { from: self.eye, to: to.normalize() }
            }
            Lens::Parallel { half_m } => Ray {
                from: self.eye + self.right * (right * half_m) + self.up * (up * half_m),
                to: self.forward,
            },
        }
    }

    /// Metres of air before what is at a distance: none without perspective, where the camera's place means nothing.
    pub(crate) fn air_m(&self, distance_m: f32) -> f32 {
        match self.lens {
            Lens::Perspective { .. } => distance_m,
            Lens::Parallel { .. } => 0.0,
        }
    }

    /// Metres that a pixel covers at a distance.
    pub(crate) fn pixel_m(&self, distance_m: f64) -> f64 {
        let width = f64::from(self.size.0);
        match self.lens {
            Lens::Perspective { half } => 2.0 * half * distance_m / width,
            Lens::Parallel { half_m } => 2.0 * half_m / width,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_sight_goes_through_the_point_that_is_seen_there() {
        let cameras = [
            Camera::at([-5.0, 2.0, 3.0], [0.5, 4.0, 1.0], 40.0, (320, 200)).unwrap(),
            Camera::parallel([0.0, 4.0, 1.0], [1.0, 0.2, -0.3], 12.0, (320, 200)).unwrap(),
        ];
        for camera in cameras {
            for point in [[0.0, 4.0, 1.0], [0.5, 3.0, 2.0], [-0.4, 5.5, 0.1]] {
                let at = camera.project(point).unwrap();
                let Ray { from, to } = camera.ray(at);
                let off = DVec3::from_array(point) - from;
                assert!((off - to * off.dot(to)).length() < 1e-9, "{camera:?} {point:?}");
            }
        }
    }

    #[test]
    fn an_angle_of_view_spans_the_picture_from_left_to_right() {
        let camera = Camera::at([0.0; 3], [1.0, 0.0, 0.0], 90.0, (100, 50)).unwrap();
        // Looking along +X, left is +Y.
        let close = |found: Option<[f64; 2]>, expected: [f64; 2]| {
            let found = found.unwrap();
            assert!(
                (found[0] - expected[0]).abs() < 1e-9 && (found[1] - expected[1]).abs() < 1e-9,
                "{found:?}"
            );
        };
        close(camera.project([2.0, 2.0, 0.0]), [0.0, 25.0]);
        close(camera.project([2.0, -2.0, 0.0]), [100.0, 25.0]);
        close(camera.project([2.0, 0.0, 1.0]), [50.0, 0.0]);
        assert_eq!(camera.project([-1.0, 0.0, 0.0]), None);
    }

    #[test]
    fn a_camera_that_cannot_be_is_refused_with_what_was_found() {
        let message = |camera: Result<Camera, RenderError>| camera.unwrap_err().to_string();
        let same = message(Camera::at([1.0; 3], [1.0; 3], 40.0, (10, 10)));
        assert!(same.contains("another point") && same.contains("[1.0, 1.0, 1.0]"), "{same}");
        assert!(message(Camera::at([0.0; 3], [1.0; 3], 170.0, (10, 10))).contains("found 170"));
        assert!(message(Camera::at([0.0; 3], [1.0; 3], 40.0, (0, 10))).contains("found 0 x 10"));
        assert!(message(Camera::at([f64::NAN; 3], [1.0; 3], 40.0, (9, 10))).contains("another point"));
    }

    #[test]
    fn a_fitted_camera_touches_the_margin_and_holds_every_point() {
        let points: Vec<DVec3> = [[0.0, 0.0, 0.0], [1.0, 18.0, 3.0], [-1.0, 18.0, 0.0], [0.3, 2.0, 3.3]]
            .map(DVec3::from_array)
            .into();
        let towards = DVec3::new(1.0, 0.8, -0.3);
        let camera =
            Camera::facing(towards, (400, 300)).unwrap().unwrap().with_angle(35.0).fitted(&points, 0.1);
        let at: Vec<[f64; 2]> = points.iter().map(|p| camera.project(p.to_array()).unwrap()).collect();
        let most = |axis: usize, size: f64| {
            at.iter().map(|p| (p[axis] / size - 0.5).abs() * 2.0).fold(0.0, f64::max)
        };
        let (x, y) = (most(0, 400.0), most(1, 300.0));
        assert!(x <= 0.9 + 1e-9 && y <= 0.9 + 1e-9 && x.max(y) > 0.9 - 1e-9, "{x} {y}");
    }
}
