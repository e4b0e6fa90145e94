//! The truth by cell, of every row.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{Cell, CellGrid, Cylinder, Facet, Leaf, Orchard, Surface, Tree, TruthGrid};

/// A rectangle in the plane x = 0.3.
fn board(y: [f64; 2], z: [f64; 2]) -> Leaf {
    Leaf::new(vec![[0.3, y[0], z[0]], [0.3, y[1], z[0]], [0.3, y[1], z[1]], [0.3, y[0], z[1]]]).unwrap()
}

fn row_of(tree: Tree, length_m: f64) -> Orchard {
    Orchard::from_trees(vec![Tree::default(), tree], length_m, Some(length_m / 2.0), Some(4.0))
}

/// The cells by their lower faces, in steps.
fn by_cell(orchard: &Orchard) -> BTreeMap<(i64, i64), Cell> {
    let cells = orchard.cells(CellGrid::default());
    let number = |cell: Cell| ((cell.y_from_m * 10.0).round() as i64, (cell.z_from_m * 2.0).round() as i64);
    cells[0].cells().map(|cell| (number(cell), cell)).collect()
}

#[test]
fn a_board_is_cut_at_the_faces_of_cells_and_bands() {
    // From 0.25 to 1.05 along the row, from 0.4 to 1.7: whole cells have 0.1 m by 0.5 m.
    let tree = Tree { leaves: vec![board([0.25, 1.05], [0.4, 1.7])], ..Tree::default() };
    let cells = by_cell(&row_of(tree, 4.0));
    let (along, up) = ([0.05, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.05], [0.1, 0.5, 0.5, 0.2]);
    assert_eq!(cells.len(), along.len() * up.len());
    for (y, length) in (2..).zip(along) {
        for (z, height) in (0..).zip(up) {
            let cell = cells[&(y, z)];
            assert!((cell.areas.leaf_area_m2 - length * height).abs() < 1e-12, "{cell:?}");
            assert_eq!((cell.areas.wood_area_m2, cell.areas.fruit_area_m2), (0.0, 0.0));
            assert_eq!((cell.row, cell.tree), (0, 1), "it belongs to the tree that bears it");
            assert_eq!((cell.y_from_m, cell.y_to_m), (y as f64 / 10.0, (y + 1) as f64 / 10.0));
            assert_eq!((cell.z_from_m, cell.z_to_m), (z as f64 / 2.0, (z + 1) as f64 / 2.0));
        }
    }
}

#[test]
fn a_board_that_ends_at_faces_fills_whole_cells_and_no_other() {
    let tree = Tree { leaves: vec![board([0.3, 0.7], [0.5, 1.0])], ..Tree::default() };
    let cells = by_cell(&row_of(tree, 4.0));
    assert_eq!(cells.keys().copied().collect::<Vec<_>>(), [(3, 1), (4, 1), (5, 1), (6, 1)]);
    assert!(cells.values().all(|cell| (cell.areas.leaf_area_m2 - 0.05).abs() < 1e-12));
}

#[test]
fn a_slanting_triangle_and_a_notch_are_cut_both_ways() {
    // The half below the diagonal of 0.2 m by 1 m: of its four cells the one above it is empty.
    let triangle = Leaf::new(vec![[0.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.2, 1.0]]).unwrap();
    let cells = by_cell(&row_of(Tree { leaves: vec![triangle], ..Tree::default() }, 4.0));
    let found: Vec<_> = cells.iter().map(|(number, cell)| (*number, cell.areas.leaf_area_m2)).collect();
    for ((number, area), (expected, m2)) in
        found.iter().zip([((0, 0), 0.025), ((1, 0), 0.05), ((1, 1), 0.025)])
    {
        assert!(*number == expected && (area - m2).abs() < 1e-12, "{found:?}");
    }
    assert_eq!(found.len(), 3);
    // A U: its notch is in the middle cell, above 0.25 m.
    let corners =
        [(0.0, 0.0), (0.3, 0.0), (0.3, 1.0), (0.2, 1.0), (0.2, 0.25), (0.1, 0.25), (0.1, 1.0), (0.0, 1.0)];
    let notched = Leaf::new(corners.iter().map(|(y, z)| [0.0, *y, *z]).collect::<Vec<_>>()).unwrap();
    let cells = by_cell(&row_of(Tree { leaves: vec![notched], ..Tree::default() }, 4.0));
    assert!((cells[&(1, 0)].areas.leaf_area_m2 - 0.025).abs() < 1e-12);
    assert!(!cells.contains_key(&(1, 1)));
    assert!(
        [(0, 0), (0, 1), (2, 0), (2, 1)].iter().all(|at| (cells[at].areas.leaf_area_m2 - 0.05).abs() < 1e-12)
    );
}

