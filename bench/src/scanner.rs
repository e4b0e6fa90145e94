//! A scanner of a bench: the one place where the two families differ.

use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::{Stage, StageError, contaminate};
use rowscan_emulator::{
    Bound, CountReader, DeviceHandle, Emulator, EmulatorConfig, LineWatch, Rig, SeenScanner, SerialConfig,
    StateFile, ViewError, VirtualScanner, pause_slack,
};
use rowscan_faults::{FaultControl, Language, Medium, StreamFaults};
use rowscan_ports::Untaken;
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::device::{Device, Options, Start};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_protocol::time::SimTime;
use rowscan_recording::Taps;
use rowscan_rest::{Kept, Rest, Server};

use crate::endpoint::{At, Line};
use crate::spec::{DeviceSpec, ScannerSpec, StartState};
use crate::{BenchError, Endpoint, Ident, Place};

/// Rate of a CoLa scanner's serial line out of the box, bits a second.
pub(crate) const COLA_RATE: u32 = 57_600;

/// A scanner that is set up. Dropping it ends it.
#[derive(Debug)]
pub struct BenchScanner {
    /// What faults, state and places call it.
    pub id: String,
    /// Number of its mount in the rig.
    pub mount: usize,
    /// What it is.
    pub model: AnyModel,
    /// Scans a client receives while the tractor drives past as much as a row from its start on, at most an hour's.
    pub scans_per_row: u64,
    device: Box<dyn VirtualScanner>,
    lines: LineWatch,
    /// Its drop ends the interface.
    _rest: Option<Server>,
}

/// A scanner that was opened: the scans of a row, and its REST interface.
type Opened = (Box<dyn VirtualScanner>, u64, Option<Server>);

impl BenchScanner {
    /// A handle that tells what it has done.
    pub fn counts(&self) -> CountReader {
        self.device.count_reader()
    }

    /// What counts as sent and has not left, from the clients' queues to what faults hold back.
    pub(crate) fn held(&self) -> Vec<InFlight> {
        self.device.held()
    }

    /// Counts what has not left as dropped.
    pub(crate) fn give_up_held(&self) {
        self.device.give_up_held();
    }

    /// The scanner as those see it who look on and change nothing.
    pub fn seen(&self) -> SeenScanner {
        SeenScanner {
            name: self.id.clone(),
            number: self.mount,
            model: self.model,
            lines: self.lines.clone(),
            counts: self.counts(),
        }
    }
}

/// What scanners are wired to.
pub(crate) struct Wiring<'a> {
    pub(crate) stage: &'a Stage,
    pub(crate) scale: TimeScale,
    pub(crate) taps: &'a Taps,
    pub(crate) faults: Option<&'a FaultControl>,
    pub(crate) watched: bool,
    pub(crate) rig: &'a mut Rig,
    pub(crate) places: &'a mut Vec<Place>,
    /// Of the scanners so far, with what they are called.
    pub(crate) serial_numbers: &'a mut BTreeMap<u32, String>,
    /// Of its pseudo-terminals.
    pub(crate) untaken: &'a mut Vec<Untaken>,
}

