//! What the tasks of one virtual CoLa scanner share: the device behind a lock, its clients, its configuration.

use std::net::IpAddr;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_faults::StreamFaults;
use rowscan_ports::Tally;
use rowscan_ports::in_flight::InFlight;
use rowscan_ports::latency::Latency;
use rowscan_protocol::device::{Device, DialectPolicy, Reply, Session};
use rowscan_protocol::frame::Frame;
use rowscan_protocol::telegram::{LmdScandata, Telegram};
use rowscan_protocol::time::SimTime;
use rowscan_recording::{StreamKind, Taps};
use tokio::sync::{Notify, watch};

use crate::clock::{SimClock, TimeScale, Timer};
use crate::datagrams::{DatagramCounts, Datagrams};
use crate::faulted::DeviceFaults;
use crate::line_change::LineChange;
use crate::line_watch::LineWatch;
use crate::refused_settings::RefusedSettings;
use crate::replay::{self, Script, ScriptedReplies};
use crate::roster::Roster;
use crate::state_file::StateFile;

/// Clients served at once, unless told otherwise.
pub const MAX_CLIENTS: usize = 32;

/// How long a client may be idle in a full house, unless told otherwise.
pub const IDLE_LIMIT: Duration = Duration::from_secs(60);

/// How a virtual scanner is run.
#[derive(Clone, Debug)]
pub struct EmulatorConfig {
    /// How simulated time runs.
    pub time_scale: TimeScale,
    /// What wakes the mirror; scanners of one process share it.
    pub timer: Timer,
    /// Which dialects are answered.
    pub dialects: DialectPolicy,
    /// Clients served at once.
    pub max_clients: usize,
    /// In a full house, a client through which nothing has passed for so long makes room; host time.
    pub idle_limit: Duration,
    /// Where mEEwriteall keeps the settings.
    pub state: Option<StateFile>,
    /// Digital lines that change on the way, in any order.
    pub line_changes: Vec<LineChange>,
    /// Who measures the host time that scan telegrams take to their user, if anyone.
    pub latency: Option<Arc<Latency>>,
    /// Where its lines can be watched, if anywhere.
    pub lines: Option<LineWatch>,
    /// Where copies of all bytes go, a stream a client; nowhere unless something records.
    pub taps: Taps,
    /// What those streams are called; as the model is, where absent.
    pub stream: Option<String>,
    /// Addresses that are not this machine's and that its datagrams may go to.
    pub allowed_destinations: Vec<IpAddr>,
    /// What goes wrong between it and its clients. Then a recording holds what went over the clients' wires.
    pub faults: Option<StreamFaults>,
}

impl Default for EmulatorConfig {
    fn default() -> Self {
        Self {
            time_scale: TimeScale::Paced(1.0),
            timer: Timer::default(),
            dialects: DialectPolicy::Auto,
            max_clients: MAX_CLIENTS,
            idle_limit: IDLE_LIMIT,
            state: None,
            line_changes: Vec::new(),
            latency: None,
            lines: None,
            taps: Taps::default(),
            stream: None,
            allowed_destinations: Vec::new(),
            faults: None,
        }
    }
}

/// What all tasks of one virtual scanner share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) device: Mutex<Device>,
    pub(crate) clock: Arc<SimClock>,
    pub(crate) program: Program,
    pub(crate) roster: Roster,
    /// Notified when a client's interest changes, so that whoever waits for a taker looks again.
    pub(crate) interest: Arc<Notify>,
    /// Polls for scans: they take scans without a subscription.
    polls: watch::Sender<Polls>,
    /// How often the device's lines have changed, it has restarted, and its supply has come back: connections look when this changes.
    pub(crate) news: watch::Sender<(u32, u32, u32)>,
    /// Telegrams on their way to clients.
    pub(crate) in_flight: InFlight,
    pub(crate) config: EmulatorConfig,
    pub(crate) counts: Counts,
    pub(crate) refused_settings: Mutex<RefusedSettings>,
    /// Its Compact telegrams.
    pub(crate) datagrams: Datagrams,
    /// What goes wrong with the device itself.
    pub(crate) troubles: Option<Arc<DeviceFaults>>,
}

