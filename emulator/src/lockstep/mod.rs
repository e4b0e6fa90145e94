//! The lockstep clock: simulated time goes on only when every participant has acknowledged the last step.
//!
//! A step ends with the instants at which scanners act: everything due until then has been sent, in the timeline's order. Then the clock
//! waits for the acknowledgement that was asked for, and takes in what the participants have sent. Where the kernel tells, it waits after
//! each source as well. It never goes on without:
//! past the deadline the run ends with an error that names the step and who is missing.

mod bystanders;
mod children;
#[cfg(target_os = "linux")]
mod hung_up;
mod level;
mod looked;
mod outputs;
#[cfg(target_os = "linux")]
mod receivers;
mod reply;
#[cfg(target_os = "linux")]
mod sockets;
#[cfg_attr(not(target_os = "linux"), path = "unread_elsewhere.rs")]
mod unread;
#[cfg_attr(not(target_os = "linux"), path = "watch_elsewhere.rs")]
mod watch;

use std::net::{SocketAddr, SocketAddrV4};
use std::sync::Arc;
use std::time::Duration;

use rowscan_ports::clock::{self, Stopwatch};
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::time::SimTime;
use tokio::sync::Notify;

pub use children::ChildClock;
pub use level::{Ack, AckError, OutputAck, OutputPort};
pub use unread::{unread, unread_datagrams};

use crate::clock::SimClock;
use crate::compute::Compute;
use crate::gap::Gaps;
use crate::sleeps::{SHORTEST, Sleep, Sleeps};
use crate::steps::Steps;
pub(crate) use bystanders::Bystanders;
use looked::Looked;
pub(crate) use outputs::OutputCount;
use outputs::Outputs;
use reply::{Replies, ReplyQuery};
use watch::Watch;

/// Time between two looks that must find the same.
const APART: Duration = Duration::from_micros(50);

/// How long the clock only yields between two looks: the runtime's timer takes up to two milliseconds for one, a quarter of this.
const YIELDING: Duration = Duration::from_millis(8);

/// How a rig's clock waits for its participants.
#[derive(Clone, Debug)]
pub struct LockstepConfig {
    /// What counts as an acknowledgement; all of them are needed.
    pub acks: Vec<Ack>,
    /// Host time after which a missing acknowledgement ends the run.
    pub deadline: Duration,
    /// How much later what participants say on a bus takes effect.
    pub compute: Compute,
}

/// A TCP connection of this program with another one on this machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unread {
    /// This program's end.
    pub here: SocketAddr,
    /// Bytes that this program has written since the connection was opened.
    pub written: u64,
    /// Bytes of these that the other program has not read.
    pub unread: u64,
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
#[derive(Debug)]
pub struct Lockstep {
    config: LockstepConfig,
    watch: Option<Watch>,
    replies: Vec<Replies>,
    outputs: Vec<Outputs>,
    bystanders: Bystanders,
    /// Notified when somebody comes to take part.
    joined: Arc<Notify>,
    gaps: Gaps,
    sleeps: Sleeps,
    /// The clock of children that wait by simulated time.
    children: Option<ChildClock>,
    step: u64,
}

impl Lockstep {
    /// Opens what the acknowledgements need.
    pub async fn open(config: LockstepConfig) -> Result<Self, LockstepOpenError> {
        let (mut replies, mut outputs) = (Vec::new(), Vec::new());
        let joined = Arc::new(Notify::new());
        let refused = |address: &str, cause| LockstepOpenError::Listen { address: address.to_owned(), cause };
        for ack in &config.acks {
            match ack {
                Ack::Reply(address) => {
                    let listen = Replies::listen(address, Arc::clone(&joined)).await;
                    replies.push(listen.map_err(|cause| refused(address, cause))?);
                }
                Ack::Output(output) => {
                    let open = Outputs::open(output.clone(), Arc::clone(&joined)).await;
                    outputs.push(open.map_err(|cause| match &output.port {
                        OutputPort::Tcp(address) | OutputPort::Udp(address) => refused(address, cause),
                        OutputPort::Can(_) => refused("can0", cause),
                    })?);
                }
                // The kernel is asked below; steps are granted at the rig's control.
                Ack::Sent | Ack::Read | Ack::Idle | Ack::Clock => {}
            }
        }
        let level = config.acks.iter().filter_map(Ack::kernel).max();
        let bystanders = Bystanders::default();
        let watch = level
            .map(|level| Watch::open(level, bystanders.clone()))
            .transpose()
            .map_err(LockstepOpenError::Kernel)?;
        let (gaps, sleeps) = (Gaps::default(), Sleeps::default());
        Ok(Self {
            config,
            watch,
            replies,
            outputs,
            bystanders,
            joined,
            gaps,
            sleeps,
            children: None,
            step: 0,
        })
    }

