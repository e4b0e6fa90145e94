//! How trees stand: rows, places and distances.

use crate::parameters::parameters;

parameters! {
    /// How trees stand.
    pub struct Layout;
    /// A layout of which every value may be left to the preset.
    pub overrides LayoutOverrides;

    /// Rows of different trees, one row spacing apart, from X = 0 away from the scanner.
    rows: u32 = 1, "rows", "the scanner sees one row; a second is the background";
    /// Places for trees in a row; after them the row repeats.
    trees: u32 = 3, "trees", "three trees make the regressions steadier than one";
    /// Places at both ends of every row where nothing stands: the headland.
    row_ends: u32 = 0, "places", "rows repeat; with gaps at their ends they begin and end";
    /// Distance between trees in the row.
    tree_spacing_m: f64 = 3.0, "m", "free-standing apple 2 to 3.5 m";
    /// Distance between rows.
    row_spacing_m: f64 = 5.0, "m", "free-standing apple 4.5 to 6 m";
    /// Trees that differ; every place gets a copy of one of them, drawn at random. 0: every place a tree of its own.
    distinct_trees: u32 = 0, "trees", "memory grows with distinct trees, not with places";
    /// Directions that copies may face, evenly spread about the vertical.
    directions: u32 = 2, "directions", "front and back: a turned tree keeps to its envelope";
}
