//! What can go wrong between a host and its scanner.

use std::io;
use std::net::SocketAddrV4;
#[cfg(feature = "recordings")]
use std::path::PathBuf;
use std::time::Duration;

use rowscan_protocol::frame::{Dialect, FrameCounts};
use rowscan_protocol::host::Refusal;
#[cfg(feature = "recordings")]
use rowscan_recording::{Format, ReadError, StreamKind, Torn};

/// Why a source could not be opened or read on. Each message names the remedy where there is one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DriverError {
    /// The source is written in a way the driver does not know.
    #[error(
        "source `{found}` is not understood: {reason}; expected tcp://HOST:PORT, picoscan://HOST:PORT?udp=2115, serial:/dev/ttyUSB0?baud=38400, rfc2217://HOST:PORT or the path of a recording"
    )]
    Source {
        /// What was given.
        found: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The source needs a feature that this build leaves out.
    #[error("`{source_text}` needs the feature `{feature}` of rowscan-driver, and this build leaves it out")]
    Feature {
        /// The source.
        source_text: String,
        /// The feature's name.
        feature: &'static str,
    },
    /// No TCP connection could be made.
    #[error(
        "cannot connect to {address}: {cause}; is the scanner powered, and is this its address and port (2111 or 2112)?"
    )]
    Connect {
        /// Host and port.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// No connection to a REST interface could be made.
    #[error(
        "cannot connect to the REST interface at {address}: {cause}; is the scanner powered, and is this its address and port (80 on a picoScan)?"
    )]
    ConnectRest {
        /// Host and port.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// Datagrams cannot be received where they are to come to.
    #[error(
        "cannot receive datagrams at {at}: {cause}; expected a port that no other program listens at (?udp=PORT) and an address of this machine (bind=ADDRESS)"
    )]
    Udp {
        /// Address and port.
        at: String,
        /// What the system said.
        cause: io::Error,
    },
    /// A scanner has accepted its settings, and sends nothing that comes here.
    #[error(
        "{address} has accepted its settings, and no Compact telegram came to UDP {to} within {timeout:?}: expected an open port in this machine's firewall, and an address that the scanner reaches (bind=ADDRESS); a virtual scanner sends to this machine only, unless --allow-destination {} allows it", to.ip()
    )]
    NoDatagrams {
        /// Host and port of REST.
        address: String,
        /// Where they should come to.
        to: SocketAddrV4,
        /// How long they were waited for.
        timeout: Duration,
    },
    /// No answer of a REST interface.
    #[error(
        "{address} accepts connections and gave no answer to `/api/{name}` within {timeout:?} that can be read; is this the HTTP port of a picoScan?"
    )]
    NoRest {
        /// Host and port.
        address: String,
        /// What was asked.
        name: &'static str,
        /// How long it was given.
        timeout: Duration,
    },
    /// Another HTTP server than a scanner's REST interface.
    #[error(
        "expected JSON of a picoScan at `{address}/api/{name}`, found {found} (HTTP {http}): is this another device's page? Expected the scanner's own address and its HTTP port (80 as delivered), and no proxy between"
    )]
    NotRest {
        /// Host and port.
        address: String,
        /// What was asked.
        name: &'static str,
        /// What came instead.
        found: &'static str,
        /// The code of HTTP.
        http: u16,
    },
    /// A login over REST was refused.
    #[error(
        "{address} refused the login of `{user}` ({code}): expected the scanner's own password, as in picoscan://HOST?password=PASSWORD (as delivered: user Service, password servicelevel), or, where that is right, an end of what makes its challenges go stale (the login was tried again with a fresh one); after five failed logins it refuses all for 30 s"
    )]
    Login {
        /// Host and port.
        address: String,
        /// Who wanted to log in.
        user: String,
        /// The device's reason.
        code: Refusal,
    },
    /// A REST interface takes no more requests for now.
    #[error(
        "{address} takes no more requests ({code}), nor after {waited:?}: this is not about the password. After five failed logins, of any client, a scanner refuses all for 30 s; expected to be asked again after that, with other clients of its REST interface closed"
    )]
    TooManyRequests {
        /// Host and port.
        address: String,
        /// The device's reason.
        code: Refusal,
        /// How long it was asked again and again.
        waited: Duration,
    },
    /// A REST interface refuses its own challenges.
    #[error(
        "{address} took the password before, and then refused two challenges in a row that it had just given ({code}): its nonces go stale on the way. Expected no other client that asks it for challenges meanwhile, and a quick link; restart the scanner if it stays so"
    )]
    StaleNonce {
        /// Host and port.
        address: String,
        /// The device's reason.
        code: Refusal,
    },
    /// A serial port could not be opened.
    #[error(
        "cannot open {place}: {cause}; is the port there, may you use it (group `dialout`), and does no other program have it open?"
    )]
    Port {
        /// The source.
        place: String,
        /// What the system said.
        cause: io::Error,
    },
    /// No LMS2xx answers on a serial line.
    #[error(
        "no LMS2xx answers on {place} at 9600, 38400, 19200 or 500000 bits a second ({what}){junk}; is it powered, and are its lines crossed?"
    )]
    NoLms2xx {
        /// The source.
        place: String,
        /// What it was asked to do.
        what: &'static str,
        /// What came instead, if anything.
        junk: JunkBytes,
    },
    /// An LMS2xx refused what no scan can come without.
    #[error("the LMS2xx on {place} refused: {what}")]
    Declined {
        /// The source.
        place: String,
        /// What it was asked to do.
        what: &'static str,
    },
    /// An LMS2xx has restarted.
    #[error("the LMS2xx on {place} has restarted")]
    Restarted {
        /// The source.
        place: String,
    },
    /// The peer accepted the connection and answered in neither dialect.
    #[error(
        "{address} accepts connections but does not answer as a SICK scanner: no reply to `sRN DeviceIdent` within {timeout:?} in \
         CoLa B nor in CoLa A{junk}; is another program listening on this port? The HTTP port of a picoScan is read as picoscan://{address}"
    )]
    NoDialect {
        /// Host and port.
        address: String,
        /// How long each dialect was given.
        timeout: Duration,
        /// What came instead, if anything.
        junk: JunkBytes,
    },
    /// A command of the start-up got no reply.
    #[error(
        "{address} did not answer `{command}` in {dialect}, asked twice with {timeout:?} each: expected its reply, found {} telegrams that are none and {} damaged ones; look for what damages bytes between (cable, network, proxy) and for other clients of the scanner, then start anew",
        counts.frames, counts.bad
    )]
    NoAnswer {
        /// Host and port.
        address: String,
        /// The command.
        command: &'static str,
        /// The dialect in use.
        dialect: Dialect,
        /// How long it was given each time.
        timeout: Duration,
        /// What came on this connection.
        counts: FrameCounts,
    },
    /// A command without which no scan can come was refused.
    #[error("{address} refused `{command}`: {code}")]
    Refused {
        /// Host and port.
        address: String,
        /// The command.
        command: &'static str,
        /// The device's reason.
        code: Refusal,
    },
    /// The peer closed the connection.
    #[error("{address} closed the connection {when}")]
    Closed {
        /// Host and port.
        address: String,
        /// In which phase.
        when: &'static str,
    },
    /// The peer closed the connection before it had answered in CoLa.
    #[error(
        "{address} closed the connection during start-up: expected an answer to `sRN DeviceIdent` in CoLa B or CoLa A, found {}; is this the CoLa port of a SICK \
         scanner (2112 or 2111)? The HTTP port of a picoScan is read as picoscan://{address}",
        if junk.0 == 0 { "nothing".to_owned() } else { format!("{} bytes that are no telegram", junk.0) }
    )]
    ClosedUnanswered {
        /// Host and port.
        address: String,
        /// What came instead, if anything.
        junk: JunkBytes,
    },
    /// The link broke.
    #[error("the link to {address} broke: {cause}")]
    Link {
        /// Host and port.
        address: String,
        /// What the system said.
        cause: io::Error,
    },
    /// Nothing arrived for too long.
    #[error("{address} sent nothing for {timeout:?}")]
    Stalled {
        /// Host and port.
        address: String,
        /// The limit.
        timeout: Duration,
    },
    /// A lost link stayed lost.
    #[error("gave up on {address} after {after:?} without a connection; the last attempt said: {last}")]
    GaveUp {
        /// Host and port.
        address: String,
        /// How long it was tried.
        after: Duration,
        /// The last attempt's error.
        last: Box<DriverError>,
    },
    /// A recording could not be read.
    #[cfg(feature = "recordings")]
    #[error("cannot read recording {}: {cause}", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        cause: ReadError,
    },
    /// A recording has no stream of that name.
    #[cfg(feature = "recordings")]
    #[error("{} has no stream `{wanted}`; it has {}", path.display(), found.join(", "))]
    NoStream {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: Vec<String>,
    },
    /// A file holds telegrams, and none of them is a scan.
    #[cfg(feature = "recordings")]
    #[error("{} ({format}) holds no scan; it holds {holds}{}", path.display(), torn.as_ref().map_or_else(String::new, |torn| format!("; {torn}")))]
    NoScan {
        /// The file.
        path: PathBuf,
        /// What the file looks like.
        format: Format,
        /// Its telegrams by name and count.
        holds: String,
        /// Where it breaks off, if it does.
        torn: Option<Box<Torn>>,
    },
    /// A file holds no telegram.
    #[cfg(feature = "recordings")]
    #[error(
        "{} ({format}) holds no SICK telegram{}; expected {}",
        path.display(),
        in_bytes(*bytes),
        telegrams_of(*kind)
    )]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// What the file looks like.
        format: Format,
        /// What its bytes were read as.
        kind: StreamKind,
        /// Bytes in which a telegram could have been.
        bytes: u64,
    },
}