    /// Has time wait for the timers of children, and theirs for it. They must be idle, too, where the kernel says who is.
    pub fn with_children(self, children: ChildClock) -> Self {
        Self { children: Some(children), ..self }
    }

    /// The clock of children that wait by simulated time.
    pub(crate) fn children(&self) -> Option<&ChildClock> {
        self.children.as_ref()
    }

    /// Where participants acknowledge, if they are asked to.
    pub fn address(&self) -> Option<SocketAddr> {
        self.replies.first().map(Replies::address)
    }

    /// All places that this opened, by the names of their endpoints.
    pub fn endpoints(&self) -> impl Iterator<Item = (&'static str, SocketAddr)> {
        let replies = self.replies.iter().map(|replies| ("ack", replies.address()));
        replies.chain(self.outputs.iter().filter_map(|outputs| Some(("output", outputs.address()?))))
    }

    /// When nobody took scans, and time went on at the host's pace.
    pub fn gaps(&self) -> Gaps {
        self.gaps.clone()
    }

    /// When a participant slept by the host's time, and held time.
    pub fn sleeps(&self) -> Sleeps {
        self.sleeps.clone()
    }

    /// Whether somebody must grant steps.
    pub fn needs_grants(&self) -> bool {
        self.config.acks.contains(&Ack::Clock)
    }

    /// Whether frames on the rig's bus acknowledge.
    pub fn needs_bus(&self) -> bool {
        self.outputs.iter().any(|outputs| outputs.of_bus().is_some())
    }

    /// True if a step is acknowledged as soon as the kernel says so.
    pub fn asks_only_the_kernel(&self) -> bool {
        self.replies.is_empty() && self.outputs.is_empty()
    }

    /// Who takes no part.
    pub(crate) fn bystanders(&self) -> Bystanders {
        self.bystanders.clone()
    }

    /// Who counts the frames that others send on the rig's bus.
    pub(crate) fn bus_counts(&self) -> Vec<OutputCount> {
        self.outputs.iter().filter_map(Outputs::of_bus).collect()
    }

    /// How much later what participants say on a bus takes effect.
    pub(crate) fn compute(&self) -> Compute {
        self.config.compute.clone()
    }

    /// Notified when somebody comes to take part: time may wait for that alone.
    pub(crate) fn joined(&self) -> Arc<Notify> {
        Arc::clone(&self.joined)
    }

    /// True once somebody takes part that steps can be asked of.
    pub(crate) fn has_participants(&self) -> bool {
        self.replies.iter().all(|replies| !replies.participants().is_empty())
            && self.outputs.iter().all(Outputs::has_participant)
    }

    /// Whether somebody on this machine listens for datagrams to `to`; true where nobody tells.
    pub(crate) fn has_receiver(&mut self, to: SocketAddrV4) -> bool {
        self.watch.as_mut().is_none_or(|watch| watch.has_receiver(to))
    }

    /// Something of the next step is about to be sent: outputs from now on are answers to it.
    pub(crate) fn arm(&mut self) {
        self.config.compute.begin_step();
        self.outputs.iter_mut().for_each(Outputs::begin);
    }

    /// All that was due until `at` is out: the step begins to be waited for.
    pub(crate) fn begin(&mut self, at: SimTime) {
        self.step += 1;
        for replies in &self.replies {
            replies.ask(ReplyQuery { step: self.step, at });
        }
    }

