//! A recording in the place of the orchard: its scanners, lines and buses on endpoints, on one clock.

use std::net::{IpAddr, SocketAddrV4};
use std::sync::Arc;
use std::time::Duration;

use rowscan_bus::nmea::{NmeaAddress, NmeaLine};
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::replay::{
    Part, Playback, Playhead, ReplayError, Survey, compact_device_of, compact_model_of, device_of,
    lms2xx_device_of, lms2xx_model_of, model_of,
};
use rowscan_emulator::{
    Bound, CountReader, Emulator, EmulatorConfig, IDLE_LIMIT, MAX_CLIENTS, Outlet, Player, RefusedSetting,
    SerialConfig, SerialEmulator, VirtualScanner, pause_slack,
};
use rowscan_faults::{FaultControl, FaultEvents, Language, Medium, StreamFaults};
use rowscan_ports::{Untaken, task};
use rowscan_protocol::device::{Device, Profile};
use rowscan_protocol::lms2xx::device::Options;
use rowscan_protocol::model::{AnyModel, MODELS};
use rowscan_protocol::rig::Rig;
use rowscan_recording::{DATAGRAMS, StreamKind, Taps};
use rowscan_rest::{Rest, Server};
use tokio::task::JoinSet;

use crate::bench::{at_of, place_of};
use crate::endpoint::{At, Line};
use crate::scanner::{Asked, a_free_port};
use crate::{BenchError, Endpoint, Place};

/// A recording that is to be played.
#[derive(Debug)]
pub struct ReplaySpec<'a> {
    /// What is in it.
    pub survey: &'a Survey,
    /// The streams that are played, each with its places.
    pub streams: Vec<StreamSpec<'a>>,
    /// Who answers what was not recorded; the recorded scanner where absent.
    pub model: Option<AnyModel>,
    /// The rig that it was recorded with: which echo scans hold, it tells where the recorded conversation does not.
    pub rig: Option<Rig>,
    /// Replies go out as recorded, to whoever connects, and nobody is answered.
    pub verbatim: bool,
    /// Clients served at once by each scanner.
    pub max_clients: usize,
    /// In a full house, who is idle for longer makes room; host time.
    pub idle_limit: Duration,
    /// Where copies of all bytes go.
    pub taps: Taps,
    /// Whether faults may come.
    pub faults: bool,
    clock: Arc<SimClock>,
}

/// A stream with its places.
#[derive(Debug)]
pub struct StreamSpec<'a> {
    /// The stream.
    pub part: &'a Part,
    /// Where it goes.
    pub places: StreamPlaces,
}

/// Where a stream goes: places of one sort.
#[derive(Clone, Debug)]
pub enum StreamPlaces {
    /// Any stream's bytes; a scanner answers there.
    Lines(Vec<Endpoint>),
    /// A picoScan: datagrams, and its REST interface.
    Datagrams(DatagramPlaces),
    /// A receiver's sentences.
    Nmea(Vec<NmeaAddress>),
    /// Ports of one bus.
    Can(Vec<BusAddress>),
}

/// Where a picoScan's datagrams go, and where it is set up.
#[derive(Clone, Debug, Default)]
pub struct DatagramPlaces {
    /// Where its REST interface is; port 0 takes a free one.
    pub rest: Vec<String>,
    /// Where its datagrams go at once, as if a client had directed them there; port 0 takes a free one.
    pub udp: Option<SocketAddrV4>,
    /// Addresses besides loopback that clients may direct them to.
    pub allowed: Vec<IpAddr>,
}

impl<'a> ReplaySpec<'a> {
    /// A recording of which nothing is played yet, its time at this scale, which begins to count here.
    pub fn new(survey: &'a Survey, scale: TimeScale) -> Self {
        Self {
            survey,
            streams: Vec::new(),
            model: None,
            rig: None,
            verbatim: false,
            max_clients: MAX_CLIENTS,
            idle_limit: IDLE_LIMIT,
            taps: Taps::default(),
            faults: false,
            clock: Arc::new(SimClock::start(scale)),
        }
    }

    /// The clock that everything goes by.
    pub fn clock(&self) -> Arc<SimClock> {
        Arc::clone(&self.clock)
    }
}

