//! `rowscan emulate`

use std::sync::Arc;

use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{AnyModel, Model};
use rowscan_recording::{About, Taps};
use tokio::task::JoinSet;

use super::device::DeviceArgs;
use super::endpoint::{DEFAULT_PORTS, Place, announce_stream};
use super::interrupt::Interrupt;
use super::line::{self, Asked, LineArgs};
use super::output::say;
use super::recorder::{self, RecordArgs, Taping};
use super::scene::SceneArgs;
use super::voices::VoiceArgs;
use super::{Failure, Format, Outcome};
use rowscan_emulator::clock::{SimClock, TimeScale, Timer};
use rowscan_emulator::stage::{Stage, StageError};
use rowscan_emulator::{Bound, Emulator, EmulatorConfig, MAX_CLIENTS, WorldError};

/// How far apart the ports of several scanners are.
const PORTS_APART: u16 = 10;

/// Rate of a CoLa scanner's serial line out of the box, bits a second.
const COLA_RATE: u32 = 57_600;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Listen on this address; repeatable; port 0 takes a free one [default: 127.0.0.1:2111 and 127.0.0.1:2112; of a second scanner 2121 and 2122, and so on]
    #[arg(long, value_name = "ADDR")]
    tcp: Vec<String>,
    /// Simulated seconds a second, or `max`: as fast as the clients take it
    #[arg(long, value_name = "K", default_value = "1")]
    time_scale: TimeScale,
    /// Dialects answered
    #[arg(long, value_enum, default_value_t)]
    dialect: DialectArg,
    /// The rig's scanner to be, from 0; repeated, several scanners of one tractor, each with its own --tcp, in the same order [default: 0]
    #[arg(long, value_name = "N")]
    scanner: Vec<usize>,
    /// Clients served at once
    #[arg(long, value_name = "N", default_value_t = MAX_CLIENTS)]
    max_clients: usize,
    /// How to tell where it listens; jsonl writes one object an endpoint to standard output
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    #[command(flatten)]
    line: LineArgs,
    #[command(flatten)]
    voices: VoiceArgs,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    record: RecordArgs,
}

/// Dialects a virtual scanner answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum DialectArg {
    /// Each connection's first valid frame decides
    #[default]
    Auto,
    /// CoLa A only; silent in CoLa B
    A,
    /// CoLa B only; silent in CoLa A
    B,
}

impl From<DialectArg> for DialectPolicy {
    fn from(arg: DialectArg) -> Self {
        match arg {
            DialectArg::Auto => Self::Auto,
            DialectArg::A => Self::Strict(Dialect::A),
            DialectArg::B => Self::Strict(Dialect::B),
        }
    }
}

/// Which of the rig's scanners to be.
enum Chosen {
    /// An LMS2xx on its line.
    Line(usize, &'static lms2xx::model::Model),
    /// Scanners on the network, all on one tractor.
    Network(Vec<Fitted>),
}

/// The flags that tell an estimate which scanners these are; models that differ are the rig's own.
fn which(scanners: &[Fitted]) -> String {
    let mut flags = String::new();
    if let Some(first) = scanners.first()
        && scanners.iter().all(|fitted| fitted.model.name == first.model.name)
    {
        flags += &format!(" --model {}", first.model.name);
    }
    if scanners.iter().enumerate().any(|(place, fitted)| fitted.index != place) {
        scanners.iter().for_each(|fitted| flags += &format!(" --scanner {}", fitted.index));
    }
    flags
}

/// A scanner of the rig with its model.
struct Fitted {
    /// Number in the rig, from 0.
    index: usize,
    model: &'static Model,
}

impl Fitted {
    /// What its stream is called, where it is one of several.
    fn stream(&self, of: usize) -> Option<String> {
        (of > 1).then(|| format!("scanner{}", self.index))
    }
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut interrupt = Interrupt::watch()?;
    let Some(stage) = interrupt.or(args.scene.stage()).await.transpose()? else { return Ok(Outcome::Done) };
    match args.chosen(&stage)? {
        Chosen::Line(scanner, model) => args.on_a_line(&stage, scanner, model, interrupt).await,
        Chosen::Network(scanners) => args.on_the_network(&stage, &scanners, interrupt).await,
    }
}

impl Args {
    fn chosen(&self, stage: &Stage) -> Result<Chosen, Failure> {
        let asked = if self.scanner.is_empty() { &[0][..] } else { &self.scanner };
        self.check(asked.len())?;
        let mut fitted = Vec::new();
        for &index in asked {
            if stage.rig.scanners.get(index).is_none() {
                let found = stage.rig.scanners.len();
                return Err(StageError::from(WorldError::NoSuchScanner { index, found }).into());
            }
            match self.scene.any_model(&stage.rig, index)? {
                AnyModel::Cola(model) => fitted.push(Fitted { index, model }),
                AnyModel::Lms2xx(model) if asked.len() == 1 => return Ok(Chosen::Line(index, model)),
                AnyModel::Lms2xx(model) => {
                    return Err(Failure::Usage(format!(
                        "{} speaks on a serial line of its own: give it an `emulate` of its own",
                        model.title
                    )));
                }
            }
        }
        Ok(Chosen::Network(fitted))
    }

    /// Starts the recording that is asked for, of scanners of these models.
    fn tape(&self, stage: &Stage, models: &str) -> Result<Taping, Failure> {
        let about = About {
            model: Some(models.to_owned()),
            scene: Some(self.scene.name.clone()),
            rig: recorder::rig_text(&stage.rig),
            seed: Some(stage.scene.seed),
            ..About::default()
        };
        // A clock that waits for its clients can wait for the disk too.
        self.record.start(about, self.time_scale == TimeScale::Max)
    }

