//! The same device without sockets: turn after turn in memory, as fast as it goes, through the same telegram.

use std::time::Duration;

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::{Device, DialectPolicy, Session};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession, Refusal, Transmit};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::time::SimTime;
use rowscan_protocol::validity::ScanFault;
use rowscan_scenes::Return;

use crate::ScannerView;
use crate::turns::Turns;

/// The device did not take what a client asks of it at start-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SetUpError {
    /// It cannot do what is asked for, or not now.
    #[error(
        "the scanner refuses `{command}`{}: the rig asks for more than its model can (`rowscan models` says what each can)",
        error.map(|error| format!(" ({error})")).unwrap_or_default()
    )]
    Refused {
        /// The request.
        command: &'static str,
        /// The device's reason; an LMS2xx gives none.
        error: Option<Refusal>,
    },
    /// It stays silent.
    #[error("the scanner does not answer `{command}`")]
    NoAnswer {
        /// The request.
        command: &'static str,
    },
}

impl SetUpError {
    /// What of a client's events ends a start-up that nobody watches. A driver goes on beside a refusal that it can live with, and tells its user; here
    /// nobody would hear it, and what is measured would not be what was asked for.
    pub(crate) fn of(event: &HostEvent) -> Option<Self> {
        match *event {
            HostEvent::Refused { command, error, .. } => Some(Self::Refused { command, error }),
            HostEvent::NoAnswer { command } => Some(Self::NoAnswer { command }),
            _ => None,
        }
    }
}

/// A device driven past a scene in memory. Its scans equal, bit for bit, those a client of the emulator receives.
#[derive(Debug)]
pub struct Offline {
    device: Device,
    world: ScannerView,
    turns: Turns,
    /// Scans have a taker from here on.
    begins: bool,
}

impl Offline {
    /// Ready for the first turn.
    pub fn new(device: Device, world: ScannerView) -> Self {
        let turns = Turns::new(SimTime::ZERO, device.mirror());
        let mut offline = Self { device, world, turns, begins: false };
        // Online, the turn at time zero has passed before anyone can have connected; the tractor still stands.
        offline.turn();
        offline
    }

    /// Sets the device up as a client does: the same requests and replies, in memory and at standstill.
    ///
    /// # Errors
    /// The request that the device refused or left unanswered.
    pub fn set_up(&mut self, config: ColaConfig) -> Result<(), SetUpError> {
        let mut client = ColaClient::new(config, Dialect::B);
        let mut session = Session::new(DialectPolicy::Auto);
        let mut replies = Vec::new();
        loop {
            let mut asked = false;
            while let Some(request) = client.poll_transmit().and_then(Transmit::into_frame) {
                asked = true;
                session.handle_bytes(&mut self.device, SimTime::ZERO, &request, &mut replies);
            }
            for reply in replies.drain(..) {
                client.handle_bytes(Duration::ZERO, &reply.bytes);
            }
            match client.poll_event() {
                Some(HostEvent::Ready(_)) => return Ok(()),
                Some(event) => SetUpError::of(&event).map_or(Ok(()), Err)?,
                None if asked => {}
                // A request without a reply: no more would ever come.
                None => match client.poll_timeout() {
                    Some(due) => client.handle_timeout(due),
                    None => return Err(SetUpError::NoAnswer { command: "the start-up" }),
                },
            }
        }
    }

    /// The next turn's telegram; `None` if the device does not measure or leaves this turn out.
    pub fn telegram(&mut self) -> Option<&LmdScandata> {
        // The first scan finds the tractor at its start, and sets it going.
        self.begins = true;
        self.turn()
    }

    /// What the beams of the last turn met: [`ScannerView::returns`].
    pub fn returns(&self) -> &[Return] {
        self.world.returns()
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
    pub fn scan_into(&mut self, scan: &mut Scan) -> Result<bool, ScanFault> {
        match self.telegram() {
            Some(telegram) => telegram.to_scan_into(scan).map(|()| true),
            None => Ok(false),
        }
    }
}
