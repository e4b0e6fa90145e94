//! What is shown: newest lines, log, strip, and where to ask for the rest.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};

use rowscan_control::Bench;
use rowscan_emulator::{LineWatcher, SeenLine, Sight};
use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::rig::{Axes, Mount};
use rowscan_protocol::scan::{Pose, Scan};
use rowscan_protocol::validity::DeviceStatus;
use rowscan_scenes::BeamFan;
use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::gauges::{Gauges, TractorGauge};
use crate::line::Line;
use crate::map_desk::MapDesk;
use crate::onlooker::{Onlooker, Seen};
use crate::orchard::OrchardPicture;
use crate::picture;
use crate::strip::{Metre, Strip, TruthColumn};
use crate::telegram_log::TelegramLog;

/// What does not change while it is shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct About {
    /// What runs: `rowscan emulate spindle`.
    pub title: String,
    /// The scanners, in the order of their numbers.
    pub scanners: Vec<ScannerAbout>,
}

/// A scanner that is shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ScannerAbout {
    /// As faults and state call it.
    pub name: String,
    /// The model, for people; empty where it is not known.
    pub model: String,
}

/// What a page shows. Clones share it; nothing in it waits.
#[derive(Clone)]
pub struct Show(Arc<Shown>);

struct Shown {
    about: About,
    orchard: Option<OrchardPicture>,
    gauges: Box<dyn Gauges>,
    lines: Vec<Mutex<Newest>>,
    log: TelegramLog,
    strip: Mutex<(u64, Strip)>,
    onlookers: RwLock<Vec<Box<dyn Onlooker>>>,
    map: OnceLock<MapDesk>,
}

/// The newest line of a scanner, and how often there is one.
#[derive(Debug, Default)]
struct Newest {
    /// Where the scanner sits, if that is known: then its fan is drawn as it stands.
    mount: Option<Mount>,
    /// Its source has come to its end.
    has_ended: bool,
    line: Option<Arc<Line>>,
    shown: u64,
    /// Of seconds a line, smoothed.
    period_s: Option<f64>,
}

/// How much a new interval counts in the smoothed one.
const SMOOTHING: f64 = 0.05;

impl fmt::Debug for Show {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Show").field("about", &self.0.about).finish_non_exhaustive()
    }
}

impl Show {
    /// Shows this; `gauges` are asked for what changes.
    pub fn new(about: About, orchard: Option<OrchardPicture>, gauges: Box<dyn Gauges>) -> Self {
        let lines = about.scanners.iter().map(|_| Mutex::default()).collect();
        let (log, strip, onlookers, map) = Default::default();
        Self(Arc::new(Shown { about, orchard, gauges, lines, log, strip, onlookers, map }))
    }

    /// Has a map of what a sprayer has done so far drawn like this, as SVG, when somebody asks for it; the first that is given stays. It may take a second,
    /// and is none while there is nothing to draw.
    pub fn draws(&self, draw: impl Fn() -> Option<String> + Send + Sync + 'static) {
        let _ = self.0.map.set(MapDesk::new(draw));
    }

    pub(crate) fn map(&self) -> Option<&MapDesk> {
        self.0.map.get()
    }

    /// Has somebody else look on from now on.
    pub fn add(&self, onlooker: impl Onlooker + 'static) {
        self.0.onlookers.write().unwrap_or_else(PoisonError::into_inner).push(Box::new(onlooker));
    }

    /// Scanner number `scanner` sits so: fans of scans are drawn by that, and not as the device counts its angles.
    pub fn sits(&self, scanner: usize, mount: Mount) {
        if let Some(newest) = self.0.lines.get(scanner) {
            lock(newest).mount = Some(mount);
        }
    }

    /// Scanner number `scanner` has no more scans: its recording is over.
    pub fn ended(&self, scanner: usize) {
        if let Some(newest) = self.0.lines.get(scanner) {
            lock(newest).has_ended = true;
        }
    }

    /// Scanner number `scanner` is read from the beginning of its recording again.
    pub fn begin_anew(&self, scanner: usize) {
        if let Some(newest) = self.0.lines.get(scanner) {
            lock(newest).has_ended = false;
        }
        self.measured(scanner, Vec::new());
    }

    /// A new scan of scanner number `scanner`, as its telegram has it; seconds since the source began.
    pub fn scan(&self, scanner: usize, at_s: f64, scan: &Scan) {
        let mut line = Line::of_scan(at_s, scan);
        let mount = self.0.lines.get(scanner).and_then(|newest| lock(newest).mount.clone());
        line.sight = mount.map(|mount| sight_of(&mount, scan.beams));
        self.take(scanner, line);
        self.tell(|onlooker| {
            onlooker.scan(&Seen { scanner, at_s, scan, sight: None, gauges: &*self.0.gauges });
        });
    }

    /// A new line of an emulated scanner.
    pub fn seen(&self, scanner: usize, line: &SeenLine) {
        self.take(scanner, Line::of_seen(line));
        let (at_s, scan, sight) = (line.at.as_secs_f64(), &line.scan, Some(line.sight));
        self.tell(|onlooker| onlooker.scan(&Seen { scanner, at_s, scan, sight, gauges: &*self.0.gauges }));
    }

    fn take(&self, scanner: usize, line: Line) {
        if let Some(newest) = self.0.lines.get(scanner) {
            lock(newest).take(line);
        }
    }

    fn tell(&self, what: impl Fn(&dyn Onlooker)) {
        let onlookers = self.0.onlookers.read().unwrap_or_else(PoisonError::into_inner);
        onlookers.iter().for_each(|onlooker| what(&**onlooker));
    }

