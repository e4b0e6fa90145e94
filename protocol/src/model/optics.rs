//! What light does in the CoLa scanners. S1 to S14 are documents: docs/optics.md lists them.

use crate::optics::{Fact, FactoryEcho, FogFilter, Noise, NoiseShape, Optics, Pulse, RemissionCurve, Spot};

/// Gaps of 0.36 to 0.81 m were recorded as one blended range, gaps of 1.56 and 1.61 m as two with a trace of each other.
pub(crate) const PULSE: Pulse = Pulse { merged_m: Fact::assumed(1.0), apart_m: Fact::assumed(2.0) };

/// Six recorded edges: 0.90 ± 0.08 of the nominal diameter.
pub(crate) const EFFECTIVE: Fact = Fact::recorded(0.9);

/// Recorded remission rises out to there, though power falls.
pub(crate) const NEAR_FIELD: Fact = Fact::assumed(1.5);

pub(super) const LMS1XX: Optics = Optics {
    wavelength_nm: Fact::memory(905.0),
    spot: Spot {
        exit_mm: Fact::from("S1 p.28", 8.0),
        divergence_mrad: Fact::from("S1 p.28", 15.0),
        sweep_mrad: Fact::assumed(0.0),
        effective: EFFECTIVE,
    },
    bend_deg: Fact::assumed(0.0),
    pulse: PULSE,
    factory_echo: FactoryEcho::All,
    // 6 % of a pulse's length, taken as 6 % of the spot.
    fog_filter: FogFilter::SmallPulses { share: Fact::from("S11", 0.06) },
    range_at_10_percent_m: Fact::memory(18.0),
    noise: Noise {
        sigma_mm: Fact::recorded(8.3),
        weak_sigma_mm: Fact::derived(18.0),
        near_sigma_mm: Fact::recorded(6.0),
        sheet_sigma_mm: Fact::from("S4", 12.0),
        shape: NoiseShape::Flat,
        pattern_mm: Fact::recorded(1.1),
        systematic_mm: Fact::from("S4", 30.0),
        slant_mrad: Fact::recorded(0.0),
    },
    near_field_m: NEAR_FIELD,
    remission: RemissionCurve::Logarithmic {
        digits_a_decade: Fact::assumed(60.0),
        sigma_digits: Fact::recorded(2.6),
    },
};

/// Standard resolution: LMS511-10100.
pub(super) const LMS5XX: Optics = Optics {
    spot: Spot {
        exit_mm: Fact::from("S2 p.23", 13.6),
        divergence_mrad: Fact::from("S2 p.23", 11.9),
        ..LMS1XX.spot
    },
    factory_echo: FactoryEcho::Last,
    // Level 3 of 6, the standard: 2 to the level.
    fog_filter: FogFilter::LeastPower { times: Fact::assumed(8.0), within_m: Fact::from("S11", 16.0) },
    range_at_10_percent_m: Fact::memory(40.0),
    noise: Noise {
        sigma_mm: Fact::recorded(3.6),
        weak_sigma_mm: Fact::derived(54.0),
        near_sigma_mm: Fact::assumed(3.6),
        sheet_sigma_mm: Fact::from("S4", 6.0),
        shape: NoiseShape::Normal,
        pattern_mm: Fact::recorded(0.9),
        systematic_mm: Fact::from("S4", 25.0),
        slant_mrad: Fact::derived(0.5),
    },
    ..LMS1XX
};

/// High resolution: the indoor LMS500 and the Lite.
pub(super) const LMS5XX_HR: Optics = Optics {
    spot: Spot {
        exit_mm: Fact::from("S3 p.22", 13.0),
        divergence_mrad: Fact::from("S3 p.22", 4.6),
        ..LMS1XX.spot
    },
    range_at_10_percent_m: Fact::memory(26.0),
    noise: Noise { sheet_sigma_mm: Fact::from("S4", 7.0), ..LMS5XX.noise },
    ..LMS5XX
};

/// TiM with steps of 0.33°.
pub(super) const TIM: Optics = Optics {
    wavelength_nm: Fact::from("S6", 850.0),
    spot: Spot {
        exit_mm: Fact::from("S5", 7.0),
        divergence_mrad: Fact::from("S5", 8.6),
        sweep_mrad: Fact::from("S5", 5.8),
        effective: EFFECTIVE,
    },
    bend_deg: Fact::from("S6", 3.0),
    factory_echo: FactoryEcho::First,
    fog_filter: FogFilter::None,
    range_at_10_percent_m: Fact::from("S10", 8.0),
    noise: Noise {
        sigma_mm: Fact::recorded(11.3),
        weak_sigma_mm: Fact::derived(16.5),
        near_sigma_mm: Fact::assumed(11.3),
        sheet_sigma_mm: Fact::from("S6", 20.0),
        shape: NoiseShape::Normal,
        pattern_mm: Fact::recorded(1.8),
        systematic_mm: Fact::from("S6", 60.0),
        slant_mrad: Fact::recorded(7.7),
    },
    near_field_m: NEAR_FIELD,
    remission: RemissionCurve::Compressed {
        at_half: Fact::recorded(13_000.0),
        exponent: Fact::recorded(0.11),
        sigma: Fact::recorded(0.012),
    },
    ..LMS1XX
};

/// Of an MRS1000 neither.
pub(super) const MRS1000: Optics = PICOSCAN;

/// Nor of an LMS1000.
pub(super) const LMS1000: Optics = PICOSCAN;

/// Of a picoScan no public measurement was at hand: an LMS1xx's numbers, all of them assumed.
pub(super) const PICOSCAN: Optics = Optics {
    wavelength_nm: Fact::assumed(905.0),
    spot: Spot {
        exit_mm: Fact::assumed(8.0),
        divergence_mrad: Fact::assumed(15.0),
        sweep_mrad: Fact::assumed(0.0),
        effective: Fact::assumed(EFFECTIVE.value),
    },
    fog_filter: FogFilter::None,
    range_at_10_percent_m: Fact::assumed(18.0),
    noise: Noise {
        sigma_mm: Fact::assumed(8.3),
        weak_sigma_mm: Fact::assumed(18.0),
        near_sigma_mm: Fact::assumed(6.0),
        sheet_sigma_mm: Fact::assumed(12.0),
        shape: NoiseShape::Flat,
        pattern_mm: Fact::assumed(1.1),
        systematic_mm: Fact::assumed(30.0),
        slant_mrad: Fact::assumed(0.0),
    },
    remission: RemissionCurve::Logarithmic {
        digits_a_decade: Fact::assumed(60.0),
        sigma_digits: Fact::assumed(2.6),
    },
    ..LMS1XX
};
