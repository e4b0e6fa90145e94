//! `rowscan emulate`

use std::path::PathBuf;

use rowscan_protocol::device::DialectPolicy;
use rowscan_protocol::frame::Dialect;
use rowscan_recording::About;

use super::device::DeviceArgs;
use super::endpoint::{Place, announce};
use super::interrupt::Interrupt;
use super::output::say;
use super::recorder::{self, RecordArgs};
use super::scene::SceneArgs;
use super::{Failure, Format, Outcome};
use crate::clock::{TimeScale, Timer};
use crate::emulator::{Bound, Emulator, EmulatorConfig, MAX_CLIENTS};
use crate::line::Pty;

/// Where a SICK scanner listens; both ports take the same commands.
const DEFAULT_ENDPOINTS: [&str; 2] = ["127.0.0.1:2111", "127.0.0.1:2112"];

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Listen on this address; repeatable; port 0 takes a free one [default: 127.0.0.1:2111 and 127.0.0.1:2112]
    #[arg(long, value_name = "ADDR")]
    tcp: Vec<String>,
    /// Be a serial port of this name: a link to a pseudo-terminal, removed at the end
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
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
    let model = args.scene.model(&stage.rig, args.scanner)?;
    let (device, world) = stage.scanner(args.scanner, model)?;
    let (device, state, line_changes) = args.device.set_up(device, stage.scene.seed)?;
    let about = About {
        model: Some(model.name.to_owned()),
        scene: Some(args.scene.name.clone()),
        rig: recorder::rig_text(&stage.rig),
        seed: Some(stage.scene.seed),
        ..About::default()
    };
    // A clock that waits for its clients can wait for the disk too.
    let taping = args.record.start(about, args.time_scale == TimeScale::Max)?;
    let config = EmulatorConfig {
        taps: taping.taps(),
        time_scale: args.time_scale,
        timer: Timer::System,
        dialects: args.dialect.into(),
        max_clients: args.max_clients,
        state,
        line_changes,
    };
    let mut emulator = Emulator::start(device, world, config);
    let mut addresses: Vec<&str> = args.tcp.iter().map(String::as_str).collect();
    if addresses.is_empty() && args.pty.is_none() {
        addresses.extend(DEFAULT_ENDPOINTS);
    }
    let mut bound = Vec::new();
    for address in addresses {
        bound.push(emulator.listen(address).await?);
    }
    for Bound { address } in &bound {
        announce(args.format, "tcp", Place::Address(address))?;
    }
    if let Some(link) = &args.pty {
        let pty = Pty::open(link)?;
        announce(args.format, "pty", Place::Path(pty.path()))?;
        emulator.attach(pty);
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
