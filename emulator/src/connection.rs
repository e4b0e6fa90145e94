//! One client: its requests to the device, the device's replies and scans back to it. All bytes to a client pass here.

use std::io;
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

/// Serves one client until it leaves, is turned out, or the device drops it. A house full of speakers refuses it.
/// `on_reset` has the connection end with a reset when it is dropped, where there is such a thing.
pub(crate) async fn serve<S: AsyncRead + AsyncWrite + Unpin>(
    shared: Arc<Shared>,
    peer: String,
    stream: S,
    on_reset: fn(&S),
) {
    let counts = &shared.counts;
    let Some(joined) = shared.roster.join(peer.clone()) else {
        if let Some(so_far) = counts.refused.count() {
            let limit = shared.roster.limit();
            tracing::warn!(
                "{peer} is refused: {limit} clients are served, and none is silent or idle ({so_far} so far)"
            );
        }
        return;
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
    let entry = RosterEntry { shared: &shared, member: joined.member };
    let ended = tokio::select! {
        ended = converse_through_faults(&shared, &entry.member, joined.scans, stream, on_reset) => ended,
        () = entry.member.turned_out() => Ok(()),
    };
    if let Err(cause) = ended {
        tracing::debug!(%cause, "client gone");
    }
}

/// A client's place among the others, given up however its task ends: a client that is gone must not keep the mirror turning.
struct RosterEntry<'a> {
    shared: &'a Shared,
    member: Arc<Member>,
}

impl Drop for RosterEntry<'_> {
    fn drop(&mut self) {
        self.shared.roster.leave(&self.member);
        self.member.set_wants(None);
        // A mirror that waits for this client's room must look again.
        self.shared.interest.notify_one();
    }
}

/// Converses through the scanner's faults, if it has any. What is recorded then is what goes over the client's wire.
async fn converse_through_faults<S: AsyncRead + AsyncWrite + Unpin>(
    shared: &Shared,
    member: &Member,
    telegrams: mpsc::Receiver<QueuedTelegram>,
    stream: S,
    on_reset: fn(&S),
) -> io::Result<()> {
    let tap = tap_of(shared);
    let Some(faults) = &shared.config.faults else {
        return converse(shared, member, telegrams, stream, tap).await;
    };
    let stream = faults.wrap(stream, on_reset).witnessed(move |direction, bytes| {
        tap.record(if direction == Direction::ToClient { Side::Device } else { Side::Host }, bytes);
    });
    converse(shared, member, telegrams, stream, Tap::default()).await
}

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

async fn converse<S: AsyncRead + AsyncWrite>(
    shared: &Shared,
    member: &Member,
    mut telegrams: mpsc::Receiver<QueuedTelegram>,
    stream: S,
    tap: Tap,
) -> io::Result<()> {
    let (mut reader, mut writer) = tokio::io::split(stream);
    let mut scripted = match &shared.program {
        Program::Script(_, script) => Some(ScriptedReplies::new(Arc::clone(script))),
        Program::Device | Program::Verbatim(..) => None,
    };
    let verbatim = shared.is_verbatim();
    if verbatim {
        member.set_wants(Some(Wants::no_events()));
        shared.interest.notify_one();
    }
    let mut session = Session::new(shared.config.dialects);
    let mut news = shared.news.subscribe();
    let (reboots, mut power_cycles) = {
        let device = shared.device();
        (device.reboots(), device.power_cycles())
    };
    let mut chunk = vec![0; READ_CHUNK];
    let mut replies: Vec<Reply> = Vec::new();
    loop {
        tokio::select! {
            read = reader.read(&mut chunk) => {
                let read = read?;
                if read == 0 {
                    return Ok(());
                }
                shared.roster.passes(member);
                tap.record(Side::Host, &chunk[..read]);
                if verbatim {
                    continue;
                }
                let saved = shared.converse(member.peer(), &mut session, scripted.as_mut(), &chunk[..read], &mut replies);
                if session.counts().frames > 0 {
                    member.has_spoken();
                }
                // Before the reply that says so. If it cannot be kept the client gets no answer, rather than a wrong one.
                if let (Some(settings), Some(file)) = (saved, &shared.config.state) {
                    file.keep(settings).await?;
                }
                if send(shared, member, &mut writer, &mut replies, &tap).await? {
                    return writer.shutdown().await;
                }
                // Only now: no scan may overtake the reply to its subscription.
                member.set_wants(Wants::of(&session));
                shared.interest.notify_one();
                // Where time waits for its clients, each poll takes the next scan: this client's next one comes after the mirror's turn.
                if shared.clock.delivery().is_patient() && !shared.is_replayed() {
                    shared.polls_answered().await;
                }
            }
            telegram = telegrams.recv() => match telegram {
                // What was queued when the client unsubscribed is not sent any more.
                Some(QueuedTelegram { event, frame, pending: _pending }) if event.is_none_or(|event| session.subscriptions().has(event)) => {
                    write(shared, member, &mut writer, &frame).await?;
                    tap.record(Side::Device, &frame);
                }
                Some(_) => {}
                None => return Ok(()),
            },
            Ok(()) = news.changed() => {
                {
                    let mut device = shared.device();
                    if device.reboots() != reboots {
                        return Ok(());
                    }
                    // A device that was without power knows nobody. Whoever is still there hears nothing of it.
                    if std::mem::replace(&mut power_cycles, device.power_cycles()) != device.power_cycles() {
                        session = Session::new(shared.config.dialects);
                        member.set_wants(None);
                    }
                    session.poll_events(&mut device, shared.clock.now(), &mut replies);
                }
                send(shared, member, &mut writer, &mut replies, &tap).await?;
            }
        }
    }
}

/// Sends replies and events, each when the device is done with it; true if the connection ends with them.
async fn send<W: AsyncWrite + Unpin>(
    shared: &Shared,
    member: &Member,
    writer: &mut W,
    replies: &mut Vec<Reply>,
    tap: &Tap,
) -> io::Result<bool> {
    for reply in replies.drain(..) {
        shared.clock.rest(reply.delay).await;
        // One write a reply: many clients take whatever one read gives as the whole reply.
        write(shared, member, writer, &reply.bytes).await?;
        tap.record(Side::Device, &reply.bytes);
        if let Some(AfterReply::Close) = reply.after {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Writes to a client; one that takes nothing for long is idle.
async fn write<W: AsyncWrite + Unpin>(
    shared: &Shared,
    member: &Member,
    writer: &mut W,
    bytes: &[u8],
) -> io::Result<()> {
    shared.roster.writes(member, true);
    writer.write_all(bytes).await?;
    shared.roster.writes(member, false);
    Ok(())
}
