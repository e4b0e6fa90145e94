//! `mEEwriteall`: keep the settings over a restart.

use super::Method;
use super::wire::fields;

fields! {
    /// Save all settings.
    pub struct WriteAll {
    }
}

impl Method for WriteAll {
    const NAME: &'static str = "mEEwriteall";
    type Reply = bool;
}
