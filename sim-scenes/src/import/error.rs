//! Why files cannot be imported as an orchard.

use crate::exchange::ExchangeError;

/// Why files hold no orchard.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file.
    #[error(transparent)]
    Exchange(#[from] ExchangeError),
    /// More trees than places.
    #[error(
        "the files hold a tree number {found}, the orchard has {places} places; raise orchard.trees or orchard.rows"
    )]
    Places {
        /// Greatest number in the files.
        found: u32,
        /// Places of the orchard.
        places: u32,
    },
}
