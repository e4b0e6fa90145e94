//! Why a telegram gives no scan.

use crate::telegram::NoDistance;
use crate::telegram::wire::WireError;

/// Why a scan telegram gives no scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum ScanError {
    /// Its fields cannot be read.
    #[error("scan telegram: {0}")]
    Wire(#[from] WireError),
    /// It has no ranges.
    #[error(transparent)]
    NoDistance(#[from] NoDistance),
}
