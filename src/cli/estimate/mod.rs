//! `rowscan estimate`

mod follower;
mod map;
mod on_earth;
mod other_scene;
mod other_side;
mod page;
mod print;
mod profile;
mod rig;
mod scanner_report;
mod truth;

use std::path::{Path, PathBuf};

use indicatif::ProgressBar;
use rowscan_canopy::{CutMethod, Enough, RowClass, Warning};
use rowscan_driver::{DriverConfig, DriverError, Source};
use rowscan_emulator::stage::Stage;
use rowscan_ports::Delivery;
use rowscan_ports::task;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Rig};
use rowscan_study::class::bare_class;
use rowscan_study::profile_beside::ProfileBeside;
use rowscan_study::reading::{CalibrationChoice, Reading, ReadingError};
use rowscan_study::side_by_side::beside_truth;
use rowscan_study::sides::SidesError;
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::estimators::EstimatorArgs;
use super::interrupt::Interrupt;
use super::link_options::{Prefer, STOP_TIMEOUT, stream_kind};
use super::output::{self, say};
use super::recorder::{self, RecordArgs, Taping};
use super::sensor::{Sensor, SensorArgs};
use super::web::WebArgs;
use super::{Failure, Format, Outcome, models, progress, scene};
use crate::export::map::LeafMap;
use follower::{Followed, Follower, follow_all};
use map::{MapArgs, Maps};
use on_earth::Way;
use other_side::{Here, OtherSideArgs};
use page::Page;
use print::By;
pub(super) use print::warnings;
use profile::ProfileArgs;
pub(super) use profile::band_m;
pub(in crate::cli) use rig::contradictions;
use rig::{Beams, Loaded, Recorded, Scanners};
use scanner_report::ScannerReport;
use truth::true_scene;

#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("beside").args(["estimators", "truth"]).multiple(true))]
pub(super) struct Args {
    /// tcp://HOST:PORT, picoscan://HOST:PORT?udp=2115, serial:/dev/ttyUSB0?baud=38400, rfc2217://HOST:PORT, or the file of a recording, with `#STREAM` behind it where it holds several;
    /// repeatable, an estimate a scanner
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<Source>,
    /// Where the scanner sits and how fast it drives: a rig file, a scene file or a built-in scene's name [default: the rig that a recording keeps; without one
    /// areas are unknown]
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    /// The rig's scanner this is, from 0; repeatable, in the order of the sources [default: the one that its recording says, else 0, 1, …]
    #[arg(long, value_name = "N")]
    scanner: Vec<usize>,
    /// Model of the scanners, instead of the one that the recording names, or else the rig's own; chooses the calibration
    #[arg(long, value_name = "NAME", value_parser = models::name(), hide_possible_values = true)]
    model: Option<String>,
    /// The echo the scans hold: a live scanner is asked for it; of a recording it is taken as said [default: first of a live scanner]
    #[arg(long, value_enum, value_name = "WHICH")]
    echo: Option<EchoArg>,
    /// How wide the scanner's beams are, instead of what the rig says; a recording by `emulate --record` knows it itself
    #[arg(long, value_enum, value_name = "HOW")]
    optics: Option<OpticsArg>,
    /// A calibration instead of the rig's own: a file, a shipped one's name, or a class (`spindle`), then that of the scanner's model
    #[arg(long, value_name = "NAME")]
    calibration: Option<String>,
    /// End after so many scans of each
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    scans: Option<u64>,
    /// End after so many metres of row
    #[arg(long, value_name = "METRES", value_parser = metres, allow_negative_numbers = true)]
    length: Option<f64>,
    /// Scans a second, for recordings that tell neither times nor a rate
    #[arg(long, value_name = "HZ", value_parser = hertz)]
    hertz: Option<f64>,
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
    #[command(flatten)]
    profile: ProfileArgs,
    /// Seed of the rig's scene, for the truth beside the estimators or the profile; where absent, the recorded one, else the scene's own
    #[arg(long, value_name = "N", requires = "beside")]
    seed: Option<u64>,
    /// How to write the estimate
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// What a line of --format csv is of; the other formats tell all
    #[arg(long, value_enum, value_name = "WHAT", default_value_t)]
    by: By,
    #[command(flatten)]
    other: OtherSideArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    sensor: SensorArgs,
    #[command(flatten)]
    record: RecordArgs,
    #[command(flatten)]
    web: WebArgs,
    /// Recordings take the time that they took.
    #[arg(skip)]
    paced: bool,
}

