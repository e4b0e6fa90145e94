//! The virtual LMS2xx: one task with the device, its view and its line. All bytes of the line pass here, at the pace of the line.

use std::collections::VecDeque;
use std::future::{pending, poll_fn};
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::Poll;
use std::time::Duration;

use rowscan_protocol::device::Mirror;
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::device::{Beams, Device, Sweep};
use rowscan_protocol::lms2xx::model::TURNS_PER_SECOND;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use tokio::io::{AsyncWriteExt, ReadBuf};
use tokio::task::JoinSet;

use super::serial_tape::{self, Eye, SerialTape, Telegram};
use super::state_file::StateFile;
use super::voices::{self, Can, Speaking, Voices};
use super::world::World;
use crate::clock::{SimClock, TimeScale};
use rowscan_bus::Inbox;
use rowscan_ports::in_flight::UnderWay;
use rowscan_ports::{Wire, uart};

/// Bytes taken from a client at a time.
const READ_CHUNK: usize = 512;
/// How often a telegram under way is handed on, host time: what a client sees of the line's pace.
const PIECE: Duration = Duration::from_millis(3);
/// Requests on their way to the device; more is more than a line carries.
const MAX_ARRIVING: usize = 64;

/// How a virtual LMS2xx is run.
#[derive(Clone, Debug)]
pub struct SerialConfig {
    /// How simulated time runs.
    pub time_scale: TimeScale,
    /// Where the configuration block is kept.
    pub state: Option<StateFile>,
    /// Who records the line.
    pub taps: Taps,
}

/// What a virtual LMS2xx has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SerialCounts {
    /// Scan telegrams put on the line.
    pub scans_sent: u64,
    /// Bytes lost because the client did not take them.
    pub bytes_lost: u64,
}

#[derive(Debug, Default)]
struct Counts {
    sent: AtomicU64,
    lost: AtomicU64,
}

/// A running virtual LMS2xx. Dropping it ends it, and its line goes.
#[derive(Debug)]
pub struct SerialEmulator {
    counts: Arc<Counts>,
    /// What it plays, if it is a recorded one.
    tape: Option<SerialTape>,
    _tasks: JoinSet<()>,
}

impl SerialEmulator {
    /// Puts `device` in `world` on `wire`.
    pub fn start(device: Device, world: World, wire: Box<dyn Wire>, config: SerialConfig) -> Self {
        Self::start_with(device, world, wire, Voices::default(), config)
    }

    /// The same with what else speaks on its tractor, which wants a paced clock: one that waits for a client on the line would not wait for
    /// theirs.
    pub fn start_with(
        device: Device,
        world: World,
        wire: Box<dyn Wire>,
        voices: Voices,
        config: SerialConfig,
    ) -> Self {
        let (voices, listening) = voices.start(config.time_scale, &config.taps);
        let clock = Arc::new(SimClock::start(config.time_scale));
        let tap = config.taps.open(device.model().name, StreamKind::Lms2xx);
        let eye = Eye::World(Box::new(world));
        Self::run(device, eye, wire, (voices, listening), (clock, config.state, tap), None)
    }

    /// A recorded LMS2xx on `wire`, whose values come from a [`Player`](super::Player); it is recorded again as `name`.
    pub fn replay(
        device: Device,
        name: &str,
        wire: Box<dyn Wire>,
        clock: Arc<SimClock>,
        config: SerialConfig,
    ) -> Self {
        let (tape, eye) = serial_tape::tape(clock.scale());
        let tap = config.taps.open(name, StreamKind::Lms2xx);
        let silent = (Speaking::default(), None);
        Self::run(device, eye, wire, silent, (clock, config.state, tap), Some(tape))
    }

    fn run(
        device: Device,
        eye: Eye,
        wire: Box<dyn Wire>,
        (voices, listening): (Speaking, Option<(Arc<Can>, Inbox)>),
        (clock, state, tap): (Arc<SimClock>, Option<StateFile>, Tap),
        tape: Option<SerialTape>,
    ) -> Self {
        let counts = Arc::new(Counts::default());
        let scanner = Scanner {
            clock: Arc::clone(&clock),
            state,
            saves: device.saves(),
            device,
            eye,
            voices,
            wire,
            tap,
            arriving: VecDeque::new(),
            sending: None,
            playing: None,
            free: SimTime::ZERO,
            counts: Arc::clone(&counts),
        };
        let mut tasks = JoinSet::new();
        if let Some((can, inbox)) = listening {
            tasks.spawn(voices::listen(clock, can, inbox));
        }
        tasks.spawn(async move {
            if let Err(cause) = scanner.run().await {
                tracing::error!(%cause, "the line is gone");
            }
        });
        Self { counts, tape, _tasks: tasks }
    }

    /// The way to play to it; none if it looks by itself.
    pub(crate) fn tape(&self) -> Option<&SerialTape> {
        self.tape.as_ref()
    }

