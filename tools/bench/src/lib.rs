//! Our kernels beside well-kept peers: same scenes, same process, runs interleaved.

pub mod caster;
pub mod measure;
pub mod peer;
pub mod row;
pub mod shady;
