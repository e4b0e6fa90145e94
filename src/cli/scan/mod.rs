//! `rowscan scan`: one of the paper's scans, offline, as fast as it goes.

mod layout;
mod matrix;
mod picture;
mod points;

use std::path::PathBuf;

use clap::ValueEnum;
use rowscan_scenes::Scene;
use rowscan_scenes::caster::Class;
use rowscan_scenes::scan::{ScanKind, ScanPlan, ScanPoint, ScanSettings};
use rowscan_study::row_scan::{self, RowScan, Scanned};

use super::blocking::off_runtime;
use super::interrupt::Interrupt;
use super::output::{self, say};
use super::pictured;
use super::scene::OpticsArgs;
use super::table_file::TableFile;
use super::{Failure, Format, Outcome, progress};
use crate::export::TableFormat;
use rowscan_emulator::stage::Stage;

pub(super) use layout::ScanArgs;
use picture::{ColourBy, Shot};
use points::{Ground, Kept};

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

impl File {
    /// How it holds points, and how its name ends; none of a matrix.
    fn points(self) -> Option<(TableFormat, &'static str)> {
        match self {
            Self::Matrix | Self::Npy => None,
            Self::Csv => Some((TableFormat::Csv, "_points.csv")),
            Self::Ply => Some((TableFormat::Ply, "_points.ply")),
            Self::Las => Some((TableFormat::Las, "_points.las")),
        }
    }
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

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    interrupt.finite(off_runtime("scan", move || scan(&args))).await
}

fn scan(args: &Args) -> Result<Outcome, Failure> {
    args.picture.as_deref().map(pictured::check).transpose()?;
    args.write.iter().filter_map(|file| file.points()).try_for_each(|(format, _)| format.check())?;
    let mut scene = args.optics.load(&args.scene)?;
    args.picture.as_deref().map_or(Ok(()), output::can_be_written)?;
    scene.seed = args.seed.unwrap_or(scene.seed);
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
    let blind = scans.iter().find(|scan| scan.is_blind());
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
    let base = row_scan::settings(scene, args.kind);
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
    ranges: Vec<f64>,
    points: Vec<ScanPoint>,
    shots: Vec<Shot>,
}

fn one(args: &Args, stage: &Stage, task: &Task) -> Result<Scanned, Failure> {
    let scan = RowScan::new(stage, task.row, &task.settings)?;
    let plan = scan.plan();
    tell_left_over(plan);
    let files: &[File] = if args.output.is_some() { &args.write } else { &[] };
    let wants_points = files.iter().any(|file| file.points().is_some());
    let wants_matrix = files.iter().any(|file| file.points().is_none());
    let bar = progress::bar("scanning", "lines", plan.len() as u64);
    let (scanned, lines) = scan.lines(|line| {
        bar.inc(1);
        LineRecord {
            ranges: if wants_matrix {
                line.layers.nearest().iter().map(|found| found.range_m).collect()
            } else {
                Vec::new()
            },
            points: if wants_points { ScanPoint::of_line(plan, line) } else { Vec::new() },
            shots: if args.picture.is_some() { picture::of_line(plan, line) } else { Vec::new() },
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
        write(plan, stage, files, &lines, &kept, &named)?;
    }
    if let Some(path) = &args.picture {
        let shots = lines.iter().flat_map(|line| &line.shots).copied().collect();
        picture::write(path, args.colour_by, plan, stage, shots)?;
    }
    Ok(scanned)
}

/// Share of the row's length that lines may leave without a word.
const LEFT_OVER: f64 = 0.001;

/// Says that lines do not reach the row's end: what stands there is in no area.
fn tell_left_over(plan: &ScanPlan) {
    let (left_m, length_m, dy_m) = (plan.left_over_m(), plan.length_m(), plan.settings().dy_m);
    if left_m > LEFT_OVER * length_m {
        say(format_args!(
            "--dy {dy_m}: {} lines stand for {:.3} of {length_m:.3} m of row, and areas are of these; an advance that goes into the row's length takes all of it",
            plan.len(),
            length_m - left_m,
        ));
    }
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
    if files.iter().any(|file| file.points().is_none()) {
        output::write_file(&named("_L.txt"), matrix::about(plan, stage).as_bytes())?;
    }
    for file in files {
        let path = match (file, file.points()) {
            (_, Some((format, end))) => write_points(named(end), format, lines, kept)?,
            (File::Npy, None) => {
                let path = named("_L.npy");
                output::write_file(&path, &matrix::npy(plan, &columns))?;
                path
            }
            (_, None) => {
                let path = named("_L.csv");
                output::write_file(&path, &matrix::csv(plan, &columns))?;
                path
            }
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