    /// Shows the lines of an emulated scanner, until it is gone.
    pub async fn follow(self, scanner: usize, mut lines: LineWatcher) {
        while let Some(line) = lines.next().await {
            self.seen(scanner, &line);
        }
    }

    /// Where telegrams are kept.
    pub fn log(&self) -> TelegramLog {
        self.0.log.clone()
    }

    /// What stands along the row by bands from `z_from_m` on, `band_m` high each; the row repeats after `period_m` if it does.
    pub fn truth(&self, truth: Vec<TruthColumn>, (z_from_m, band_m): (f64, f64), period_m: Option<f64>) {
        let mut kept = lock(&self.0.strip);
        let measured = std::mem::take(&mut kept.1.measured);
        *kept = (kept.0 + 1, Strip { truth, period_m, z_from_m, band_m, measured });
    }

    /// What scanner number `scanner` has measured, metre by metre.
    pub fn measured(&self, scanner: usize, metres: Vec<Metre>) {
        self.tell(|onlooker| onlooker.measured(scanner, &metres));
        let mut kept = lock(&self.0.strip);
        let scanners = self.0.lines.len();
        kept.1.measured.resize_with(scanners, Vec::new);
        if let Some(of_scanner) = kept.1.measured.get_mut(scanner) {
            *of_scanner = metres;
            kept.0 += 1;
        }
    }

    /// What does not change.
    pub fn about(&self) -> &About {
        &self.0.about
    }

    pub(crate) fn orchard(&self) -> Option<&OrchardPicture> {
        self.0.orchard.as_ref()
    }

    /// The strip as JSON.
    pub(crate) fn strip_now(&self) -> Value {
        let kept = lock(&self.0.strip);
        json!({ "version": kept.0, "strip": kept.1 })
    }

    /// A picture of what there is now.
    pub(crate) fn picture(&self, number: u32) -> Vec<u8> {
        let newest = |(scanner, newest): (usize, &Mutex<Newest>)| Some((scanner, lock(newest).line.clone()?));
        let lines: Vec<(usize, Arc<Line>)> = self.0.lines.iter().enumerate().filter_map(newest).collect();
        let tractor = self.0.gauges.tractor();
        picture::write(number, tractor.as_ref(), lines.iter().map(|(scanner, line)| (*scanner, &**line)))
    }

    /// Changes whenever a picture would: how many lines there were, and where the tractor is.
    pub(crate) fn moment(&self) -> (u64, Option<TractorGauge>) {
        (self.0.lines.iter().map(|newest| lock(newest).shown).sum(), self.0.gauges.tractor())
    }

    /// Everything that is numbers, with what `bench` tells.
    pub(crate) fn state(&self, bench: Option<&Bench>) -> Value {
        let mut all = bench.map(Bench::state).unwrap_or_default();
        let gauges = self.0.gauges.scanners();
        let scanners: Vec<Value> = self
            .0
            .lines
            .iter()
            .enumerate()
            .map(|(number, newest)| {
                let mut told = json!(gauges.get(number).copied().unwrap_or_default());
                if let Value::Object(keys) = &mut told {
                    lock(newest).tell(keys);
                }
                told
            })
            .collect();
        all.insert("tractor".to_owned(), json!(self.0.gauges.tractor()));
        all.insert("scanners".to_owned(), Value::from(scanners));
        all.insert("log_last".to_owned(), json!(self.0.log.last()));
        all.insert("strip_version".to_owned(), json!(lock(&self.0.strip).0));
        Value::Object(all)
    }
}

/// Where a scanner on this mount looks, the row to its right; the tractor is at the start of the row.
fn sight_of(mount: &Mount, beams: BeamGrid) -> Sight {
    let fan = BeamFan::tilted(mount, beams, true, 0.0);
    Sight {
        origin: Pose { x_m: -mount.distance_m, y_m: mount.offset_y_m, z_m: mount.height_m },
        axes: Axes::LEVEL,
        first_rad: fan.theta_rad(0),
        step_rad: fan.step_rad(),
        advance_m: 0.0,
    }
}

impl Newest {
    fn take(&mut self, line: Line) {
        let before_s = self.line.as_ref().map(|line| line.at_s);
        if let Some(passed_s) = before_s.map(|before_s| line.at_s - before_s).filter(|passed| *passed > 0.0) {
            let smooth = |period_s| period_s + SMOOTHING * (passed_s - period_s);
            self.period_s = Some(self.period_s.map_or(passed_s, smooth));
        }
        self.line = Some(Arc::new(line));
        self.shown += 1;
    }

    /// What the lines themselves tell.
    fn tell(&self, keys: &mut Map<String, Value>) {
        keys.insert("lines".to_owned(), json!(self.shown));
        keys.insert("ended".to_owned(), json!(self.has_ended));
        keys.insert("rate_hz".to_owned(), json!(self.period_s.map(|period_s| 1.0 / period_s)));
        let Some(line) = &self.line else { return };
        let found = line.range_m.iter().copied().filter(|range| range.is_finite());
        keys.insert("counter".to_owned(), json!(line.counter));
        keys.insert("at_s".to_owned(), json!(line.at_s));
        keys.insert("beams".to_owned(), json!(line.range_m.len()));
        keys.insert("returns".to_owned(), json!(found.clone().count()));
        keys.insert("nearest_m".to_owned(), json!(found.reduce(f32::min)));
        keys.insert("frequency_hz".to_owned(), json!(line.frequency_hz));
        let status = match line.status {
            DeviceStatus::Ok => "ok",
            DeviceStatus::ContaminationWarning => "contamination_warning",
            DeviceStatus::ContaminationError => "contamination_error",
            DeviceStatus::Error => "error",
        };
        keys.insert("status".to_owned(), json!(status));
    }
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}
