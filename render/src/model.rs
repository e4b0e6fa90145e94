//! An orchard as triangles.

use glam::DVec3;
use rowscan_scenes::{Facet, Leaf, Orchard, SupportKind, Surface, Tree};

use crate::error::RenderError;
use crate::figure::Figure;
use crate::mark::{self, Mark};
use crate::mesh::{Finish, Mesh, Patch};
use crate::noise::hash2;
use crate::tube::{self, Ring};

/// Most triangles of a model: some 4 GB.
const MOST_TRIANGLES: usize = 40_000_000;

/// Wood as thin as this is a shoot or a petiole, metres.
const SHOOT_RADIUS_M: f64 = 0.0026;

/// How rows lie, for the paint of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rows {
    /// Distance between them; None where it is unknown.
    pub(crate) spacing_m: Option<f64>,
    pub(crate) count: usize,
}

/// An orchard made ready to be drawn.
#[derive(Clone, Debug)]
pub struct Model {
    pub(crate) mesh: Mesh,
    pub(crate) marks: Vec<Mark>,
    pub(crate) rows: Rows,
    /// Height of the level plane that reaches to the horizon.
    pub(crate) plane_m: f64,
    /// Lowest and highest coordinates of what stands there.
    low: DVec3,
    high: DVec3,
}

impl Model {
    /// The first `trees` places of an orchard, with posts, wires and ground.
    ///
    /// # Errors
    /// An orchard without anything in it, or of too many organs.
    pub fn of(orchard: &Orchard, trees: usize) -> Result<Self, RenderError> {
        few_enough(orchard, trees)?;
        let mut mesh = Mesh::default();
        for (number, tree) in orchard.trees().take(trees).enumerate() {
            plant(&mut mesh, &tree, number as u32);
        }
        let reach_m = reach_m(orchard, trees);
        supports(&mut mesh, orchard, reach_m);
        let [low, high] = mesh.extent().ok_or(RenderError::Nothing)?;
        ground(&mut mesh, orchard, reach_m);
        let rows = Rows { spacing_m: orchard.row_spacing_m(), count: orchard.rows() };
        let plane_m = plane_m(orchard);
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        Ok(Self {
            mesh,
            marks: Vec::new(),
            rows,
            plane_m,
            low,
            high: high.max(DVec3::new(low.x, low.y, plane_m)),
        })
    }

    /// The same with somebody or something beside the first tree, for the size.
    #[must_use]
    pub fn with_figure(mut self, figure: Figure) -> Self {
        let [low, high] = [self.low, self.high];
        // Before the row's begin and a little towards the scanner, where it hides little.
        let foot = DVec3::new(low.x.min(0.0) - 0.1, low.y - 0.35, self.plane_m);
        let Some(size) = figure.add(&mut self.mesh, foot) else { return self };
        self.low = low.min(foot - DVec3::new(size.x, size.y, 0.0));
        self.high = high.max(foot + size);
        self
    }

    /// The same with the returns of a scan.
    #[must_use]
    pub fn with_marks(self, marks: Vec<Mark>) -> Self {
        Self { marks, ..self }
    }

    /// Lowest and highest coordinates of all that stands there, metres.
    pub fn extent(&self) -> [[f64; 3]; 2] {
        [self.low.to_array(), self.high.to_array()]
    }

    /// All corners of what stands there: what a picture is framed by. A box around them would leave room that nothing fills.
    pub(crate) fn points(&self) -> Vec<DVec3> {
        let standing = self.mesh.corners.iter().map(|corner| corner.at.as_dvec3());
        standing.filter(|at| (at.cmpge(self.low) & at.cmple(self.high)).all()).collect()
    }

    /// Distance between rows, or of an alley where it is unknown.
    pub(crate) fn alley_m(&self) -> f64 {
        self.rows.spacing_m.unwrap_or(4.0)
    }

    /// The returns as triangles that face a direction.
    pub(crate) fn marks_facing(&self, towards: DVec3) -> Mesh {
        mark::mesh(&self.marks, towards)
    }
}

fn few_enough(orchard: &Orchard, trees: usize) -> Result<(), RenderError> {
    let polygons = |leaves: &[Leaf]| leaves.iter().map(|leaf| leaf.outline().len() - 2).sum::<usize>();
    let each: Vec<usize> = orchard
        .distinct_trees()
        .iter()
        .map(|tree| polygons(&tree.leaves) + 24 * tree.wood.len() + 2 * tree.facets.len())
        .collect();
    let found = orchard.standing().take(trees).filter_map(|(tree, _)| each.get(tree)).sum();
    if found > MOST_TRIANGLES { Err(RenderError::TooMany { most: MOST_TRIANGLES, found }) } else { Ok(()) }
}

/// How far along the row is drawn, metres.
fn reach_m(orchard: &Orchard, trees: usize) -> f64 {
    match orchard.tree_spacing_m() {
        Some(spacing_m) if trees < orchard.trees_per_row() => trees as f64 * spacing_m,
        _ => orchard.length_m(),
    }
}

fn plant(mesh: &mut Mesh, tree: &Tree, number: u32) {
    for (organ, leaf) in tree.leaves.iter().enumerate() {
        blade(mesh, leaf, Finish::Leaf, hash2(number, organ as u32));
    }
    for (organ, (rings, piece)) in tube::rings(&tree.wood).into_iter().zip(&tree.wood).enumerate() {
        let finish = if piece.radius_m() < SHOOT_RADIUS_M { Finish::Shoot } else { Finish::Bark };
        let patch = mesh.patch(of_tube(rings, finish, hash2(!number, organ as u32)));
        tube::add(mesh, rings, patch);
    }
    facets(mesh, &tree.facets, hash2(number, u32::MAX));
}

