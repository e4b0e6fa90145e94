//! CoLa over TCP.

use std::io;
use std::time::Duration;

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::frame::{Dialect, FrameCounts};
use rowscan_protocol::host::{DeviceInfo, Language, Refusal};
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::telegram::SopasError;
use tokio::net::TcpStream;

use super::{Endpoint, Opening, dial};
use crate::config::DriverConfig;
use crate::error::{DriverError, JunkBytes};

/// A scanner's TCP port. It is asked in the dialect that answered last and then in the other one, over a new connection each: some devices
/// stay silent on a connection that once spoke the wrong dialect.
#[derive(Debug)]
pub(crate) struct ColaEndpoint {
    address: String,
    config: ColaConfig,
    /// The dialect that answered last.
    dialect: Dialect,
    /// The dialect of the attempt.
    tried: Dialect,
    /// Bytes of the attempt that are no telegram.
    junk: u64,
}

impl ColaEndpoint {
    pub(crate) fn new(address: String, config: &DriverConfig) -> Self {
        let dialect = config.prefer;
        Self { address, config: config.cola.clone(), dialect, tried: dialect, junk: 0 }
    }

    fn reply_timeout(&self) -> Duration {
        self.config.reply_timeout
    }
}

impl Endpoint for ColaEndpoint {
    type Stream = TcpStream;
    type Session = ColaClient;

    fn address(&self) -> &str {
        &self.address
    }

    fn open(&self) -> Opening<TcpStream> {
        let address = self.address.clone();
        Box::pin(async move { dial::tcp(&address).await })
    }

    fn set_rate(_: &mut TcpStream, _: Rate) -> io::Result<()> {
        Ok(())
    }

    fn session(&self) -> ColaClient {
        ColaClient::new(self.config.clone(), self.tried)
    }

    fn ready(&mut self, info: &DeviceInfo) {
        if let Language::Cola(dialect) = info.language {
            self.dialect = dialect;
        }
        self.failed();
    }

    fn closed_early(&self, counts: FrameCounts) -> DriverError {
        let address = self.address.clone();
        match counts.frames {
            0 => DriverError::ClosedUnanswered { address, junk: JunkBytes(self.junk + counts.skipped_bytes) },
            _ => DriverError::Closed { address, when: "during start-up" },
        }
    }

    fn no_answer(&mut self, command: &'static str, counts: FrameCounts) -> Result<(), DriverError> {
        let (address, timeout) = (self.address.clone(), self.reply_timeout());
        if counts.frames > 0 {
            return Err(DriverError::NoAnswer { address, command, dialect: self.tried, timeout, counts });
        }
        self.junk += counts.skipped_bytes;
        if self.tried != self.dialect {
            return Err(DriverError::NoDialect { address, timeout, junk: JunkBytes(self.junk) });
        }
        self.tried = self.dialect.other();
        Ok(())
    }

    fn failed(&mut self) {
        self.tried = self.dialect;
        self.junk = 0;
    }

    fn cannot_open(&self, cause: io::Error) -> DriverError {
        DriverError::Connect { address: self.address.clone(), cause }
    }

    fn refused(&self, command: &'static str, error: Option<Refusal>) -> DriverError {
        let code = error.unwrap_or(SopasError::UnknownError.into());
        DriverError::Refused { address: self.address.clone(), command, code }
    }
}
