//! `mSCreboot`: restart; the connection drops after the answer.

use super::Method;
use super::wire::fields;

fields! {
    /// Restart.
    pub struct Reboot {
    }
}

impl Method for Reboot {
    const NAME: &'static str = "mSCreboot";
    type Reply = ();
}