impl Wiring<'_> {
    /// Puts a scanner on its mount and its endpoints.
    pub(crate) async fn add(&mut self, spec: &ScannerSpec) -> Result<BenchScanner, BenchError> {
        let found = self.stage.rig.scanners.len();
        if spec.mount >= found {
            return Err(StageError::from(ViewError::NoSuchScanner { index: spec.mount, found }).into());
        }
        let lines = LineWatch::default();
        let (device, scans_per_row, rest): Opened = match spec.model {
            AnyModel::Cola(model) => self.cola(spec, model, &lines).await?,
            AnyModel::Lms2xx(model) => self.lms2xx(spec, model, &lines).await?,
        };
        let ScannerSpec { id, mount, model, .. } = spec.clone();
        Ok(BenchScanner { id, mount, model, scans_per_row, device, lines, _rest: rest })
    }

    async fn cola(
        &mut self,
        spec: &ScannerSpec,
        model: &'static Model,
        lines: &LineWatch,
    ) -> Result<Opened, BenchError> {
        let (device, view) = self.stage.scanner_on(&self.rig.tractor(), spec.mount, model)?;
        let scans_per_row = self.stage.scans_per_row(&device);
        let spec = &ScannerSpec { udp: spec.udp.map(a_free_port).transpose()?, ..spec.clone() };
        let (mut device, state) = cola_device(spec, model, device, self.stage.scene.seed)?;
        device.set_serial_number(self.serial_number(spec, device.serial_number())?);
        let on_a_line = spec.endpoints.iter().all(Endpoint::is_line) && !spec.endpoints.is_empty();
        let config = EmulatorConfig {
            time_scale: self.scale,
            dialects: spec.dialects,
            max_clients: spec.max_clients,
            idle_limit: spec.idle_limit,
            state,
            line_changes: spec.device.line_changes.clone(),
            latency: spec.latency.clone(),
            lines: self.watched.then(|| lines.clone()),
            taps: self.taps.clone(),
            stream: spec.stream.clone(),
            allowed_destinations: allowed_destinations(spec),
            faults: self.stream(spec, if on_a_line { Medium::Wire } else { Medium::Tcp }, Language::Cola),
            ..EmulatorConfig::default()
        };
        let serial_number = device.serial_number();
        self.serial_numbers.insert(serial_number, spec.id.clone());
        let mut emulator = self.rig.scanner(device, view, config);
        for endpoint in &spec.endpoints {
            match endpoint {
                Endpoint::Tcp(address) => {
                    let Bound { address } = emulator.listen(address).await?;
                    self.place(spec, "tcp", At::Address(address));
                }
                line => {
                    let line = Line::open(line, COLA_RATE).await?;
                    self.place(spec, line.kind, line.at);
                    self.untaken.extend(line.untaken);
                    emulator.attach(line.wire);
                }
            }
        }
        if let Some(address) = &spec.search {
            let tcp = self.places.iter().find_map(|place| match place.at {
                At::Address(at) if place.part == spec.id => Some(at),
                _ => None,
            });
            let found_at = tcp.unwrap_or_else(|| SocketAddr::from(([127, 0, 0, 1], 0)));
            let Bound { address } = emulator.answer_searches(address, found_at).await?;
            self.place(spec, "search", At::Address(address));
        }
        let rest = match &spec.rest {
            Some(address) => Some(self.rest(spec, address, &emulator, serial_number).await?),
            None => None,
        };
        if let Some(to) = spec.udp {
            self.place(spec, "udp", At::Address(to.into()));
        }
        Ok((Box::new(emulator), scans_per_row, rest))
    }

    /// The serial number of a scanner that has this one by model, mount and seed: the one that is asked for, else the next that no other scanner has.
    fn serial_number(&self, spec: &ScannerSpec, own: u32) -> Result<u32, BenchError> {
        let taken = |number: u32| self.serial_numbers.get(&number);
        let Some(asked) = spec.device.serial_number else {
            return Ok((own..).find(|number| taken(*number).is_none()).unwrap_or(own));
        };
        taken(asked).map_or(Ok(asked), |other| {
            let (id, other) = (spec.id.clone(), other.clone());
            Err(BenchError::SameSerialNumber { id, other, serial_number: asked })
        })
    }

    /// Serves the scanner's REST interface.
    async fn rest(
        &mut self,
        spec: &ScannerSpec,
        address: &str,
        emulator: &Emulator,
        serial_number: u32,
    ) -> Result<Server, BenchError> {
        let rest = Rest::new(self.stage.scene.seed, serial_number);
        let server = Server::open(address, rest, Arc::new(Asked(emulator.device_handle()))).await?;
        self.place(spec, "rest", At::Address(server.address()));
        Ok(server)
    }

    async fn lms2xx(
        &mut self,
        spec: &ScannerSpec,
        model: &'static lms2xx::model::Model,
        lines: &LineWatch,
    ) -> Result<Opened, BenchError> {
        let [endpoint] = spec.endpoints.as_slice() else {
            return Err(BenchError::NotOneLine { model: model.title, found: spec.endpoints.len() });
        };
        let options = lms2xx_options(spec, model, self.stage, self.scale)?;
        let (mut device, view) =
            self.stage.serial_scanner_on(&self.rig.tractor(), spec.mount, model, options)?;
        let hertz = f64::from(lms2xx::model::TURNS_PER_SECOND) / f64::from(model.turns(device.variant()));
        let scans_per_row = self.stage.scans_of_row(hertz);
        let DeviceSpec { fields_mm, state, .. } = &spec.device;
        if !fields_mm.iter().enumerate().all(|(number, radius_mm)| device.set_field(number, *radius_mm)) {
            return Err(BenchError::TooManyFields { found: fields_mm.len() });
        }
        let open = |path| StateFile::open(path, |text| device.restore(text));
        let state = state.as_deref().map(open).transpose()?;
        let line = Line::open(endpoint, device.rate().bits_per_second()).await?;
        self.place(spec, line.kind, line.at);
        self.untaken.extend(line.untaken);
        let config = SerialConfig {
            time_scale: self.scale,
            state,
            taps: self.taps.clone(),
            stream: spec.stream.clone(),
            lines: self.watched.then(|| lines.clone()),
            faults: self.stream(spec, Medium::Wire, Language::Lms2xx),
        };
        Ok((Box::new(self.rig.lms2xx(device, view, line.wire, config)), scans_per_row, None))
    }

    /// Its part of the faults, if faults may come.
    fn stream(&self, spec: &ScannerSpec, medium: Medium, language: Language) -> Option<StreamFaults> {
        Some(self.faults?.stream(&spec.id, medium, language))
    }

    fn place(&mut self, spec: &ScannerSpec, kind: &'static str, at: At) {
        self.places.push(Place { part: spec.id.clone(), kind, at });
    }
}

