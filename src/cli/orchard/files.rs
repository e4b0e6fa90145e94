//! The formats an orchard is written in.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use rowscan_files::is_standard_output;
use rowscan_scenes::Orchard;
use rowscan_scenes::exchange::text::{self, TreeColumn};
use rowscan_scenes::exchange::{gltf, obj, ply};

use crate::cli::Failure;
use crate::cli::output::{self, name_of, say};

/// A format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum FileFormat {
    /// PREFIX_branches.txt and PREFIX_leaves.txt, with the number of each organ's tree; equal to the bit when read back
    Text,
    /// PREFIX.obj and PREFIX.mtl: faces by material, single precision
    Obj,
    /// PREFIX.ply: the same, binary little-endian
    Ply,
    /// PREFIX.glb: triangles by material, one mesh a distinct tree
    Gltf,
}

/// Writes an orchard in every format asked for.
pub(super) fn write(orchard: &Orchard, prefix: &Path, formats: &[FileFormat]) -> Result<(), Failure> {
    let two_files = |format: &FileFormat| matches!(format, FileFormat::Text | FileFormat::Obj);
    if is_standard_output(prefix) && (formats.len() != 1 || formats.iter().any(two_files)) {
        return Err(Failure::Usage(
            "standard output takes one file: expected one format, ply or gltf, with `-o -`".to_owned(),
        ));
    }
    let wrote = |path: &Path| say(format_args!("wrote {}", name_of(path)));
    for format in formats {
        match format {
            FileFormat::Text => write_text(orchard, prefix, TreeColumn::Written)?,
            FileFormat::Obj => {
                let library = named(prefix, ".mtl");
                let name = library.file_name().unwrap_or_default().to_string_lossy();
                let (mesh, materials) = obj::write(orchard, &name);
                let path = named(prefix, ".obj");
                output::write_file(&library, &materials)?;
                output::write_file(&path, &mesh)?;
                wrote(&path);
            }
            FileFormat::Ply => {
                let path = named(prefix, ".ply");
                output::write_file(&path, &ply::write(orchard))?;
                wrote(&path);
            }
            FileFormat::Gltf => {
                let path = named(prefix, ".glb");
                output::write_file(&path, &gltf::write(orchard))?;
                wrote(&path);
            }
        }
    }
    Ok(())
}

/// Writes branches and leaves as text.
pub(super) fn write_text(orchard: &Orchard, prefix: &Path, column: TreeColumn) -> Result<(), Failure> {
    output::write_file(&named(prefix, "_branches.txt"), &text::write_branches(orchard, column))?;
    output::write_file(&named(prefix, "_leaves.txt"), &text::write_leaves(orchard, column))?;
    say(format_args!("wrote {}_branches.txt and {0}_leaves.txt", prefix.display()));
    if column == TreeColumn::Written && orchard.count(|tree| tree.facets.len()) > 0 {
        say(
            "text holds leaves and branches only: surfaces given as polygons are left out; write obj or ply for them",
        );
    }
    Ok(())
}

fn named(prefix: &Path, ending: &str) -> PathBuf {
    if is_standard_output(prefix) {
        return prefix.to_owned();
    }
    let mut name = prefix.to_owned().into_os_string();
    name.push(ending);
    PathBuf::from(name)
}
