//! A virtual LMS2xx without a line: scan after scan in memory, as fast as it goes, through the same telegrams and the driver's own session.

use std::time::Duration;

use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::Device;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::Return;

use crate::ScannerView;
use crate::lms2xx::look;
use crate::offline::SetUpError;

/// An LMS2xx driven past a scene in memory, on a line that is as fast as a client asks for and loses nothing.
#[derive(Debug)]
pub struct OfflineLms2xx {
    device: Device,
    world: ScannerView,
    client: Lms2xxClient,
    now: SimTime,
    /// The tractor drives.
    begun: bool,
}

impl OfflineLms2xx {
    /// Sets the device up as the driver does: the same requests and replies, at standstill.
    ///
    /// # Errors
    /// The request that the device refused or left unanswered.
    pub fn set_up(device: Device, world: ScannerView, config: Lms2xxConfig) -> Result<Self, SetUpError> {
        let client = Lms2xxClient::new(config);
        let mut offline = Self { device, world, client, now: SimTime::ZERO, begun: false };
        loop {
            while offline.exchange() {}
            match offline.client.poll_event() {
                Some(HostEvent::Ready(_)) => return Ok(offline),
                Some(event) => SetUpError::of(&event).map_or(Ok(()), Err)?,
                None => offline.wait()?,
            }
        }
    }

    /// Hands requests to the device and replies to the client; false if neither had any.
    fn exchange(&mut self) -> bool {
        let mut said = false;
        while let Some(request) = self.client.poll_transmit() {
            said = true;
            if let Transmit::Frame(frame) = request {
                self.device.handle_bytes(self.now, Duration::ZERO, &frame);
            }
        }
        self.device.handle_timeout(self.now);
        while let Some(reply) = self.device.poll_transmit(self.now) {
            self.device.transmitted(self.now);
            self.client.handle_bytes(self.now.elapsed(), &reply);
            said = true;
        }
        said
    }

    /// Lets the time pass until one of the two has something to do.
    fn wait(&mut self) -> Result<(), SetUpError> {
        let client = self.client.poll_timeout().map(|due| SimTime::ZERO + due);
        let due = [client, self.device.poll_timeout()].into_iter().flatten().min();
        self.now = self.now.max(due.ok_or(SetUpError::NoAnswer { command: "the start-up" })?);
        self.client.handle_timeout(self.now.elapsed());
        Ok(())
    }

    /// The next scan; none if the device sends none, or one that cannot be read.
    pub fn scan(&mut self) -> Option<&Scan> {
        self.scan_met().map(|(scan, _)| scan)
    }

    /// The same, with what the beams of the last turn cast met: [`ScannerView::returns`].
    pub fn scan_met(&mut self) -> Option<(&Scan, &[Return])> {
        let sweep = self.device.plan(self.now)?;
        look(&mut self.device, &mut self.world, sweep, |_| ());
        if !self.begun {
            // The first scan finds the tractor at its start, and sets it going.
            self.world.tractor().begin(sweep.done());
            self.begun = true;
        }
        self.device.finish(sweep.done(), sweep);
        let telegram = self.device.poll_transmit(sweep.done())?;
        self.now = self.device.pace().end(sweep.done(), telegram.len());
        self.device.transmitted(self.now);
        self.client.handle_bytes(self.now.elapsed(), &telegram);
        let sent = self.client.poll_event() == Some(HostEvent::Scan);
        sent.then(|| (self.client.scan(), self.world.returns()))
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::lms2xx::{Rate, device::Options, model::MODELS};
    use rowscan_scenes::files::load_scene;

    use super::*;
    use crate::stage::Stage;

    #[test]
    fn a_device_is_set_up_without_a_wait_and_sends_every_scan() {
        let mut scene = load_scene("spindle", |_| {}).expect("built in");
        (scene.orchard.trees, scene.orchard.tree.iterations) = (Some(1), Some(3));
        let stage = Stage::grow(scene, &|_, _| {}).expect("it grows");
        for model in MODELS.iter().copied() {
            let (device, world) = stage.serial_scanner(0, model, Options::default()).expect("it fits");
            let config = Lms2xxConfig { rate: Rate::R500000, ..Lms2xxConfig::default() };
            let mut offline = OfflineLms2xx::set_up(device, world, config).expect("it is set up");
            // The only pause is that of the rate.
            assert!(offline.now.elapsed() < Duration::from_millis(400), "{}: {:?}", model.name, offline.now);
            let counters: Vec<u16> =
                (0..5).map(|_| offline.scan().expect("a scan").telegram_counter).collect();
            assert!(counters.is_sorted_by(|a, b| a + 1 == *b), "{}: {counters:?}", model.name);
        }
    }
}
