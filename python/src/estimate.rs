//! `estimate`: what `rowscan estimate --format json` writes of one source.

use std::fmt::Display;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use pyo3::prelude::*;
use rowscan_canopy::{CutMethod, Enough, Estimate, Pipeline, Reached, UNREADABLE};
use rowscan_driver::{Arrival, DriverConfig, Scanner, Source};
use rowscan_emulator::stage::Stage;
use rowscan_ports::clock;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_protocol::scan::Scan;
use rowscan_scenes::files::{load_rig, rig_from_text};
use rowscan_study::reading::{CalibrationChoice, Reading, ReadingError, fitted_rig};
use rowscan_study::side_by_side::{Beside, beside_truth, estimators_named};
use serde::Serialize;

use crate::failure::{Failure, Refusal};
use crate::one_or_more::OneOrMore;
use crate::orchard::{SceneOf, grown};
use crate::scans::ScanArrays;
use crate::{document, wait, warning};

/// How often it is asked whether that is enough while nothing arrives.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// The document: an estimate, and the row's numbers beside the truth if estimators were asked for.
#[derive(Serialize)]
struct EstimateDocument {
    #[serde(flatten)]
    estimate: Estimate,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    side_by_side: Vec<Beside>,
}

/// Estimates leaf area from a scanner or a recording.
#[pyfunction]
#[pyo3(signature = (source, rig = None, *, scanner = None, model = None, echo = None, calibration = None, scans = None, length_m = None, hertz = None, estimators = None, trees = None, profile = None))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn estimate(
    py: Python<'_>,
    source: SourceOf,
    rig: Option<SceneOf>,
    scanner: Option<usize>,
    model: Option<&str>,
    echo: Option<&str>,
    calibration: Option<PathBuf>,
    scans: Option<u64>,
    length_m: Option<f64>,
    hertz: Option<f64>,
    estimators: Option<OneOrMore<String>>,
    trees: Option<OneOrMore<String>>,
    profile: Option<f64>,
) -> PyResult<Py<PyAny>> {
    let model = model.map(AnyModel::named).transpose().map_err(Failure::from)?;
    let echo = echo.map(echo_named).transpose()?;
    let all = |given: Option<OneOrMore<String>>| given.map(OneOrMore::all).unwrap_or_default();
    let asked = estimators_named(&all(estimators)).map_err(Failure::from)?;
    let cuts: Result<Vec<CutMethod>, _> = all(trees).iter().map(|name| CutMethod::named(name)).collect();
    let cuts = cuts.map_err(Failure::from)?;
    let recorded = source.recorded_model();
    let told = scanner.or_else(|| source.mount());
    let scanner = told.unwrap_or(0);
    let model = model.or(recorded);
    let (rig, stage) = match (rig, &source) {
        (None, SourceOf::Scans(scans)) => {
            let scans = scans.get();
            let rig = scans.rig().map(|rig| fitted_rig(rig, &[scanner], model, echo));
            (rig, scans.stage())
        }
        (None, SourceOf::Named(_)) => {
            let kept = source.kept_rig(py)?;
            if let Some(found) = kept.as_ref().map(|rig| rig.scanners.len()).filter(|found| *found > 1)
                && told.is_none()
            {
                let why = format!(
                    "the kept rig has {found} scanners, and the recording does not say which of them it is: say it with `scanner`, from 0"
                );
                return Err(Failure::from(Refusal::Usage(why)).into());
            }
            (kept.map(|rig| fitted_rig(rig, &[scanner], model, echo)), None)
        }
        (rig, _) => rig_given(py, rig, (scanner, model, echo), !asked.is_empty())?,
    };
    let from = source.from(py)?;
    let mount = rig.as_ref().and_then(|rig| rig.scanners.get(scanner));
    let taken_for = mount.and_then(|mount| AnyModel::by_name(&mount.model));
    let reading = reading(&from, rig.as_ref(), scanner, calibration)?;
    let pipeline = reading.pipeline.with_estimators(&asked).with_trees_found(&cuts);
    let pipeline = match profile {
        Some(band_m) => pipeline.with_profile(band_m).map_err(ReadingError::from).map_err(Failure::from)?,
        None => pipeline,
    };
    let pipeline = hertz.into_iter().fold(pipeline, Pipeline::at_frequency);
    let config = DriverConfig { cola: reading.cola, lms2xx: reading.lms2xx, ..DriverConfig::default() };
    let enough = Enough::new(scans, length_m);
    let (estimate, reached) = match from {
        From::Scans(all) => {
            let work = move || {
                let mut estimate = of_scans(&all, pipeline, enough);
                if let Some((recorded, taken_for)) = recorded.zip(taken_for) {
                    estimate.named(&[recorded], taken_for);
                }
                Ok((estimate, None))
            };
            wait::for_work(py, "estimate from scans", work)?
        }
        From::Source(source) => {
            let work = move || follow((source, taken_for), config, pipeline, enough);
            wait::for_future(py, "follow the scanner", work)?
        }
    };
    if reached == Some(Reached::NothingValid) {
        warning::warn(py, format_args!("telegrams came for {UNREADABLE:?}, and none held a valid scan"))?;
    }
    if asked.is_empty() {
        return document::of(py, &EstimateDocument { estimate, side_by_side: Vec::new() });
    }
    let told = wait::for_work(py, "compare the estimate with the truth", move || {
        let truth = stage.as_deref().zip(rig.as_ref());
        Ok(EstimateDocument { side_by_side: beside_truth(&estimate, scanner, truth), estimate })
    })?;
    document::of(py, &told)
}

