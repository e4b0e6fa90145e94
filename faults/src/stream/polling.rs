//! Reads and writes: through the faults where one is active or something waits, else past them.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use rowscan_ports::Wire;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use super::{FaultyStream, MOST, READER, WRITER};
use crate::event::Direction;

impl<S: AsyncRead + AsyncWrite + Unpin> AsyncRead for FaultyStream<S> {
    fn poll_read(self: Pin<&mut Self>, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        loop {
            let fate = this.sync(cx, READER)?;
            let [to_client, to_device] = fate.closed;
            if fate.finished || to_client {
                // Whether it is done or waits, its waker is known.
                let closed = this.poll_close(cx, READER)?;
                if fate.finished {
                    return closed.map(Ok);
                }
            } else if let Poll::Ready(Err(cause)) = this.poll_drain(cx, READER) {
                return Poll::Ready(Err(cause));
            }
            if to_device {
                return Poll::Ready(Ok(()));
            }
            if fate.dead[Direction::ToDevice.index()] {
                match this.poll_dead(cx, fate) {
                    Poll::Ready(ended) => return Poll::Ready(ended),
                    Poll::Pending => {
                        ready!(this.poll_due(cx, READER));
                        continue;
                    }
                }
            }
            if this.hand_over(buf) {
                return Poll::Ready(Ok(()));
            }
            if this.eof && this.back.is_empty() {
                return Poll::Ready(Ok(()));
            }
            let patient = this.entry.faults.shared.clock.is_patient();
            let taken = if this.eof {
                Poll::Pending
            } else if this.is_quiet(Direction::ToDevice, 0) {
                match this.poll_pass(cx, buf) {
                    Poll::Ready(read) => return Poll::Ready(read),
                    Poll::Pending => Poll::Pending,
                }
            } else if patient || this.back.waiting() < MOST {
                this.poll_take(cx)?
            } else {
                Poll::Pending
            };
            if taken.is_pending() {
                ready!(this.poll_due(cx, READER));
            }
        }
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> AsyncWrite for FaultyStream<S> {
    fn poll_write(self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        loop {
            let fate = this.sync(cx, WRITER)?;
            if fate.finished {
                return Poll::Ready(Err(io::ErrorKind::BrokenPipe.into()));
            }
            if fate.closed[Direction::ToClient.index()] {
                let _ = this.poll_close(cx, WRITER)?;
                this.out.swallow(bytes);
                return Poll::Ready(Ok(bytes.len()));
            }
            if fate.dead[Direction::ToClient.index()] {
                this.out.swallow(bytes);
                return Poll::Ready(Ok(bytes.len()));
            }
            let drained = this.poll_drain(cx, WRITER)?;
            let shared = Arc::clone(&this.entry.faults.shared);
            if drained.is_ready() && this.is_quiet(Direction::ToClient, bytes.len()) {
                let written = ready!(Pin::new(&mut this.inner).poll_write(cx, bytes))?;
                let gone = bytes.get(..written).unwrap_or_default();
                this.pass(Direction::ToClient, gone);
                this.out.observe(gone, shared.clock.now(), &mut shared.plan());
                return Poll::Ready(Ok(written));
            }
            let room =
                if shared.clock.is_patient() { usize::MAX } else { MOST.saturating_sub(this.out.waiting()) };
            if room == 0 {
                ready!(this.poll_due(cx, WRITER));
                continue;
            }
            let bytes = bytes.get(..room).unwrap_or(bytes);
            this.out.push(bytes, shared.clock.now(), &mut shared.plan());
            shared.spread();
            if let Poll::Ready(Err(cause)) = this.poll_drain(cx, WRITER) {
                return Poll::Ready(Err(cause));
            }
            // Whoever reads must know of the new deadlines.
            let reader = shared.plan().take_waker(this.entry.link, READER);
            if let Some(waker) = reader {
                waker.wake();
            }
            return Poll::Ready(Ok(bytes.len()));
        }
    }

    /// Flushes what may leave; what a fault holds back is on its way, as far as the host can know.
    fn poll_flush(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        this.sync(cx, WRITER)?;
        ready!(this.poll_drain(cx, WRITER))?;
        if this.shut { Poll::Ready(Ok(())) } else { Pin::new(&mut this.inner).poll_flush(cx) }
    }

    /// Closes after what is held back has left.
    fn poll_shutdown(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let fate = this.sync(cx, WRITER)?;
        if fate.dead[Direction::ToClient.index()] {
            return Poll::Ready(Ok(()));
        }
        {
            let shared = Arc::clone(&this.entry.faults.shared);
            this.out.finish(shared.clock.now(), &mut shared.plan());
        }
        this.poll_close(cx, WRITER)
    }
}

impl<S: Wire> Wire for FaultyStream<S> {
    fn client_rate(&self) -> io::Result<Option<u32>> {
        self.inner.client_rate()
    }

    fn set_rate(&mut self, rate: u32) -> io::Result<()> {
        self.inner.set_rate(rate)
    }

    fn is_open(&self) -> bool {
        self.inner.is_open()
    }

    fn paces_itself(&self) -> bool {
        self.inner.paces_itself()
    }
}
