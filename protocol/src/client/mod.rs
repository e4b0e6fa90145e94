//! The host's side, without I/O.

use alloc::string::String;
use alloc::vec::Vec;
use core::time::Duration;

use crate::frame::{Dialect, FrameCounts};
use crate::model::ScanMode;
use crate::scan::Scan;
use crate::telegram::SopasError;

/// User level and password.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Login {
    /// 2 maintenance, 3 authorised client, 4 service.
    pub level: u8,
    /// Password hash.
    pub password: u32,
}

impl Login {
    /// Authorised client of an LMS1xx or LMS5xx.
    pub const CLIENT: Self = Self { level: 3, password: 0xF472_4744 };
}

/// How a scanner is to be set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientConfig {
    /// Who logs in.
    pub login: Login,
    /// Scan mode; as the device has it where absent.
    pub scan_mode: Option<ScanMode>,
    /// First and last angle, 1/10000°; as the device has it where absent.
    pub output_range: Option<(i32, i32)>,
    /// Ask for remission.
    pub remission: bool,
    /// How long a reply may take.
    pub reply_timeout: Duration,
    /// Largest payload taken.
    pub max_payload: usize,
}

impl Default for ClientConfig {
    fn default() -> Self {
        Self {
            login: Login::CLIENT,
            scan_mode: None,
            output_range: None,
            remission: false,
            reply_timeout: Duration::from_secs(2),
            max_payload: 64 * 1024,
        }
    }
}

/// What a device says of itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeviceInfo {
    /// DeviceIdent, name and version.
    pub ident: String,
    /// FirmwareVersion.
    pub firmware: String,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// The device is set up and sends scans.
    Ready(DeviceInfo),
    /// A scan came; see [`Client::scan`].
    Scan,
    /// The device refused a command.
    Refused {
        /// The command's name.
        command: &'static str,
        /// Its reason.
        error: SopasError,
        /// The start-up cannot go on without it: the client is done.
        fatal: bool,
    },
    /// No answer in time: wrong dialect, or nobody there. The client is done; try the other dialect over a new connection.
    NoAnswer {
        /// The command's name.
        command: &'static str,
        /// The dialect tried.
        dialect: Dialect,
    },
    /// A scan telegram that passed the checksum and made no sense.
    Malformed {
        /// Why.
        reason: String,
    },
    /// The clean stop is done.
    Stopped,
}

/// One connection to a scanner, or a tapped line.
#[derive(Clone, Debug)]
pub struct Client {
    scan: Scan,
}

impl Client {
    /// A client that sets the scanner up and streams.
    pub fn new(config: ClientConfig, dialect: Dialect) -> Self {
        let _ = (config, dialect);
        Self { scan: Scan::default() }
    }

    /// A client that only listens.
    pub fn listen(max_payload: usize) -> Self {
        let _ = max_payload;
        Self { scan: Scan::default() }
    }

    /// Takes received bytes.
    pub fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        let _ = (now, bytes);
    }

    /// The stream has ended (a recording's last byte).
    pub fn handle_end(&mut self) {}

    /// Time has come to `now`.
    pub fn handle_timeout(&mut self, now: Duration) {
        let _ = now;
    }

    /// When `handle_timeout` wants to be called.
    pub fn poll_timeout(&self) -> Option<Duration> {
        None
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Vec<u8>> {
        None
    }

    /// The next event.
    pub fn poll_event(&mut self) -> Option<Event> {
        None
    }

    /// Begins a clean stop.
    pub fn stop(&mut self, now: Duration) {
        let _ = now;
    }

    /// The last scan.
    pub fn scan(&self) -> &Scan {
        &self.scan
    }

    /// What was received.
    pub fn counts(&self) -> FrameCounts {
        FrameCounts::default()
    }
}