/// What is estimated from.
#[derive(FromPyObject)]
pub(crate) enum SourceOf {
    /// Scans that were driven or read.
    Scans(Py<ScanArrays>),
    /// A live scanner or a recording.
    Named(PathBuf),
}

/// The same, out of Python's hands.
enum From {
    Scans(Vec<Scan>),
    Source(Source),
}

impl SourceOf {
    /// The model that the recording of the scans names.
    fn recorded_model(&self) -> Option<AnyModel> {
        match self {
            Self::Scans(scans) => scans.get().recorded_model(),
            Self::Named(source) => source.to_string_lossy().parse::<Source>().ok()?.recorded_model(),
        }
    }

    /// Which of its rig's scanners a recording says that it is of.
    fn mount(&self) -> Option<usize> {
        let Self::Named(source) = self else { return None };
        let source: Source = source.to_string_lossy().parse().ok()?;
        source.mount_in(&source.peek()?)
    }

    /// The rig that a recording keeps.
    fn kept_rig(&self, py: Python<'_>) -> PyResult<Option<Rig>> {
        let Self::Named(source) = self else { return Ok(None) };
        let recording = source.to_string_lossy().parse::<Source>().ok().and_then(|source| source.peek());
        let Some(text) = recording.and_then(|recording| recording.about().rig.clone()) else {
            return Ok(None);
        };
        let tell =
            |what: &dyn Display| warning::warn(py, format_args!("{}: its rig: {what}", source.display()));
        let mut old_roofs = Vec::new();
        match rig_from_text(&text, |old| old_roofs.push(old)) {
            Ok(rig) => old_roofs.iter().try_for_each(|old| tell(old)).map(|()| Some(rig)),
            Err(why) => tell(&why).map(|()| None),
        }
    }

    fn from(self, py: Python<'_>) -> PyResult<From> {
        Ok(match self {
            Self::Scans(scans) => From::Scans(scans.get().scans(py)?),
            Self::Named(source) => From::Source(source.to_string_lossy().parse().map_err(Failure::from)?),
        })
    }
}

/// What an estimator makes of scans until there are enough.
fn of_scans(scans: &[Scan], mut pipeline: Pipeline, mut enough: Enough) -> Estimate {
    for scan in scans {
        pipeline.push(scan);
        if enough.reached(&pipeline, 0, Duration::ZERO).is_some() {
            break;
        }
    }
    pipeline.finish()
}

