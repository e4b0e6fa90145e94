//! What each scanner of the rig becomes: a device on its endpoints.

use rowscan_emulator::stage::Stage;
use rowscan_emulator::{
    Bound, Emulator, EmulatorConfig, LineWatch, Rig, ScannerView, SerialConfig, faulty_wire,
};
use rowscan_ports::Untaken;
use rowscan_protocol::device::Device;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_recording::{StreamKind, Taps};
use rowscan_vehicle::Tractor;

use super::super::Failure;
use super::super::endpoint::{DEFAULT_PORTS, Place, announce_stream};
use super::super::faulting::Faulting;
use super::super::line::{self, Opened};
use super::Args;
use super::fitted::Fitted;
use super::running::Running;

/// How far apart the ports of several scanners are.
const PORTS_APART: u16 = 10;

/// Rate of a CoLa scanner's serial line out of the box, bits a second.
const COLA_RATE: u32 = 57_600;

/// What every scanner is opened with.
pub(super) struct Stand<'a> {
    pub(super) args: &'a Args,
    pub(super) stage: &'a Stage,
    pub(super) tractor: &'a Tractor,
    pub(super) fitted: &'a [Fitted],
    pub(super) taps: Taps,
    pub(super) faulting: Option<&'a Faulting>,
    /// Where each one's lines can be watched; none if nobody watches.
    pub(super) lines: &'a [LineWatch],
}

/// A scanner that was opened.
pub(super) struct Standing {
    pub(super) running: Running,
    /// The source that reads it, where there is one to name.
    pub(super) source: Option<String>,
    /// What the client of its pseudo-terminal has not read yet.
    pub(super) untaken: Option<Untaken>,
}

impl Stand<'_> {
    /// Opens the scanner at this place of those asked for.
    pub(super) async fn open(
        &self,
        place: usize,
        scanner: &Fitted,
        rig: &mut Rig,
    ) -> Result<Standing, Failure> {
        match scanner.model {
            AnyModel::Cola(model) => {
                let addresses = self.addresses(place);
                let (device, view, mut config) = self.cola(scanner, model)?;
                config.faults = scanner.faults(self.faulting, addresses.is_empty());
                config.lines = self.lines.get(place).cloned();
                let mut emulator = rig.scanner(device, view, config);
                let (source, untaken) = self.listen(&mut emulator, scanner, &addresses).await?;
                Ok(Standing { running: Running::Cola(emulator), source, untaken })
            }
            AnyModel::Lms2xx(model) => {
                let lines = self.lines.get(place).cloned();
                self.lms2xx(scanner, model, lines, rig).await
            }
        }
    }

    /// A CoLa scanner as the flags have it.
    fn cola(
        &self,
        scanner: &Fitted,
        model: &'static Model,
    ) -> Result<(Device, ScannerView, EmulatorConfig), Failure> {
        let args = self.args;
        let (device, view) = self.stage.scanner_on(self.tractor, scanner.index, model)?;
        let (device, state, line_changes) =
            args.device.set_up(device, self.stage.scene.seed, scanner.index)?;
        let config = EmulatorConfig {
            taps: self.taps.clone(),
            time_scale: args.scale(),
            dialects: args.dialect.into(),
            state,
            line_changes,
            stream: scanner.stream(self.fitted.len()),
            ..EmulatorConfig::default()
        };
        Ok((device, view, args.clients.of(config)))
    }

    /// An LMS2xx as the flags have it, on its line.
    async fn lms2xx(
        &self,
        scanner: &Fitted,
        model: &'static lms2xx::model::Model,
        lines: Option<LineWatch>,
        rig: &mut Rig,
    ) -> Result<Standing, Failure> {
        let args = self.args;
        let options = line::options(&args.device, &args.line, args.scale())?;
        let (mut device, view) = self.stage.serial_scanner_on(self.tractor, scanner.index, model, options)?;
        args.device.lms2xx_fields(&mut device)?;
        let state = args.device.lms2xx_state(&mut device)?;
        let rate = device.rate().bits_per_second();
        let Opened { mut wire, source, untaken } = args.line.open_one(&args.tcp, rate, args.format).await?;
        let stream = scanner.stream(self.fitted.len());
        let mut taps = self.taps.clone();
        if let Some(faults) = scanner.faults(self.faulting, false) {
            let tap =
                std::mem::take(&mut taps).open(stream.as_deref().unwrap_or(model.name), StreamKind::Lms2xx);
            wire = faulty_wire(wire, &faults, tap);
        }
        let config = SerialConfig { time_scale: args.scale(), state, taps, stream, lines };
        let running = Running::Lms2xx(rig.lms2xx(device, view, wire, config));
        Ok(Standing { running, source, untaken })
    }

    /// Has a CoLa scanner listen where the flags say; the source that reads it, and what the client of its line has not read.
    async fn listen(
        &self,
        emulator: &mut Emulator,
        scanner: &Fitted,
        addresses: &[String],
    ) -> Result<(Option<String>, Option<Untaken>), Failure> {
        let (args, stream) = (self.args, scanner.stream(self.fitted.len()));
        let (mut source, mut untaken) = (None, None);
        for address in addresses {
            let Bound { address } = emulator.listen(address).await?;
            announce_stream(args.format, stream.as_deref(), "tcp", Place::Address(&address))?;
            source.get_or_insert_with(|| format!("tcp://{address}"));
        }
        if self.fitted.len() == 1 {
            for line in args.line.open(args.format, COLA_RATE).await? {
                emulator.attach(line.wire);
                untaken = line.untaken.or(untaken);
            }
        }
        Ok((source, untaken))
    }

    /// Where the scanner at this place of those asked for listens.
    fn addresses(&self, place: usize) -> Vec<String> {
        let (args, several) = (self.args, self.fitted.len() > 1);
        let before = self.fitted.iter().take(place).filter(|fitted| fitted.model.lms2xx().is_none()).count();
        match args.tcp.get(before) {
            Some(address) if several => vec![address.clone()],
            Some(_) => args.tcp.clone(),
            None if !several && args.line.count() > 0 => Vec::new(),
            None => {
                let further = PORTS_APART.saturating_mul(u16::try_from(before).unwrap_or(u16::MAX));
                DEFAULT_PORTS.map(|port| format!("127.0.0.1:{}", port.saturating_add(further))).to_vec()
            }
        }
    }
}
