//! A server for Foxglove and Lichtblick.

pub(super) use rowscan_web::foxglove::FoxgloveServer;
