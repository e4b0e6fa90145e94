//! A virtual rig on the page: its scanners' lines, their talk, their numbers.

use std::sync::Arc;

use rowscan_emulator::clock::SimClock;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{LineWatcher, SeenRig, SeenScanner};
use rowscan_recording::Taps;
use rowscan_scenes::CellGrid;
use rowscan_study::reading::{CalibrationChoice, Reading, rig_with};
use rowscan_vehicle::Tractor;
use rowscan_web::{About, OrchardPicture, ScannerAbout, Show, TruthColumn};
use tokio::runtime::Handle;
use tokio::task::JoinSet;

use super::{Meter, RigGauges, Talk, gauge_of};

/// The cells that the page shows the truth by, metres.
const CELLS: CellGrid = CellGrid { cell_m: 0.25, band_m: 0.25 };

/// Cells along a row that are shown at most: a kilometre.
const LONGEST: f64 = 4000.0;

/// What the page is to hear, before there is one.
pub(in super::super) struct Watching {
    taps: Taps,
    talk: Talk,
}

impl Watching {
    /// For scanners whose time is on `clock`.
    pub(in super::super) fn new(clock: Arc<SimClock>) -> Self {
        let (taps, talk) = Talk::listen(Arc::new(move || clock.now().as_secs_f64()));
        Self { taps, talk }
    }

    /// Where bytes go.
    pub(in super::super) fn taps(&self) -> Taps {
        self.taps.clone()
    }

    /// What a page shows of the rig, for as long as `tasks` run.
    pub(in super::super) fn show(self, rig: SeenRig<'_>, tasks: &mut JoinSet<()>, on: &Handle) -> Show {
        let SeenRig { title, stage, tractor, clock, scanners, map } = rig;
        let about = scanners.iter().map(|scanner| ScannerAbout {
            name: scanner.name.clone(),
            model: scanner.model.title().to_owned(),
        });
        let about = About { title, scanners: about.collect() };
        let meters: Vec<_> = scanners.iter().map(|scanner| reading(stage, scanner)).collect();
        let watchers: Vec<_> = scanners.iter().map(|scanner| scanner.lines.watch()).collect();
        let gauges = RigGauges {
            clock,
            tractor: tractor.clone(),
            encoder: stage.scene.encoder,
            receiver: stage.receiver(),
            scanners: scanners.into_iter().map(|scanner| gauge_of(scanner.counts)).collect(),
        };
        let show = Show::new(about, Some(OrchardPicture::of(&stage.orchard)), Box::new(gauges));
        if let Some((truth, z_from_m, period_m)) = truth(stage) {
            show.truth(truth, (z_from_m, CELLS.band_m), period_m);
        }
        if let Some(map) = map {
            show.draws(move || map.svg());
        }
        tasks.spawn_on(self.talk.tell(show.log()), on);
        for (number, (lines, reading)) in watchers.into_iter().zip(meters).enumerate() {
            let meter = reading.map(|reading| Meter::new(reading.pipeline, show.clone(), number));
            tasks.spawn_on(follow(lines, show.clone(), number, tractor.clone(), meter), on);
        }
        show
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
    if let Some(meter) = &mut meter {
        meter.show_rest();
    }
}

/// How a scanner's lines are measured: as `estimate --rig SCENE` would; none where that has no estimate.
fn reading(stage: &Stage, scanner: &SeenScanner) -> Option<Reading> {
    let rig = rig_with(&stage.rig, scanner.number, scanner.model.name());
    Reading::of(Some(&rig), scanner.number, false, CalibrationChoice::OfRig).ok()
}

/// What stands in the row that the first scanner sees, at what height that begins, and after how many metres the row repeats, if it does.
fn truth(stage: &Stage) -> Option<(Vec<TruthColumn>, f64, Option<f64>)> {
    let row = stage.row_seen(0).row;
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
    let z_from_m = cells.column(0.0).bands.first().map_or(0.0, |band| band.z_from_m);
    let period_m = Some(stage.orchard.period_m()).filter(|period_m| period_m.is_finite());
    length_m.is_finite().then(|| ((0..count).map(column).collect(), z_from_m, period_m))
}
