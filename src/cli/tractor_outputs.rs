//! Flags for what else on the tractor speaks, and for the canopy sensor's own bus.

use std::path::Path;

use rowscan_recording::Taps;
use rowscan_vehicle::Tractor;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::endpoint::{Place, announce_stream};
use super::output::say;
use super::{Failure, Format, Outcome};
use rowscan_bus::link::candump::LogCut;
use rowscan_bus::link::{Found, Link};
use rowscan_bus::nmea::{GnssEpochs, NmeaAddress, NmeaLine, NmeaPlace};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress, BusNews, Inbox};
use rowscan_emulator::Rig;
use rowscan_emulator::stage::Stage;
use rowscan_ports::task;

/// News of the bus that may wait to be told; a bus that flaps faster loses some.
const NEWS: usize = 16;

/// Where CAN goes.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct BusArgs {
    /// A port of the CAN bus; repeatable: slcan:LINK, socketcan:can0, socketcand:ADDR, socketcand-client:HOST:PORT/BUS, udp:GROUP:PORT, candump:FILE
    #[arg(long, value_name = "PORT")]
    can: Vec<BusAddress>,
}

impl BusArgs {
    /// Whether there is one.
    pub(super) fn is_given(&self) -> bool {
        !self.can.is_empty()
    }

    /// The bus, its ports announced; none without any.
    pub(super) async fn open(&self, format: Format) -> Result<Option<(Bus, Inbox)>, Failure> {
        if self.can.is_empty() {
            return Ok(None);
        }
        open_bus(&self.can, None, format).await.map(Some)
    }
}

/// Opens the ports of a bus and announces them, for the stream of that name.
pub(super) async fn open_bus(
    ports: &[BusAddress],
    stream: Option<&str>,
    format: Format,
) -> Result<(Bus, Inbox), Failure> {
    let mut announced = Ok(());
    let mut tell = |link: &Link| {
        let tell = |place: Place<'_>| announce_stream(format, stream, link.kind(), place);
        let told = match link.found() {
            Found::Address(address) => tell(Place::Address(&address)),
            Found::Path(path) => tell(Place::Path(&path)),
            Found::Name(name) => tell(Place::Address(&name)),
        };
        if announced.is_ok() {
            announced = told;
        }
    };
    let bus = Bus::open(ports, &mut tell).await?;
    announced.map(|()| bus)
}

/// Where news of a bus go to be told by a task of `tasks`.
pub(super) fn tell_news(tasks: &mut JoinSet<()>) -> mpsc::Sender<BusNews> {
    let (news, mut told) = mpsc::channel(NEWS);
    tasks.spawn(task(async move {
        while let Some(news) = told.recv().await {
            say(news);
        }
    }));
    news
}

/// Opens a place for sentences that come `rate_hz` times a second and announces it, for the stream of that name.
pub(super) async fn open_nmea(
    address: &NmeaAddress,
    rate_hz: f64,
    stream: Option<&str>,
    format: Format,
) -> Result<NmeaLine, Failure> {
    let line = NmeaLine::open(address, rate_hz).await?;
    match line.place() {
        NmeaPlace::Address(address) => announce_stream(format, stream, "nmea", Place::Address(address))?,
        NmeaPlace::Path(path) => announce_stream(format, stream, "nmea", Place::Path(path))?,
    }
    Ok(line)
}

/// Where GNSS and CAN of the virtual tractor go.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct TractorOutputArgs {
    #[command(flatten)]
    bus: BusArgs,
    /// GNSS sentences; repeatable: tcp:ADDR, udp:ADDR, pty:LINK (pty:LINK@4800: a line of that rate), serial:DEV@RATE
    #[arg(long, value_name = "PLACE")]
    nmea: Vec<NmeaAddress>,
}

impl TractorOutputArgs {
    /// Whether nothing is asked for.
    pub(super) fn is_empty(&self) -> bool {
        self.nmea.is_empty() && self.bus.can.is_empty()
    }

    /// Whether there is a bus.
    pub(super) fn has_bus(&self) -> bool {
        self.bus.is_given()
    }

    /// Opens what is asked for, adds it to the rig and says where it is.
    pub(super) async fn open(
        &self,
        stage: &Stage,
        tractor: &Tractor,
        rig: &mut Rig,
        taps: &Taps,
        format: Format,
    ) -> Result<OpenOutputs, Failure> {
        let mut open = OpenOutputs::default();
        let mut lines = Vec::new();
        for address in &self.nmea {
            lines.push(open_nmea(address, stage.scene.gnss.rate_hz, None, format).await?);
        }
        if !lines.is_empty() {
            rig.gnss(GnssEpochs::new(tractor.clone(), stage.receiver()), lines, taps);
        }
        if let Some(bus) = self.bus.open(format).await? {
            let ecu = TractorEcu::new(tractor.clone(), stage.receiver());
            open.logs = bus.0.logs();
            rig.bus(ecu, bus, Some(tell_news(&mut open.telling)), taps);
        }
        Ok(open)
    }

    /// The files that are written.
    pub(super) fn files(&self) -> impl Iterator<Item = &Path> {
        self.bus.can.iter().filter_map(|port| match port {
            BusAddress::Candump(path) => Some(path.as_path()),
            _ => None,
        })
    }
}

/// What speaks while a rig runs.
#[derive(Debug, Default)]
pub(super) struct OpenOutputs {
    /// Tells what happens on the bus.
    telling: JoinSet<()>,
    logs: Vec<LogCut>,
}

impl OpenOutputs {
    /// Whether all logs are whole.
    pub(super) fn outcome(&self) -> Outcome {
        if self.logs.iter().any(LogCut::is_cut) { Outcome::Finding } else { Outcome::Done }
    }
}
