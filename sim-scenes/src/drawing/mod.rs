//! An orchard, and a scan over it, drawn from front, side and above: SVG, to look at before one trusts.
//!
//! Leaves are drawn as the leaf area behind each cell of a raster, in five shades; wood, posts and wires as lines of their thickness;
//! returns of a scan as coloured cells. So the file stays small whatever the number of leaves. Or leaves and wood are drawn as silhouettes in their real
//! outlines, with the area that they cover.

mod canvas;
mod pen;
mod rig;
mod silhouette;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::{DVec2, DVec3};

use crate::caster::Class;
use crate::exchange::mesh::Material;
use crate::orchard::Orchard;
use crate::organ::{Cylinder, Facet, Leaf, Tree};
use crate::support::{Support, SupportKind};
use canvas::Canvas;
pub use rig::{Rows, apart_words, draw_rig, mount_words};
use silhouette::{Contour, Silhouette};

/// What is drawn, and how finely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawing {
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Pixels of a metre.
    pub scale_px: f64,
    /// Places of every row that are drawn, from the first.
    pub trees: usize,
    /// Leaves and wood as silhouettes in their real outlines, to the millimetre, instead of cells.
    pub outlines: bool,
}

impl Default for Drawing {
    fn default() -> Self {
        Self { cell_m: 0.05, scale_px: 60.0, trees: usize::MAX, outlines: false }
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

impl View {
    fn on_paper(self, point: [f64; 3]) -> [f64; 2] {
        [point[self.right], point[self.up]]
    }

    /// What a cylinder covers: its end, moved from its base to its tip.
    fn outline(self, piece: &Cylinder) -> Contour {
        let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
        let (across, along) = (tip - base).normalize_or(DVec3::Z).any_orthonormal_pair();
        let radius = piece.radius_m();
        let rim = |corner: usize| {
            let (sine, cosine) = (std::f64::consts::TAU * corner as f64 / RIM as f64).sin_cos();
            DVec2::from_array(self.on_paper((radius * (cosine * across + sine * along)).to_array()))
        };
        let [base, tip] = [base, tip].map(|end| DVec2::from_array(self.on_paper(end.to_array())));
        // The rim runs one way or the other around, as seen.
        let turn = rim(0).perp_dot(rim(1)).signum();
        let sides = (0..RIM).map(|corner| (rim(corner), rim(corner + 1)));
        let at = |(from, to): (DVec2, DVec2)| {
            if turn * (to - from).perp_dot(tip - base) < 0.0 { tip } else { base }
        };
        sides
            .flat_map(|(from, to)| [at((from, to)) + from, at((from, to)) + to])
            .map(|point| point.to_array())
            .collect()
    }
}

/// Corners of a cylinder's rim.
const RIM: usize = 16;

const VIEWS: [View; 3] = [
    View { title: "front: as the scanner looks", right: 1, up: 2, along: 0 },
    View { title: "side: along the row", right: 0, up: 2, along: 1 },
    View { title: "top", right: 1, up: 0, along: 2 },
];

/// Pieces of wood drawn in a view: the thickest.
const MOST_WOOD: usize = 500;

/// The same of trees without leaves: then wood is what there is to see.
const MOST_BARE_WOOD: usize = 1500;

/// Space around a view, pixels.
const MARGIN_PX: f64 = 24.0;

/// Width of a letter of the legend, pixels, on average.
const LEGEND_PX: f64 = 6.6;

/// Room for a view's title, pixels.
const LEAST_PX: f64 = 180.0;

/// Draws the trees, posts and wires of an orchard, and dots over them, which `title` and a legend of what they met stand above.
pub fn draw(orchard: &Orchard, dots: &[Dot], drawing: &Drawing, title: Option<&str>) -> String {
    let per_row = orchard.trees_per_row().max(1);
    let drawn =
        (0..).zip(orchard.trees()).filter(|(number, _): &(usize, _)| number % per_row < drawing.trees);
    let trees: Vec<Tree> = drawn.map(|(_, tree)| tree.into_owned()).collect();
    let reach_m = match orchard.tree_spacing_m() {
        Some(spacing_m) if drawing.trees < orchard.trees_per_row() => drawing.trees as f64 * spacing_m,
        _ => orchard.length_m(),
    };
    let shown = Shown { orchard, trees: &trees, reach_m };
    let [front, side, top] = VIEWS.map(|view| Some((view, paint(view, &shown, dots, drawing)?)));
    let mut body = String::new();
    let (mut width_px, mut height_px) = (320.0f64, MARGIN_PX);
    if let Some(title) = title {
        height_px = head(&mut body, title, dots);
    }
    // Front and side stand on one ground; the view from above lies below the front.
    for line in [[front, side], [top, None]] {
        let (mut right_px, mut tall_px) = (MARGIN_PX, 0.0f64);
        for (view, canvas) in line.into_iter().flatten() {
            let (_, height) = canvas.size_px();
            body.push_str(&canvas.write(view.title, right_px, height_px));
            (right_px, tall_px) =
                (right_px + canvas.room_px(view.title).max(LEAST_PX) + MARGIN_PX, tall_px.max(height));
        }
        (width_px, height_px) = (width_px.max(right_px), height_px + tall_px + 2.0 * MARGIN_PX);
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width_px:.0}\" height=\"{height_px:.0}\" font-family=\"sans-serif\" \
         font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

/// Writes the title, and what the colours of returns mean; where the views begin, pixels from above.
fn head(body: &mut String, title: &str, dots: &[Dot]) -> f64 {
    // A scene may be called anything.
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    let _ = writeln!(body, "<text x=\"{MARGIN_PX}\" y=\"{MARGIN_PX}\" font-size=\"15\">{title}</text>");
    let (mut x, y) = (MARGIN_PX, 2.0 * MARGIN_PX);
    for class in Class::ALL.iter().copied().filter(|class| dots.iter().any(|dot| dot.class == *class)) {
        let ([r, g, b], words) = (colour_of(class), format!("return of {}", class.name()));
        let _ = writeln!(
            body,
            "<rect x=\"{x:.0}\" y=\"{:.0}\" width=\"9\" height=\"9\" fill=\"#{r:02x}{g:02x}{b:02x}\"/>\n<text x=\"{:.0}\" y=\"{y:.0}\">{words}</text>",
            y - 9.0,
            x + 14.0
        );
        x += 14.0 + LEGEND_PX * words.len() as f64 + MARGIN_PX;
    }
    let _ = writeln!(
        body,
        "<text x=\"{x:.0}\" y=\"{y:.0}\">green: leaf area behind a cell, 0.05 to more than 4 times the cell</text>"
    );
    y + 2.0 * MARGIN_PX
}

/// What is drawn of an orchard.
struct Shown<'a> {
    orchard: &'a Orchard,
    trees: &'a [Tree],
    /// How far along the row.
    reach_m: f64,
}

impl Shown<'_> {
    /// Posts and wires, cut where the drawing ends: a wire runs on beyond the trees that are drawn.
    fn supports(&self) -> impl Iterator<Item = (SupportKind, [[f64; 3]; 2], f64)> {
        let reach_m = self.reach_m;
        let cut = move |[x, y, z]: [f64; 3]| [x, if reach_m.is_finite() { y.min(reach_m) } else { y }, z];
        let near = move |shape: &Cylinder| shape.base()[1].min(shape.tip()[1]) <= reach_m;
        let supports = self.orchard.supports().iter().filter(move |support| near(&support.shape));
        supports
            .map(move |Support { kind, shape }| (*kind, [shape.base(), cut(shape.tip())], shape.radius_m()))
    }

    /// Soil and grass; not from above, where they would cover what stands on them.
    fn ground(&self, view: View) -> impl Iterator<Item = &Facet> {
        let near = |facet: &&Facet| facet.polygon.outline().iter().all(|[_, y, _]| *y <= self.reach_m);
        self.orchard.ground().facets.iter().filter(near).filter(move |_| view.along != 2)
    }

    fn points(&self, view: View) -> impl Iterator<Item = [f64; 3]> {
        let organs = self.trees.iter().flat_map(|tree| {
            let facets = tree.facets.iter().map(|facet| &facet.polygon);
            let outlines = tree.leaves.iter().chain(facets).flat_map(|leaf| leaf.outline().iter().copied());
            outlines.chain(tree.wood.iter().flat_map(|piece| [piece.base(), piece.tip()]))
        });
        let ground = self.ground(view).flat_map(|facet| facet.polygon.outline().iter().copied());
        organs.chain(self.supports().flat_map(|(_, ends, _)| ends)).chain(ground)
    }
}

fn paint(view: View, shown: &Shown<'_>, dots: &[Dot], drawing: &Drawing) -> Option<Canvas> {
    let on_paper = |point: [f64; 3]| view.on_paper(point);
    let points = shown.points(view).map(on_paper);
    let mut canvas = Canvas::around(points, view.up == 2, (drawing.cell_m, drawing.scale_px))?;
    if drawing.outlines {
        fill(&mut canvas, view, shown);
    } else {
        shade(&mut canvas, view, shown);
    }
    for (kind, [base, tip], radius_m) in shown.supports() {
        let colour = match kind {
            SupportKind::Post => Material::Post.rgb(),
            SupportKind::Wire => Material::Wire.rgb(),
        };
        canvas.line(on_paper(base), on_paper(tip), 2.0 * radius_m, colour);
    }
    for dot in dots.iter().filter(|dot| dot.at[1] <= shown.reach_m) {
        canvas.dot(on_paper(dot.at), colour_of(dot.class));
    }
    Some(canvas)
}

/// Leaf area by cells, and the thickest wood as lines.
fn shade(canvas: &mut Canvas, view: View, shown: &Shown<'_>) {
    let on_paper = |point: [f64; 3]| view.on_paper(point);
    for tree in shown.trees {
        for leaf in &tree.leaves {
            // A leaf's area as seen, spread over its vertices and its middle.
            let outline = leaf.outline();
            let seen_m2 = leaf.area_m2() * leaf.normal()[view.along].abs() / (outline.len() + 1) as f64;
            for point in outline.iter().copied().chain([leaf.centroid()]) {
                canvas.shade(on_paper(point), seen_m2);
            }
        }
    }
    for facet in shown.trees.iter().flat_map(|tree| &tree.facets).chain(shown.ground(view)) {
        let colour = Material::of_surface(facet.surface).rgb();
        let outline = facet.polygon.outline().iter().copied();
        outline.chain([facet.polygon.centroid()]).for_each(|point| canvas.dot(on_paper(point), colour));
    }
    let mut wood: Vec<&Cylinder> = shown.trees.iter().flat_map(|tree| &tree.wood).collect();
    wood.sort_by(|a, b| b.radius_m().total_cmp(&a.radius_m()));
    let is_bare = shown.trees.iter().all(|tree| tree.leaves.is_empty());
    let most = if is_bare { MOST_BARE_WOOD } else { MOST_WOOD };
    for piece in wood.into_iter().take(most) {
        let thick_m = 2.0 * piece.radius_m();
        canvas.line(on_paper(piece.base()), on_paper(piece.tip()), thick_m, Material::Wood.rgb());
    }
}

/// Wood, leaves and the rest as silhouettes, one over the other.
fn fill(canvas: &mut Canvas, view: View, shown: &Shown<'_>) {
    let polygon =
        |polygon: &Leaf| -> Contour { polygon.outline().iter().map(|point| view.on_paper(*point)).collect() };
    let wood = shown.trees.iter().flat_map(|tree| &tree.wood);
    canvas.fill(&Silhouette::of(wood.map(|piece| view.outline(piece))), Material::Wood.rgb());
    let leaves = Silhouette::of(shown.trees.iter().flat_map(|tree| &tree.leaves).map(polygon));
    canvas.fill(&leaves, Material::Leaf.rgb());
    canvas.note(format!("leaves cover {:.2} m²", leaves.area_m2()));
    let mut facets: BTreeMap<[u8; 3], Vec<Contour>> = BTreeMap::new();
    for facet in shown.trees.iter().flat_map(|tree| &tree.facets).chain(shown.ground(view)) {
        facets.entry(Material::of_surface(facet.surface).rgb()).or_default().push(polygon(&facet.polygon));
    }
    for (colour, polygons) in facets {
        canvas.fill(&Silhouette::of(polygons.into_iter()), colour);
    }
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
        let drawn = draw(&orchard, &[hit], &Drawing::default(), None);
        assert_eq!(drawn.matches("<g ").count(), 3);
        assert!(drawn.contains("front") && drawn.contains("side") && drawn.contains("top"));
        assert!(drawn.contains("#005adc"), "the return is there");
        assert!(drawn.contains("#787878") && drawn.contains("#3c508c"), "posts and wires are there");
        assert!(drawn.len() < 90_000, "{} bytes", drawn.len());
        assert_eq!(drawn, draw(&orchard, &[hit], &Drawing::default(), None));
    }

