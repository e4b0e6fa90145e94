//! An orchard, and a scan over it, drawn from front, side and above: SVG, to look at before one trusts.
//!
//! Leaves are drawn as the leaf area behind each cell of a raster, in five shades; wood, posts and wires as lines of their thickness;
//! returns of a scan as coloured cells. So the file stays small whatever the number of leaves.

mod canvas;

use crate::caster::Class;
use crate::exchange::mesh::Material;
use crate::orchard::Orchard;
use crate::organ::{Cylinder, Facet, Tree};
use crate::support::SupportKind;
use canvas::Canvas;

/// What is drawn, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawing {
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Pixels of a metre.
    pub scale_px: f64,
    /// Places that are drawn, from the first.
    pub trees: usize,
}

impl Default for Drawing {
    fn default() -> Self {
        Self { cell_m: 0.05, scale_px: 60.0, trees: usize::MAX }
    }
}

/// A return of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dot {
    /// Where, metres, scene frame.
    pub at: [f64; 3],
    /// What the beam met.
    pub class: Class,
}

/// A way to look: axes to the right and up on paper, and along the view.
#[derive(Clone, Copy, Debug)]
struct View {
    title: &'static str,
    right: usize,
    up: usize,
    along: usize,
}

const VIEWS: [View; 3] = [
    View { title: "front: along the row, as the scanner looks", right: 1, up: 2, along: 0 },
    View { title: "side: across the row", right: 0, up: 2, along: 1 },
    View { title: "top", right: 1, up: 0, along: 2 },
];

/// Pieces of wood drawn in a view: the thickest.
const MOST_WOOD: usize = 500;

/// Space around a view, pixels.
const MARGIN_PX: f64 = 24.0;

/// Draws the trees, posts and wires of an orchard, and dots over them.
pub fn draw(orchard: &Orchard, dots: &[Dot], drawing: &Drawing) -> String {
    let trees: Vec<Tree> = orchard.trees().take(drawing.trees).map(|tree| tree.into_owned()).collect();
    let reach_m = match orchard.tree_spacing_m() {
        Some(spacing_m) if drawing.trees < orchard.trees_per_row() => drawing.trees as f64 * spacing_m,
        _ => orchard.length_m(),
    };
    let mut body = String::new();
    let (mut width_px, mut height_px) = (0.0f64, MARGIN_PX);
    for view in VIEWS {
        let Some(canvas) = paint(view, orchard, &trees, reach_m, dots, drawing) else { continue };
        let (width, height) = canvas.size_px();
        body.push_str(&canvas.write(view.title, MARGIN_PX, height_px));
        height_px += height + 2.0 * MARGIN_PX;
        width_px = width_px.max(width);
    }
    width_px = (width_px + 2.0 * MARGIN_PX).max(320.0);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px:.0}\" height=\"{height_px:.0}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

