//! A pseudo-terminal: a serial port for programs on the same machine.
//!
//! The scanner's end outlives its clients, as a scanner outlives the program that reads it: a read waits while nobody is there, and
//! what is written then goes where it goes on a cable that nobody listens to.

use std::ffi::OsStr;
use std::future::poll_fn;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::task::{Context, Poll, Waker, ready};

use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, ioctl_tiocnxcl, tcflush, tcgetattr, tcsetattr};
use tokio::io::unix::AsyncFd;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use super::link::Link;
use super::occupancy::{Change, Occupancy, watched};
use crate::PortError;

/// What a port is set to until a client sets it, bits a second.
const FIRST_RATE: u32 = 9600;

/// The scanner's end of a pseudo-terminal with a name that stays.
///
/// Clients may come, go, be killed and come again; see the module's text. The rate a client sets is [`Pty::client_rate`]; the bytes
/// themselves pass at once, whatever it is: who wants a line's pace keeps it himself.
#[derive(Debug)]
pub struct Pty {
    master: AsyncFd<OwnedFd>,
    /// Kept open: without any, the system would tell for ever that the other end is closed, and a reader would spin.
    slave: OwnedFd,
    occupancy: Occupancy,
    link: Link,
    reader: Option<Waker>,
    writer: Option<Waker>,
}

impl Pty {
    /// Makes a pseudo-terminal that clients find at `link`, which is removed with it.
    pub fn open(link: &Path) -> Result<Self, PortError> {
        let (master, slave, name) = pair().map_err(PortError::Pty)?;
        let occupancy = Occupancy::watch(&name).map_err(PortError::Pty)?;
        let master = watched(master).map_err(PortError::Pty)?;
        let link = Link::place(link, &name)?;
        Ok(Self { master, slave, occupancy, link, reader: None, writer: None })
    }

    /// The name clients open.
    pub fn path(&self) -> &Path {
        self.link.path()
    }

    /// Whether a client has it open, as far as reads and writes have noticed.
    pub fn is_open(&self) -> bool {
        self.occupancy.is_open()
    }

    /// The rate the client has set, bits a second; any number, not only the classic ones.
    pub fn client_rate(&self) -> io::Result<u32> {
        Ok(tcgetattr(self.master.get_ref())?.output_speed())
    }

    /// A watch on what the client has not read yet.
    pub fn untaken(&self) -> Result<Untaken, PortError> {
        self.slave.try_clone().map(Untaken).map_err(PortError::Pty)
    }

    /// Waits until a client has it open. Cancel safe.
    pub async fn opened(&mut self) -> io::Result<()> {
        poll_fn(|cx| self.poll_open(cx)).await
    }

    /// Ready once a client has it open.
    pub fn poll_open(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.reader = Some(cx.waker().clone());
        self.poll_clients(cx)?;
        if self.is_open() { Poll::Ready(Ok(())) } else { Poll::Pending }
    }

    /// Follows clients coming and going; wakes whoever waits at the other half.
    fn poll_clients(&mut self, cx: &mut Context<'_>) -> io::Result<()> {
        while let Poll::Ready(change) = self.occupancy.poll_change(cx) {
            // What one client did not read is not for the next one; what it sent still counts.
            let change = change?;
            tcflush(&self.slave, QueueSelector::IFlush)?;
            if change == Change::Left {
                // A killed client cannot give an exclusive port back, nor a text mode.
                ioctl_tiocnxcl(&self.slave)?;
                make_raw(&self.slave)?;
            }
            for waker in [self.reader.take(), self.writer.take()].into_iter().flatten() {
                waker.wake();
            }
        }
        Ok(())
    }
}

/// What a pseudo-terminal's client has not read yet. The system throws it away when the scanner's end is closed: whoever wants it read
/// waits for that first.
#[derive(Debug)]
pub struct Untaken(OwnedFd);

impl Untaken {
    /// Waits until all that was written has been read, or its client has left. Cancel safe.
    pub async fn taken(&self) {
        // What has just been written is on its way within the system, and not to be seen.
        let mut clear = 0;
        while clear < 2 {
            crate::clock::retry_pause().await;
            let unread = rustix::io::ioctl_fionread(&self.0).unwrap_or(0);
            clear = if unread == 0 { clear + 1 } else { 0 };
        }
    }
}

/// Both ends and the name of a new pseudo-terminal.
fn pair() -> io::Result<(OwnedFd, OwnedFd, PathBuf)> {
    let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
    let master = openpt(flags)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let name = ptsname(&master, Vec::new())?;
    let slave = ioctl_tiocgptpeer(&master, flags)?;
    rustix::io::ioctl_fionbio(&master, true)?;
    let mut settings = tcgetattr(&slave)?;
    settings.set_speed(FIRST_RATE)?;
    tcsetattr(&slave, OptionalActions::Now, &settings)?;
    make_raw(&slave)?;
    Ok((master, slave, PathBuf::from(OsStr::from_bytes(name.as_bytes()))))
}

/// Bytes as they are: no echo, no line editing, no signals.
fn make_raw(slave: &OwnedFd) -> io::Result<()> {
    let mut settings = tcgetattr(slave)?;
    settings.make_raw();
    Ok(tcsetattr(slave, OptionalActions::Now, &settings)?)
}

impl AsyncRead for Pty {
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        this.reader = Some(cx.waker().clone());
        this.poll_clients(cx)?;
        loop {
            let mut ready = ready!(this.master.poll_read_ready(cx))?;
            let read =
                ready.try_io(|master| Ok(rustix::io::read(master.get_ref(), buf.initialize_unfilled())?));
            match read {
                Ok(Ok(read)) => {
                    buf.advance(read);
                    this.occupancy.proven();
                    return Poll::Ready(Ok(()));
                }
                Ok(Err(cause)) if cause.kind() == io::ErrorKind::Interrupted => {}
                Ok(Err(cause)) => return Poll::Ready(Err(cause)),
                Err(_would_block) => {}
            }
        }
    }
}

impl AsyncWrite for Pty {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        this.writer = Some(cx.waker().clone());
        this.poll_clients(cx)?;
        loop {
            if !this.is_open() {
                return Poll::Ready(Ok(bytes.len()));
            }
            let mut ready = ready!(this.master.poll_write_ready(cx))?;
            match ready.try_io(|master| Ok(rustix::io::write(master.get_ref(), bytes)?)) {
                Ok(Err(cause)) if cause.kind() == io::ErrorKind::Interrupted => {}
                Ok(written) => return Poll::Ready(written),
                Err(_would_block) => {}
            }
        }
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
