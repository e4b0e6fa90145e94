//! `ScanArrays`: the scans of one scanner as arrays, of a recording or of a drive in memory.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rowscan_canopy::{PlacedLine, Placing};
use rowscan_driver::{Arrival, DriverConfig, Scanner, Source};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::{DAZZLED, Echo, EncoderReading, NO_ECHO, Scan};
use rowscan_protocol::time::{DeviceClock, SimTime};
use rowscan_protocol::validity::DeviceStatus;
use rowscan_scenes::files::load_rig;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_study::trial::{self, StartUpRequests};
use serde::{Deserialize, Serialize};

use crate::failure::{Failure, Refusal};
use crate::orchard::SceneOf;
use crate::readings::Readings;
use crate::seed::Seed;
use crate::{arrays, wait, warning};

/// The scans of one scanner.
#[pyclass(frozen, module = "rowscan")]
pub(crate) struct ScanArrays {
    /// On the device's clock, since the first scan: seconds, float64, (scans,).
    #[pyo3(get)]
    time_s: Py<PyArray1<f64>>,
    /// When each was received, since the recording began: seconds, float64, (scans,); NaN where a recording has no times. None for a drive.
    #[pyo3(get)]
    received_s: Option<Py<PyArray1<f64>>>,
    /// Ranges: metres, float64, (scans, beams); NaN where a beam met nothing.
    #[pyo3(get)]
    ranges_m: Py<PyArray2<f64>>,
    /// Received signal strength in the device's digits: uint16, (scans, beams); None where not every scan has it.
    #[pyo3(get)]
    remission: Option<Py<PyArray2<u16>>>,
    /// Where the beams point, on the device's own scale: degrees, float64, (beams,).
    #[pyo3(get)]
    angles_deg: Py<PyArray1<f64>>,
    /// First encoder: ticks, uint32, (scans,), wraps; None where not every scan has it.
    #[pyo3(get)]
    encoder_ticks: Option<Py<PyArray1<u32>>>,
    /// Counts telegrams: uint16, (scans,), wraps.
    #[pyo3(get)]
    telegram_counter: Py<PyArray1<u16>>,
    /// Counts turns of the mirror: uint16, (scans,), wraps.
    #[pyo3(get)]
    scan_counter: Py<PyArray1<u16>>,
    /// Where the tractor is along its row at each scan: metres, float64, (scans,). Of a drive; None of a recording, which does not know.
    #[pyo3(get)]
    row_m: Option<Py<PyArray1<f64>>>,
    /// How fast it drives at each scan: m/s, float64, (scans,). Of a drive.
    #[pyo3(get)]
    speed_m_s: Option<Py<PyArray1<f64>>>,
    /// Readings of the scanner's inertial measurement unit: a dict of arrays. Of recordings that hold some.
    #[pyo3(get)]
    imu: Option<Py<PyDict>>,
    /// The same of its encoder, where that has telegrams of its own.
    #[pyo3(get)]
    wheel: Option<Py<PyDict>>,
    /// What the arrays do not hold, and an estimate needs.
    told: Told,
    /// Of a drive: what stands there.
    stage: Option<Arc<Stage>>,
}

/// What telegrams tell of scans besides arrays.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Told {
    start: i32,
    step: u16,
    count: u16,
    scan_frequency_hz: f64,
    layer_centideg: i16,
    /// Which echo of each beam it is, from 0.
    echo: usize,
    /// The device's clock and its word of itself, by scan.
    time_us: Vec<u32>,
    status: Vec<u8>,
    /// Beams whose receiver was dazzled, by scan and beam: in the arrays they are NaN, as misses are.
    dazzled: BTreeSet<(usize, usize)>,
    /// Of a drive, with the alley that it is in.
    rig: Option<(Rig, Option<i32>)>,
    /// The name of the model that their recording names.
    #[serde(default)]
    model: Option<String>,
}

impl Told {
    fn beams(&self) -> BeamGrid {
        BeamGrid { start: self.start, step: self.step, count: self.count }
    }
}

/// Scans as they come, before Python has them.
#[derive(Default)]
struct Gathered {
    clock: DeviceClock,
    beams: Option<BeamGrid>,
    told: Told,
    time_s: Vec<f64>,
    received_s: Vec<f64>,
    ranges_m: Vec<f64>,
    remission: Vec<u16>,
    encoder_ticks: Vec<u32>,
    telegram_counter: Vec<u16>,
    scan_counter: Vec<u16>,
    readings: Readings,
}

