//! A spray plume: a cone of drops before a nozzle that rides with the scanner.

use std::f64::consts::PI;

use rowscan_vehicle::ParameterError;
use rowscan_vehicle::parameter::{require, require_within};
use serde::{Deserialize, Serialize};

use super::haze::BACKSCATTER_SR;
use super::shot::{PULSE_M, Shot};
use crate::angle::cos_sin_deg;
use crate::optics::draws::Use;
use crate::optics::touch::{NO_RAY, Touch};

/// Half angle of a hollow cone of the 80° class.
const HALF_ANGLE_DEG: f64 = 35.0;

/// Scatter of the concentration from shot to shot, sd of its logarithm \[ASM\].
const SCATTER: f64 = 0.5;

/// Pieces that a beam's way through the cone is cut into.
const PIECES: usize = 12;

/// A cone ends here, metres.
const LENGTH_M: f64 = 3.0;

/// A nozzle: table `[[optics.air.plume]]`. Its place counts from the scanner's mirror.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Plume {
    /// Towards the row, metres.
    pub x_m: f64,
    /// Ahead along the row, metres.
    pub y_m: f64,
    /// Up, metres.
    pub z_m: f64,
    /// Where it sprays, degrees above level, towards the row.
    pub pitch_deg: f64,
    /// Flow, l/min; 0 is off.
    pub flow_l_min: f64,
    /// Volume-mean diameter of the drops, µm.
    pub drop_um: f64,
    /// Their speed, m/s.
    pub speed_m_s: f64,
    /// Half angle of the cone, degrees.
    pub half_angle_deg: f64,
    /// Shut until a controller opens it over CAN.
    pub shut: bool,
    /// Other flows from a place or a time of the drive on.
    #[serde(rename = "change", skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<FlowChange>,
    /// The nozzle of a boom that it is, by its number there: it gives what that nozzle's valve lets through.
    #[serde(skip)]
    pub nozzle: Option<usize>,
}

/// Whose flow it is that somebody else than the scene sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// That of the scene's plume with this place, from 0.
    Plume(usize),
    /// That of the boom's nozzle with this number, from 0.
    Nozzle(usize),
}

/// Another flow: table `[[optics.air.plume.change]]`, with either `at_s` or `at_m`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FlowChange {
    /// From so many seconds of driving on.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 12.0)]
    pub at_s: Option<f64>,
    /// Where the scanner is farther along the row than this, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = 6.0)]
    pub at_m: Option<f64>,
    /// The flow, l/min.
    pub flow_l_min: f64,
}

impl FlowChange {
    fn is_reached(&self, drive: Moment) -> bool {
        match (self.at_s, self.at_m) {
            (Some(at_s), _) => drive.driven_s >= at_s,
            (None, Some(at_m)) => drive.y_m >= at_m,
            (None, None) => false,
        }
    }
}

/// Where a drive has come to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Seconds since it began.
    pub driven_s: f64,
    /// Y of the scanner, metres.
    pub y_m: f64,
}

impl Default for Plume {
    fn default() -> Self {
        Self {
            x_m: 0.3,
            y_m: 0.0,
            z_m: -0.3,
            pitch_deg: 0.0,
            flow_l_min: 1.0,
            drop_um: 120.0,
            speed_m_s: 12.0,
            half_angle_deg: HALF_ANGLE_DEG,
            shut: false,
            changes: Vec::new(),
            nozzle: None,
        }
    }
}

impl Plume {
    /// Half angles of the narrowest and the widest cone, degrees.
    pub const HALF_ANGLES_DEG: (f64, f64) = (1.0, 85.0);

    pub(super) fn validate(&self) -> Result<(), ParameterError> {
        for (key, place) in [("x_m", self.x_m), ("y_m", self.y_m), ("z_m", self.z_m)] {
            require_within(&format!("optics.air.plume.{key}"), place, -20.0, 20.0)?;
        }
        require_within("optics.air.plume.pitch_deg", self.pitch_deg, -90.0, 90.0)?;
        require_within("optics.air.plume.flow_l_min", self.flow_l_min, 0.0, 100.0)?;
        for change in &self.changes {
            let expected = "a table with either at_s or at_m";
            let one = change.at_s.is_some() != change.at_m.is_some();
            require(
                one,
                "optics.air.plume.change",
                expected,
                if change.at_s.is_some() { "both" } else { "neither" },
            )?;
            require_within("optics.air.plume.change.flow_l_min", change.flow_l_min, 0.0, 100.0)?;
            require_within("optics.air.plume.change.at_s", change.at_s.unwrap_or(0.0), 0.0, 1e6)?;
            require_within("optics.air.plume.change.at_m", change.at_m.unwrap_or(0.0), -1e6, 1e6)?;
        }
        require_within("optics.air.plume.drop_um", self.drop_um, 10.0, 5000.0)?;
        let (narrowest_deg, widest_deg) = Self::HALF_ANGLES_DEG;
        require_within("optics.air.plume.half_angle_deg", self.half_angle_deg, narrowest_deg, widest_deg)?;
        require_within("optics.air.plume.speed_m_s", self.speed_m_s, 0.1, 200.0)
    }

    /// Radius of the cone a metre.
    fn widening(&self) -> f64 {
        let (cos, sin) = cos_sin_deg(self.half_angle_deg);
        sin / cos
    }

    /// Who else sets its flow, where it is number `place` of the scanner's.
    pub(super) fn source(&self, place: usize) -> Source {
        self.nozzle.map_or(Source::Plume(place), Source::Nozzle)
    }