/// What the only scanner's stream is called in a recording.
const ONE_STREAM: &str = "scanner";

/// What the stream of this scanner, one of so many, is called in a recording.
fn stream_of(scanner: usize, scanners: usize) -> String {
    if scanners > 1 { format!("scanner{scanner}") } else { ONE_STREAM.to_owned() }
}

/// Where `watch` opens its page, unless told otherwise.
const PAGE: &str = "127.0.0.1:8080";

/// An echo of a beam.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum EchoArg {
    /// The first
    First,
    /// The last: what an LMS5xx sends out of the box
    Last,
}

impl From<EchoArg> for EchoChoice {
    fn from(echo: EchoArg) -> Self {
        match echo {
            EchoArg::First => Self::First,
            EchoArg::Last => Self::Last,
        }
    }
}

/// How wide beams are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum OpticsArg {
    /// Rays, as `--optics ideal` of `emulate` makes them
    Ideal,
    /// As the model's own: a real scanner's, and those of `--optics device`
    Device,
}

impl From<OpticsArg> for BeamWidth {
    fn from(optics: OpticsArg) -> Self {
        match optics {
            OpticsArg::Ideal => Self::Ideal,
            OpticsArg::Device => Self::Device,
        }
    }
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

/// A rate of scans.
fn hertz(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(hertz) if (0.01..=10_000.0).contains(&hertz) => Ok(hertz),
        _ => Err(format!("expected 0.01 to 10000 scans a second, found `{text}`")),
    }
}

/// A length to go.
fn metres(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(metres) if metres.is_finite() && metres > 0.0 => Ok(metres),
        _ => Err(format!("expected a number of metres above 0, found `{text}`")),
    }
}

impl Args {
    /// What is said of the beams.
    fn beams(&self) -> Beams {
        Beams { echo: self.echo.map(EchoChoice::from), optics: self.optics.map(BeamWidth::from) }
    }

    /// Refuses what says something of a rig where there is none.
    fn check_rig(&self, rig: Option<&Rig>) -> Result<(), Failure> {
        let of_rig = [
            ("--model", self.model.is_some()),
            ("--echo", self.echo.is_some()),
            ("--optics", self.optics.is_some()),
            ("--profile", self.profile.profile.is_some()),
            ("--other-side", self.other.is_given()),
            ("--map", !self.map.is_empty()),
        ];
        match of_rig.into_iter().find(|(_, is_given)| rig.is_none() && *is_given) {
            None => Ok(()),
            Some((flag, _)) => Err(Failure::Usage(format!(
                "{flag} needs a rig, and no recording here keeps one: say where the scanner sits with --rig"
            ))),
        }
    }

