//! The virtual LMS2xx on the timeline: a device, its view and its serial line. All bytes of the line pass here, at the pace of the line.

use std::collections::VecDeque;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use rowscan_faults::StreamFaults;
use rowscan_ports::in_flight::Pending;
use rowscan_ports::{Delivery, Wire, uart};
use rowscan_protocol::device::{Mirror, Profile};
use rowscan_protocol::lms2xx::device::{Beams, Device, Pace, Sweep};
use rowscan_protocol::lms2xx::model::TURNS_PER_SECOND;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, Tap, Taps};
use tokio::io::{AsyncWriteExt, ReadBuf};

use crate::ScannerView;
use crate::clock::{SimClock, TimeScale};
use crate::faulted::DeviceFaults;
use crate::firing::{Claim, Firing};
use crate::line_watch::LineWatch;
use crate::mirror::tell_missed;
use crate::playback_queue::{Recorded, Values};
use crate::scan_moment::LastScan;
use crate::sent_lines::SentLines;
use crate::state_file::StateFile;

/// Bytes taken from a client at a time.
const READ_CHUNK: usize = 512;
/// How often a telegram under way is handed on, host time: what a client sees of the line's pace.
const PIECE: Duration = Duration::from_millis(3);
/// How far it may be behind before it leaves scans out, host time: a line of its own pace catches up with less.
const MOST_BEHIND: Duration = Duration::from_millis(250);
/// Requests on their way to the device; more is more than a line carries.
const MAX_ARRIVING: usize = 64;
/// Telegrams that may still leave at the end: the one on the line, an answer, and the scan that was measured meanwhile.
const MOST_AT_END: usize = 4;

/// How a virtual LMS2xx is run.
#[derive(Clone, Debug)]
pub struct SerialConfig {
    /// How simulated time runs.
    pub time_scale: TimeScale,
    /// Where the configuration block is kept.
    pub state: Option<StateFile>,
    /// Who records the line.
    pub taps: Taps,
    /// What its stream is called; as the model is, where absent.
    pub stream: Option<String>,
    /// Where its lines can be watched, if anywhere; a recorded one has none to show.
    pub lines: Option<LineWatch>,
    /// What goes wrong between it and its client. Then a recording holds what went over the client's wire.
    pub faults: Option<StreamFaults>,
}

impl SerialConfig {
    /// As it is out of the box, with simulated time at this scale.
    pub fn at(time_scale: TimeScale) -> Self {
        Self { time_scale, state: None, taps: Taps::default(), stream: None, lines: None, faults: None }
    }
}

/// What the host's scheduling adds to a pause inside a telegram.
const PAUSE_SLACK: Duration = Duration::from_millis(14);
/// The same on the bench: a client on a busy host may take half a second between two bytes.
const BENCH_SLACK: Duration = Duration::from_millis(500);

/// How much longer than real a client's pause inside a telegram may be, in simulated time.
pub fn pause_slack(profile: Profile, scale: TimeScale) -> Duration {
    let slack = if profile == Profile::Bench { BENCH_SLACK } else { PAUSE_SLACK };
    match scale {
        TimeScale::Paced(scale) => slack.mul_f64(scale.clamp(1e-3, 1e3)),
        // Time stands still between requests: any pause is no pause.
        TimeScale::Max => Duration::MAX / 4,
    }
}

/// What a virtual LMS2xx has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SerialCounts {
    /// Scan telegrams put on the line.
    pub scans_sent: u64,
    /// Scan telegrams that did not reach the client: recorded ones that came faster than the line carries them, and those that faults still held back at the
    /// end. None where neither can be.
    pub scans_dropped: Option<u64>,
    /// Scan telegrams, of those sent, that faults have kept from the client; none where nothing can go wrong there.
    pub scans_kept_by_faults: Option<u64>,
    /// Scans left out because the host was too slow.
    pub scans_missed: u64,
    /// Bytes lost because the client did not take them.
    pub bytes_lost: u64,
}

#[derive(Debug, Default)]
pub(crate) struct Counts {
    pub(crate) sent: AtomicU64,
    pub(crate) missed: AtomicU64,
    pub(crate) lost: AtomicU64,
    /// Scan telegrams on the line that faults held back at the end.
    pub(crate) given_up: AtomicU64,
}

