//! Telling where a command can be reached: one line an endpoint, for people or for scripts.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use rowscan_bench::At;
use rowscan_bus::link::Found;
use serde::Serialize;

use super::output::{self, say};
use super::{Failure, Format};

/// The ports of a SICK scanner; both take the same commands.
pub(super) const DEFAULT_PORTS: [u16; 2] = [2111, 2112];
/// The same on this machine alone.
pub(super) const DEFAULT_ENDPOINTS: [&str; 2] = ["127.0.0.1:2111", "127.0.0.1:2112"];

/// The line that tells a script where an endpoint is.
#[derive(Debug, Serialize)]
struct Listening<'a> {
    event: &'static str,
    endpoint: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    stream: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    address: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    path: Option<String>,
}

/// Where something can be reached.
pub(super) enum Place {
    /// A network address, with the real port where 0 was asked for, or a name.
    Address(String),
    /// A device file or a link to one.
    Path(PathBuf),
}

impl From<&At> for Place {
    fn from(at: &At) -> Self {
        match at {
            At::Path(path) => Self::Path(path.clone()),
            At::Address(_) | At::Name(_) => Self::Address(at.to_string()),
        }
    }
}

impl From<&Found> for Place {
    fn from(found: &Found) -> Self {
        match found {
            Found::Path(path) => Self::Path(path.clone()),
            Found::Address(_) | Found::Name(_) => Self::Address(found.to_string()),
        }
    }
}

impl From<&SocketAddr> for Place {
    fn from(address: &SocketAddr) -> Self {
        Self::Address(address.to_string())
    }
}

impl From<&Path> for Place {
    fn from(path: &Path) -> Self {
        Self::Path(path.to_owned())
    }
}

/// Announces all places of a bench; `stream_of` names the stream of a part, where it is one among several.
pub(super) fn announce_all<'a>(
    format: Format,
    places: &'a [rowscan_bench::Place],
    stream_of: impl Fn(&'a str) -> Option<&'a str>,
) -> Result<(), Failure> {
    places.iter().try_for_each(|place| announce_stream(format, stream_of(&place.part), place.kind, &place.at))
}

/// Announces the endpoint called `name` (`tcp`, `pty`, `serial`, `rfc2217`, `nmea`, …), of one stream among several where that is named.
pub(super) fn announce_stream(
    format: Format,
    stream: Option<&str>,
    name: &str,
    place: impl Into<Place>,
) -> Result<(), Failure> {
    let (address, path) = match place.into() {
        Place::Address(address) => (Some(address), None),
        Place::Path(path) => (None, Some(path.display().to_string())),
    };
    match format {
        Format::Json | Format::Jsonl => {
            let line = Listening { event: "listening", endpoint: name, stream, address, path };
            output::print_event(format, &line)
        }
        Format::Csv | Format::Table => {
            let stream = stream.map(|stream| format!(" ({stream})")).unwrap_or_default();
            say(format_args!("listening on {name} {}{stream}", address.or(path).unwrap_or_default()));
            Ok(())
        }
    }
}
