//! What light does in the LMS2xx. "TD" is the technical description as quoted in the listing's notes; S8 is listed in docs/optics.md.

use crate::model::optics::{EFFECTIVE, NEAR_FIELD, PULSE};
use crate::optics::{Fact, FactoryEcho, FogFilter, Noise, NoiseShape, Optics, RemissionCurve, Spot};

/// LMS200: indoor. The first return wins.
pub(super) const INDOOR: Optics = Optics {
    wavelength_nm: Fact::from("S8", 905.0),
    spot: Spot {
        exit_mm: Fact::from("TD p.114", 12.0),
        divergence_mrad: Fact::from("TD p.114", 4.4),
        sweep_mrad: Fact::assumed(0.0),
        effective: EFFECTIVE,
    },
    bend_deg: Fact::assumed(0.0),
    pulse: PULSE,
    factory_echo: FactoryEcho::First,
    fog_filter: FogFilter::None,
    range_at_10_percent_m: Fact::memory(10.0),
    noise: Noise {
        sigma_mm: Fact::recorded(4.3),
        weak_sigma_mm: Fact::assumed(2.5),
        near_sigma_mm: Fact::assumed(4.3),
        sheet_sigma_mm: Fact::from("TD", 5.0),
        shape: NoiseShape::Normal,
        pattern_mm: Fact::assumed(1.0),
        systematic_mm: Fact::from("TD", 15.0),
        slant_mrad: Fact::assumed(0.5),
    },
    near_field_m: NEAR_FIELD,
    remission: RemissionCurve::Logarithmic {
        digits_a_decade: Fact::assumed(60.0),
        sigma_digits: Fact::assumed(2.6),
    },
};

/// LMS211, LMS221, LMS291: outdoor.
pub(super) const OUTDOOR: Optics = Optics {
    spot: Spot {
        exit_mm: Fact::from("TD p.114", 16.0),
        divergence_mrad: Fact::from("TD p.114", 11.9),
        ..INDOOR.spot
    },
    range_at_10_percent_m: Fact::memory(30.0),
    noise: Noise {
        sigma_mm: Fact::from("TD", 10.0),
        near_sigma_mm: Fact::assumed(10.0),
        sheet_sigma_mm: Fact::from("TD", 10.0),
        systematic_mm: Fact::from("TD", 35.0),
        ..INDOOR.noise
    },
    ..INDOOR
};
