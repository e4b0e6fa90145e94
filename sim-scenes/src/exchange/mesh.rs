//! Orchards as faces with materials: what OBJ, PLY and glTF have in common.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::growth::rotation::square_to;
use crate::orchard::grown::Orchard;
use crate::organ::{Cylinder, Surface, Tree};
use crate::parameters::choices;
use crate::support::SupportKind;

choices! {
    /// What a face is made of. The names are those of the materials in written files.
    pub enum Material {
        /// A leaf blade.
        Leaf = "leaf",
        /// Bark.
        Wood = "wood",
        /// A fruit.
        Fruit = "fruit",
        /// A post.
        Post = "post",
        /// A wire.
        Wire = "wire",
        /// Soil.
        Soil = "soil",
        /// Grass and weeds.
        Grass = "grass",
    }
}

impl Material {
    /// The surface of a facet of this material; None for a leaf.
    pub fn surface(self) -> Option<Surface> {
        match self {
            Self::Leaf => None,
            Self::Wood => Some(Surface::Bark),
            Self::Fruit => Some(Surface::Fruit),
            Self::Post => Some(Surface::Post),
            Self::Wire => Some(Surface::Wire),
            Self::Soil => Some(Surface::Soil),
            Self::Grass => Some(Surface::Grass),
        }
    }

    /// The material of a surface.
    pub fn of_surface(surface: Surface) -> Self {
        match surface {
            Surface::Bark => Self::Wood,
            Surface::Fruit => Self::Fruit,
            Surface::Post => Self::Post,
            Surface::Wire => Self::Wire,
            Surface::Soil => Self::Soil,
            Surface::Grass => Self::Grass,
        }
    }

    /// Colour in drawings and in files that have colours: red, green, blue.
    pub fn rgb(self) -> [u8; 3] {
        match self {
            Self::Leaf => [86, 140, 58],
            Self::Wood => [110, 82, 58],
            Self::Fruit => [196, 52, 44],
            Self::Post => [120, 120, 120],
            Self::Wire => [60, 80, 140],
            Self::Soil => [150, 120, 90],
            Self::Grass => [150, 170, 80],
        }
    }
}

/// Names by which materials of foreign files are known, without regard to case. A name stands for every material that begins with it,
/// such as `leaf` for `Leaf.001`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialNames {
    /// Leaf blades.
    pub leaf: Vec<String>,
    /// Trunk and branches.
    pub wood: Vec<String>,
    /// Fruit.
    pub fruit: Vec<String>,
    /// Posts.
    pub post: Vec<String>,
    /// Wires.
    pub wire: Vec<String>,
    /// Soil.
    pub soil: Vec<String>,
    /// Grass and weeds.
    pub grass: Vec<String>,
    /// What is left out.
    pub ignore: Vec<String>,
}

impl Default for MaterialNames {
    fn default() -> Self {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Self {
            leaf: names(&["leaf", "leaves", "foliage"]),
            wood: names(&["wood", "bark", "trunk", "branch", "stem", "twig"]),
            fruit: names(&["fruit", "apple"]),
            post: names(&["post", "stake"]),
            wire: names(&["wire"]),
            soil: names(&["soil", "ground", "terrain"]),
            grass: names(&["grass", "weed"]),
            ignore: Vec::new(),
        }
    }
}

impl MaterialNames {
    /// The material of a name: None for an unknown one, `Some(None)` for one that is left out. The longest name that fits decides.
    pub fn material(&self, name: &str) -> Option<Option<Material>> {
        let name = name.to_lowercase();
        let fits = |known: &String| !known.is_empty() && name.starts_with(&known.to_lowercase());
        let best = self.lists().into_iter().flat_map(|(names, material)| {
            names.iter().filter(|known| fits(known)).map(move |known| (known.len(), material))
        });
        best.max_by_key(|(length, _)| *length).map(|(_, material)| material)
    }

    /// All names, for messages.
    pub fn known(&self) -> String {
        let all: Vec<&str> =
            self.lists().into_iter().flat_map(|(names, _)| names.iter().map(String::as_str)).collect();
        all.join(", ")
    }