/// The device as its REST interface asks it.
pub(crate) struct Asked(pub(crate) DeviceHandle);

impl rowscan_rest::Scanner for Asked {
    fn ask(&self, ask: &mut dyn FnMut(&mut Device, SimTime)) -> Kept {
        Box::pin(self.0.ask(ask))
    }
}

/// Whether something is asked for that only models with Compact output have.
fn wants_compact(spec: &ScannerSpec) -> bool {
    spec.udp.is_some() || spec.rest.is_some() || !spec.allowed_destinations.is_empty()
}

/// The destination with a port that is free now, if it asks for one: whoever is to hear the datagrams binds it.
pub(crate) fn a_free_port(to: SocketAddrV4) -> Result<SocketAddrV4, BenchError> {
    if to.port() != 0 {
        return Ok(to);
    }
    let found = UdpSocket::bind(to).and_then(|socket| socket.local_addr());
    let found = found.map_err(|cause| BenchError::NoFreePort { address: *to.ip(), cause })?;
    Ok(SocketAddrV4::new(*to.ip(), found.port()))
}

/// Where a scanner's datagrams may go, besides loopback.
fn allowed_destinations(spec: &ScannerSpec) -> Vec<IpAddr> {
    let directed = spec.udp.map(|to| IpAddr::from(*to.ip()));
    spec.allowed_destinations.iter().copied().chain(directed).collect()
}

/// A CoLa device as the specification has it, and where it keeps its settings.
fn cola_device(
    spec: &ScannerSpec,
    model: &'static Model,
    device: Device,
    seed: u64,
) -> Result<(Device, Option<StateFile>), BenchError> {
    let of = &spec.device;
    let start = match of.start {
        Some(StartState::Cola(start)) => start,
        Some(StartState::Lms2xx(_)) => return Err(BenchError::ForeignStart { model: model.title }),
        None => of.profile.default_start(),
    };
    let mut device = device.with_options(Options {
        profile: of.profile,
        start,
        strict_login: of.strict_login,
        power_up_before: of.uptime,
        clock_ppm: of.clock_ppm,
        seed,
        scanner: u32::try_from(spec.mount).unwrap_or(u32::MAX),
        boot: of.boot,
        save: of.save,
        ..Options::default()
    });
    let open = |path| StateFile::open(path, |text| device.restore(text));
    let state = of.state.as_deref().map(open).transpose()?;
    if model.compact.is_none() && wants_compact(spec) {
        return Err(BenchError::NoDatagrams { model: model.title });
    }
    if let Some(to) = spec.udp {
        device.direct(to);
    }
    if model.compact.is_some() && of.start == Some(StartState::Cola(Start::Streaming)) {
        device.enable_streaming();
    }
    if let Some(level) = of.contamination {
        contaminate(&mut device, model, level)?;
    }
    device.set_comment(&of.comment);
    if let Some(Ident { name, version }) = &of.ident {
        device.set_ident(name, version);
    }
    if let Some(text) = &of.firmware {
        device.set_firmware(text);
    }
    device.watch_fields(&of.fields_mm)?;
    // A line the model does not have is told now, not when its time comes.
    let mut trial = device.clone();
    of.line_changes.iter().try_for_each(|change| change.apply(&mut trial))?;
    Ok((device, state))
}

/// How an LMS2xx is found, as the specification has it.
fn lms2xx_options(
    spec: &ScannerSpec,
    model: &'static lms2xx::model::Model,
    stage: &Stage,
    scale: TimeScale,
) -> Result<lms2xx::device::Options, BenchError> {
    let of = &spec.device;
    let start = match of.start {
        Some(StartState::Lms2xx(start)) => start,
        Some(StartState::Cola(_)) => return Err(BenchError::ForeignStart { model: model.title }),
        None => lms2xx::device::Start::default_of(of.profile),
    };
    if wants_compact(spec) {
        return Err(BenchError::NoDatagrams { model: model.title });
    }
    if of.ident.is_some() || spec.search.is_some() {
        return Err(BenchError::NoIdent { model: model.title });
    }
    if of.serial_number.is_some() {
        return Err(BenchError::NoSerialNumber { model: model.title });
    }
    let firmware = of.firmware.as_deref().map(str::parse).transpose()?;
    let slack: Duration = of.pause_slack.unwrap_or_else(|| pause_slack(of.profile, scale));
    Ok(lms2xx::device::Options {
        profile: of.profile,
        start,
        stored_rate: of.rate,
        pause_slack: slack,
        firmware,
        boot: of.boot,
        save: of.save,
        contamination: of.contamination.unwrap_or_else(|| stage.scene.optics.contamination()),
    })
}
