//! `rowscan study field`: a calibration from pieces of real rows whose leaf area was measured by hand.

use std::collections::HashMap;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use comfy_table::Cell;
use rowscan_canopy::Estimate;
use rowscan_canopy::calibration::{CalibrationClass, Provenance};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::rig::{BeamWidth, Rig};
use rowscan_scenes::files;
use rowscan_study::calibrations::{load_calibration_for, load_named_calibration};
use rowscan_study::field::{self, FieldReport, MeasuredPiece, Planned, ScannedPiece};
use rowscan_study::fingerprint;
use rowscan_study::reading::{CalibrationChoice, Reading};

use super::calibration::{mean_m, voxel_m};
use crate::cli::estimate::contradictions;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, percent, say, share};
use crate::cli::{Failure, Format, Outcome, progress};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    /// The sheet of what was measured: CSV with the columns recording, from_m, to_m, leaf_area_m2
    #[arg(value_name = "field.csv", required_unless_present = "plan")]
    sheet: Option<PathBuf>,
    /// Where the scanner sat and how fast it drove: a rig file, a scene file or a built-in scene's name
    #[arg(long, value_name = "RIG")]
    rig: String,
    /// The rig's scanner that was used, from 0; otherwise the one that each recording says, else the first
    #[arg(long, value_name = "N")]
    scanner: Option<usize>,
    /// A calibration whose class the new one gets, instead of the rig's own: a file, a shipped one's name, or a class (`spindle`)
    #[arg(long, value_name = "NAME")]
    calibration: Option<String>,
    /// What the orchard is called in the new calibration
    #[arg(long, value_name = "NAME", default_value = "field")]
    name: String,
    /// Say how many pieces to strip, before anything is measured
    #[arg(long, conflicts_with_all = ["sheet", "output"])]
    plan: bool,
    /// With `--plan`: relative standard deviation of a leaf area measured by hand
    #[arg(long, value_name = "SHARE", default_value_t = 0.03, requires = "plan")]
    hand_sd: f64,
    /// Write the calibration to this file
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// How to write the report; CSV and JSON lines hold a piece a row
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let (rig, _) = files::load_rig(&args.rig, say)?;
    let found = rig.scanners.len();
    if let Some(scanner) = args.scanner.filter(|scanner| *scanner >= found) {
        return Err(Failure::Usage(format!(
            "--scanner: expected a number below {found}, the count of the rig's scanners; found {scanner}"
        )));
    }
    match &args.sheet {
        Some(sheet) if !args.plan => calibrate(&args, &rig, sheet).await,
        _ => planned(&args, &rig),
    }
}