    /// What it has done so far.
    pub fn counts(&self) -> SerialCounts {
        SerialCounts {
            scans_sent: self.counts.sent.load(Ordering::Relaxed),
            bytes_lost: self.counts.lost.load(Ordering::Relaxed),
        }
    }
}

#[derive(Debug)]
struct Scanner {
    clock: Arc<SimClock>,
    device: Device,
    eye: Eye,
    voices: Speaking,
    wire: Box<dyn Wire>,
    state: Option<StateFile>,
    saves: u32,
    tap: Tap,
    /// What the client has sent and is still on the line.
    arriving: VecDeque<Arriving>,
    sending: Option<Sending>,
    /// Of the recorded telegram that the line is busy with.
    playing: Option<UnderWay>,
    /// When the line was, or will be, free of what the device sends.
    free: SimTime,
    counts: Arc<Counts>,
}

/// Bytes from a client, on their way.
#[derive(Debug)]
struct Arriving {
    first: SimTime,
    spacing: Duration,
    last: SimTime,
    bytes: Vec<u8>,
}

/// Bytes to the client, on their way.
#[derive(Debug)]
struct Sending {
    bytes: Vec<u8>,
    began: SimTime,
    rate: Rate,
    handed_on: usize,
}

impl Sending {
    fn end(&self) -> SimTime {
        self.began + self.rate.transmission(self.bytes.len())
    }

    /// Bytes that have left by `now`.
    fn left(&self, now: SimTime) -> usize {
        let elapsed = now.0.saturating_sub(self.began.0);
        let bytes = u128::from(elapsed) * u128::from(self.rate.bits_per_second()) / 10_000_000_000;
        usize::try_from(bytes).unwrap_or(usize::MAX).min(self.bytes.len())
    }
}

impl Scanner {
    async fn run(mut self) -> io::Result<()> {
        let mut chunk = vec![0; READ_CHUNK];
        loop {
            self.device.handle_timeout(self.clock.now());
            self.begin_sending();
            let sweep = self.sweep();
            let due = self.due(sweep);
            let line_is_free = self.sending.is_none() && self.device.is_silent();
            if line_is_free {
                self.playing = None;
            }
            self.eye.tell(self.device.wants_values());
            tokio::select! {
                telegram = self.eye.next_telegram(), if line_is_free => self.play(telegram),
                heard = listen(&mut *self.wire, &mut chunk) => if let Some(read) = heard? {
                    self.receive(chunk.get(..read).unwrap_or_default())?;
                },
                reached = reach(&self.clock, due) => {
                    while let Some(due) = self.voices.next().filter(|due| *due <= reached) {
                        self.voices.speak(due).await;
                    }
                    self.deliver(reached).await?;
                    self.hand_on(reached).await?;
                    if let Some(sweep) = sweep.filter(|sweep| sweep.done() <= reached) {
                        self.measure(sweep);
                    }
                }
            }
        }
    }

