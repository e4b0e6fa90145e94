//! Who has a pseudo-terminal open: the system tells when one is opened and closed.

use std::mem::MaybeUninit;
use std::os::fd::OwnedFd;
use std::path::Path;
use std::task::{Context, Poll, ready};

use rustix::fs::inotify::{self, CreateFlags, ReadFlags, WatchFlags};
use rustix::io::Errno;
use tokio::io::unix::AsyncFd;

/// Counts the programs that have a terminal open.
///
/// The system merges equal notices that nobody has read yet, so two programs that open in one moment count once. Bytes from a client
/// that was not counted are the proof that it is there ([`Occupancy::proven`]).
#[derive(Debug)]
pub(super) struct Occupancy {
    notices: AsyncFd<OwnedFd>,
    clients: u32,
    /// Bytes came while none was counted.
    proven: bool,
}

/// Has the runtime tell when `descriptor` can be read or written.
#[expect(deprecated, reason = "what replaces it is unsafe; an owned descriptor holds what that asks for")]
pub(super) fn watched(descriptor: OwnedFd) -> std::io::Result<AsyncFd<OwnedFd>> {
    AsyncFd::new(descriptor)
}

/// What changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// The first client came.
    Came,
    /// The last client left.
    Left,
}

impl Occupancy {
    /// Watches `terminal`, which no client has open yet.
    pub(super) fn watch(terminal: &Path) -> std::io::Result<Self> {
        let notices = inotify::init(CreateFlags::NONBLOCK | CreateFlags::CLOEXEC)?;
        inotify::add_watch(
            &notices,
            terminal,
            WatchFlags::OPEN | WatchFlags::CLOSE_WRITE | WatchFlags::CLOSE_NOWRITE,
        )?;
        Ok(Self { notices: watched(notices)?, clients: 0, proven: false })
    }

    /// Whether any client has it open.
    pub(super) fn is_open(&self) -> bool {
        self.clients > 0 || self.proven
    }

    /// A client has sent something, so there is one; until the next notice says better, as bytes may outlive their sender.
    pub(super) fn proven(&mut self) {
        self.proven = self.clients == 0;
    }

    /// The next change. The caller polls until it is pending.
    pub(super) fn poll_change(&mut self, cx: &mut Context<'_>) -> Poll<std::io::Result<Change>> {
        loop {
            // Asked directly first: the runtime may not have heard yet what has already happened.
            // One notice a time: each is 16 bytes, as the watch is on a file and carries no name.
            let mut room = [MaybeUninit::uninit(); 24];
            let mut reader = inotify::Reader::new(self.notices.get_ref(), &mut room);
            let before = self.clients;
            match reader.next() {
                Ok(notice) if notice.events().contains(ReadFlags::OPEN) => {
                    self.clients += 1;
                    self.proven = false;
                }
                Ok(notice)
                    if notice.events().intersects(ReadFlags::CLOSE_WRITE | ReadFlags::CLOSE_NOWRITE) =>
                {
                    self.clients = self.clients.saturating_sub(1);
                }
                Ok(_) => {}
                Err(Errno::AGAIN) => ready!(self.notices.poll_read_ready(cx))?.clear_ready(),
                Err(Errno::INTR) => {}
                Err(cause) => return Poll::Ready(Err(cause.into())),
            }
            match (before, self.clients) {
                (0, 1) => return Poll::Ready(Ok(Change::Came)),
                (1, 0) => return Poll::Ready(Ok(Change::Left)),
                _ => {}
            }
        }
    }
}