    /// Which of the rig's scanners the sources are, as far as this says.
    fn scanners(&self) -> Result<Scanners<'_>, Failure> {
        let (sources, named) = (self.sources.len(), self.scanner.len());
        match named {
            0 => Ok(Scanners::From(0)),
            _ if named == sources => Ok(Scanners::Asked(&self.scanner)),
            _ => Err(Failure::Usage(format!(
                "expected one --scanner for each of the {sources} sources, in their order, found {named}"
            ))),
        }
    }

    /// How each source is read, each by a rig of its own, of a row of this class where it is known.
    fn readings(
        &self,
        rigs: &[Rig],
        scanners: &[usize],
        class: Option<RowClass>,
    ) -> Result<Vec<Reading>, Failure> {
        let asked = self.estimators.asked()?;
        let cuts: Vec<CutMethod> = self.trees.iter().copied().map(CutMethod::from).collect();
        let read = |(place, (source, scanner)): (usize, (&Source, &usize))| {
            let rig = rigs.get(place);
            let calibration =
                self.calibration.as_deref().map_or(CalibrationChoice::OfRig, CalibrationChoice::Named);
            let encoder = self.sensor.wants_encoder();
            let mut reading = match source.file() {
                Some(_) => Reading::of_recording(rig, *scanner, encoder, calibration),
                None => Reading::of(rig, *scanner, encoder, calibration),
            }?;
            reading.pipeline = reading.pipeline.with_estimators(&asked).with_trees_found(&cuts);
            if let Some(class) = &class {
                reading.pipeline = reading.pipeline.of_class(class.clone());
            }
            if let Some(band_m) = self.profile.profile {
                reading.pipeline = reading.pipeline.with_profile(band_m).map_err(ReadingError::from)?;
            }
            if let Some(hertz) = self.hertz {
                reading.pipeline = reading.pipeline.at_frequency(hertz);
            }
            if self.sensor.only_encoder() {
                reading.pipeline = reading.pipeline.by_encoder_only();
            }
            Ok(reading)
        };
        self.sources.iter().zip(scanners).enumerate().map(read).collect()
    }

    /// All of it is in files: there is an end, and no result before it.
    fn is_recorded(&self) -> bool {
        self.sources.iter().all(|source| source.file().is_some())
    }

    /// The files of its recordings.
    fn files(&self) -> Vec<PathBuf> {
        self.sources.iter().filter_map(Source::file).map(Path::to_owned).collect()
    }

    /// Recordings wait for who reads them.
    fn delivery(&self) -> Delivery {
        if self.is_recorded() { Delivery::Patient } else { Delivery::Paced }
    }

    /// What a recording says of itself.
    fn about(&self, rig: Option<&Rig>, scanners: &[usize]) -> rowscan_recording::About {
        let sources: Vec<String> = self.sources.iter().map(Source::to_string).collect();
        rowscan_recording::About {
            rig: rig.and_then(recorder::rig_text),
            mounts: scanners.iter().map(|scanner| (stream_of(*scanner, scanners.len()), *scanner)).collect(),
            source: Some(sources.join(", ")),
            ..rowscan_recording::About::default()
        }
    }

    /// Who follows the source at this place, which is measured by this rig.
    fn follower(
        &self,
        place: usize,
        (scanners, rig): (&[usize], Option<&Rig>),
        reading: (Reading, Vec<Warning>),
        taping: &Taping,
        sensor: Sensor,
        beside: (&ProgressBar, &Page),
    ) -> Option<Follower> {
        let (source, scanner) = (self.sources.get(place)?, scanners.get(place)?);
        let stream = stream_of(*scanner, scanners.len());
        let name = (scanners.len() > 1).then(|| stream.clone());
        let (Reading { cola, lms2xx, pipeline }, notes) = reading;
        let prefer = self.prefer.into();
        let mut config = DriverConfig { cola, lms2xx, wait: self.wait, prefer, ..DriverConfig::default() };
        let (bar, page) = beside;
        // Of a file, only the page has a use for what it is.
        let kind = page.feeds.as_ref().and_then(|_| rig::recorded_kind(source));
        let kind = kind.unwrap_or_else(|| stream_kind(source));
        config.tap = page.taps.clone().and(taping.taps()).open(&stream, kind);
        Some(Follower {
            place,
            source: source.clone(),
            models: taping.models(scanners.len()),
            name,
            notes,
            taken_for: rig.and_then(|rig| AnyModel::by_name(&rig.scanners.get(*scanner)?.model)),
            config,
            pipeline,
            sensor,
            enough: Enough::new(self.scans, self.length),
            bar: bar.clone(),
            feed: page.feeds.as_ref().map(|feeds| {
                let feed = feeds.of(place);
                rig.and_then(|rig| rig.scanners.get(*scanner))
                    .cloned()
                    .into_iter()
                    .for_each(|mount| feed.sits(mount));
                feed
            }),
            way: (!self.map.is_empty()).then(Way::default),
        })
    }

    /// The map of what was estimated, each by its rig.
    fn mapped(
        &self,
        maps: &Maps,
        all: &[Followed],
        scanners: &[usize],
        rigs: &[Rig],
    ) -> Result<LeafMap, Failure> {
        let mut map = LeafMap::default();
        for followed in all {
            let place = followed.place;
            if let (Some(estimate), Some(way), Some(source), (Some(scanner), Some(rig))) = (
                &followed.estimate,
                &followed.way,
                self.sources.get(place),
                (scanners.get(place), rigs.get(place)),
            ) {
                let row = maps.row(source, (rig, *scanner), way)?;
                map.add(place, estimate, &row, rig.row_spacing_m);
            }
        }
        Ok(map)
    }

    /// What is told of a scanner that gave scans; beside the truth where a scene knows it.
    fn told(
        &self,
        followed: &mut Followed,
        scanners: &[usize],
        truth: Option<(&Stage, &Rig)>,
    ) -> Option<ScannerReport> {
        let (mut estimate, scanner) = (followed.estimate.take()?, scanners.get(followed.place)?);
        let side_by_side = match self.estimators.are_asked() {
            true => beside_truth(&estimate, *scanner, truth),
            false => Vec::new(),
        };
        let profile = self.profile.told(&estimate, *scanner, truth);
        let row_ends = truth.is_some_and(|(stage, _)| !stage.orchard.period_m().is_finite());
        let mut beside = side_by_side.iter().filter(|beside| beside.measure.value.is_some()).peekable();
        let untold = beside.peek().is_some() && beside.all(|beside| beside.truth.is_none());
        if row_ends && (untold || profile.as_ref().is_some_and(ProfileBeside::lacks_truth)) {
            say(format_args!(
                "no truth is told of the row: the scans reach beyond its ends, and nothing is known there; begin with `start_m` 0, and end with --length"
            ));
        }
        estimate.profile = None;
        let several = scanners.len() > 1;
        Some(ScannerReport {
            scanner: several.then_some(*scanner),
            source: several
                .then(|| self.sources.get(followed.place).map(Source::to_string).unwrap_or_default()),
            estimate,
            profile,
            side_by_side,
        })
    }
}

