//! Scenes whose answer is a formula, cell by cell along the row.
//!
//! Every place of the row (its cell is one tree spacing long) holds the same shape about the row axis X = 0. What scans of them must
//! give in closed form stands in `docs/orchards.md`.

use std::f64::consts::TAU;

use crate::generator::draft::{Blade, Draft};
use crate::generator::error::GrowError;
use crate::generator::planting::{Generator, Planting};
use crate::growth::rotation::square_to;
use crate::organ::{Cylinder, Leaf, OrganError};
use crate::parameters::{ParameterError, choices, parameters, require};
use crate::seed::{Purpose, Stream};
use crate::support::{Support, SupportKind};
use glam::DVec3;

choices! {
    /// What stands in every cell.
    pub enum Shape {
        /// A wall of leaf across the whole cell, in the plane X = 0: without a gap along the row.
        Wall = "wall",
        /// A post (class post) in the middle of the cell.
        Post = "post",
        /// An upright cylinder of wood in the middle of the cell.
        Cylinder = "cylinder",
        /// Small square leaves at random places of a box along the whole cell, all directions alike; their number is a Poisson variable.
        Slab = "slab",
        /// A wall with a gap in the middle of the cell.
        GapWall = "gap_wall",
        /// A chess board of leaf and nothing in the plane X = 0.
        Checker = "checker",
    }
}

parameters! {
    /// Sizes of an analytic scene.
    pub struct AnalyticParameters;
    /// Sizes of which every one may be left out: the `[orchard.analytic]` table of a scene file.
    pub overrides AnalyticOverrides;

    /// What stands in every cell.
    shape: Shape = Shape::Wall, "wall | post | cylinder | slab | gap_wall | checker", "ours";
    /// Lower edge above the ground.
    from_m: f64 = 0.5, "m", "a canopy does not touch the ground";
    /// Upper edge above the ground.
    to_m: f64 = 3.0, "m", "the height of a tree row";
    /// Radius of post and cylinder.
    radius_m: f64 = 0.05, "m", "a post of 100 mm";
    /// Width of the gap of a gap wall along the row.
    gap_m: f64 = 0.075, "m", "the gap that a published sprayer rig sees";
    /// Side of a square of the checker.
    square_m: f64 = 0.25, "m", "divides the cell's length and the height";
    /// Thickness of the slab across the row.
    depth_m: f64 = 1.0, "m", "half a metre to either side of the axis";
    /// Leaf area density of the slab, one-sided.
    density_m2_m3: f64 = 2.0, "m²/m³", "a full crown";
    /// Side of the slab's square leaves.
    leaf_m: f64 = 0.05, "m", "25 cm², as a leaf of the grown trees";
}

impl AnalyticParameters {
    /// Refuses what no scene can be made of. `cell_m` is the tree spacing.
    ///
    /// # Errors
    /// The first key with an invalid value, and the values allowed.
    pub fn validate(&self, cell_m: f64) -> Result<(), ParameterError> {
        let within = |name: &str, value: f64, low: f64, high: f64| {
            let expected = format!("a number from {low} to {high}");
            require((low..=high).contains(&value), &format!("orchard.analytic.{name}"), &expected, value)
        };
        within("from_m", self.from_m, 0.0, 100.0)?;
        within("to_m", self.to_m, 0.01, 100.0)?;
        require(self.to_m > self.from_m, "orchard.analytic.to_m", "above from_m", self.to_m)?;
        within("radius_m", self.radius_m, 1e-4, 10.0)?;
        within("gap_m", self.gap_m, 0.0, 100.0)?;
        require(
            self.shape != Shape::GapWall || self.gap_m < cell_m,
            "orchard.analytic.gap_m",
            "less than the tree spacing",
            self.gap_m,
        )?;
        within("square_m", self.square_m, 0.01, 10.0)?;
        within("depth_m", self.depth_m, 0.01, 10.0)?;
        within("density_m2_m3", self.density_m2_m3, 0.0, 1000.0)?;
        within("leaf_m", self.leaf_m, 0.001, 1.0)?;
        let leaves = self.leaves_expected(cell_m);
        require(
            leaves <= MOST_LEAVES,
            "orchard.analytic.density_m2_m3",
            &format!("low enough for {MOST_LEAVES} leaves a cell"),
            self.density_m2_m3,
        )
    }

