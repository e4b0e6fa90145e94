//! A bench: one scanner, plates square to its axis, one line after another.

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::{Fact, Optics};
use rowscan_protocol::scan::Pose;
use rowscan_scenes::optics::{Eye, EyeEcho, EyeModel, OpticsSettings, RangeLimits};
use rowscan_scenes::{BeamFan, Caster, Leaf, Orchard};

/// Height of the scanner's axis: far above the ground.
pub(crate) const HEIGHT_M: f64 = 50.0;

pub(crate) const LIMITS: RangeLimits = RangeLimits { min_range_m: 0.05, max_range_m: 60.0 };

pub(crate) fn optics(model: &str) -> Optics {
    *AnyModel::by_name(model).unwrap().optics()
}

/// The same with echoes of its own for every surface: what shows shares.
pub(crate) fn split(optics: Optics) -> Optics {
    let mut optics = optics;
    optics.pulse.merged_m = Fact::assumed(1e-3);
    optics.pulse.apart_m = Fact::assumed(2e-3);
    optics
}

/// A plate at `x_m` with one straight edge: what lies `beyond_m` and more from the axis along the direction `turn_rad` (0 is +Y) is plate.
pub(crate) fn half_plate(x_m: f64, beyond_m: f64, turn_rad: f64) -> Leaf {
    let (sin, cos) = turn_rad.sin_cos();
    let at = |along: f64, aside: f64| [x_m, along * cos - aside * sin, HEIGHT_M + along * sin + aside * cos];
    let far = beyond_m + 4.0;
    Leaf::new(vec![at(beyond_m, -2.0), at(far, -2.0), at(far, 2.0), at(beyond_m, 2.0)]).unwrap()
}

/// A plate that covers all beams.
pub(crate) fn plate(x_m: f64) -> Leaf {
    let at = |y: f64, z: f64| [x_m, y, HEIGHT_M + z];
    Leaf::new(vec![at(-9.0, -9.0), at(9.0, -9.0), at(9.0, 9.0), at(-9.0, 9.0)]).unwrap()
}

pub(crate) fn caster(plates: Vec<Leaf>) -> Caster {
    Caster::new(&Orchard::from_organs(plates, vec![], f64::INFINITY))
}

/// Beams about +X, `pitch_deg` apart; the middle one is the axis.
pub(crate) fn fan(pitch_deg: f64, beams: usize) -> BeamFan {
    BeamFan::from_degrees(-pitch_deg * (beams / 2) as f64, pitch_deg, beams)
}

pub(crate) struct Bench {
    pub(crate) eye: Eye,
    pub(crate) caster: Caster,
    pub(crate) beams: usize,
}

impl Bench {
    pub(crate) fn new(
        optics: &Optics,
        echoes: u8,
        settings: &OpticsSettings,
        plates: Vec<Leaf>,
        fan: &BeamFan,
    ) -> Self {
        let mut eye = Eye::new(EyeModel { optics, echoes, limits: LIMITS }, settings, 1, 0);
        eye.turn_to(fan, true);
        Self { eye, caster: caster(plates), beams: fan.len() }
    }

    /// All beams of line `scan`.
    pub(crate) fn look(&mut self, scan: u64) -> Vec<Vec<EyeEcho>> {
        let origin = Pose { x_m: 0.0, y_m: 0.0, z_m: HEIGHT_M };
        self.eye.look(&self.caster, origin, 0.0, scan);
        (0..self.beams).map(|beam| self.eye.beam(beam).to_vec()).collect()
    }

    /// The axis' echoes.
    pub(crate) fn axis(&mut self, scan: u64) -> Vec<EyeEcho> {
        self.look(scan).swap_remove(self.beams / 2)
    }
}

pub(crate) fn settings(stages: &str) -> OpticsSettings {
    OpticsSettings { stages: stages.parse().unwrap(), ..OpticsSettings::default() }
}
