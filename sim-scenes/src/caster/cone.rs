//! Beams that all leave the plane in which the mirror turns by one angle: a cone, cast as facets that lie in one plane each.
//!
//! A layer of constant elevation is such a cone, and so is the scan plane of a unit whose mirror is askew.

use rowscan_protocol::rig::Axes;
use rowscan_protocol::scan::Pose;

use super::{BeamFan, Caster, Return, Scratch};
use crate::angle::cos_sin_deg;

/// Widest facet, degrees. A cone bent by [`SLIGHT_RAD`] leaves such a facet by 0.2 mm a metre.
const WIDEST_DEG: f64 = 10.0;

/// Up to this bend, 3°, facets are the widest, and beams are as far apart on them as in the plane.
const SLIGHT_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// How far other facets may leave the cone, by the distance from the scanner.
const TOLERANCE: f64 = 2.5e-4;

/// The beams of a cone.
#[derive(Clone, Debug)]
pub struct Cone {
    bend_rad: f64,
    pieces: Vec<Piece>,
}

/// Rays that are cast together.
#[derive(Clone, Debug)]
struct Piece {
    /// Number of its first ray.
    first: usize,
    /// The rays, in the plane that they lie in.
    fan: BeamFan,
    /// How that plane is turned from the fan's own.
    turned: Option<Axes>,
}

impl Cone {
    /// The beams of `fan`, each of which leaves the scan plane by `bend_rad`: ahead, along the fan's +Y, where that is positive.
    pub fn new(fan: &BeamFan, bend_rad: f64) -> Self {
        Self { bend_rad, pieces: pieces(fan, bend_rad) }
    }

    /// How far its beams leave the scan plane, radians.
    pub fn bend_rad(&self) -> f64 {
        self.bend_rad
    }

    /// Angle between two beams of a cone bent so, by that between two of the plane.
    pub fn pitch(bend_rad: f64) -> f64 {
        Facets::of(bend_rad).pitch
    }

    /// The fan's plane leans as this one's from now on.
    pub fn lean(&mut self, fan: &BeamFan) {
        self.pieces.iter_mut().for_each(|piece| piece.lean(fan));
    }

    /// As [`Caster::cast`]: what each beam meets, the first from `origin`, each next one `advance_m` farther along +Y. `across_m` is how far the
    /// beams start beside that, square to the plane that they lie in.
    pub fn cast(
        &mut self,
        caster: &Caster,
        (origin, across_m): (Pose, f64),
        advance_m: f64,
        scratch: &mut Scratch,
        out: &mut [Return],
    ) {
        for Piece { first, fan, .. } in &mut self.pieces {
            fan.advance(advance_m);
            let y_m = origin.y_m + *first as f64 * advance_m;
            let from = beside(Pose { y_m, ..origin }, fan, across_m);
            caster.cast(from, fan, scratch, out.get_mut(*first..).unwrap_or_default());
        }
    }
}

/// A place so far across the fan's plane.
fn beside(from: Pose, fan: &BeamFan, across_m: f64) -> Pose {
    let [x, y, z] = fan.axes().map_or([0.0, 1.0, 0.0], |axes| axes.ahead);
    Pose { x_m: from.x_m + x * across_m, y_m: from.y_m + y * across_m, z_m: from.z_m + z * across_m }
}

/// How a cone is cut into facets.
#[derive(Clone, Copy, Debug)]
struct Facets {
    /// As seen from above the cone, degrees.
    width_deg: f64,
    /// Angle between two beams, by that between two of the plane.
    pitch: f64,
    /// How much farther their middles are bent than the cone, radians: a facet then leaves it as far in its middle as at its edges.
    beyond_rad: f64,
}

impl Facets {
    /// A beam at θ from a facet's middle leaves the plane that touches the cone there by θ² sin φ cos φ / 2, where φ is the bend.
    fn of(bend_rad: f64) -> Self {
        if bend_rad.abs() <= SLIGHT_RAD {
            return Self { width_deg: WIDEST_DEG, pitch: 1.0, beyond_rad: 0.0 };
        }
        let (cos, sin) = cos_sin_deg(bend_rad.to_degrees());
        let half_rad = (4.0 * TOLERANCE / (cos * sin).abs()).sqrt();
        let beyond_rad = TOLERANCE.copysign(bend_rad);
        Self { width_deg: (2.0 * half_rad.to_degrees()).min(WIDEST_DEG), pitch: cos, beyond_rad }
    }
}