/// A virtual LMS2xx with its line, as a source of the timeline.
#[derive(Debug)]
pub(crate) struct Lms2xxScanner {
    clock: Arc<SimClock>,
    device: Device,
    values: Values,
    wire: Box<dyn Wire>,
    chunk: Box<[u8; READ_CHUNK]>,
    state: Option<StateFile>,
    saves: u32,
    tap: Tap,
    /// What the client has sent and is still on the line.
    arriving: VecDeque<Arriving>,
    sending: Option<Sending>,
    /// Of the recorded telegram that the line is busy with.
    playing: Option<Pending>,
    /// The next scan telegram's turns.
    sweep: Option<Sweep>,
    /// When the telegram of the last sweep was ready to be sent.
    ready: SimTime,
    /// When the line was, or will be, free of what the device sends.
    free: SimTime,
    pub(crate) counts: Arc<Counts>,
    /// What goes wrong with the device itself.
    troubles: Option<Arc<DeviceFaults>>,
    /// What goes wrong on its line.
    faults: Option<StreamFaults>,
    last_scan: Option<LastScan>,
    /// Who watches its lines.
    lines: Option<SentLines>,
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
    pace: Pace,
    handed_on: usize,
    /// A telegram of values, not cut off by a request.
    is_scan: bool,
}

impl Sending {
    fn end(&self) -> SimTime {
        self.pace.end(self.began, self.bytes.len())
    }

    /// Ends behind the byte that is on the line: a request has come.
    fn cut_off(&mut self, now: SimTime) {
        let begun = self.left(now) + 1;
        self.is_scan &= begun >= self.bytes.len();
        self.bytes.truncate(begun);
    }

    /// Bytes that have left by `now`.
    fn left(&self, now: SimTime) -> usize {
        self.pace.left(self.began, self.bytes.len(), now)
    }
}

impl Drop for Lms2xxScanner {
    fn drop(&mut self) {
        self.break_off();
    }
}

impl Lms2xxScanner {
    pub(crate) fn new(
        device: Device,
        values: Values,
        wire: Box<dyn Wire>,
        clock: Arc<SimClock>,
        state: Option<StateFile>,
        tap: Tap,
    ) -> Self {
        Self {
            clock,
            state,
            saves: device.saves(),
            device,
            values,
            wire,
            chunk: Box::new([0; READ_CHUNK]),
            tap,
            arriving: VecDeque::new(),
            sending: None,
            playing: None,
            sweep: None,
            ready: SimTime::ZERO,
            free: SimTime::ZERO,
            counts: Arc::default(),
            troubles: None,
            faults: None,
            last_scan: None,
            lines: None,
        }
    }

    /// The same with what goes wrong with it.
    pub(crate) fn troubled(mut self, troubles: Option<Arc<DeviceFaults>>) -> Self {
        self.troubles = troubles;
        self
    }

    /// The same with what goes wrong on its line.
    pub(crate) fn behind(mut self, faults: Option<StreamFaults>) -> Self {
        self.faults = faults;
        self
    }

    /// What goes wrong on its line, if anything may.
    pub(crate) fn faults(&self) -> Option<&StreamFaults> {
        self.faults.as_ref()
    }

    /// The same with its lines watched.
    pub(crate) fn watched(mut self, lines: Option<LineWatch>) -> Self {
        self.lines = lines.and_then(SentLines::new);
        self
    }

    /// Does what goes wrong, or comes right, by now.
    fn obey(&mut self) {
        let Some(troubles) = &self.troubles else { return };
        if troubles.act_on_lms2xx(&mut self.device, self.clock.now()) {
            self.break_off();
            self.sweep = None;
            self.arriving.clear();
        }
    }

    /// What it sends ends here; what of it has left is kept in the recording.
    fn break_off(&mut self) {
        if let Some(Sending { bytes, handed_on: left @ 1.., .. }) = self.sending.take() {
            self.tap.record(Side::Device, bytes.get(..left).unwrap_or_default());
        }
    }

    /// When there is something to do next. What the device has to say now sets out.
    pub(crate) fn next(&mut self) -> Option<SimTime> {
        self.obey();
        self.device.handle_timeout(self.clock.now());
        self.begin_sending();
        self.sweep = self.plan();
        if self.line_is_free() {
            self.playing = None;
        }
        self.values.tell(self.has_taker());
        self.due()
    }

