//! One client: its requests to the device, the device's replies and scans back to it. All bytes to a client pass here.

use std::io;
use std::pin::Pin;
use std::sync::Arc;

use rowscan_faults::Direction;
use rowscan_protocol::device::{AfterReply, Reply, Session};
use rowscan_recording::{Side, StreamKind, Tap};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::sync::mpsc;

use crate::replay::ScriptedReplies;
use crate::roster::{Member, QueuedTelegram, TurnedOut, Wants};
use crate::shared::{Program, Shared};

/// Bytes taken from a client at a time.
const READ_CHUNK: usize = 4096;

/// Takes a client in, and serves it until it leaves, is turned out, or the device drops it. A house full of speakers refuses it.
///
/// It is taken in now, before the first poll: whoever connects later makes room later, however late its task is run.
/// `on_reset` has the connection end with a reset when it is dropped, where there is such a thing.
pub(crate) fn serve<S: AsyncRead + AsyncWrite + Unpin + Send>(
    shared: Arc<Shared>,
    peer: String,
    stream: S,
    on_reset: fn(&S),
) -> impl Future<Output = ()> + Send {
    let place = take_in(shared, peer);
    async move {
        let Some((entry, scans)) = place else { return };
        let (shared, member) = (&entry.shared, &entry.member);
        let ended = tokio::select! {
            biased; // Whoever is turned out is answered nothing more.
            () = member.turned_out() => Ok(()),
            ended = converse_through_faults(shared, member, scans, stream, on_reset) => ended,
        };
        if let Err(cause) = ended {
            tracing::debug!(%cause, "client gone");
        }
    }
}

/// A place for a client, if there is one, and its scans; says who made room for it, or that nobody does.
fn take_in(shared: Arc<Shared>, peer: String) -> Option<(RosterEntry, mpsc::Receiver<QueuedTelegram>)> {
    let counts = &shared.counts;
    let Some(joined) = shared.roster.join(peer.clone()) else {
        if let Some(so_far) = counts.refused.count() {
            let limit = shared.roster.limit();
            tracing::warn!(
                "{peer} is refused: {limit} clients are served, and none is silent or idle ({so_far} so far)"
            );
        }
        return None;
    };
    match &joined.instead_of {
        Some((member, TurnedOut::Silent)) => {
            if let Some(so_far) = counts.silent.count() {
                tracing::warn!(
                    "{} makes room for {peer}: it never sent a telegram ({so_far} so far)",
                    member.peer()
                );
            }
        }
        Some((member, TurnedOut::Idle(idle))) => {
            if let Some(so_far) = counts.idle.count() {
                let seconds = idle.as_secs();
                tracing::warn!(
                    "{} makes room for {peer}: it was idle for {seconds} s ({so_far} so far)",
                    member.peer()
                );
            }
        }
        None => {}
    }
    Some((RosterEntry { shared, member: joined.member }, joined.scans))
}

/// A client's place among the others, given up however its task ends: a client that is gone must not keep the mirror turning.
struct RosterEntry {
    shared: Arc<Shared>,
    member: Arc<Member>,
}

impl Drop for RosterEntry {
    fn drop(&mut self) {
        self.shared.roster.leave(&self.member);
        self.member.set_wants(None);
        // A mirror that waits for this client's room must look again.
        self.shared.interest.notify_one();
    }
}

/// Converses through the scanner's faults, if it has any. What is recorded then is what goes over the client's wire.
async fn converse_through_faults<S: AsyncRead + AsyncWrite + Unpin + Send>(
    shared: &Shared,
    member: &Member,
    telegrams: mpsc::Receiver<QueuedTelegram>,
    stream: S,
    on_reset: fn(&S),
) -> io::Result<()> {
    let tap = tap_of(shared);
    let Some(faults) = &shared.config.faults else {
        return converse(shared, member, telegrams, Box::pin(stream), tap).await;
    };
    let stream = faults.wrap(stream, on_reset).witnessed(move |direction, bytes| {
        tap.record(if direction == Direction::ToClient { Side::Device } else { Side::Host }, bytes);
    });
    converse(shared, member, telegrams, Box::pin(stream), Tap::default()).await
}

/// Bytes both ways.
trait ByteStream: AsyncRead + AsyncWrite {}
impl<S: AsyncRead + AsyncWrite> ByteStream for S {}

fn tap_of(shared: &Shared) -> Tap {
    match &shared.program {
        Program::Device => {
            let stream = shared.config.stream.as_deref();
            shared.config.taps.open(stream.unwrap_or(shared.device().model().name), StreamKind::Cola)
        }
        Program::Script(name, _) => shared.config.taps.open(name, StreamKind::Cola),
        Program::Verbatim(name, kind) => shared.config.taps.open(name, *kind),
    }
}