/// `rowscan watch`: the same with a page, waiting for the scanner, and recordings as slow as they were.
pub(super) async fn watch(args: Args, interrupt: Interrupt) -> Result<Outcome, Failure> {
    let web = args.web.clone().at_least(PAGE);
    run(Args { web, wait: true, paced: true, ..args }, interrupt).await
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    let asked = args.scanners()?;
    if args.record.is_given() && args.is_recorded() {
        let why = "--record keeps what a scanner sends, and this is a recording already: leave it out, or write it anew with `rowscan record FILE -o NEW`";
        return Err(Failure::Usage(why.to_owned()));
    }
    let model = args.model.as_deref();
    let loaded = rig::load(args.rig.as_deref(), model, (&args.sources, asked), args.beams())?;
    let (rig, scanners, scene, mut recorded) = match loaded {
        Some(Loaded { rig, scanners, scene, recorded }) => (Some(rig), scanners, scene, recorded),
        None => (None, asked.in_order(args.sources.len()), None, Vec::new()),
    };
    args.check_rig(rig.as_ref())?;
    let rigs: Vec<Rig> =
        rig.iter().flat_map(|rig| recorded.iter().map(|told: &Recorded| told.decides(rig))).collect();
    let maps = args.map.check(&args.sources, scene.as_ref(), args.other.is_by_receivers())?;
    args.map.check_rows(&rigs, &scanners)?;
    args.other.check(&args.sources)?;
    if args.by == By::Band && args.profile.profile.is_none() {
        let why = "--by band writes the bands of a profile: say how high they are with --profile METRES";
        return Err(Failure::Usage(why.to_owned()));
    }
    let mut readings = args.readings(&rigs, &scanners, scene.as_ref().and_then(bare_class))?;
    if let (Some(reading), Some(scanner), Some(rig), Some(source), true) =
        (readings.first_mut(), scanners.first(), rigs.first(), args.sources.first(), args.other.is_given())
    {
        let here = Here {
            source,
            rig,
            scanner: *scanner,
            pipeline: &reading.pipeline,
            scene: scene.as_ref(),
            antenna: args.map.antenna(),
        };
        let read = args.other.read((args.rig.as_deref(), args.beams()), here);
        match interrupt.or(read).await.transpose()? {
            None => return Ok(Outcome::Done),
            Some(None) => {}
            Some(Some(side)) => {
                let joined = reading.pipeline.clone().joined_with(side);
                reading.pipeline = joined.map_err(SidesError::from)?;
            }
        }
    }
    if args.profile.truth && scene.is_none() {
        say("no truth is told: --rig names no scene");
    }
    let scene = args.rig.as_deref().zip(scene).filter(|_| args.estimators.are_asked() || args.profile.truth);
    let stage = match scene.and_then(|scene| true_scene(scene, args.seed, &args.sources, &mut recorded)) {
        Some(scene) => match interrupt.or(scene::grow(scene)).await.transpose()? {
            Some(stage) => Some(stage),
            None => return Ok(Outcome::Done),
        },
        None => None,
    };
    let sensors = args.sensor.open(args.format, &args.sources, args.delivery()).await?;
    let taping = args.record.start(args.about(rig.as_ref(), &scanners), false)?;
    sensors.record_to(&taping.taps());
    let page = Page::open(&args, &scanners).await?;
    let bar =
        progress::bar("scanning", "scans", args.scans.unwrap_or(0).saturating_mul(scanners.len() as u64));
    let (stop, stopped) = watch::channel(false);
    let mut following = JoinSet::new();
    for (place, reading) in readings.into_iter().enumerate() {
        let sensor = sensors.of(place);
        let notes =
            recorded.get_mut(place).map(|told| std::mem::take(&mut told.warnings)).unwrap_or_default();
        if let Some(follower) = args.follower(
            place,
            (&scanners, rigs.get(place)),
            (reading, notes),
            &taping,
            sensor,
            (&bar, &page),
        ) {
            following.spawn(task(follower.follow(stopped.clone())));
        }
    }
    let (mut all, interrupted) = follow_all(following, stop, &mut interrupt).await?;
    bar.finish_and_clear();
    if let Some(signal) = interrupted.filter(|_| args.is_recorded() && !args.paced) {
        // A part of a file looks like the whole of another one.
        let scans: u64 = all.iter().filter_map(|followed| Some(followed.estimate.as_ref()?.scans)).sum();
        say(format_args!("interrupted after {scans} scans: there is no estimate of the whole"));
        return Ok(Outcome::Interrupted(signal));
    }
    if args.paced
        && !args.is_recorded()
        && interrupted.is_none()
        && all.iter().all(|followed| followed.ended.is_ok())
    {
        say("all has been shown; Ctrl-C closes the page");
        interrupt.wait().await;
    }
    sensors.part(STOP_TIMEOUT).await;
    let failed = all.iter_mut().find_map(|followed| std::mem::replace(&mut followed.ended, Ok(())).err());
    let truth = |place: usize| {
        let is_here = recorded.get(place).is_some_and(|recorded| recorded.other_scene.is_none());
        stage.as_ref().zip(rigs.get(place)).filter(|_| is_here)
    };
    let is_asked = rig.is_some() && !maps.are_none();
    let map = is_asked.then(|| args.mapped(&maps, &all, &scanners, &rigs));
    let mut is_mapped = true;
    let told: Vec<ScannerReport> =
        all.iter_mut().filter_map(|followed| args.told(followed, &scanners, truth(followed.place))).collect();
    // Without a rig nobody asked for areas.
    let nothing =
        |told: &ScannerReport| told.estimate.scans == 0 || rig.is_some() && told.estimate.is_withheld();
    let withheld = told.iter().any(nothing);
    // Of a live scanner, what was seen before a failure is not lost by it; a file can be read again. One without a scan is told as such.
    let has_no_scan = matches!(failed, Some(Failure::Driver(DriverError::NoScan { .. })));
    if args.is_recorded()
        && !has_no_scan
        && let Some(cause) = failed
    {
        return Err(cause);
    }
    if !told.is_empty() {
        if rig.is_none() {
            say("no rig given: areas stay unknown; say where the scanner sits with --rig");
        }
        print::print(args.format, args.by, &told)?;
        if let Some(map) = map {
            is_mapped = maps.write(&map?)?;
        }
    } else if let Some(cause) = failed {
        // A source that never gave a scan has nothing to show, nor has its recording.
        return Err(cause);
    }
    for followed in &mut all {
        if let Some(latency) = sensors.latency(&mut followed.sensor) {
            output::tell_latency(args.format, &latency)?;
        }
    }
    // Recorded all the same, whatever the estimate knows.
    let outcome = match (taping.finish(), withheld || !is_mapped) {
        (Outcome::Done, true) => Outcome::Finding,
        (outcome, _) => outcome,
    };
    failed.map_or(Ok(outcome), Err)
}
