//! `rowscan estimate`

use std::time::Duration;

use rowscan_canopy::{CutMethod, Estimate, Pipeline, TreesFound, Warning};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::client::ClientConfig;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::ScanMode;
use rowscan_protocol::rig::Rig;
use rowscan_recording::About;
use rowscan_scenes::Scene;
use serde::Serialize;

use super::estimators::{self, Beside, EstimatorArgs};
use super::interrupt::Interrupt;
use super::link_events::LinkTeller;
use super::output::{self, number, say};
use super::recorder::{self, RecordArgs};
use super::sensor::{Sensor, SensorArgs};
use super::{Failure, Format, Outcome, models, progress, record, scene};
use crate::appraisal::Appraisal;
use crate::{config, stage};

/// How long the device is given to end the stream.
pub(super) const PARTING: Duration = Duration::from_secs(2);

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// tcp://HOST:PORT, serial:/dev/ttyUSB0?baud=38400, rfc2217://HOST:PORT, or the file of a recording, with `#STREAM` behind it where it holds several
    source: Source,
    /// Where the scanner sits and how fast it drives: a rig file, a scene file or a built-in scene's name; without it areas are unknown
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// The rig's scanner this is, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    scanner: usize,
    /// Scanner model, instead of the rig's own; chooses the calibration
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// A calibration file or a shipped calibration's name, instead of the rig's own
    #[arg(long, value_name = "NAME")]
    calibration: Option<String>,
    /// End after so many scans
    #[arg(long, value_name = "N")]
    scans: Option<u64>,
    /// End after so many metres of row
    #[arg(long, value_name = "METRES")]
    length: Option<f64>,
    /// The dialect tried first
    #[arg(long, value_enum, default_value_t)]
    prefer: Prefer,
    /// Wait for the scanner to appear instead of failing fast
    #[arg(long)]
    wait: bool,
    #[command(flatten)]
    estimators: EstimatorArgs,
    /// Find trees in the data as well, not only by the rig's spacing
    #[arg(long, value_name = "HOW", value_delimiter = ',', value_enum)]
    trees: Vec<CutArg>,
    /// Seed of the rig's scene, for the truth beside the estimators; the scene's own where absent
    #[arg(long, value_name = "N", requires = "estimators")]
    seed: Option<u64>,
    /// How to write the estimate
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    record: RecordArgs,
}

/// How trees are told apart in the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum CutArg {
    /// By the returns of bare trunks
    Trunk,
    /// By the lows of the impacted area along the row
    Valley,
}

impl From<CutArg> for CutMethod {
    fn from(cut: CutArg) -> Self {
        match cut {
            CutArg::Trunk => Self::Trunk,
            CutArg::Valley => Self::Valley,
        }
    }
}

/// The dialect a driver tries first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Prefer {
    /// CoLa A, ASCII
    A,
    /// CoLa B, binary
    #[default]
    B,
}

impl From<Prefer> for Dialect {
    fn from(prefer: Prefer) -> Self {
        match prefer {
            Prefer::A => Self::A,
            Prefer::B => Self::B,
        }
    }
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut interrupt = Interrupt::watch()?;
    let asked = args.estimators.asked()?;
    let cuts: Vec<CutMethod> = args.trees.iter().copied().map(CutMethod::from).collect();
    let (rig, scene) = match &args.rig {
        Some(name) => {
            let (rig, scene) = rig_for(name, args.model.as_deref(), args.scanner)?;
            (Some(rig), scene)
        }
        None => (None, None),
    };
    let mut pipeline = pipeline(rig.as_ref(), args.scanner, args.calibration.as_deref())?
        .with_estimators(&asked)
        .with_trees_found(&cuts);
    let appraisal = match (&rig, scene) {
        (Some(rig), Some(scene)) if !asked.is_empty() => {
            let scene = Scene { seed: args.seed.unwrap_or(scene.seed), ..scene };
            let Some(stage) = interrupt.or(scene::grow(scene)).await.transpose()? else {
                return Ok(Outcome::Done);
            };
            let mount = rig.scanners.get(args.scanner).cloned().unwrap_or_default();
            Some(Appraisal::of(&stage.orchard, &mount, rig.ground_clearance_m))
        }
        _ => None,
    };
    if rig.is_none() {
        say("no rig given: areas stay unknown; say where the scanner sits with --rig");
    }
    let encoder =
        rig.as_ref().filter(|_| args.sensor.wants_encoder()).and_then(|rig| rig.encoder_ticks_per_m);
    let client = ClientConfig {
        scan_mode: scan_mode(rig.as_ref(), args.scanner),
        encoder_ticks_per_m: encoder.map(|ticks| ticks.abs().round() as u32),
        ..ClientConfig::default()
    };
    let row_spacing_m = rig.as_ref().and_then(|rig| rig.row_spacing_m);
    let mut sensor = args.sensor.open(args.format, row_spacing_m, &args.source).await?;
    let about = About {
        model: args.model.clone(),
        rig: rig.as_ref().and_then(recorder::rig_text),
        source: Some(args.source.to_string()),
        ..About::default()
    };
    let taping = args.record.start(about, false)?;
    let config = DriverConfig {
        client,
        lms2xx: lms2xx_config(rig.as_ref(), args.scanner),
        wait: args.wait,
        prefer: args.prefer.into(),
        tap: taping.taps().open("scanner", record::stream_kind(&args.source)),
        ..DriverConfig::default()
    };
    let Some(scanner) = interrupt.or(Scanner::open(&args.source, config)).await else {
        return Ok(Outcome::Done);
    };
    let mut scanner = scanner?;
    let telling = LinkTeller::start(&scanner);
    let ended = tokio::select! {
        ended = follow(&mut scanner, &mut pipeline, &mut sensor, &args) => ended,
        () = interrupt.wait() => Ok(()),
    };
    let mut estimate = pipeline.finish();
    estimate.telegrams_bad = scanner.stop(PARTING).await.telegrams_bad;
    drop(telling);
    sensor.part(PARTING).await;
    // What was seen before a failure is not lost by it; a source that never gave a scan has nothing to show.
    if ended.is_ok() || estimate.scans > 0 {
        let start_m = rig.as_ref().map_or(0.0, |rig| rig.start_m);
        let truth = appraisal.as_ref().map(|appraisal| estimators::scanned(appraisal, &estimate, start_m));
        let beside = if asked.is_empty() { Vec::new() } else { Beside::of_row(&estimate, truth.as_ref()) };
        print(args.format, &estimate, &beside)?;
    }
    if let Some(latency) = sensor.latency() {
        output::tell_latency(args.format, &latency)?;
    }
    let outcome = taping.finish();
    ended.map(|()| outcome)
}