/// How many polls for scans there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Polls {
    asked: u64,
    /// Of these, answered with the scan after the one they found.
    served: u64,
}

/// Who answers.
#[derive(Debug)]
pub(crate) enum Program {
    /// The device.
    Device,
    /// A recorded device of that name, and the device where nothing was recorded.
    Script(String, Arc<Script>),
    /// Nobody: a stream of that name goes out as it was recorded.
    Verbatim(String, StreamKind),
}

#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) sent: AtomicU64,
    pub(crate) dropped: AtomicU64,
    pub(crate) missed: AtomicU64,
    pub(crate) unheard: AtomicU64,
    /// Nanoseconds of the drive in which nobody took scans, or a request had stopped the device; all, and since somebody last did.
    pub(crate) unheard_ns: AtomicU64,
    pub(crate) silence_ns: AtomicU64,
    /// One more than the number in the last scan telegram; 0 before the first.
    pub(crate) numbered: AtomicU32,
    /// How often a scan telegram's number did not follow on the one before.
    pub(crate) numbered_anew: AtomicU64,
    /// One more than the number in the first scan telegram that somebody took; 0 before it.
    pub(crate) first_taken: AtomicU32,
    pub(crate) refused: Tally,
    pub(crate) silent: Tally,
    pub(crate) idle: Tally,
}

/// What a virtual scanner has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmulatorCounts {
    /// Scan telegrams handed to clients, one a client.
    pub scans_sent: u64,
    /// Scan telegrams a client was too slow to take.
    pub scans_dropped: u64,
    /// Scan telegrams, of those sent, that faults have kept from their client; none where nothing can go wrong there.
    pub scans_kept_by_faults: Option<u64>,
    /// Scans left out because the host was too slow for the mirror.
    pub scans_missed: u64,
    /// Scans measured while nobody took them.
    pub scans_unheard: u64,
    /// The number in the last scan telegram that was measured, taken or not.
    pub last_counter: Option<u16>,
    /// How often it has begun to number its scan telegrams anew, as after a power cycle.
    pub numbered_anew: u64,
    /// The number in the first scan telegram that went out to a taker.
    pub first_taken: Option<u16>,
    /// How long in the drive nobody took scans, or a request had stopped the device.
    pub unheard: Duration,
    /// The same since somebody last took a scan.
    pub silence: Duration,
    /// Connections turned away because the house was full.
    pub connections_refused: u64,
    /// Connections closed in a full house because not one valid telegram had come.
    pub connections_silent: u64,
    /// Connections closed in a full house because nothing had passed for [`EmulatorConfig::idle_limit`].
    pub connections_idle: u64,
    /// What became of its datagrams; none where it sends none.
    pub datagrams: Option<DatagramCounts>,
}

/// The number of a scan telegram, which is kept as one more; none before there was one.
fn number_in(kept: &AtomicU32) -> Option<u16> {
    kept.load(Ordering::Relaxed).checked_sub(1).map(|counter| counter as u16)
}

impl Counts {
    /// A scan telegram of this number was measured.
    pub(crate) fn number(&self, counter: u16) {
        let last = self.numbered.swap(u32::from(counter) + 1, Ordering::Relaxed).checked_sub(1);
        let follows = last.is_none_or(|last| counter.wrapping_sub(last as u16) < 0x8000);
        self.numbered_anew.fetch_add(u64::from(!follows), Ordering::Relaxed);
    }

    pub(crate) fn so_far(&self) -> EmulatorCounts {
        EmulatorCounts {
            scans_sent: self.sent.load(Ordering::Relaxed),
            scans_dropped: self.dropped.load(Ordering::Relaxed),
            scans_kept_by_faults: None,
            scans_missed: self.missed.load(Ordering::Relaxed),
            scans_unheard: self.unheard.load(Ordering::Relaxed),
            last_counter: number_in(&self.numbered),
            numbered_anew: self.numbered_anew.load(Ordering::Relaxed),
            first_taken: number_in(&self.first_taken),
            unheard: Duration::from_nanos(self.unheard_ns.load(Ordering::Relaxed)),
            silence: Duration::from_nanos(self.silence_ns.load(Ordering::Relaxed)),
            connections_refused: self.refused.total(),
            connections_silent: self.silent.total(),
            connections_idle: self.idle.total(),
            datagrams: None,
        }
    }
}

