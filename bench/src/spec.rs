//! What a bench is made of.

use std::net::{IpAddr, SocketAddrV4};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::Duration;

use rowscan_bus::control_function::ControlFunction;
use rowscan_bus::nmea::NmeaAddress;
use rowscan_bus::{BusAddress, BusNews};
use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::lockstep::Lockstep;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{EndWhen, IDLE_LIMIT, LineChange, MAX_CLIENTS, ScanMoment, StartWhen};
use rowscan_ports::latency::Latency;
use rowscan_protocol::device::{DialectPolicy, Profile, Start};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::AnyModel;
use rowscan_recording::{DATAGRAMS, Taps};
use rowscan_vehicle::Tractor;
use tokio::sync::mpsc;

use crate::Endpoint;

/// A rig that is to run: an orchard, a tractor on one clock, and all that rides on it.
#[derive(Debug)]
pub struct BenchSpec<'a> {
    /// The orchard, and the rig with its mounts.
    pub stage: &'a Stage,
    /// How time goes.
    pub time: TimeSpec,
    /// The scanners, in the order in which they are opened.
    pub scanners: Vec<ScannerSpec>,
    /// The CAN buses; the tractor's ECU is on the first.
    pub buses: Vec<BusSpec>,
    /// Where the GNSS receiver's sentences go.
    pub nmea: Vec<NmeaSpec>,
    /// Who records those.
    pub nmea_taps: Taps,
    /// Where copies of all bytes of scanners go.
    pub taps: Taps,
    /// Whether faults may come: from a script, from scripts of others, by hand.
    pub faults: bool,
    /// Whether somebody watches the scanners' lines.
    pub watched: bool,
    /// Where the truth goes, a moment a scan of the first scanner that went to a taker.
    pub moments: Option<Sender<ScanMoment>>,
    clock: Arc<SimClock>,
    tractor: Tractor,
}

/// How time goes.
#[derive(Debug, Default)]
pub struct TimeSpec {
    /// What wakes the mirrors.
    pub timer: Timer,
    /// What sets the tractor going; by the time scale where absent.
    pub start: Option<StartWhen>,
    /// When it is over.
    pub end: Option<EndWhen>,
    /// Length of a step from the start of the drive on.
    pub step: Option<Duration>,
    /// Time waits for acknowledgements.
    pub lockstep: Option<Lockstep>,
    /// The drive is held until [`Bench::release`](crate::Bench::release).
    pub held: bool,
}

/// A scanner.
#[derive(Clone, Debug)]
pub struct ScannerSpec {
    /// What faults, state and places call it.
    pub id: String,
    /// Number of its mount in the rig.
    pub mount: usize,
    /// What it is.
    pub model: AnyModel,
    /// Where clients find it. An LMS2xx has one line.
    pub endpoints: Vec<Endpoint>,
    /// CoLa: where SICK's device search finds it, over UDP.
    pub search: Option<String>,
    /// With Compact output: where its REST interface is; port 0 takes a free one.
    pub rest: Option<String>,
    /// With Compact output: where all its datagrams go, in place of 192.168.0.100; allowed wherever that is.
    pub udp: Option<SocketAddrV4>,
    /// With Compact output: addresses besides loopback that clients may direct its datagrams to.
    pub allowed_destinations: Vec<IpAddr>,
    /// What its recorded stream is called; as the model is, where absent.
    pub stream: Option<String>,
    /// In which state it is, and how it behaves.
    pub device: DeviceSpec,
    /// Which dialects a CoLa scanner answers.
    pub dialects: DialectPolicy,
    /// Clients served at once.
    pub max_clients: usize,
    /// In a full house, who is idle for longer makes room; host time.
    pub idle_limit: Duration,
    /// Who measures the host time that scans of a CoLa scanner take to their user.
    pub latency: Option<Arc<Latency>>,
}

/// The state a scanner is found in, of either family.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartState {
    /// Of a CoLa scanner.
    Cola(Start),
    /// Of an LMS2xx.
    Lms2xx(lms2xx::device::Start),
}

/// What a scanner says that it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ident {
    /// Its name, such as `LMS10x_FieldEval`.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// In which state a scanner is, and how it behaves. What a family does not have is refused or has no effect, as its field says.