    fn lists(&self) -> [(&Vec<String>, Option<Material>); 8] {
        [
            (&self.leaf, Some(Material::Leaf)),
            (&self.wood, Some(Material::Wood)),
            (&self.fruit, Some(Material::Fruit)),
            (&self.post, Some(Material::Post)),
            (&self.wire, Some(Material::Wire)),
            (&self.soil, Some(Material::Soil)),
            (&self.grass, Some(Material::Grass)),
            (&self.ignore, None),
        ]
    }
}

/// A face of a foreign file.
#[derive(Clone, Debug, PartialEq)]
pub struct RawFace {
    /// Number of the tree, 0 where the file has none.
    pub tree: u32,
    /// Line, or number of the face; from 1.
    pub line: usize,
    /// Name of its material; None where it has none.
    pub material: Option<String>,
    /// Its vertices, as the file has them.
    pub outline: Vec<[f64; 3]>,
}

/// A face to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// What it is made of.
    pub material: Material,
    /// Its vertices, metres.
    pub outline: Vec<[f64; 3]>,
}

/// Sides of the prism that stands for a cylinder.
const SIDES: u32 = 8;

/// The faces of a tree, leaf by leaf, then wood as open prisms of the cylinders' lateral area, then facets.
pub fn faces_of_tree(tree: &Tree) -> Vec<Face> {
    let leaves =
        tree.leaves.iter().map(|leaf| Face { material: Material::Leaf, outline: leaf.outline().to_vec() });
    let wood = tree.wood.iter().flat_map(|piece| prism(piece, Material::Wood));
    let facets = tree.facets.iter().map(|facet| Face {
        material: Material::of_surface(facet.surface),
        outline: facet.polygon.outline().to_vec(),
    });
    leaves.chain(wood).chain(facets).collect()
}

/// The faces of posts, wires, soil and grass.
pub fn faces_of_supports(orchard: &Orchard) -> Vec<Face> {
    let material = |kind| match kind {
        SupportKind::Post => Material::Post,
        SupportKind::Wire => Material::Wire,
    };
    let built = orchard.supports().iter().flat_map(|support| prism(&support.shape, material(support.kind)));
    let ground = orchard.ground().facets.iter().map(|facet| Face {
        material: Material::of_surface(facet.surface),
        outline: facet.polygon.outline().to_vec(),
    });
    built.chain(ground).collect()
}

/// The sides of a prism about a cylinder's axis, as wide around as the cylinder, so that its area is kept.
fn prism(piece: &Cylinder, material: Material) -> impl Iterator<Item = Face> + use<> {
    let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
    let axis = (tip - base).normalize_or_zero();
    let (u, v) = (square_to(axis), axis.cross(square_to(axis)));
    let half = PI / f64::from(SIDES);
    let radius_m = piece.radius_m() * half / libm::sin(half);
    let rim = move |k: u32| {
        let angle = TAU * f64::from(k % SIDES) / f64::from(SIDES);
        (u * libm::cos(angle) + v * libm::sin(angle)) * radius_m
    };
    (0..SIDES).map(move |k| {
        let corners = [base + rim(k), base + rim(k + 1), tip + rim(k + 1), tip + rim(k)];
        Face { material, outline: corners.iter().map(DVec3::to_array).collect() }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::organ::Leaf;

    #[test]
    fn a_prism_keeps_the_lateral_area() {
        let piece = Cylinder::new([1.0, 2.0, 0.0], [1.5, 2.0, 2.0], 0.04).unwrap();
        let faces: Vec<Face> = prism(&piece, Material::Wood).collect();
        let area: f64 = faces.iter().map(|face| Leaf::new(face.outline.clone()).unwrap().area_m2()).sum();
        assert_eq!(faces.len(), 8);
        assert!((area - piece.area_m2()).abs() < 1e-12, "{area}");
    }

    #[test]
    fn materials_are_known_by_their_beginnings() {
        let mut names = MaterialNames::default();
        assert_eq!(names.material("Leaf.001"), Some(Some(Material::Leaf)));
        assert_eq!(names.material("BarkOld"), Some(Some(Material::Wood)));
        assert_eq!(names.material("concrete"), None);
        names.ignore.push("leaf_shadow".into());
        assert_eq!(names.material("leaf_shadow2"), Some(None));
        assert!(names.known().contains("foliage, wood"));
    }
}
