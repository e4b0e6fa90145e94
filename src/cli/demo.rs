//! `rowscan demo`: a virtual scanner, our own driver, and the estimate beside the truth, over a real socket.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use comfy_table::Cell;
use indicatif::ProgressBar;
use rowscan_canopy::{Estimate, Pipeline, Placing, TreeEstimate};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::AnyModel;
use rowscan_scenes::Truth;
use serde::Serialize;

use super::blocking::off_runtime;
use super::emulate::DialectArg;
use super::estimate;
use super::grid::Grid;
use super::interrupt::Interrupt;
use super::link_events::LinkTeller;
use super::link_options::{Prefer, STOP_TIMEOUT};
use super::output::{self, number, percent, say};
use super::scene::SceneArgs;
use super::{Failure, Format, Outcome, pictured, progress, spray_demo};
use rowscan_bench::{At, Bench, BenchScanner, BenchSpec, DeviceSpec, Endpoint, ScannerSpec};
use rowscan_emulator::ScannerCounts;
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::stage::Stage;
use rowscan_ports::clock::Stopwatch;
use rowscan_ports::latency::Latency;
use rowscan_study::class::row_class;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_vehicle::trajectory::Drive;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Simulated seconds a second, or `max`: as fast as the bytes go through the socket
    #[arg(long, value_name = "K", default_value = "max")]
    time_scale: TimeScale,
    /// Dialects the scanner answers
    #[arg(long, value_enum, default_value_t)]
    dialect: DialectArg,
    /// A calibration instead of the rig's own: a file, a shipped one's name, or a class (`spindle`), then that of the scanner's model
    #[arg(long, value_name = "NAME")]
    calibration: Option<String>,
    /// What the scanner and the driver speak over; a serial line has an LMS2xx on it [default: pty for an LMS2xx, tcp for any other]
    #[arg(long, value_enum)]
    line: Option<Line>,
    /// Spray the row with the reference controller: scans, valves and interception on leaves, beside the best that the boom can do
    #[arg(long, conflicts_with_all = ["time_scale", "dialect", "calibration", "line"])]
    spray: bool,
    /// The file that describes the boom of --spray; one with six sections on the right where left out
    #[arg(long, value_name = "FILE", requires = "spray")]
    boom: Option<PathBuf>,
    /// Draw the row, the returns that were received, and the estimate beside the truth by metre to this PNG or SVG file; with --spray the map of the run
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// How to write the result
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// What stands between scanner and driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Line {
    /// CoLa over a TCP socket
    Tcp,
    /// A pseudo-terminal
    Pty,
    /// A serial port over TCP
    Rfc2217,
}

/// The LMS2xx of a demo that names none.
const SERIAL_MODEL: &str = "lms291";

/// A demo that is set up: the scanner runs, and this is where and how to read it.
struct SetUp {
    bench: Bench,
    source: Source,
    latency: Option<Arc<Latency>>,
}

impl SetUp {
    fn scanner(&self) -> Option<&BenchScanner> {
        self.bench.scanners().first()
    }

    /// Scans of one pass of the row.
    fn scans(&self) -> u64 {
        self.scanner().map_or(0, |scanner| scanner.scans_per_row)
    }

    fn model(&self) -> &'static str {
        self.scanner().map_or("", |scanner| scanner.model.name())
    }

    fn counts(&self) -> ScannerCounts {
        self.scanner().and_then(|scanner| scanner.counts().counts()).unwrap_or_default()
    }

    /// Host time to the estimate; telegrams of an LMS2xx cannot be told apart, so that theirs is not known.
    fn latency_ms(&self, fraction: f64) -> Option<f64> {
        self.latency.as_ref()?.quantile(fraction).map(|latency| latency.as_secs_f64() * 1e3)
    }
}

impl Args {
    /// The model that is named, or the rig's own.
    fn model(&self, stage: &Stage) -> Result<Option<AnyModel>, Failure> {
        let of_rig = || AnyModel::by_name(&stage.rig.scanners.first()?.model);
        Ok(self.scene.named_model()?.or_else(of_rig))
    }

    /// What it speaks over.
    fn line(&self, stage: &Stage) -> Result<Line, Failure> {
        Ok(match (self.line, self.model(stage)?) {
            (Some(line), _) => line,
            (None, Some(AnyModel::Lms2xx(_))) => Line::Pty,
            (None, _) => Line::Tcp,
        })
    }