/// All rays of `fan`; each leaves the scan plane by `bend_rad`, ahead where that is positive.
fn pieces(fan: &BeamFan, bend_rad: f64) -> Vec<Piece> {
    if bend_rad == 0.0 || fan.is_empty() {
        return vec![Piece { first: 0, fan: fan.clone(), turned: None }];
    }
    let facets = Facets::of(bend_rad);
    let step_deg = fan.step_rad().to_degrees().abs();
    let most = ((facets.width_deg / step_deg) as usize).max(1);
    let piece = |first: usize| {
        let count = most.min(fan.len() - first);
        let middle_rad = fan.theta_rad(first) + fan.step_rad() * (count - 1) as f64 / 2.0;
        let turned = Some(facet(middle_rad, bend_rad + facets.beyond_rad));
        Piece { first, fan: fan.part(first, count).narrowed(facets.pitch), turned }
    };
    let mut pieces: Vec<Piece> = (0..fan.len()).step_by(most).map(piece).collect();
    pieces.iter_mut().for_each(|piece| piece.lean(fan));
    pieces
}

impl Piece {
    fn lean(&mut self, fan: &BeamFan) {
        let axes = fan.axes();
        self.fan.lean(match &self.turned {
            Some(turned) => Some(turned.on(axes.unwrap_or(&Axes::LEVEL))),
            None => axes.copied(),
        });
    }
}

/// The plane that touches the cone at this angle, in the axes of the scan plane: those turned about the way in which the mirror turns.
fn facet(theta_rad: f64, bend_rad: f64) -> Axes {
    let [(cos, sin), (cos_bend, sin_bend)] =
        [theta_rad, bend_rad].map(|angle_rad| cos_sin_deg(angle_rad.to_degrees()));
    let beam = [cos * cos_bend, sin_bend, sin * cos_bend];
    let ahead = [-cos * sin_bend, cos_bend, -sin * sin_bend];
    let mirror = [-sin, 0.0, cos];
    let mixed = |a: f64, b: f64| [0, 1, 2].map(|i| a * beam[i] + b * mirror[i]);
    Axes { to_row: mixed(cos, -sin), ahead, up: mixed(sin, cos) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions of all rays, piece by piece.
    fn directions(cone: &Cone) -> Vec<[f64; 3]> {
        let of = |piece: &Piece| {
            let axes = piece.fan.axes().copied().unwrap_or(Axes::LEVEL);
            piece.fan.directions().map(|(cos, sin)| axes.beam(cos, sin)).collect::<Vec<_>>()
        };
        cone.pieces.iter().flat_map(of).collect()
    }

    #[test]
    fn facets_have_every_ray_once_and_are_the_cone() {
        let bends = [(0.11, 3.0, 0.0), (-0.33, -3.0, 0.0), (0.5, 1.2, 0.1), (0.25, 2.5, -0.2)];
        let elevations =
            [(0.25, 5.0, 0.1), (0.25, 7.5, 0.0), (-0.25, 22.5, 0.3), (0.125, 42.0, 0.0), (1.0, -42.0, 0.1)];
        for (step_deg, bend_deg, yaw_rad) in bends.into_iter().chain(elevations) {
            let carrier = rowscan_protocol::rig::Attitude { yaw_rad, ..Default::default() }.axes();
            let fan = BeamFan::from_degrees(-47.0, step_deg, 823).leaning(carrier);
            let bend_rad = f64::to_radians(bend_deg);
            let cone = Cone::new(&fan, bend_rad);
            assert!(cone.pieces.windows(2).all(|two| two[0].first + two[0].fan.len() == two[1].first));
            let found = directions(&cone);
            assert_eq!(found.len(), fan.len());
            for ((cos, sin), direction) in fan.directions().zip(found) {
                let (sin_bend, cos_bend) = bend_rad.sin_cos();
                let ray = carrier.turned([cos * cos_bend, sin_bend, sin * cos_bend]);
                let off: f64 = (0..3).map(|i| (ray[i] - direction[i]).powi(2)).sum();
                assert!(off.sqrt() < 2.8e-4, "{bend_deg} degrees: {direction:?}, expected {ray:?}");
            }
        }
    }

    #[test]
    fn a_plane_that_is_not_bent_is_the_fan_itself() {
        let fan = BeamFan::from_degrees(-45.0, 0.25, 1081);
        let [piece] = &Cone::new(&fan, 0.0).pieces[..] else { panic!("one piece") };
        assert_eq!((piece.first, &piece.fan), (0, &fan));
    }
}
