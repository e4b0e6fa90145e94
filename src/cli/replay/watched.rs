//! The page beside a replay.

use std::sync::Arc;

use rowscan_bench::replay::ReplayedStream;
use rowscan_control::Bench;
use rowscan_emulator::clock::SimClock;
use rowscan_emulator::replay::Part;
use rowscan_ports::task;
use rowscan_protocol::rig::Rig;
use rowscan_recording::Taps;
use rowscan_study::reading::{CalibrationChoice, Reading};
use rowscan_web::{About, Gauges, ScannerAbout, ScannerGauge, Show};
use tokio::task::JoinSet;

use super::super::Failure;
use super::super::web::{GaugeOf, Meter, Opened, Scans, Talk, gauge_of};
use super::Args;

/// What the page is to hear, before there is one.
pub(super) struct Watching {
    names: Vec<String>,
    taps: Taps,
    talk: Talk,
    scans: Scans,
}

/// A page that is served. Dropped, it is served no longer.
#[derive(Default)]
pub(super) struct Watched {
    _web: Opened,
    _tasks: JoinSet<()>,
}

struct ReplayGauges(Vec<GaugeOf>);

impl Gauges for ReplayGauges {
    fn scanners(&self) -> Vec<ScannerGauge> {
        self.0.iter().map(|gauge| gauge()).collect()
    }
}

impl Watching {
    /// For the scanners among these streams.
    pub(super) fn new(parts: &[&Part], clock: Arc<SimClock>) -> Self {
        let names: Vec<String> =
            parts.iter().filter(|part| part.is_scanner()).map(|part| part.name.clone()).collect();
        let now_s: Arc<dyn Fn() -> f64 + Send + Sync> = Arc::new(move || clock.now().as_secs_f64());
        let (talk_taps, talk) = Talk::listen(Arc::clone(&now_s));
        let (scan_taps, scans) = Scans::listen(names.clone(), now_s);
        Self { names, taps: talk_taps.and(scan_taps), talk, scans }
    }

    /// Where bytes go.
    pub(super) fn taps(&self) -> Taps {
        self.taps.clone()
    }

    /// Opens the page.
    pub(super) async fn open(
        self,
        args: &Args,
        model: Option<&str>,
        rig: Option<&Rig>,
        (parts, streams): (&[&Part], &[ReplayedStream]),
        bench: Bench,
    ) -> Result<Watched, Failure> {
        let scanner =
            |name: &String| ScannerAbout { name: name.clone(), model: model.unwrap_or_default().to_owned() };
        let name = args.file.file_name().unwrap_or(args.file.as_os_str());
        let about = About {
            title: format!("rowscan replay {}", name.display()),
            scanners: self.names.iter().map(scanner).collect(),
        };
        let scanners = parts.iter().zip(streams).filter(|(part, _)| part.is_scanner());
        let gauges = scanners.filter_map(|(_, stream)| stream.counts().map(gauge_of));
        let show = Show::new(about, None, Box::new(ReplayGauges(gauges.collect())));
        // The recording's scanners are the rig's in their order, where it has as many.
        for (number, mount) in rig.into_iter().flat_map(|rig| &rig.scanners).enumerate() {
            show.sits(number, mount.clone());
        }
        let mut tasks = JoinSet::new();
        tasks.spawn(task(self.talk.tell(show.log())));
        let meters =
            (0..self.names.len()).map(|number| meter(rig, number, self.names.len(), &show)).collect();
        tasks.spawn(task(self.scans.show(show.clone(), meters)));
        let web = args.web.open(show, Some(bench), args.format).await?;
        Ok(Watched { _web: web, _tasks: tasks })
    }
}

/// What measures the scans of scanner number `number` of `scanners` as `estimate FILE --rig RIG` would; none where that has no estimate. A rig's
/// scanners are the recording's in their order.
fn meter(rig: Option<&Rig>, number: usize, scanners: usize, show: &Show) -> Option<Meter> {
    let rig = rig.filter(|rig| scanners == 1 || rig.scanners.len() == scanners)?;
    // What whoever watches has skipped is not missing: the rest is shown.
    let rig = Rig { max_excluded: 1.0, ..rig.clone() };
    let reading = Reading::of_recording(Some(&rig), number, false, CalibrationChoice::OfRig).ok()?;
    Some(Meter::new(reading.pipeline, show.clone(), number))
}
