//! Where scans come from.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use rowscan_protocol::lms2xx::Rate;

use crate::DriverError;
use crate::picoscan_address::{PicoscanAddress, REST_PORT, without_password};

/// A live scanner or a recording, as written on a command line.
///
/// ```
/// use rowscan_driver::Source;
/// assert_eq!("tcp://10.0.0.5:2112".parse::<Source>().unwrap(), Source::Tcp { address: "10.0.0.5:2112".into() });
/// assert!(matches!("row7.bin".parse::<Source>().unwrap(), Source::Recording { .. }));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Source {
    /// CoLa over TCP; `address` is host:port.
    Tcp {
        /// Host and port; an IPv6 host stands in brackets.
        address: String,
    },
    /// REST for the settings, Compact over UDP for the scans.
    Picoscan(PicoscanAddress),
    /// An LMS2xx on a serial port.
    Serial {
        /// The port's device file.
        path: PathBuf,
        /// The rate to stream at; the one it is found at is found out.
        rate: Rate,
    },
    /// An LMS2xx on a serial port over TCP (RFC 2217); `address` is host:port.
    Rfc2217 {
        /// Host and port; an IPv6 host stands in brackets.
        address: String,
        /// The rate to stream at.
        rate: Rate,
    },
    /// A file of recorded telegrams, recognised by its content.
    Recording {
        /// The file.
        path: PathBuf,
        /// Which of its streams; the first by name of those with scans if none is named. Written behind a `#`.
        stream: Option<String>,
    },
}

impl Source {
    /// The file of a recording; none of a live scanner.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Recording { path, .. } => Some(path),
            _ => None,
        }
    }
}

/// The port SICK drivers dial when none is given.
const DEFAULT_PORT: u16 = 2112;
/// The port of RFC 2217 servers when none is given.
const RFC2217_PORT: u16 = 2217;
/// The rate an LMS2xx is raised to unless told otherwise: what any RS-232 port carries.
const DEFAULT_RATE: Rate = Rate::R38400;

/// What stands before `?baud=N`, and N.
fn with_rate(text: &str) -> Result<(&str, Rate), String> {
    if let Some((place, rate)) = text.rsplit_once('@').filter(|(_, rate)| rate.parse::<u32>().is_ok()) {
        return Err(format!("a scanner's rate stands behind ?baud=: write {place}?baud={rate}"));
    }
    let Some((text, query)) = text.split_once('?') else { return Ok((text, DEFAULT_RATE)) };
    let rate = query.strip_prefix("baud=").and_then(|rate| rate.parse().ok()).and_then(Rate::of);
    let refuse = || format!("`?{query}` is not ?baud= with 9600, 19200, 38400 or 500000");
    Ok((text, rate.ok_or_else(refuse)?))
}

/// Whether it is HOST:PORT and no path.
fn is_address(text: &str) -> bool {
    let is_host = |host: &str| {
        // One letter is a drive.
        host.len() > 1 && host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-._[]:".contains(&byte))
    };
    text.rsplit_once(':').is_some_and(|(host, port)| is_host(host) && port.parse::<u16>().is_ok())
}

impl FromStr for Source {
    type Err = DriverError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let refuse =
            |reason: &str| DriverError::Source { found: without_password(text), reason: reason.to_owned() };
        if let Some(rest) = text.strip_prefix("serial:") {
            let (path, rate) = with_rate(rest).map_err(|reason| refuse(&reason))?;
            // serial:///dev/ttyS0 is the same in the form of other addresses.
            let path = path.strip_prefix("//").unwrap_or(path);
            return match path {
                "" => Err(refuse("the port is missing")),
                path => Ok(Self::Serial { path: path.into(), rate }),
            };
        }
        let Some((scheme, rest)) = text.split_once("://") else {
            return match text {
                "" => Err(refuse("it is empty")),
                text if is_address(text) => Err(refuse(&format!(
                    "it looks like an address: write tcp://{text}, or ./{text} for a file"
                ))),
                text => Ok(Self::recording(text)),
            };
        };
        match scheme {
            "tcp" => parse_address(rest, DEFAULT_PORT)
                .map(|address| Self::Tcp { address })
                .map_err(|reason| refuse(&reason)),
            "picoscan" => {
                let (address, query) = rest.split_once('?').unwrap_or((rest, ""));
                let place = parse_address(address, REST_PORT).map(PicoscanAddress::new);
                place
                    .and_then(|place| place.with_query(query))
                    .map(Self::Picoscan)
                    .map_err(|reason| refuse(&reason))
            }
            "rfc2217" => {
                let (rest, rate) = with_rate(rest).map_err(|reason| refuse(&reason))?;
                let address = parse_address(rest, RFC2217_PORT).map_err(|reason| refuse(&reason))?;
                Ok(Self::Rfc2217 { address, rate })
            }
            "file" => Ok(Self::recording(rest)),
            _ => Err(refuse(&format!("the scheme `{scheme}://` is unknown"))),
        }
    }
}

impl Source {
    /// The feature of this crate that opens such a source.
    pub fn feature(&self) -> &'static str {
        match self {
            Self::Tcp { .. } | Self::Picoscan(_) | Self::Rfc2217 { .. } => "tcp",
            Self::Serial { .. } => "serial",
            Self::Recording { .. } => "recordings",
        }
    }

    /// `FILE` or `FILE#STREAM`.
    fn recording(text: &str) -> Self {
        match text.rsplit_once('#') {
            Some((path, stream)) if !path.is_empty() && !stream.is_empty() => {
                Self::Recording { path: path.into(), stream: Some(stream.to_owned()) }
            }
            _ => Self::Recording { path: text.into(), stream: None },
        }
    }
}

