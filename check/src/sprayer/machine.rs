//! The boom while a run goes on: one machine, which hears its commands once, and which sensors, scanners and task controllers see alike.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_protocol::time::SimTime;
use rowscan_sprayer::live::{Reader, States};
use rowscan_sprayer::{Boom, Command, Live};
use rowscan_vehicle::Tractor;

use super::part::SprayerPart;

/// A boom that runs. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Machine {
    live: Arc<Mutex<Live>>,
    part: Arc<SprayerPart>,
    tractor: Tractor,
}

impl Machine {
    /// This boom on this tractor; its free valves follow from `seed`.
    pub(crate) fn new(boom: Boom, seed: u64, part: Arc<SprayerPart>, tractor: Tractor) -> Self {
        Self { live: Arc::new(Mutex::new(Live::new(boom, seed))), part, tractor }
    }

    /// Someone who looks at it.
    pub(super) fn reader(&self) -> Reader {
        self.lock().reader()
    }

    /// What `reader` sees at `at`.
    pub(super) fn look(&self, reader: Reader, at: SimTime) -> States {
        let speed = |at_s: f64| self.tractor.motion(SimTime((at_s * 1e9) as u64)).speed_m_s;
        self.lock().look(reader, at.as_secs_f64(), &self.part.troubles(), &speed)
    }

    /// The tractor that carries it.
    pub(super) fn tractor(&self) -> &Tractor {
        &self.tractor
    }

    /// It is told something.
    pub(super) fn tell(&self, command: &Command) {
        self.lock().tell(command);
    }

    fn lock(&self) -> MutexGuard<'_, Live> {
        self.live.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