impl Gathered {
    fn push(&mut self, scan: &Scan, echo: usize) -> Result<(), Failure> {
        let beams = *self.beams.get_or_insert(scan.beams);
        if beams != scan.beams {
            let (found, expected) = (scan.beams.len(), beams.len());
            return Err(Refusal::OtherBeams { scan: self.time_s.len(), found, expected }.into());
        }
        let number = self.time_s.len();
        self.told.scan_frequency_hz = scan.scan_frequency_hz;
        self.told.layer_centideg = scan.layer_centideg;
        self.told.echo = echo;
        self.told.time_us.push(scan.scan_time_us);
        self.told.status.push(scan.status.number());
        self.time_s.push(self.clock.seconds(scan.scan_time_us));
        match scan.echoes.get(echo) {
            Some(echo) => {
                let or_nan = |range_m: &f64| if range_m.is_finite() { *range_m } else { f64::NAN };
                self.ranges_m.extend(echo.range_m.iter().map(or_nan));
                let dazzled = echo.range_m.iter().enumerate().filter(|(_, range_m)| range_m.is_nan());
                self.told.dazzled.extend(dazzled.map(|(beam, _)| (number, beam)));
                self.remission.extend_from_slice(&echo.remission);
            }
            None => self.ranges_m.extend(std::iter::repeat_n(f64::NAN, beams.len())),
        }
        self.encoder_ticks.extend(scan.encoders.first().map(|encoder| encoder.position_ticks));
        self.telegram_counter.push(scan.telegram_counter);
        self.scan_counter.push(scan.scan_counter);
        Ok(())
    }

    fn hand_over(self, py: Python<'_>, drive: Option<Driven>) -> PyResult<ScanArrays> {
        let beams = self.beams.unwrap_or_default();
        let (scans, columns) = (self.time_s.len(), beams.len());
        let has_remission = scans > 0 && self.remission.len() == self.ranges_m.len();
        let has_encoder = scans > 0 && self.encoder_ticks.len() == scans;
        let is_drive = drive.is_some();
        let (rig, stage, motions) = match drive {
            Some(Driven { rig, alley, stage }) => {
                let motions = motions(&stage, &self.time_s);
                (Some((rig, alley)), Some(stage), motions)
            }
            None => Default::default(),
        };
        let (row_m, speed_m_s): (Vec<f64>, Vec<f64>) = motions.into_iter().unzip();
        let known = |of: Vec<f64>| is_drive.then(|| arrays::line(py, of));
        let BeamGrid { start, step, count } = beams;
        Ok(ScanArrays {
            row_m: known(row_m),
            speed_m_s: known(speed_m_s),
            received_s: (!is_drive).then(|| arrays::line(py, self.received_s)),
            ranges_m: arrays::rows(py, self.ranges_m, columns)?,
            remission: has_remission.then(|| arrays::rows(py, self.remission, columns)).transpose()?,
            angles_deg: arrays::line(py, (0..columns).map(|beam| beams.angle_deg(beam)).collect()),
            encoder_ticks: has_encoder.then(|| arrays::line(py, self.encoder_ticks)),
            telegram_counter: arrays::line(py, self.telegram_counter),
            scan_counter: arrays::line(py, self.scan_counter),
            time_s: arrays::line(py, self.time_s),
            imu: self.readings.imu(py)?,
            wheel: self.readings.wheel(py)?,
            told: Told { start, step, count, rig, ..self.told },
            stage,
        })
    }
}

/// A drive that is over.
struct Driven {
    rig: Rig,
    alley: Option<i32>,
    stage: Arc<Stage>,
}

/// Where the tractor is along its row at these times of the drive, and how fast.
fn motions(stage: &Stage, time_s: &[f64]) -> Vec<(f64, f64)> {
    let tractor = stage.tractor();
    tractor.begin(SimTime(0));
    let motion = |time_s: &f64| {
        let motion = tractor.motion(SimTime((time_s * 1e9).round() as u64));
        (motion.place.y_m, motion.speed_m_s)
    };
    time_s.iter().map(motion).collect()
}