/// Host and port, the port defaulted.
fn parse_address(text: &str, default: u16) -> Result<String, String> {
    let text = text.trim_end_matches('/');
    // In brackets a colon belongs to the address: only one after the bracket starts a port.
    let after_host = text.rfind(']').map_or(0, |bracket| bracket + 1);
    let (host, port) = match text[after_host..].rfind(':') {
        Some(colon) => (&text[..after_host + colon], Some(&text[after_host + colon + 1..])),
        None => (text, None),
    };
    if host.is_empty() {
        return Err("the host is missing".into());
    }
    let port = match port {
        None => default,
        Some(port) => match port.parse::<u16>() {
            Ok(port) if port > 0 => port,
            _ => return Err(format!("`{port}` is not a port from 1 to 65535")),
        },
    };
    Ok(format!("{host}:{port}"))
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp { address } => write!(f, "tcp://{address}"),
            Self::Picoscan(place) => place.fmt(f),
            Self::Serial { path, .. } => write!(f, "serial:{}", path.display()),
            Self::Rfc2217 { address, .. } => write!(f, "rfc2217://{address}"),
            Self::Recording { path, stream: None } => write!(f, "{}", path.display()),
            Self::Recording { path, stream: Some(stream) } => write!(f, "{}#{stream}", path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tcp(text: &str) -> String {
        match text.parse() {
            Ok(Source::Tcp { address }) => address,
            other => panic!("{text} gave {other:?}"),
        }
    }

    #[test]
    fn addresses_keep_their_port_or_get_sicks() {
        assert_eq!(tcp("tcp://scanner:2111"), "scanner:2111");
        assert_eq!(tcp("tcp://192.168.0.1"), "192.168.0.1:2112");
        assert_eq!(tcp("tcp://[::1]:9"), "[::1]:9");
        assert_eq!(tcp("tcp://[::1]/"), "[::1]:2112");
    }

    #[test]
    fn serial_ports_have_a_rate() {
        let serial = |path: &str, rate| Source::Serial { path: path.into(), rate };
        assert_eq!("serial:/dev/ttyUSB0".parse::<Source>().unwrap(), serial("/dev/ttyUSB0", Rate::R38400));
        assert_eq!(
            "serial:///dev/ttyS1?baud=500000".parse::<Source>().unwrap(),
            serial("/dev/ttyS1", Rate::R500000)
        );
        assert_eq!(
            "rfc2217://host?baud=9600".parse::<Source>().unwrap(),
            Source::Rfc2217 { address: "host:2217".into(), rate: Rate::R9600 }
        );
    }

    #[test]
    fn a_picoscan_has_a_port_of_rest_and_one_of_datagrams() {
        let place = |text: &str| match text.parse() {
            Ok(Source::Picoscan(place)) => place,
            other => panic!("{other:?}"),
        };
        let found = place("picoscan://10.0.0.5");
        assert_eq!((found.address.as_str(), found.udp, found.bind), ("10.0.0.5:80", 2115, None));
        let found = place("picoscan://h:8080?udp=0&bind=127.0.0.1&user=Run&password=a=b");
        assert_eq!((found.address.as_str(), found.udp), ("h:8080", 0));
        assert_eq!(found.bind, Some(std::net::Ipv4Addr::LOCALHOST));
        assert_eq!((found.user.as_str(), found.password.as_str()), ("Run", "a=b"));
    }

    /// Sources are told in logs, recordings and messages.
    #[test]
    fn a_password_is_never_shown() {
        let text = "picoscan://h?udp=1&password=secret";
        let source: Source = text.parse().unwrap();
        let refused = format!("{text}&bind=x").parse::<Source>().unwrap_err();
        for told in [source.to_string(), format!("{source:?}"), refused.to_string(), format!("{refused:?}")] {
            assert!(!told.contains("secret") && told.contains("password=***"), "{told}");
        }
    }

    #[test]
    fn files_with_colons_are_files() {
        for path in ["./127.0.0.1:29111", "run:1.mcap", "C:2112", "logs/a:12", "a:b", "12:00:70000"] {
            let source = path.parse::<Source>().expect(path);
            assert_eq!(source, Source::Recording { path: path.into(), stream: None }, "{path}");
        }
    }

    #[test]
    fn nonsense_is_refused_with_its_reason() {
        for (text, reason) in [
            ("", "empty"),
            ("tcp://", "host is missing"),
            ("tcp://:2112", "host is missing"),
            ("tcp://h:0", "`0` is not a port"),
            ("tcp://h:99999", "`99999` is not a port"),
            ("serial:", "port is missing"),
            ("serial:/dev/ttyUSB0?baud=115200", "`?baud=115200` is not"),
            ("serial:/dev/ttyUSB0@38400", "write /dev/ttyUSB0?baud=38400"),
            ("rfc2217://h?rate=9600", "`?rate=9600` is not"),
            ("rfc2217://", "host is missing"),
            ("picoscan://", "host is missing"),
            ("picoscan://h?udp=70000", "`udp` is a port from 0 to 65535, found `70000`"),
            ("picoscan://h?bind=::1", "`bind` is an IPv4 address"),
            ("picoscan://h?password=", "`password` is a text"),
            ("picoscan://h?password=secret&port=1", "`port` is not one of"),
            ("gopher://h", "scheme `gopher://`"),
            ("127.0.0.1:29111", "write tcp://127.0.0.1:29111"),
            ("scanner.local:2112", "write tcp://scanner.local:2112"),
            ("[::1]:2112", "write tcp://[::1]:2112"),
        ] {
            let message = text.parse::<Source>().expect_err(text).to_string();
            assert!(message.contains(reason), "{text}: {message}");
            assert!(message.contains("tcp://HOST:PORT"), "{text}: {message}");
        }
    }
}
