//! The boom's spray, for scanners to see: what its valves let through while the run goes on.

use std::sync::Arc;
use std::time::Duration;

use rowscan_bus::CanFrame;
use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::isobus::role::SectionLog;
use rowscan_protocol::time::SimTime;
use rowscan_sprayer::live::Valves;
use rowscan_vehicle::Tractor;

use super::hearing::Hearing;
use super::part::SprayerPart;
use super::spec::SprayerSpec;

/// Scanners see the mean of so long, when it is over.
const PERIOD: Duration = Duration::from_millis(10);

/// Tells scanners what leaves the nozzles. It sends nothing.
#[derive(Debug)]
pub(crate) struct BoomSpray {
    hearing: Hearing,
    valves: Valves,
    part: Arc<SprayerPart>,
    tractor: Tractor,
    next: Option<SimTime>,
}

impl BoomSpray {
    /// Of this sprayer, whose free valves follow from `seed`.
    pub(crate) fn new(
        spec: &SprayerSpec,
        seed: u64,
        (part, tractor, orders): (Arc<SprayerPart>, Tractor, SectionLog),
    ) -> Self {
        let (hearing, valves) = (Hearing::new(spec, orders), Valves::new(spec.boom.clone(), seed));
        Self { hearing, valves, part, tractor, next: None }
    }
}

impl ControlFunction for BoomSpray {
    fn open(&mut self, at: SimTime, _out: &mut Vec<CanFrame>) {
        self.next.get_or_insert(at + PERIOD);
    }

    fn open_settled(&mut self, at: SimTime, out: &mut Vec<CanFrame>) {
        self.open(at, out);
    }

    fn next(&self) -> Option<SimTime> {
        self.next
    }

    fn poll(&mut self, at: SimTime, _out: &mut Vec<CanFrame>) {
        if self.next.is_none_or(|next| at < next) {
            return;
        }
        self.hearing.ordered().iter().for_each(|command| self.valves.tell(command));
        let shares = self.valves.shares(at.as_secs_f64(), &self.part.troubles());
        for (number, share) in (0..=u8::MAX).zip(shares) {
            self.tractor.set_nozzle_flow(at, number, share);
        }
        self.next = Some(at + PERIOD);
    }

    fn handle(&mut self, at: SimTime, frame: &CanFrame, _out: &mut Vec<CanFrame>) {
        self.hearing.heard(at, frame).iter().for_each(|command| self.valves.tell(command));
    }
}
