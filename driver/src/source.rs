//! Where scans come from.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use crate::DriverError;

/// A live scanner or a recording, as written on a command line.
///
/// ```
/// use rowscan_driver::Source;
/// assert_eq!("tcp://10.0.0.5:2112".parse::<Source>().unwrap(), Source::Tcp { address: "10.0.0.5:2112".into() });
/// assert!(matches!("row7.bin".parse::<Source>().unwrap(), Source::Recording { .. }));
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// CoLa over TCP; `address` is host:port.
    Tcp {
        /// Host and port; an IPv6 host stands in brackets.
        address: String,
    },
    /// A file of recorded telegrams, recognised by its content.
    Recording {
        /// The file.
        path: PathBuf,
        /// Which of its streams; the first with a scan if none is named. Written behind a `#`.
        stream: Option<String>,
    },
}

/// The port SICK drivers dial when none is given.
const DEFAULT_PORT: u16 = 2112;

impl FromStr for Source {
    type Err = DriverError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let refuse = |reason: &str| DriverError::Source { found: text.to_owned(), reason: reason.to_owned() };
        let Some((scheme, rest)) = text.split_once("://") else {
            return if text.is_empty() { Err(refuse("it is empty")) } else { Ok(Self::recording(text)) };
        };
        match scheme {
            "tcp" => {
                parse_address(rest).map(|address| Self::Tcp { address }).map_err(|reason| refuse(&reason))
            }
            "file" => Ok(Self::recording(rest)),
            _ => Err(refuse(&format!("the scheme `{scheme}://` is unknown"))),
        }
    }
}

impl Source {
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
fn parse_address(text: &str) -> Result<String, String> {
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
        None => DEFAULT_PORT,
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
    fn nonsense_is_refused_with_its_reason() {
        for (text, reason) in [
            ("", "empty"),
            ("tcp://", "host is missing"),
            ("tcp://:2112", "host is missing"),
            ("tcp://h:0", "`0` is not a port"),
            ("tcp://h:99999", "`99999` is not a port"),
            ("gopher://h", "scheme `gopher://`"),
        ] {
            let message = text.parse::<Source>().expect_err(text).to_string();
            assert!(message.contains(reason), "{text}: {message}");
            assert!(message.contains("tcp://HOST:PORT"), "{text}: {message}");
        }
    }
}
