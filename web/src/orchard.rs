//! An orchard as a browser draws it: one buffer for the graphics card, with a head that says where things are.
//!
//! | bytes | hold |
//! |---|---|
//! | 4 | `RWO1` |
//! | 4 | length of the head, a multiple of 4, u32 |
//! | head | JSON: [`Head`], blanks behind it |
//! | 28 a blade | leaves of every distinct tree, then facets, then blades of grass: centre 3 × f32, normal 3 × i8 and class u8, axis 3 × i8 and 0, length and width u16 in 0.1 mm, area f32 m² |
//! | 32 a stick | wood of every distinct tree, then posts and wires: base 3 × f32, tip 3 × f32, radius f32, class u8 and 3 × 0 |
//!
//! All little endian. Trees have their coordinates in their own frame, and `places` say where they stand. The leaves of a tree come in an order in which every
//! beginning of it is a fair sample: who draws only the first tenth, larger, draws the same tree from farther away. Wood comes from the thickest to the thinnest.

use rowscan_scenes::{Class, Cylinder, Facet, Leaf, Orchard, Surface, Tree};
use serde::Serialize;

/// What the bytes begin with.
const MAGIC: &[u8; 4] = b"RWO1";
/// A leaf's width to its length where it has no extent to tell.
const ROUND: f64 = 1.0;
/// Blades of grass in a picture at most.
const MOST_GRASS: usize = 30_000;
/// Sizes are in these, metres.
const SIZE_UNIT_M: f64 = 1e-4;

/// Numbers that a class has in pictures.
pub(crate) fn class_code(class: Class) -> u8 {
    match class {
        Class::None => 0,
        Class::Leaf => 1,
        Class::Wood => 2,
        Class::Ground => 3,
        Class::Fruit => 4,
        Class::Post => 5,
        Class::Wire => 6,
        Class::Grass => 7,
    }
}

/// An orchard as bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct OrchardPicture {
    bytes: Vec<u8>,
    leaves: usize,
}

/// What is where in the bytes.
#[derive(Debug, Serialize)]
struct Head {
    /// Leaves of all distinct trees; facets follow them.
    leaves: usize,
    facets: usize,
    /// Blades of grass, of which a dense meadow has too many to be drawn: so many of them.
    grass: usize,
    /// Branches of all distinct trees; posts and wires follow them.
    wood: usize,
    supports: usize,
    trees: Vec<TreeSpan>,
    /// Number of the distinct tree, x, y, z of its foot, cos and sin of its turn.
    places: Vec<[f64; 6]>,
    /// The rows repeat after so many metres; none where they do not.
    period_m: Option<f64>,
    row_spacing_m: Option<f64>,
    tree_spacing_m: Option<f64>,
    rows: usize,
    /// Of all trees that stand.
    leaf_area_m2: f64,
    height_m: f64,
}

/// Where a distinct tree's parts are: the first, and how many.
#[derive(Clone, Copy, Debug, Serialize)]
struct TreeSpan {
    leaves: [usize; 2],
    facets: [usize; 2],
    wood: [usize; 2],
}

impl OrchardPicture {
    /// A picture of all that stands.
    pub fn of(orchard: &Orchard) -> Self {
        let trees = orchard.distinct_trees();
        let (mut spans, mut counts) = (Vec::new(), [0_usize; 3]);
        for tree in trees {
            let of = [tree.leaves.len(), tree.facets.len(), tree.wood.len()];
            let [leaves, facets, wood] = std::array::from_fn(|part| [counts[part], of[part]]);
            spans.push(TreeSpan { leaves, facets, wood });
            counts.iter_mut().zip(of).for_each(|(count, more)| *count += more);
        }
        let [leaves, facets, wood] = counts;
        let grass: Vec<&Facet> =
            orchard.ground().facets.iter().filter(|facet| facet.surface == Surface::Grass).collect();
        let drawn = grass.len().min(MOST_GRASS);
        let head = head(orchard, spans, counts, drawn);
        let mut bytes = Vec::with_capacity(8 + head.len() + 28 * (leaves + facets + drawn) + 32 * wood);
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&u32::try_from(head.len()).unwrap_or(u32::MAX).to_le_bytes());
        bytes.extend_from_slice(&head);
        for tree in trees {
            for number in sampled(tree.leaves.len()) {
                if let Some(leaf) = tree.leaves.get(number) {
                    write_blade(leaf, Class::Leaf, &mut bytes);
                }
            }
        }
        for facet in trees.iter().flat_map(|tree| &tree.facets) {
            write_blade(&facet.polygon, facet.surface.into(), &mut bytes);
        }
        for facet in sampled(grass.len()).take(drawn).filter_map(|number| grass.get(number)) {
            write_blade(&facet.polygon, Class::Grass, &mut bytes);
        }
        for tree in trees {
            let mut wood: Vec<&Cylinder> = tree.wood.iter().collect();
            wood.sort_by(|a, b| b.radius_m().total_cmp(&a.radius_m()));
            wood.iter().for_each(|wood| write_stick(wood, Class::Wood, &mut bytes));
        }
        for support in orchard.supports() {
            let class = Class::from(support.kind);
            write_stick(&support.shape, class, &mut bytes);
        }
        Self { bytes, leaves }
    }

    /// The bytes, as the page reads them.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Leaves of all distinct trees.
    pub fn leaves(&self) -> usize {
        self.leaves
    }
}