fn paint(
    view: View,
    orchard: &Orchard,
    trees: &[Tree],
    reach_m: f64,
    dots: &[Dot],
    drawing: &Drawing,
) -> Option<Canvas> {
    let on_paper = |point: [f64; 3]| [point[view.right], point[view.up]];
    let shown = |cylinder: &Cylinder| cylinder.base()[1].min(cylinder.tip()[1]) <= reach_m;
    let supports: Vec<_> = orchard.supports().iter().filter(|support| shown(&support.shape)).collect();
    // A wire runs on beyond the trees that are drawn.
    let cut = |[x, y, z]: [f64; 3]| [x, if reach_m.is_finite() { y.min(reach_m) } else { y }, z];
    let organs = trees.iter().flat_map(|tree| {
        let facets = tree.facets.iter().map(|facet| &facet.polygon);
        let outlines = tree.leaves.iter().chain(facets).flat_map(|leaf| leaf.outline().iter().copied());
        outlines.chain(tree.wood.iter().flat_map(|piece| [piece.base(), piece.tip()]))
    });
    let built = supports.iter().flat_map(|support| [support.shape.base(), cut(support.shape.tip())]);
    let mut canvas =
        Canvas::around(organs.chain(built).map(on_paper), view.up == 2, (drawing.cell_m, drawing.scale_px))?;
    for tree in trees {
        for leaf in &tree.leaves {
            // A leaf's area as seen, spread over its vertices and its middle.
            let outline = leaf.outline();
            let seen_m2 = leaf.area_m2() * leaf.normal()[view.along].abs() / (outline.len() + 1) as f64;
            for point in outline.iter().copied().chain([leaf.centroid()]) {
                canvas.shade(on_paper(point), seen_m2);
            }
        }
        for facet in &tree.facets {
            let colour = Material::of_surface(facet.surface).rgb();
            let outline = facet.polygon.outline().iter().copied();
            outline.chain([facet.polygon.centroid()]).for_each(|point| canvas.dot(on_paper(point), colour));
        }
    }
    let near = |facet: &&Facet| facet.polygon.outline().iter().all(|[_, y, _]| *y <= reach_m);
    // From above it would cover what stands on it.
    for facet in orchard.ground().facets.iter().filter(near).filter(|_| view.along != 2) {
        let colour = Material::of_surface(facet.surface).rgb();
        let outline = facet.polygon.outline().iter().copied();
        outline.for_each(|point| canvas.dot(on_paper(point), colour));
    }
    let mut wood: Vec<&Cylinder> = trees.iter().flat_map(|tree| &tree.wood).collect();
    wood.sort_by(|a, b| b.radius_m().total_cmp(&a.radius_m()));
    for piece in wood.into_iter().take(MOST_WOOD) {
        canvas.line(
            on_paper(piece.base()),
            on_paper(piece.tip()),
            2.0 * piece.radius_m(),
            Material::Wood.rgb(),
        );
    }
    for support in supports {
        let colour = match support.kind {
            SupportKind::Post => Material::Post.rgb(),
            SupportKind::Wire => Material::Wire.rgb(),
        };
        let (base, tip) = (support.shape.base(), cut(support.shape.tip()));
        canvas.line(on_paper(base), on_paper(tip), 2.0 * support.shape.radius_m(), colour);
    }
    for dot in dots.iter().filter(|dot| dot.at[1] <= reach_m) {
        canvas.dot(on_paper(dot.at), colour_of(dot.class));
    }
    Some(canvas)
}

/// Colours of returns: stronger than those of what they met.
fn colour_of(class: Class) -> [u8; 3] {
    match class {
        Class::Leaf => [0, 90, 220],
        Class::Wood => [220, 60, 0],
        Class::Fruit => [230, 0, 120],
        Class::Post => [40, 40, 40],
        Class::Wire => [130, 0, 200],
        Class::Grass => [150, 170, 0],
        Class::Ground | Class::None => [200, 170, 60],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orchard::{OrchardParameters, Preset};

    #[test]
    fn a_drawing_has_three_views_stays_small_and_repeats() {
        let parameters = OrchardParameters { trees: Some(3), ..OrchardParameters::of(Preset::FruitingWall) };
        let orchard = Orchard::grow(&parameters, 1, &|_, _| {}).unwrap();
        let hit = Dot { at: [-0.3, 1.0, 2.0], class: Class::Leaf };
        let drawn = draw(&orchard, &[hit], &Drawing::default());
        assert_eq!(drawn.matches("<g ").count(), 3);
        assert!(drawn.contains("front") && drawn.contains("side") && drawn.contains("top"));
        assert!(drawn.contains("#005adc"), "the return is there");
        assert!(drawn.contains("#787878") && drawn.contains("#3c508c"), "posts and wires are there");
        assert!(drawn.len() < 90_000, "{} bytes", drawn.len());
        assert_eq!(drawn, draw(&orchard, &[hit], &Drawing::default()));
    }

    #[test]
    fn nothing_is_drawn_as_nothing() {
        let empty = Orchard::from_trees(vec![Tree::default()], 1.0, None, None);
        let drawn = draw(&empty, &[], &Drawing::default());
        assert!(drawn.starts_with("<svg") && !drawn.contains("<g "));
    }
}