fn of_tube([base, tip]: [Ring; 2], finish: Finish, lot: u32) -> Patch {
    let way = tip.middle - base.middle;
    let along = way / way.length_squared().max(1e-12);
    let across = way.any_orthogonal_vector().normalize_or_zero() / base.radius_m;
    Patch { finish, lot, foot: base.middle.as_vec3(), along: along.as_vec3(), across: across.as_vec3() }
}

/// A leaf or a blade of grass: its pattern runs from its first corner to the farthest one.
fn blade(mesh: &mut Mesh, leaf: &Leaf, finish: Finish, lot: u32) {
    let outline = leaf.outline();
    let vertices = || outline.iter().map(|vertex| DVec3::from_array(*vertex));
    let (normal, foot) = (DVec3::from_array(leaf.normal()), vertices().next().unwrap_or_default());
    let far = |a: &DVec3, b: &DVec3| a.distance_squared(foot).total_cmp(&b.distance_squared(foot));
    let way = vertices().max_by(far).unwrap_or(foot) - foot;
    let side = normal.cross(way).normalize_or_zero();
    let half_m = vertices().map(|vertex| (vertex - foot).dot(side).abs()).fold(1e-6, f64::max);
    let patch = mesh.patch(Patch {
        finish,
        lot,
        foot: foot.as_vec3(),
        along: (way / way.length_squared().max(1e-12)).as_vec3(),
        across: (side / half_m).as_vec3(),
    });
    mesh.polygon(outline, |_| normal, leaf.normal(), patch, finish == Finish::Leaf);
}

/// Facets in turn; those of a fruit, twenty each, are smooth about its middle.
fn facets(mesh: &mut Mesh, facets: &[Facet], lot: u32) {
    let mut rest = facets;
    let mut number = 0u32;
    while let Some(first) = rest.first() {
        let like = rest.iter().take_while(|facet| facet.surface == first.surface).count();
        let take = if first.surface == Surface::Fruit { like.min(FRUIT_FACETS) } else { 1 };
        let (these, after) = rest.split_at(take);
        number += 1;
        let middle = these.iter().map(|facet| DVec3::from_array(facet.polygon.centroid())).sum::<DVec3>()
            / take as f64;
        let patch = mesh.patch(plain(of_surface(first.surface), hash2(lot, number), middle));
        for Facet { polygon, .. } in these {
            let normal = DVec3::from_array(polygon.normal());
            let smooth = |at: DVec3| if take > 1 { (at - middle).normalize_or(normal) } else { normal };
            mesh.polygon(polygon.outline(), smooth, polygon.normal(), patch, true);
        }
        rest = after;
    }
}

/// Faces of a grown fruit.
const FRUIT_FACETS: usize = 20;

fn plain(finish: Finish, lot: u32, foot: DVec3) -> Patch {
    let zero = DVec3::ZERO.as_vec3();
    Patch { finish, lot, foot: foot.as_vec3(), along: zero, across: zero }
}

fn of_surface(surface: Surface) -> Finish {
    match surface {
        Surface::Bark => Finish::Bark,
        Surface::Fruit => Finish::Fruit,
        Surface::Post => Finish::Post,
        Surface::Wire => Finish::Wire,
        Surface::Soil => Finish::Ground,
        Surface::Grass => Finish::Grass,
    }
}

/// Posts and wires up to where the drawn trees end.
fn supports(mesh: &mut Mesh, orchard: &Orchard, reach_m: f64) {
    let shown = orchard
        .supports()
        .iter()
        .filter(|support| support.shape.base()[1].min(support.shape.tip()[1]) <= reach_m);
    for (number, support) in shown.enumerate() {
        let shape = &support.shape;
        let [base, mut tip] = [shape.base(), shape.tip()].map(DVec3::from_array);
        if reach_m.is_finite() {
            tip.y = tip.y.min(reach_m);
        }
        let axis = (tip - base).normalize_or(DVec3::Z);
        let rings = [base, tip].map(|middle| Ring { middle, axis, radius_m: shape.radius_m() });
        let finish = match support.kind {
            SupportKind::Post => Finish::Post,
            SupportKind::Wire => Finish::Wire,
        };
        let patch = mesh.patch(of_tube(rings, finish, hash2(number as u32, 7)));
        tube::add(mesh, rings, patch);
    }
}

/// Soil and grass, where the orchard has any.
fn ground(mesh: &mut Mesh, orchard: &Orchard, reach_m: f64) {
    for (number, Facet { surface, polygon }) in orchard.ground().facets.iter().enumerate() {
        let begins_m = polygon.outline().first().map_or(0.0, |foot| foot[1]);
        if begins_m > reach_m {
            continue;
        }
        let lot = hash2(number as u32, 13);
        match surface {
            Surface::Grass => blade(mesh, polygon, Finish::Grass, lot),
            surface => {
                let patch = mesh.patch(plain(of_surface(*surface), lot, DVec3::ZERO));
                let normal = DVec3::from_array(polygon.normal());
                mesh.polygon(polygon.outline(), |_| normal, polygon.normal(), patch, false);
            }
        }
    }
}

/// Height of the level plane.
fn plane_m(orchard: &Orchard) -> f64 {
    orchard.ground().plane_m
}
