//! `rowscan orchard export`

use std::path::PathBuf;

use rowscan_scenes::drawing::{self, Dot, Drawing};
use rowscan_scenes::scan::{ScanError, ScanKind, ScanPlan, ScanSettings, Target};
use rowscan_scenes::season::Season;
use rowscan_scenes::{Caster, Class};

use super::files::{self, FileFormat};
use crate::cli::blocking::off_runtime;
use crate::cli::output::{self, say};
use crate::cli::scene::{SceneArgs, grow};
use crate::cli::{Failure, Outcome};
use rowscan_emulator::stage::Stage;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Season, instead of the scene's own: dormant, bud_burst, unfolding, bloom, fruit_set, full_leaf, leaf_fall
    #[arg(long, value_name = "NAME", value_parser = season)]
    season: Option<Season>,
    /// Write files that begin with this
    #[arg(short, long, value_name = "PREFIX", required_unless_present = "svg")]
    output: Option<PathBuf>,
    /// Which files
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "text")]
    write: Vec<FileFormat>,
    /// Draw front, side and top view to this file; `-` for standard output
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Draw the returns of a scan over it: lateral, zenith, … as in `rowscan scan`, from where the rig's first scanner is
    #[arg(long, value_name = "TYPE", value_parser = kind, requires = "svg")]
    scan: Option<ScanKind>,
    /// Draw only that many trees, from the first place
    #[arg(long, value_name = "N", requires = "svg")]
    trees: Option<usize>,
    /// Side of a cell of the drawing, metres: larger cells make smaller files
    #[arg(long, value_name = "METRES", default_value_t = Drawing::default().cell_m, requires = "svg")]
    cell: f64,
    /// Draw leaves and wood as silhouettes in their real outlines, with the area that leaves cover, instead of cells
    #[arg(long, requires = "svg", conflicts_with = "cell")]
    outlines: bool,
}

pub(super) fn season(text: &str) -> Result<Season, String> {
    let known = Season::ALL.iter().find(|season| season.to_string() == text);
    known.copied().ok_or_else(|| format!("expected one of {}", Season::NAMES.join(", ")))
}

fn kind(text: &str) -> Result<ScanKind, String> {
    ScanKind::from_name(text).ok_or_else(|| format!("expected one of {}", ScanKind::NAMES.join(", ")))
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    if !(args.cell.is_finite() && args.cell > 0.0) {
        return Err(Failure::Usage(format!(
            "--cell: a positive number of metres expected, found {}",
            args.cell
        )));
    }
    let mut scene = args.scene.scene()?;
    scene.orchard.season = args.season.unwrap_or(scene.orchard.season);
    let stage = grow(scene).await?;
    off_runtime("write the orchard", move || export(&args, &stage)).await
}

fn export(args: &Args, stage: &Stage) -> Result<Outcome, Failure> {
    if let Some(prefix) = &args.output {
        files::write(&stage.orchard, prefix, &args.write)?;
    }
    let Some(path) = &args.svg else { return Ok(Outcome::Done) };
    let dots = args.scan.map_or_else(|| Ok(Vec::new()), |kind| scan(stage, kind))?;
    let trees = args.trees.unwrap_or(usize::MAX);
    let settings = Drawing { cell_m: args.cell, trees, outlines: args.outlines, ..Drawing::default() };
    let (name, seed) = (&stage.scene.name, stage.scene.seed);
    let title = args.scan.map(|kind| {
        format!("{name}, seed {seed}: {kind} scan from where the rig's first scanner is, every 0.05 m")
    });
    let drawn = drawing::draw(&stage.orchard, &dots, &settings, title.as_deref());
    if path.as_os_str() == "-" {
        output::print(&drawn)?;
    } else {
        output::write_file(path, &drawn)?;
        say(format_args!("wrote {}", path.display()));
    }
    Ok(Outcome::Done)
}

/// What the beams of a scan of the first row meet first, ground left out.
fn scan(stage: &Stage, kind: ScanKind) -> Result<Vec<Dot>, Failure> {
    let mut settings =
        ScanSettings { kind, dy_m: 0.05, dtheta_deg: 1.0, pitch_m: 0.05, ..ScanSettings::default() };
    if let Some(mount) = stage.rig.scanners.first() {
        settings = ScanSettings { distance_m: mount.distance_m, height_m: mount.height_m, ..settings };
    }
    let target = Target::row(&stage.orchard, 0).ok_or(ScanError::NothingThere { kind })?;
    let plan = ScanPlan::new(&target, &settings)?;
    let lines = plan.lines(&Caster::new(&stage.orchard), 0, |line| {
        let rays = plan.beams().rays(line.origin).zip(line.layers.nearest());
        let hits = rays.filter(|(_, found)| found.is_hit() && found.class != Class::Ground);
        let dot = |((start, direction), found): (([f64; 3], [f64; 3]), &rowscan_scenes::Return)| Dot {
            at: std::array::from_fn(|axis| start[axis] + found.range_m * direction[axis]),
            class: found.class,
        };
        hits.map(dot).collect::<Vec<Dot>>()
    });
    Ok(lines.concat())
}
