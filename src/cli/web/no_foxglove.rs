//! No server for Foxglove and Lichtblick: a build without the feature `foxglove`.

use std::net::SocketAddr;

use rowscan_web::Show;

use crate::feature::{Feature, MissingFeature};

/// There is none.
#[derive(Debug)]
pub(super) enum FoxgloveServer {}

impl FoxgloveServer {
    pub(super) async fn open(_: SocketAddr, _: &Show) -> Result<Self, MissingFeature> {
        Err(Feature::Foxglove.missing("a server for Foxglove"))
    }

    pub(super) fn address(&self) -> SocketAddr {
        match *self {}
    }

    pub(super) async fn close(self) {
        match self {}
    }
}