    /// The scanner that is asked for: a CoLa scanner on a TCP port, or an LMS2xx on a line, at the rate that carries every scan.
    fn scanner(&self, stage: &Stage) -> Result<ScannerSpec, Failure> {
        let free = || "127.0.0.1:0".to_owned();
        let endpoint = match self.line(stage)? {
            Line::Tcp => {
                // A picoScan is asked for LMDscandata: datagrams at the pace of `max` would be lost.
                let spec = ScannerSpec::new(0, self.scene.model(&stage.rig, 0)?);
                let spec = ScannerSpec { dialects: self.dialect.into(), ..spec };
                let latency = Some(Arc::new(Latency::default()));
                return Ok(ScannerSpec { latency, ..spec }.at(Endpoint::Tcp(free())));
            }
            Line::Rfc2217 => Endpoint::Rfc2217(free()),
            Line::Pty => {
                Endpoint::Pty(std::env::temp_dir().join(format!("rowscan-demo-{}", std::process::id())))
            }
        };
        let model = match (self.scene.named_model()?, self.model(stage)?) {
            (_, Some(model @ AnyModel::Lms2xx(_))) => model,
            (None, _) => AnyModel::named(SERIAL_MODEL)?,
            _ => {
                return Err(Failure::Usage(
                    "--line pty and rfc2217 have an LMS2xx at their end; leave out --model, or name one of `rowscan models`"
                        .to_owned(),
                ));
            }
        };
        let device = DeviceSpec { pause_slack: Some(Duration::from_secs(3600)), ..DeviceSpec::default() };
        Ok(ScannerSpec { device, ..ScannerSpec::new(0, model) }.at(endpoint))
    }

    /// Sets the scanner up and lets its time go.
    async fn set_up(&self, stage: &Stage) -> Result<(SetUp, Reading), Failure> {
        let scanner = self.scanner(stage)?;
        let calibration =
            self.calibration.as_deref().map_or(CalibrationChoice::OfRig, CalibrationChoice::Named);
        let rig = rig_with(&stage.rig, 0, scanner.model.name());
        let reading = Reading::of(Some(&rig), 0, true, calibration)?;
        let (latency, id) = (scanner.latency.clone(), scanner.id.clone());
        let mut spec = BenchSpec::new(stage, self.time_scale);
        spec.time.timer = Timer::system();
        spec.scanners.push(scanner);
        let mut bench = Bench::open(spec).await?;
        bench.run();
        let place = bench.places_of(&id).next();
        let rate = lms2xx::Rate::R500000;
        let source = match place.map(|place| (place.kind, &place.at)) {
            Some(("rfc2217", at)) => Source::Rfc2217 { address: at.to_string(), rate },
            Some((_, At::Path(path))) => Source::Serial { path: path.clone(), rate },
            at => Source::Tcp { address: at.map(|(_, at)| at.to_string()).unwrap_or_default() },
        };
        Ok((SetUp { bench, source, latency }, reading))
    }
}

/// The demo's result.
#[derive(Debug, Serialize)]
struct Outcomes {
    estimate: Estimate,
    truth: Truth,
    /// True if the whole row was passed. Otherwise no error of the row is known, and none of the tree at which the drive ended.
    row_passed: bool,
    /// (estimate − truth) / truth of the row's leaf area.
    leaf_area_error: Option<f64>,
    /// The same for the regression on I_T.
    leaf_area_regression_error: Option<f64>,
    seed: u64,
    model: &'static str,
    scans_sent: u64,
    scans_dropped: u64,
    /// Host time from the telegram's hand-over to its socket until the estimate holds it.
    latency_p50_ms: Option<f64>,
    latency_p99_ms: Option<f64>,
    wall_clock_s: f64,
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    args.picture.as_deref().map(pictured::check).transpose()?;
    if args.spray {
        let Args { scene, boom, picture, format, .. } = &args;
        picture.as_deref().map_or(Ok(()), output::can_be_written)?;
        let asked =
            spray_demo::Asked { scene, boom: boom.as_deref(), picture: picture.clone(), format: *format };
        return spray_demo::run(asked, &mut interrupt).await;
    }
    let watch = Stopwatch::start();
    let Some(stage) = interrupt.or(args.scene.stage()).await.transpose()? else {
        return Ok(Outcome::Interrupted(interrupt.signal().await));
    };
    if stage.scene.drive == Drive::default() && stage.rig.speed_m_s == 0.0 {
        let why = "expected a speed above 0, found `speed_m_s = 0` in the rig: the tractor would never pass the row";
        return Err(Failure::Usage(why.to_owned()));
    }
    args.picture.as_deref().map_or(Ok(()), output::can_be_written)?;
    let (set_up, reading) = args.set_up(&stage).await?;
    let (model, scans) = (set_up.model(), set_up.scans());
    say(format_args!("a virtual {model} is at {}, seed {}", set_up.source, stage.scene.seed));