#[test]
fn wood_is_shared_out_by_length_and_fruit_is_cut() {
    // From (0.05, 0.25) to (0.25, 1.25): crosses faces at 1/4 (both), 3/4 (both).
    let branch = Cylinder::new([0.0, 0.05, 0.25], [0.0, 0.25, 1.25], 0.01).unwrap();
    let fruit = Facet { surface: Surface::Fruit, polygon: board([0.0, 0.2], [1.5, 1.6]) };
    let bark = Facet { surface: Surface::Bark, polygon: board([0.5, 0.55], [1.5, 1.6]) };
    let post = Facet { surface: Surface::Post, polygon: board([0.8, 0.85], [1.5, 1.6]) };
    let tree = Tree { leaves: vec![], wood: vec![branch], facets: vec![fruit, bark, post] };
    let cells = by_cell(&row_of(tree, 4.0));
    let total = 2.0 * PI * 0.01 * 0.2f64.hypot(1.0);
    for (at, share) in [((0, 0), 0.25), ((1, 1), 0.5), ((2, 2), 0.25)] {
        assert!((cells[&at].areas.wood_area_m2 - share * total).abs() < 1e-12, "{at:?}");
    }
    assert!([(0, 3), (1, 3)].iter().all(|at| (cells[at].areas.fruit_area_m2 - 0.01).abs() < 1e-12));
    assert!((cells[&(5, 3)].areas.wood_area_m2 - 0.005).abs() < 1e-12);
    assert_eq!(cells.len(), 6, "a post is no part of a tree");
}

#[test]
fn what_reaches_over_the_end_counts_where_the_row_repeats_it() {
    // The row is 2.05 m long: its last cell is half as long as the others.
    let tree = Tree { leaves: vec![board([1.9, 2.15], [0.0, 0.5])], ..Tree::default() };
    let orchard = row_of(tree, 2.05);
    let cells = by_cell(&orchard);
    for (y, m2) in [(0, 0.05), (19, 0.05), (20, 0.025)] {
        assert!((cells[&(y, 0)].areas.leaf_area_m2 - m2).abs() < 1e-12, "{cells:?}");
    }
    assert_eq!((cells.len(), cells[&(20, 0)].y_to_m), (3, 2.05));
    let row = orchard.cells_of_row(0, CellGrid::default()).unwrap();
    for y_m in [0.05, 2.1, -2.0] {
        let column = row.column(y_m);
        assert_eq!((column.y_from_m, column.bands.len()), (0.0, 1), "{y_m}");
        assert!((column.bands[0].areas.leaf_area_m2 - 0.05).abs() < 1e-12);
    }
    assert_eq!(row.column(1.0).bands[0].areas.leaf_area_m2, 0.0, "known to be empty");
    // Without a period nothing is folded.
    let endless = Orchard::from_organs(vec![board([-0.1, 0.1], [0.0, 0.5])], vec![], f64::INFINITY);
    assert_eq!(by_cell(&endless).keys().copied().collect::<Vec<_>>(), [(-1, 0), (0, 0)]);
    assert!(orchard.cells_of_row(1, CellGrid::default()).is_none());
    assert!(orchard.cells_of_row(0, CellGrid { cell_m: 0.0, band_m: 0.5 }).is_none());
}

#[test]
fn cells_sum_to_the_rows_trees_and_slabs_of_several_rows() {
    let parameters = OrchardParameters { missing: vec![1].into(), ..OrchardParameters::of(Preset::Spindle) };
    let parameters = OrchardParameters { trees: Some(3), rows: Some(2), ..parameters };
    let orchard = Orchard::grow(&parameters, 6, &|_, _| {}).unwrap();
    let rows = orchard.cells(CellGrid::default());
    assert_eq!(rows.iter().map(|row| row.row()).collect::<Vec<_>>(), [0, 1]);
    assert_ne!(rows[0].cells().map(|c| c.areas.leaf_area_m2).sum::<f64>(), 0.0);
    for row in &rows {
        let truth = orchard.truth_of_row(row.row(), TruthGrid { slab_m: 0.1, band_m: 0.5 });
        let sum = |of: &dyn Fn(&Cell) -> Option<f64>| row.cells().filter_map(|cell| of(&cell)).sum::<f64>();
        let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        near(sum(&|cell| Some(cell.areas.leaf_area_m2)), truth.leaf_area_m2);
        near(sum(&|cell| Some(cell.areas.wood_area_m2)), truth.wood_area_m2);
        for tree in &truth.trees {
            let own = |cell: &Cell| cell.tree == tree.tree;
            near(sum(&|cell| own(cell).then_some(cell.areas.leaf_area_m2)), tree.leaf_area_m2);
            near(sum(&|cell| own(cell).then_some(cell.areas.wood_area_m2)), tree.wood_area_m2);
        }
        for slab in &truth.slabs {
            let inside = |cell: &Cell| (cell.y_from_m - slab.y_from_m).abs() < 1e-6;
            near(sum(&|cell| inside(cell).then_some(cell.areas.leaf_area_m2)), slab.leaf_area_m2);
            near(sum(&|cell| inside(cell).then_some(cell.areas.wood_area_m2)), slab.wood_area_m2);
            let column = row.column(slab.y_from_m.midpoint(slab.y_to_m));
            near(column.bands.iter().map(|band| band.areas.leaf_area_m2).sum(), slab.leaf_area_m2);
        }
        for band in &truth.bands {
            let inside = |cell: &Cell| (cell.z_from_m - band.z_from_m).abs() < 1e-6;
            near(sum(&|cell| inside(cell).then_some(cell.areas.leaf_area_m2)), band.leaf_area_m2);
        }
    }
}