    /// Mean number of leaves of a cell of the slab.
    fn leaves_expected(&self, cell_m: f64) -> f64 {
        let volume_m3 = self.depth_m * cell_m * (self.to_m - self.from_m);
        self.density_m2_m3 * volume_m3 / (self.leaf_m * self.leaf_m)
    }
}

/// Leaves of a cell beyond which a slab is refused.
const MOST_LEAVES: f64 = 1e6;

/// Cells of one shape.
pub(crate) struct Analytic {
    parameters: AnalyticParameters,
    cell_m: f64,
    seed: u64,
}

impl Analytic {
    pub(crate) fn new(
        parameters: AnalyticParameters,
        cell_m: f64,
        seed: u64,
    ) -> Result<Self, ParameterError> {
        parameters.validate(cell_m)?;
        Ok(Self { parameters, cell_m, seed })
    }

    fn shapes(&self, planting: &Planting) -> Result<Draft, OrganError> {
        let &AnalyticParameters { shape, from_m, to_m, radius_m, gap_m, .. } = &self.parameters;
        let half_m = self.cell_m / 2.0;
        let upright = || Cylinder::new([0.0, 0.0, from_m], [0.0, 0.0, to_m], radius_m);
        let panel = |y: [f64; 2]| Ok(leaf(panel(y, [from_m, to_m])?));
        let mut draft = Draft::default();
        match shape {
            Shape::Wall => draft.blades.push(panel([-half_m, half_m])?),
            Shape::GapWall => {
                draft.blades.push(panel([-half_m, -gap_m / 2.0])?);
                draft.blades.push(panel([gap_m / 2.0, half_m])?);
            }
            Shape::Checker => draft.blades = self.checker()?,
            Shape::Slab => draft.blades = self.slab(planting)?,
            Shape::Cylinder => draft.wood.push(upright()?),
            Shape::Post => draft.supports.push(Support { kind: SupportKind::Post, shape: upright()? }),
        }
        Ok(draft)
    }

    /// Squares by column and row from the cell's lower corner, the first of them leaf; those at the far edges may be cut.
    fn checker(&self) -> Result<Vec<Blade>, OrganError> {
        let &AnalyticParameters { from_m, to_m, square_m, .. } = &self.parameters;
        let half_m = self.cell_m / 2.0;
        let count = |length_m: f64| (length_m / square_m - 1e-9).ceil() as u32;
        let mut squares = Vec::new();
        for column in 0..count(self.cell_m) {
            for row in (column % 2..count(to_m - from_m)).step_by(2) {
                let span = |from: f64, number: u32, to: f64| {
                    [from + f64::from(number) * square_m, (from + f64::from(number + 1) * square_m).min(to)]
                };
                squares.push(leaf(panel(span(-half_m, column, half_m), span(from_m, row, to_m))?));
            }
        }
        Ok(squares)
    }

    /// Leaves whose middles are uniform in the box.
    fn slab(&self, planting: &Planting) -> Result<Vec<Blade>, OrganError> {
        let &AnalyticParameters { from_m, to_m, depth_m, leaf_m, .. } = &self.parameters;
        let mut stream = Purpose::Foliage.stream(self.seed, planting.row, planting.tree);
        let count = poisson(self.parameters.leaves_expected(self.cell_m), &mut stream);
        (0..count)
            .map(|_| {
                let mut between = |low: f64, high: f64| low + (high - low) * stream.unit();
                let half_m = self.cell_m / 2.0;
                let middle = DVec3::new(
                    between(-depth_m / 2.0, depth_m / 2.0),
                    between(-half_m, half_m),
                    between(from_m, to_m),
                );
                let (rise, bearing, spin) = (between(-1.0, 1.0), between(0.0, TAU), between(0.0, TAU));
                let flat = (1.0 - rise * rise).sqrt();
                let normal = DVec3::new(flat * libm::cos(bearing), flat * libm::sin(bearing), rise);
                let (u, v) = (square_to(normal), normal.cross(square_to(normal)));
                let (u, v) =
                    (u * libm::cos(spin) + v * libm::sin(spin), v * libm::cos(spin) - u * libm::sin(spin));
                let corner = |a: f64, b: f64| (middle + (u * a + v * b) * (leaf_m / 2.0)).to_array();
                let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                Leaf::new(corners).map(leaf)
            })
            .collect()
    }
}

impl Generator for Analytic {
    fn draft(&self, planting: &Planting) -> Result<Draft, GrowError> {
        // Sizes are checked: a shape without extent cannot come up.
        self.shapes(planting).map_err(|error| {
            GrowError::Parameter(ParameterError::new("orchard.analytic", "sizes that enclose an area", error))
        })
    }
}

