//! Flags for what else on the tractor speaks, and for the canopy sensor's own bus.

use rowscan_bench::{BenchSpec, BusSpec, NmeaSpec};
use rowscan_bus::nmea::NmeaAddress;
use rowscan_bus::{Bus, BusAddress, BusNews, Inbox};
use rowscan_recording::Taps;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::endpoint::announce_stream;
use super::output::say;
use super::{Failure, Format};
use rowscan_ports::task;

/// News of the bus that may wait to be told; a bus that flaps faster loses some.
const NEWS: usize = 16;

/// Where CAN goes.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct BusArgs {
    /// A port of the CAN bus; repeatable: slcan:LINK, socketcan:can0, socketcand:ADDR, socketcand-client:HOST:PORT/BUS, lines:LINK, lines-tcp:ADDR, agopengps:ADDR, udp-aog:ADDR, udp-aog-listen:ADDR, udp:GROUP:PORT, candump:FILE
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
    let mut places = Vec::new();
    let bus = Bus::open(ports, &mut |link| places.push((link.kind(), link.found()))).await?;
    for (kind, found) in places {
        announce_stream(format, stream, kind, &found)?;
    }
    Ok(bus)
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

    /// Puts what is asked for into a bench, recorded by `taps`; news of the bus are told by a task of `telling`.
    pub(super) fn add_to(&self, spec: &mut BenchSpec<'_>, taps: &Taps, telling: &mut JoinSet<()>) {
        spec.nmea_taps = taps.clone();
        let places = (0..).zip(&self.nmea);
        spec.nmea.extend(places.map(|(number, at)| NmeaSpec { id: format!("nmea{number}"), at: at.clone() }));
        if self.has_bus() {
            let bus = BusSpec::new("can0", self.bus.can.iter().cloned());
            spec.buses.push(BusSpec { taps: taps.clone(), news: Some(tell_news(telling)), ..bus });
        }
    }
}
