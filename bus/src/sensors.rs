//! Canopy sensors on a bus that they share, each a control function of its own: one a scanner.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_canopy::Pipeline;
use rowscan_ports::Delivery;
use rowscan_protocol::time::SimTime;
use tokio::sync::mpsc;

use super::canopy::CanopyEcu;
use super::{Bus, BusNews, BusWatch, CanFrame, Inbox};
use crate::link::PortEvent;

/// Sensors and their bus.
#[derive(Debug)]
pub struct CanopySensors {
    bus: Bus,
    speakers: Vec<Mutex<Speaker>>,
    /// What happens to frames that a port is too slow for.
    delivery: Delivery,
}

/// One sensor, and the time of its scanner.
#[derive(Debug, Default)]
struct Speaker {
    ecu: CanopyEcu,
    now: SimTime,
    /// What is to be sent; kept, so that a scan costs no memory.
    frames: Vec<CanFrame>,
}

impl CanopySensors {
    /// So many sensors on `bus`. Someone must [`listen`](Self::listen).
    pub async fn join(bus: Bus, count: usize, delivery: Delivery) -> Arc<Self> {
        let speaker = |instance: usize| {
            let ecu = CanopyEcu::new(u8::try_from(instance).unwrap_or(u8::MAX));
            Mutex::new(Speaker { ecu, ..Speaker::default() })
        };
        let sensors = Self { bus, speakers: (0..count).map(speaker).collect(), delivery };
        if sensors.bus.is_open_from_the_start() {
            for number in 0..count {
                sensors.with(number, |speaker| speaker.ecu.open(speaker.now, &mut speaker.frames)).await;
            }
        }
        Arc::new(sensors)
    }

    /// Sensor `number` has worked in a scan taken at `at`: says what is due.
    pub async fn tell(&self, number: usize, at: SimTime, pipeline: &Pipeline) {
        let told = |speaker: &mut Speaker| {
            speaker.now = at;
            speaker.ecu.tell(at, pipeline, &mut speaker.frames);
        };
        self.with(number, told).await;
    }

    /// The tractor's ground speed as sensor `number` hears it, signed, m/s, while it is told.
    pub fn ground_speed_m_s(&self, number: usize, at: SimTime) -> Option<f64> {
        self.speaker(number)?.ecu.ground_speed_m_s(at)
    }

    /// Hears what the ports say and answers, for as long as the bus is open; what has changed there goes to `news`, whom nobody waits for.
    pub async fn listen(self: Arc<Self>, mut inbox: Inbox, news: mpsc::Sender<BusNews>) {
        let mut watches = vec![BusWatch::default(); self.speakers.len()];
        while let Some((origin, heard)) = inbox.recv().await {
            if let PortEvent::Frame(frame) = heard {
                let now = self.speaker(0).map_or(SimTime::ZERO, |speaker| speaker.now);
                self.bus.send((now, frame), Some(origin), self.delivery).await;
            }
            for (number, watch) in watches.iter_mut().enumerate() {
                let hear = |speaker: &mut Speaker| {
                    match heard {
                        PortEvent::Opened => speaker.ecu.open(speaker.now, &mut speaker.frames),
                        PortEvent::Frame(frame) => {
                            speaker.ecu.handle(speaker.now, &frame, &mut speaker.frames);
                        }
                        PortEvent::Lost(_) | PortEvent::Refused(_) => {}
                    }
                    watch.news(origin.port, heard, speaker.ecu.address_state())
                };
                let told = self.with(number, hear).await.flatten();
                // That a port is gone is no other news to the second sensor.
                if let Some(told) = told.filter(|told| number == 0 || matches!(told, BusNews::AddressLost(_)))
                {
                    let _ = news.try_send(told);
                }
            }
        }
    }

    /// Waits until the ports have written everything so far. Cancel safe.
    pub async fn written(&self) {
        self.bus.written().await;
    }

    /// Waits for that, for at most `patience`; how many frames a port was too slow to take, and whether the last are out.
    pub async fn part(&self, patience: Duration) -> (u64, bool) {
        let all = rowscan_ports::clock::within(patience, self.bus.written()).await.is_some();
        (self.bus.dropped(), all)
    }

