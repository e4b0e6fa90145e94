//! The flags of serial lines, and the virtual LMS2xx that speaks on one.

use std::path::PathBuf;

use rowscan_protocol::lms2xx::device::Options;
use rowscan_protocol::lms2xx::firmware::Firmware;
use rowscan_protocol::lms2xx::{Rate, model::Model};

use super::device::DeviceArgs;
use super::endpoint::{Place, announce};
use super::{Failure, Format};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::pause_slack;
use rowscan_ports::{NetLine, Port, Pty, Untaken, Wire};

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Serial line")]
pub(super) struct LineArgs {
    /// Be a serial port of this name: a link to a pseudo-terminal, removed at the end
    #[arg(long, value_name = "LINK")]
    pub(super) pty: Option<PathBuf>,
    /// Be at the other end of this serial port
    #[arg(long, value_name = "DEV")]
    serial: Option<PathBuf>,
    /// Be a serial port over TCP (RFC 2217) at this address
    #[arg(long, value_name = "ADDR")]
    rfc2217: Option<String>,
    /// Rate the scanner was left at, bits a second [default: 9600; CoLa on a real port: 57600]
    #[arg(long, value_name = "RATE")]
    rate: Option<u32>,
    /// LMS2xx: an older or other firmware, V02.10, V02.30 or X01.27, in place of the model's own
    #[arg(long, value_name = "VERSION")]
    firmware: Option<Firmware>,
}

/// A line that was opened, and where clients find it.
pub(super) struct Opened {
    pub(super) wire: Box<dyn Wire>,
    /// The source that reads it, where there is one to name.
    pub(super) source: Option<String>,
    /// What its client has not read yet, where the system throws that away with the line.
    pub(super) untaken: Option<Untaken>,
}

impl LineArgs {
    /// How many lines are asked for.
    pub(super) fn count(&self) -> usize {
        usize::from(self.pty.is_some())
            + usize::from(self.serial.is_some())
            + usize::from(self.rfc2217.is_some())
    }

    /// Opens the lines asked for, real ports at `rate` unless the flags say otherwise, and announces them.
    pub(super) async fn open(&self, format: Format, rate: u32) -> Result<Vec<Opened>, Failure> {
        let mut lines = Vec::new();
        if let Some(link) = &self.pty {
            let pty = Pty::open(link)?;
            announce(format, "pty", Place::Path(pty.path()))?;
            let source = Some(format!("serial:{}", pty.path().display()));
            let untaken = Some(pty.untaken()?);
            lines.push(Opened { wire: Box::new(pty), source, untaken });
        }
        if let Some(path) = &self.serial {
            let port = Port::open(path, self.rate.unwrap_or(rate))?;
            announce(format, "serial", Place::Path(path))?;
            lines.push(Opened { wire: Box::new(port), source: None, untaken: None });
        }
        if let Some(address) = &self.rfc2217 {
            let line = NetLine::rfc2217(address).await?;
            announce(format, "rfc2217", Place::Address(&line.address()))?;
            let source = Some(format!("rfc2217://{}", line.address()));
            lines.push(Opened { wire: Box::new(line), source, untaken: None });
        }
        Ok(lines)
    }

    /// Opens the one line of an LMS2xx: of these flags, or bare bytes over TCP.
    pub(super) async fn open_one(
        &self,
        tcp: &[String],
        rate: u32,
        format: Format,
    ) -> Result<Opened, Failure> {
        if let (0, Some(address)) = (self.count(), tcp.first()) {
            let line = NetLine::bare(address).await?;
            announce(format, "tcp", Place::Address(&line.address()))?;
            return Ok(Opened { wire: Box::new(line), source: None, untaken: None });
        }
        let line = self.open(format, rate).await?.pop();
        line.ok_or_else(|| Failure::Usage("no serial line is asked for".to_owned()))
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

    /// The rate an LMS2xx was left at.
    fn stored_rate(&self) -> Result<Rate, Failure> {
        let Some(rate) = self.rate else { return Ok(Rate::default()) };
        Rate::of(rate).ok_or_else(|| {
            Failure::Usage(format!("--rate {rate}: an LMS2xx has the rates 9600, 19200, 38400 and 500000"))
        })
    }
}

pub(super) fn options(device: &DeviceArgs, line: &LineArgs, scale: TimeScale) -> Result<Options, Failure> {
    let profile = device.profile();
    let pause_slack = pause_slack(profile, scale);
    let (boot, save) = device.times();
    let (start, stored_rate) = (device.lms2xx_start()?, line.stored_rate()?);
    let (firmware, contamination) = (line.firmware, device.contamination());
    Ok(Options { profile, start, stored_rate, pause_slack, firmware, boot, save, contamination })
}
