//! Orchards as files of other programs, and back: bytes in, bytes out.
//!
//! | format | reads | writes | holds |
//! |---|---|---|---|
//! | text | yes | yes | leaves and branches to the last bit |
//! | OBJ | yes | yes | faces by material, single precision when written |
//! | PLY | yes | yes | likewise, binary when written |
//! | glTF | no | yes | triangles by material, one mesh a distinct tree |

pub mod gltf;
pub mod mesh;
pub mod obj;
pub mod ply;
pub mod text;

use crate::organ::OrganError;
use crate::parameters::FileError;

/// Why a file holds no orchard.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExchangeError {
    /// The file was not read, or is not text.
    #[error(transparent)]
    File(#[from] FileError),
    /// A record of it cannot be used.
    #[error("{path}:{line}: {cause}")]
    Record {
        /// The file.
        path: String,
        /// The line, or the number of the face in a binary file; from 1.
        line: usize,
        /// What is wrong with it.
        cause: OrganRecordError,
    },
    /// It is not in the format that its name says.
    #[error("{path}: {cause}")]
    Format {
        /// The file.
        path: String,
        /// What the reader says.
        cause: String,
    },
}

/// What is wrong with one record.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrganRecordError {
    /// A field is not a number.
    #[error("a number expected, found `{found}`")]
    NotANumber {
        /// The field.
        found: String,
    },
    /// Too few or too many fields.
    #[error("{expected} expected, found {found} fields")]
    Fields {
        /// What a record is made of.
        expected: &'static str,
        /// Fields there.
        found: usize,
    },
    /// A number of a tree out of range.
    #[error("the number of a tree expected, from 0 to {most}, found `{found}`")]
    Tree {
        /// Greatest number.
        most: u32,
        /// The field.
        found: String,
    },
    /// It lies where no tree of an orchard stands.
    #[error(
        "a point within 200 km of the origin and 1000 m of the ground expected, found {found} m; is `scale` right?"
    )]
    TooFar {
        /// The coordinate.
        found: f64,
    },
    /// No organ can be made of it.
    #[error("{0}")]
    Organ(#[from] OrganError),
    /// A leaf that does not lie in a plane, where that is refused.
    #[error(
        "the leaf is not plane: off by {warp:.3} of its size, 0.001 allowed; set not_plane to `triangulate` or `flatten`"
    )]
    NotPlane {
        /// Distance from the plane over the size.
        warp: f64,
    },
    /// An outline that is no simple polygon.
    #[error(
        "the leaf's outline crosses itself, so that it has no one area; give its corners in their order around it, or cut it in two"
    )]
    CrossesItself,
    /// A face names a vertex that is not there.
    #[error("a vertex from 1 to {vertices} expected, or from -1 back, found `{found}`")]
    Index {
        /// Vertices so far.
        vertices: usize,
        /// The field.
        found: String,
    },
    /// A material that is neither leaf nor wood nor anything else.
    #[error("unknown material `{found}`; known are {known}; add it to a list of orchard.import.materials")]
    Material {
        /// The name.
        found: String,
        /// The names that are known.
        known: String,
    },
    /// A face before any material.
    #[error("the face has no material; name one for all such faces in orchard.import.material")]
    NoMaterial,
}

/// Numbers of trees in a file end here.
pub const MOST_TREES: u32 = 1_000_000;