impl Shared {
    /// Scans that were counted as sent were sent to nobody.
    pub(crate) fn count_as_dropped(&self, scans: u64) {
        self.counts.dropped.fetch_add(scans, Ordering::Relaxed);
        self.counts.sent.fetch_sub(scans, Ordering::Relaxed);
    }

    pub(crate) fn new(
        device: Device,
        program: Program,
        clock: Arc<SimClock>,
        interest: Arc<Notify>,
        config: EmulatorConfig,
    ) -> Arc<Self> {
        let delivery = clock.delivery();
        // What is recorded cannot be otherwise.
        let faults = config.faults.as_ref().filter(|_| matches!(program, Program::Device));
        let troubles = faults.map(|faults| {
            let troubles = DeviceFaults::cola(&interest, device.model());
            faults.part(Arc::<DeviceFaults>::clone(&troubles));
            troubles
        });
        Arc::new(Self {
            device: Mutex::new(device),
            clock,
            program,
            roster: Roster::new(config.max_clients, config.idle_limit, delivery),
            refused_settings: Mutex::default(),
            troubles,
            interest,
            polls: watch::Sender::default(),
            news: watch::Sender::default(),
            in_flight: InFlight::default(),
            datagrams: Datagrams::new(config.allowed_destinations.clone()),
            config,
            counts: Counts::default(),
        })
    }

    /// A recorded stream goes out as it was, and nobody is answered.
    pub(crate) fn is_verbatim(&self) -> bool {
        matches!(self.program, Program::Verbatim(..))
    }

    /// What it sends by itself comes from a recording.
    pub(crate) fn is_replayed(&self) -> bool {
        !matches!(self.program, Program::Device)
    }

    pub(crate) fn device(&self) -> MutexGuard<'_, Device> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets `session` answer `peer`, as it is prompted; the settings, if mEEwriteall was among the requests.
    pub(crate) fn converse(
        &self,
        peer: &str,
        session: &mut Session,
        mut scripted: Option<&mut ScriptedReplies>,
        bytes: &[u8],
        replies: &mut Vec<Reply>,
    ) -> Option<String> {
        let mut device = self.device();
        let now = self.clock.now();
        self.obey(&mut device, now);
        let saves = device.saves();
        let was_streaming = self.datagrams.is_streaming(&device);
        let mut polls = 0;
        let mut fixed = device.fixed_by_recording();
        session.handle_bytes_with(&mut device, now, bytes, replies, &mut |device, frame, reply| {
            let is_fixed = std::mem::replace(&mut fixed, device.fixed_by_recording()) != fixed;
            let replaced = scripted.as_mut().is_some_and(|scripted| scripted.amend(device, frame, reply));
            if is_fixed && !replaced {
                self.note_refused(peer, frame);
            }
            polls += u64::from(replay::polls(frame));
        });
        if polls > 0 {
            self.polls.send_modify(|known| known.asked += polls);
        }
        self.notice(&device, was_streaming);
        (device.saves() != saves).then(|| device.saved_settings())
    }

    /// Whether somebody takes its scans: a subscriber, a client that polls, or a place that datagrams go to.
    pub(crate) fn has_taker(&self) -> bool {
        self.takes_events() || self.polls_take_scans() || self.datagrams.has_taker(&self.device())
    }

    /// Whether a subscriber gets scans.
    pub(crate) fn takes_events(&self) -> bool {
        self.roster.has_audience() && (self.is_replayed() || self.device().sends_scan_events())
    }

    /// What it has done so far.
    pub(crate) fn counted(&self) -> EmulatorCounts {
        let datagrams = self.datagrams.counts(&self.device());
        // Datagrams pass no stream's faults.
        let faults = self.config.faults.as_ref().filter(|_| datagrams.is_none());
        let scans_kept_by_faults = faults.map(StreamFaults::lost);
        EmulatorCounts { datagrams, scans_kept_by_faults, ..self.counts.so_far() }
    }

