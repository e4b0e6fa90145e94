//! `Scans`: the scans of one scanner as arrays, of a recording or of a drive in memory.

use std::path::PathBuf;

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rowscan_canopy::{PlacedLine, Placing};
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::DeviceClock;
use rowscan_scenes::files::load_rig;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_study::trial::{self, Asked};

use crate::failure::{Failure, Refusal};
use crate::orchard::SceneOf;
use crate::{arrays, wait, warning};

/// The scans of one scanner.
#[pyclass(frozen, module = "rowscan")]
pub(crate) struct Scans {
    /// On the device's clock, since the first scan: seconds, float64, (scans,).
    #[pyo3(get)]
    time_s: Py<PyArray1<f64>>,
    /// When each was received, since the recording began: seconds, float64, (scans,); zeros where a recording has no times. None for a drive.
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
    beams: BeamGrid,
    scan_frequency_hz: f64,
    layer_deg: f64,
    /// Of a drive, with the alley that it is in.
    rig: Option<(Rig, Option<i32>)>,
}

/// Scans as they come, before Python has them.
#[derive(Default)]
struct Gathered {
    clock: DeviceClock,
    beams: Option<BeamGrid>,
    scan_frequency_hz: f64,
    layer_deg: f64,
    time_s: Vec<f64>,
    received_s: Vec<f64>,
    ranges_m: Vec<f64>,
    remission: Vec<u16>,
    encoder_ticks: Vec<u32>,
    telegram_counter: Vec<u16>,
    scan_counter: Vec<u16>,
}

impl Gathered {
    fn push(&mut self, scan: &Scan, echo: usize) -> Result<(), Failure> {
        let beams = *self.beams.get_or_insert(scan.beams);
        if beams != scan.beams {
            let (found, expected) = (scan.beams.len(), beams.len());
            return Err(Refusal::OtherBeams { scan: self.time_s.len(), found, expected }.into());
        }
        self.scan_frequency_hz = scan.scan_frequency_hz;
        self.layer_deg = f64::from(scan.layer_centideg) / 100.0;
        self.time_s.push(self.clock.seconds(scan.scan_time_us));
        match scan.echoes.get(echo) {
            Some(echo) => {
                let or_nan = |range_m: &f64| if range_m.is_finite() { *range_m } else { f64::NAN };
                self.ranges_m.extend(echo.range_m.iter().map(or_nan));
                self.remission.extend_from_slice(&echo.remission);
            }
            None => self.ranges_m.extend(std::iter::repeat_n(f64::NAN, beams.len())),
        }
        self.encoder_ticks.extend(scan.encoders.first().map(|encoder| encoder.position_ticks));
        self.telegram_counter.push(scan.telegram_counter);
        self.scan_counter.push(scan.scan_counter);
        Ok(())
    }

    fn hand_over(self, py: Python<'_>, rig: Option<(Rig, Option<i32>)>) -> PyResult<Scans> {
        let beams = self.beams.unwrap_or_default();
        let (scans, columns) = (self.time_s.len(), beams.len());
        let has_remission = scans > 0 && self.remission.len() == self.ranges_m.len();
        let has_encoder = scans > 0 && self.encoder_ticks.len() == scans;
        Ok(Scans {
            time_s: arrays::line(py, self.time_s),
            received_s: rig.is_none().then(|| arrays::line(py, self.received_s)),
            ranges_m: arrays::rows(py, self.ranges_m, columns)?,
            remission: has_remission.then(|| arrays::rows(py, self.remission, columns)).transpose()?,
            angles_deg: arrays::line(py, (0..columns).map(|beam| beams.angle_deg(beam)).collect()),
            encoder_ticks: has_encoder.then(|| arrays::line(py, self.encoder_ticks)),
            telegram_counter: arrays::line(py, self.telegram_counter),
            scan_counter: arrays::line(py, self.scan_counter),
            beams,
            scan_frequency_hz: self.scan_frequency_hz,
            layer_deg: self.layer_deg,
            rig,
        })
    }
}

