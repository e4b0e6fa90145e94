//! `LFPmeanfilter`, `LFPmedianfilter`, `LFPparticle`: filters over ranges inside the device.

use super::Variable;
use super::wire::fields;

fields! {
    /// Mean of several scans.
    #[derive(Copy)]
    pub struct MeanFilter {
        /// On.
        pub active: bool,
        /// Scans a mean is made of.
        pub scans: u16,
        /// Always 0.
        pub reserved: u8,
    }

    /// Median of neighbouring beams. Binary layout not verified.
    #[derive(Copy)]
    pub struct MedianFilter {
        /// On.
        pub active: bool,
        /// Beams a median is made of.
        pub beams: u16,
    }

    /// Takes away single beams that stand in front of their neighbours. Binary layout not verified.
    #[derive(Copy)]
    pub struct ParticleFilter {
        /// On.
        pub active: bool,
        /// How far in front, millimetres.
        pub threshold_mm: u16 ["mm"],
    }
}

impl Variable for MeanFilter {
    const NAME: &'static str = "LFPmeanfilter";
}

impl Variable for MedianFilter {
    const NAME: &'static str = "LFPmedianfilter";
}

impl Variable for ParticleFilter {
    const NAME: &'static str = "LFPparticle";
}
