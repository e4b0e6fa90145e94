//! An LMS2xx on a serial port, of this machine or over TCP.

use std::io;

use rowscan_protocol::frame::FrameCounts;
use rowscan_protocol::host::{DeviceInfo, Language, Refusal};
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};

use super::port::{Place, Port};
use super::{Endpoint, Opening};
use crate::error::{DriverError, JunkBytes};

/// A serial port with an LMS2xx on it.
#[derive(Debug)]
pub(crate) struct Lms2xxEndpoint {
    place: Place,
    /// The place as the user named it.
    address: String,
    config: Lms2xxConfig,
}

impl Lms2xxEndpoint {
    /// An LMS2xx at `place`, to stream at the configuration's rate.
    pub(crate) fn new(place: Place, address: String, config: Lms2xxConfig) -> Self {
        Self { place, address, config }
    }
}

impl Endpoint for Lms2xxEndpoint {
    type Stream = Port;
    type Session = Lms2xxClient;

    fn address(&self) -> &str {
        &self.address
    }

    fn open(&self) -> Opening<Port> {
        let place = self.place.clone();
        Box::pin(async move { Port::open(&place).await })
    }

    fn set_rate(port: &mut Port, rate: Rate) -> io::Result<()> {
        port.set_rate(rate)
    }

    fn session(&self) -> Lms2xxClient {
        Lms2xxClient::new(self.config.clone())
    }

    fn ready(&mut self, info: &DeviceInfo) {
        if let Language::Lms2xx(rate) = info.language {
            self.config.known = Some(rate);
        }
    }

    fn no_answer(&mut self, what: &'static str, counts: FrameCounts) -> Result<(), DriverError> {
        let junk = JunkBytes(counts.skipped_bytes);
        Err(DriverError::NoLms2xx { place: self.address.clone(), what, junk })
    }

    fn failed(&mut self) {}

    fn cannot_open(&self, cause: io::Error) -> DriverError {
        DriverError::Port { place: self.address.clone(), cause }
    }

    fn refused(&self, what: &'static str, _: Option<Refusal>) -> DriverError {
        DriverError::Declined { place: self.address.clone(), what }
    }
}
