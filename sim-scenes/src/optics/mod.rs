//! From what beams meet to what a scanner measures.
//!
//! [`measure`] is the ideal scanner: a beam without width, the first surface, no noise. [`Eye`] sees as a device does, stage by stage
//! ([`Stage`]): the spot's footprint, echoes, energy, noise, air. Every stage is seeded and can be switched on alone. Formulas and their
//! sources are in docs/optics.md, the numbers of each scanner in [`rowscan_protocol::optics`].

mod air;
mod casts;
mod draws;
mod echo;
mod energy;
mod eye;
mod footprint;
mod groups;
mod ideal;
mod noise;
mod normal;
mod parts;
mod rays;
mod settings;
mod spot;
mod stage;
mod swept;
mod touch;
mod waveform;

pub use air::{
    Air, BACKSCATTER_SR, DUST_BACKSCATTER_SR, FlowChange, Moment, Plume, Source, Sun, WindowSector,
};
pub use casts::EyeCaster;
pub use energy::Reflectance;
pub use eye::{Eye, EyeEcho, EyeModel};
pub use ideal::{NO_ECHO_MM, RangeLimits, measure, remission};
pub use settings::{Blend, NoiseLevel, OpticsSettings};
pub use stage::{Stage, StageInfo, Stages, StagesError};