    /// Puts a recorded telegram on the line; nobody wants it: it goes by.
    fn play(&mut self, telegram: Telegram) {
        if self.device.wants_values() {
            self.device.play(self.clock.now(), telegram.bytes.to_vec());
            self.playing = Some(telegram.slip);
            self.counts.sent.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The next scan telegram's turns; none while the line is in use or nobody is there to take it.
    fn sweep(&mut self) -> Option<Sweep> {
        if self.sending.is_some() || matches!(self.eye, Eye::Tape(..)) {
            return None;
        }
        let sweep = self.device.plan(self.free).filter(|_| self.wire.is_open());
        if sweep.is_none() {
            // No scan that was over before someone wanted one.
            self.free = self.free.max(self.clock.now());
        }
        sweep
    }

    /// When there is something to do next.
    fn due(&self, sweep: Option<Sweep>) -> Option<SimTime> {
        let piece = self.sending.as_ref().map(|sending| {
            let pace = match self.clock.scale() {
                TimeScale::Paced(scale) => PIECE.mul_f64(scale),
                TimeScale::Max => return sending.end(),
            };
            let next = sending.began + sending.rate.transmission(sending.handed_on) + pace;
            next.min(sending.end())
        });
        // While something is being sent the device's next bytes wait for its end.
        let device = self.device.poll_timeout().filter(|_| self.sending.is_none());
        let arriving = self.arriving.front().map(|arriving| arriving.last);
        let sweep = sweep.map(|sweep| sweep.done());
        [piece, device, arriving, sweep, self.voices.next()].into_iter().flatten().min()
    }

    fn begin_sending(&mut self) {
        if self.sending.is_some() {
            return;
        }
        let now = self.clock.now();
        if let Some(bytes) = self.device.poll_transmit(now) {
            self.tap.record(Side::Device, &bytes);
            let began = self.free.max(now);
            let sending = Sending { bytes, began, rate: self.device.rate(), handed_on: 0 };
            self.free = sending.end();
            self.sending = Some(sending);
        }
    }

    /// Bytes from the client set out.
    fn receive(&mut self, bytes: &[u8]) -> io::Result<()> {
        if bytes.is_empty() {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let own = self.device.rate().bits_per_second();
        let rate = self.wire.client_rate()?.unwrap_or(own);
        let heard = uart::hear(bytes, rate, own);
        let now = self.clock.now();
        let spacing = match self.wire.is_copper() {
            true => Duration::ZERO,
            false => Duration::from_nanos(10_000_000_000 / u64::from(rate.max(1))),
        };
        let first = self.arriving.back().map_or(now, |before| before.last.max(now));
        let last = first + spacing.saturating_mul(u32::try_from(bytes.len()).unwrap_or(u32::MAX));
        if self.arriving.len() < MAX_ARRIVING && !heard.is_empty() {
            self.tap.record(Side::Host, &heard);
            self.arriving.push_back(Arriving { first, spacing, last, bytes: heard });
        }
        Ok(())
    }

    /// Hands the device what has arrived.
    async fn deliver(&mut self, now: SimTime) -> io::Result<()> {
        while self.arriving.front().is_some_and(|arriving| arriving.last <= now) {
            let Some(Arriving { first, spacing, bytes, .. }) = self.arriving.pop_front() else { break };
            self.device.handle_bytes(first, spacing, &bytes);
        }
        if self.device.saves() != self.saves {
            self.saves = self.device.saves();
            if let Some(file) = &self.state {
                file.keep(self.device.saved_settings()).await?;
            }
        }
        Ok(())
    }

    /// Hands the client what has left.
    async fn hand_on(&mut self, now: SimTime) -> io::Result<()> {
        let Some(mut sending) = self.sending.take() else { return Ok(()) };
        let left = sending.left(now);
        let piece = sending.bytes.get(sending.handed_on..left).unwrap_or_default();
        if !piece.is_empty() {
            let own = sending.rate.bits_per_second();
            let rate = self.wire.client_rate()?.unwrap_or(own);
            let heard = uart::hear(piece, own, rate);
            self.write(&heard).await?;
        }
        sending.handed_on = left;
        if left < sending.bytes.len() {
            self.sending = Some(sending);
            return Ok(());
        }
        let rate = self.device.rate();
        self.device.transmitted(now);
        if self.device.rate() != rate {
            self.wire.set_rate(self.device.rate().bits_per_second())?;
        }
        Ok(())
    }

    /// A line does not wait: what the client does not take is lost. Only the clock that waits for its clients waits here.
    async fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.clock.scale() == TimeScale::Max {
            return self.wire.write_all(bytes).await;
        }
        let mut rest = bytes;
        while !rest.is_empty() {
            let written = tokio::select! {
                biased;
                written = self.wire.write(rest) => written?,
                () = std::future::ready(()) => {
                    self.counts.lost.fetch_add(rest.len() as u64, Ordering::Relaxed);
                    return Ok(());
                }
            };
            rest = rest.get(written..).unwrap_or_default();
        }
        self.wire.flush().await
    }

    /// Looks once a mirror turn, each from where the tractor then was, and has the telegram made.
    fn measure(&mut self, sweep: Sweep) {
        let Eye::World(world) = &mut self.eye else { return };
        for turn in sweep.turns() {
            let beams = self.device.turn_beams(turn);
            let mirror = Mirror { frequency_centihz: TURNS_PER_SECOND * 100, period_ppm: 0, beams };
            world.look(mirror, Sweep::turn_at(turn));
            let echo = world.echo();
            let seen = Beams { range_mm: &echo.range_mm, remission: &echo.remission };
            self.device.measure(sweep, turn, seen);
        }
        self.device.finish(sweep.done(), sweep);
        // The first scan that someone takes sets the tractor going.
        world.tractor().begin(sweep.done());
        self.counts.sent.fetch_add(1, Ordering::Relaxed);
    }
}

/// The next bytes from the client; none where it has only come or gone. Cancel safe.
async fn listen(wire: &mut dyn Wire, chunk: &mut [u8]) -> io::Result<Option<usize>> {
    let was_open = wire.is_open();
    poll_fn(|cx| {
        let mut room = ReadBuf::new(chunk);
        match Pin::new(&mut *wire).poll_read(cx, &mut room)? {
            Poll::Ready(()) => Poll::Ready(Ok(Some(room.filled().len()))),
            Poll::Pending if wire.is_open() != was_open => Poll::Ready(Ok(None)),
            Poll::Pending => Poll::Pending,
        }
    })
    .await
}

/// Waits for `due`, for ever without one; gives the time it is then.
async fn reach(clock: &SimClock, due: Option<SimTime>) -> SimTime {
    match due {
        Some(due) => clock.reach(due).await,
        None => pending().await,
    }
    clock.now()
}
