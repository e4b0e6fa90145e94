//! Where NMEA goes out: TCP to whoever connects, UDP, a pseudo-terminal, a serial port.

use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use bytes::Bytes;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::{Notify, broadcast, mpsc};
use tokio::task::JoinSet;

use super::sentence::SENTENCES;
use rowscan_ports::in_flight::{InFlight, Pending};
use rowscan_ports::task;
use rowscan_ports::{Delivery, Port, PortError, Pty, Tally, Untaken, Wire, keep_alive, uart};

/// Epochs a client may be behind before it loses some.
const QUEUE: usize = 256;
/// Epochs that may be pending where nothing is lost: fewer than a client's queue holds.
const MOST_PENDING: u64 = 128;
/// TCP clients at once.
const MAX_CLIENTS: usize = 32;

/// A place for sentences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NmeaAddress {
    /// `tcp:HOST:PORT`: a server.
    Tcp(String),
    /// `udp:HOST:PORT`: datagrams to there.
    Udp(String),
    /// `pty:LINK`: a pseudo-terminal that any rate reads; `pty:LINK@4800` at the pace of such a line, garbage to who listens at another rate.
    Pty(PathBuf, Option<u32>),
    /// `serial:DEV@RATE`: a serial port at that rate.
    Serial(PathBuf, u32),
}

/// `LINE@RATE`, with a rate that serial lines have.
pub(super) fn rated(place: &str) -> Option<(PathBuf, u32)> {
    let (line, rate) = place.rsplit_once('@').filter(|(line, _)| !line.is_empty())?;
    let rate = rate.parse().ok().filter(|rate| (300..=4_000_000).contains(rate))?;
    Some((line.into(), rate))
}

/// What a network address was refused with.
pub(super) fn refused(address: &str) -> impl FnOnce(std::io::Error) -> NmeaError + use<> {
    let address = address.to_owned();
    |cause| NmeaError::Network { address, cause }
}

/// A name that is no place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected tcp:HOST:PORT, udp:HOST:PORT, pty:LINK (pty:LINK@4800 for a line of that rate) or serial:DEV@RATE, found `{0}`"
)]
pub struct NmeaAddressError(String);

impl FromStr for NmeaAddress {
    type Err = NmeaAddressError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || NmeaAddressError(text.to_owned());
        let (kind, place) = text.split_once(':').filter(|(_, place)| !place.is_empty()).ok_or_else(wrong)?;
        match kind {
            "tcp" if place.contains(':') => Ok(Self::Tcp(place.to_owned())),
            "udp" if place.contains(':') => Ok(Self::Udp(place.to_owned())),
            "pty" if !place.contains('@') => Ok(Self::Pty(place.into(), None)),
            "pty" => rated(place).map(|(link, rate)| Self::Pty(link, Some(rate))).ok_or_else(wrong),
            "serial" => rated(place).map(|(device, rate)| Self::Serial(device, rate)).ok_or_else(wrong),
            _ => Err(wrong()),
        }
    }
}

/// Why a place cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum NmeaError {
    /// A network address.
    #[error("cannot open NMEA at {address}: {cause}")]
    Network {
        /// Where.
        address: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A pseudo-terminal or a serial port.
    #[error(transparent)]
    Line(#[from] PortError),
    /// Too much for the line.
    #[error(
        "{found} bit/s carry {:.1} epochs a second of {bytes} bytes, fewer than gnss.rate_hz = {rate_hz}; lower gnss.rate_hz or take a line of \
         {} bit/s or more", f64::from(*.found) / 10.0 / *.bytes as f64, faster(*.bytes, *.rate_hz)
    )]
    TooSlow {
        /// Bits a second.
        found: u32,
        /// Bytes an epoch, on average over a second.
        bytes: usize,
        /// Epochs a second.
        rate_hz: f64,
    },
}

/// Whether a line of so many bits a second carries so many epochs a second.
fn carries(found: u32, rate_hz: f64) -> Result<(), NmeaError> {
    let each = |once_a_second| {
        let sentences = SENTENCES.iter().filter(move |sentence| sentence.once_a_second == once_a_second);
        sentences.map(|sentence| sentence.longest).sum::<usize>() as f64
    };
    // What is sent once a second is spread over that second's epochs.
    let bytes = (each(false) + each(true) / rate_hz.max(1.0)).ceil() as usize;
    match f64::from(found) < bytes as f64 * 10.0 * rate_hz {
        true => Err(NmeaError::TooSlow { found, bytes, rate_hz }),
        false => Ok(()),
    }
}

