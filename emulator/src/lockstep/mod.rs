//! The lockstep clock: simulated time goes on only when every participant has acknowledged the last step.
//!
//! A step ends with the instants at which scanners act: everything due until then has been sent, in the timeline's order. Then the clock
//! waits for the acknowledgement that was asked for, and takes in what the participants have sent. Where the kernel tells, it waits after
//! each source as well. It never goes on without:
//! past the deadline the run ends with an error that names the step and who is missing.

mod level;
#[cfg(target_os = "linux")]
mod processes;
mod reply;
#[cfg(target_os = "linux")]
mod sockets;
#[cfg_attr(not(target_os = "linux"), path = "watch_elsewhere.rs")]
mod watch;

use std::fmt;
use std::time::Duration;

use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::time::SimTime;

pub use level::{Ack, AckError};

use crate::clock::{self, Stopwatch};
use reply::{Asked, Replies};
use watch::{Looked, Watch};

/// How a rig's clock waits for its participants.
#[derive(Clone, Debug)]
pub struct LockstepConfig {
    /// What counts as an acknowledgement; all of them are needed.
    pub acks: Vec<Ack>,
    /// Host time after which a missing acknowledgement ends the run.
    pub deadline: Duration,
}

/// Why a lockstep clock could not begin.
#[derive(Debug, thiserror::Error)]
pub enum LockstepOpenError {
    /// The endpoint for acknowledgements.
    #[error("cannot listen on {address} for acknowledgements: {cause}")]
    Listen {
        /// What was asked for.
        address: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The kernel tells nothing about sockets.
    #[error("the kernel does not tell what is unread (sock_diag): {0}; take --ack reply:HOST:PORT")]
    Kernel(std::io::Error),
}

/// A step that was not acknowledged in time.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("lockstep: step {step} at {:.6} s was not acknowledged within {deadline:?}: {missing}", at.as_secs_f64())]
pub struct LockstepError {
    /// The step, from 1.
    pub step: u64,
    /// Its simulated time.
    pub at: SimTime,
    /// How long it was given.
    pub deadline: Duration,
    /// Who has not acknowledged it, and what that one does.
    pub missing: String,
}

/// The steps of one rig.
pub struct Lockstep {
    config: LockstepConfig,
    watch: Option<Watch>,
    replies: Option<Replies>,
    step: u64,
}

impl fmt::Debug for Lockstep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Lockstep")
            .field("config", &self.config)
            .field("step", &self.step)
            .finish_non_exhaustive()
    }
}

impl Lockstep {
    /// Opens what the acknowledgements need.
    pub async fn open(config: LockstepConfig) -> Result<Self, LockstepOpenError> {
        let (mut watch, mut replies) = (None, None);
        for ack in &config.acks {
            match ack {
                Ack::Reply(address) => {
                    let listen = Replies::listen(address).await;
                    let address = address.clone();
                    replies = Some(listen.map_err(|cause| LockstepOpenError::Listen { address, cause })?);
                }
                level => watch = Some(Watch::open(level.clone()).map_err(LockstepOpenError::Kernel)?),
            }
        }
        Ok(Self { config, watch, replies, step: 0 })
    }

    /// Where participants acknowledge, if they are asked to.
    pub fn address(&self) -> Option<std::net::SocketAddr> {
        self.replies.as_ref().map(Replies::address)
    }

    /// True once somebody takes part that steps can be asked of.
    pub(crate) fn has_participants(&self) -> bool {
        self.replies.as_ref().is_none_or(|replies| !replies.participants().is_empty())
    }

    /// All that was due until `at` is out: the next step begins to be waited for.
    pub(crate) fn begin(&mut self, at: SimTime) {
        self.step += 1;
        if let Some(replies) = &self.replies {
            replies.ask(Asked { step: self.step, at });
        }
    }

    /// Waits until what has been handed over is written. Cancel safe.
    pub(crate) async fn written(&self, at: SimTime, pending: &[InFlight]) -> Result<(), LockstepError> {
        let deadline = self.config.deadline;
        let written = async {
            for pending in pending {
                pending.flushed().await;
            }
        };
        let missing = || "a peer's socket takes nothing more".to_owned();
        let error = || LockstepError { step: self.step, at, deadline, missing: missing() };
        rowscan_ports::clock::within(deadline, written).await.ok_or_else(error)
    }

    /// Waits until the participants have taken in what one source has sent, as far as the kernel tells: so the order in which a participant
    /// hears several streams does not hang on the host. Cancel safe.
    pub(crate) async fn settled(&mut self, at: SimTime) -> Result<(), LockstepError> {
        self.until(at, Self::look_at_kernel).await
    }

    /// Waits for the step's acknowledgement. Cancel safe.
    pub(crate) async fn acknowledged(&mut self, at: SimTime) -> Result<(), LockstepError> {
        self.until(at, Self::look).await
    }

    async fn until(&mut self, at: SimTime, look: fn(&mut Self) -> Looked) -> Result<(), LockstepError> {
        let stopwatch = Stopwatch::start();
        let mut looks = 0_u32;
        loop {
            let missing = match look(self) {
                Looked::Acknowledged => return Ok(()),
                Looked::Missing(who) => who,
            };
            if stopwatch.elapsed() >= self.config.deadline {
                let deadline = self.config.deadline;
                let doing = self.watch.as_mut().map(Watch::describe).unwrap_or_default();
                let missing = missing + &doing;
                return Err(LockstepError { step: self.step, at, deadline, missing });
            }
            looks = looks.saturating_add(1);
            clock::look_again(looks).await;
        }
    }

    fn look(&mut self) -> Looked {
        if let Some(replies) = &self.replies {
            for participant in replies.participants() {
                if let Some(nonsense) = participant.nonsense {
                    let peer = participant.peer;
                    return Looked::Missing(format!(
                        "{peer} said `{nonsense}`, expected `ACK {}`",
                        self.step
                    ));
                }
                if participant.acknowledged < self.step {
                    return Looked::Missing(format!("{} has not sent `ACK {}`", participant.peer, self.step));
                }
            }
        }
        self.look_at_kernel()
    }

    fn look_at_kernel(&mut self) -> Looked {
        self.watch.as_mut().map_or(Looked::Acknowledged, Watch::look)
    }
}
