//! What a recorded stream becomes: a scanner at its places, lines of a receiver, ports of a bus.

use std::sync::Arc;

use rowscan_protocol::device::{Device, Profile};
use rowscan_protocol::lms2xx::device::Options;
use rowscan_protocol::model::{AnyModel, MODELS};
use rowscan_recording::{StreamKind, Taps};

use super::super::client_limits;
use super::super::endpoint::{self, announce_stream};
use super::super::events::End;
use super::super::faulting::Faulting;
use super::super::output::say;
use super::super::tractor_outputs::{open_bus, open_nmea};
use super::super::web::{GaugeOf, gauge_of};
use super::super::{Failure, Format};
use super::Args;
use super::seats::{Place, Seat, Sort};
use rowscan_bus::BusAddress;
use rowscan_emulator::clock::SimClock;
use rowscan_emulator::replay::{
    Part, ReplayError, Survey, device_of, lms2xx_device_of, lms2xx_model_of, model_of,
};
use rowscan_emulator::{
    Bound, Counting, Emulator, EmulatorConfig, Outlet, RefusedSetting, SerialConfig, SerialEmulator,
    faulty_wire, pause_slack,
};
use rowscan_faults::{Language, Medium, StreamFaults};
use rowscan_ports::{NetLine, Pty, Wire};
use rowscan_web::ScannerGauge;

/// What every stream is opened with.
pub(super) struct Stand<'a> {
    pub(super) args: &'a Args,
    pub(super) survey: &'a Survey,
    pub(super) asked: Option<AnyModel>,
    pub(super) clock: Arc<SimClock>,
    pub(super) taps: Taps,
    pub(super) faulting: Option<&'a Faulting>,
}

/// What stands at a stream's places.
pub(super) enum Live {
    Cola(Emulator),
    Lms2xx(SerialEmulator),
    /// Lines and buses, which the player has.
    Beside,
}

impl Live {
    /// What it has done, in words.
    pub(super) fn told(&self, played: u64) -> String {
        match self {
            Self::Cola(emulator) => {
                let counts = emulator.counts();
                format!(
                    "{} telegrams sent, {} dropped for slow clients; {}",
                    counts.scans_sent,
                    counts.scans_dropped,
                    client_limits::told(&counts)
                )
            }
            Self::Lms2xx(emulator) => {
                let counts = emulator.counts();
                format!("{} telegrams sent, {} bytes not taken", counts.scans_sent, counts.bytes_lost)
            }
            Self::Beside => format!("{played} packets sent"),
        }
    }

    /// Tells what it has done at any time; none of lines and buses.
    pub(super) fn counts(&self) -> Option<Counting> {
        match self {
            Self::Cola(emulator) => Some(emulator.into()),
            Self::Lms2xx(emulator) => Some(emulator.into()),
            Self::Beside => None,
        }
    }

    /// The same for the page.
    pub(super) fn gauge(&self) -> GaugeOf {
        match self {
            Self::Cola(emulator) => gauge_of(emulator.into()),
            Self::Lms2xx(emulator) => gauge_of(emulator.into()),
            Self::Beside => Box::new(ScannerGauge::default),
        }
    }

    /// The same of its clients for scripts.
    pub(super) fn announce(&self, format: Format, stream: Option<&str>) -> Result<(), Failure> {
        match self {
            Self::Cola(emulator) => End::cola(stream, &emulator.counts()).tell(format),
            Self::Lms2xx(emulator) => End::lms2xx(stream, emulator.counts()).tell(format),
            Self::Beside => Ok(()),
        }
    }

    /// Settings that clients wanted and the recording does not allow.
    pub(super) fn refused_settings(&self) -> Vec<RefusedSetting> {
        match self {
            Self::Cola(emulator) => emulator.refused_settings(),
            Self::Lms2xx(_) | Self::Beside => Vec::new(),
        }
    }
}

