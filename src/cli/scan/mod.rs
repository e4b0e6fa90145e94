//! `rowscan scan`: one of the paper's scans, offline, as fast as it goes.

mod layout;
mod matrix;
mod picture;
mod points;

use std::path::PathBuf;

use clap::ValueEnum;
use rowscan_scenes::caster::Class;
use rowscan_scenes::files;
use rowscan_scenes::optics::{EyeCaster, EyeModel, RangeLimits};
use rowscan_scenes::scan::{
    Casts, LAYERS, ScanAreas, ScanError, ScanKind, ScanPlan, ScanSettings, Target, WoodTest,
};
use rowscan_scenes::{Beams, Scene, TruthGrid};
use serde::Serialize;

use super::blocking::off_runtime;
use super::interrupt::Interrupt;
use super::models;
use super::output::{self, say};
use super::pictured;
use super::scene::OpticsArgs;
use super::table_file::TableFile;
use super::{Failure, Format, Outcome, progress};
use crate::export::TableFormat;
use rowscan_emulator::stage::Stage;

pub(super) use layout::ScanArgs;
use picture::{ColourBy, Shot};
use points::{Ground, Kept, Point};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A scene file, or the name of a built-in scene; its rig's first scanner gives distance and height
    #[arg(value_name = "SCENE", default_value = "spindle")]
    scene: String,
    /// Seed of everything random, instead of the scene's own
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// lateral, opposite, lateral-orthogonal, opposite-orthogonal, zenith or zenith-orthogonal
    #[arg(long = "type", value_name = "TYPE", default_value = "lateral", value_parser = kind)]
    kind: ScanKind,
    #[command(flatten)]
    layout: ScanArgs,
    #[command(flatten)]
    optics: OpticsArgs,
    /// First and last value of what is swept (degrees or metres), instead of what the canopy asks for
    #[arg(long, value_name = "FROM..TO", value_parser = range, allow_hyphen_values = true)]
    range: Option<(f64, f64)>,
    /// Drive midway between two rows of different trees and scan both: files *_left and *_right
    #[arg(long)]
    two_rows: bool,
    /// Write files that begin with this
    #[arg(short, long, value_name = "PREFIX")]
    output: Option<PathBuf>,
    /// Which files
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "matrix,csv",
        requires = "output"
    )]
    write: Vec<File>,
    /// Draw the returns over the trees to this PNG or SVG file; an angular or orthogonal scan from the side as a side view, from above as a plan
    #[arg(long, value_name = "FILE", conflicts_with = "two_rows")]
    picture: Option<PathBuf>,
    /// What the colours of the returns in the picture say
    #[arg(long, value_enum, default_value_t, requires = "picture")]
    colour_by: ColourBy,
    /// Only points of these classes: leaf, wood, fruit, post, wire, ground
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', requires = "output", value_parser = class)]
    only: Vec<Class>,
    /// How to write the areas
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// What can be written of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum File {
    /// PREFIX_L.csv: matrix L, a row a beam, a column a line, metres; PREFIX_L.txt: what it is
    Matrix,
    /// PREFIX_L.npy: the same as 32-bit floats for NumPy, without header and first column; PREFIX_L.txt
    Npy,
    /// PREFIX_points.csv: every return with its labels
    Csv,
    /// PREFIX_points.ply: the same, binary little-endian
    Ply,
    /// PREFIX_points.las: the same, LAS 1.4, without the ground beyond the orchard
    Las,
}

fn kind(text: &str) -> Result<ScanKind, String> {
    ScanKind::from_name(text).ok_or_else(|| format!("expected one of {}", ScanKind::NAMES.join(", ")))
}

fn class(text: &str) -> Result<Class, String> {
    let known = || Class::ALL.iter().filter(|class| **class != Class::None);
    let found = known().find(|class| class.name() == text);
    let names = || known().map(|class| class.name()).collect::<Vec<_>>().join(", ");
    found.copied().ok_or_else(|| format!("expected some of {}, found `{text}`", names()))
}

fn range(text: &str) -> Result<(f64, f64), String> {
    let both = text.split_once("..").and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
    both.ok_or_else(|| format!("expected a range as FROM..TO, such as -40..60, found `{text}`"))
}

/// One scan of one row.
struct Task {
    suffix: &'static str,
    row: usize,
    settings: ScanSettings,
}

/// What came of it.
#[derive(Debug, Serialize)]
struct Scanned {
    #[serde(rename = "type")]
    kind: ScanKind,
    row: usize,
    seed: u64,
    lines: usize,
    beams: usize,
    dy_m: f64,
    range_from: f64,
    range_to: f64,
    origin_x_m: f64,
    origin_z_m: f64,
    leaf_hits: usize,
    wood_hits: usize,
    fruit_hits: usize,
    support_hits: usize,
    grass_hits: usize,
    ground_hits: usize,
    escapes: usize,
    #[serde(rename = "I_L")]
    leaf_m2: f64,
    #[serde(rename = "I_T")]
    total_m2: f64,
    #[serde(rename = "I_3L")]
    three_leaves_m2: f64,
    visible_leaf_area_m2: f64,
    leaf_area_m2: f64,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut interrupt = Interrupt::watch()?;
    interrupt.finite(off_runtime("scan", move || scan(&args))).await
}

