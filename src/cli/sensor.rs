//! The estimator as a sensor on the machine: its ground speed from elsewhere, its canopy on the bus, its latency.

use std::sync::Arc;
use std::time::Duration;

use rowscan_canopy::{AdvanceSource, GroundSpeed, Pipeline};
use rowscan_driver::{HostTime, Source};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::{DeviceClock, SimTime};
use rowscan_recording::nmea::Lines;
use serde::Serialize;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::timeout;

use super::output::say;
use super::voices::BusArgs;
use super::{Failure, Format};
use crate::bus::canopy::CanopyEcu;
use crate::bus::link::Heard;
use crate::bus::{Bus, BusWatch, CanFrame, Inbox};
use crate::clock::{Lateness, quantile};
use crate::nmea::{NmeaSource, SpeedReader};

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct SensorArgs {
    /// Where the advance comes from; auto: the encoder if the scans carry one, else the rig's constant speed
    #[arg(long, value_enum, default_value_t)]
    advance: AdvanceArg,
    /// A GNSS receiver's NMEA, for --advance gnss: HOST:PORT of a server, udp:ADDR:PORT, serial:DEV@RATE
    #[arg(long, value_name = "SOURCE")]
    gnss: Option<NmeaSource>,
    #[command(flatten)]
    bus: BusArgs,
    /// Measure the host time from a scan's last byte to its CAN frames being out, beside what an idle task waits
    #[arg(long)]
    latency: bool,
}

/// Where the advance comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum AdvanceArg {
    /// The encoder in the scans, else the rig's speed
    #[default]
    Auto,
    /// The rig's speed
    Constant,
    /// The encoder in the scans
    Encoder,
    /// Ground speed by GNSS
    Gnss,
    /// Ground speed on the CAN bus
    Can,
}

/// Host times from a scan's last byte on, milliseconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct LatencyReport {
    /// Scans measured.
    scans: usize,
    /// Until its CAN frames were out.
    latency_p50_ms: Option<f64>,
    latency_p99_ms: Option<f64>,
    /// How late an idle task woke meanwhile: what the host itself adds.
    idle_p50_ms: Option<f64>,
    idle_p99_ms: Option<f64>,
}

/// What goes on beside the scans.
pub(super) struct Sensor {
    advance: AdvanceArg,
    can: Option<(CanopyEcu, Arc<Bus>, Inbox)>,
    gnss: Option<watch::Receiver<Option<f64>>>,
    latency: Option<(Vec<Duration>, Lateness)>,
    clock: DeviceClock,
    now: SimTime,
    frames: Vec<CanFrame>,
    watch: BusWatch,
    /// A recording waits for a bus that is behind; a live scanner does not.
    patient: bool,
    row_spacing_m: Option<f64>,
    _tasks: JoinSet<()>,
}

impl SensorArgs {
    /// Whether the scanner shall be asked for its encoder.
    pub(super) fn wants_encoder(&self) -> bool {
        matches!(self.advance, AdvanceArg::Auto | AdvanceArg::Encoder)
    }

    /// Opens what it needs.
    pub(super) async fn open(
        &self,
        format: Format,
        row_spacing_m: Option<f64>,
        source: &Source,
    ) -> Result<Sensor, Failure> {
        let mut tasks = JoinSet::new();
        let gnss = match (&self.gnss, self.advance) {
            (Some(source), _) => Some(follow_gnss(source.clone(), &mut tasks).await?),
            (None, AdvanceArg::Gnss) => {
                return Err(Failure::Usage(
                    "--advance gnss needs a receiver: --gnss HOST:PORT, or serial:DEV@RATE".to_owned(),
                ));
            }
            (None, _) => None,
        };
        let (mut frames, mut ecu) = (Vec::new(), CanopyEcu::default());
        let can = match self.bus.open(format).await? {
            Some((bus, inbox)) => {
                if bus.is_open_from_the_start() {
                    ecu.open(SimTime::ZERO, &mut frames);
                }
                Some((ecu, Arc::new(bus), inbox))
            }
            None if self.advance == AdvanceArg::Can => {
                return Err(Failure::Usage(
                    "--advance can needs the tractor's bus: --can udp:239.74.163.2:43113, or another port"
                        .to_owned(),
                ));
            }
            None => None,
        };
        let latency =
            self.latency.then(|| (Vec::new(), Lateness::watch(Duration::from_millis(20), &mut tasks)));
        Ok(Sensor {
            advance: self.advance,
            can,
            gnss,
            latency,
            clock: DeviceClock::default(),
            now: SimTime::ZERO,
            frames,
            watch: BusWatch::default(),
            patient: matches!(source, Source::Recording { .. }),
            row_spacing_m,
            _tasks: tasks,
        })
    }
}