    let prefer = if args.dialect == DialectArg::A { Prefer::A } else { Prefer::B };
    let truth = stage.truth(0);
    let Reading { cola, lms2xx, pipeline } = reading;
    let mut pipeline = pipeline.of_class(row_class(&stage.scene, &truth));
    let config = DriverConfig { cola, lms2xx, prefer: prefer.into(), ..DriverConfig::default() };
    let config = if args.line(&stage)? == Line::Tcp { config.patient() } else { config };
    let Some(mut scanner) = interrupt.or(Scanner::open(&set_up.source, config)).await.transpose()? else {
        return Ok(Outcome::Interrupted(interrupt.signal().await));
    };
    let telling = LinkTeller::start(&scanner, None, None);
    let bar = progress::bar("driving", "scans", scans);
    let mut seen = args.picture.is_some().then(|| PictureScans {
        placing: Placing::new(Some(stage.rig.clone()), 0, stage.scene.drive.alley),
        points: Vec::new(),
    });
    let mut stopped = None;
    let ended = tokio::select! {
        ended = follow(&mut scanner, &mut pipeline, set_up.latency.as_deref(), scans, (&bar, &mut seen)) => ended,
        signal = interrupt.signal() => {
            stopped = Some(signal);
            Ok(())
        }
    };
    bar.finish_and_clear();
    let passed = pipeline.progress().scans;
    let row_passed = passed >= scans;
    if !row_passed {
        say(format_args!("the drive ended after {passed} of {scans} scans: no error of the row is known"));
    }
    let mut found = pipeline.finish();
    let heard = scanner.stop(STOP_TIMEOUT).await;
    found.heard_over(heard.telegrams_bad, heard.segments);
    drop(telling);
    ended?;

    let error = |estimate: Option<f64>| {
        estimate
            .map(|found| (found - truth.leaf_area_m2) / truth.leaf_area_m2)
            .filter(|error| error.is_finite() && row_passed)
    };
    let counts = set_up.counts();
    let outcomes = Outcomes {
        row_passed,
        leaf_area_error: error(found.leaf.areas.best_m2().ok()),
        leaf_area_regression_error: error(found.leaf.areas.regression_m2().ok()),
        estimate: found,
        truth,
        seed: stage.scene.seed,
        model,
        scans_sent: counts.scans_sent,
        scans_dropped: counts.scans_dropped.unwrap_or(0),
        latency_p50_ms: set_up.latency_ms(0.5),
        latency_p99_ms: set_up.latency_ms(0.99),
        wall_clock_s: watch.elapsed().as_secs_f64(),
    };
    print(args.format, &outcomes)?;
    if let (Some(path), Some(PictureScans { points, .. })) = (args.picture, seen) {
        let estimate = outcomes.estimate.clone();
        let work = move || pictured::demo(&path, &stage, &estimate, &points);
        off_runtime("draw the row", work).await?;
    }
    Ok(match stopped {
        Some(signal) if !row_passed => Outcome::Interrupted(signal),
        _ if !row_passed || outcomes.estimate.is_withheld() => Outcome::Finding,
        _ => Outcome::Done,
    })
}

/// What the picture shows of the scans: where their returns came from.
struct PictureScans {
    placing: Placing,
    points: Vec<[f64; 3]>,
}

/// Feeds the pipeline the scans of one pass of the row.
async fn follow(
    scanner: &mut Scanner,
    pipeline: &mut Pipeline,
    latency: Option<&Latency>,
    scans: u64,
    (bar, seen): (&ProgressBar, &mut Option<PictureScans>),
) -> Result<(), Failure> {
    while pipeline.progress().scans < scans {
        let Some(record) = scanner.next().await? else { break };
        pipeline.push(record.scan);
        if let Some(PictureScans { placing, points }) = seen {
            let returns = placing.points(record.scan);
            if pipeline.progress().scans.is_multiple_of(pictured::EVERY) {
                points.extend(returns);
            }
        }
        if let Some(latency) = latency {
            latency.used(record.scan.telegram_counter);
        }
        bar.set_position(pipeline.progress().scans);
    }
    Ok(())
}

fn print(format: Format, outcomes: &Outcomes) -> Result<(), Failure> {
    match format {
        Format::Json | Format::Jsonl => output::print_json(format, outcomes),
        Format::Csv => output::print_rows(format, &beside_truth(outcomes)),
        Format::Table => {
            output::print(&format!("{}\n{}", trees(outcomes), facts(outcomes)))?;
            output::print(&estimate::warnings(&outcomes.estimate.warnings))
        }
    }
}

/// A tree's estimate with the truth beside it.
#[derive(Serialize)]
struct TreeBesideTruth<'a> {
    #[serde(flatten)]
    estimate: &'a TreeEstimate,
    /// Leaf area between the tree's borders, whoever's leaves they are: what the estimator can know.
    truth_leaf_area_m2: Option<f64>,
    truth_lai: Option<f64>,
    truth_height_m: f64,
    /// (estimate − truth) / truth of the leaf area.
    leaf_area_error: Option<f64>,
}