/// The next usual rate that carries it.
fn faster(bytes: usize, rate_hz: f64) -> u32 {
    let needed = bytes as f64 * 10.0 * rate_hz;
    let usual = [4800, 9600, 19_200, 38_400, 57_600, 115_200, 230_400, 460_800];
    usual.into_iter().find(|rate| f64::from(*rate) >= needed).unwrap_or(460_800)
}

/// Where an open line is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NmeaPlace {
    /// At a network address.
    Address(SocketAddr),
    /// Under a path.
    Path(PathBuf),
}

impl fmt::Display for NmeaPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => address.fmt(f),
            Self::Path(path) => path.display().fmt(f),
        }
    }
}

/// Sentences on their way out, and what tells that they are.
type Epoch = (Bytes, Pending);

/// An open line.
#[derive(Debug)]
pub struct NmeaLine {
    outbox: mpsc::Sender<Epoch>,
    in_flight: InFlight,
    untaken: Option<Untaken>,
    takers: Arc<Takers>,
    place: NmeaPlace,
    is_datagrams: bool,
    _tasks: JoinSet<()>,
}

impl NmeaLine {
    /// Opens a place for a receiver of this rate.
    ///
    /// # Errors
    /// What the system refuses, or a rate the line cannot carry.
    pub async fn open(address: &NmeaAddress, rate_hz: f64) -> Result<Self, NmeaError> {
        let (outbox, mut queue) = mpsc::channel(QUEUE);
        let (mut tasks, mut untaken) = (JoinSet::new(), None);
        let takers = Arc::<Takers>::default();
        let place = match address {
            NmeaAddress::Tcp(place) => {
                let listener = TcpListener::bind(place).await.map_err(refused(place))?;
                let address = listener.local_addr().map_err(refused(place))?;
                tasks.spawn(task(serve(listener, queue, Arc::clone(&takers))));
                NmeaPlace::Address(address)
            }
            NmeaAddress::Udp(place) => {
                let socket = UdpSocket::bind("0.0.0.0:0").await.map_err(refused(place))?;
                socket.connect(place).await.map_err(refused(place))?;
                let address = socket.peer_addr().map_err(refused(place))?;
                tasks.spawn(task(send_datagrams(socket, queue, takers.enter())));
                NmeaPlace::Address(address)
            }
            NmeaAddress::Serial(device, rate) => {
                carries(*rate, rate_hz)?;
                let port = Port::open(device, *rate)?;
                let taker = takers.enter();
                tasks.spawn(task(async move {
                    let _taker = taker;
                    write_line(port, None, queue).await;
                }));
                NmeaPlace::Path(device.clone())
            }
            NmeaAddress::Pty(link, rate) => {
                rate.map_or(Ok(()), |rate| carries(rate, rate_hz))?;
                let mut pty = Pty::open(link)?;
                let path = pty.path().to_owned();
                untaken = Some(pty.untaken()?);
                let (takers, rate) = (Arc::clone(&takers), *rate);
                tasks.spawn(task(async move {
                    // What nobody reads is dropped, as on a cable without a receiver.
                    let opened = loop {
                        tokio::select! {
                            opened = pty.opened() => break opened,
                            epoch = queue.recv() => if epoch.is_none() { return },
                        }
                    };
                    if opened.is_ok() {
                        let _taker = takers.enter();
                        write_line(pty, rate, queue).await;
                    }
                }));
                NmeaPlace::Path(path)
            }
        };
        Ok(Self {
            outbox,
            in_flight: InFlight::default(),
            untaken,
            takers,
            place,
            is_datagrams: matches!(address, NmeaAddress::Udp(_)),
            _tasks: tasks,
        })
    }

    /// Where it is found.
    pub fn place(&self) -> &NmeaPlace {
        &self.place
    }

    /// What has been sent and is not written yet.
    pub fn in_flight(&self) -> &InFlight {
        &self.in_flight
    }

    /// Waits until whoever listens has everything. Cancel safe.
    pub async fn taken(&self) {
        self.in_flight.flushed().await;
        if let Some(untaken) = &self.untaken {
            untaken.taken().await;
        }
    }

    /// Hands out an epoch. Patient, it waits for a line that is behind; else the line loses it.
    pub async fn send(&self, epoch: Bytes, delivery: Delivery) {
        delivery.put(&self.outbox, (epoch, self.in_flight.enter())).await;
        if delivery.is_patient() {
            self.in_flight.below(MOST_PENDING).await;
        }
    }

