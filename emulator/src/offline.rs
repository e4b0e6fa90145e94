//! The same device without sockets: turn after turn in memory, as fast as it goes, through the same telegram.

use rowscan_protocol::device::Device;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::{LmdScandata, NoDistance};
use rowscan_protocol::time::SimTime;

use crate::World;
use crate::turns::Turns;

/// A device driven past a scene in memory. Its scans equal, bit for bit, those a client of the emulator receives.
#[derive(Debug)]
pub struct Offline {
    device: Device,
    world: World,
    turns: Turns,
    /// Scans have a taker from here on.
    begins: bool,
}

impl Offline {
    /// Ready for the first turn.
    pub fn new(device: Device, world: World) -> Self {
        let turns = Turns::new(SimTime::ZERO, device.mirror());
        let mut offline = Self { device, world, turns, begins: false };
        // Online, the turn at time zero has passed before anyone can have connected; the tractor still stands.
        offline.turn();
        offline
    }

    /// The next turn's telegram; `None` if the device does not measure or leaves this turn out.
    pub fn telegram(&mut self) -> Option<&LmdScandata> {
        // The first scan finds the tractor at its start, and sets it going.
        self.begins = true;
        self.turn()
    }

    fn turn(&mut self) -> Option<&LmdScandata> {
        let at = self.turns.next();
        let mirror = self.device.mirror();
        self.world.look(mirror, at);
        self.device.set_encoder_ticks(self.world.encoder_ticks(at));
        self.turns.advance(mirror);
        let telegram = self.device.measure(at, &self.world.line());
        if self.begins && telegram.is_some() {
            self.world.tractor().begin(at);
        }
        telegram
    }

    /// The next turn's scan, into `scan`; false if there is none this turn.
    pub fn scan_into(&mut self, scan: &mut Scan) -> Result<bool, NoDistance> {
        match self.telegram() {
            Some(telegram) => telegram.to_scan_into(scan).map(|()| true),
            None => Ok(false),
        }
    }
}