/// Below this share of the mean tree's leaf area a place is a gap, and an error relative to it says nothing.
const LEAST_SHARE: f64 = 0.01;

/// Every tree that has an estimate and a truth.
fn beside_truth(outcomes: &Outcomes) -> Vec<TreeBesideTruth<'_>> {
    let truths = &outcomes.truth.trees;
    let truth_of = |estimate: &TreeEstimate| outcomes.truth.tree(estimate.tree);
    // A tree at which the drive began or ended was not passed.
    let pairs = outcomes.estimate.trees.iter().filter_map(|estimate| Some((estimate, truth_of(estimate)?)));
    let least_m2 = LEAST_SHARE * outcomes.truth.leaf_area_m2 / truths.len().max(1) as f64;
    pairs
        .map(|(estimate, truth)| {
            let leaf_area_m2 = truth.cell_leaf_area_m2;
            let error = |(found, real): (f64, f64)| (found - real) / real;
            let known = estimate.leaf.areas.best_m2().ok().zip(leaf_area_m2);
            let known = known.filter(|(_, real)| estimate.complete && *real >= least_m2);
            TreeBesideTruth {
                estimate,
                truth_leaf_area_m2: leaf_area_m2,
                truth_lai: truth.cell_lai(),
                truth_height_m: truth.height_m,
                leaf_area_error: known.map(error).filter(|error| error.is_finite()),
            }
        })
        .collect()
}

/// Estimate beside truth, tree by tree and for the row.
fn trees(outcomes: &Outcomes) -> String {
    let Outcomes { estimate, truth, .. } = outcomes;
    let mut table = Grid::new();
    output::head(
        &mut table,
        [
            "tree",
            "y m",
            "I_T m²",
            "leaf m² by I_T",
            "leaf m²",
            "truth",
            "error",
            "LAI",
            "truth",
            "height m",
            "truth",
        ],
    );
    for row in beside_truth(outcomes) {
        let found = row.estimate;
        table.add_row([
            number(Some(found.tree.into()), 0),
            number(Some(found.y_m), 2),
            number(Some(found.impacted_total_area_m2), 3),
            number(found.leaf.areas.regression_m2().ok(), 2),
            number(found.leaf.areas.best_m2().ok(), 2),
            number(row.truth_leaf_area_m2, 2),
            percent(row.leaf_area_error),
            number(found.leaf.areas.lai().ok(), 2),
            number(row.truth_lai, 2),
            number(found.height_m, 2),
            number(Some(row.truth_height_m), 2),
        ]);
    }
    table.add_row([
        Cell::new("row"),
        Cell::new(""),
        number(estimate.impacted_total_area_m2, 3),
        number(estimate.leaf.areas.regression_m2().ok(), 2),
        number(estimate.leaf.areas.best_m2().ok(), 2),
        number(Some(truth.leaf_area_m2), 2),
        percent(outcomes.leaf_area_error),
        number(estimate.leaf.areas.lai().ok(), 2),
        number(truth.lai, 2),
        Cell::new(""),
        Cell::new(""),
    ]);
    table.to_string()
}

fn facts(outcomes: &Outcomes) -> String {
    let estimate = &outcomes.estimate;
    let ms = |value: Option<f64>| value.map_or_else(|| "unknown".to_owned(), |ms| format!("{ms:.2} ms"));
    let percent = |error: Option<f64>| {
        error.map_or_else(|| "unknown".to_owned(), |error| format!("{:+.1} %", 100.0 * error))
    };
    let ends = |ends: Option<[f64; 2]>| {
        ends.map_or_else(
            || "unknown".to_owned(),
            |[low_m2, high_m2]| format!("{low_m2:.1} to {high_m2:.1} m²"),
        )
    };
    format!(
        "row leaf area error   {} by contact frequency, {} by I_T\n\
         95 % of leaf areas    {}; by sampling alone {}\n\
         scans                 {} of the row received, {} lost, {} repeated; {} sent until the demo hung up\n\
         latency               p50 {}, p99 {} from the socket to the estimate\n\
         took                  {:.1} s for {:.1} m of row\n",
        percent(outcomes.leaf_area_error),
        percent(outcomes.leaf_area_regression_error),
        ends(estimate.leaf.interval_m2),
        ends(estimate.leaf.sampling_error_m2),
        estimate.scans,
        estimate.scans_lost.map_or_else(|| "unknown".to_owned(), |lost| lost.to_string()),
        estimate.scans_repeated,
        outcomes.scans_sent,
        ms(outcomes.latency_p50_ms),
        ms(outcomes.latency_p99_ms),
        outcomes.wall_clock_s,
        estimate.scanned_m.unwrap_or_default(),
    )
}
