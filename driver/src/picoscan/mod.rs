//! A scanner that is set up over REST and sends its scans as Compact telegrams over UDP.
//!
//! [`PicoStream`] carries both: what it reads is a [`piece`] a read, and what is written is a whole request. [`PicoSession`] is the conversation, without I/O.

mod http;
mod piece;
mod session;
mod step;
mod stream;

use std::io;
use std::net::SocketAddrV4;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rowscan_protocol::frame::FrameCounts;
use rowscan_protocol::host::{DeviceInfo, Refusal};
use rowscan_protocol::lms2xx::Rate;
use rowscan_recording::Tap;

use self::session::{DATAGRAMS, LOGIN, PAUSES, PicoSession};
use self::stream::{PicoStream, UdpError};
use crate::config::DriverConfig;
use crate::endpoint::{Endpoint, Opening};
use crate::error::DriverError;
use crate::picoscan_address::PicoscanAddress;

/// Such a scanner as an endpoint.
#[derive(Debug)]
pub(crate) struct PicoEndpoint {
    place: PicoscanAddress,
    config: DriverConfig,
    /// Where datagrams shall come to, once a stream is open.
    bound: Arc<Mutex<Option<SocketAddrV4>>>,
}

impl PicoEndpoint {
    pub(crate) fn new(place: PicoscanAddress, config: &DriverConfig) -> Self {
        Self { place, config: config.clone(), bound: Arc::default() }
    }

    fn bound(&self) -> Option<SocketAddrV4> {
        *self.bound.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn reply_timeout(&self) -> Duration {
        self.config.cola.reply_timeout
    }
}

impl Endpoint for PicoEndpoint {
    type Stream = PicoStream;
    type Session = PicoSession;

    fn address(&self) -> &str {
        &self.place.address
    }

    fn open(&self) -> Opening<PicoStream> {
        let (place, bound, tap) = (self.place.clone(), Arc::clone(&self.bound), self.config.tap.clone());
        Box::pin(async move {
            let stream = PicoStream::open(&place, tap).await?;
            *bound.lock().unwrap_or_else(PoisonError::into_inner) = Some(stream.destination());
            Ok(stream)
        })
    }

    fn set_rate(_: &mut PicoStream, _: Rate) -> io::Result<()> {
        Ok(())
    }

    fn session(&self) -> PicoSession {
        PicoSession::new(&self.place, self.bound(), &self.config)
    }

    /// Datagrams are recorded where they come in: REST is no part of a stream of Compact telegrams.
    fn tap(&self, _: &Tap) -> Tap {
        Tap::default()
    }

    fn ready(&mut self, _: &DeviceInfo) {}

    fn no_answer(&mut self, command: &'static str, _: FrameCounts) -> Result<(), DriverError> {
        let address = self.place.address.clone();
        Err(match (command, self.bound()) {
            (DATAGRAMS, Some(to)) => {
                DriverError::NoDatagrams { address, to, timeout: self.config.first_datagram_timeout }
            }
            _ => DriverError::NoRest { address, name: command, timeout: self.reply_timeout() },
        })
    }

    fn failed(&mut self) {}

    fn cannot_open(&self, cause: io::Error) -> DriverError {
        match cause.downcast::<UdpError>() {
            Ok(UdpError { at, cause }) => DriverError::Udp { at, cause },
            Err(cause) => DriverError::ConnectRest { address: self.place.address.clone(), cause },
        }
    }

    fn refused(&self, command: &'static str, error: Option<Refusal>) -> DriverError {
        let (address, code) = (self.place.address.clone(), error.unwrap_or(NOTHING));
        match (command, code) {
            (_, Refusal::TooMany { .. }) => {
                DriverError::TooManyRequests { address, code, waited: PAUSES.iter().sum() }
            }
            (_, Refusal::StaleNonce { .. }) => DriverError::StaleNonce { address, code },
            (name, Refusal::NotJson { is_html, http }) => {
                DriverError::NotRest { address, name, found: if is_html { "HTML" } else { "no JSON" }, http }
            }
            (LOGIN, _) => DriverError::Login { address, user: self.place.user.clone(), code },
            _ => DriverError::Refused { address, command, code },
        }
    }
}

/// A refusal that says nothing.
const NOTHING: Refusal = Refusal::Rest { status: None, http: 0 };
