//! `ScanLayerFilter`: which layers of a scanner with several are sent.

use alloc::vec::Vec;

use super::Variable;
use super::wire::fields;

fields! {
    /// Layers on and off, from the lowest to the highest.
    pub struct ScanLayerFilter {
        /// One a layer.
        pub layers: Vec<bool>,
    }
}

impl Variable for ScanLayerFilter {
    const NAME: &'static str = "ScanLayerFilter";
}