/// A stream that is set up.
#[derive(Debug)]
pub struct ReplayedStream {
    /// Its name.
    pub name: String,
    /// The model that it was taken for, by its beams and answers, where nothing says which it is.
    pub taken_for: Option<&'static str>,
    scanner: Option<Box<dyn VirtualScanner>>,
    /// Its drop ends the interfaces.
    _rest: Vec<Server>,
}

impl ReplayedStream {
    /// A handle that tells what its scanner has done; none of lines and buses.
    pub fn counts(&self) -> Option<CountReader> {
        self.scanner.as_ref().map(|scanner| scanner.count_reader())
    }

    /// Settings that clients wanted and the recording does not allow.
    pub fn refused_settings(&self) -> Vec<RefusedSetting> {
        self.scanner.as_ref().map(|scanner| scanner.refused_settings()).unwrap_or_default()
    }
}

/// A recording that is set up: everything listens, and is played from [`ReplayBench::play`] on. Dropping it ends its scanners.
#[derive(Debug)]
pub struct ReplayBench {
    streams: Vec<ReplayedStream>,
    places: Vec<Place>,
    outlets: Vec<Outlet>,
    clock: Arc<SimClock>,
    faults: Option<(FaultControl, Option<FaultEvents>)>,
    _driving: JoinSet<()>,
}

impl ReplayBench {
    /// Sets up what `spec` describes; called within the runtime that it runs in.
    ///
    /// # Errors
    /// The first stream that cannot be played so.
    pub async fn open(spec: ReplaySpec<'_>) -> Result<Self, BenchError> {
        let clock = spec.clock();
        let mut driving = JoinSet::new();
        let faults = spec.faults.then(|| {
            let clock: Arc<SimClock> = Arc::clone(&clock);
            let (control, events) = FaultControl::new(spec.survey.about.seed.unwrap_or(1), clock, None);
            let driven = control.clone();
            driving.spawn(task(async move { driven.drive().await }));
            (control, Some(events))
        });
        let (mut streams, mut outlets, mut places) = (Vec::new(), Vec::new(), Vec::new());
        for stream in &spec.streams {
            let control = faults.as_ref().map(|(control, _)| control);
            let (opened, outlet) =
                Opening { spec: &spec, faults: control, places: &mut places }.open(stream).await?;
            streams.push(opened);
            outlets.push(outlet);
        }
        Ok(Self { streams, places, outlets, clock, faults, _driving: driving })
    }

    /// Plays `tape` from where `playhead` stands; its streams must be those of the description, in the same order. A second call plays nothing.
    pub fn play(&mut self, tape: Playback, playhead: Arc<Playhead>, timer: &Timer) -> Player {
        let outlets = std::mem::take(&mut self.outlets);
        Player::start(tape, outlets, playhead, Arc::clone(&self.clock), timer)
    }

    /// Its streams, in the order of the description.
    pub fn streams(&self) -> &[ReplayedStream] {
        &self.streams
    }

    /// Where everything is found.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The handle to what goes wrong; none unless faults were asked for.
    pub fn faults(&self) -> Option<&FaultControl> {
        self.faults.as_ref().map(|(control, _)| control)
    }

    /// What faults do, as they do it; handed out once.
    pub fn take_fault_events(&mut self) -> Option<FaultEvents> {
        self.faults.as_mut()?.1.take()
    }
}

/// What streams are opened with.
struct Opening<'a> {
    spec: &'a ReplaySpec<'a>,
    faults: Option<&'a FaultControl>,
    places: &'a mut Vec<Place>,
}

