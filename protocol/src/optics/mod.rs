//! What a scanner's beam and receiver are, as data: spot, echoes, sensitivity, noise, remission. Every number says where it comes from.
//! Scanner models carry one [`Optics`] each; scene simulators act by it; estimators may read it to correct for the spot.

mod fact;

pub use fact::{Fact, Tag};

use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Everything that light does in one scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    /// Wavelength, nm.
    pub wavelength_nm: Fact,
    /// The beam's cross-section.
    pub spot: Spot,
    /// How far the scan plane of a unit may be bent to a cone, degrees either way.
    pub bend_deg: Fact,
    /// How returns become echoes.
    pub pulse: Pulse,
    /// The echo that is reported out of the box.
    pub factory_echo: FactoryEcho,
    /// What its fog filter does where a client has set it (`MSsuppmode`).
    pub fog_filter: FogFilter,
    /// Farthest range of a surface with 10 % remission, metres: what sets the least power that is detected.
    pub range_at_10_percent_m: Fact,
    /// Scatter of the ranges.
    pub noise: Noise,
    /// Nearer than this the receiver sees only part of the spot, metres: remission tells the power times the square of range over this.
    pub near_field_m: Fact,
    /// What the remission values mean.
    pub remission: RemissionCurve,
}

/// The beam's cross-section: a disc of diameter `exit_mm + divergence_mrad · r`, widened in the scan plane by `sweep_mrad · r`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Diameter at the window, mm.
    pub exit_mm: Fact,
    /// Growth of the diameter, mm a metre.
    pub divergence_mrad: Fact,
    /// Angle that the mirror turns through while one value is measured, mrad: a box that the disc is swept over.
    pub sweep_mrad: Fact,
    /// Diameter of a uniform disc that does what recorded edges show, relative to the nominal one.
    pub effective: Fact,
}

impl Spot {
    /// Effective radius across the scan plane at this range, metres.
    pub fn radius_m(&self, range_m: f64) -> f64 {
        0.5e-3 * self.effective.value * (self.exit_mm.value + self.divergence_mrad.value * range_m)
    }

    /// Nominal diameter across the scan plane at this range, metres: the manual's spot.
    pub fn nominal_m(&self, range_m: f64) -> f64 {
        1e-3 * (self.exit_mm.value + self.divergence_mrad.value * range_m)
    }
}

/// Remission of a beam whose receiver is dazzled, on the 16-bit scale: 255 in 8 bits. A strong echo has it beside its range; without a range nothing else does.
pub const DAZZLED: u16 = u16::MAX;

/// What stands for the range of such a beam, mm, as CoLa scanners send it \[ASM\]; an LMS2xx has a code of its own.
pub const DAZZLED_MM: u16 = 1;

/// How returns that are close together become one echo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Returns closer than this are one echo, metres.
    pub merged_m: Fact,
    /// Echoes farther apart than this do not disturb each other, metres.
    pub apart_m: Fact,
}

/// The echo that is reported out of the box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FactoryEcho {
    /// The first.
    First,
    /// All of them.
    All,
    /// The last.
    Last,
}

impl FactoryEcho {
    /// Whether the first echo stands first in its scans, with nothing set.
    pub fn begins_with_first(self) -> bool {
        self != Self::Last
    }
}

/// What a fog filter does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FogFilter {
    /// The scanner has none.
    None,
    /// Small pulses are dropped: less than this share of the spot.
    SmallPulses {
        /// Share of the spot.
        share: Fact,
    },
    /// The least power that is detected rises within a range.
    LeastPower {
        /// By so many times.
        times: Fact,
        /// Out to here, metres.
        within_m: Fact,
    },
}

impl FogFilter {
    /// Least share of the spot that an echo must have.
    pub fn least_share(&self) -> f64 {
        if let Self::SmallPulses { share } = self { share.value } else { 0.0 }
    }

    /// How many times the least power an echo at this range must have.
    pub fn times_least_power(&self, range_m: f64) -> f64 {
        match self {
            Self::LeastPower { times, within_m } if range_m < within_m.value => times.value,
            _ => 1.0,
        }
    }
}

