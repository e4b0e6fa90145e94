//! Telling where a command can be reached: one line an endpoint, for people or for scripts.

use std::fmt::Display;
use std::path::Path;

use serde::Serialize;

use super::output::{self, say};
use super::{Failure, Format};

/// The ports of a SICK scanner; both take the same commands.
pub(super) const DEFAULT_PORTS: [u16; 2] = [2111, 2112];
/// The same on this machine alone.
pub(super) const DEFAULT_ENDPOINTS: [&str; 2] = ["127.0.0.1:2111", "127.0.0.1:2112"];

/// Where something can be reached.
#[derive(Clone, Copy)]
pub(super) enum Place<'a> {
    /// A network address, with the real port where 0 was asked for.
    Address(&'a dyn Display),
    /// A device file or a link to one.
    Path(&'a Path),
}

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

/// Announces the endpoint called `name` (`tcp`, `pty`, `serial`, `rfc2217`, `nmea`, …).
pub(super) fn announce(format: Format, name: &str, place: Place<'_>) -> Result<(), Failure> {
    announce_stream(format, None, name, place)
}

/// The same of the endpoint of one stream among several.
pub(super) fn announce_stream(
    format: Format,
    stream: Option<&str>,
    name: &str,
    place: Place<'_>,
) -> Result<(), Failure> {
    let (address, path) = match place {
        Place::Address(address) => (Some(address.to_string()), None),
        Place::Path(path) => (None, Some(path.display().to_string())),
    };
    match format {
        Format::Json | Format::Jsonl => {
            let line = Listening { event: "listening", endpoint: name, stream, address, path };
            output::print_event(&line)
        }
        Format::Csv | Format::Table => {
            let stream = stream.map(|stream| format!(" ({stream})")).unwrap_or_default();
            say(format_args!("listening on {name} {}{stream}", address.or(path).unwrap_or_default()));
            Ok(())
        }
    }
}