/// Drives one scanner past the first row, in memory, and gives its scans: those that a client of the same scanner receives, bit for bit.
#[pyfunction]
#[pyo3(signature = (orchard = SceneOf::Named(PathBuf::from("spindle")), model = None, *, remission = true, seed = None, optics = None))]
pub(crate) fn drive(
    py: Python<'_>,
    orchard: SceneOf,
    model: Option<&str>,
    remission: bool,
    seed: Option<Seed>,
    optics: Option<&str>,
) -> PyResult<ScanArrays> {
    let named = model.map(AnyModel::named).transpose().map_err(Failure::from)?;
    let stage = orchard.stage(py, seed, optics)?;
    let mounted = || stage.rig.scanners.first().map_or("", |mount| mount.model.as_str());
    let model = named.map_or_else(|| AnyModel::named(mounted()), Ok).map_err(Failure::from)?;
    let rig = rig_with(&stage.rig, 0, model.name());
    let (told, driven) = (rig.clone(), Arc::clone(&stage));
    let gathered = wait::for_work(py, "drive past the row", move || {
        let none = CalibrationChoice::Given(None);
        let Reading { mut cola, lms2xx, .. } = Reading::of(Some(&told), 0, true, none)?;
        cola.remission = remission;
        let (mut gathered, mut fits) = (Gathered::default(), Ok(()));
        trial::each_scan(&stage, model, StartUpRequests { cola, lms2xx }, &mut |scan| {
            if fits.is_ok() {
                fits = gathered.push(scan, 0);
            }
        })?;
        fits.map(|()| gathered)
    })?;
    let alley = driven.scene.drive.alley;
    gathered.hand_over(py, Some(Driven { rig, alley, stage: driven }))
}

/// Reads the scans of a recording: MCAP, pcap, pcapng, raw bytes, hex text, or ranges as CSV; `FILE#STREAM` where it holds several.
#[pyfunction]
#[pyo3(signature = (path, *, echo = 0, scans = None))]
pub(crate) fn read(py: Python<'_>, path: PathBuf, echo: usize, scans: Option<usize>) -> PyResult<ScanArrays> {
    let source: Source = path.to_string_lossy().parse().map_err(Failure::from)?;
    if !matches!(source, Source::Recording { .. }) {
        return Err(Refusal::Usage(format!("{source} is live: `rowscan record` it first")).into());
    }
    let gathered = wait::for_future(py, "read the recording", move || async move {
        let mut scanner = Scanner::open(&source, DriverConfig::default()).await?;
        let mut gathered = Gathered::default();
        gathered.told.model = source.recorded_model().map(|model| model.name().to_owned());
        while scans.is_none_or(|most| gathered.time_s.len() < most) {
            match scanner.arrival().await? {
                None => break,
                Some(Arrival::Scan(record)) => {
                    gathered.push(record.scan, echo)?;
                    gathered.received_s.push(record.received_s());
                }
                Some(Arrival::Reading { reading, received }) => {
                    gathered.readings.push(received.0.as_secs_f64(), reading);
                }
                Some(Arrival::Unreadable { .. }) => {}
            }
            // A recording never waits by itself.
            tokio::task::coop::consume_budget().await;
        }
        Ok(gathered)
    })?;
    gathered.hand_over(py, None)
}

