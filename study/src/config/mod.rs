//! Files and names a user hands in: scenes, rigs, calibrations.

mod scene;
mod strict;

pub use scene::{
    ConfigError, fill, load_calibration, load_calibration_for, load_rig, load_scene, nearest, scene_from_text,
};
pub use strict::{Trouble, from_toml};
