//! A dialect on a pseudo-terminal.

use std::path::Path;

use rowscan_ports::{Pty, Untaken};
use tokio::io::{AsyncReadExt, AsyncWriteExt, split};
use tokio::sync::mpsc;

use super::dialect::{Dialect, pass};
use super::{BusError, PortListener};
use crate::port_event::OutgoingFrame;

/// Bytes that are gathered for one write.
const WRITE: usize = 4096;

/// A pseudo-terminal whose other end speaks a dialect.
#[derive(Debug)]
pub struct PtyLink<D> {
    pty: Pty,
    dialect: D,
}

impl<D: Dialect> PtyLink<D> {
    pub(super) fn open(link: &Path) -> Result<Self, BusError> {
        Ok(Self { pty: Pty::open(link)?, dialect: D::default() })
    }

    pub(super) fn path(&self) -> &Path {
        self.pty.path()
    }

    pub(super) fn untaken(&self) -> Result<Untaken, BusError> {
        Ok(self.pty.untaken()?)
    }

    pub(super) async fn run(self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let Self { pty, mut dialect } = self;
        let (mut reader, mut writer) = split(pty);
        let (mut bytes, mut answers, mut heard) = ([0; 512], Vec::new(), Vec::new());
        let mut pending = Vec::new();
        loop {
            tokio::select! {
                read = reader.read(&mut bytes) => match read {
                    Ok(0) | Err(_) => return,
                    Ok(count) => {
                        dialect.take(bytes.get(..count).unwrap_or_default(), &mut answers, &mut heard);
                    }
                },
                frame = queue.recv() => {
                    // What has gathered meanwhile goes in the same write.
                    let mut next = frame;
                    while let Some(OutgoingFrame { at, what, pending: written, .. }) = next {
                        pass(&mut dialect, at, &what, &mut answers);
                        pending.push(written);
                        next = if answers.len() < WRITE { queue.try_recv().ok() } else { None };
                    }
                    if pending.is_empty() { return }
                }
            }
            if writer.write_all(&answers).await.is_err() {
                return;
            }
            answers.clear();
            pending.clear();
            for heard in heard.drain(..) {
                ear.hear(heard).await;
            }
        }
    }
}