#[derive(Clone, Debug, Default)]
pub struct DeviceSpec {
    /// Whether it takes the time a real one takes.
    pub profile: Profile,
    /// The state it is found in; by the profile where absent.
    pub start: Option<StartState>,
    /// The file that keeps its saved settings.
    pub state: Option<PathBuf>,
    /// CoLa: a login stops the scans.
    pub strict_login: bool,
    /// CoLa: how long it has been on already.
    pub uptime: Duration,
    /// CoLa: how much too fast its clock runs, parts per million.
    pub clock_ppm: i32,
    /// CoLa: digital lines that are switched on the way.
    pub line_changes: Vec<LineChange>,
    /// Radii of its evaluation fields, millimetres.
    pub fields_mm: Vec<u16>,
    /// From power-up to the first answer, in place of the model's.
    pub boot: Option<Duration>,
    /// What saving takes, in place of the model's.
    pub save: Option<Duration>,
    /// Dirt on the front screen, 0 to 3; the scene's where absent.
    pub contamination: Option<u8>,
    /// CoLa: the comment in its scans.
    pub comment: String,
    /// LMS2xx: the rate it was left at.
    pub rate: lms2xx::Rate,
    /// CoLa: what DeviceIdent says; the model's own where absent.
    pub ident: Option<Ident>,
    /// Its serial number; by model, mount and seed where absent. An LMS2xx tells none.
    pub serial_number: Option<u32>,
    /// What FirmwareVersion says, the model's own where absent; of an LMS2xx, which of its firmwares it has.
    pub firmware: Option<String>,
    /// LMS2xx: how long a client may pause inside a telegram, more than a real device allows; by profile and time scale where absent.
    pub pause_slack: Option<Duration>,
}

/// A CAN bus.
#[derive(Debug)]
pub struct BusSpec {
    /// What faults, state and places call it.
    pub id: String,
    /// Its ports: each hears what the others say.
    pub ports: Vec<BusAddress>,
    /// Who records it.
    pub taps: Taps,
    /// Where news of it go.
    pub news: Option<mpsc::Sender<BusNews>>,
    /// The rig's control functions on it beside the tractor's.
    pub functions: Vec<Box<dyn ControlFunction>>,
}

/// A place for GNSS sentences.
#[derive(Clone, Debug)]
pub struct NmeaSpec {
    /// What places call it.
    pub id: String,
    /// Where it is.
    pub at: NmeaAddress,
}

impl<'a> BenchSpec<'a> {
    /// An empty rig on `stage`, its time at this scale, which begins to count here.
    pub fn new(stage: &'a Stage, scale: TimeScale) -> Self {
        Self {
            stage,
            time: TimeSpec::default(),
            scanners: Vec::new(),
            buses: Vec::new(),
            nmea: Vec::new(),
            nmea_taps: Taps::default(),
            taps: Taps::default(),
            faults: false,
            watched: false,
            moments: None,
            clock: Arc::new(SimClock::start(scale)),
            tractor: stage.tractor(),
        }
    }

    /// The clock that everything acts by.
    pub fn clock(&self) -> Arc<SimClock> {
        Arc::clone(&self.clock)
    }

    /// The tractor that everything rides on.
    pub fn tractor(&self) -> Tractor {
        self.tractor.clone()
    }
}

impl ScannerSpec {
    /// The rig's scanner of this mount, a device of `model` that nobody can reach yet, called `scanner0` and so on.
    pub fn new(mount: usize, model: impl Into<AnyModel>) -> Self {
        Self {
            id: format!("scanner{mount}"),
            mount,
            model: model.into(),
            endpoints: Vec::new(),
            search: None,
            rest: None,
            udp: None,
            allowed_destinations: Vec::new(),
            stream: None,
            device: DeviceSpec::default(),
            dialects: DialectPolicy::Auto,
            max_clients: MAX_CLIENTS,
            idle_limit: IDLE_LIMIT,
            latency: None,
        }
    }

    /// The same as the next of so many on one mount, called `scanner0-2` and so on, so that faults and places tell them apart.
    #[must_use]
    pub fn after(mut self, on_this_mount: usize) -> Self {
        if on_this_mount > 0 {
            self.id = format!("scanner{}-{}", self.mount, on_this_mount + 1);
        }
        self
    }

    /// What the streams are called that its telegrams are recorded in.
    pub fn streams(&self) -> Vec<String> {
        let datagrams = matches!(self.model, AnyModel::Cola(model) if model.compact.is_some());
        let name = self.stream.as_deref().unwrap_or(self.model.name());
        let datagrams = datagrams.then(|| format!("{name}{DATAGRAMS}"));
        [name.to_owned()].into_iter().chain(datagrams).collect()
    }

    /// The same, to be found there as well.
    #[must_use]
    pub fn at(mut self, endpoint: Endpoint) -> Self {
        self.endpoints.push(endpoint);
        self
    }
}

impl BusSpec {
    /// A bus of this name with these ports, which nobody records.
    pub fn new(id: impl Into<String>, ports: impl IntoIterator<Item = BusAddress>) -> Self {
        Self {
            id: id.into(),
            ports: ports.into_iter().collect(),
            taps: Taps::default(),
            news: None,
            functions: Vec::new(),
        }
    }
}