/// The rig that was given, with what stands there if that is asked for.
fn rig_given(
    py: Python<'_>,
    rig: Option<SceneOf>,
    (scanner, model, echo): (usize, Option<AnyModel>, Option<EchoChoice>),
    with_truth: bool,
) -> PyResult<(Option<Rig>, Option<Arc<Stage>>)> {
    let Some(rig) = rig else { return Ok((None, None)) };
    let (rig, stage) = rig_of(py, rig, with_truth)?;
    Ok((Some(fitted_rig(rig, &[scanner], model, echo)), stage))
}

fn echo_named(name: &str) -> Result<EchoChoice, Failure> {
    match name {
        "first" => Ok(EchoChoice::First),
        "last" => Ok(EchoChoice::Last),
        found => Err(Refusal::Usage(format!("echo: expected `first` or `last`, found `{found}`")).into()),
    }
}

/// The rig, and what really stands there, grown if it is asked for and the scene is known.
fn rig_of(py: Python<'_>, rig: SceneOf, with_truth: bool) -> PyResult<(Rig, Option<Arc<Stage>>)> {
    match rig {
        SceneOf::Grown(orchard) => {
            let stage = &orchard.get().stage;
            Ok((stage.rig.clone(), with_truth.then(|| Arc::clone(stage))))
        }
        SceneOf::Named(name) => {
            let (rig, scene) = warning::of_file(py, |tell| load_rig(&name.to_string_lossy(), tell))?;
            Ok((rig, scene.filter(|_| with_truth).map(|scene| grown(py, scene)).transpose()?))
        }
    }
}

fn reading(
    from: &From,
    rig: Option<&Rig>,
    scanner: usize,
    calibration: Option<PathBuf>,
) -> Result<Reading, Failure> {
    let name = calibration.map(|path| path.to_string_lossy().into_owned());
    let calibration = name.as_deref().map_or(CalibrationChoice::OfRig, CalibrationChoice::Named);
    Ok(match from {
        From::Source(Source::Recording { .. }) => Reading::of_recording(rig, scanner, true, calibration),
        _ => Reading::of(rig, scanner, true, calibration),
    }?)
}

/// Follows the source until it ends, or `enough` says why not.
async fn follow(
    (source, taken_for): (Source, Option<AnyModel>),
    config: DriverConfig,
    mut pipeline: Pipeline,
    mut enough: Enough,
) -> Result<(Estimate, Option<Reached>), Failure> {
    let mut scanner = Scanner::open(&source, config).await?;
    pipeline.set_up(&scanner.settings());
    let reached = loop {
        match clock::within(LOOK_EVERY, scanner.arrival()).await.transpose()? {
            None => {}
            Some(None) => break None,
            Some(Some(Arrival::Scan(record))) => pipeline.push(record.scan),
            Some(Some(Arrival::Reading { .. })) => {}
            Some(Some(Arrival::Unreadable { fault, .. })) => pipeline.push_unreadable(&fault),
        }
        let reached = enough.reached(&pipeline, scanner.counts().telegrams_bad, scanner.now().0);
        if reached.is_some() {
            break reached;
        }
        // A recording never waits by itself.
        tokio::task::coop::consume_budget().await;
    };
    let mut found = pipeline.finish();
    let (broken_off, models, settings) = (scanner.broken_off(), scanner.models(), scanner.settings());
    let left_out = scanner.streams_left_out();
    let heard = scanner.stop(wait::STOP_TIMEOUT).await;
    found.heard_over(heard.telegrams_bad, heard.segments);
    found.set_up(settings);
    if let Some(place) = broken_off {
        found.broken_off(place);
    }
    if let Some(others) = left_out {
        found.streams_left_out(others.read, others.left_out);
    }
    if let Some(taken_for) = taken_for {
        found.named(&models, taken_for);
    }
    Ok((found, reached))
}
