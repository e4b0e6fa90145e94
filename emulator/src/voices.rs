//! What else on the tractor speaks: GNSS and CAN, on the same simulated clock as the mirror.
//!
//! The mirror's task speaks for them between its turns, in the order of time, so that at any time scale everything comes at the instant
//! it states, and run after run in the same order.

use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use tokio::sync::mpsc;

use crate::clock::{SimClock, TimeScale};
use rowscan_bus::link::Heard;
use rowscan_bus::nmea::{NmeaLine, NmeaVoice};
use rowscan_bus::node::Standing;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusNews, BusWatch, CanFrame, Inbox};

/// Names of the recorded streams.
const GNSS: &str = "gnss";
const CAN: &str = "can";

/// The voices of one tractor, and where they are heard.
#[derive(Debug, Default)]
pub struct Voices {
    /// GNSS sentences, and the lines they go out on.
    pub nmea: Option<(NmeaVoice, Vec<NmeaLine>)>,
    /// The tractor's control function, its bus, and what is heard there.
    pub can: Option<(TractorEcu, Bus, Inbox)>,
    /// Where news of the bus go; nobody is waited for.
    pub news: Option<mpsc::Sender<BusNews>>,
}

/// Voices that speak; by default none.
#[derive(Debug, Default)]
pub(crate) struct Speaking {
    nmea: Option<(NmeaVoice, Vec<NmeaLine>)>,
    can: Option<Arc<Can>>,
    /// What is said as simulated time begins.
    first: Vec<CanFrame>,
    patient: bool,
    /// Records the sentences.
    tap: Tap,
}

/// The control function on its bus: the mirror's task speaks for it, a task of its own listens.
#[derive(Debug)]
pub(crate) struct Can {
    ecu: Mutex<TractorEcu>,
    bus: Bus,
    tap: Tap,
    news: Option<mpsc::Sender<BusNews>>,
}

impl Can {
    fn tell(&self, tell: impl FnOnce(&mut TractorEcu, &mut Vec<CanFrame>)) -> Vec<CanFrame> {
        let mut frames = Vec::new();
        tell(&mut self.ecu.lock().unwrap_or_else(PoisonError::into_inner), &mut frames);
        frames
    }

    fn standing(&self) -> Standing {
        self.ecu.lock().unwrap_or_else(PoisonError::into_inner).standing()
    }

    async fn send(&self, at: SimTime, frames: Vec<CanFrame>, patient: bool) {
        for frame in frames {
            self.tap.record(Side::Device, frame.to_text().as_bytes());
            self.bus.send((at, frame), None, patient).await;
        }
    }
}

impl Voices {
    /// Ready to speak, with copies to `taps`; what listens at the bus besides.
    pub(crate) fn start(self, scale: TimeScale, taps: &Taps) -> (Speaking, Option<(Arc<Can>, Inbox)>) {
        let patient = scale == TimeScale::Max;
        let mut first = Vec::new();
        let (can, listening) = match self.can {
            Some((mut ecu, bus, inbox)) => {
                if bus.is_open_from_the_start() {
                    ecu.open(SimTime::ZERO, &mut first);
                }
                let tap = taps.open(CAN, StreamKind::Can);
                let can = Arc::new(Can { ecu: Mutex::new(ecu), bus, tap, news: self.news });
                (Some(Arc::clone(&can)), Some((can, inbox)))
            }
            None => (None, None),
        };
        let tap = match self.nmea {
            Some(_) => taps.open(GNSS, StreamKind::Nmea),
            None => Tap::default(),
        };
        (Speaking { nmea: self.nmea, can, first, patient, tap }, listening)
    }
}

impl Speaking {
    /// When something is due next.
    pub(crate) fn next(&self) -> Option<SimTime> {
        if !self.first.is_empty() {
            return Some(SimTime::ZERO);
        }
        let nmea = self.nmea.as_ref().map(|(voice, _)| voice.next());
        let ecu = |can: &Arc<Can>| can.ecu.lock().unwrap_or_else(PoisonError::into_inner).next();
        nmea.into_iter().chain(self.can.as_ref().and_then(ecu)).min()
    }

    /// Says everything due at `at`: CAN, then GNSS.
    pub(crate) async fn speak(&mut self, at: SimTime) {
        if let Some(can) = &self.can {
            let mut frames = std::mem::take(&mut self.first);
            frames.extend(can.tell(|ecu, out| ecu.poll(at, out)));
            can.send(at, frames, self.patient).await;
        }
        if let Some((voice, lines)) = &mut self.nmea {
            while voice.next() <= at {
                let epoch = Bytes::from(voice.speak());
                self.tap.record(Side::Device, &epoch);
                for line in lines.iter() {
                    line.send(epoch.clone(), self.patient).await;
                }
            }
        }
    }
}

/// Hears what the ports say, for as long as the bus is open.
pub(crate) async fn listen(clock: Arc<SimClock>, can: Arc<Can>, mut inbox: Inbox) {
    let patient = clock.scale() == TimeScale::Max;
    let mut watch = BusWatch::default();
    while let Some((port, heard)) = inbox.recv().await {
        let at = clock.now();
        let replies = match heard {
            Heard::Opened => can.tell(|ecu, out| ecu.open(at, out)),
            Heard::Frame(frame) => {
                can.tap.record(Side::Host, frame.to_text().as_bytes());
                can.bus.send((at, frame), Some(port), patient).await;
                can.tell(|ecu, out| ecu.handle(at, &frame, out))
            }
            Heard::Lost(_) => Vec::new(),
        };
        if let (Some(news), Some(told)) = (watch.news(port, heard, can.standing()), &can.news) {
            let _ = told.try_send(news);
        }
        can.send(at, replies, patient).await;
    }
}
