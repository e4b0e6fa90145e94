//! What a scene says about files of trees.

use serde::{Deserialize, Serialize};

use crate::exchange::mesh::{Material, MaterialNames};
use crate::parameters::{ParameterError, SceneFile, choices, require};

choices! {
    /// Which axis of a mesh points up.
    pub enum UpAxis {
        /// Z, as here.
        Z = "z",
        /// Y: (x, y, z) of the file is (x, −z, y) here.
        Y = "y",
    }
}

choices! {
    /// What becomes of a leaf that lies off its plane by more than a thousandth of its size.
    pub enum NotPlane {
        /// It is cut into triangles: about its first vertex, and where it has a hollow there, ear by ear.
        Triangulate = "triangulate",
        /// It is pressed into its mean plane.
        Flatten = "flatten",
        /// It is refused.
        Refuse = "refuse",
    }
}

choices! {
    /// Where the trees of the files stand.
    pub enum Stands {
        /// At the origin: tree k of them grows at place k, and from the first again when they are used up.
        AtOrigin = "at_origin",
        /// Where the files say, tree k counting as that of place k.
        InPlace = "in_place",
    }
}

/// The `[orchard.import]` table of a scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ImportParameters {
    /// Branches as text: `x1 y1 z1 x2 y2 z2 diameter` a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"branches.txt")]
    pub branches: Option<SceneFile>,
    /// Leaves as text: `n x1 y1 z1 … xn yn zn` a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"leaves.txt")]
    pub leaves: Option<SceneFile>,
    /// A mesh: a file whose name ends in `.obj` or `.ply`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"trees.obj")]
    pub mesh: Option<SceneFile>,
    /// Where the trees stand.
    pub stands: Stands,
    /// Which axis of the files points up.
    pub up: UpAxis,
    /// Metres of one unit of the files.
    pub scale: f64,
    /// What to do with leaves that are not plane.
    pub not_plane: NotPlane,
    /// Material of faces that have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(example = &"leaf")]
    pub material: Option<Material>,
    /// Names of materials.
    pub materials: MaterialNames,
}

impl Default for ImportParameters {
    fn default() -> Self {
        Self {
            branches: None,
            leaves: None,
            mesh: None,
            stands: Stands::AtOrigin,
            up: UpAxis::Z,
            scale: 1.0,
            not_plane: NotPlane::Triangulate,
            material: None,
            materials: MaterialNames::default(),
        }
    }
}

/// How far a leaf may lie off its plane, over its size.
pub const PLANE_TOLERANCE: f64 = 1e-3;

impl ImportParameters {
    /// Refuses what names no trees.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let any = self.branches.is_some() || self.leaves.is_some() || self.mesh.is_some();
        let expected = "at least one of branches, leaves, mesh";
        require(any, "orchard.import", expected, "none of them")?;
        let scale = self.scale.is_finite() && self.scale > 0.0;
        require(scale, "orchard.import.scale", "a positive number of metres", self.scale)?;
        let known = self.mesh.as_ref().is_none_or(|mesh| MeshFormat::of(mesh.path()).is_some());
        let path = self.mesh.as_ref().map_or("", SceneFile::path);
        require(known, "orchard.import.mesh", "a file whose name ends in .obj or .ply", path)
    }

    /// The files it names.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut SceneFile> {
        [self.branches.as_mut(), self.leaves.as_mut(), self.mesh.as_mut()].into_iter().flatten()
    }

    /// A point of the files in the scene's axes and metres.
    pub(super) fn point(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let turned = match self.up {
            UpAxis::Z => [x, y, z],
            UpAxis::Y => [x, -z, y],
        };
        if self.scale == 1.0 { turned } else { turned.map(|c| c * self.scale) }
    }
}

/// A kind of mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MeshFormat {
    Obj,
    Ply,
}

impl MeshFormat {
    /// By the ending of a file's name.
    pub(super) fn of(path: &str) -> Option<Self> {
        let ending = path.rsplit_once('.')?.1.to_lowercase();
        match ending.as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }
}
