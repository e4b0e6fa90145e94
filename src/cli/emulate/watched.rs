//! The page beside emulated scanners: their lines, their talk, their numbers.

use std::sync::Arc;

use rowscan_control::Bench;
use rowscan_emulator::clock::SimClock;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{LineWatch, LineWatcher, Rig};
use rowscan_protocol::time::SimTime;
use rowscan_recording::Taps;
use rowscan_scenes::CellGrid;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_vehicle::Tractor;
use rowscan_web::{About, OrchardPicture, ScannerAbout, Show, TruthColumn};
use tokio::task::JoinSet;

use super::super::Failure;
use super::super::web::{Meter, Opened, RigGauges, Talk};
use super::Args;
use super::fitted::Fitted;
use super::running::Running;

/// The cells that the page shows the truth by, metres.
const CELLS: CellGrid = CellGrid { cell_m: 0.25, band_m: 0.25 };

/// Cells along a row that are shown at most: a kilometre.
const LONGEST: f64 = 4000.0;

/// Where scanners show what a page shows, before there is one.
pub(super) struct Watching {
    lines: Vec<LineWatch>,
    taps: Taps,
    talk: Talk,
}

/// A page that is served. Dropped, it is served no longer.
#[derive(Debug, Default)]
pub(super) struct Watched {
    _web: Opened,
    _tasks: JoinSet<()>,
}

impl Watching {
    /// For so many scanners.
    pub(super) fn new(scanners: usize, clock: Arc<SimClock>) -> Self {
        let (taps, talk) = Talk::listen(Arc::new(move || clock.now().as_secs_f64()));
        Self { lines: (0..scanners).map(|_| LineWatch::default()).collect(), taps, talk }
    }

    /// Where the scanner at this place shows its lines.
    pub(super) fn lines(&self, place: usize) -> Option<LineWatch> {
        self.lines.get(place).cloned()
    }

    /// Where bytes go.
    pub(super) fn taps(&self) -> Taps {
        self.taps.clone()
    }

    /// Opens the page.
    pub(super) async fn open(
        self,
        args: &Args,
        stage: &Stage,
        rig: &Rig,
        bench: Bench,
        scanners: (&[Fitted], &[Running]),
    ) -> Result<Watched, Failure> {
        let (fitted, running) = scanners;
        let about = About {
            title: format!("rowscan emulate {}", args.scene.name),
            scanners: fitted
                .iter()
                .map(|fitted| ScannerAbout { name: fitted.name(), model: fitted.model.title().to_owned() })
                .collect(),
        };
        let gauges = RigGauges {
            clock: rig.clock(),
            tractor: rig.tractor(),
            encoder: stage.scene.encoder,
            receiver: stage.receiver(),
            scanners: running.iter().map(Running::gauge).collect(),
        };
        let show = Show::new(about, Some(OrchardPicture::of(&stage.orchard)), Box::new(gauges));
        if let Some((truth, period_m)) = truth(stage, &rig.tractor()) {
            show.truth(truth, Some(period_m));
        }
        let mut tasks = JoinSet::new();
        tasks.spawn(self.talk.tell(show.log()));
        for (number, (lines, fitted)) in self.lines.iter().zip(fitted).enumerate() {
            let meter = meter(stage, fitted, &show, number);
            tasks.spawn(follow(lines.watch(), show.clone(), number, rig.tractor(), meter));
        }
        let web = args.web.open(show, Some(bench), args.format).await?;
        web.addresses().for_each(|address| rig.control().exclude(address));
        Ok(Watched { _web: web, _tasks: tasks })
    }
}

/// Shows a scanner's lines, and measures them while the tractor drives.
async fn follow(
    mut lines: LineWatcher,
    show: Show,
    number: usize,
    tractor: Tractor,
    mut meter: Option<Meter>,
) {
    while let Some(line) = lines.next().await {
        show.seen(number, &line);
        let drives = tractor.began().is_some_and(|began| line.at >= began);
        if let (Some(meter), true) = (&mut meter, drives) {
            meter.push(&line.scan);
        }
    }
}

/// What measures a scanner's lines as `estimate --rig SCENE` would; none where that has no estimate.
fn meter(stage: &Stage, fitted: &Fitted, show: &Show, number: usize) -> Option<Meter> {
    let rig = rig_with(&stage.rig, fitted.index, fitted.model.name());
    let reading = Reading::of(Some(&rig), fitted.index, false, CalibrationChoice::OfRig).ok()?;
    Some(Meter::new(reading.pipeline, show.clone(), number))
}

/// What stands in the row that the tractor begins beside, and after how many metres the row repeats.
fn truth(stage: &Stage, tractor: &Tractor) -> Option<(Vec<TruthColumn>, f64)> {
    let place = tractor.motion(SimTime::ZERO).place;
    let row = place.alley.and_then(|alley| usize::try_from(alley.row_beside(true).0).ok()).unwrap_or(0);
    let (length_m, cells) = (stage.orchard.length_m(), stage.orchard.cells_of_row(row, CELLS)?);
    let column = |number: u32| {
        let column = cells.column((f64::from(number) + 0.5) * CELLS.cell_m);
        TruthColumn {
            y_from_m: column.y_from_m,
            y_to_m: column.y_to_m,
            leaf_area_m2: column.bands.iter().map(|band| band.areas.leaf_area_m2).collect(),
        }
    };
    let count = (length_m / CELLS.cell_m).ceil().min(LONGEST) as u32;
    length_m.is_finite().then(|| ((0..count).map(column).collect(), length_m))
}
