//! Our kernels beside well-kept peers: same scenes, same process, runs interleaved.

pub mod beside;
pub mod caster;
pub mod codec;
#[cfg(target_os = "linux")]
pub mod fleet;
pub mod hectare;
#[cfg(target_os = "linux")]
pub mod lockstep;
#[cfg(target_os = "linux")]
pub mod lockstep_reader;
pub mod loopback;
pub mod measure;
pub mod optics;
pub mod peer;
pub mod proxy;
#[cfg(target_os = "linux")]
pub mod replay;
pub mod row;
pub mod shady;
pub mod sprayer;
#[cfg(target_os = "linux")]
pub mod web;
