//! Whether the simulated clock waits for its participants, and for what of them.

use std::time::Duration;

use rowscan_emulator::Compute;
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::lockstep::{Ack, Lockstep, LockstepConfig};

use super::endpoint::announce_stream;
use super::{Failure, Format};

#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Clock")]
pub(super) struct LockstepArgs {
    /// What drives simulated time: the host's clock by --time-scale, or the participants, who acknowledge each step
    #[arg(long, value_enum, default_value_t)]
    clock: ClockArg,
    /// What counts as an acknowledgement, in lockstep: sent (the peers' kernels have it), read (the peers have read it), idle (they have and wait for
    /// input), reply:HOST:PORT (they say so there), output:can0[,id=HEX][,count=K], output:tcp:HOST:PORT or output:udp:HOST:PORT (so many outputs come in
    /// there), clock (POST /step of --control); repeatable, all are needed, of sent, read and idle the strongest [default: idle]
    #[arg(long, value_name = "LEVEL")]
    ack: Vec<Ack>,
    /// Length of a step, simulated milliseconds [default: a step ends whenever scanners act]
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    step_ms: Option<f64>,
    /// Host seconds after which a missing acknowledgement ends the run, exit code 2
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = seconds)]
    deadline_wall_s: f64,
}

/// What drives simulated time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum ClockArg {
    /// The host's clock
    #[default]
    Paced,
    /// The participants
    Lockstep,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.001..=86_400.0).contains(&seconds) => Ok(seconds),
        _ => Err(format!("expected 0.001 to 86400 seconds, found `{text}`")),
    }
}

fn milliseconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ms) if (0.001..=60_000.0).contains(&ms) => Ok(ms),
        _ => Err(format!("expected 0.001 to 60000 milliseconds, found `{text}`")),
    }
}

/// What acknowledgements may come by.
pub(super) struct Ways {
    /// A bus.
    pub(super) bus: bool,
    /// A control.
    pub(super) control: bool,
}

impl LockstepArgs {
    /// The length of a step, where one is asked for.
    pub(super) fn step(&self) -> Option<Duration> {
        self.step_ms.map(|ms| Duration::from_secs_f64(ms / 1e3))
    }

    /// The time scale that the clock asks for: in lockstep, as fast as acknowledgements come.
    pub(super) fn time_scale(&self, asked: Option<TimeScale>) -> Result<TimeScale, Failure> {
        match (self.clock, asked) {
            (ClockArg::Paced, _) if !self.ack.is_empty() => {
                Err(Failure::Usage("--ack is of a clock in lockstep: add --clock lockstep".to_owned()))
            }
            (ClockArg::Paced, asked) => Ok(asked.unwrap_or(TimeScale::Paced(1.0))),
            (ClockArg::Lockstep, None | Some(TimeScale::Max)) => Ok(TimeScale::Max),
            (ClockArg::Lockstep, Some(TimeScale::Paced(_))) => Err(Failure::Usage(
                "in lockstep the participants set the pace: leave --time-scale out".to_owned(),
            )),
        }
    }

    /// The acknowledgements that time waits for, their endpoints announced; none without lockstep.
    pub(super) async fn open(&self, ways: &Ways, format: Format) -> Result<Option<Lockstep>, Failure> {
        if self.clock != ClockArg::Lockstep {
            return Ok(None);
        }
        let acks = if self.ack.is_empty() { vec![Ack::Idle] } else { self.ack.clone() };
        let deadline = Duration::from_secs_f64(self.deadline_wall_s);
        let lockstep = Lockstep::open(LockstepConfig { acks, deadline, compute: Compute::default() }).await?;
        if lockstep.needs_bus() && !ways.bus {
            return Err(Failure::Usage("--ack output:can0 needs a bus: add --can PORT".to_owned()));
        }
        if lockstep.needs_grants() && !ways.control {
            return Err(Failure::Usage(
                "--ack clock needs somebody to grant steps: add --control ADDR".to_owned(),
            ));
        }
        for (name, address) in lockstep.endpoints() {
            announce_stream(format, None, name, &address)?;
        }
        Ok(Some(lockstep))
    }
}
