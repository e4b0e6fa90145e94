//! Flags for what else on the tractor speaks, and for the canopy sensor's own bus.

use super::endpoint::{Place, announce};
use super::{Failure, Format};
use crate::bus::link::{Found, Link};
use crate::bus::tractor::TractorEcu;
use crate::bus::{Bus, BusAddress, Inbox};
use crate::emulator::{Tractor, Voices};
use crate::nmea::{NmeaAddress, NmeaLine, NmeaPlace, NmeaVoice};
use crate::stage::Stage;

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
        let mut announced = Ok(());
        let mut tell = |link: &Link| {
            let told = match link.found() {
                Found::Address(address) => announce(format, link.kind(), Place::Address(&address)),
                Found::Path(path) => announce(format, link.kind(), Place::Path(&path)),
                Found::Name(name) => announce(format, link.kind(), Place::Address(&name)),
            };
            if announced.is_ok() {
                announced = told;
            }
        };
        let bus = Bus::open(&self.can, &mut tell).await?;
        announced.map(|()| Some(bus))
    }
}

/// Where GNSS and CAN of the virtual tractor go.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Tractor")]
pub(super) struct VoiceArgs {
    #[command(flatten)]
    bus: BusArgs,
    /// GNSS sentences; repeatable: tcp:ADDR, udp:ADDR, pty:LINK (pty:LINK@4800: a line of that rate)
    #[arg(long, value_name = "PLACE")]
    nmea: Vec<NmeaAddress>,
}

impl VoiceArgs {
    /// Refuses voices where nothing would speak.
    pub(super) fn refuse(&self, title: &str) -> Result<(), Failure> {
        if self.nmea.is_empty() && self.bus.can.is_empty() {
            return Ok(());
        }
        Err(Failure::Usage(format!(
            "--can and --nmea ride with CoLa scanners; a virtual {title} has none: leave them out"
        )))
    }

    /// Opens what is asked for and says where it is.
    pub(super) async fn open(
        &self,
        stage: &Stage,
        tractor: &Tractor,
        format: Format,
    ) -> Result<Voices, Failure> {
        let mut voices = Voices::default();
        let mut lines = Vec::new();
        for address in &self.nmea {
            let line = NmeaLine::open(address, stage.scene.gnss.rate_hz).await?;
            match line.place() {
                NmeaPlace::Address(address) => announce(format, "nmea", Place::Address(address))?,
                NmeaPlace::Path(path) => announce(format, "nmea", Place::Path(path))?,
            }
            lines.push(line);
        }
        if !lines.is_empty() {
            voices.nmea = Some((NmeaVoice::new(tractor.clone(), stage.receiver()), lines));
        }
        if let Some((bus, inbox)) = self.bus.open(format).await? {
            voices.can = Some((TractorEcu::new(tractor.clone(), stage.receiver()), bus, inbox));
        }
        Ok(voices)
    }
}
