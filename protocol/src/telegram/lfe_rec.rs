//! `LFErec`: field evaluation results. Scanners here have no fields to evaluate; the body is not taken apart.

use super::Variable;
use super::wire::{Opaque, fields};

fields! {
    /// Field evaluation results.
    pub struct FieldResults {
        /// The body.
        pub body: Opaque,
    }
}

impl Variable for FieldResults {
    const NAME: &'static str = "LFErec";
}
