//! Telegrams: commands with typed fields. One file a telegram, named as the manual names the command.

mod kind;
mod lmd_scandata;
mod sopas_error;

pub use kind::Kind;
pub use lmd_scandata::{
    Channel, ChannelName, DateTime, Encoder, EventInfo, LmdScandata, NoDistance, Position,
};
pub use sopas_error::SopasError;