/// What the rig asks of an LMS2xx: the widest variant with its resolution; the device keeps its own where the rig leaves that open.
fn lms2xx_config(rig: Option<&Rig>, scanner: usize) -> lms2xx::client::ClientConfig {
    let step = rig.and_then(|rig| rig.scanners.get(scanner)).and_then(stage::asked_step);
    let variants = lms2xx::model::MODELS.iter().flat_map(|model| model.variants.iter().copied());
    let variant = variants
        .filter(|variant| Some(variant.step_centideg.saturating_mul(100)) == step)
        .max_by_key(|variant| variant.angle_deg);
    lms2xx::client::ClientConfig { variant, ..Default::default() }
}

/// The scan mode the rig asks of its scanner; the device keeps its own where the rig leaves frequency or resolution open.
fn scan_mode(rig: Option<&Rig>, scanner: usize) -> Option<ScanMode> {
    let mount = rig?.scanners.get(scanner)?;
    Some(ScanMode {
        frequency_centihz: stage::asked_frequency_centihz(mount)?,
        step: stage::asked_step(mount)?,
    })
}

/// The rig called `name`, carrying scanners of `model`, and the scene it stands in, if it names one.
fn rig_for(name: &str, model: Option<&str>, scanner: usize) -> Result<(Rig, Option<Scene>), Failure> {
    let (mut rig, scene) = config::load_rig(name)?;
    if let (Some(model), Some(mount)) = (model, rig.scanners.get_mut(scanner)) {
        models::find(model)?.name().clone_into(&mut mount.model);
    }
    Ok((rig, scene))
}

/// The pipeline of a rig's scanner, with the calibration named, or the rig's own.
pub(super) fn pipeline(
    rig: Option<&Rig>,
    scanner: usize,
    calibration: Option<&str>,
) -> Result<Pipeline, Failure> {
    let mount = rig.and_then(|rig| rig.scanners.get(scanner));
    let calibration = match (calibration, rig.and_then(|rig| rig.calibration.as_deref()), mount) {
        (Some(name), ..) => Some(config::load_calibration(name)?),
        (None, Some(name), Some(mount)) => config::load_calibration_for(name, &mount.model)?,
        _ => None,
    };
    Ok(Pipeline::new(rig, scanner, calibration)?)
}

/// Feeds the pipeline until the source ends or enough has been seen.
async fn follow(
    scanner: &mut Scanner,
    pipeline: &mut Pipeline,
    sensor: &mut Sensor,
    args: &Args,
) -> Result<(), Failure> {
    let bar = progress::bar("scanning", "scans", args.scans.unwrap_or(0));
    loop {
        let received = {
            // Kept while the bus is heard, or a bus that talks would call every attempt to connect off.
            let mut next = std::pin::pin!(scanner.next());
            let record = loop {
                tokio::select! {
                    // What the bus says is older than the scan that comes next.
                    biased;
                    () = sensor.hear() => sensor.send().await,
                    record = &mut next => break record?,
                }
            };
            let Some(record) = record else { break };
            sensor.push(pipeline, record.scan).await;
            record.received
        };
        sensor.measure(received, || scanner.now()).await;
        let progress = pipeline.progress();
        bar.set_position(progress.scans);
        if args.scans.is_some_and(|scans| progress.scans >= scans)
            || args.length.is_some_and(|length| progress.advance_m >= Some(length))
        {
            break;
        }
    }
    bar.finish_and_clear();
    Ok(())
}

