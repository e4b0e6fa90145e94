//! What an orchard is made of: leaves (plane polygons), wood (finite cylinders), trees that own them.

use glam::DVec3;

use crate::placement::Placement;
use crate::polygon;

/// One leaf blade: a plane, simple, closed polygon. It need not be convex.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaf {
    outline: Box<[[f64; 3]]>,
    normal: [f64; 3],
    area_m2: f64,
}

impl Leaf {
    /// A leaf from its outline (metres, scene frame; the last vertex joins the first).
    ///
    /// # Errors
    /// Fewer than three vertices, a coordinate that is not a number, or an outline that encloses no area.
    pub fn new(outline: impl Into<Box<[[f64; 3]]>>) -> Result<Self, OrganError> {
        let outline = outline.into();
        if outline.len() < 3 {
            return Err(OrganError::TooFewVertices { found: outline.len() });
        }
        if outline.iter().flatten().any(|c| !c.is_finite()) {
            return Err(OrganError::NotFinite);
        }
        let vector_area = polygon::vector_area(&outline);
        let area_m2 = vector_area.length();
        match vector_area.try_normalize() {
            Some(normal) if area_m2 > 0.0 => Ok(Self { outline, normal: normal.to_array(), area_m2 }),
            _ => Err(OrganError::NoArea),
        }
    }

    /// The vertices in order, metres.
    pub fn outline(&self) -> &[[f64; 3]] {
        &self.outline
    }

    /// Unit normal; right-handed about the outline.
    pub fn normal(&self) -> [f64; 3] {
        self.normal
    }

    /// One-sided area, m², computed from the polygon.
    pub fn area_m2(&self) -> f64 {
        self.area_m2
    }

    /// Mean of the vertices weighted by area: the polygon's centroid.
    pub fn centroid(&self) -> [f64; 3] {
        polygon::centroid(&self.outline).to_array()
    }

    /// The same leaf elsewhere.
    #[must_use]
    pub fn translated(&self, by: [f64; 3]) -> Self {
        self.placed(&Placement::at(by))
    }

    /// The same leaf as it stands in the scene.
    #[must_use]
    pub fn placed(&self, placement: &Placement) -> Self {
        Self {
            outline: self.outline.iter().map(|vertex| placement.point(*vertex)).collect(),
            normal: placement.direction(self.normal),
            area_m2: self.area_m2,
        }
    }

    /// Moves this leaf: its vertices are those of [`translated`](Self::translated), in the same memory.
    fn move_by(&mut self, placement: &Placement) {
        for vertex in &mut self.outline {
            *vertex = placement.point(*vertex);
        }
        self.normal = placement.direction(self.normal);
    }

    /// The same leaf, larger or smaller by `factor` in length and width about its first vertex (its foot).
    ///
    /// # Errors
    /// A factor that leaves no area.
    pub fn scaled(&self, factor: f64) -> Result<Self, OrganError> {
        let foot = self.outline.first().map_or(DVec3::ZERO, |foot| DVec3::from_array(*foot));
        let stretched = |v: &[f64; 3]| (foot + (DVec3::from_array(*v) - foot) * factor).to_array();
        Self::new(self.outline.iter().map(stretched).collect::<Vec<_>>())
    }

    /// How far the farthest vertex lies off the plane through the centroid, over the polygon's size (its largest extent from the first
    /// vertex): 0 for a plane one.
    pub fn warp(&self) -> f64 {
        let middle = DVec3::from_array(self.centroid());
        let normal = DVec3::from_array(self.normal);
        let vertices = || self.outline.iter().map(|vertex| DVec3::from_array(*vertex));
        let off = vertices().map(|vertex| (vertex - middle).dot(normal).abs()).fold(0.0, f64::max);
        let first = vertices().next().unwrap_or(middle);
        let size = vertices().map(|vertex| vertex.distance(first)).fold(0.0, f64::max);
        if size > 0.0 { off / size } else { 0.0 }
    }
}

/// One piece of wood: a straight cylinder with flat ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    base: [f64; 3],
    tip: [f64; 3],
    radius_m: f64,
}

impl Cylinder {
    /// A cylinder from the middles of its two ends (metres, scene frame) and its radius (metres).
    ///
    /// # Errors
    /// A coordinate that is not a number, ends that coincide, or a radius that is not a positive number.
    pub fn new(base: [f64; 3], tip: [f64; 3], radius_m: f64) -> Result<Self, OrganError> {
        if base.iter().chain(&tip).any(|c| !c.is_finite()) {
            return Err(OrganError::NotFinite);
        }
        if !(radius_m.is_finite() && radius_m > 0.0) {
            return Err(OrganError::Radius { found: radius_m });
        }
        let cylinder = Self { base, tip, radius_m };
        if cylinder.length_m() > 0.0 { Ok(cylinder) } else { Err(OrganError::NoLength) }
    }

    /// Middle of the lower (older) end, metres.
    pub fn base(&self) -> [f64; 3] {
        self.base
    }