    /// Whether sentences go out as datagrams.
    pub fn is_datagrams(&self) -> bool {
        self.is_datagrams
    }

    /// Whether somebody takes what is sent here. A real port and a datagram's receiver count as takers: nobody can tell.
    pub fn has_taker(&self) -> bool {
        self.takers.count.load(Ordering::Relaxed) > 0
    }

    /// Has `changed` notified when a taker comes.
    pub fn notify_of_takers(&self, changed: &Arc<Notify>) {
        let _ = self.takers.changed.set(Arc::clone(changed));
    }
}

/// Who takes what a line sends.
#[derive(Debug, Default)]
struct Takers {
    count: AtomicUsize,
    /// Who wants to know when one comes.
    changed: OnceLock<Arc<Notify>>,
}

/// One taker; dropped when it is gone.
struct Taker(Arc<Takers>);

impl Takers {
    fn enter(self: &Arc<Self>) -> Taker {
        self.count.fetch_add(1, Ordering::Relaxed);
        if let Some(changed) = self.changed.get() {
            changed.notify_one();
        }
        Taker(Arc::clone(self))
    }
}

impl Drop for Taker {
    fn drop(&mut self) {
        self.0.count.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A client gone takes nothing with it; one that is behind loses epochs, alone.
async fn serve(listener: TcpListener, mut queue: mpsc::Receiver<Epoch>, takers: Arc<Takers>) {
    let (spread, _) = broadcast::channel(QUEUE);
    let (mut clients, refused) = (JoinSet::new(), Tally::default());
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, _)) if clients.len() < MAX_CLIENTS => {
                    let (epochs, taker) = (spread.subscribe(), takers.enter());
                    clients.spawn(task(async move {
                        let _taker = taker;
                        serve_client(stream, epochs).await;
                    }));
                }
                Ok((_, client)) => {
                    if let Some(so_far) = refused.count() {
                        tracing::warn!("{client} is refused: {MAX_CLIENTS} clients get NMEA sentences already ({so_far} so far)");
                    }
                }
                Err(_) => rowscan_ports::clock::retry_pause().await,
            },
            epoch = queue.recv() => {
                let Some(epoch) = epoch else { return };
                // Nobody there is nothing wrong.
                let _ = spread.send(epoch);
            }
            Some(_) = clients.join_next() => {}
        }
    }
}

async fn serve_client(mut stream: TcpStream, mut epochs: broadcast::Receiver<Epoch>) {
    let _ = keep_alive(&stream);
    let (mut reader, mut writer) = stream.split();
    let mut ignored = [0; 256];
    loop {
        tokio::select! {
            // What a client says (an NTRIP line, perhaps) is not for us; that it goes is.
            read = reader.read(&mut ignored) => if !matches!(read, Ok(1..)) { return },
            epoch = epochs.recv() => match epoch {
                Ok((epoch, _pending)) => if writer.write_all(&epoch).await.is_err() { return },
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return,
            },
        }
    }
}

async fn send_datagrams(socket: UdpSocket, mut queue: mpsc::Receiver<Epoch>, _taker: Taker) {
    while let Some((epoch, _pending)) = queue.recv().await {
        // Nobody listening there is nothing wrong.
        let _ = socket.send(&epoch).await;
    }
}