/// Drives one scanner past the first row, in memory, and gives its scans: those that a client of the same scanner receives, bit for bit.
#[pyfunction]
#[pyo3(signature = (orchard = SceneOf::Named(PathBuf::from("spindle")), model = None, *, remission = true, seed = None, optics = None))]
pub(crate) fn drive(
    py: Python<'_>,
    orchard: SceneOf,
    model: Option<&str>,
    remission: bool,
    seed: Option<u64>,
    optics: Option<&str>,
) -> PyResult<Scans> {
    let named = model.map(AnyModel::named).transpose().map_err(Failure::from)?;
    let stage = orchard.stage(py, seed, optics)?;
    let mounted = || stage.rig.scanners.first().map_or("", |mount| mount.model.as_str());
    let model = named.map_or_else(|| AnyModel::named(mounted()), Ok).map_err(Failure::from)?;
    let rig = rig_with(&stage.rig, 0, model.name());
    let (told, alley) = (rig.clone(), stage.scene.drive.alley);
    let gathered = wait::for_work(py, "drive past the row", move || {
        let none = CalibrationChoice::Given(None);
        let Reading { mut cola, lms2xx, .. } = Reading::of(Some(&told), 0, true, none)?;
        cola.remission = remission;
        let (mut gathered, mut fits) = (Gathered::default(), Ok(()));
        trial::each_scan(&stage, model, Asked { cola, lms2xx }, &mut |scan| {
            if fits.is_ok() {
                fits = gathered.push(scan, 0);
            }
        })?;
        fits.map(|()| gathered)
    })?;
    gathered.hand_over(py, Some((rig, alley)))
}

/// Reads the scans of a recording: MCAP, pcap, pcapng, raw bytes, hex text, or ranges as CSV; `FILE#STREAM` where it holds several.
#[pyfunction]
#[pyo3(signature = (path, *, echo = 0, scans = None))]
pub(crate) fn read(py: Python<'_>, path: PathBuf, echo: usize, scans: Option<usize>) -> PyResult<Scans> {
    let source: Source = path.to_string_lossy().parse().map_err(Failure::from)?;
    if !matches!(source, Source::Recording { .. }) {
        return Err(Refusal::Usage(format!("{source} is live: `rowscan record` it first")).into());
    }
    let gathered = wait::for_future(py, "read the recording", move || async move {
        let mut scanner = Scanner::open(&source, DriverConfig::default()).await?;
        let mut gathered = Gathered::default();
        while scans.is_none_or(|most| gathered.time_s.len() < most) {
            let Some(record) = scanner.next().await? else { break };
            gathered.push(record.scan, echo)?;
            gathered.received_s.push(record.received.0.as_secs_f64());
            // A recording never waits by itself.
            tokio::task::coop::consume_budget().await;
        }
        Ok(gathered)
    })?;
    gathered.hand_over(py, None)
}

#[pymethods]
impl Scans {
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
            None => self.rig.clone(),
        };
        let (rig, alley) = rig.unzip();
        let (ranges_m, time_s) =
            (self.ranges_m.bind(py).try_readonly()?, self.time_s.bind(py).try_readonly()?);
        let (ranges_m, time_s) = (ranges_m.as_slice()?, time_s.as_slice()?);
        let (placing, columns) = (Placing::new(rig, scanner, alley.flatten()), self.beams.len());
        let (mut points_m, mut scans, mut beams) = (Vec::new(), Vec::<u32>::new(), Vec::<u32>::new());
        for ((scan, time_s), line) in (0..).zip(time_s).zip(ranges_m.chunks(columns.max(1))) {
            let placed = PlacedLine::new(*time_s, self.scan_frequency_hz, self.beams, self.layer_deg);
            for (beam, range_m) in (0..).zip(line).filter(|(_, range_m)| range_m.is_finite()) {
                points_m.push(placing.place(&placed, beam as usize, *range_m));
                scans.push(scan);
                beams.push(beam);
            }
        }
        let found = PyDict::new(py);
        found.set_item("points_m", arrays::points(py, points_m)?)?;
        found.set_item("scan", arrays::line(py, scans))?;
        found.set_item("beam", arrays::line(py, beams))?;
        Ok(found)
    }

    /// A pandas data frame: a row a beam of a scan, misses too.
    fn to_pandas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (numpy, pandas) = (py.import("numpy")?, py.import("pandas")?);
        let (scans, beams) = (self.time_s.bind(py).len(), self.beams.len());
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
        pandas.call_method1("DataFrame", (columns,))
    }

    fn __len__(&self, py: Python<'_>) -> usize {
        self.time_s.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        format!("<rowscan.Scans: {} scans of {} beams>", self.__len__(py), self.beams.len())
    }
}
