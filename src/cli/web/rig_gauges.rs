//! What an emulated rig tells the page.

use std::sync::Arc;
use std::time::Duration;

use rowscan_emulator::CountReader;
use rowscan_emulator::clock::SimClock;
use rowscan_protocol::time::SimTime;
use rowscan_vehicle::Tractor;
use rowscan_vehicle::encoder::Encoder;
use rowscan_vehicle::gnss::{FixQuality, Receiver};
use rowscan_web::{FixGauge, Gauges, ScannerGauge, Speeds, TractorGauge};

/// Tells what a scanner has done.
pub(in super::super) type GaugeOf = Box<dyn Fn() -> ScannerGauge + Send + Sync>;

/// The gauge of a virtual scanner.
pub(in super::super) fn gauge_of(reader: CountReader) -> GaugeOf {
    Box::new(move || {
        let Some(counts) = reader.counts() else { return ScannerGauge::default() };
        ScannerGauge {
            scans: Some(counts.scans_sent),
            lost: counts.scans_dropped,
            missed: counts.scans_missed,
            refused: counts.connections.map(|of| of.refused + of.silent + of.idle),
            clients: reader.clients().map(|clients| clients as u64),
            ..ScannerGauge::default()
        }
    })
}

/// How long ticks are counted for a speed.
const COUNTED: Duration = Duration::from_millis(200);

/// The tractor and the scanners of a rig.
pub(in super::super) struct RigGauges {
    pub(in super::super) clock: Arc<SimClock>,
    pub(in super::super) tractor: Tractor,
    pub(in super::super) encoder: Encoder,
    pub(in super::super) receiver: Receiver,
    pub(in super::super) scanners: Vec<GaugeOf>,
}

impl RigGauges {
    /// By the ticks of the last fifth of a second.
    fn wheel_m_s(&self, at: SimTime) -> Option<f64> {
        let before = SimTime(at.0.checked_sub(COUNTED.as_nanos() as u64)?);
        let ticks = |at| self.tractor.encoder_ticks(&self.encoder, at);
        Some((ticks(at) - ticks(before)) / self.encoder.ticks_a_metre_ahead() / COUNTED.as_secs_f64())
    }

    fn gnss_m_s(&self, at: SimTime) -> Option<f64> {
        let fix = self.tractor.report(&self.receiver, at).fix;
        (fix.quality != FixQuality::None).then_some(fix.speed_m_s)
    }
}

impl Gauges for RigGauges {
    fn tractor(&self) -> Option<TractorGauge> {
        let at = self.clock.now();
        let motion = self.tractor.motion(at);
        Some(TractorGauge {
            at_s: at.as_secs_f64(),
            x_m: motion.place.x_m,
            y_m: motion.place.y_m,
            up_m: motion.up_m,
            heading_rad: motion.place.heading_rad,
            roll_rad: motion.roll_rad,
            pitch_rad: motion.pitch_rad,
            way_m: motion.way_m,
            has_begun: self.tractor.began().is_some(),
            speeds: Speeds {
                ground_m_s: Some(motion.speed_m_s),
                wheel_m_s: self.wheel_m_s(at),
                gnss_m_s: self.gnss_m_s(at),
            },
        })
    }

    fn fix(&self) -> Option<FixGauge> {
        let fix = self.tractor.report(&self.receiver, self.clock.now()).fix;
        (fix.quality != FixQuality::None).then_some(FixGauge {
            latitude_deg: fix.latitude_deg,
            longitude_deg: fix.longitude_deg,
            altitude_m: fix.altitude_m + fix.geoid_m,
        })
    }

    fn scanners(&self) -> Vec<ScannerGauge> {
        self.scanners.iter().map(|gauge| gauge()).collect()
    }
}