    #[test]
    fn a_scan_has_a_title_and_a_legend_of_what_it_met() {
        let parameters = OrchardParameters { trees: Some(1), ..OrchardParameters::of(Preset::FruitingWall) };
        let orchard = Orchard::grow(&parameters, 1, &|_, _| {}).unwrap();
        let hits = [Class::Leaf, Class::Wood].map(|class| Dot { at: [-0.3, 1.0, 2.0], class });
        let drawn = draw(&orchard, &hits, &Drawing::default(), Some("spindle, seed 1: lateral scan"));
        for words in
            ["spindle, seed 1: lateral scan", "return of leaf", "return of wood", "leaf area behind a cell"]
        {
            assert!(drawn.contains(words), "{words}");
        }
        assert!(!drawn.contains("return of fruit"), "nothing was met that is not there");
    }

    #[test]
    fn outlines_tell_what_leaves_cover_and_repeat() {
        let corners = |y: f64| vec![[0.0, y, 1.0], [0.0, y + 0.1, 1.0], [0.0, y + 0.1, 1.1], [0.0, y, 1.1]];
        let leaf = |y: f64| Leaf::new(corners(y)).unwrap();
        // Too small to be drawn.
        let speck = Leaf::new(vec![[0.0, 0.3, 1.0], [0.0, 0.3002, 1.0], [0.0, 0.3, 1.0002]]).unwrap();
        let tree = Tree { leaves: vec![speck, leaf(0.0), leaf(0.05), leaf(0.5)], ..Tree::default() };
        let orchard = Orchard::from_trees(vec![tree], 1.0, None, None);
        let settings = Drawing { outlines: true, ..Drawing::default() };
        let drawn = draw(&orchard, &[], &settings, None);
        // Two of three overlap by half from the front, and none is seen from above.
        assert!(drawn.contains("leaves cover 0.03 m²") && drawn.contains("leaves cover 0.00 m²"), "{drawn}");
        assert!(drawn.contains("M0 100l0 100 150 0 0 -100 z"), "{drawn}");
        assert!(!drawn.contains("lz"), "a path without a step: {drawn}");
        assert_eq!(drawn, draw(&orchard, &[], &settings, None));
    }

