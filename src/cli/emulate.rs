//! `rowscan emulate`

use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::AnyModel;
use rowscan_recording::About;

use super::device::DeviceArgs;
use super::endpoint::{Place, announce};
use super::interrupt::Interrupt;
use super::line::{self, Asked, LineArgs};
use super::output::say;
use super::recorder::{self, RecordArgs};
use super::scene::SceneArgs;
use super::voices::VoiceArgs;
use super::{Failure, Format, Outcome};
use crate::clock::{TimeScale, Timer};
use crate::emulator::{Bound, Emulator, EmulatorConfig, MAX_CLIENTS};

/// Where a SICK scanner listens; both ports take the same commands.
const DEFAULT_ENDPOINTS: [&str; 2] = ["127.0.0.1:2111", "127.0.0.1:2112"];

/// Rate of a CoLa scanner's serial line out of the box, bits a second.
const COLA_RATE: u32 = 57_600;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Listen on this address; repeatable; port 0 takes a free one [default: 127.0.0.1:2111 and 127.0.0.1:2112]
    #[arg(long, value_name = "ADDR")]
    tcp: Vec<String>,
    /// Simulated seconds a second, or `max`: as fast as the clients take it
    #[arg(long, value_name = "K", default_value = "1")]
    time_scale: TimeScale,
    /// Dialects answered
    #[arg(long, value_enum, default_value_t)]
    dialect: DialectArg,
    /// The rig's scanner to be, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    scanner: usize,
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

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut interrupt = Interrupt::watch()?;
    let Some(stage) = interrupt.or(args.scene.stage()).await.transpose()? else { return Ok(Outcome::Done) };
    let about = |model: &str| About {
        model: Some(model.to_owned()),
        scene: Some(args.scene.name.clone()),
        rig: recorder::rig_text(&stage.rig),
        seed: Some(stage.scene.seed),
        ..About::default()
    };
    // A clock that waits for its clients can wait for the disk too.
    let waits = args.time_scale == TimeScale::Max;
    let model = match args.scene.any_model(&stage.rig, args.scanner)? {
        AnyModel::Cola(model) => model,
        AnyModel::Lms2xx(model) => {
            args.line.check(model, &args.tcp)?;
            args.voices.refuse(model.title)?;
            let taping = args.record.start(about(model.name), waits)?;
            let asked = Asked {
                line: &args.line,
                tcp: &args.tcp,
                device: &args.device,
                scanner: args.scanner,
                time_scale: args.time_scale,
                format: args.format,
                scene: &args.scene.name,
                taps: taping.taps(),
            };
            line::emulate(asked, &stage, model, interrupt).await?;
            return Ok(taping.finish());
        }
    };
    let tractor = stage.tractor();
    let (device, world) = stage.scanner_on(&tractor, args.scanner, model)?;
    let (device, state, line_changes) = args.device.set_up(device, stage.scene.seed)?;
    let taping = args.record.start(about(model.name), waits)?;
    let config = EmulatorConfig {
        taps: taping.taps(),
        time_scale: args.time_scale,
        timer: Timer::System,
        dialects: args.dialect.into(),
        max_clients: args.max_clients,
        state,
        line_changes,
    };
    let voices = args.voices.open(&stage, &tractor, args.format).await?;
    let mut emulator = Emulator::start_with(device, world, voices, config);
    let mut addresses: Vec<&str> = args.tcp.iter().map(String::as_str).collect();
    if addresses.is_empty() && args.line.count() == 0 {
        addresses.extend(DEFAULT_ENDPOINTS);
    }
    let mut bound = Vec::new();
    for address in addresses {
        bound.push(emulator.listen(address).await?);
    }
    for Bound { address } in &bound {
        announce(args.format, "tcp", Place::Address(address))?;
    }
    for line in args.line.open(args.format, COLA_RATE).await? {
        emulator.attach(line.wire);
    }
    say(format_args!(
        "{} on {}, seed {}; the tractor starts with the first scan sent",
        model.title, args.scene.name, stage.scene.seed
    ));
    if let Some(Bound { address }) = bound.first() {
        say(format_args!(
            "estimate with: rowscan estimate tcp://{address} --rig {} --model {}",
            args.scene.name, model.name
        ));
    }
    interrupt.wait().await;
    let counts = emulator.counts();
    say(format_args!(
        "{} scans sent, {} dropped for slow clients, {} connections refused",
        counts.scans_sent, counts.scans_dropped, counts.connections_refused
    ));
    drop(emulator);
    Ok(taping.finish())
}
