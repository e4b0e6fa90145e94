//! What is written is what is read: text to the bit, meshes to single precision.

use rowscan_scenes::exchange::text::{self, TreeColumn};
use rowscan_scenes::exchange::{obj, ply};
use rowscan_scenes::import::{ImportParameters, Stands};
use rowscan_scenes::orchard::{OrchardParameters, Preset};
use rowscan_scenes::parameters::SceneFile;
use rowscan_scenes::{GeneratorKind, Leaf, Orchard, Tree};

fn grown() -> Orchard {
    let mut parameters = OrchardParameters { trees: Some(3), ..OrchardParameters::of(Preset::FruitingWall) };
    parameters.tree.iterations = Some(8);
    Orchard::grow(&parameters, 4, &|_, _| {}).unwrap()
}

fn read(import: ImportParameters) -> Orchard {
    let parameters = OrchardParameters {
        generator: Some(GeneratorKind::Import),
        import: ImportParameters { stands: Stands::InPlace, ..import },
        trees: Some(3),
        ..OrchardParameters::of(Preset::FruitingWall)
    };
    let bare = OrchardParameters { trellis: rowscan_scenes::Trellis::default().as_overrides(), ..parameters };
    Orchard::grow(&bare, 1, &|_, _| {}).unwrap()
}

fn from_text(orchard: &Orchard) -> Orchard {
    let file = |name: &str, text: String| Some(SceneFile::with_content(name, text.into_bytes()));
    read(ImportParameters {
        branches: file("b.txt", text::write_branches(orchard, TreeColumn::Written)),
        leaves: file("l.txt", text::write_leaves(orchard, TreeColumn::Written)),
        ..ImportParameters::default()
    })
}

fn from_mesh(name: &str, content: Vec<u8>) -> Orchard {
    let mesh = Some(SceneFile::with_content(name, content));
    read(ImportParameters { mesh, ..ImportParameters::default() })
}

#[test]
fn text_goes_round_to_the_bit() {
    let orchard = grown();
    let once = from_text(&orchard);
    assert!(orchard.count(|tree| tree.leaves.len()) > 500);
    for (read, made) in once.trees().zip(orchard.trees()) {
        assert!(read.wood == made.wood, "branches to the bit");
        assert!(
            read.leaves.iter().map(Leaf::outline).eq(made.leaves.iter().map(Leaf::outline)),
            "and leaves"
        );
    }
    assert!(from_text(&once) == once, "areas and normals too, once they are those of the file");
}

#[test]
fn meshes_go_round_within_single_precision() {
    let orchard = grown();
    let through_obj = |orchard: &Orchard| from_mesh("t.obj", obj::write(orchard, "t.mtl").0.into_bytes());
    let through_ply = |orchard: &Orchard| from_mesh("t.ply", ply::write(orchard));
    for through in [&through_obj as &dyn Fn(&Orchard) -> Orchard, &through_ply] {
        let once = through(&orchard);
        let counts = |orchard: &Orchard| orchard.trees().map(|tree| tree.leaves.len()).collect::<Vec<_>>();
        assert_eq!(counts(&once), counts(&orchard));
        for (read, made) in once.trees().zip(orchard.trees()) {
            for (read, made) in read.leaves.iter().zip(&made.leaves) {
                for (read, made) in read.outline().iter().flatten().zip(made.outline().iter().flatten()) {
                    assert_eq!(*read as f32, *made as f32);
                }
            }
            // Branches came as prisms of their lateral area.
            assert!(read.wood.is_empty() && read.facets.len() >= 8 * made.wood.len());
        }
        let (read, made) = (once.truth(), orchard.truth());
        assert!((read.leaf_area_m2 / made.leaf_area_m2 - 1.0).abs() < 1e-4);
        assert!(
            (read.wood_area_m2 / made.wood_area_m2 - 1.0).abs() < 1e-3,
            "{} {}",
            read.wood_area_m2,
            made.wood_area_m2
        );
        assert!((read.post_area_m2 / made.post_area_m2 - 1.0).abs() < 1e-4);
        // What came from a mesh goes round unchanged.
        let twice = through(&once);
        let same = |a: &Tree, b: &Tree| a == b;
        assert!(once.trees().zip(twice.trees()).all(|(a, b)| same(&a, &b)));
    }
}
