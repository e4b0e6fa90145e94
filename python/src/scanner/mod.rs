//! `Scanner`: a virtual scanner in this process, on a port of its own, on threads of its own.

mod live;
mod log;
mod order;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::AnyModel;
use tokio::runtime::{Builder, Runtime};

use crate::failure::{Failure, Refusal};
use crate::one_or_more::OneOrMore;
use crate::orchard::{SceneOf, grown};
use crate::seed::Seed;
use crate::{document, wait};
use live::{Goal, Live, Way};
use log::Log;
use order::{Order, Pace, Place};

/// Threads that serve a scanner.
const THREADS: usize = 2;

/// What tasks get to end in, once it is stopped.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_millis(300);

/// Seconds of the host that `step` and `until` wait, unless told otherwise.
const PATIENCE_S: f64 = 30.0;

/// A virtual scanner, or the scanners of one tractor, in this process.
#[pyclass(frozen, weakref, module = "rowscan")]
pub(crate) struct Scanner {
    order: Arc<Order>,
    /// Grown at the first start.
    stage: Mutex<Option<Arc<Stage>>>,
    running: Mutex<Option<Served>>,
    log: Mutex<Log>,
}

/// A rig and the threads that serve it. The rig ends first.
struct Served {
    live: Live,
    runtime: Runtime,
}

