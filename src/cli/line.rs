//! The flags of serial lines, and the virtual LMS2xx that speaks on one.

use std::path::PathBuf;
use std::time::Duration;

use rowscan_protocol::device::Profile;
use rowscan_protocol::lms2xx::device::Options;
use rowscan_protocol::lms2xx::{Rate, model::Model};
use rowscan_recording::Taps;

use super::device::DeviceArgs;
use super::endpoint::{Place, announce};
use super::interrupt::Interrupt;
use super::output::say;
use super::voices::VoiceArgs;
use super::{Failure, Format};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{SerialConfig, SerialEmulator};
use rowscan_ports::{NetLine, Port, Pty, Wire};

/// What the host's scheduling adds to a pause inside a telegram.
const PAUSE_SLACK: Duration = Duration::from_millis(14);

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
}

/// A line that was opened, and where clients find it.
pub(super) struct Opened {
    pub(super) wire: Box<dyn Wire>,
    /// The source that reads it, where there is one to name.
    pub(super) source: Option<String>,
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
            lines.push(Opened { wire: Box::new(pty), source });
        }
        if let Some(path) = &self.serial {
            let port = Port::open(path, self.rate.unwrap_or(rate))?;
            announce(format, "serial", Place::Path(path))?;
            lines.push(Opened { wire: Box::new(port), source: None });
        }
        if let Some(address) = &self.rfc2217 {
            let line = NetLine::rfc2217(address).await?;
            announce(format, "rfc2217", Place::Address(&line.address()))?;
            let source = Some(format!("rfc2217://{}", line.address()));
            lines.push(Opened { wire: Box::new(line), source });
        }
        Ok(lines)
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

/// What the flags say of an LMS2xx, beside its line.
pub(super) struct Asked<'a> {
    pub(super) line: &'a LineArgs,
    pub(super) tcp: &'a [String],
    pub(super) device: &'a DeviceArgs,
    pub(super) voices: &'a VoiceArgs,
    pub(super) scanner: usize,
    pub(super) time_scale: TimeScale,
    pub(super) format: Format,
    pub(super) scene: &'a str,
    pub(super) taps: Taps,
}

/// Is a virtual LMS2xx until interrupted.
pub(super) async fn emulate(
    asked: Asked<'_>,
    stage: &Stage,
    model: &'static Model,
    mut interrupt: Interrupt,
) -> Result<(), Failure> {
    let options = options(asked.device, asked.line, asked.time_scale)?;
    let tractor = stage.tractor();
    let (mut device, world) = stage.serial_scanner_on(&tractor, asked.scanner, model, options)?;
    let state = asked.device.lms2xx_state(&mut device)?;
    let mut lines = asked.line.open(asked.format, device.rate().bits_per_second()).await?;
    for address in asked.tcp {
        let line = NetLine::bare(address).await?;
        announce(asked.format, "tcp", Place::Address(&line.address()))?;
        lines.push(Opened { wire: Box::new(line), source: None });
    }
    let config = SerialConfig { time_scale: asked.time_scale, state, taps: asked.taps };
    say(format_args!(
        "{} on {}, seed {}, at {} bits a second; the tractor starts with the first scan sent",
        model.title,
        asked.scene,
        stage.scene.seed,
        device.rate()
    ));
    let Some(Opened { wire, source }) = lines.pop() else { return Ok(()) };
    if let Some(source) = source {
        say(format_args!(
            "estimate with: rowscan estimate {source} --rig {} --model {}",
            asked.scene, model.name
        ));
    }
    let (voices, _telling) = asked.voices.open(stage, &tractor, asked.format).await?;
    let emulator = SerialEmulator::start_with(device, world, wire, voices, config);
    interrupt.wait().await;
    let counts = emulator.counts();
    say(format_args!("{} scans sent, {} bytes not taken", counts.scans_sent, counts.bytes_lost));
    Ok(())
}

/// How much longer than real a pause inside a telegram may be.
pub(super) fn pause_slack(scale: TimeScale) -> Duration {
    match scale {
        TimeScale::Paced(scale) => PAUSE_SLACK.mul_f64(scale.clamp(1e-3, 1e3)),
        // Time stands still between requests: any pause is no pause.
        TimeScale::Max => Duration::MAX / 4,
    }
}

fn options(device: &DeviceArgs, line: &LineArgs, scale: TimeScale) -> Result<Options, Failure> {
    let pause_slack = pause_slack(scale);
    let profile: Profile = device.profile();
    Ok(Options { profile, start: device.lms2xx_start()?, stored_rate: line.stored_rate()?, pause_slack })
}
