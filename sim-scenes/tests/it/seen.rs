//! What a side can see of each cell.

use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::{Caster, CellGrid, Cylinder, Leaf, Orchard, SeenCell, Track, Tree};

const LEFT: Track = Track { aside_m: -2.0, height_m: 1.5 };
const RIGHT: Track = Track { aside_m: 2.0, height_m: 1.5 };

/// A rectangle in a plane across the view.
fn board(x: f64, y: [f64; 2], z: [f64; 2]) -> Leaf {
    Leaf::new(vec![[x, y[0], z[0]], [x, y[1], z[0]], [x, y[1], z[1]], [x, y[0], z[1]]]).unwrap()
}

fn seen(tree: Tree, track: Track) -> Vec<SeenCell> {
    let orchard = Orchard::from_trees(vec![tree], 4.0, Some(4.0), Some(4.0));
    orchard.seen_cells(&Caster::new(&orchard), 0, CellGrid::default(), track).unwrap()
}

fn sum(cells: &[SeenCell], of: fn(&SeenCell) -> f64) -> f64 {
    cells.iter().map(of).sum()
}

#[test]
fn a_board_before_another_hides_its_shadow() {
    // The near board, 0.5 m before the row, from 1.5 m up to 2.25 m, shades the one in the row plane up to 1.5 + 0.75 · 2 / 1.5 = 2.5 m.
    let leaves = vec![board(-0.5, [1.0, 2.0], [1.5, 2.25]), board(0.0, [1.0, 2.0], [1.5, 3.5])];
    let tree = Tree { leaves, ..Tree::default() };
    let cells = seen(tree.clone(), LEFT);
    let (visible, hidden) = (sum(&cells, |c| c.leaf_visible_m2), sum(&cells, |c| c.leaf_hidden_m2));
    assert!(
        (visible - (0.75 + 1.0)).abs() < 0.03 && (visible + hidden - 2.75).abs() < 1e-9,
        "{visible} {hidden}"
    );
    // Their cells lie over each other: 0.75 m² and none of 1 m² below 2.5 m, all above.
    for cell in cells.iter().filter(|cell| cell.cell.z_from_m >= 2.5) {
        assert!(cell.leaf_hidden_m2.abs() < 1e-9, "{cell:?}");
    }
    // From the other side the far board is the near one: the one behind it is hidden whole.
    let cells = seen(tree, RIGHT);
    let (visible, hidden) = (sum(&cells, |c| c.leaf_visible_m2), sum(&cells, |c| c.leaf_hidden_m2));
    // A cell's share is that of its patches, and patches are not cut at the cells' faces.
    assert!((visible - 2.0).abs() < 0.01 && (hidden - 0.75).abs() < 0.01, "{visible} {hidden}");
}

#[test]
fn half_of_a_post_of_wood_faces_either_side_and_a_board_edge_on_is_seen() {
    let wood = vec![Cylinder::new([0.0, 1.0, 0.5], [0.0, 1.0, 2.5], 0.05).unwrap()];
    // A leaf that lies level above the mirror is seen from below.
    let level =
        Leaf::new(vec![[-0.2, 2.0, 2.0], [0.2, 2.0, 2.0], [0.2, 2.4, 2.0], [-0.2, 2.4, 2.0]]).unwrap();
    let tree = Tree { wood, leaves: vec![level], ..Tree::default() };
    for track in [LEFT, RIGHT] {
        let cells = seen(tree.clone(), track);
        let share = sum(&cells, |c| c.wood_visible_m2) / sum(&cells, |c| c.cell.areas.wood_area_m2);
        assert!((share - 0.5).abs() < 0.05, "{share}");
        assert!((sum(&cells, |c| c.leaf_visible_m2) - 0.16).abs() < 1e-9);
    }
}

#[test]
fn what_is_visible_and_hidden_adds_up_to_the_cells_of_every_row() {
    let parameters =
        OrchardParameters { rows: Some(2), trees: Some(2), ..OrchardParameters::of(Preset::FruitingWall) };
    let orchard = Orchard::grow(&parameters, 3, &|_, _| {}).unwrap();
    let caster = Caster::new(&orchard);
    let track = Track { aside_m: -2.5, height_m: 1.6 };
    for row in 0..2 {
        let cells = orchard.seen_cells(&caster, row, CellGrid::default(), track).unwrap();
        let plain: Vec<_> = orchard.cells_of_row(row, CellGrid::default()).unwrap().cells().collect();
        assert_eq!(cells.iter().map(|cell| cell.cell).collect::<Vec<_>>(), plain);
        for cell in &cells {
            assert!(
                (cell.leaf_visible_m2 + cell.leaf_hidden_m2 - cell.cell.areas.leaf_area_m2).abs() < 1e-12
            );
            assert!(
                (cell.wood_visible_m2 + cell.wood_hidden_m2 - cell.cell.areas.wood_area_m2).abs() < 1e-12
            );
            assert!(cell.leaf_visible_m2 >= 0.0 && cell.leaf_hidden_m2 >= 0.0);
        }
        let truth = orchard.truth_of_row(row, Default::default());
        assert!(
            (sum(&cells, |c| c.leaf_visible_m2 + c.leaf_hidden_m2) / truth.leaf_area_m2 - 1.0).abs() < 1e-9
        );
        let share = sum(&cells, |c| c.leaf_visible_m2) / truth.leaf_area_m2;
        assert!((0.1..=1.0).contains(&share), "{share}");
        let wood = sum(&cells, |c| c.wood_visible_m2) / truth.wood_area_m2;
        assert!(wood < 0.55, "no more than one side of it: {wood}");
    }
}