fn leaf(leaf: Leaf) -> Blade {
    Blade { segment: 0, along_m: 0.0, leaf, petiole: None }
}

fn panel([y0, y1]: [f64; 2], [z0, z1]: [f64; 2]) -> Result<Leaf, OrganError> {
    Leaf::new([[0.0, y0, z0], [0.0, y1, z0], [0.0, y1, z1], [0.0, y0, z1]])
}

/// A Poisson variable: events of a process of rate one before time `mean`.
fn poisson(mean: f64, stream: &mut Stream) -> usize {
    let mut time = 0.0;
    let mut events = 0;
    loop {
        // In (0, 1], so that the logarithm is finite.
        time -= libm::log(1.0 - stream.unit());
        if time > mean {
            return events;
        }
        events += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orchard::{Orchard, OrchardParameters};

    fn made(overrides: AnalyticOverrides) -> Orchard {
        let parameters = OrchardParameters {
            generator: Some(crate::generator::GeneratorKind::Analytic),
            analytic: overrides,
            trees: Some(4),
            tree_spacing_m: Some(2.0),
            ..OrchardParameters::default()
        };
        Orchard::grow(&parameters, 1, &|_, _| {}).unwrap()
    }

    fn leaf_area_m2(shape: Shape) -> f64 {
        made(AnalyticOverrides { shape: Some(shape), ..AnalyticOverrides::default() }).truth().leaf_area_m2
    }

    #[test]
    fn areas_are_those_of_the_formulas() {
        assert!((leaf_area_m2(Shape::Wall) - 8.0 * 2.5).abs() < 1e-12);
        assert!((leaf_area_m2(Shape::GapWall) - (8.0 - 4.0 * 0.075) * 2.5).abs() < 1e-12);
        assert!((leaf_area_m2(Shape::Checker) - 8.0 * 2.5 / 2.0).abs() < 1e-12);
        let wood =
            AnalyticOverrides { shape: Some(Shape::Cylinder), radius_m: Some(0.25), ..Default::default() };
        let truth = made(wood).truth();
        assert!((truth.wood_area_m2 - 4.0 * TAU * 0.25 * 2.5).abs() < 1e-12);
        assert_eq!(truth.leaf_area_m2, 0.0);
        let posts = made(AnalyticOverrides { shape: Some(Shape::Post), ..Default::default() });
        assert_eq!((posts.supports().len(), posts.truth().wood_area_m2), (4, 0.0));
        assert_eq!(posts.supports()[1].shape.base(), [0.0, 3.0, 0.5]);
    }

    #[test]
    fn the_slab_has_its_density_on_average_and_all_directions_alike() {
        let orchard = made(AnalyticOverrides { shape: Some(Shape::Slab), ..Default::default() });
        // 4 cells of 2 x 2.5 x 1 m³ at 2 m²/m³: 16 000 leaves expected, σ 126.
        let truth = orchard.truth();
        assert!((truth.leaf_area_m2 - 40.0).abs() < 5.0 * 126.0 * 25e-4, "{}", truth.leaf_area_m2);
        let normals = orchard
            .trees()
            .flat_map(|tree| tree.leaves.iter().map(|leaf| leaf.normal().map(f64::abs)).collect::<Vec<_>>());
        let (mut sums, mut count) = ([0.0; 3], 0.0);
        for normal in normals {
            count += 1.0;
            sums.iter_mut().zip(normal).for_each(|(sum, n)| *sum += n);
        }
        // Each component of an isotropic unit vector is uniform: its absolute mean is 1/2, σ 0.289/√n.
        assert!(sums.iter().all(|sum| (sum / count - 0.5).abs() < 5.0 * 0.289 / count.sqrt()), "{sums:?}");
    }

    #[test]
    fn a_gap_as_wide_as_the_cell_is_refused() {
        let parameters = AnalyticParameters { shape: Shape::GapWall, gap_m: 2.0, ..Default::default() };
        assert!(parameters.validate(2.0).unwrap_err().to_string().contains("less than the tree spacing"));
        assert!(parameters.validate(2.5).is_ok());
        let dense = AnalyticParameters { density_m2_m3: 900.0, leaf_m: 0.001, ..Default::default() };
        assert!(dense.validate(2.0).unwrap_err().to_string().contains("1000000 leaves a cell"));
    }
}
