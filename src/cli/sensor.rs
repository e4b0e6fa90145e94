//! The estimator as a sensor on the machine: its ground speed from elsewhere, its canopy on the bus, its latency.

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use rowscan_canopy::{AdvanceSource, GroundSpeed, Pipeline};
use rowscan_driver::{Record, Source};
use rowscan_protocol::nmea::NmeaLines;
use rowscan_protocol::time::{DeviceClock, SimTime};
use rowscan_protocol::validity::ScanFault;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use serde::Serialize;
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;

use super::output::say;
use super::recorded_speed::RecordedSpeed;
use super::tractor_outputs::{BusArgs, tell_news};
use super::{Failure, Format};
use rowscan_bus::Inbox;
use rowscan_bus::link::PortEvent;
use rowscan_bus::nmea::{NmeaSource, SpeedReader};
use rowscan_bus::sensors::CanopySensors;
use rowscan_ports::Delivery;
use rowscan_ports::latency::{WakeLateness, quantile};
use rowscan_ports::task;

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct SensorArgs {
    /// Where the advance comes from; auto: the encoder if the scans carry one that counts, else the rig's constant speed; gnss and can are also taken
    /// from the recording of the scans
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

/// What goes on beside the scans of all scanners.
pub(super) struct Sensors {
    advance: AdvanceArg,
    can: Option<Arc<CanopySensors>>,
    gnss: Option<watch::Receiver<Option<f64>>>,
    /// One a source; empty unless the advance comes from recordings.
    recorded: Vec<RecordedSpeed>,
    /// One a source: what was recorded beside the way that the estimate goes by.
    beside: Vec<Option<(AdvanceSource, RecordedSpeed)>>,
    idle: Option<WakeLateness>,
    tapes: Tapes,
    _tasks: JoinSet<()>,
}

/// A scan that is older than the bus's time by more is no late one: the scanner's clock was set back, or stood.
const LATE_NS: u64 = 100_000_000;

/// One scanner's part in it.
pub(super) struct Sensor {
    advance: AdvanceArg,
    can: Option<(Arc<CanopySensors>, usize)>,
    gnss: Option<watch::Receiver<Option<f64>>>,
    recorded: Option<RecordedSpeed>,
    beside: Option<(AdvanceSource, RecordedSpeed)>,
    measured: Option<Vec<Duration>>,
    clock: DeviceClock,
    /// Time on the bus.
    now: SimTime,
    /// Time on the bus when the scanner's clock began to count.
    anchor: SimTime,
    /// When the last telegram came, host time.
    received: Duration,
}

impl SensorArgs {
    /// Whether the advance comes from the encoder and from nothing else.
    pub(super) fn only_encoder(&self) -> bool {
        self.advance == AdvanceArg::Encoder
    }

    /// Whether the scanner shall be asked for its encoder.
    pub(super) fn wants_encoder(&self) -> bool {
        matches!(self.advance, AdvanceArg::Auto | AdvanceArg::Encoder)
    }

    /// Opens what so many scanners need. A recording waits for a bus that is behind, a live scanner cannot.
    pub(super) async fn open(
        &self,
        format: Format,
        sources: &[Source],
        delivery: Delivery,
    ) -> Result<Sensors, Failure> {
        let (recorded, beside) = (self.recorded(sources)?, self.beside(sources));
        let (mut tasks, tapes) = (JoinSet::new(), Tapes::default());
        let gnss = match (&self.gnss, self.advance) {
            (Some(source), _) => Some(follow_gnss(source.clone(), &tapes, &mut tasks).await?),
            (None, AdvanceArg::Gnss) if recorded.is_empty() => {
                return Err(Failure::Usage(
                    "--advance gnss needs a receiver: --gnss HOST:PORT, or serial:DEV@RATE".to_owned(),
                ));
            }
            (None, _) => None,
        };
        let can = match self.bus.open(format).await? {
            Some((bus, inbox)) => {
                let can = CanopySensors::join(bus, sources.len(), delivery).await;
                let news = tell_news(&mut tasks);
                let inbox = tapes.taping(inbox, &mut tasks);
                tasks.spawn(task(Arc::clone(&can).listen(inbox, news)));
                Some(can)
            }
            None if self.advance == AdvanceArg::Can && recorded.is_empty() => {
                return Err(Failure::Usage(
                    "--advance can needs the tractor's bus: --can udp:239.74.163.2:43113, or another port"
                        .to_owned(),
                ));
            }
            None => None,
        };
        let idle = self.latency.then(|| WakeLateness::watch(Duration::from_millis(20), &mut tasks));
        Ok(Sensors { advance: self.advance, can, gnss, recorded, beside, idle, tapes, _tasks: tasks })
    }
}

impl SensorArgs {
    /// The speeds that recordings hold beside what the advance comes from; one a source.
    fn beside(&self, sources: &[Source]) -> Vec<Option<(AdvanceSource, RecordedSpeed)>> {
        let way = match self.advance {
            AdvanceArg::Gnss => Some(AdvanceSource::Gnss),
            AdvanceArg::Can => Some(AdvanceSource::Can),
            AdvanceArg::Auto | AdvanceArg::Constant | AdvanceArg::Encoder => None,
        };
        let beside = |source: &Source| {
            // Other formats hold scans alone; what is no file, as a pipe, is read only once.
            source.peek().filter(|recording| recording.format() == rowscan_recording::Format::Mcap)?;
            // What cannot be read is told where the scans are.
            RecordedSpeed::found_beside(source.file()?, way).ok().flatten()
        };
        sources.iter().map(beside).collect()
    }

    /// The speeds that recordings hold, one a source, where the advance comes from there.
    fn recorded(&self, sources: &[Source]) -> Result<Vec<RecordedSpeed>, Failure> {
        let kind = match self.advance {
            AdvanceArg::Gnss if self.gnss.is_none() => StreamKind::Nmea,
            AdvanceArg::Can => StreamKind::Can,
            _ => return Ok(Vec::new()),
        };
        let all: Result<Option<Vec<_>>, Failure> =
            sources.iter().map(|source| RecordedSpeed::of(source, kind)).collect();
        match all {
            // The bus has it, then.
            Err(_) if self.advance == AdvanceArg::Can && self.bus.is_given() => Ok(Vec::new()),
            all => Ok(all?.unwrap_or_default()),
        }
    }
}

/// What a recording beside the estimate keeps of receiver and bus, once there is one.
#[derive(Debug, Default)]
struct Tapes {
    gnss: Arc<OnceLock<Tap>>,
    can: Arc<OnceLock<Tap>>,
}

impl Tapes {
    /// What a bus hears, passed on; frames are recorded.
    fn taping(&self, mut heard: Inbox, tasks: &mut JoinSet<()>) -> Inbox {
        let (pass_on, inbox) = mpsc::channel(1);
        let tape = Arc::clone(&self.can);
        tasks.spawn(task(async move {
            while let Some((port, event)) = heard.recv().await {
                if let (PortEvent::Frame(frame), Some(tape)) = (&event, tape.get()) {
                    tape.record(Side::Device, frame.to_text().as_bytes());
                }
                if pass_on.send((port, event)).await.is_err() {
                    return;
                }
            }
        }));
        inbox
    }
}

impl Sensors {
    /// Records what the receiver and the bus say as well, beside the scans: the way may come from them.
    pub(super) fn record_to(&self, taps: &Taps) {
        // Only the first call counts.
        if self.gnss.is_some() {
            let _ = self.tapes.gnss.set(taps.open("gnss", StreamKind::Nmea));
        }
        if self.can.is_some() {
            let _ = self.tapes.can.set(taps.open("can", StreamKind::Can));
        }
    }

    /// The part of scanner number `place` among those that are followed.
    pub(super) fn of(&self, place: usize) -> Sensor {
        Sensor {
            advance: self.advance,
            can: self.can.as_ref().map(|can| (Arc::clone(can), place)),
            gnss: self.gnss.clone(),
            recorded: self.recorded.get(place).cloned(),
            beside: self.beside.get(place).cloned().flatten(),
            measured: self.idle.as_ref().map(|_| Vec::new()),
            clock: DeviceClock::default(),
            now: SimTime::ZERO,
            anchor: SimTime::ZERO,
            received: Duration::ZERO,
        }
    }

    /// Waits until the bus has everything, for at most `patience`, and says what it did not take.
    pub(super) async fn part(&self, patience: Duration) {
        let Some(can) = &self.can else { return };
        let (lost, all) = can.part(patience).await;
        if lost > 0 {
            say(format_args!("{lost} CAN frames lost: a port was too slow to take them"));
        }
        if !all {
            say(format_args!("the last CAN frames are lost: a port did not take them within {patience:?}"));
        }
    }

    /// What was measured with a scanner.
    pub(super) fn latency(&self, sensor: &mut Sensor) -> Option<LatencyReport> {
        let (measured, idle) = (sensor.measured.as_mut()?, self.idle.as_ref()?);
        let ms =
            |times: &mut Vec<Duration>, share| quantile(times, share).map(|time| time.as_secs_f64() * 1e3);
        let mut idle = idle.measured();
        Some(LatencyReport {
            scans: measured.len(),
            latency_p50_ms: ms(measured, 0.5),
            latency_p99_ms: ms(measured, 0.99),
            idle_p50_ms: ms(&mut idle, 0.5),
            idle_p99_ms: ms(&mut idle, 0.99),
        })
    }
}

impl Sensor {
    /// Works a scan in.
    pub(super) async fn push(&mut self, pipeline: &mut Pipeline, record: Record<'_>) {
        let scan = record.scan;
        self.go_on(scan.scan_time_us, record.received.0);
        let speed = |source, speed_m_s| GroundSpeed { source, speed_m_s };
        if let Some((source, beside)) = &self.beside {
            pipeline.hear_speed(speed(*source, beside.between(self.received)));
        }
        match self.advance {
            AdvanceArg::Auto | AdvanceArg::Encoder => pipeline.push(scan),
            AdvanceArg::Constant => pipeline.push_at_speed(scan, speed(AdvanceSource::Constant, None)),
            AdvanceArg::Gnss => {
                let now = match &self.recorded {
                    Some(recorded) => recorded.at(self.received),
                    None => self.gnss.as_ref().and_then(|gnss| *gnss.borrow()),
                };
                pipeline.push_at_speed(scan, speed(AdvanceSource::Gnss, now));
            }
            AdvanceArg::Can => {
                let heard = match &self.recorded {
                    Some(recorded) => recorded.at(self.received),
                    None => {
                        self.can.as_ref().and_then(|(can, number)| can.ground_speed_m_s(*number, self.now))
                    }
                };
                pipeline.push_at_speed(scan, speed(AdvanceSource::Can, heard));
            }
        }
        self.tell(pipeline).await;
    }

    /// Works a telegram in that gives no scan. The device's time is not known, so host time goes on from the last scan.
    pub(super) async fn unreadable(
        &mut self,
        pipeline: &mut Pipeline,
        fault: &ScanFault,
        received: Duration,
    ) {
        self.pass(received);
        pipeline.push_unreadable(fault);
        self.tell(pipeline).await;
    }

    /// Nothing has come for a while, and it is `now` on the host: the bus tells what is due. A recording has no such time.
    pub(super) async fn silent(&mut self, pipeline: &Pipeline, now: Duration) {
        if now > self.received {
            self.pass(now);
            self.tell(pipeline).await;
        }
    }

    /// The bus's time goes on as the scanner's clock does. Where that was set back, or host time has overtaken it in a silence, the clock counts anew from where the
    /// bus is: a bus that waited for the clock would be dead until then.
    fn go_on(&mut self, scan_time_us: u32, received: Duration) {
        let passed_ns = (self.clock.seconds(scan_time_us) * 1e9) as u64;
        let reached = SimTime(self.anchor.0.saturating_add(passed_ns));
        if self.now.0.saturating_sub(reached.0) > LATE_NS {
            self.pass(received);
            self.anchor = self.now;
            self.clock = DeviceClock::default();
            self.clock.seconds(scan_time_us);
        } else {
            self.now = self.now.max(reached);
            self.received = received;
        }
    }

    /// Host time goes on from the last scan.
    fn pass(&mut self, now: Duration) {
        let passed = now.saturating_sub(self.received);
        self.received = now;
        self.now = SimTime(self.now.0.saturating_add(passed.as_nanos() as u64));
    }

    async fn tell(&self, pipeline: &Pipeline) {
        if let Some((can, number)) = &self.can {
            can.tell(*number, self.now, pipeline).await;
        }
    }

    /// Waits until the bus has what is due by now; only if that is measured.
    pub(super) async fn written(&self) {
        if let (Some((can, _)), Some(_)) = (&self.can, &self.measured) {
            can.written().await;
        }
    }

    /// From a scan's last byte to here it took so long.
    pub(super) fn measured(&mut self, latency: Duration) {
        if let Some(measured) = &mut self.measured {
            measured.push(latency);
        }
    }
}

/// Follows a receiver's ground speed; lost while it has no fix or the connection is gone.
async fn follow_gnss(
    source: NmeaSource,
    tapes: &Tapes,
    tasks: &mut JoinSet<()>,
) -> Result<watch::Receiver<Option<f64>>, Failure> {
    let mut ear = source.open().await?;
    let (tell, told) = watch::channel(None);
    let tape = Arc::clone(&tapes.gnss);
    tasks.spawn(task(async move {
        let (mut lines, mut reader) = (NmeaLines::default(), SpeedReader::default());
        loop {
            let heard = ear.hear().await;
            if heard.is_empty() {
                (lines, reader) = Default::default();
                tell.send_replace(None);
            } else if let Some(tape) = tape.get() {
                tape.record(Side::Device, heard);
            }
            lines.push(heard);
            while let Some(line) = lines.next_line() {
                if let Some(speed) = reader.line(&line) {
                    tell.send_replace(speed);
                }
            }
        }
    }));
    Ok(told)
}
