//! A dialect over TCP, for several clients at once.

use std::marker::PhantomData;
use std::net::SocketAddr;
use std::time::Duration;

use rowscan_ports::clock::{Stopwatch, rest};
use rowscan_ports::in_flight::Pending;
use rowscan_ports::task;
use rowscan_ports::{Tally, acknowledge_at_once, keep_alive};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::dialect::{Dialect, pass};
use super::{BusError, PortListener};
use crate::port_event::{OutgoingFrame, PortEvent};

/// Clients served at once.
const MAX_CLIENTS: usize = 16;
/// Frames a client may be behind before it loses some.
const QUEUE: usize = 4096;

/// A listening server.
#[derive(Debug)]
pub struct TcpLink<D> {
    listener: TcpListener,
    address: SocketAddr,
    dialect: PhantomData<D>,
}

impl<D: Dialect> TcpLink<D> {
    pub(super) async fn open(place: &str) -> Result<Self, BusError> {
        let failed = |cause| BusError::Network { what: D::SERVER, address: place.to_owned(), cause };
        let listener = TcpListener::bind(place).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Self { listener, address, dialect: PhantomData })
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) async fn run(self, mut queue: mpsc::Receiver<OutgoingFrame>, ear: PortListener) {
        let mut clients: Vec<(u64, mpsc::Sender<OutgoingFrame>)> = Vec::new();
        let mut numbers = 0..u64::MAX;
        let (mut tasks, refused) = (JoinSet::new(), Tally::default());
        loop {
            tokio::select! {
                accepted = self.listener.accept() => {
                    clients.retain(|(_, client)| !client.is_closed());
                    match accepted {
                        Ok((stream, _)) if clients.len() < MAX_CLIENTS => {
                            let (outbox, queue) = mpsc::channel(QUEUE);
                            let number = numbers.next().unwrap_or_default();
                            clients.push((number, outbox));
                            tasks.spawn(task(serve::<D>(stream, queue, ear.of_client(number))));
                        }
                        Ok((_, client)) => {
                            if let Some(so_far) = refused.count() {
                                tracing::warn!("{client} is refused: {MAX_CLIENTS} clients are on the CAN bus already ({so_far} so far)");
                            }
                        }
                        Err(_) => rowscan_ports::clock::retry_pause().await,
                    }
                }
                frame = queue.recv() => {
                    let Some(outgoing) = frame else { return };
                    // A client that is behind loses frames, alone, and holds nobody up.
                    clients.retain(|(number, client)| {
                        outgoing.said_by == Some(*number)
                            || !matches!(client.try_send(outgoing.clone()), Err(mpsc::error::TrySendError::Closed(_)))
                    });
                }
                Some(_) = tasks.join_next() => {}
            }
        }
    }
}

async fn serve<D: Dialect>(
    mut stream: TcpStream,
    mut queue: mpsc::Receiver<OutgoingFrame>,
    ear: PortListener,
) {
    let _ = keep_alive(&stream);
    let (mut reader, mut writer) = stream.split();
    let mut dialect = D::default();
    let (mut bytes, mut answers, mut heard) = ([0; 512], D::GREETING.as_bytes().to_vec(), Vec::new());
    if D::OPEN_AT_ONCE {
        heard.push(PortEvent::Opened);
    }
    // The frame in `answers`, until it is written.
    let mut written: Option<Pending> = None;
    let mut opened: Option<Stopwatch> = None;
    loop {
        if writer.write_all(&answers).await.is_err() {
            return;
        }
        answers.clear();
        drop(written.take());
        for heard in heard.drain(..) {
            if heard == PortEvent::Opened {
                opened = Some(Stopwatch::start());
            }
            ear.hear(heard).await;
        }
        let quiet = opened.map_or(Duration::ZERO, |opened| D::QUIET.saturating_sub(opened.elapsed()));
        tokio::select! {
            read = reader.read(&mut bytes) => match read {
                Ok(0) | Err(_) => return,
                Ok(count) => {
                    let _ = acknowledge_at_once(reader.as_ref());
                    dialect.take(bytes.get(..count).unwrap_or_default(), &mut answers, &mut heard);
                }
            },
            () = rest(quiet), if !quiet.is_zero() => {}
            frame = queue.recv(), if quiet.is_zero() => {
                let Some(OutgoingFrame { at, what, pending, .. }) = frame else { return };
                written = Some(pending);
                pass(&mut dialect, at, &what, &mut answers);
            }
        }
    }
}
