//! What the filters of a scanner with Compact output leave.

use super::variable::{LAYERS, Stored};

/// Half a turn, degrees.
pub(super) const HALF_TURN_DEG: f64 = 180.0;
/// A beam this near to the edge of the angle filter is inside, degrees: clients compute in radians.
const EDGE_TOLERANCE_DEG: f64 = 1e-3;

/// What the filters leave.
pub(super) struct Seen {
    pub(super) layers: LayersSent,
    angles_deg: Option<[f64; 2]>,
    elevations_deg: Option<[f64; 2]>,
    increment: usize,
    ranges_mm: Option<[i64; 2]>,
}

impl Seen {
    pub(super) fn new(variables: &Stored) -> Self {
        let part = |number| variables.number("LFPangleRangeFilter", number);
        let is_on = part(0) == 1;
        let deg = |number| part(number) as f64 / 10_000.0;
        let radial = |number| variables.number("LFPradialDistanceRangeFilter", number);
        Self {
            layers: LayersSent::new(variables),
            angles_deg: is_on.then(|| [deg(1), deg(2)]),
            elevations_deg: is_on.then(|| [deg(3), deg(4)]),
            increment: if is_on { part(5).max(1) as usize } else { 1 },
            ranges_mm: (radial(0) == 1).then(|| [radial(1), radial(2)]),
        }
    }

    /// True where no filter hides a beam or a line.
    pub(super) fn is_all(&self) -> bool {
        self.angles_deg.is_none() && self.layers.is_all()
    }

    pub(super) fn sees(&self, beam: usize, theta_deg: f64, phi_deg: f64) -> bool {
        let is_within = |range: Option<[f64; 2]>, deg: f64| {
            range
                .is_none_or(|[from, to]| (from - EDGE_TOLERANCE_DEG..=to + EDGE_TOLERANCE_DEG).contains(&deg))
        };
        is_within(self.angles_deg, around(theta_deg))
            && is_within(self.elevations_deg, phi_deg)
            && beam.is_multiple_of(self.increment)
    }

    /// True of an echo: there is one at this range, and it is let through.
    pub(super) fn reaches(&self, range_mm: u16) -> bool {
        range_mm > 0 && self.ranges_mm.is_none_or(|[from, to]| (from..=to).contains(&range_mm.into()))
    }
}

/// The layers whose lines are sent.
pub(super) struct LayersSent(u32);

impl LayersSent {
    pub(super) fn new(variables: &Stored) -> Self {
        let part = |number| variables.number("LFPlayerFilter", number);
        match part(0) {
            1 => {
                Self((0..LAYERS).filter(|layer| part(1 + layer) == 1).fold(0, |all, layer| all | 1 << layer))
            }
            _ => Self(u32::MAX),
        }
    }

    fn is_all(&self) -> bool {
        self.0 == u32::MAX
    }

    pub(super) fn sends(&self, layer: usize) -> bool {
        layer < LAYERS && self.0 >> layer & 1 == 1
    }
}

/// The same angle from −180° to below 180°.
pub(super) fn around(theta_deg: f64) -> f64 {
    let turn_deg = 2.0 * HALF_TURN_DEG;
    theta_deg - turn_deg * libm::floor((theta_deg + HALF_TURN_DEG) / turn_deg)
}