/// Bytes of scanners that were looked through; a file of other things (a bus, a GNSS receiver) has none.
#[cfg(feature = "recordings")]
fn in_bytes(bytes: u64) -> String {
    if bytes > 0 { format!(" in its {bytes} bytes") } else { String::new() }
}

/// What is expected of bytes that are read as these.
#[cfg(feature = "recordings")]
fn telegrams_of(kind: StreamKind) -> &'static str {
    match kind {
        StreamKind::Compact => {
            "Compact telegrams (02 02 02 02, type, content, CRC of four bytes), found their beginning and none whole with a right CRC; `rowscan decode` says of \
             each what is wrong"
        }
        StreamKind::Lms2xx => "LMS2xx telegrams (02, address, length, content, CRC of two bytes)",
        StreamKind::Cola | StreamKind::Nmea | StreamKind::Can | StreamKind::Bytes => {
            "CoLa A (02 … 03) or CoLa B (02 02 02 02, length, payload, checksum) frames with LMDscandata, or Compact telegrams"
        }
    }
}

/// Bytes of a peer that speaks no known protocol: so many belong to no valid frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JunkBytes(pub u64);

impl std::fmt::Display for JunkBytes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            0 => Ok(()),
            n => write!(f, " ({n} bytes came that are no telegram)"),
        }
    }
}