    async fn on_a_line(
        &self,
        stage: &Stage,
        scanner: usize,
        model: &'static lms2xx::model::Model,
        interrupt: Interrupt,
    ) -> Result<Outcome, Failure> {
        self.line.check(model, &self.tcp)?;
        self.voices.check_beside_a_line(self.time_scale)?;
        let taping = self.tape(stage, model.name)?;
        let asked = Asked {
            line: &self.line,
            tcp: &self.tcp,
            device: &self.device,
            voices: &self.voices,
            scanner,
            time_scale: self.time_scale,
            format: self.format,
            scene: &self.scene.name,
            taps: taping.taps(),
        };
        line::emulate(asked, stage, model, interrupt).await?;
        Ok(taping.finish())
    }

    async fn on_the_network(
        &self,
        stage: &Stage,
        scanners: &[Fitted],
        mut interrupt: Interrupt,
    ) -> Result<Outcome, Failure> {
        let list = |name: fn(&Model) -> &str, by: &str| {
            scanners.iter().map(|fitted| name(fitted.model)).collect::<Vec<_>>().join(by)
        };
        let taping = self.tape(stage, &list(|model| model.name, ", "))?;
        let (mut emulators, _telling) = self.start(stage, scanners, taping.taps()).await?;
        let mut sources = Vec::new();
        for (place, (fitted, emulator)) in scanners.iter().zip(&mut emulators).enumerate() {
            let stream = fitted.stream(scanners.len());
            let mut first = None;
            for address in self.addresses(place, scanners.len() > 1) {
                let Bound { address } = emulator.listen(&address).await?;
                announce_stream(self.format, stream.as_deref(), "tcp", Place::Address(&address))?;
                first.get_or_insert(address);
            }
            sources.extend(first.map(|address| format!(" tcp://{address}")));
        }
        if let Some(emulator) = emulators.first_mut() {
            for line in self.line.open(self.format, COLA_RATE).await? {
                emulator.attach(line.wire);
            }
        }
        say(format_args!(
            "{} on {}, seed {}; the tractor starts with the first scan sent",
            list(|model| model.title, " and "),
            self.scene.name,
            stage.scene.seed
        ));
        if !sources.is_empty() {
            let (sources, scene) = (sources.concat(), &self.scene.name);
            say(format_args!("estimate with: rowscan estimate{sources} --rig {scene}{}", which(scanners)));
        }
        interrupt.wait().await;
        for counts in emulators.iter().map(Emulator::counts) {
            say(format_args!(
                "{} scans sent, {} dropped for slow clients, {} missed by a slow host, {} connections refused",
                counts.scans_sent, counts.scans_dropped, counts.scans_missed, counts.connections_refused
            ));
        }
        drop(emulators);
        Ok(taping.finish())
    }

    /// Starts the scanners, on one tractor and one clock, and what else speaks there.
    async fn start(
        &self,
        stage: &Stage,
        scanners: &[Fitted],
        taps: Taps,
    ) -> Result<(Vec<Emulator>, JoinSet<()>), Failure> {
        let (tractor, timer) = (stage.tractor(), Timer::system());
        let mut set_up = Vec::new();
        for fitted in scanners {
            let (device, world) = stage.scanner_on(&tractor, fitted.index, fitted.model)?;
            let (device, state, line_changes) = self.device.set_up(device, stage.scene.seed, fitted.index)?;
            let config = EmulatorConfig {
                taps: taps.clone(),
                time_scale: self.time_scale,
                timer: timer.clone(),
                dialects: self.dialect.into(),
                max_clients: self.max_clients,
                state,
                line_changes,
                latency: None,
                stream: fitted.stream(scanners.len()),
            };
            set_up.push((device, world, config));
        }
        let (voices, telling) = self.voices.open(stage, &tractor, self.format).await?;
        // They speak once, beside the first scanner.
        let (mut voices, clock) = (Some(voices), Arc::new(SimClock::start(self.time_scale)));
        let start = |(device, world, config)| {
            let voices = voices.take().unwrap_or_default();
            Emulator::start_on(Arc::clone(&clock), device, world, voices, config)
        };
        Ok((set_up.into_iter().map(start).collect(), telling))
    }

    /// Refuses what several scanners cannot share.
    fn check(&self, scanners: usize) -> Result<(), Failure> {
        let refused = |why: &str| Err(Failure::Usage(why.to_owned()));
        if scanners < 2 {
            return Ok(());
        }
        if self.time_scale == TimeScale::Max {
            return refused(
                "several scanners on one tractor want a paced clock: --time-scale 1, or any other number",
            );
        }
        if self.line.count() > 0 || self.device.keeps_state() {
            return refused(
                "--pty, --serial, --rfc2217 and --state are one scanner's: leave them out, or give one --scanner",
            );
        }
        if !self.tcp.is_empty() && self.tcp.len() != scanners {
            return Err(Failure::Usage(format!(
                "expected one --tcp for each of the {} scanners, in their order, found {}",
                scanners,
                self.tcp.len()
            )));
        }
        Ok(())
    }

    /// Where the scanner at this place of those asked for listens.
    fn addresses(&self, place: usize, several: bool) -> Vec<String> {
        match (self.tcp.get(place), several) {
            (Some(address), true) => vec![address.clone()],
            (Some(_), false) => self.tcp.clone(),
            (None, _) if self.line.count() > 0 => Vec::new(),
            (None, _) => {
                let further = PORTS_APART.saturating_mul(u16::try_from(place).unwrap_or(u16::MAX));
                DEFAULT_PORTS.map(|port| format!("127.0.0.1:{}", port.saturating_add(further))).to_vec()
            }
        }
    }
}