impl Sensor {
    /// Works a scan in.
    pub(super) async fn push(&mut self, pipeline: &mut Pipeline, scan: &Scan) {
        let seconds = self.clock.seconds(scan.scan_time_us);
        self.now = self.now.max(SimTime((seconds * 1e9) as u64));
        let speed = |source, speed_m_s| GroundSpeed { source, speed_m_s };
        match self.advance {
            AdvanceArg::Auto | AdvanceArg::Encoder => pipeline.push(scan),
            AdvanceArg::Constant => pipeline.push_at_speed(scan, speed(AdvanceSource::Constant, None)),
            AdvanceArg::Gnss => {
                let now = self.gnss.as_ref().and_then(|gnss| *gnss.borrow());
                pipeline.push_at_speed(scan, speed(AdvanceSource::Gnss, now));
            }
            AdvanceArg::Can => {
                let now = self.can.as_ref().and_then(|(ecu, ..)| ecu.ground_speed_m_s(self.now));
                pipeline.push_at_speed(scan, speed(AdvanceSource::Can, now));
            }
        }
        if let Some((ecu, ..)) = &mut self.can {
            ecu.tell(self.now, pipeline, self.row_spacing_m, &mut self.frames);
        }
        self.send().await;
    }

    /// The scan whose last byte came at `received` is out; it is now `now`.
    pub(super) async fn measure(&mut self, received: HostTime, now: impl Fn() -> HostTime) {
        if let Some((measured, _)) = &mut self.latency {
            if let Some((_, bus, _)) = &self.can {
                bus.written().await;
            }
            measured.push(now().0.saturating_sub(received.0));
        }
    }

    /// Waits for something on the bus and answers it; for ever without one. Cancel safe.
    pub(super) async fn hear(&mut self) {
        let Some((ecu, _, inbox)) = &mut self.can else { return std::future::pending().await };
        let Some((port, heard)) = inbox.recv().await else { return std::future::pending().await };
        match heard {
            Heard::Opened => ecu.open(self.now, &mut self.frames),
            Heard::Frame(frame) => ecu.handle(self.now, &frame, &mut self.frames),
            Heard::Lost(_) => {}
        }
        if let Some(news) = self.watch.news(port, heard, ecu.standing()) {
            say(news);
        }
    }

    /// Sends what has gathered.
    pub(super) async fn send(&mut self) {
        if let Some((_, bus, _)) = &self.can {
            for frame in self.frames.drain(..) {
                bus.send((self.now, frame), None, self.patient).await;
            }
        }
    }

    /// Waits until the bus has everything, for at most `patience`, and says what it did not take.
    pub(super) async fn part(&mut self, patience: Duration) {
        let Some((_, bus, _)) = &self.can else { return };
        let all = timeout(patience, bus.written()).await.is_ok();
        if bus.dropped() > 0 {
            say(format_args!("{} CAN frames lost: a port was too slow to take them", bus.dropped()));
        }
        if !all {
            say(format_args!("the last CAN frames are lost: a port did not take them within {patience:?}"));
        }
    }

    /// What was measured.
    pub(super) fn latency(&mut self) -> Option<LatencyReport> {
        let (measured, lateness) = self.latency.as_mut()?;
        let ms =
            |times: &mut Vec<Duration>, share| quantile(times, share).map(|time| time.as_secs_f64() * 1e3);
        let mut idle = lateness.measured();
        Some(LatencyReport {
            scans: measured.len(),
            latency_p50_ms: ms(measured, 0.5),
            latency_p99_ms: ms(measured, 0.99),
            idle_p50_ms: ms(&mut idle, 0.5),
            idle_p99_ms: ms(&mut idle, 0.99),
        })
    }
}

/// Follows a receiver's ground speed; lost while it has no fix or the connection is gone.
async fn follow_gnss(
    source: NmeaSource,
    tasks: &mut JoinSet<()>,
) -> Result<watch::Receiver<Option<f64>>, Failure> {
    let mut ear = source.open().await?;
    let (tell, told) = watch::channel(None);
    tasks.spawn(async move {
        let (mut lines, mut reader) = (Lines::default(), SpeedReader::default());
        loop {
            let heard = ear.hear().await;
            if heard.is_empty() {
                (lines, reader) = Default::default();
                tell.send_replace(None);
            }
            lines.push(heard);
            while let Some(line) = lines.next_line() {
                if let Some(speed) = reader.line(&line) {
                    tell.send_replace(speed);
                }
            }
        }
    });
    Ok(told)
}