#[pymethods]
impl ScanArrays {
    /// Every return as a point in the scene's frame: X across the rows, the first of which stands at 0, Y along them, Z up; metres.
    #[pyo3(signature = (rig = None, *, scanner = 0))]
    fn points<'py>(
        &self,
        py: Python<'py>,
        rig: Option<PathBuf>,
        scanner: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rig = match rig {
            Some(name) => {
                let (rig, scene) = warning::of_file(py, |tell| load_rig(&name.to_string_lossy(), tell))?;
                Some((rig, scene.and_then(|scene| scene.drive.alley)))
            }
            None => self.told.rig.clone(),
        };
        let (rig, alley) = rig.unzip();
        let beams = self.told.beams();
        let (ranges_m, time_s) =
            (self.ranges_m.bind(py).try_readonly()?, self.time_s.bind(py).try_readonly()?);
        let (ranges_m, time_s) = (ranges_m.as_slice()?, time_s.as_slice()?);
        let ticks = self.encoder_ticks.as_ref().map(|ticks| ticks.bind(py).try_readonly()).transpose()?;
        let ticks = ticks.as_ref().map(|ticks| ticks.as_slice()).transpose()?;
        let (mut placing, columns) = (Placing::new(rig, scanner, alley.flatten()), beams.len());
        let (mut points_m, mut scans, mut numbers) = (Vec::new(), Vec::<u32>::new(), Vec::<u32>::new());
        for ((scan, time_s), line) in (0..).zip(time_s).zip(ranges_m.chunks(columns.max(1))) {
            let layer_deg = placing.layer_deg(self.told.layer_centideg);
            let placed = PlacedLine::new(*time_s, self.told.scan_frequency_hz, beams, layer_deg);
            let placed =
                placing.on_its_way(placed, ticks.and_then(|ticks| ticks.get(scan as usize)).copied());
            for (beam, range_m) in (0..).zip(line).filter(|(_, range_m)| range_m.is_finite()) {
                points_m.push(placing.place(&placed, beam as usize, *range_m));
                scans.push(scan);
                numbers.push(beam);
            }
        }
        let found = PyDict::new(py);
        found.set_item("points_m", arrays::points(py, points_m)?)?;
        found.set_item("scan", arrays::line(py, scans))?;
        found.set_item("beam", arrays::line(py, numbers))?;
        Ok(found)
    }

    /// A pandas data frame: a row a beam of a scan, misses too.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (numpy, pandas) = (py.import("numpy")?, py.import("pandas")?);
        let (scans, beams) = (self.time_s.bind(py).len(), self.told.beams().len());
        let each = |values: &Bound<'py, PyAny>| numpy.call_method1("repeat", (values, beams));
        let columns = PyDict::new(py);
        let numbers =
            |count: usize| numpy.call_method1("arange", (count,))?.call_method1("astype", ("uint32",));
        columns.set_item("scan", each(&numbers(scans)?)?)?;
        columns.set_item("time_s", each(self.time_s.bind(py).as_any())?)?;
        columns.set_item("beam", numpy.call_method1("tile", (numbers(beams)?, scans))?)?;
        columns.set_item("angle_deg", numpy.call_method1("tile", (self.angles_deg.bind(py), scans))?)?;
        columns.set_item("range_m", self.ranges_m.bind(py).call_method0("ravel")?)?;
        if let Some(remission) = &self.remission {
            columns.set_item("remission", remission.bind(py).call_method0("ravel")?)?;
        }
        if let Some(ticks) = &self.encoder_ticks {
            columns.set_item("encoder_ticks", each(ticks.bind(py).as_any())?)?;
        }
        for (name, column) in [("row_m", &self.row_m), ("speed_m_s", &self.speed_m_s)] {
            if let Some(column) = column {
                columns.set_item(name, each(column.bind(py).as_any())?)?;
            }
        }
        pandas.call_method1("DataFrame", (columns,))
    }

    /// The arrays, and the rest as text. What stood there is grown again by whoever needs it.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let told = serde_json::to_string(&self.told).map_err(Failure::from)?;
        let parts: [Bound<'py, PyAny>; 13] = [
            self.time_s.bind(py).as_any().clone(),
            self.received_s.or_none(py),
            self.ranges_m.bind(py).as_any().clone(),
            self.remission.or_none(py),
            self.angles_deg.bind(py).as_any().clone(),
            self.encoder_ticks.or_none(py),
            self.telegram_counter.bind(py).as_any().clone(),
            self.scan_counter.bind(py).as_any().clone(),
            self.row_m.or_none(py),
            self.speed_m_s.or_none(py),
            self.imu.or_none(py),
            self.wheel.or_none(py),
            told.into_bound_py_any(py)?,
        ];
        Ok((py.import("rowscan._native")?.getattr("_scans")?, PyTuple::new(py, parts)?))
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.time_s.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<rowscan.ScanArrays: {} scans of {} beams>", self.__len__(py), self.told.beams().len())
    }
}

/// An array that may be missing, as a pickle has it.
trait OrNone {
    fn or_none<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny>;
}

impl<T> OrNone for Option<Py<T>> {
    fn or_none<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        match self {
            Some(array) => array.bind(py).as_any().clone(),
            None => py.None().into_bound(py),
        }
    }
}