/// Writes epochs to a line of this rate; without one, of whatever rate its reader has set.
async fn write_line(mut wire: impl Wire, rate: Option<u32>, mut queue: mpsc::Receiver<Epoch>) {
    let mut ignored = [0; 256];
    loop {
        tokio::select! {
            read = wire.read(&mut ignored) => if read.is_err() { return },
            epoch = queue.recv() => {
                let Some((epoch, _pending)) = epoch else { return };
                // A reader at another rate hears what it would on copper. A port that cannot tell has the right one.
                let heard = match rate.zip(wire.client_rate().ok().flatten()) {
                    Some((from, to)) if !uart::understands(from, to) => Bytes::from(uart::hear(&epoch, from, to)),
                    _ => epoch,
                };
                if wire.write_all(&heard).await.is_err() { return }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_named() {
        assert_eq!("tcp:127.0.0.1:0".parse(), Ok(NmeaAddress::Tcp("127.0.0.1:0".into())));
        assert_eq!("pty:/tmp/gps@4800".parse(), Ok(NmeaAddress::Pty("/tmp/gps".into(), Some(4800))));
        assert_eq!("serial:/dev/ttyS0@38400".parse(), Ok(NmeaAddress::Serial("/dev/ttyS0".into(), 38_400)));
        for wrong in ["tcp:5", "gps", "pty:x@fast", "serial:", "serial:/dev/ttyS0", "serial:@4800", ""] {
            assert!(wrong.parse::<NmeaAddress>().is_err(), "{wrong}");
        }
    }

    #[tokio::test]
    async fn a_line_that_cannot_carry_the_rate_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let address = NmeaAddress::Pty(folder.path().join("gps"), Some(4800));
        let error = NmeaLine::open(&address, 10.0).await.unwrap_err().to_string();
        assert!(
            error.contains("fewer than gnss.rate_hz = 10") && error.contains("38400 bit/s or more"),
            "{error}"
        );
        assert!(NmeaLine::open(&address, 1.0).await.is_ok());
    }

    #[tokio::test]
    async fn a_serial_port_gets_its_epochs_at_its_rate() {
        let folder = tempfile::tempdir().unwrap();
        // The far end of the port is a pseudo-terminal here.
        let mut far = Pty::open(&folder.path().join("port")).unwrap();
        let device = std::fs::canonicalize(far.path()).unwrap();
        let slow = NmeaLine::open(&NmeaAddress::Serial(device.clone(), 4800), 10.0).await;
        assert!(matches!(slow, Err(NmeaError::TooSlow { found: 4800, .. })));
        let line = NmeaLine::open(&NmeaAddress::Serial(device.clone(), 38_400), 10.0).await.unwrap();
        assert_eq!(line.place(), &NmeaPlace::Path(device));
        line.send(Bytes::from_static(b"$GNHDT,0.00,T*00\r\n"), Delivery::Patient).await;
        let mut heard = [0; 18];
        let read = tokio::time::timeout(std::time::Duration::from_secs(10), far.read_exact(&mut heard)).await;
        assert_eq!(read.expect("in time").expect("it is read"), 18);
        assert_eq!(&heard, b"$GNHDT,0.00,T*00\r\n");
        assert_eq!(rowscan_ports::Wire::client_rate(&far).unwrap(), Some(38_400));
    }

    #[tokio::test]
    async fn who_listens_at_another_rate_hears_no_sentence() {
        let folder = tempfile::tempdir().unwrap();
        for (client, line_rate, clean) in
            [(9600, Some(38_400), false), (38_400, Some(38_400), true), (9600, None, true)]
        {
            let link = folder.path().join(format!("gps{client}{}", line_rate.is_some()));
            let line = NmeaLine::open(&NmeaAddress::Pty(link.clone(), line_rate), 1.0).await.unwrap();
            let mut port = Port::open(&link, client).unwrap();
            while !line.has_taker() {
                tokio::task::yield_now().await;
            }
            let sentence = b"$GNHDT,0.00,T*00\r\n";
            line.send(Bytes::from_static(sentence), Delivery::Patient).await;
            let mut heard = [0; 64];
            let within = std::time::Duration::from_secs(10);
            let read = tokio::time::timeout(within, port.read(&mut heard)).await.expect("in time").unwrap();
            assert_eq!(&heard[..read] == sentence, clean, "{client} {line_rate:?}: {:?}", &heard[..read]);
        }
    }

    #[tokio::test]
    async fn the_client_after_the_last_is_refused_at_once() {
        let line = NmeaLine::open(&NmeaAddress::Tcp("127.0.0.1:0".to_owned()), 1.0).await.unwrap();
        let NmeaPlace::Address(address) = *line.place() else { panic!("a server") };
        let mut served = Vec::new();
        for _ in 0..MAX_CLIENTS {
            served.push(TcpStream::connect(address).await.unwrap());
        }
        let mut refused = TcpStream::connect(address).await.unwrap();
        let ended = tokio::time::timeout(std::time::Duration::from_secs(10), refused.read_u8()).await;
        assert!(ended.expect("it does not hang").is_err(), "nothing is sent to it");
        // Who leaves makes room.
        line.send(Bytes::from_static(b"$A\r\n"), Delivery::Patient).await;
        assert_eq!(served[0].read_u8().await.unwrap(), b'$');
        served.clear();
        while line.takers.count.load(Ordering::Relaxed) > 0 {
            tokio::task::yield_now().await;
        }
        let mut next = TcpStream::connect(address).await.unwrap();
        while !line.has_taker() {
            tokio::task::yield_now().await;
        }
        line.send(Bytes::from_static(b"$B\r\n"), Delivery::Patient).await;
        assert_eq!(next.read_u8().await.unwrap(), b'$');
    }
}
