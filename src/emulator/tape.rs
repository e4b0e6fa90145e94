//! What feeds the clients of a replayed recording: the tape in the mirror's place, on the same clock, into the same queues.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use rowscan_protocol::device::Event;
use rowscan_protocol::time::SimTime;

use super::Shared;
use super::mirror::hand_over;
use super::roster::{Member, Queued, Wants};
use crate::clock::{self, Pacer};
use crate::replay::{Playhead, Tape};

/// One tape and the playhead it follows.
#[derive(Debug)]
pub(super) struct Reel {
    pub(super) tape: Tape,
    pub(super) playhead: Arc<Playhead>,
    /// The tape's number at the playhead.
    pub(super) number: usize,
}

/// Plays a tape to its end, and waits until its clients have all of it.
pub(super) async fn play(shared: Arc<Shared>, mut reel: Reel) {
    let mut pacer = Pacer::new(&shared.clock, shared.config.timer);
    let mut audience: Vec<(Arc<Member>, Wants)> = Vec::new();
    let mut watch = reel.playhead.watch();
    let mut jumps = reel.playhead.jumps().0;
    // Whoever wants scans, where there are any.
    let anyone = reel.tape.is_verbatim() || !reel.tape.has_scans();
    wait_for_taker(&shared, anyone, &mut audience).await;
    reel.playhead.taken(reel.number, shared.clock.now());
    loop {
        let mut event = match reel.tape.next() {
            Ok(Some(event)) => event,
            Ok(None) => break,
            Err(cause) => {
                tracing::warn!(%cause, "the recording cannot be read on");
                break;
            }
        };
        let due = loop {
            let (moved, to_ns) = reel.playhead.jumps();
            if moved != jumps {
                jumps = moved;
                if let Err(cause) = reel.tape.seek(to_ns) {
                    tracing::warn!(%cause, "the recording cannot be read again");
                }
                break None;
            }
            match reel.playhead.due(event.at_ns) {
                None => watch.changed().await,
                Some(due) => tokio::select! {
                    () = pacer.reach(&shared.clock, due) => break Some(due),
                    () = watch.changed() => {}
                },
            }
        };
        let Some(due) = due else { continue };
        reel.tape.stamp(&mut event, due);
        let is_scan = matches!(event.event, Some(Event::ScanData | Event::Monitor));
        // Stopped by a client: what is recorded goes on unheard.
        if is_scan && !shared.device().is_measuring() {
            continue;
        }
        shared.lateness(due);
        if is_scan
            && shared.polled.load(Ordering::Relaxed)
            && let Some(scan) = event.scan()
        {
            shared.device().show_scan(scan);
        }
        shared.roster.listeners(&mut audience);
        for (member, wants) in &audience {
            let wanted = event.event.is_none_or(|event| wants.subscriptions.has(event));
            if let Some(frame) = wanted.then(|| event.in_dialect(wants.dialect)).flatten() {
                hand_over(&shared, member, Queued { event: event.event, frame }).await;
            }
        }
    }
    drain(&shared).await;
    shared.ended.send_replace(true);
}

/// Waits until somebody wants what is on the tape.
async fn wait_for_taker(shared: &Shared, anyone: bool, audience: &mut Vec<(Arc<Member>, Wants)>) {
    loop {
        let interest = shared.interest.notified();
        shared.roster.listeners(audience);
        let polled = shared.polled.load(Ordering::Relaxed);
        if polled || audience.iter().any(|(_, wants)| anyone || wants.takes_scans()) {
            return;
        }
        interest.await;
    }
}

/// Waits until every client's queue is empty.
async fn drain(shared: &Shared) {
    let mut audience = Vec::new();
    loop {
        shared.roster.listeners(&mut audience);
        if audience.iter().all(|(member, _)| member.queue().capacity() == member.queue().max_capacity()) {
            return;
        }
        clock::breathe().await;
    }
}

impl Shared {
    /// Notes how late an event goes out that was due at `due`, host time.
    fn lateness(&self, due: SimTime) {
        self.counts.lateness.note(self.clock.lateness(due));
    }
}
