//! Flags for what else on the tractor speaks, and for the canopy sensor's own bus.

use rowscan_vehicle::Tractor;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::endpoint::{Place, announce_stream};
use super::output::say;
use super::{Failure, Format};
use rowscan_bus::link::{Found, Link};
use rowscan_bus::nmea::{NmeaAddress, NmeaLine, NmeaPlace, NmeaVoice};
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress, BusNews, Inbox};
use rowscan_emulator::Voices;
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;

/// News of the bus that may wait to be told; a bus that flaps faster loses some.
const NEWS: usize = 16;

/// Where CAN goes.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct BusArgs {
    /// A port of the CAN bus; repeatable: slcan:LINK, socketcan:can0, socketcand:ADDR, udp:GROUP:PORT, candump:FILE
    #[arg(long, value_name = "PORT")]
    can: Vec<BusAddress>,
}

impl BusArgs {
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
    tasks.spawn(async move {
        while let Some(news) = told.recv().await {
            say(news);
        }
    });
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
pub(super) struct VoiceArgs {
    #[command(flatten)]
    bus: BusArgs,
    /// GNSS sentences; repeatable: tcp:ADDR, udp:ADDR, pty:LINK (pty:LINK@4800: a line of that rate), serial:DEV@RATE
    #[arg(long, value_name = "PLACE")]
    nmea: Vec<NmeaAddress>,
}

impl VoiceArgs {
    /// Refuses voices beside a scanner whose clock waits for one client on a line, and not for theirs.
    pub(super) fn check_beside_a_line(&self, scale: TimeScale) -> Result<(), Failure> {
        if scale != TimeScale::Max || self.nmea.is_empty() && self.bus.can.is_empty() {
            return Ok(());
        }
        Err(Failure::Usage(
            "--can and --nmea beside an LMS2xx want a paced clock: --time-scale 1, or any other number"
                .to_owned(),
        ))
    }

    /// Opens what is asked for and says where it is; the tasks tell what happens on the bus.
    pub(super) async fn open(
        &self,
        stage: &Stage,
        tractor: &Tractor,
        format: Format,
    ) -> Result<(Voices, JoinSet<()>), Failure> {
        let mut telling = JoinSet::new();
        let mut voices = Voices::default();
        let mut lines = Vec::new();
        for address in &self.nmea {
            lines.push(open_nmea(address, stage.scene.gnss.rate_hz, None, format).await?);
        }
        if !lines.is_empty() {
            voices.nmea = Some((NmeaVoice::new(tractor.clone(), stage.receiver()), lines));
        }
        if let Some((bus, inbox)) = self.bus.open(format).await? {
            voices.can = Some((TractorEcu::new(tractor.clone(), stage.receiver()), bus, inbox));
            voices.news = Some(tell_news(&mut telling));
        }
        Ok((voices, telling))
    }
}