impl Stand<'_> {
    /// Opens the one line of an LMS2xx.
    async fn open_lms2xx(&self, seat: &Seat<'_>, stream: Option<&str>) -> Result<(Live, Outlet), Failure> {
        let (args, part) = (self.args, seat.part);
        let asked = match self.asked {
            Some(AnyModel::Lms2xx(model)) => Some(model),
            Some(AnyModel::Cola(model)) => return Err(other_language(part, model.title)),
            None => None,
        };
        let model = lms2xx_model_of(self.survey, part, asked)?;
        let one_line = || {
            Failure::Usage(format!(
                "{} has one serial line: give `{}` one of --pty LINK, or --tcp ADDR for its bare bytes",
                model.title, part.name
            ))
        };
        let mut untaken = Vec::new();
        let wire: Box<dyn Wire> = match seat.places.as_slice() {
            [Place::Pty(link)] => {
                let pty = Pty::open(link)?;
                announce_stream(args.format, stream, "pty", endpoint::Place::Path(pty.path()))?;
                untaken.push(pty.untaken()?);
                Box::new(pty)
            }
            [Place::Tcp(address)] => {
                let line = NetLine::bare(address).await?;
                announce_stream(args.format, stream, "tcp", endpoint::Place::Address(&line.address()))?;
                Box::new(line)
            }
            _ => return Err(one_line()),
        };
        let options =
            Options { pause_slack: pause_slack(Profile::Field, args.time_scale), ..Options::default() };
        let device = lms2xx_device_of(part, model, options);
        let mut config = SerialConfig { taps: self.taps.clone(), ..SerialConfig::at(args.time_scale) };
        let wire = match self.faults(seat) {
            Some(faults) => faulty_wire(
                wire,
                &faults,
                std::mem::take(&mut config.taps).open(&part.name, StreamKind::Lms2xx),
            ),
            None => wire,
        };
        let emulator = SerialEmulator::replay(device, &part.name, wire, Arc::clone(&self.clock), config);
        let outlet = Outlet::lms2xx(&emulator).ok_or_else(one_line)?;
        Ok((Live::Lms2xx(emulator), outlet.read_by(untaken)))
    }

    /// A stream's part of the faults, if there are any.
    fn faults(&self, seat: &Seat<'_>) -> Option<StreamFaults> {
        let is_net = seat.places.iter().any(|place| matches!(place, Place::Tcp(_)));
        let (medium, language) = match seat.part.kind {
            // Its bare bytes over TCP are a wire all the same.
            StreamKind::Lms2xx => (Medium::Wire, Language::Lms2xx),
            _ if is_net => (Medium::Tcp, Language::Cola),
            _ => (Medium::Wire, Language::Cola),
        };
        Some(self.faulting?.control().stream(&seat.part.name, medium, language))
    }

    /// Opens a stream's places; `named`: which stream is at which place must be told.
    pub(super) async fn open(&self, seat: &Seat<'_>, named: bool) -> Result<(Live, Outlet), Failure> {
        let (args, part) = (self.args, seat.part);
        let stream = named.then_some(part.name.as_str());
        match seat.sort {
            Sort::Line if part.kind == StreamKind::Lms2xx && !args.verbatim => {
                self.open_lms2xx(seat, stream).await
            }
            Sort::Line => {
                let device = device(args, self.survey, part, self.asked)?;
                let config = args.clients.of(EmulatorConfig {
                    time_scale: args.time_scale,
                    taps: self.taps.clone(),
                    faults: self.faults(seat),
                    ..EmulatorConfig::default()
                });
                let mut emulator =
                    Emulator::replay(device, part, args.verbatim, Arc::clone(&self.clock), config);
                let mut untaken = Vec::new();
                for place in &seat.places {
                    match place {
                        Place::Tcp(address) => {
                            let Bound { address } = emulator.listen(address).await?;
                            announce_stream(args.format, stream, "tcp", endpoint::Place::Address(&address))?;
                        }
                        Place::Pty(link) => {
                            let pty = Pty::open(link)?;
                            announce_stream(args.format, stream, "pty", endpoint::Place::Path(pty.path()))?;
                            untaken.push(pty.untaken()?);
                            emulator.attach(pty);
                        }
                        Place::Nmea(_) | Place::Can(_) => {}
                    }
                }
                let outlet = Outlet::scanner(&emulator, part.scans > 0);
                Ok((Live::Cola(emulator), outlet.read_by(untaken)))
            }
            Sort::Nmea => {
                let mut lines = Vec::new();
                for place in &seat.places {
                    if let Place::Nmea(address) = place {
                        // Whether the line is quick enough was the recorded receiver's concern.
                        lines.push(open_nmea(address, 0.0, stream, args.format).await?);
                    }
                }
                Ok((Live::Beside, Outlet::nmea(&part.name, lines, args.time_scale, &self.taps)))
            }
            Sort::Can => {
                let port = |place: &Place<'_>| match place {
                    Place::Can(address) => Some((*address).clone()),
                    _ => None,
                };
                let ports: Vec<BusAddress> = seat.places.iter().filter_map(port).collect();
                let bus = open_bus(&ports, stream, args.format).await?;
                Ok((Live::Beside, Outlet::can(&part.name, bus, args.time_scale, &self.taps)))
            }
        }
    }
}

/// The device that answers what the recording does not.
fn device(args: &Args, survey: &Survey, part: &Part, asked: Option<AnyModel>) -> Result<Device, Failure> {
    let asked = match asked {
        Some(AnyModel::Cola(model)) => Some(model),
        Some(AnyModel::Lms2xx(model)) => return Err(other_language(part, model.title)),
        None => None,
    };
    // Nobody is answered.
    let silent = part.is_verbatim(args.verbatim);
    let model = match (model_of(survey, part, asked), MODELS.first()) {
        (Err(ReplayError::UnknownModel { .. }), Some(any)) if silent => *any,
        (found, _) => found?,
    };
    if !silent && part.ident.is_none() && asked.is_none() && survey.about.model.is_none() {
        say(format_args!(
            "{}: by its beams and answers taken for the model {}; --model says otherwise",
            part.name, model.title
        ));
    }
    Ok(device_of(part, model))
}

fn other_language(part: &Part, title: &str) -> Failure {
    Failure::Usage(format!(
        "stream `{}` is {}, which {title} does not speak; `rowscan models` lists who does",
        part.name, part.kind
    ))
}