    /// Its flow at a moment of the drive, l/min; `duty` is what its source says, as a share of full flow.
    pub(super) fn flow_at(&self, drive: Moment, duty: Option<f64>) -> f64 {
        let reached = self.changes.iter().rev().find(|change| change.is_reached(drive));
        let set = reached.map_or(self.flow_l_min, |change| change.flow_l_min);
        set * duty.unwrap_or(if self.shut { 0.0 } else { 1.0 })
    }

    /// Extinction so far before the nozzle, 1/m: drops by mass balance over the cone's cross-section.
    pub fn extinction(&self, ahead_m: f64) -> f64 {
        let (flow, diameter) = (self.flow_l_min * 1e-3 / 60.0, self.drop_um * 1e-6);
        let radius = ahead_m * self.widening();
        let drop_m3 = PI / 6.0 * diameter * diameter * diameter;
        let per_m3 = flow / (drop_m3 * self.speed_m_s * PI * radius * radius);
        per_m3 * PI / 2.0 * diameter * diameter
    }

    /// Extinction at a place in the scan plane, metres from the mirror; 0 outside the cone.
    fn at(&self, x_m: f64, z_m: f64) -> f64 {
        let (x, z) = (x_m - self.x_m, z_m - self.z_m);
        let (cos, sin) = cos_sin_deg(self.pitch_deg);
        let ahead = x * cos + z * sin;
        if !(0.02..LENGTH_M).contains(&ahead) {
            return 0.0;
        }
        let across = libm::hypot(z * cos - x * sin, self.y_m);
        if across > ahead * self.widening() { 0.0 } else { self.extinction(ahead) }
    }

    /// Adds its own return, and dims those before it in the list. Gives what it leaves of the power of all others.
    pub(super) fn act(&self, shot: Shot, free_m: f64, own: &mut Vec<Touch>) -> f64 {
        if self.flow_l_min <= 0.0 {
            return 1.0;
        }
        let (sin, cos) = (libm::sin(shot.theta_rad), libm::cos(shot.theta_rad));
        // The scanner may look either way along X: the nozzle sprays where it looks.
        let cos = cos.abs();
        let scatter = libm::exp(SCATTER * shot.draws(Use::Spray).normal());
        let reach_m = free_m.min(libm::hypot(self.x_m, self.z_m) + LENGTH_M);
        let step_m = reach_m / PIECES as f64;
        let (mut depth, mut reflected, mut place, mut lit_m) = (0.0, 0.0, 0.0, 0.0);
        for piece in 0..PIECES {
            let range_m = (piece as f64 + 0.5) * step_m;
            let alpha = scatter * self.at(range_m * cos, range_m * sin);
            if alpha <= 0.0 {
                continue;
            }
            let back = PI * alpha / BACKSCATTER_SR * step_m * libm::exp(-2.0 * depth) / (range_m * range_m);
            reflected += back;
            place += back * range_m;
            lit_m += step_m;
            depth += alpha * step_m;
        }
        if reflected <= 0.0 {
            return 1.0;
        }
        let left = libm::exp(-2.0 * depth);
        own.iter_mut().for_each(|touch| touch.power *= left);
        let power = reflected * (PULSE_M / lit_m).min(1.0);
        own.push(Touch { range_m: place / reflected, share: 0.0, power, ray: NO_RAY });
        left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flow_is_the_last_change_reached_times_the_duty_told() {
        let change = |at_s, at_m, flow_l_min| FlowChange { at_s, at_m, flow_l_min };
        let changes = vec![change(Some(3.0), None, 0.0), change(None, Some(8.0), 2.0)];
        let plume = Plume { changes, ..Plume::default() };
        plume.validate().unwrap();
        let at = |driven_s, y_m, duty| plume.flow_at(Moment { driven_s, y_m }, duty);
        assert_eq!((at(2.9, 2.9, None), at(3.0, 3.0, None), at(8.0, 8.0, None)), (1.0, 0.0, 2.0));
        assert_eq!((at(8.0, 8.0, Some(0.25)), at(1.0, 1.0, Some(0.0))), (0.5, 0.0));
        let shut = Plume { shut: true, ..Plume::default() };
        let at_start = |duty| shut.flow_at(Moment::default(), duty);
        assert_eq!((at_start(None), at_start(Some(1.0))), (0.0, 1.0));
        let both = Plume { changes: vec![change(Some(1.0), Some(1.0), 0.0)], ..Plume::default() };
        let message = both.validate().unwrap_err().to_string();
        assert!(message.contains("either at_s or at_m") && message.contains("both"), "{message}");
    }

    #[test]
    fn a_worked_plume_has_the_extinction_of_the_sheet() {
        // OPTICS.md 4: 1 l/min, 120 µm, 12 m/s.
        for (ahead_m, alpha) in [(0.3, 0.25), (0.6, 0.062), (1.0, 0.022), (1.5, 0.010)] {
            let found = Plume::default().extinction(ahead_m);
            assert!((found / alpha - 1.0).abs() < 0.06, "{ahead_m} m: {found}, {alpha}");
        }
        let coarse = Plume { drop_um: 350.0, speed_m_s: 8.0, ..Plume::default() };
        let ratio = coarse.extinction(1.0) / Plume::default().extinction(1.0);
        assert!((0.45..0.6).contains(&ratio), "{ratio}");
    }
}