impl Opening<'_> {
    async fn open(&mut self, stream: &StreamSpec<'_>) -> Result<(ReplayedStream, Outlet), BenchError> {
        let (part, scale, taps) = (stream.part, self.spec.clock.scale(), &self.spec.taps);
        let beside = |outlet| (replayed(part, None, None), outlet);
        match &stream.places {
            StreamPlaces::Lines(lines) if part.kind == StreamKind::Lms2xx && !self.spec.verbatim => {
                self.lms2xx(part, lines).await
            }
            StreamPlaces::Lines(lines) => self.scanner(part, lines).await,
            StreamPlaces::Datagrams(places) => self.datagrams(part, places).await,
            StreamPlaces::Nmea(addresses) => {
                let mut lines = Vec::new();
                for address in addresses {
                    // Whether the line is quick enough was the recorded receiver's concern.
                    let line = NmeaLine::open(address, 0.0).await?;
                    self.places.push(place_of(&part.name, &line));
                    lines.push(line);
                }
                Ok(beside(Outlet::nmea(&part.name, lines, scale, taps)))
            }
            StreamPlaces::Can(ports) => {
                let places = &mut *self.places;
                let mut tell = |link: &rowscan_bus::link::Link| {
                    places.push(Place { part: part.name.clone(), kind: link.kind(), at: at_of(link) });
                };
                let bus = Bus::open(ports, &mut tell).await?;
                Ok(beside(Outlet::can(&part.name, bus, scale, taps)))
            }
        }
    }

    /// A CoLa scanner, or any stream that goes out verbatim.
    async fn scanner(
        &mut self,
        part: &Part,
        endpoints: &[Endpoint],
    ) -> Result<(ReplayedStream, Outlet), BenchError> {
        let (device, taken_for) = self.device(part)?;
        let spec = self.spec;
        let config = EmulatorConfig {
            time_scale: spec.clock.scale(),
            max_clients: spec.max_clients,
            idle_limit: spec.idle_limit,
            taps: spec.taps.clone(),
            faults: self.stream_faults(part, endpoints),
            ..EmulatorConfig::default()
        };
        let faults = config.faults.clone();
        let mut emulator = Emulator::replay(device, part, spec.verbatim, spec.clock(), config);
        let mut untaken: Vec<Untaken> = Vec::new();
        for endpoint in endpoints {
            match endpoint {
                Endpoint::Tcp(address) => {
                    let Bound { address } = emulator.listen(address).await?;
                    self.place(part, "tcp", At::Address(address));
                }
                line => {
                    let line = Line::open(line, crate::scanner::COLA_RATE).await?;
                    self.place(part, line.kind, line.at);
                    untaken.extend(line.untaken);
                    emulator.attach(line.wire);
                }
            }
        }
        let outlet = Outlet::scanner(&emulator, part.scans > 0).read_by(untaken).through(faults);
        let scanner: Option<Box<dyn VirtualScanner>> = Some(Box::new(emulator));
        Ok((replayed(part, taken_for, scanner), outlet))
    }

    /// A picoScan: its datagrams go where a client directs them, and REST answers as the model does that was set as the recorded one.
    async fn datagrams(
        &mut self,
        part: &Part,
        places: &DatagramPlaces,
    ) -> Result<(ReplayedStream, Outlet), BenchError> {
        let spec = self.spec;
        let asked = match spec.model {
            Some(AnyModel::Cola(model)) if model.compact.is_some() => Some(model),
            Some(other) => return Err(foreign(part, other.title())),
            None => None,
        };
        if spec.clock.delivery().is_patient() {
            return Err(BenchError::UnpacedDatagrams { stream: part.name.clone() });
        }
        let model = compact_model_of(spec.survey, part, asked)?;
        let mut device = compact_device_of(part, model, spec.rig.as_ref());
        let udp = places.udp.map(a_free_port).transpose()?;
        if let Some(to) = udp {
            device.direct(to);
            device.enable_streaming();
        }
        let serial_number = device.serial_number();
        let directed = udp.map(|to| IpAddr::from(*to.ip()));
        let config = EmulatorConfig {
            time_scale: spec.clock.scale(),
            taps: spec.taps.clone(),
            stream: Some(part.name.strip_suffix(DATAGRAMS).unwrap_or(&part.name).to_owned()),
            allowed_destinations: places.allowed.iter().copied().chain(directed).collect(),
            ..EmulatorConfig::default()
        };
        let emulator = Emulator::replay(device, part, true, spec.clock(), config);
        let mut servers = Vec::new();
        for address in &places.rest {
            let rest = Rest::new(spec.survey.about.seed.unwrap_or(1), serial_number);
            let server = Server::open(address, rest, Arc::new(Asked(emulator.device_handle()))).await?;
            self.place(part, "rest", At::Address(server.address()));
            servers.push(server);
        }
        if let Some(to) = udp {
            self.place(part, "udp", At::Address(to.into()));
        }
        let outlet = Outlet::datagrams(&emulator);
        let is_told = asked.is_some() || spec.survey.about.model_of(&part.name) == Some(model.name);
        let stream = replayed(part, (!is_told).then_some(model.title), Some(Box::new(emulator)));
        Ok((ReplayedStream { _rest: servers, ..stream }, outlet))
    }

    /// The device that answers what the recording does not, and the model that it was taken for where nothing says which.
    fn device(&self, part: &Part) -> Result<(Device, Option<&'static str>), BenchError> {
        let survey = self.spec.survey;
        // Nobody is answered.
        let silent = part.is_verbatim(self.spec.verbatim);
        let asked = match self.spec.model {
            Some(AnyModel::Cola(model)) => Some(model),
            Some(AnyModel::Lms2xx(model)) if !silent => return Err(foreign(part, model.title)),
            Some(AnyModel::Lms2xx(_)) | None => None,
        };
        let model = match (model_of(survey, part, asked), MODELS.first()) {
            (Err(ReplayError::UnknownModel { .. }), Some(any)) if silent => *any,
            (found, _) => found?,
        };
        let is_told =
            part.told_models().len() == 1 || asked.is_some() || survey.about.model_of(&part.name).is_some();
        let guessed = !silent && !is_told;
        Ok((device_of(part, model, self.spec.rig.as_ref()), guessed.then_some(model.title)))
    }

    /// The one line of an LMS2xx.
    async fn lms2xx(
        &mut self,
        part: &Part,
        endpoints: &[Endpoint],
    ) -> Result<(ReplayedStream, Outlet), BenchError> {
        let spec = self.spec;
        let asked = match spec.model {
            Some(AnyModel::Lms2xx(model)) => Some(model),
            Some(AnyModel::Cola(model)) => return Err(foreign(part, model.title)),
            None => None,
        };
        let model = lms2xx_model_of(spec.survey, part, asked)?;
        let not_one = || BenchError::NotOneLine { model: model.title, found: endpoints.len() };
        let [endpoint] = endpoints else { return Err(not_one()) };
        let scale = spec.clock.scale();
        let options = Options { pause_slack: pause_slack(Profile::Field, scale), ..Options::default() };
        let device = lms2xx_device_of(part, model, options);
        let line = Line::open(endpoint, device.rate().bits_per_second()).await?;
        self.place(part, line.kind, line.at);
        let config = SerialConfig {
            taps: spec.taps.clone(),
            faults: self.stream_faults(part, endpoints),
            ..SerialConfig::at(scale)
        };
        let faults = config.faults.clone();
        let emulator = SerialEmulator::replay(device, &part.name, line.wire, spec.clock(), config);
        let outlet = Outlet::lms2xx(&emulator, part).ok_or_else(not_one)?;
        let outlet = outlet.read_by(Vec::from_iter(line.untaken)).through(faults);
        let scanner: Option<Box<dyn VirtualScanner>> = Some(Box::new(emulator));
        Ok((replayed(part, None, scanner), outlet))
    }

    /// A stream's part of the faults, if faults may come.
    fn stream_faults(&self, part: &Part, endpoints: &[Endpoint]) -> Option<StreamFaults> {
        let (medium, language) = match part.kind {
            // Its bare bytes over TCP are a wire all the same.
            StreamKind::Lms2xx => (Medium::Wire, Language::Lms2xx),
            _ if endpoints.iter().any(|endpoint| !endpoint.is_line()) => (Medium::Tcp, Language::Cola),
            _ => (Medium::Wire, Language::Cola),
        };
        Some(self.faults?.stream(&part.name, medium, language))
    }

    fn place(&mut self, part: &Part, kind: &'static str, at: At) {
        self.places.push(Place { part: part.name.clone(), kind, at });
    }
}

fn replayed(
    part: &Part,
    taken_for: Option<&'static str>,
    scanner: Option<Box<dyn VirtualScanner>>,
) -> ReplayedStream {
    ReplayedStream { name: part.name.clone(), taken_for, scanner, _rest: Vec::new() }
}

fn foreign(part: &Part, model: &'static str) -> BenchError {
    BenchError::ForeignLanguage { stream: part.name.clone(), kind: part.kind, model }
}
