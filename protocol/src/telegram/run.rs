//! `Run`: log out and measure.

use super::Method;
use super::wire::fields;

fields! {
    /// Back to user level 1.
    pub struct Run {
    }
}

impl Method for Run {
    const NAME: &'static str = "Run";
    type Reply = bool;
}
