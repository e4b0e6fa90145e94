//! The canopy sensor's control function: its address, what it says of the canopy, what it hears of the tractor.

use rowscan_canopy::{AdvanceSource, Pipeline, Withheld};
use rowscan_protocol::time::SimTime;

use super::frame::{CanFrame, J1939Id};
use super::message::{Message, Payload};
use super::name::Name;
use super::node::{AddressState, Node};
use super::pgn::canopy::{CanopyReport, IMPACTED_BANDS, LEAF_BANDS, LEAF_STATUS, SUMMARY};
use super::pgn::{CANOPY_ADDRESS, tractor};

const MESSAGES: &[&Message] = &[&SUMMARY, &IMPACTED_BANDS, &LEAF_BANDS, &LEAF_STATUS];

/// A speed not heard for so long is lost, ns: tractors send it every 100 ms. So is the canopy without a valid scan for so long.
const STALE_NS: u64 = 500_000_000;

/// The canopy sensor on the bus. Its time is the scanner's, so that what it says comes as the scans do.
#[derive(Debug)]
pub struct CanopyEcu {
    node: Node,
    report: CanopyReport,
    ground_speed: Option<(SimTime, f64)>,
    /// The scans that the canopy was made of when a valid one came last, and when that was.
    valid: (u64, Option<SimTime>),
}

impl Default for CanopyEcu {
    fn default() -> Self {
        Self::new(0)
    }
}

fn compose(report: &CanopyReport, message: &Message) -> Option<Payload> {
    Some(match message.pgn {
        pgn if pgn == SUMMARY.pgn => report.summary(),
        pgn if pgn == IMPACTED_BANDS.pgn => report.impacted_bands(),
        pgn if pgn == LEAF_BANDS.pgn => report.leaf_bands(),
        pgn if pgn == LEAF_STATUS.pgn => report.leaf_status(),
        _ => return None,
    })
}

impl CanopyEcu {
    /// The sensor of this number, from 0, among those of one machine.
    pub fn new(instance: u8) -> Self {
        let address = CANOPY_ADDRESS.saturating_add(instance);
        let node = Node::new(Name::canopy(instance), address, MESSAGES, &[]);
        Self { node, report: CanopyReport::default(), ground_speed: None, valid: (0, None) }
    }

    /// A bus, or another port of it, opens.
    pub fn open(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.node.open(at, out);
    }

    /// A frame was received: answers, and keeps the tractor's speed.
    pub fn handle(&mut self, at: SimTime, frame: &CanFrame, out: &mut Vec<CanFrame>) {
        let Self { node, report, ground_speed, valid: _ } = self;
        node.handle(at, frame, &mut |message, _| compose(report, message), out);
        if J1939Id::of(frame.id).is_some_and(|id| id.pgn == tractor::GROUND_SPEED.pgn) {
            *ground_speed = tractor::ground_speed_m_s(frame.data()).map(|speed_m_s| (at, speed_m_s));
        }
    }

    /// The tractor's ground speed, signed, m/s, while it is told.
    pub fn ground_speed_m_s(&self, at: SimTime) -> Option<f64> {
        self.ground_speed
            .filter(|(heard, _)| at.0.saturating_sub(heard.0) <= STALE_NS)
            .map(|(_, speed)| speed)
    }

    /// A telegram that came at `at` has been worked in: says what is due. While no valid scan has come for half a second, the canopy's values are
    /// "not available".
    pub fn tell(&mut self, at: SimTime, pipeline: &Pipeline, out: &mut Vec<CanFrame>) {
        if pipeline.valid_scans() > self.valid.0 {
            self.valid = (pipeline.valid_scans(), Some(at));
        }
        if self.node.next().is_none_or(|due| due > at) {
            return;
        }
        let is_stale = self.valid.1.is_some_and(|valid_at| at.0.saturating_sub(valid_at.0) >= STALE_NS);
        let window = if is_stale { Err(Withheld::Stale) } else { pipeline.window() };
        let speed = pipeline.ground_speed();
        self.report = CanopyReport {
            window,
            speed_m_s: speed.and_then(|speed| speed.speed_m_s),
            advance_source: speed.map(|speed| match speed.source {
                AdvanceSource::Constant => 0.0,
                AdvanceSource::Encoder => 1.0,
                AdvanceSource::Gnss => 2.0,
                AdvanceSource::Can => 3.0,
            }),
        };
        let report = &self.report;
        self.node.poll(at, &mut |message, _| compose(report, message), out);
    }