/// One function for every kind of stream: it is long, and compiled wherever an emulator is started.
async fn converse(
    shared: &Shared,
    member: &Member,
    mut telegrams: mpsc::Receiver<QueuedTelegram>,
    stream: Pin<Box<dyn ByteStream + Send + '_>>,
    tap: Tap,
) -> io::Result<()> {
    let (mut reader, writer) = tokio::io::split(stream);
    let mut news = shared.news.subscribe();
    let mut conversation = Conversation::new(shared, member, writer, tap);
    let mut chunk = vec![0; READ_CHUNK];
    loop {
        let next = tokio::select! {
            read = reader.read(&mut chunk) => match read? {
                0 => Next::End,
                _ if member.is_out() => Next::End,
                read => conversation.hears(&chunk[..read]).await?,
            },
            telegram = telegrams.recv() => match telegram {
                Some(telegram) => conversation.sends(telegram).await?,
                None => Next::End,
            },
            Ok(()) = news.changed() => conversation.learns().await?,
        };
        if let Next::End = next {
            return Ok(());
        }
    }
}

/// What becomes of a conversation.
enum Next {
    GoesOn,
    End,
}

/// A client's session with the device, and the way back to the client.
struct Conversation<'a, W> {
    shared: &'a Shared,
    member: &'a Member,
    writer: W,
    tap: Tap,
    session: Session,
    scripted: Option<ScriptedReplies>,
    replies: Vec<Reply>,
    reboots: u32,
    power_cycles: u32,
}

impl<'a, W: AsyncWrite + Unpin> Conversation<'a, W> {
    fn new(shared: &'a Shared, member: &'a Member, writer: W, tap: Tap) -> Self {
        if shared.is_verbatim() {
            member.set_wants(Some(Wants::no_events()));
            shared.interest.notify_one();
        }
        let scripted = match &shared.program {
            Program::Script(_, script) => Some(ScriptedReplies::new(Arc::clone(script))),
            Program::Device | Program::Verbatim(..) => None,
        };
        let (reboots, power_cycles) = {
            let device = shared.device();
            (device.reboots(), device.power_cycles())
        };
        let session = Session::new(shared.config.dialects);
        Self { shared, member, writer, tap, session, scripted, replies: Vec::new(), reboots, power_cycles }
    }

    /// Answers what the client says.
    async fn hears(&mut self, bytes: &[u8]) -> io::Result<Next> {
        let (shared, member) = (self.shared, self.member);
        shared.roster.passes(member);
        self.tap.record(Side::Host, bytes);
        if shared.is_verbatim() {
            return Ok(Next::GoesOn);
        }
        let (session, scripted) = (&mut self.session, self.scripted.as_mut());
        let saved = shared.converse(member.peer(), session, scripted, bytes, &mut self.replies);
        if self.session.counts().frames > 0 {
            member.has_spoken();
        }
        // Before the reply that says so. If it cannot be kept the client gets no answer, rather than a wrong one.
        if let (Some(settings), Some(file)) = (saved, &shared.config.state) {
            file.keep(settings).await?;
        }
        if let Next::End = self.reply().await? {
            self.writer.shutdown().await?;
            return Ok(Next::End);
        }
        // Where time waits for its clients, each poll takes the next scan: this client's next one comes after the mirror's turn.
        if shared.clock.delivery().is_patient() && !shared.is_replayed() {
            shared.polls_answered().await;
        }
        Ok(Next::GoesOn)
    }

    /// Sends what was queued for the client.
    async fn sends(&mut self, queued: QueuedTelegram) -> io::Result<Next> {
        let QueuedTelegram { event, frame, pending: _pending } = queued;
        // What was queued when the client unsubscribed is not sent any more.
        if event.is_none_or(|event| self.session.subscriptions().has(event)) {
            self.write(&frame).await?;
            self.tap.record(Side::Device, &frame);
        }
        Ok(Next::GoesOn)
    }

    /// Sends what the device says by itself.
    async fn learns(&mut self) -> io::Result<Next> {
        let shared = self.shared;
        {
            let mut device = shared.device();
            if device.reboots() != self.reboots {
                return Ok(Next::End);
            }
            // A device that was without power knows nobody. Whoever is still there hears nothing of it.
            if std::mem::replace(&mut self.power_cycles, device.power_cycles()) != device.power_cycles() {
                self.session = Session::new(shared.config.dialects);
                self.member.set_wants(None);
            }
            self.session.poll_events(&mut device, shared.clock.now(), &mut self.replies);
        }
        self.reply().await?;
        Ok(Next::GoesOn)
    }

