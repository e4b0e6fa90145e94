//! The command line over the virtual scanner, its driver and its canopy estimator.

pub mod cli;
pub mod decode;
pub mod export;
pub mod feature;
pub mod reference;
