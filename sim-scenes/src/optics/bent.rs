//! The fan of a line, in pieces that lie in one plane each: one piece, or facets of the cone that a bent scan plane is.

use rowscan_protocol::rig::Axes;

use crate::angle::cos_sin_deg;
use crate::caster::BeamFan;

/// Widest facet, degrees. A cone bent by 3° leaves such a facet by 0.2 mm a metre.
const FACET_DEG: f64 = 10.0;

/// Rays that are cast together.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Number of its first ray.
    pub(super) first: usize,
    /// The rays, in the plane that they lie in.
    pub(super) fan: BeamFan,
    /// How that plane is turned from the fan's own.
    turned: Option<Axes>,
}

/// All rays of `fan`; each leaves the scan plane by `bend_rad`, ahead where that is positive.
pub(super) fn pieces(fan: &BeamFan, bend_rad: f64) -> Vec<Piece> {
    if bend_rad == 0.0 || fan.is_empty() {
        return vec![Piece { first: 0, fan: fan.clone(), turned: None }];
    }
    let step_deg = fan.step_rad().to_degrees().abs();
    let most = ((FACET_DEG / step_deg) as usize).max(1);
    let piece = |first: usize| {
        let count = most.min(fan.len() - first);
        let middle_rad = fan.theta_rad(first) + fan.step_rad() * (count - 1) as f64 / 2.0;
        Piece { first, fan: fan.part(first, count), turned: Some(facet(middle_rad, bend_rad)) }
    };
    let mut pieces: Vec<Piece> = (0..fan.len()).step_by(most).map(piece).collect();
    pieces.iter_mut().for_each(|piece| piece.lean(fan));
    pieces
}

impl Piece {
    /// The fan's plane leans as this one's from now on.
    pub(super) fn lean(&mut self, fan: &BeamFan) {
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
    fn directions(pieces: &[Piece]) -> Vec<[f64; 3]> {
        let of = |piece: &Piece| {
            let axes = piece.fan.axes().copied().unwrap_or(Axes::LEVEL);
            piece.fan.directions().map(|(cos, sin)| axes.beam(cos, sin)).collect::<Vec<_>>()
        };
        pieces.iter().flat_map(of).collect()
    }

    #[test]
    fn facets_have_every_ray_once_and_are_the_cone() {
        for (step_deg, bend_deg, yaw_rad) in [(0.11, 3.0, 0.0), (-0.33, -3.0, 0.0), (0.5, 1.2, 0.1)] {
            let carrier = rowscan_protocol::rig::Attitude { yaw_rad, ..Default::default() }.axes();
            let fan = BeamFan::from_degrees(-47.0, step_deg, 823).leaning(carrier);
            let bend_rad = f64::to_radians(bend_deg);
            let pieces = pieces(&fan, bend_rad);
            assert!(pieces.windows(2).all(|two| two[0].first + two[0].fan.len() == two[1].first));
            let found = directions(&pieces);
            assert_eq!(found.len(), fan.len());
            for ((cos, sin), direction) in fan.directions().zip(found) {
                let (sin_bend, cos_bend) = bend_rad.sin_cos();
                let cone = carrier.turned([cos * cos_bend, sin_bend, sin * cos_bend]);
                let off: f64 = (0..3).map(|i| (cone[i] - direction[i]).powi(2)).sum();
                assert!(off.sqrt() < 2.5e-4, "{bend_deg} degrees: {direction:?}, expected {cone:?}");
            }
        }
    }

    #[test]
    fn a_plane_that_is_not_bent_is_the_fan_itself() {
        let fan = BeamFan::from_degrees(-45.0, 0.25, 1081);
        let [piece] = &pieces(&fan, 0.0)[..] else { panic!("one piece") };
        assert_eq!((piece.first, &piece.fan), (0, &fan));
    }
}
