//! The flags of serial lines, and the virtual LMS2xx that speaks on one.

use std::path::PathBuf;

use rowscan_bench::{DeviceSpec, Endpoint};
use rowscan_protocol::lms2xx::{Rate, model::Model};

use super::Failure;

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Serial line")]
pub(super) struct LineArgs {
    /// Be a serial port of this name: a link to a pseudo-terminal, removed at the end
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Be at the other end of this serial port
    #[arg(long, value_name = "DEV")]
    serial: Option<PathBuf>,
    /// Be a serial port over TCP (RFC 2217) at this address
    #[arg(long, value_name = "ADDR")]
    rfc2217: Option<String>,
    /// Rate the scanner was left at, bits a second [default: 9600; CoLa on a real port: 57600]
    #[arg(long, value_name = "RATE")]
    rate: Option<u32>,
}

impl LineArgs {
    /// How many lines are asked for.
    pub(super) fn count(&self) -> usize {
        self.endpoints().count()
    }

    /// The lines that are asked for.
    pub(super) fn endpoints(&self) -> impl Iterator<Item = Endpoint> + '_ {
        let pty = self.pty.clone().map(Endpoint::Pty);
        let serial = self.serial.clone().map(|path| Endpoint::Serial(path, self.rate));
        let rfc2217 = self.rfc2217.clone().map(Endpoint::Rfc2217);
        pty.into_iter().chain(serial).chain(rfc2217)
    }

    /// Refuses what is not one line for one LMS2xx.
    pub(super) fn check(&self, model: &Model, tcp: &[String]) -> Result<(), Failure> {
        if self.count() + tcp.len() == 1 {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "{} has one serial line: give one of --pty LINK, --serial DEV, --rfc2217 ADDR, or --tcp ADDR for its bare bytes",
            model.title
        )))
    }

    /// An LMS2xx on such a line.
    pub(super) fn over(&self, device: DeviceSpec) -> Result<DeviceSpec, Failure> {
        let rate = match self.rate {
            None => Rate::default(),
            Some(rate) => Rate::of(rate).ok_or_else(|| {
                Failure::Usage(format!(
                    "--rate {rate}: an LMS2xx has the rates 9600, 19200, 38400 and 500000"
                ))
            })?,
        };
        Ok(DeviceSpec { rate, ..device })
    }
}