    /// Waits until the next step should have been granted; for ever if steps need no grant, before the first one, and while `clock` is paused.
    pub(crate) fn overdue_grant(
        &self,
        steps: Steps,
        clock: Arc<SimClock>,
    ) -> impl Future<Output = LockstepError> + use<> {
        let (deadline, needed) = (self.config.deadline, self.needs_grants());
        async move {
            loop {
                let never = std::future::pending::<()>();
                if clock::within(deadline, never).await.is_none()
                    && needed
                    && steps.taken() > 0
                    && !clock.is_paused()
                {
                    let missing = "nobody has granted the next step".to_owned();
                    return LockstepError { step: steps.taken() + 1, at: clock.now(), deadline, missing };
                }
            }
        }
    }

    /// Waits until what has been handed over is written. Cancel safe.
    pub(crate) async fn written(&self, at: SimTime, pending: &[InFlight]) -> Result<(), LockstepError> {
        let written = async {
            for pending in pending {
                pending.flushed().await;
            }
        };
        let overdue = || self.overdue(at, "a peer's socket takes nothing more".to_owned());
        clock::within(self.config.deadline, written).await.ok_or_else(overdue)
    }

    /// Waits until the participants have taken in what one source has sent, as far as the kernel tells: so the order in which a participant
    /// hears several streams does not hang on the host. Cancel safe.
    pub(crate) async fn settled(&mut self, at: SimTime) -> Result<(), LockstepError> {
        if self.watch.is_none() {
            return Ok(());
        }
        self.until(at, Self::look_at_kernel).await
    }

    /// Waits for the step's acknowledgement. Cancel safe.
    pub(crate) async fn acknowledged(&mut self, at: SimTime) -> Result<(), LockstepError> {
        self.until(at, Self::look).await?;
        self.outputs.iter_mut().for_each(Outputs::end);
        Ok(())
    }

    async fn until(&mut self, at: SimTime, look: fn(&mut Self) -> Looked) -> Result<(), LockstepError> {
        let stopwatch = Stopwatch::start();
        let mut asleep: Option<(u32, Stopwatch)> = None;
        loop {
            let looked = look(self);
            let waited = stopwatch.elapsed();
            // Who is fast has read what came: only of a long wait it is asked what for.
            let sleeper = match looked {
                Looked::Missing(_) if waited >= YIELDING => self.watch.as_mut().and_then(Watch::sleeper),
                _ => None,
            };
            if asleep.map(|(process, _)| process) != sleeper {
                let slept =
                    asleep.take().map(|(process, since)| Sleep { at, took: since.elapsed(), process });
                slept
                    .filter(|sleep| sleep.took >= SHORTEST)
                    .into_iter()
                    .for_each(|sleep| self.sleeps.note(sleep));
                asleep = sleeper.map(|process| (process, Stopwatch::start()));
            }
            match looked {
                Looked::Acknowledged => return Ok(()),
                // Others run meanwhile: one may have to take in what a child has said.
                Looked::Settling => {
                    clock::spin(APART);
                    tokio::task::yield_now().await;
                }
                Looked::Missing(missing) if waited >= self.config.deadline => {
                    let children = self.children.as_ref();
                    let doing = self.watch.as_mut().map(|watch| watch.describe(children)).unwrap_or_default();
                    return Err(self.overdue(at, missing + &doing));
                }
                // At first only a yield, so that a fast peer costs little; then a millisecond, so that a slow one gets the processor.
                Looked::Missing(_) if waited < YIELDING => tokio::task::yield_now().await,
                Looked::Missing(_) => clock::rest(Duration::from_millis(1)).await,
            }
        }
    }

    /// The present step is not acknowledged in time.
    fn overdue(&self, at: SimTime, missing: String) -> LockstepError {
        LockstepError { step: self.step, at, deadline: self.config.deadline, missing }
    }

    fn look(&mut self) -> Looked {
        let replies = self.replies.iter().map(|replies| replies.look(self.step));
        let mut asked = replies.chain(self.outputs.iter().map(Outputs::look));
        if let Some(missing) = asked.find(|looked| matches!(looked, Looked::Missing(_))) {
            return missing;
        }
        self.look_at_kernel()
    }

    fn look_at_kernel(&mut self) -> Looked {
        let children = self.children.as_ref();
        self.watch.as_mut().map_or(Looked::Acknowledged, |watch| watch.look(children))
    }
}