    /// Middle of the upper (younger) end, metres.
    pub fn tip(&self) -> [f64; 3] {
        self.tip
    }

    /// Radius, metres.
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// Distance between the ends, metres.
    pub fn length_m(&self) -> f64 {
        DVec3::from_array(self.base).distance(DVec3::from_array(self.tip))
    }

    /// Lateral surface without the ends, m².
    pub fn area_m2(&self) -> f64 {
        2.0 * std::f64::consts::PI * self.radius_m * self.length_m()
    }

    /// Height of its highest point, metres.
    pub fn top_m(&self) -> f64 {
        let [along_x, along_y, _] = (DVec3::from_array(self.tip) - DVec3::from_array(self.base)).to_array();
        self.base[2].max(self.tip[2]) + self.radius_m * along_x.hypot(along_y) / self.length_m()
    }

    /// The same cylinder elsewhere.
    #[must_use]
    pub fn translated(&self, by: [f64; 3]) -> Self {
        self.placed(&Placement::at(by))
    }

    /// The same cylinder as it stands in the scene.
    #[must_use]
    pub fn placed(&self, placement: &Placement) -> Self {
        Self { base: placement.point(self.base), tip: placement.point(self.tip), radius_m: self.radius_m }
    }
}

/// What a facet is the surface of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Surface {
    /// Bark: wood that came as a mesh and not as cylinders.
    Bark,
    /// A fruit.
    Fruit,
    /// A post that came as a mesh.
    Post,
    /// A wire that came as a mesh.
    Wire,
    /// Soil that is not a plane.
    Soil,
    /// Grass, or the leaf of a weed.
    Grass,
}

/// A plane polygon that stops beams and is not a leaf.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    /// What it is the surface of.
    pub surface: Surface,
    /// Its outline, area and normal.
    pub polygon: Leaf,
}

/// A tree: what grows at one place of the row. A gap in the row is a tree without organs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    /// Its blades; the place in this list is the leaf's id.
    pub leaves: Vec<Leaf>,
    /// Its branches; the place in this list is the branch's id.
    pub wood: Vec<Cylinder>,
    /// Surfaces given as polygons: bark of meshes, fruit. The place in this list is the facet's id.
    pub facets: Vec<Facet>,
}

impl Tree {
    /// One-sided area of all leaves, m².
    pub fn leaf_area_m2(&self) -> f64 {
        // The sum of nothing is written as zero, not as minus zero.
        self.leaves.iter().fold(0.0, |sum, leaf| sum + leaf.area_m2())
    }

    /// Lateral surface of all wood, m²: cylinders without their ends, and bark facets.
    pub fn wood_area_m2(&self) -> f64 {
        let cylinders = self.wood.iter().fold(0.0, |sum, piece| sum + piece.area_m2());
        cylinders + self.facet_area_m2(Surface::Bark)
    }

    /// Surface of all facets of a kind, m².
    pub fn facet_area_m2(&self, surface: Surface) -> f64 {
        let of_kind = self.facets.iter().filter(|facet| facet.surface == surface);
        of_kind.fold(0.0, |sum, facet| sum + facet.polygon.area_m2())
    }

    /// The same tree elsewhere.
    #[must_use]
    pub fn translated(&self, by: [f64; 3]) -> Self {
        self.placed(&Placement::at(by))
    }

    /// The same tree elsewhere, in the same memory.
    #[must_use]
    pub(crate) fn moved(mut self, by: [f64; 3]) -> Self {
        let placement = Placement::at(by);
        self.leaves.iter_mut().for_each(|leaf| leaf.move_by(&placement));
        self.wood.iter_mut().for_each(|piece| *piece = piece.placed(&placement));
        self.facets.iter_mut().for_each(|facet| facet.polygon.move_by(&placement));
        self
    }

    /// The same tree as it stands in the scene.
    #[must_use]
    pub fn placed(&self, placement: &Placement) -> Self {
        Self {
            leaves: self.leaves.iter().map(|leaf| leaf.placed(placement)).collect(),
            wood: self.wood.iter().map(|piece| piece.placed(placement)).collect(),
            facets: self
                .facets
                .iter()
                .map(|Facet { surface, polygon }| Facet {
                    surface: *surface,
                    polygon: polygon.placed(placement),
                })
                .collect(),
        }
    }
}

/// Why an outline cannot be a leaf, or two points and a radius a branch.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrganError {
    /// A polygon has three vertices or more.
    #[error("a leaf outline needs 3 vertices or more, found {found}")]
    TooFewVertices {
        /// Vertices given.
        found: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("a coordinate is not a finite number")]
    NotFinite,
    /// All vertices lie on a line.
    #[error("the leaf outline encloses no area")]
    NoArea,
    /// Both ends are the same point.
    #[error("the two ends of a branch coincide")]
    NoLength,
    /// The radius cannot be one.
    #[error("the radius of a branch must be a positive number of metres, found {found}")]
    Radius {
        /// Metres.
        found: f64,
    },
}