    /// Lets `ask` have the device as it is now; the settings, if they were saved.
    pub(crate) fn ask(&self, ask: &mut dyn FnMut(&mut Device, SimTime)) -> Option<String> {
        let mut device = self.device();
        let now = self.clock.now();
        self.obey(&mut device, now);
        let (was_streaming, saves) = (self.datagrams.is_streaming(&device), device.saves());
        ask(&mut device, now);
        self.notice(&device, was_streaming);
        (device.saves() != saves).then(|| device.saved_settings())
    }

    /// Has everybody notice what a client has changed.
    fn notice(&self, device: &Device, was_streaming: bool) {
        self.spread(device);
        self.datagrams.tell(device);
        if self.datagrams.is_streaming(device) != was_streaming {
            // Time may wait for whoever takes scans.
            self.interest.notify_one();
        }
    }

    /// When something goes wrong with the device, or comes right, next.
    pub(crate) fn next_change(&self) -> Option<SimTime> {
        self.troubles.as_ref().and_then(|troubles| troubles.next())
    }

    /// Does what goes wrong with the device, or comes right, by `at`.
    pub(crate) fn change(&self, at: SimTime) {
        let mut device = self.device();
        self.obey(&mut device, at);
        self.spread(&device);
    }

    fn obey(&self, device: &mut Device, now: SimTime) {
        if let Some(troubles) = &self.troubles {
            troubles.act_on(device, now);
        }
    }

    /// Notes a setting that the recording does not allow.
    fn note_refused(&self, peer: &str, frame: &Frame<'_>) {
        let name = Telegram::parse(frame.dialect, frame.payload).map_or("", |telegram| telegram.name);
        let mut refused = self.refused_settings.lock().unwrap_or_else(PoisonError::into_inner);
        if refused.note(peer, name) {
            tracing::warn!("{name} of {peer} is refused: the recorded scans do not have what it asks for");
        }
    }

    /// Shows a recorded scan to whoever polls; gives it as it is to be sent where less is asked for than was recorded.
    pub(crate) fn show(&self, scan: LmdScandata) -> Option<LmdScandata> {
        let mut device = self.device();
        let cut = device.is_cut().then(|| {
            let mut cut = scan.clone();
            device.cut_to_measure(&mut cut);
            cut
        });
        device.show_scan(scan);
        cut
    }

    /// Whether anybody takes scans by polls. Off a recording a single poll takes none, or a client that looks whether there is a scan, and then
    /// subscribes, would lose what is played meanwhile.
    pub(crate) fn polls_take_scans(&self) -> bool {
        self.polls.borrow().asked > u64::from(self.is_replayed())
    }

    /// Waits for a poll that no scan has been played for. Cancel safe.
    pub(crate) async fn next_poll(&self) {
        loop {
            let interest = self.interest.notified();
            let comes = |polls: &mut Polls| {
                let comes = polls.served < polls.asked;
                polls.served += u64::from(comes);
                comes
            };
            if self.polls.send_if_modified(comes) {
                return;
            }
            interest.await;
        }
    }

    /// Whether polls wait for the mirror's next turn.
    pub(crate) fn polls_wait(&self) -> bool {
        let polls = *self.polls.borrow();
        polls.served < polls.asked
    }

    /// The mirror has turned for the polls that wait; false if there were none.
    pub(crate) fn answer_polls(&self) -> bool {
        self.polls.send_if_modified(|polls| std::mem::replace(&mut polls.served, polls.asked) != polls.asked)
    }

    /// Waits until the mirror has turned for all polls so far. Cancel safe.
    pub(crate) async fn polls_answered(&self) {
        // The sender is part of this.
        let _ = self.polls.subscribe().wait_for(|polls| polls.served == polls.asked).await;
    }

    /// Notifies every connection if there is anything new about the device.
    pub(crate) fn spread(&self, device: &Device) {
        let news = (device.changes(), device.reboots(), device.power_cycles());
        self.news.send_if_modified(|known| std::mem::replace(known, news) != news);
    }
}
