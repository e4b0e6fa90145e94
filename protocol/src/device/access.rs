//! What commands know and change of their connection.

use core::time::Duration;

use super::event::Subscriptions;
use crate::frame::Dialect;

/// What commands know and change of their connection.
#[derive(Clone, Debug)]
pub(super) struct Access {
    /// User level, 1 = nobody logged in.
    pub(super) level: u8,
    pub(super) dialect: Dialect,
    /// Dialect after the reply that is being made.
    pub(super) next_dialect: Option<Dialect>,
    /// The connection is dropped after the reply that is being made.
    pub(super) closing: bool,
    /// How long the reply takes that is being made.
    pub(super) delay: Duration,
    pub(super) subscriptions: Subscriptions,
}

impl Access {
    /// Nobody logged in.
    pub(super) fn new(dialect: Dialect) -> Self {
        Self {
            level: 1,
            dialect,
            next_dialect: None,
            closing: false,
            delay: Duration::ZERO,
            subscriptions: Subscriptions::default(),
        }
    }
}