    /// What the client has sent, or the next recorded telegram.
    pub(crate) fn poll_input(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let was_open = self.wire.is_open();
        let mut room = ReadBuf::new(&mut self.chunk[..]);
        let read = Pin::new(&mut *self.wire).poll_read(cx, &mut room)?;
        let read = read.map(|()| room.filled().len());
        match read {
            Poll::Ready(read) => {
                let bytes: Vec<u8> = self.chunk.get(..read).unwrap_or_default().to_vec();
                return Poll::Ready(self.receive(&bytes));
            }
            Poll::Pending if self.wire.is_open() != was_open => return Poll::Ready(Ok(())),
            Poll::Pending => {}
        }
        if self.line_is_free()
            && let Poll::Ready(Some(telegram)) = self.values.poll_recorded(cx)
        {
            self.play(telegram);
            return Poll::Ready(Ok(()));
        }
        Poll::Pending
    }

    /// Acts on everything due; true if a scan has been made for the client.
    pub(crate) async fn fire(&mut self, firing: Firing) -> io::Result<bool> {
        // A line that is written late hands on what has left by now.
        let now = self.clock.now().max(firing.at);
        self.deliver(now).await?;
        self.hand_on(now, firing.delivery).await?;
        match self.sweep.take_if(|sweep| sweep.done() <= now) {
            Some(sweep) if self.is_too_late(now.elapsed().saturating_sub(sweep.done().elapsed())) => {
                self.leave_out(now, sweep);
                Ok(false)
            }
            Some(sweep) => Ok(self.measure(sweep)),
            None => Ok(false),
        }
    }

    fn is_too_late(&self, behind: Duration) -> bool {
        match self.clock.scale() {
            TimeScale::Paced(scale) => behind > MOST_BEHIND.mul_f64(scale),
            TimeScale::Max => false,
        }
    }

    /// Passes over the scans that there is no time for, from this one until now.
    fn leave_out(&mut self, now: SimTime, sweep: Sweep) {
        self.free = self.free.max(now);
        let first = |sweep: Sweep| sweep.turns().next().unwrap_or_default();
        let next = self.device.plan(self.free).map_or(0, first);
        let turns = sweep.turns().count().max(1) as u64;
        tell_missed(&self.counts.missed, (next.saturating_sub(first(sweep)) / turns).max(1));
    }

    /// The last scan it made.
    /// Sends the rest of the telegram that is on the line, and of a scan that is ready.
    pub(crate) async fn finish(&mut self, delivery: Delivery) -> io::Result<()> {
        for _ in 0..MOST_AT_END {
            self.begin_sending();
            let Some(sending) = &self.sending else { break };
            self.hand_on(sending.end(), delivery).await?;
        }
        Ok(())
    }

    pub(crate) fn last_scan(&self) -> Option<LastScan> {
        self.last_scan
    }

    /// What it needs time for: its line is at work, or a client takes its scans.
    pub(crate) fn claim(&self) -> Claim {
        let at_work =
            self.sending.is_some() || !self.arriving.is_empty() || self.device.poll_timeout().is_some();
        match (at_work, self.sweep) {
            (true, _) => Claim::Busy,
            (false, Some(_)) => Claim::Taker,
            (false, None) => Claim::Idle,
        }
    }

    /// Whether a client has it stream.
    pub(crate) fn has_taker(&self) -> bool {
        self.wire.is_open() && self.device.wants_values()
    }

    fn line_is_free(&self) -> bool {
        self.sending.is_none() && self.device.is_silent()
    }

    /// Puts a recorded telegram on the line; nobody wants it: it goes by.
    fn play(&mut self, telegram: Recorded) {
        if self.has_taker() {
            self.device.play(self.clock.now(), telegram.bytes.to_vec());
            self.playing = Some(telegram.pending);
        }
    }