async fn calibrate(args: &Args, rig: &Rig, sheet: &Path) -> Result<Outcome, Failure> {
    let told = |cause: &dyn std::fmt::Display| Failure::Usage(format!("{}: {cause}", sheet.display()));
    let text = rowscan_files::read_text(sheet).map_err(|cause| told(&cause))?;
    let measured = field::read(&text).map_err(|cause| told(&cause))?;
    args.output.as_deref().map_or(Ok(()), output::can_be_written)?;
    let folder = sheet.parent().unwrap_or(Path::new(""));
    let mut recordings: Vec<&str> = measured.iter().map(|piece| piece.recording.as_str()).collect();
    recordings.sort_unstable();
    recordings.dedup();
    if let Some([one, other]) = twice(folder, &recordings) {
        return Err(told(&format!(
            "`{one}` and `{other}` have the same contents: expected one name for a recording; write it on all its lines, for pieces of one row are alike"
        )));
    }
    let first = recordings.first().map(|recording| recorded(&folder.join(recording))).transpose()?;
    let nearest = class(args, rig, first.map_or(0, |first| scanner_of(args, rig, &first)))?;
    let bar = progress::bar("reading", "recordings", recordings.len() as u64);
    let mut scanned: Vec<(u64, ScannedPiece)> = Vec::new();
    let mut rows = Vec::new();
    for recording in recordings {
        let estimate = estimate(args, rig, &folder.join(recording)).await?;
        let own = measured.iter().filter(|piece| piece.recording == recording);
        let piece = |piece: &MeasuredPiece| {
            let scanned =
                field::scanned(&estimate, piece, rig.tree_spacing_m).map_err(|cause| told(&cause))?;
            Ok((piece.line, scanned))
        };
        scanned.extend(own.map(piece).collect::<Result<Vec<_>, Failure>>()?);
        rows.push(estimate);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let spacings_m = rows.iter().map(|row: &Estimate| row.contact.as_ref()?.line_spacing_m);
    let edges_m = rows.iter().map(|row| Some(row.contact.as_ref()?.voxel_m));
    let class = CalibrationClass {
        line_spacing_m: mean_m(spacings_m),
        crown_depth_m: mean_m(rows.iter().map(|row| row.crown_depth_m)),
        voxel_m: voxel_m(edges_m),
        ..nearest
    };
    scanned.sort_by_key(|(line, _)| *line);
    let pieces: Vec<ScannedPiece> = scanned.into_iter().map(|(_, piece)| piece).collect();
    let command = format!("rowscan study field {} --rig {}", sheet.display(), args.rig);
    let report = field::calibrate(&pieces, &class, Provenance { command, seeds: Vec::new() })
        .map_err(|cause| told(&cause))?;
    if let Some(path) = &args.output {
        output::write_file(path, &output::calibration_text(&report.calibration)?)?;
        say(format_args!("wrote {}", path.display()));
    }
    match args.format {
        Format::Json => output::print_json(args.format, &report)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &report.pieces)?,
        Format::Table => output::print(&table(&report))?,
    }
    Ok(Outcome::Done)
}

/// Two names of one recording, if any: by what the files hold, so that a copy is one as well.
fn twice<'a>(folder: &Path, recordings: &[&'a str]) -> Option<[&'a str; 2]> {
    let mut known = HashMap::new();
    recordings.iter().find_map(|recording| {
        // What cannot be read is told when it is opened.
        let file = rowscan_files::open(&folder.join(recording)).ok()?;
        let contents = BufReader::new(file).bytes().map_while(Result::ok);
        known.insert(fingerprint::of_bytes(contents), *recording).map(|other| [other, recording])
    })
}

/// The recording of that name.
fn recorded(path: &Path) -> Result<Source, Failure> {
    let source: Source =
        path.to_string_lossy().parse().map_err(|cause| Failure::Usage(format!("{cause}")))?;
    if source.file().is_none() {
        return Err(Failure::Usage(format!("{source} is live: `rowscan record` it first")));
    }
    Ok(source)
}

/// Which of the rig's scanners a recording is of.
fn scanner_of(args: &Args, rig: &Rig, source: &Source) -> usize {
    args.scanner.or_else(|| source.mount_on(rig)).unwrap_or_default()
}

/// What the scans of a recording tell.
async fn estimate(args: &Args, rig: &Rig, path: &Path) -> Result<Estimate, Failure> {
    let source = recorded(path)?;
    for warning in contradictions(&source, rig, scanner_of(args, rig, &source)) {
        say(format_args!("{}: warning: {warning}", path.display()));
    }
    let choice = args.calibration.as_deref().map_or(CalibrationChoice::OfRig, CalibrationChoice::Named);
    let mut pipeline =
        Reading::of_recording(Some(rig), scanner_of(args, rig, &source), true, choice)?.pipeline;
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await?;
    while let Some(record) = scanner.next().await? {
        pipeline.push(record.scan);
        tokio::task::coop::consume_budget().await;
    }
    Ok(pipeline.finish())
}