    /// The state of its address claim.
    pub fn address_state(&self) -> AddressState {
        self.node.address_state()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::rig::{BeamWidth, Rig};
    use rowscan_protocol::scan::{Echo, Scan};

    const MS: u64 = 1_000_000;

    #[test]
    fn a_wall_is_told_ten_times_a_second_by_its_height() {
        let rig = Rig { row_spacing_m: Some(4.0), optics: Some(BeamWidth::Ideal), ..Rig::default() };
        let mut pipeline = Pipeline::new(Some(&rig), 0, None).unwrap();
        let (mut ecu, mut out) = (CanopyEcu::default(), Vec::new());
        ecu.open(SimTime::ZERO, &mut out);
        out.clear();
        let beams = BeamGrid::spanning(-450_000, 2_250_000, 5000);
        // A wall at the row axis: range = distance / cos θ.
        let range_m = (0..beams.len()).map(|beam| {
            let theta = (beams.angle_deg(beam) - 90.0).to_radians();
            // Behind the axis, where a face of the voxels is.
            let range_m = (rig.scanners[0].distance_m + 1e-4) / theta.cos();
            let z_m = 1.6 + range_m * theta.sin();
            if theta.cos() > 0.0 && (0.2..2.0).contains(&z_m) { range_m } else { f64::INFINITY }
        });
        let mut scan = Scan {
            scan_frequency_hz: 50.0,
            beams,
            echoes: vec![Echo { range_m: range_m.collect(), remission: Vec::new() }],
            ..Scan::default()
        };
        for turn in 1..=100u16 {
            scan.telegram_counter = turn;
            scan.scan_time_us = u32::from(turn) * 20_000;
            pipeline.push(&scan);
            ecu.tell(SimTime(u64::from(turn) * 20 * MS), &pipeline, &mut out);
        }
        let of = |message: &Message| -> Vec<&CanFrame> {
            out.iter().filter(|frame| J1939Id::of(frame.id).unwrap().pgn == message.pgn).collect()
        };
        // From 250 ms to 2 s.
        assert_eq!((of(&SUMMARY).len(), of(&IMPACTED_BANDS).len()), (18, 36));
        let last = SUMMARY.decode(of(&SUMMARY).last().unwrap().data());
        // The wall of the midpoint form: distance · 2 N sin(Δθ/2) a metre, of N beams.
        let wall_m2 = |beams: f64| rig.scanners[0].distance_m * 2.0 * beams * 0.25_f64.to_radians().sin();
        let met = scan.echoes[0].range_m.iter().filter(|range_m| range_m.is_finite()).count();
        assert!((last[0].unwrap() - wall_m2(met as f64)).abs() < 0.02, "{last:?}");
        assert!((last[4].unwrap() - 2.0).abs() < 0.03, "{last:?}");
        assert_eq!(
            (last[1], last[3], last[6]),
            (None, None, Some(0.0)),
            "a wall has no leaves; constant speed"
        );
        let status = LEAF_STATUS.decode(of(&LEAF_STATUS).last().unwrap().data());
        assert_eq!(status, [Some(f64::from(Withheld::NoFoliage.number())), None, None, None]);
        let bands = IMPACTED_BANDS.decode(of(&IMPACTED_BANDS).last().unwrap().data());
        // From half a metre to a metre the wall is 25 beams high.
        assert!((bands[1].unwrap() - wall_m2(25.0)).abs() < 0.02 && bands[5] == Some(0.0), "{bands:?}");
    }
}