    /// The next scan telegram's turns; none while the line is in use or nobody is there to take it.
    fn plan(&mut self) -> Option<Sweep> {
        if self.sending.is_some() || self.values.are_recorded() {
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
    fn due(&self) -> Option<SimTime> {
        let piece = self.sending.as_ref().map(|sending| {
            let pace = match self.clock.scale() {
                TimeScale::Paced(scale) => PIECE.mul_f64(scale),
                TimeScale::Max => return sending.end(),
            };
            let next = sending.pace.end(sending.began, sending.handed_on) + pace;
            // In a telegram's pause nothing leaves.
            let more = sending.pace.end(sending.began, sending.handed_on + 1);
            next.max(more).min(sending.end())
        });
        // While something is being sent the device's next bytes wait for its end.
        let device = self.device.poll_timeout().filter(|_| self.sending.is_none());
        let arriving = self.arriving.front().map(|arriving| arriving.last);
        let sweep = self.sweep.map(|sweep| sweep.done());
        let trouble = self.troubles.as_ref().and_then(|troubles| troubles.next());
        [piece, device, arriving, sweep, trouble].into_iter().flatten().min()
    }

    fn begin_sending(&mut self) {
        if self.sending.is_some() {
            return;
        }
        let now = self.clock.now();
        if let Some(bytes) = self.device.poll_transmit(now) {
            if let (Some(lines), Values::Seen(world), Some(scan)) =
                (&mut self.lines, &self.values, self.last_scan)
            {
                lines.sent(scan.at, &bytes, world);
            }
            let is_scan = self.device.sends_values();
            // A scan leaves when it is ready, however late the host is: the line goes by its own time, and so do the scans that it has room for.
            let ready = if is_scan && !self.values.are_recorded() { self.ready.min(now) } else { now };
            let began = self.free.max(ready);
            let sending = Sending { bytes, began, pace: self.device.pace(), handed_on: 0, is_scan };
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
        let spacing = match self.wire.paces_itself() {
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
            let Some(Arriving { first, spacing, last, bytes }) = self.arriving.pop_front() else { break };
            self.device.handle_bytes(first, spacing, &bytes);
            if let Some(sending) = self.sending.as_mut().filter(|_| self.device.interrupts()) {
                sending.cut_off(last.max(sending.began));
                self.free = sending.end();
            }
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
    async fn hand_on(&mut self, now: SimTime, delivery: Delivery) -> io::Result<()> {
        let Some(mut sending) = self.sending.take() else { return Ok(()) };
        let left = sending.left(now);
        let piece = sending.bytes.get(sending.handed_on..left).unwrap_or_default();
        if !piece.is_empty() {
            let own = sending.pace.rate.bits_per_second();
            let rate = self.wire.client_rate()?.unwrap_or(own);
            let heard = uart::hear(piece, own, rate);
            self.write(&heard, delivery).await?;
        }
        sending.handed_on = left;
        if left < sending.bytes.len() {
            self.sending = Some(sending);
            return Ok(());
        }
        // Only now is it known whether a request has cut it off.
        self.tap.record(Side::Device, &sending.bytes);
        self.counts.sent.fetch_add(u64::from(sending.is_scan), Ordering::Relaxed);
        let rate = self.device.rate();
        self.device.transmitted(now);
        if self.device.rate() != rate {
            self.wire.set_rate(self.device.rate().bits_per_second())?;
        }
        Ok(())
    }

    /// A line does not wait: what the client does not take is lost. Only the clock that waits for its clients waits here.
    async fn write(&mut self, bytes: &[u8], delivery: Delivery) -> io::Result<()> {
        if delivery.is_patient() {
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

    /// Has the telegram of a sweep made.
    fn measure(&mut self, sweep: Sweep) -> bool {
        let Values::Seen(world) = &mut self.values else { return false };
        let mut lines = self.lines.as_mut().filter(|lines| lines.are_watched());
        lines.iter_mut().for_each(|lines| lines.begin());
        look(&mut self.device, world, sweep, |world| lines.iter_mut().for_each(|lines| lines.turn(world)));
        let first = sweep.turns().next();
        self.last_scan = first.map(|turn| LastScan { at: Sweep::turn_at(turn), telegram_counter: None });
        self.ready = sweep.done();
        self.device.finish(self.ready, sweep);
        true
    }
}

/// Looks once a mirror turn, each from where the tractor then is; `each` hears of it.
pub(crate) fn look(
    device: &mut Device,
    world: &mut ScannerView,
    sweep: Sweep,
    mut each: impl FnMut(&ScannerView),
) {
    for turn in sweep.turns() {
        let beams = device.turn_beams(turn);
        let mirror = Mirror {
            frequency_centihz: TURNS_PER_SECOND * 100,
            period_ppm: 0,
            beams,
            suppresses_fog: false,
            layer_centideg: 0,
        };
        world.look(mirror, Sweep::turn_at(turn));
        each(world);
        let echo = world.echo();
        let seen = Beams { range_mm: &echo.range_mm, remission: &echo.remission };
        device.measure(sweep, turn, seen);
    }
}