/// What the new calibration is valid for: all that the nearest one is, under its own name.
fn class(args: &Args, rig: &Rig, scanner: usize) -> Result<CalibrationClass, Failure> {
    let model = rig.scanners.get(scanner).map(|mount| mount.model.as_str()).unwrap_or_default();
    let nearest = match (&args.calibration, &rig.calibration) {
        (Some(name), _) => Some(load_named_calibration(name, model, rig.optics)?),
        (None, Some(name)) => load_calibration_for(name, model, rig.optics)?,
        (None, None) => None,
    };
    let nearest = nearest.ok_or_else(|| {
        Failure::Usage(
            "the rig names no calibration for its scanner; add --calibration NAME of the class that is nearest to the orchard (`rowscan schema` has the form)".to_owned(),
        )
    })?;
    Ok(CalibrationClass { preset: args.name.clone(), ..nearest.class })
}

fn planned(args: &Args, rig: &Rig) -> Result<Outcome, Failure> {
    if !(0.0..=1.0).contains(&args.hand_sd) {
        return Err(Failure::Usage(format!(
            "--hand-sd: expected a share from 0 to 1, found {}",
            args.hand_sd
        )));
    }
    let mount = rig.scanners.get(args.scanner.unwrap_or_default());
    let (model, distance_m) = mount.map_or(("", 0.0), |mount| (mount.model.as_str(), mount.distance_m));
    let beams = if rig.optics == Some(BeamWidth::Ideal) { "rays" } else { "eye" };
    let plan = field::plan(beams, model, distance_m, args.hand_sd).ok_or_else(|| {
        Failure::Usage(format!(
            "pieces seen by a {model} at {distance_m} m were never studied: `rowscan study pieces`"
        ))
    })?;
    match args.format {
        Format::Json => output::print_json(args.format, &plan)?,
        Format::Jsonl | Format::Csv => output::print_rows(args.format, &plan)?,
        Format::Table => output::print(&plan_table(&plan))?,
    }
    Ok(Outcome::Done)
}

fn plan_table(plan: &[Planned]) -> String {
    let mut grid = Grid::new();
    output::head(&mut grid, ["piece m", "sd", "n for ± 20 %", "± 10 %", "± 5 %", "metres for ± 10 %"]);
    for row in plan {
        grid.add_row([
            number(Some(row.length_m), 1),
            share(Some(row.sd)),
            Cell::new(row.for_20_percent),
            Cell::new(row.for_10_percent),
            Cell::new(row.for_5_percent),
            number(Some(row.metres_for_10_percent), 1),
        ]);
    }
    format!("{grid}\n")
}

fn table(report: &FieldReport) -> String {
    let mut grid = Grid::new();
    output::head(&mut grid, ["recording", "m", "measured m²", "raw", "before", "left out", "error"]);
    for piece in &report.pieces {
        grid.add_row([
            Cell::new(&piece.recording),
            Cell::new(format!("{}..{}", piece.from_m, piece.to_m)),
            number(Some(piece.measured_m2), 2),
            number(Some(piece.raw_m2), 2),
            number(piece.before_m2, 2),
            number(Some(piece.left_out_m2), 2),
            percent(Some(piece.left_out_m2 / piece.measured_m2 - 1.0)),
        ]);
    }
    let signed = |value: f64| format!("{:+.1} %", 100.0 * value);
    let before = report.before.map_or_else(String::new, |before| {
        format!(
            "with the calibration that was there: {}, RMSE {:.1} %\n",
            signed(before.bias),
            100.0 * before.rmse
        )
    });
    let [low, high] = report.factor_interval;
    let needed = match (report.recordings_for_ten_percent, report.pieces_for_ten_percent) {
        (Some(recordings), _) => format!(
            "recordings for ± 10 %: {recordings} (they differ by more than their pieces, so more pieces of the same ones help little)"
        ),
        (None, pieces) => format!("pieces for ± 10 %: {}", pieces.unwrap_or_default()),
    };
    format!(
        "{grid}\n{before}each {} left out of the fit: {}, RMSE {:.1} %\nfactor of contact {:.3}, 95 % {low:.3} to {high:.3}; {needed}, measured: {}\n",
        report.left_out,
        signed(report.after.bias),
        100.0 * report.after.rmse,
        report.factor,
        report.pieces.len(),
    )
}
