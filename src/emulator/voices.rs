//! What else on the tractor speaks: GNSS and CAN, on the same simulated clock as the mirror.
//!
//! The mirror's task speaks for them between its turns, in the order of time, so that at any time scale everything comes at the instant
//! it states, and run after run in the same order.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use rowscan_protocol::time::SimTime;

use super::Shared;
use crate::bus::link::Heard;
use crate::bus::tractor::TractorEcu;
use crate::bus::{Bus, CanFrame, Inbox};
use crate::clock::TimeScale;
use crate::nmea::{NmeaLine, NmeaVoice};

/// The voices of one tractor, and where they are heard.
#[derive(Debug, Default)]
pub struct Voices {
    /// GNSS sentences, and the lines they go out on.
    pub nmea: Option<(NmeaVoice, Vec<NmeaLine>)>,
    /// The tractor's control function, its bus, and what is heard there.
    pub can: Option<(TractorEcu, Bus, Inbox)>,
}

/// Voices that speak.
#[derive(Debug)]
pub(super) struct Speaking {
    nmea: Option<(NmeaVoice, Vec<NmeaLine>)>,
    can: Option<Arc<Can>>,
    /// What is said as simulated time begins.
    first: Vec<CanFrame>,
    patient: bool,
}

/// The control function on its bus: the mirror's task speaks for it, a task of its own listens.
#[derive(Debug)]
pub(super) struct Can {
    ecu: Mutex<TractorEcu>,
    bus: Bus,
}

impl Can {
    fn tell(&self, tell: impl FnOnce(&mut TractorEcu, &mut Vec<CanFrame>)) -> Vec<CanFrame> {
        let mut frames = Vec::new();
        tell(&mut self.ecu.lock().unwrap_or_else(PoisonError::into_inner), &mut frames);
        frames
    }

    async fn send(&self, at: SimTime, frames: Vec<CanFrame>, patient: bool) {
        for frame in frames {
            self.bus.send((at, frame), None, patient).await;
        }
    }
}

impl Voices {
    /// Ready to speak; what listens at the bus besides.
    pub(super) fn start(self, scale: TimeScale) -> (Speaking, Option<(Arc<Can>, Inbox)>) {
        let patient = scale == TimeScale::Max;
        let mut first = Vec::new();
        let (can, listening) = match self.can {
            Some((mut ecu, bus, inbox)) => {
                if bus.is_open_from_the_start() {
                    ecu.open(SimTime::ZERO, &mut first);
                }
                let can = Arc::new(Can { ecu: Mutex::new(ecu), bus });
                (Some(Arc::clone(&can)), Some((can, inbox)))
            }
            None => (None, None),
        };
        (Speaking { nmea: self.nmea, can, first, patient }, listening)
    }
}

impl Speaking {
    /// When something is due next.
    pub(super) fn next(&self) -> Option<SimTime> {
        if !self.first.is_empty() {
            return Some(SimTime::ZERO);
        }
        let nmea = self.nmea.as_ref().map(|(voice, _)| voice.next());
        let ecu = |can: &Arc<Can>| can.ecu.lock().unwrap_or_else(PoisonError::into_inner).next();
        nmea.into_iter().chain(self.can.as_ref().and_then(ecu)).min()
    }

    /// Says everything due at `at`: CAN, then GNSS.
    pub(super) async fn speak(&mut self, at: SimTime) {
        if let Some(can) = &self.can {
            let mut frames = std::mem::take(&mut self.first);
            frames.extend(can.tell(|ecu, out| ecu.poll(at, out)));
            can.send(at, frames, self.patient).await;
        }
        if let Some((voice, lines)) = &mut self.nmea {
            while voice.next() <= at {
                let epoch = Bytes::from(voice.speak());
                for line in lines.iter() {
                    line.send(epoch.clone(), self.patient).await;
                }
            }
        }
    }
}

/// Hears what the ports say, for as long as the bus is open.
pub(super) async fn listen(shared: Arc<Shared>, can: Arc<Can>, mut inbox: Inbox) {
    let clock = &shared.clock;
    let patient = clock.scale() == TimeScale::Max;
    while let Some((port, heard)) = inbox.recv().await {
        let at = clock.now();
        let replies = match heard {
            Heard::Opened => can.tell(|ecu, out| ecu.open(at, out)),
            Heard::Frame(frame) => {
                can.bus.send((at, frame), Some(port), patient).await;
                can.tell(|ecu, out| ecu.handle(at, &frame, out))
            }
        };
        can.send(at, replies, patient).await;
    }
}
