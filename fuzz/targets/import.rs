//! Any file as trees: OBJ, PLY, branches or leaves as text. It holds trees or is refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_scenes::exchange::mesh::Material;
use rowscan_scenes::import::ImportParameters;
use rowscan_scenes::parameters::SceneFile;

fuzz_target!(|data: &[u8]| {
    let Some((&choice, bytes)) = data.split_first() else { return };
    let file = |name: &str| Some(SceneFile::with_content(name, bytes));
    let mut parameters = ImportParameters { material: Some(Material::Leaf), ..ImportParameters::default() };
    match choice % 4 {
        0 => parameters.mesh = file("x.obj"),
        1 => parameters.mesh = file("x.ply"),
        2 => parameters.branches = file("x.txt"),
        _ => parameters.leaves = file("x.txt"),
    }
    if let Ok(count) = parameters.count_trees() {
        assert!(count >= 1);
    }
});
