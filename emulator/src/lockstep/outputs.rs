//! Acknowledgements by outputs: a step is worked in once so many lines, datagrams or frames have come since it began.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::io::{AsyncBufReadExt, AsyncReadExt, BufReader};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::Notify;
use tokio::task::JoinSet;

use super::level::{OutputAck, OutputPort};
use super::looked::Looked;
use rowscan_ports::task;

/// Connections at once.
const MOST: usize = 32;
/// The longest line; a longer one counts by its pieces.
const LONGEST: u64 = 64 * 1024;

/// Outputs that have come in so far at one place. Clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct OutputCount {
    /// Only frames of this identifier count, if there is one.
    id: Option<u32>,
    counted: Arc<Counted>,
}

#[derive(Debug, Default)]
struct Counted {
    heard: AtomicU64,
    /// Peers that are connected, and that have been.
    here: AtomicU64,
    came: AtomicU64,
}

impl OutputCount {
    /// A frame of this identifier came.
    pub(crate) fn frame(&self, id: u32) {
        if self.id.is_none_or(|counts| counts == id) {
            self.one();
        }
    }

    fn one(&self) {
        self.counted.heard.fetch_add(1, Ordering::Relaxed);
    }

    fn heard(&self) -> u64 {
        self.counted.heard.load(Ordering::Relaxed)
    }
}

/// One place with the outputs that a step waits for.
#[derive(Debug)]
pub(super) struct Outputs {
    config: OutputAck,
    count: OutputCount,
    address: Option<SocketAddr>,
    /// What had come before the present step.
    before: Option<u64>,
    _tasks: JoinSet<()>,
}

impl Outputs {
    pub(super) async fn open(config: OutputAck, joined: Arc<Notify>) -> io::Result<Self> {
        let mut count = OutputCount::default();
        let mut tasks = JoinSet::new();
        let address = match &config.port {
            OutputPort::Can(id) => {
                count.id = *id;
                None
            }
            OutputPort::Tcp(address) => {
                let listener = TcpListener::bind(address).await?;
                let address = listener.local_addr()?;
                tasks.spawn(task(accept(listener, count.clone(), joined)));
                Some(address)
            }
            OutputPort::Udp(address) => {
                let socket = UdpSocket::bind(address).await?;
                let address = socket.local_addr()?;
                tasks.spawn(task(count_datagrams(socket, count.clone())));
                Some(address)
            }
        };
        Ok(Self { config, count, address, before: None, _tasks: tasks })
    }

    pub(super) fn address(&self) -> Option<SocketAddr> {
        self.address
    }

    /// Who counts frames for it.
    pub(super) fn of_bus(&self) -> Option<OutputCount> {
        matches!(self.config.port, OutputPort::Can(_)).then(|| self.count.clone())
    }

    /// True once somebody is there who may send; of buses and datagrams that cannot be known.
    pub(super) fn has_participant(&self) -> bool {
        match self.config.port {
            OutputPort::Tcp(_) => self.count.counted.came.load(Ordering::Acquire) > 0,
            OutputPort::Can(_) | OutputPort::Udp(_) => true,
        }
    }

    /// A step begins: what comes from now on is its own.
    pub(super) fn begin(&mut self) {
        self.before.get_or_insert(self.count.heard());
    }

    pub(super) fn end(&mut self) {
        self.before = None;
    }

    pub(super) fn look(&self) -> Looked {
        let heard = self.count.heard() - self.before.unwrap_or_else(|| self.count.heard());
        // One that hangs up drops out.
        let gone = matches!(self.config.port, OutputPort::Tcp(_))
            && self.count.counted.here.load(Ordering::Acquire) == 0;
        if heard >= self.config.count || gone {
            return Looked::Acknowledged;
        }
        let (wanted, what) = (self.config.count, self.name());
        Looked::Missing(format!("expected {wanted} {what}, {heard} came"))
    }

    fn name(&self) -> String {
        let address = self.address.map(|address| address.to_string()).unwrap_or_default();
        match self.config.port {
            OutputPort::Can(Some(id)) => format!("frames 0x{id:X} on can0"),
            OutputPort::Can(None) => "frames on can0".to_owned(),
            OutputPort::Tcp(_) => format!("lines at {address}"),
            OutputPort::Udp(_) => format!("datagrams at {address}"),
        }
    }
}

async fn accept(listener: TcpListener, count: OutputCount, joined: Arc<Notify>) {
    let mut serving = JoinSet::new();
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) if serving.len() < MOST => {
                    count.counted.here.fetch_add(1, Ordering::AcqRel);
                    count.counted.came.fetch_add(1, Ordering::AcqRel);
                    joined.notify_one();
                    serving.spawn(task(count_lines(stream, count.clone())));
                }
                Ok(_) => {}
                Err(_) => rowscan_ports::clock::retry_pause().await,
            },
            Some(_) = serving.join_next() => {}
        }
    }
}

async fn count_lines(stream: TcpStream, count: OutputCount) {
    let mut reader = BufReader::new(stream);
    let mut line = Vec::new();
    loop {
        line.clear();
        let mut limited = (&mut reader).take(LONGEST);
        match limited.read_until(b'\n', &mut line).await {
            Ok(1..) => count.one(),
            Ok(0) | Err(_) => break,
        }
    }
    count.counted.here.fetch_sub(1, Ordering::AcqRel);
}

async fn count_datagrams(socket: UdpSocket, count: OutputCount) {
    let mut datagram = vec![0; 64 * 1024];
    loop {
        match socket.recv_from(&mut datagram).await {
            Ok(_) => count.one(),
            Err(_) => rowscan_ports::clock::retry_pause().await,
        }
    }
}