fn scan(args: &Args) -> Result<Outcome, Failure> {
    args.picture.as_deref().map(pictured::check).transpose()?;
    let mut scene = files::load_scene(&args.scene)?;
    scene.seed = args.seed.unwrap_or(scene.seed);
    args.optics.over(&mut scene);
    if args.two_rows {
        scene.orchard.rows = Some(scene.orchard.layout().rows.max(2));
    }
    let tasks = tasks(args, &scene)?;
    let bar = progress::bar("growing", "trees", 0);
    let stage = Stage::grow(scene, &|done, of| {
        bar.set_length(of as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    super::scene::tell(&stage);
    let scans: Vec<Scanned> = tasks.iter().map(|task| one(args, &stage, task)).collect::<Result<_, _>>()?;
    output::print_rows(args.format, &scans)?;
    let blind =
        scans.iter().find(|scan| scan.leaf_hits + scan.wood_hits + scan.fruit_hits + scan.support_hits == 0);
    if let Some(scan) = blind {
        say(format_args!(
            "the {} scan sees nothing: no beam met a leaf, a branch, a post or a wire",
            scan.kind
        ));
        return Ok(Outcome::Finding);
    }
    Ok(Outcome::Done)
}

/// One scan, or the two of a drive between rows.
fn tasks(args: &Args, scene: &Scene) -> Result<Vec<Task>, Failure> {
    let rig = scene.resolved_rig();
    let mut base =
        ScanSettings { kind: args.kind, dy_m: 0.02, dtheta_deg: 0.5, pitch_m: 0.01, ..Default::default() };
    if let Some(mount) = rig.scanners.first() {
        base = ScanSettings { distance_m: mount.distance_m, height_m: mount.height_m, ..base };
    }
    let settings = ScanSettings { range: args.range, ..args.layout.over(base) };
    if !args.two_rows {
        return Ok(vec![Task { suffix: "", row: 0, settings }]);
    }
    let other = match args.kind {
        ScanKind::Lateral => ScanKind::Opposite,
        ScanKind::LateralOrthogonal => ScanKind::OppositeOrthogonal,
        found => {
            return Err(Failure::Usage(format!(
                "--two-rows scans to both sides: expected --type lateral or lateral-orthogonal, found {found}"
            )));
        }
    };
    // Driving towards +Y, the row on the left is the one at smaller X: seen towards −X.
    let midway = ScanSettings { distance_m: scene.orchard.layout().row_spacing_m / 2.0, ..settings };
    Ok(vec![
        Task { suffix: "_left", row: 0, settings: ScanSettings { kind: other, ..midway.clone() } },
        Task { suffix: "_right", row: 1, settings: midway },
    ])
}

/// What is kept of a line.
struct LineRecord {
    areas: ScanAreas,
    /// By class.
    counts: Vec<(Class, usize)>,
    ranges: Vec<f64>,
    points: Vec<Point>,
    shots: Vec<Shot>,
}

/// What casts the beams of a plan: the exact caster, the paper's mesh, or the eye of the rig's scanner.
fn caster(args: &Args, stage: &Stage, plan: &ScanPlan) -> Result<Box<dyn Casts>, Failure> {
    let optics = &stage.scene.optics;
    if optics.stages.is_ideal() {
        return Ok(args.layout.wood().caster(&stage.orchard)?);
    }
    let (Beams::Fan(fan), WoodTest::Exact) = (plan.beams(), args.layout.wood()) else {
        return Err(Failure::Usage(format!(
            "optics {} need the beams of a mirror and exact wood: expected --type lateral, opposite or zenith and --wood exact, or --optics ideal",
            optics.stages
        )));
    };
    let model = models::find(stage.rig.scanners.first().map_or("", |mount| mount.model.as_str()))?;
    let (min_range_m, max_range_m) = model.range_m();
    let limits = RangeLimits { min_range_m, max_range_m };
    let eye = EyeModel { optics: model.optics(), echoes: model.echoes(), limits };
    let towards_x = plan.settings().kind != ScanKind::Opposite;
    let caster = stage.caster().clone();
    Ok(Box::new(EyeCaster::new(caster, eye, optics, stage.scene.seed, fan, towards_x)))
}

fn one(args: &Args, stage: &Stage, task: &Task) -> Result<Scanned, Failure> {
    let kind = task.settings.kind;
    let target = Target::row(&stage.orchard, task.row).ok_or(ScanError::NothingThere { kind })?;
    let plan = ScanPlan::new(&target, &task.settings)?;
    let caster = caster(args, stage, &plan)?;
    let files: &[File] = if args.output.is_some() { &args.write } else { &[] };
    let is_matrix = |file: &File| matches!(file, File::Matrix | File::Npy);
    let wants_points = files.iter().any(|file| !is_matrix(file));
    let wants_matrix = files.iter().any(is_matrix);
    let bar = progress::bar("scanning", "lines", plan.len() as u64);
    let lines = plan.lines(caster.as_ref(), LAYERS, |line| {
        bar.inc(1);
        let of_class = |class| line.layers.nearest().iter().filter(|found| found.class == class).count();
        LineRecord {
            areas: plan.line_areas(line.layers),
            counts: Class::ALL.iter().map(|class| (*class, of_class(*class))).collect(),
            ranges: if wants_matrix {
                line.layers.nearest().iter().map(|found| found.range_m).collect()
            } else {
                Vec::new()
            },
            points: if wants_points { points::of_line(&plan, &line) } else { Vec::new() },
            shots: if args.picture.is_some() { picture::of_line(&plan, &line) } else { Vec::new() },
        }
    });
    bar.finish_and_clear();
    if let Some(prefix) = &args.output {
        let named = |end: &str| {
            let mut name = prefix.clone().into_os_string();
            name.push(task.suffix);
            name.push(end);
            PathBuf::from(name)
        };
        let kept = Kept { only: &args.only, ground: Ground::of(&stage.orchard) };
        write(&plan, stage, files, &lines, &kept, &named)?;
    }
    if let Some(path) = &args.picture {
        let shots = lines.iter().flat_map(|line| &line.shots).copied().collect();
        picture::write(path, args.colour_by, &plan, stage, shots)?;
    }
    let areas: ScanAreas = lines.iter().map(|line| line.areas).sum();
    let total = |wanted: Class| -> usize {
        let counts = lines.iter().flat_map(|line| &line.counts);
        counts.filter(|(class, _)| *class == wanted).map(|(_, count)| count).sum()
    };
    let beams = plan.beams().len();
    let origin = plan.origin(0);
    Ok(Scanned {
        kind,
        row: task.row,
        seed: stage.scene.seed,
        lines: plan.len(),
        beams,
        dy_m: task.settings.dy_m,
        range_from: plan.swept(0),
        range_to: plan.swept(beams.saturating_sub(1)),
        origin_x_m: origin.x_m,
        origin_z_m: origin.z_m,
        leaf_hits: total(Class::Leaf),
        wood_hits: total(Class::Wood),
        fruit_hits: total(Class::Fruit),
        support_hits: total(Class::Post) + total(Class::Wire),
        grass_hits: total(Class::Grass),
        ground_hits: total(Class::Ground),
        escapes: total(Class::None),
        leaf_m2: areas.leaf_m2,
        total_m2: areas.total_m2,
        three_leaves_m2: areas.three_leaves_m2,
        visible_leaf_area_m2: areas.visible_leaf_area_m2,
        leaf_area_m2: stage.orchard.truth_of_row(task.row, TruthGrid::default()).leaf_area_m2,
    })
}

fn write(
    plan: &ScanPlan,
    stage: &Stage,
    files: &[File],
    lines: &[LineRecord],
    kept: &Kept<'_>,
    named: &dyn Fn(&str) -> PathBuf,
) -> Result<(), Failure> {
    let columns: Vec<&[f64]> = lines.iter().map(|line| line.ranges.as_slice()).collect();
    if files.iter().any(|file| matches!(file, File::Matrix | File::Npy)) {
        output::write_file(&named("_L.txt"), matrix::about(plan, stage).as_bytes())?;
    }
    for file in files {
        let path = match file {
            File::Matrix => {
                let path = named("_L.csv");
                output::write_file(&path, &matrix::csv(plan, &columns))?;
                path
            }
            File::Npy => {
                let path = named("_L.npy");
                output::write_file(&path, &matrix::npy(plan, &columns))?;
                path
            }
            File::Csv => write_points(named("_points.csv"), TableFormat::Csv, lines, kept)?,
            File::Ply => write_points(named("_points.ply"), TableFormat::Ply, lines, kept)?,
            File::Las => write_points(named("_points.las"), TableFormat::Las, lines, kept)?,
        };
        say(format_args!("wrote {}", path.display()));
    }
    Ok(())
}

/// Writes every return that is kept.
fn write_points(
    path: PathBuf,
    format: TableFormat,
    lines: &[LineRecord],
    kept: &Kept<'_>,
) -> Result<PathBuf, Failure> {
    let mut file = TableFile::create(&path, format, &points::table(format))?;
    let mut row = Vec::new();
    for point in lines.iter().flat_map(|line| &line.points).filter(|point| kept.holds(point, format)) {
        points::row(point, format, &mut row);
        file.row(&row).map_err(|cause| file.failure(cause))?;
    }
    file.commit()?;
    Ok(path)
}