/// The head as JSON, filled up with blanks.
fn head(
    orchard: &Orchard,
    trees: Vec<TreeSpan>,
    [leaves, facets, wood]: [usize; 3],
    grass: usize,
) -> Vec<u8> {
    let places = orchard.standing().map(|(tree, placement)| {
        let [x, y, z] = placement.base_m();
        let [cos, sin, _] = placement.direction([1.0, 0.0, 0.0]);
        [tree as f64, x, y, z, cos, sin]
    });
    let standing = orchard.standing().filter_map(|(tree, _)| orchard.distinct_trees().get(tree));
    let head = Head {
        leaves,
        facets,
        grass,
        wood,
        supports: orchard.supports().len(),
        trees,
        places: places.collect(),
        period_m: Some(orchard.period_m()).filter(|period_m| period_m.is_finite()),
        row_spacing_m: orchard.row_spacing_m(),
        tree_spacing_m: orchard.tree_spacing_m(),
        rows: orchard.rows(),
        leaf_area_m2: standing.map(Tree::leaf_area_m2).fold(0.0, |sum, area| sum + area),
        height_m: orchard.distinct_trees().iter().map(top_m).fold(0.0, f64::max),
    };
    let mut text = serde_json::to_vec(&head).unwrap_or_default();
    text.resize(text.len().next_multiple_of(4), b' ');
    text
}

fn top_m(tree: &Tree) -> f64 {
    let leaves = tree.leaves.iter().map(|leaf| leaf.centroid()[2]);
    leaves.chain(tree.wood.iter().map(Cylinder::top_m)).fold(0.0, f64::max)
}

/// All numbers below `count`, each once, spread so that every beginning is a sample of the whole: multiples of a step without a common divisor near the
/// golden section of `count`.
fn sampled(count: usize) -> impl Iterator<Item = usize> {
    let divides = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a == 1
    };
    let near = (count as f64 * 0.618_033_988_749_895) as usize;
    let step = (near.max(1)..=count.max(1)).find(|step| divides(*step, count)).unwrap_or(1);
    (0..count).scan(0, move |at, _| {
        let here = *at;
        *at = (here + step) % count.max(1);
        Some(here)
    })
}

/// A polygon as an ellipse of the same area: from its foot to its farthest vertex, and as wide as the area asks for.
fn write_blade(leaf: &Leaf, class: Class, out: &mut Vec<u8>) {
    let foot = leaf.outline().first().copied().unwrap_or_default();
    let from_foot = |vertex: &[f64; 3]| std::array::from_fn::<f64, 3, _>(|i| vertex[i] - foot[i]);
    let length = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let farthest = leaf.outline().iter().map(from_foot).max_by(|a, b| length(a).total_cmp(&length(b)));
    let along = farthest.unwrap_or_default();
    let length_m = length(&along);
    let axis = if length_m > 0.0 { along.map(|c| c / length_m) } else { [ROUND, 0.0, 0.0] };
    let width_m = if length_m > 0.0 { 4.0 * leaf.area_m2() / (std::f64::consts::PI * length_m) } else { 0.0 };
    let unit = |v: [f64; 3]| v.map(|c| (c * 127.0).round().clamp(-127.0, 127.0) as i8);
    let size = |metres: f64| (metres / SIZE_UNIT_M).round().clamp(0.0, f64::from(u16::MAX)) as u16;
    write_point(leaf.centroid(), out);
    out.extend(unit(leaf.normal()).map(|c| c.to_le_bytes()[0]));
    out.push(class_code(class));
    out.extend(unit(axis).map(|c| c.to_le_bytes()[0]));
    out.push(0);
    out.extend_from_slice(&size(length_m).to_le_bytes());
    out.extend_from_slice(&size(width_m).to_le_bytes());
    out.extend_from_slice(&(leaf.area_m2() as f32).to_le_bytes());
}

fn write_stick(wood: &Cylinder, class: Class, out: &mut Vec<u8>) {
    write_point(wood.base(), out);
    write_point(wood.tip(), out);
    out.extend_from_slice(&(wood.radius_m() as f32).to_le_bytes());
    out.extend_from_slice(&[class_code(class), 0, 0, 0]);
}

fn write_point(point: [f64; 3], out: &mut Vec<u8>) {
    point.iter().for_each(|c| out.extend_from_slice(&(*c as f32).to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_beginning_of_the_order_is_spread_over_the_whole() {
        for count in [1_usize, 2, 7, 100, 4096, 9973] {
            let order: Vec<usize> = sampled(count).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>());
            // The first tenth has no gap wider than six tenths of a hundredth of what even spacing would leave, times ten.
            let mut first: Vec<usize> = order.iter().copied().take(count.div_ceil(10)).collect();
            first.sort_unstable();
            let widest = first.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
            assert!(widest <= 4 * 10 + 1, "{count}: {widest}");
        }
        assert_eq!(sampled(0).count(), 0);
    }
}