    /// Lets a sensor do something, and sends what it then says: out, and to the others.
    async fn with<T>(&self, number: usize, act: impl FnOnce(&mut Speaker) -> T) -> Option<T> {
        let (done, at, mut frames) = {
            let mut speaker = self.speaker(number)?;
            let done = act(&mut speaker);
            (done, speaker.now, std::mem::take(&mut speaker.frames))
        };
        let mut answers = Vec::new();
        for frame in frames.drain(..) {
            self.overhear(number, &frame, &mut answers);
            self.bus.send((at, frame), None, self.delivery).await;
        }
        if let Some(mut speaker) = self.speaker(number)
            && speaker.frames.is_empty()
        {
            speaker.frames = frames;
        }
        while let Some((from, at, frame)) = answers.pop() {
            self.overhear(from, &frame, &mut answers);
            self.bus.send((at, frame), None, self.delivery).await;
        }
        Some(done)
    }

    /// The other sensors of this process hear what one says, as whoever else is on the bus does.
    fn overhear(&self, from: usize, frame: &CanFrame, answers: &mut Vec<(usize, SimTime, CanFrame)>) {
        for number in (0..self.speakers.len()).filter(|number| *number != from) {
            let Some(mut speaker) = self.speaker(number) else { continue };
            let (now, mut said) = (speaker.now, Vec::new());
            speaker.ecu.handle(now, frame, &mut said);
            answers.extend(said.into_iter().map(|frame| (number, now, frame)));
        }
    }

    fn speaker(&self, number: usize) -> Option<MutexGuard<'_, Speaker>> {
        self.speakers.get(number).map(|speaker| speaker.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BusAddress;
    use crate::frame::J1939Id;
    use crate::link::candump::read_frame;
    use crate::name::Name;
    use crate::node::AddressState;
    use crate::pgn::network::ADDRESS_CLAIMED;

    const MS: u64 = 1_000_000;

    async fn sensors(count: usize) -> (tempfile::TempDir, std::path::PathBuf, Arc<CanopySensors>, Inbox) {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("bus.log");
        let (bus, inbox) = Bus::open(&[BusAddress::Candump(log.clone())], &mut |_| {}).await.unwrap();
        (folder, log, CanopySensors::join(bus, count, Delivery::Patient).await, inbox)
    }

    #[tokio::test]
    async fn each_has_a_name_and_an_address_of_its_own() {
        let (_folder, log, sensors, _inbox) = sensors(2).await;
        let pipeline = Pipeline::new(None, 0, None).unwrap();
        for ms in [300, 400] {
            for number in 0..2 {
                sensors.tell(number, SimTime(ms * MS), &pipeline).await;
            }
        }
        assert_eq!(sensors.part(Duration::from_secs(10)).await, (0, true));
        let text = std::fs::read_to_string(log).unwrap();
        let frames: Vec<CanFrame> = text.lines().map(|line| read_frame(line).unwrap().1).collect();
        let source = |frame: &CanFrame| J1939Id::of(frame.id).unwrap().source;
        for (address, instance) in [(0x80, 0), (0x81, 1)] {
            let said: Vec<_> = frames.iter().filter(|frame| source(frame) == address).collect();
            assert_eq!(J1939Id::of(said[0].id).unwrap().pgn, ADDRESS_CLAIMED.pgn);
            assert_eq!(said[0].data(), Name::canopy(instance).0.to_le_bytes());
            assert!(said.len() > 4, "{} frames of {address}", said.len());
        }
    }

    #[tokio::test]
    async fn one_that_loses_its_address_does_not_take_the_other_ones() {
        let (_folder, _log, sensors, _inbox) = sensors(2).await;
        // Somebody with a better NAME sits at the first one's address.
        let id = J1939Id { destination: 0xFF, ..ADDRESS_CLAIMED.id(0x80) }.id();
        let rival = CanFrame::new(id, &[0; 8]).unwrap();
        sensors.with(0, |speaker| speaker.ecu.handle(speaker.now, &rival, &mut speaker.frames)).await;
        let standing = |number| sensors.speaker(number).unwrap().ecu.address_state();
        let address = |standing| match standing {
            AddressState::Claiming(address, _) | AddressState::Claimed(address) => address,
            AddressState::Off | AddressState::Lost(_) => panic!("{standing:?}"),
        };
        assert_eq!((address(standing(0)), address(standing(1))), (0x82, 0x81));
    }
}