/// Scatter of the ranges, 1 σ: σ² = `sigma_mm²` + `weak_sigma_mm²` · least power / power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// With power to spare, mm.
    pub sigma_mm: Fact,
    /// Added where the power is the least that is detected, mm.
    pub weak_sigma_mm: Fact,
    /// With power to spare nearer than 0.5 m, mm.
    pub near_sigma_mm: Fact,
    /// Typical value of the data sheet, mm.
    pub sheet_sigma_mm: Fact,
    /// How values scatter.
    pub shape: NoiseShape,
    /// Fixed pattern over the beams, mm.
    pub pattern_mm: Fact,
    /// Bound of the systematic error, mm: a unit's curve over range stays within half of it.
    pub systematic_mm: Fact,
    /// Extra scatter on slanted surfaces, mrad: times range and tangent of the incidence.
    pub slant_mrad: Fact,
}

/// How values scatter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseShape {
    /// Normal; recorded kurtosis 2.9 to 3.0.
    Normal,
    /// A uniform and a normal part, kurtosis 2.4, as recorded on an LMS111.
    Flat,
}

/// What the remission values mean. All of it assumed from a few recorded surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RemissionCurve {
    /// 8 bits: 1 at the least power that is detected, so many digits a factor of ten; 255 is dazzled.
    Logarithmic {
        /// Digits a factor of ten in power.
        digits_a_decade: Fact,
        /// Scatter from shot to shot, digits.
        sigma_digits: Fact,
    },
    /// 16 bits: `at_half` digits at half the power of a white wall at 1 m, and a power law; 65535 is dazzled.
    Compressed {
        /// Digits at half the power of a white wall at 1 m.
        at_half: Fact,
        /// Of the power law.
        exponent: Fact,
        /// Scatter from shot to shot, relative.
        sigma: Fact,
    },
}

impl Optics {
    /// Least power that is detected, relative to a white wall at 1 m, square on.
    pub fn least_power(&self) -> f64 {
        0.10 / (self.range_at_10_percent_m.value * self.range_at_10_percent_m.value)
    }

    /// Every number with its name, unit and tag, for lists.
    pub fn lines(&self) -> Vec<(&'static str, String)> {
        let Self { spot, pulse, noise, .. } = self;
        let mut lines: Vec<(&'static str, String)> = [
            ("wavelength_nm", self.wavelength_nm),
            ("spot at the window, mm", spot.exit_mm),
            ("spot growth, mm/m", spot.divergence_mrad),
            ("sweep in the plane, mm/m", spot.sweep_mrad),
            ("effective / nominal spot", spot.effective),
            ("bend of the scan plane within, deg", self.bend_deg),
            ("one echo below, m", pulse.merged_m),
            ("echoes apart from, m", pulse.apart_m),
            ("range at 10 %, m", self.range_at_10_percent_m),
            ("remission falls nearer than, m", self.near_field_m),
            ("sigma, mm", noise.sigma_mm),
            ("sigma added at least power, mm", noise.weak_sigma_mm),
            ("sigma below 0.5 m, mm", noise.near_sigma_mm),
            ("sigma by data sheet, mm", noise.sheet_sigma_mm),
            ("fixed pattern, mm", noise.pattern_mm),
            ("systematic error within, mm", noise.systematic_mm),
            ("slant, mrad", noise.slant_mrad),
        ]
        .map(|(name, fact)| (name, fact.to_string()))
        .into();
        match self.fog_filter {
            FogFilter::None => {}
            FogFilter::SmallPulses { share } => {
                lines.push(("fog filter: least share of the spot", share.to_string()))
            }
            FogFilter::LeastPower { times, within_m } => {
                lines.push(("fog filter: least power, times", times.to_string()));
                lines.push(("fog filter: out to, m", within_m.to_string()));
            }
        }
        match self.remission {
            RemissionCurve::Logarithmic { digits_a_decade, sigma_digits } => {
                lines.push(("remission sigma, digits", sigma_digits.to_string()));
                lines.push(("remission, digits a decade", digits_a_decade.to_string()));
            }
            RemissionCurve::Compressed { at_half, exponent, sigma } => {
                lines.push(("remission sigma, relative", sigma.to_string()));
                lines.push(("remission at half a white wall at 1 m, digits", at_half.to_string()));
                lines.push(("remission exponent", exponent.to_string()));
            }
        }
        lines
    }
}