/// The estimate with its estimators side by side.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    estimate: &'a Estimate,
    /// The row's numbers with the truth beside them; only if estimators were asked for.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    side_by_side: &'a [Beside],
}

/// Writes an estimate; as CSV the trees, or the estimators side by side if any were asked for.
fn print(format: Format, estimate: &Estimate, side_by_side: &[Beside]) -> Result<(), Failure> {
    match format {
        Format::Json | Format::Jsonl => output::print_json(format, &Told { estimate, side_by_side }),
        Format::Csv if !side_by_side.is_empty() => output::print_rows(format, side_by_side),
        Format::Csv => output::print_rows(format, &estimate.trees),
        Format::Table => {
            output::print(&facts(estimate))?;
            if !estimate.trees.is_empty() {
                output::print(&trees(estimate))?;
            }
            for found in &estimate.trees_found {
                output::print(&trees_found(found))?;
            }
            if !side_by_side.is_empty() {
                output::print(&estimators::table(side_by_side))?;
            }
            output::print(&warnings(&estimate.warnings))
        }
    }
}

/// The row's numbers, a line each.
fn facts(estimate: &Estimate) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: String| text.push_str(&format!("{name:<22}{value}\n"));
    let known = |value: Option<f64>, decimals: usize, unit: &str| {
        value.map_or_else(|| "unknown".to_owned(), |value| format!("{value:.decimals$} {unit}"))
    };
    line(
        "scans",
        format!(
            "{} ({} repeated, {} lost, {} bad telegrams)",
            estimate.scans, estimate.scans_repeated, estimate.scans_lost, estimate.telegrams_bad
        ),
    );
    line(
        "scan frequency",
        format!(
            "{} measured, {} stated",
            known(estimate.scan_frequency_hz, 3, "Hz"),
            known(estimate.scan_frequency_nominal_hz, 2, "Hz")
        ),
    );
    line("points a scan", estimate.points_per_scan.map_or_else(|| "unknown".into(), |n| n.to_string()));
    let ranges = &estimate.ranges;
    line(
        "ranges",
        format!(
            "{} returns, {} misses; {} to {}, mean {}",
            ranges.returns,
            ranges.misses,
            known(ranges.min_m, 3, "m"),
            known(ranges.max_m, 3, "m"),
            known(ranges.mean_m, 3, "m")
        ),
    );
    line("advance", known(estimate.advance_m, 3, "m"));
    line("impacted area I_T", known(estimate.impacted_total_area_m2, 3, "m²"));
    line("leaf area", known(estimate.leaf_area_m2, 2, "m²"));
    line("  by contact", known(estimate.leaf_area_contact_m2, 2, "m²"));
    line("  by I_T", known(estimate.leaf_area_regression_m2, 2, "m²"));
    line("LAI", known(estimate.lai, 2, ""));
    text
}

fn trees(estimate: &Estimate) -> String {
    let mut table = output::grid();
    output::head(
        &mut table,
        ["tree", "y m", "I_T m²", "leaf m² by I_T", "leaf m² by contact", "LAI", "height m", "volume m³"],
    );
    for tree in &estimate.trees {
        table.add_row([
            number(Some(tree.tree.into()), 0),
            number(Some(tree.y_m), 2),
            number(Some(tree.impacted_total_area_m2), 3),
            number(tree.leaf_area_regression_m2, 2),
            number(tree.leaf_area_contact_m2, 2),
            number(tree.lai, 2),
            number(tree.height_m, 2),
            number(Some(tree.volume_m3), 2),
        ]);
    }
    format!("{table}\n")
}

/// The trees that one way of cutting the row finds.
fn trees_found(found: &TreesFound) -> String {
    let mut table = output::grid();
    output::head(&mut table, ["tree", "y m", "from m", "to m", "I_T m²", "leaf m² by contact, raw"]);
    for (number_of, tree) in found.trees.iter().enumerate() {
        table.add_row([
            number(Some(number_of as f64), 0),
            number(Some(tree.y_m), 2),
            number(Some(tree.y_from_m), 2),
            number(Some(tree.y_to_m), 2),
            number(Some(tree.impacted_total_area_m2), 3),
            number(Some(tree.leaf_area_contact_raw_m2), 2),
        ]);
    }
    format!("{} trees found by {}\n{table}\n", found.trees.len(), found.method.name())
}

/// What the reader must know beside the numbers.
pub(super) fn warnings(warnings: &[Warning]) -> String {
    warnings.iter().map(|warning| format!("warning: {warning}\n")).collect()
}