/// Scans from what pickles hold.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the arrays, in their order")]
pub(crate) fn _scans(
    time_s: Py<PyArray1<f64>>,
    received_s: Option<Py<PyArray1<f64>>>,
    ranges_m: Py<PyArray2<f64>>,
    remission: Option<Py<PyArray2<u16>>>,
    angles_deg: Py<PyArray1<f64>>,
    encoder_ticks: Option<Py<PyArray1<u32>>>,
    telegram_counter: Py<PyArray1<u16>>,
    scan_counter: Py<PyArray1<u16>>,
    row_m: Option<Py<PyArray1<f64>>>,
    speed_m_s: Option<Py<PyArray1<f64>>>,
    imu: Option<Py<PyDict>>,
    wheel: Option<Py<PyDict>>,
    told: &str,
) -> PyResult<ScanArrays> {
    let told = serde_json::from_str(told).map_err(Failure::from)?;
    Ok(ScanArrays {
        time_s,
        received_s,
        ranges_m,
        remission,
        angles_deg,
        encoder_ticks,
        telegram_counter,
        scan_counter,
        row_m,
        speed_m_s,
        imu,
        wheel,
        told,
        stage: None,
    })
}

impl ScanArrays {
    /// The rig that they were driven with.
    pub(crate) fn rig(&self) -> Option<Rig> {
        self.told.rig.as_ref().map(|(rig, _)| rig.clone())
    }

    /// The model that their recording names.
    pub(crate) fn recorded_model(&self) -> Option<AnyModel> {
        self.told.model.as_deref().and_then(AnyModel::by_name)
    }

    /// What stands where they were driven.
    pub(crate) fn stage(&self) -> Option<Arc<Stage>> {
        self.stage.clone()
    }

    /// The scans that the arrays hold, as an estimator takes them.
    pub(crate) fn scans(&self, py: Python<'_>) -> PyResult<Vec<Scan>> {
        if self.told.echo > 0 {
            let found = self.told.echo;
            let why = format!(
                "an estimate needs first echoes: expected scans read with echo=0, found echo={found}"
            );
            return Err(Refusal::Usage(why).into());
        }
        let ranges_m = self.ranges_m.bind(py).try_readonly()?;
        let ranges_m = ranges_m.as_slice()?;
        let remission =
            self.remission.as_ref().map(|remission| remission.bind(py).try_readonly()).transpose()?;
        let remission = remission.as_ref().map(|remission| remission.as_slice()).transpose()?;
        let ticks = self.encoder_ticks.as_ref().map(|ticks| ticks.bind(py).try_readonly()).transpose()?;
        let ticks = ticks.as_ref().map(|ticks| ticks.as_slice()).transpose()?;
        let telegrams = self.telegram_counter.bind(py).try_readonly()?;
        let turns = self.scan_counter.bind(py).try_readonly()?;
        let counters = telegrams.as_slice()?.iter().zip(turns.as_slice()?);
        let (beams, told) = (self.told.beams(), &self.told);
        let columns = beams.len().max(1);
        let expected = told.time_us.len();
        if ranges_m.len() != expected * beams.len() || counters.len() != expected {
            let why = format!(
                "arrays of another shape than they were read in: expected {expected} scans of {} beams",
                beams.len()
            );
            return Err(Refusal::Usage(why).into());
        }
        let lines = ranges_m.chunks(columns).zip(counters).zip(told.time_us.iter().zip(&told.status));
        Ok(lines
            .enumerate()
            .map(|(number, ((line, (telegram, turn)), (time_us, status)))| {
                let measured = |(beam, range_m): (usize, &f64)| match range_m.is_nan() {
                    true if told.dazzled.contains(&(number, beam)) => DAZZLED,
                    true => NO_ECHO,
                    false => *range_m,
                };
                let strengths = remission.and_then(|remission| remission.chunks(columns).nth(number));
                let echo = Echo {
                    range_m: line.iter().enumerate().map(measured).collect(),
                    remission: strengths.unwrap_or_default().to_vec(),
                };
                let ticks = ticks.and_then(|ticks| ticks.get(number));
                let encoder = ticks.map(|ticks| EncoderReading { position_ticks: *ticks, speed: 0 });
                Scan {
                    status: DeviceStatus::of_number(*status).unwrap_or_default(),
                    layer_centideg: told.layer_centideg,
                    telegram_counter: *telegram,
                    scan_counter: *turn,
                    scan_time_us: *time_us,
                    scan_frequency_hz: told.scan_frequency_hz,
                    beams,
                    echoes: vec![echo],
                    encoders: encoder.into_iter().collect(),
                    ..Scan::default()
                }
            })
            .collect())
    }
}
