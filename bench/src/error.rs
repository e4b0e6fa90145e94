//! Why a bench cannot be.

use std::net::Ipv4Addr;

use rowscan_bus::BusError;
use rowscan_bus::nmea::NmeaError;
use rowscan_emulator::replay::ReplayError;
use rowscan_emulator::stage::StageError;
use rowscan_emulator::{ListenError, StateFileError};
use rowscan_ports::PortError;
use rowscan_protocol::device::{DigitalLineError, FieldError};
use rowscan_protocol::lms2xx::firmware::FirmwareError;
use rowscan_recording::StreamKind;
use rowscan_rest::RestError;

/// Why a bench cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The scanner does not fit the rig.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// An address is not to be had.
    #[error(transparent)]
    Listen(#[from] ListenError),
    /// The address of a REST interface is not to be had.
    #[error(transparent)]
    Rest(#[from] RestError),
    /// A line is not to be had.
    #[error(transparent)]
    Port(#[from] PortError),
    /// A port of a bus is not to be had.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A place for sentences is not to be had.
    #[error(transparent)]
    Nmea(#[from] NmeaError),
    /// A file of settings cannot be used.
    #[error(transparent)]
    State(#[from] StateFileError),
    /// The scanner has no such digital line.
    #[error(transparent)]
    DigitalLine(#[from] DigitalLineError),
    /// The scanner has no such evaluation fields.
    #[error(transparent)]
    Fields(#[from] FieldError),
    /// An LMS2xx has no such firmware.
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    /// An LMS2xx has no DeviceIdent, and no search finds it.
    #[error(
        "{model} has no DeviceIdent, and no search finds it on its line; its firmware says what it answers (--firmware)"
    )]
    NoIdent {
        /// The model.
        model: &'static str,
    },
    /// An LMS2xx tells no serial number.
    #[error("{model} tells no serial number: leave --serial-number out")]
    NoSerialNumber {
        /// The model.
        model: &'static str,
    },
    /// Two scanners with one serial number.
    #[error(
        "`{id}` and `{other}` have the serial number {serial_number}: expected one for each scanner, for datagrams are told apart by it"
    )]
    SameSerialNumber {
        /// The second scanner.
        id: String,
        /// The first one.
        other: String,
        /// Their number.
        serial_number: u32,
    },
    /// The model sends no datagrams.
    #[error(
        "{model} has no Compact output: --udp, --allow-destination and --rest are for models that have it, such as picoscan150"
    )]
    NoDatagrams {
        /// The model.
        model: &'static str,
    },
    /// A destination asks for a free port, and there is none: it is not of this machine.
    #[error(
        "datagrams to {address}: expected a port, or an address of this machine with port 0; found no free port there: {cause}"
    )]
    NoFreePort {
        /// Where datagrams are to go.
        address: Ipv4Addr,
        /// What the system said.
        cause: std::io::Error,
    },
    /// Datagrams without a pace.
    #[error(
        "`{stream}` goes out as datagrams, and nothing holds back who sends them at --time-scale max: expected a number, such as 10"
    )]
    UnpacedDatagrams {
        /// The stream.
        stream: String,
    },
    /// An LMS2xx has three fields.
    #[error("an LMS2xx has 3 fields, A, B and C; found {found}")]
    TooManyFields {
        /// How many were asked for.
        found: usize,
    },
    /// The state is one of the other family.
    #[error("{model} has no such state to be found in")]
    ForeignStart {
        /// The model.
        model: &'static str,
    },
    /// An LMS2xx has one line.
    #[error(
        "{model} has one serial line: give it one of --pty LINK, --serial DEV, --rfc2217 ADDR, or --tcp ADDR for its bare bytes; found {found}"
    )]
    NotOneLine {
        /// The model.
        model: &'static str,
        /// How many were asked for.
        found: usize,
    },
    /// A recording that cannot be played.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// The model speaks another language than the recorded stream.
    #[error("stream `{stream}` is {kind}, which {model} does not speak; `rowscan models` lists who does")]
    ForeignLanguage {
        /// The stream.
        stream: String,
        /// Its language.
        kind: StreamKind,
        /// The model.
        model: &'static str,
    },
    /// A clock in lockstep that could not see what is read there.
    #[error(
        "`{port}` is a line, and in lockstep nobody can see what has been read from one: use `{instead}`, an acknowledgement by reply or output, or a paced clock"
    )]
    UnseenLine {
        /// The port.
        port: String,
        /// What can be seen.
        instead: &'static str,
    },
    /// Two parts of one name.
    #[error("two parts are called `{id}`: faults and places could not tell them apart")]
    SameName {
        /// The name.
        id: String,
    },
}
