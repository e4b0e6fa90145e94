//! `rowscan orchard import`

use std::path::{Path, PathBuf};

use rowscan_scenes::exchange::mesh::Material;
use rowscan_scenes::import::{ImportParameters, NotPlane, Stands, UpAxis};
use rowscan_scenes::parameters::SceneFile;
use rowscan_scenes::{GeneratorKind, Orchard, OrchardParameters};
use serde::Serialize;

use super::files::{self, FileFormat};
use crate::cli::blocking::off_runtime;
use crate::cli::output::{self, say};
use crate::cli::{Failure, Format, Outcome};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Branches as text: x1 y1 z1 x2 y2 z2 diameter a line
    #[arg(long, value_name = "FILE", required_unless_present_any = ["leaves", "mesh"])]
    branches: Option<PathBuf>,
    /// Leaves as text: n x1 y1 z1 … xn yn zn a line
    #[arg(long, value_name = "FILE")]
    leaves: Option<PathBuf>,
    /// A mesh, .obj or .ply
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// A material name of the mesh that is leaf, beside those known; repeatable
    #[arg(long, value_name = "NAME")]
    leaf_material: Vec<String>,
    /// A material name of the mesh that is wood; repeatable
    #[arg(long, value_name = "NAME")]
    wood_material: Vec<String>,
    /// A material name of the mesh that is left out; repeatable
    #[arg(long, value_name = "NAME")]
    ignore_material: Vec<String>,
    /// Material of faces that have none: leaf, wood, fruit, post or wire
    #[arg(long, value_name = "MATERIAL", value_parser = material)]
    material: Option<Material>,
    /// Which axis points up: z or y
    #[arg(long, value_name = "AXIS", default_value = "z", value_parser = up)]
    up: UpAxis,
    /// Metres of one unit of the files
    #[arg(long, value_name = "METRES", default_value_t = 1.0)]
    scale: f64,
    /// Leaves that are not plane: triangulate, flatten or refuse
    #[arg(long, value_name = "HOW", default_value = "triangulate", value_parser = not_plane)]
    not_plane: NotPlane,
    /// Distance between trees, for the length of the row and the leaf area index
    #[arg(long, value_name = "METRES", default_value_t = 1.5)]
    tree_spacing: f64,
    /// Distance between rows, for the leaf area index
    #[arg(long, value_name = "METRES", default_value_t = 4.0)]
    row_spacing: f64,
    /// Write files that begin with this
    #[arg(short, long, value_name = "PREFIX")]
    output: Option<PathBuf>,
    /// Which files
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "text", requires = "output")]
    write: Vec<FileFormat>,
    /// How to write the summary
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// A choice by its name.
fn choice<T: Copy>(text: &str, names: &[&str], all: &[T]) -> Result<T, String> {
    let found = names.iter().zip(all).find(|(name, _)| **name == text).map(|(_, choice)| *choice);
    found.ok_or_else(|| format!("expected one of {}", names.join(", ")))
}

fn material(text: &str) -> Result<Material, String> {
    choice(text, Material::NAMES, Material::ALL)
}

fn up(text: &str) -> Result<UpAxis, String> {
    choice(text, UpAxis::NAMES, UpAxis::ALL)
}

fn not_plane(text: &str) -> Result<NotPlane, String> {
    choice(text, NotPlane::NAMES, NotPlane::ALL)
}

/// What was in the files.
#[derive(Debug, Serialize)]
struct Imported {
    trees: usize,
    leaves: usize,
    wood_segments: usize,
    facets: usize,
    leaf_area_m2: f64,
    wood_area_m2: f64,
    height_m: f64,
    lai: Option<f64>,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    off_runtime("import the trees", move || import(&args)).await
}

fn import(args: &Args) -> Result<Outcome, Failure> {
    let orchard = read(args)?;
    orchard.remarks().iter().for_each(say);
    if let Some(prefix) = &args.output {
        files::write(&orchard, prefix, &args.write)?;
    }
    let truth = orchard.truth();
    let imported = Imported {
        trees: truth.trees.len(),
        leaves: orchard.count(|tree| tree.leaves.len()),
        wood_segments: orchard.count(|tree| tree.wood.len()),
        facets: orchard.count(|tree| tree.facets.len()),
        leaf_area_m2: truth.leaf_area_m2,
        wood_area_m2: truth.wood_area_m2,
        height_m: truth.trees.iter().map(|tree| tree.height_m).fold(0.0, f64::max),
        lai: truth.lai,
    };
    match args.format {
        Format::Json => output::print_json(args.format, &imported)?,
        format => output::print_rows(format, &[imported])?,
    }
    Ok(Outcome::Done)
}

/// All trees of the files, where the files say.
fn read(args: &Args) -> Result<Orchard, Failure> {
    let file = |path: &Option<PathBuf>| path.as_deref().map(open).transpose();
    let mut import = ImportParameters {
        branches: file(&args.branches)?,
        leaves: file(&args.leaves)?,
        mesh: file(&args.mesh)?,
        stands: Stands::InPlace,
        up: args.up,
        scale: args.scale,
        not_plane: args.not_plane,
        material: args.material,
        ..ImportParameters::default()
    };
    import.materials.leaf.extend(args.leaf_material.iter().cloned());
    import.materials.wood.extend(args.wood_material.iter().cloned());
    import.materials.ignore.extend(args.ignore_material.iter().cloned());
    let parameters = OrchardParameters {
        generator: Some(GeneratorKind::Import),
        trees: Some(import.count_trees()?),
        rows: Some(1),
        tree_spacing_m: Some(args.tree_spacing),
        row_spacing_m: Some(args.row_spacing),
        import,
        ..OrchardParameters::default()
    };
    Ok(Orchard::grow(&parameters, 0, &|_, _| {})?)
}

fn open(path: &Path) -> Result<SceneFile, Failure> {
    let mut file = SceneFile::named(path.display().to_string());
    rowscan_scenes::files::fill(&mut file, Path::new(""))?;
    Ok(file)
}