    /// Sends replies and events, each when the device is done with it.
    ///
    /// The mirror knows what the client wants of its scans before the client can read the reply: a client that then lets time go on gets every scan from
    /// there. It is told after the last delay, since a patient clock would wait for the client meanwhile. No scan overtakes a reply: both are written here.
    async fn reply(&mut self) -> io::Result<Next> {
        let replies = std::mem::take(&mut self.replies);
        let rested = replies.iter().rposition(|reply| !reply.delay.is_zero()).unwrap_or_default();
        if replies.is_empty() {
            self.tell_wants();
        }
        for (number, reply) in replies.into_iter().enumerate() {
            self.shared.clock.rest(reply.delay).await;
            if number == rested {
                self.tell_wants();
            }
            // One write a reply: many clients take whatever one read gives as the whole reply.
            self.write(&reply.bytes).await?;
            self.tap.record(Side::Device, &reply.bytes);
            if let Some(AfterReply::Close) = reply.after {
                return Ok(Next::End);
            }
        }
        Ok(Next::GoesOn)
    }

    /// Tells the mirror what the client wants of its scans.
    fn tell_wants(&self) {
        if self.shared.is_verbatim() {
            return;
        }
        self.member.set_wants(Wants::of(&self.session));
        self.shared.interest.notify_one();
    }

    /// Writes to the client; one that takes nothing for long is idle.
    async fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.shared.roster.writes(self.member, true);
        self.writer.write_all(bytes).await?;
        self.shared.roster.writes(self.member, false);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::task::{Context, Poll};

    use rowscan_protocol::device::{Device, Identity};
    use rowscan_protocol::model;
    use tokio::io::{DuplexStream, ReadBuf};
    use tokio::sync::Notify;

    use super::*;
    use crate::clock::{SimClock, TimeScale};
    use crate::shared::EmulatorConfig;

    /// A client's line that notes with every reply whether the mirror has an audience.
    struct Witnessed {
        line: DuplexStream,
        shared: Arc<Shared>,
        seen: Arc<Mutex<Vec<bool>>>,
    }

    impl AsyncRead for Witnessed {
        fn poll_read(
            mut self: Pin<&mut Self>,
            cx: &mut Context<'_>,
            out: &mut ReadBuf<'_>,
        ) -> Poll<io::Result<()>> {
            Pin::new(&mut self.line).poll_read(cx, out)
        }
    }

    impl AsyncWrite for Witnessed {
        fn poll_write(
            mut self: Pin<&mut Self>,
            cx: &mut Context<'_>,
            bytes: &[u8],
        ) -> Poll<io::Result<usize>> {
            let taken = self.shared.roster.has_audience();
            self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(taken);
            Pin::new(&mut self.line).poll_write(cx, bytes)
        }

        fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
            Pin::new(&mut self.line).poll_flush(cx)
        }

        fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
            Pin::new(&mut self.line).poll_shutdown(cx)
        }
    }

    #[tokio::test]
    async fn the_mirror_knows_what_a_client_wants_before_the_client_reads_that_it_was_heard() {
        for model in model::MODELS {
            let device = Device::new(model, Identity::of(model, 0));
            let clock = Arc::new(SimClock::start(TimeScale::Max));
            let config = EmulatorConfig::default();
            let shared = Shared::new(device, Program::Device, clock, Arc::new(Notify::new()), config);
            let (mut here, line) = tokio::io::duplex(4096);
            let seen = Arc::new(Mutex::new(Vec::new()));
            let witnessed = Witnessed { line, shared: Arc::clone(&shared), seen: Arc::clone(&seen) };
            let served = tokio::spawn(serve(shared, "a client".to_owned(), witnessed, |_| ()));
            let steps: [(&str, bool); 5] = [
                ("sRN DeviceIdent", false),
                ("sEN LMDscandata 1", true),
                ("sRN DeviceIdent", true),
                ("sEN LMDscandata 0", false),
                ("sRN DeviceIdent", false),
            ];
            for (asked, wanted) in steps {
                here.write_all(format!("\x02{asked}\x03").as_bytes()).await.expect("the line takes it");
                let mut reply = [0; 512];
                let read = here.read(&mut reply).await.expect("a reply");
                assert!(read > 0, "{}: {asked} is not answered", model.name);
                let seen = std::mem::take(&mut *seen.lock().expect("no panic"));
                assert_eq!(seen, [wanted], "{}: {asked}", model.name);
            }
            drop(here);
            served.await.expect("the client's end ends it");
        }
    }
}
