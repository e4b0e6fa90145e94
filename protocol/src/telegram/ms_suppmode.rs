//! `MSsuppmode`: what the receiver suppresses before it forms echoes, the fog filter.

use super::Variable;
use super::wire::fields;

fields! {
    /// Suppression: 0 glitches only, 1 fog too. Name and codes as in acfr/snark, sick-lms protocol header; the answer's layout is assumed.
    #[derive(Copy)]
    pub struct SuppressionMode {
        /// The code.
        pub code: u8,
    }
}

impl Variable for SuppressionMode {
    const NAME: &'static str = "MSsuppmode";
}

/// Glitches only.
pub const GLITCH: u8 = 0;
/// Fog, too: weak echoes are suppressed.
pub const FOG: u8 = 1;
