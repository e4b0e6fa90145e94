//! How a tree grows: a hidden Markov tree after Méndez et al. (2013).
//!
//! One season after the other every live axis draws a state ([`markov`]); a rule table ([`rules`]) says whether the draw
//! extends the axis or ends it in a fork. The growth units that result are laid out in space ([`skeleton`]), clothed with
//! leaves ([`foliage`]), thickened by the pipe model, thinned where too shaded ([`shade`]) and pruned to the envelope of the
//! orchard; those last three are the same for trees of other generators. [`TreeParameters::table`] lists every choice with its reason.

pub mod foliage;
pub(crate) mod fruit;
pub(crate) mod hmt;
pub mod internodes;
pub mod leaf_angle;
pub mod markov;
pub mod options;
mod parameters;
pub(crate) mod prune;
pub(crate) mod rotation;
pub mod rules;
pub mod shade;
pub mod skeleton;
pub(crate) mod wood;

pub use internodes::InternodeSource;
pub use markov::{BranchingSource, MatrixSource, State};
pub use options::LeafLifetime;
pub use parameters::{TreeOverrides, TreeParameters};
pub use rules::RuleSource;
