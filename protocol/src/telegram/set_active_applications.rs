//! `SetActiveApplications`: ranging and field evaluation on and off.

use alloc::vec::Vec;

use super::Variable;
use super::wire::{FixedText, fields};

fields! {
    /// Applications to switch.
    pub struct ActiveApplications {
        /// Which, and whether on.
        pub applications: Vec<Application>,
    }

    /// One application.
    pub struct Application {
        /// `RANG` ranging, `FEVL` field evaluation.
        pub name: FixedText<4>,
        /// On.
        pub active: bool,
    }
}

impl Variable for ActiveApplications {
    const NAME: &'static str = "SetActiveApplications";
}
