//! From parameters to an orchard.

use super::grown::Orchard;
use super::parameters::OrchardParameters;
use crate::generator::error::GrowError;
use crate::generator::plant::{Planted, plant};
use crate::generator::planting::Planting;
use crate::generator::remark::{FEWEST_TREES, Remark};
use crate::ground::{self, Relief};
use crate::placement::Placement;
use crate::seed::Purpose;
use crate::support::Support;

impl Orchard {
    /// Grows an orchard, one tree a task of the current rayon pool; the result is the same on any number of threads.
    ///
    /// `progress(done, of)` is called after every tree, from the thread that grew it.
    ///
    /// # Errors
    /// A parameter out of range, or a tree that explodes ([`GrowError`]).
    pub fn grow(
        parameters: &OrchardParameters,
        seed: u64,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, GrowError> {
        parameters.validate()?;
        let layout = parameters.layout();
        let relief = Relief::of(&parameters.ground_parameters(), &layout, seed);
        let foot = |row: u32, place: u32| {
            let x_m = f64::from(row) * layout.row_spacing_m;
            let y_m = (f64::from(place) + 0.5) * layout.tree_spacing_m;
            [x_m, y_m, relief.height_m(x_m, y_m)]
        };
        let is_headland = |place: u32| place < layout.row_ends || place >= layout.trees - layout.row_ends;
        let stands: Vec<Planting> = (0..layout.rows)
            .flat_map(|row| (0..layout.trees).map(move |place| (row, place)))
            .map(|(row, place)| Planting {
                row,
                tree: parameters.order.of(row).get(place as usize).copied().unwrap_or(place),
                gap: parameters.missing.of(row).contains(&place) || is_headland(place),
                is_young: parameters.replanted.of(row).contains(&place),
                base: foot(row, place),
            })
            .collect();
        let (plantings, places) = match layout.distinct_trees {
            0 => {
                let places = (0..stands.len()).map(|number| (number, Placement::HERE)).collect();
                (stands, places)
            }
            distinct => few(distinct, layout.directions, seed, &stands),
        };
        let mut copies = vec![0usize; plantings.len()];
        for (tree, _) in &places {
            copies[*tree] += 1;
        }
        let Planted { trees, supports, adjustment, foliage, mut remarks } =
            plant(parameters, seed, &plantings, &copies, progress)?;
        let is_few = (1..FEWEST_TREES.min(layout.trees)).contains(&layout.distinct_trees);
        remarks.extend(is_few.then_some(Remark::FewTrees { distinct_trees: layout.distinct_trees }));
        // Posts and wires follow the slope from row to row.
        let on_slope =
            |support: Support| support.translated([0.0, 0.0, relief.slope_m(support.shape.base()[0])]);
        let trellis = parameters.trellis_parameters().build(&layout).into_iter().map(on_slope);
        Ok(Self {
            distinct: trees,
            places,
            supports: supports.into_iter().chain(trellis).collect(),
            ground: ground::build(&parameters.ground_parameters(), &layout, seed),
            trees_per_row: layout.trees as usize,
            length_m: f64::from(layout.trees) * layout.tree_spacing_m,
            repeats: true,
            seed: Some(seed),
            tree_spacing_m: Some(layout.tree_spacing_m),
            row_spacing_m: Some(layout.row_spacing_m),
            adjustment,
            foliage,
            remarks,
        })
    }
}

/// Plantings of a few distinct trees at the origin (then a gap, then a young one where any is replanted), and which of them stands at each place: tree and direction
/// drawn from the place's own random stream.
fn few(
    distinct: u32,
    directions: u32,
    seed: u64,
    stands: &[Planting],
) -> (Vec<Planting>, Vec<(usize, Placement)>) {
    let at_origin = |tree, gap, is_young| Planting { row: 0, tree, gap, is_young, base: [0.0; 3] };
    let gap = at_origin(distinct, true, false);
    let young = stands.iter().any(|stand| stand.is_young).then(|| at_origin(distinct + 1, false, true));
    let plantings = (0..distinct).map(|tree| at_origin(tree, false, false)).chain([gap]).chain(young);
    let places = stands.iter().map(|stand| {
        if stand.gap {
            return (distinct as usize, Placement::HERE);
        }
        let mut stream = Purpose::Placing.stream(seed, stand.row, stand.tree);
        let mut draw = |of: u32| (stream.unit() * f64::from(of)).floor();
        let (tree, direction) = (draw(distinct) as usize, draw(directions));
        let tree = if stand.is_young { distinct as usize + 1 } else { tree };
        (tree, Placement::at(stand.base).turned(direction * 360.0 / f64::from(directions)))
    });
    (plantings.collect(), places.collect())
}