    #[test]
    fn a_cylinder_covers_its_side_and_its_end() {
        let covered = |tip: [f64; 3]| {
            let piece = Cylinder::new([0.2, 0.1, 0.3], tip, 0.05).unwrap();
            let [front, ..] = VIEWS;
            Silhouette::of([front.outline(&piece)].into_iter()).area_m2()
        };
        let end_m2 = std::f64::consts::PI * 0.05 * 0.05;
        // Across the view, along it, and halfway between.
        for (tip, expected_m2) in [
            ([0.2, 1.1, 0.3], 0.1),
            ([1.2, 0.1, 0.3], end_m2),
            ([1.2, 1.1, 0.3], 0.1 + end_m2 / f64::sqrt(2.0)),
        ] {
            let found_m2 = covered(tip);
            // A rim of sixteen corners lies inside the circle.
            assert!(
                (0.97..=1.0 + 1e-9).contains(&(found_m2 / expected_m2)),
                "{tip:?}: {found_m2} of {expected_m2}"
            );
        }
    }

    #[test]
    fn nothing_is_drawn_as_nothing() {
        let empty = Orchard::from_trees(vec![Tree::default()], 1.0, None, None);
        let drawn = draw(&empty, &[], &Drawing::default(), None);
        assert!(drawn.starts_with("<svg") && !drawn.contains("<g "));
    }
}