impl Served {
    /// Ends it: endpoints are closed when this returns.
    fn end(self) {
        drop(self.live);
        self.runtime.shutdown_timeout(SHUTDOWN_TIMEOUT);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Scanner {
    /// Does something with the running rig.
    fn with<T>(&self, f: impl FnOnce(&Live) -> T) -> Result<T, Refusal> {
        lock(&self.running).as_ref().map(|served| f(&served.live)).ok_or(Refusal::NotRunning)
    }

    fn stage(&self, py: Python<'_>) -> PyResult<Arc<Stage>> {
        if let Some(stage) = &*lock(&self.stage) {
            return Ok(Arc::clone(stage));
        }
        let stage = match &self.order.place {
            Place::Grown(stage) => Arc::clone(stage),
            Place::Scene(scene) => grown(py, (**scene).clone())?,
        };
        Ok(Arc::clone(lock(&self.stage).insert(stage)))
    }

    fn open(&self, py: Python<'_>) -> PyResult<()> {
        if lock(&self.running).is_some() {
            return Ok(());
        }
        let stage = self.stage(py)?;
        let runtime =
            Builder::new_multi_thread().worker_threads(THREADS).thread_name("rowscan").enable_all().build();
        let runtime = runtime.map_err(|cause| Refusal::System { what: "start the runtime", cause })?;
        let (order, log) = (Arc::clone(&self.order), Log::default());
        *lock(&self.log) = log.clone();
        let handle = runtime.handle().clone();
        let opened = wait::for_future_on(py, "start the scanner", handle, move || async move {
            Live::open(&order, &stage, log).await
        });
        match opened {
            Ok(live) => *lock(&self.running) = Some(Served { live, runtime }),
            Err(error) => {
                py.detach(|| runtime.shutdown_timeout(SHUTDOWN_TIMEOUT));
                return Err(error);
            }
        }
        Ok(())
    }

    fn close(&self, py: Python<'_>) {
        let served = lock(&self.running).take();
        py.detach(|| served.map(Served::end));
    }

    /// Waits until the rig's time is where it is to be.
    fn go(
        &self,
        py: Python<'_>,
        what: String,
        timeout: Option<f64>,
        go: impl Future<Output = Result<(), Failure>> + Send + 'static,
    ) -> PyResult<()> {
        let patience = timeout.map(patience).transpose()?;
        let handle = {
            let running = lock(&self.running);
            running.as_ref().map(|served| served.runtime.handle().clone()).ok_or(Refusal::NotRunning)?
        };
        wait::for_future_on(py, "wait for the scanner", handle, move || async move {
            let overdue = || Refusal::Overdue { what, patience: patience.unwrap_or_default() };
            wait::within(patience, go).await.ok_or_else(overdue)?
        })
    }
}

fn patience(seconds: f64) -> Result<Duration, Refusal> {
    Duration::try_from_secs_f64(seconds).map_err(|_| {
        Refusal::Usage(format!("timeout: expected a number of seconds from 0 on, found {seconds}"))
    })
}

#[pymethods]
impl Scanner {
    #[new]
    #[pyo3(signature = (
        model = None, scene = SceneOf::Named(PathBuf::from("spindle")), *, seed = None, optics = None, time_scale = None, start_when = None,
        tcp = None, pty = None, can = None, nmea = None, faults = None, rest = None, udp = None, allow_destination = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn new(
        py: Python<'_>,
        model: Option<OneOrMore<String>>,
        scene: SceneOf,
        seed: Option<Seed>,
        optics: Option<&str>,
        time_scale: Option<Pace>,
        start_when: Option<&str>,
        tcp: Option<OneOrMore<String>>,
        pty: Option<PathBuf>,
        can: Option<OneOrMore<String>>,
        nmea: Option<OneOrMore<String>>,
        faults: Option<&Bound<'_, PyAny>>,
        rest: Option<OneOrMore<String>>,
        udp: Option<OneOrMore<String>>,
        allow_destination: Option<OneOrMore<String>>,
    ) -> PyResult<Self> {
        let models = match model {
            None => vec![None],
            Some(names) => named(names)?,
        };
        let all = |given: Option<OneOrMore<String>>| given.map(OneOrMore::all).unwrap_or_default();
        let order = Order {
            place: Place::of(py, scene, seed, optics)?,
            models,
            scale: time_scale.unwrap_or(Pace::Times(1.0)).scale()?,
            start: start_when.map(str::parse).transpose().map_err(Failure::from)?,
            tcp: all(tcp),
            pty,
            can: all(can)
                .iter()
                .map(|place| place.parse())
                .collect::<Result<_, _>>()
                .map_err(Failure::from)?,
            nmea: all(nmea)
                .iter()
                .map(|place| place.parse())
                .collect::<Result<_, _>>()
                .map_err(Failure::from)?,
            faults: order::faults(faults)?,
            directed: order::directed(all(rest), &all(udp), &all(allow_destination))?,
        };
        order.check()?;
        Ok(Self {
            order: Arc::new(order),
            stage: Mutex::default(),
            running: Mutex::default(),
            log: Mutex::default(),
        })
    }

    /// Grows the orchard (once) and listens. Does nothing if it runs already.
    fn start<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, Self>> {
        slf.get().open(slf.py())?;
        // The interpreter's end is no reason to leave a link to a terminal behind.
        slf.py().import("rowscan._running")?.call_method1("keep", (slf,))?;
        Ok(slf.clone())
    }

    /// Ends it: when this returns, its connections and ports are closed. Does nothing if it does not run.
    fn stop(&self, py: Python<'_>) {
        self.close(py);
    }

    fn __enter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, Self>> {
        Self::start(slf)
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, PyTuple>) {
        self.close(py);
    }

    /// True while it runs.
    #[getter]
    fn running(&self) -> bool {
        lock(&self.running).is_some()
    }

    /// Where the first scanner is: `HOST:PORT`, or a serial port's path.
    #[getter]
    fn address(&self) -> PyResult<String> {
        let first = self.with(|live| live.places.first().map(|(_, place)| place.clone()))?;
        Ok(first.unwrap_or_default())
    }

    /// Where everything is, by name: `scanner0`, `can0`, `nmea0`.
    #[getter]
    fn addresses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let places = self.with(|live| live.places.clone())?;
        let dict = PyDict::new(py);
        places.iter().try_for_each(|(name, place)| dict.set_item(name, place))?;
        Ok(dict)
    }

    /// What `estimate` and the command line read the first scanner by.
    #[getter]
    fn source(&self) -> PyResult<String> {
        Ok(self.with(|live| live.sources.first().cloned())?.unwrap_or_default())
    }

    /// Name of the first scanner's model.
    #[getter]
    fn model(&self, py: Python<'_>) -> PyResult<&'static str> {
        if let Some(Some(model)) = self.order.models.first() {
            return Ok(model.name());
        }
        let stage = self.stage(py)?;
        let mounted = stage.rig.scanners.first().map_or("", |mount| mount.model.as_str());
        Ok(AnyModel::named(mounted).map_err(Failure::from)?.name())
    }

    /// Seed of everything random.
    #[getter]
    fn seed(&self) -> u64 {
        self.order.place.scene().seed
    }

    /// Time, the tractor's place, and what each scanner has done.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        self.with(|live| {
            let time = live.control.time();
            dict.set_item("time_s", time.at.as_secs_f64())?;
            dict.set_item("time_scale", time.scale)?;
            dict.set_item("paused", time.paused)?;
            dict.set_item("steps", time.steps)?;
            dict.set_item("steps_granted", time.granted)?;
            dict.set_item("began_s", time.began.map(|began| began.as_secs_f64()))?;
            dict.set_item("row_m", time.row_m)?;
            dict.set_item("tree", rowscan_faults::Row::tree(&*live.row, time.at.elapsed()))?;
            for scanner in live.scanners() {
                let (counts, reader) = (PyDict::new(py), scanner.counts());
                let found = reader.counts().unwrap_or_default();
                counts.set_item("model", scanner.model.name())?;
                counts.set_item("scans_sent", found.scans_sent)?;
                let of_family = [
                    ("clients", reader.clients().map(|clients| clients as u64)),
                    ("scans_dropped", found.scans_dropped),
                    ("scans_kept_by_faults", found.scans_kept_by_faults),
                    ("scans_missed", found.scans_missed),
                    ("bytes_lost", found.bytes_lost),
                ];
                for (key, value) in of_family.into_iter().filter(|(_, value)| value.is_some()) {
                    counts.set_item(key, value)?;
                }
                dict.set_item(&scanner.id, counts)?;
            }
            PyResult::Ok(())
        })??;
        Ok(dict)
    }

    /// Simulated time: seconds since the start.
    #[getter]
    fn time_s(&self) -> PyResult<f64> {
        Ok(self.with(|live| live.control.time().at.as_secs_f64())?)
    }

    /// Where the tractor is along its row, metres; None before the drive has started.
    #[getter]
    fn row_m(&self) -> PyResult<Option<f64>> {
        Ok(self.with(|live| live.control.time().row_m)?)
    }

    /// Simulated seconds a host second; None at `max`.
    #[getter]
    fn time_scale(&self) -> PyResult<Option<f64>> {
        Ok(self.with(|live| live.control.time().scale)?)
    }

    #[setter]
    fn set_time_scale(&self, scale: f64) -> PyResult<()> {
        Ok(self.with(|live| live.control.set_scale(scale))?.map_err(Failure::from)?)
    }

    /// Stops time. Clients are answered meanwhile.
    fn pause(&self) -> PyResult<()> {
        Ok(self.with(|live| live.control.pause())?)
    }

    /// Lets time run on.
    fn resume(&self) -> PyResult<()> {
        Ok(self.with(|live| live.control.resume())?)
    }

    /// Lets time take so many steps, a turn of the mirror each, and stops it then.
    #[pyo3(signature = (count = 1, *, timeout = PATIENCE_S))]
    fn step(&self, py: Python<'_>, count: u64, timeout: Option<f64>) -> PyResult<()> {
        let control = self.with(|live| live.control.clone())?;
        let last = control.step(count);
        let what = format!("step {last}");
        let go = async move {
            control.stepped(last).await;
            Ok(())
        };
        self.go(py, what, timeout, go)
    }

    /// Lets time run until the tractor is there, and stops it then.
    #[pyo3(signature = (*, tree = None, row_m = None, driven_s = None, timeout = PATIENCE_S))]
    fn until(
        &self,
        py: Python<'_>,
        tree: Option<u32>,
        row_m: Option<f64>,
        driven_s: Option<f64>,
        timeout: Option<f64>,
    ) -> PyResult<()> {
        let (goal, what) = match (tree, row_m, driven_s) {
            (Some(tree), None, None) => (Goal::Tree(self.tree_there_is(py, tree)?), format!("tree {tree}")),
            (None, Some(row_m), None) => (Goal::RowM(row_m), format!("{row_m} m of the row")),
            (None, None, Some(driven_s)) => {
                (Goal::Driven(patience(driven_s)?), format!("{driven_s} s of the drive"))
            }
            _ => {
                let why = "until: give one of tree, row_m and driven_s";
                return Err(Refusal::Usage(why.to_owned()).into());
            }
        };
        let way =
            self.with(|live| Way { control: live.control.clone(), row: Arc::clone(&live.row), goal })?;
        let goal = what.clone();
        let go = async move {
            match way.past_m().await {
                Some(row_m) => Err(Refusal::Past { what: goal, row_m }.into()),
                None => {
                    way.go().await;
                    Ok(())
                }
            }
        };
        self.go(py, what, timeout, go)
    }

    /// Begins a fault, or has it wait for its time; its id.
    #[pyo3(signature = (name, **keys))]
    fn fault(&self, py: Python<'_>, name: &str, keys: Option<&Bound<'_, PyDict>>) -> PyResult<String> {
        let spec = order::fault_named(py, name, keys)?;
        Ok(self.with(|live| live.faults.add(spec))?.map_err(Failure::from)?)
    }

    /// Ends a fault by its id, or all.
    #[pyo3(signature = (id = None))]
    fn clear(&self, id: Option<&str>) -> PyResult<()> {
        let cleared = self.with(|live| match id {
            Some(id) => live.faults.remove(id),
            None => {
                live.faults.reset();
                Ok(())
            }
        })?;
        Ok(cleared.map_err(Failure::from)?)
    }

    /// Every fault on every stream, and how far it is.
    #[getter]
    fn faults(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        document::of(py, &self.with(|live| live.faults.list())?)
    }

    /// What has happened lately, in lines: telegrams both ways, and what faults did. Kept after the stop.
    #[getter]
    fn log(&self) -> Vec<String> {
        lock(&self.log).lines()
    }

    fn __repr__(&self) -> String {
        let place = self.with(|live| live.sources.join(" ")).unwrap_or_else(|_| "stopped".to_owned());
        format!("<rowscan.Scanner on {}: {place}>", self.order.place.scene().name)
    }
}

impl Scanner {
    /// The number of a tree, from 1 as in faults, if the row has one.
    fn tree_there_is(&self, py: Python<'_>, tree: u32) -> PyResult<u32> {
        let trees = self.stage(py)?.orchard.trees_per_row();
        match usize::try_from(tree) {
            Ok(number) if (1..=trees).contains(&number) => Ok(tree),
            _ => Err(Refusal::Usage(format!("tree: expected a tree from 1 to {trees}, found {tree}")).into()),
        }
    }
}

fn named(names: OneOrMore<String>) -> Result<Vec<Option<AnyModel>>, Failure> {
    names.all().iter().map(|name| Ok(Some(AnyModel::named(name)?))).collect()
}
