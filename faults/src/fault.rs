//! What a fault is to the rest of the crate: a line of the table, and what it does once it is made.

use std::time::Duration;

use rowscan_protocol::random::Stream;
use rowscan_settings::TomlError;
use rowscan_settings::fault_table::{Family, Parameter, PartFault, Row, Settings};

use crate::event::Direction;
use crate::telegram::Regions;

/// A line of the table: what can be asked for, and what it makes.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// Its name in files.
    pub name: &'static str,
    /// What it acts on.
    pub layer: Layer,
    /// Its own parameters, beside the common ones.
    pub parameters: &'static [Parameter],
    /// Which way it acts unless told otherwise.
    pub directions: &'static [Direction],
    /// True if it acts on serial wires too.
    pub on_wires: bool,
    /// What it does.
    pub about: &'static str,
    /// What a driver must report.
    pub reports: &'static str,
    /// What recovery is expected.
    pub recovery: &'static str,
    pub(crate) make: Make,
}

/// What makes a fault of its parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Make {
    /// One that acts here.
    Bytes(fn(&Settings<'_>) -> Result<Action, TomlError>),
    /// One that a part acts on.
    Part(fn(&Settings<'_>) -> Result<PartFault, TomlError>),
}

impl Make {
    pub(crate) fn make(self, settings: &Settings<'_>) -> Result<Action, TomlError> {
        match self {
            Self::Bytes(make) => make(settings),
            Self::Part(make) => make(settings).map(Action::Part),
        }
    }
}

impl Fault {
    /// A fault of a part, by its row.
    pub(crate) fn of_part(row: &Row) -> Self {
        let Row { name, family, parameters, about, reports, recovery, make } = *row;
        Self {
            name,
            layer: Layer::Part(family),
            parameters,
            directions: &[],
            on_wires: true,
            about,
            reports,
            recovery,
            make: Make::Part(make),
        }
    }
}

/// What a fault acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Whole telegrams, one at a time.
    Telegram,
    /// Bytes as they come.
    Bytes,
    /// A connection that stands.
    Connection,
    /// Connections that are being made.
    Accept,
    /// A part of what is emulated, and no byte path.
    Part(Family),
}

impl Layer {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Telegram => "telegram",
            Self::Bytes => "bytes",
            Self::Connection => "connection",
            Self::Accept => "accept",
            Self::Part(family) => family.name(),
        }
    }
}

/// A fault that is made.
#[derive(Debug)]
pub(crate) enum Action {
    /// Works on telegrams.
    Telegram(Box<dyn OnTelegram>),
    /// Works on pieces of bytes, whatever they are.
    Piece(Box<dyn OnPiece>),
    /// Nothing leaves.
    Hold,
    /// Ends a connection, one way or another.
    Cut(Cut),
    /// Turns away who wants to connect.
    Door(Door),
    /// What a part does.
    Part(PartFault),
}

impl Action {
    /// How it ends connections, if it does.
    pub(crate) fn cut(&self) -> Option<Cut> {
        match self {
            Self::Cut(cut) => Some(*cut),
            Self::Part(fault) if fault.cuts_connections() => Some(Cut::HalfOpen),
            _ => None,
        }
    }
}

/// How a connection ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    Reset,
    Finish,
    HalfOpen,
    HalfClose,
}

/// How who wants to connect is met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Door {
    Refuse,
    Silent,
    Close,
}

/// Why a fault could not act on a telegram.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Skipped(pub(crate) String);

/// What happens to one telegram: faults that act on it edit this in turn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Work {
    /// The telegram, as far as it is still one.
    pub(crate) bytes: Vec<u8>,
    /// Its parts, as it came.
    pub(crate) regions: Regions,
    /// Bytes of the other telegram that `inject` makes, in this dialect.
    pub(crate) foreign: Vec<u8>,
    /// It leaves in pieces: cut before these offsets, each piece so long after the one before.
    pub(crate) cuts: Vec<(usize, Duration)>,
    /// Further copies behind it.
    pub(crate) copies: u32,
    /// It and so many telegrams after it are lost.
    pub(crate) drop: Option<u32>,
    /// It leaves behind so many further telegrams.
    pub(crate) behind: u32,
    /// It leaves in one piece with so many further telegrams, or after this time.
    pub(crate) joined: Option<(u32, Duration)>,
}

impl Work {
    pub(crate) fn new(bytes: Vec<u8>, regions: Regions, foreign: Vec<u8>) -> Self {
        Self { bytes, regions, foreign, cuts: Vec::new(), copies: 0, drop: None, behind: 0, joined: None }
    }
}

/// Works on telegrams.
pub(crate) trait OnTelegram: Send + Sync + std::fmt::Debug {
    /// Acts on one; `dice` are this event's own.
    fn act(&self, work: &mut Work, dice: &mut Stream) -> Result<(), Skipped>;
}

/// Bytes on their way, and when they may leave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    pub(crate) due: Duration,
    pub(crate) bytes: Vec<u8>,
}

/// Works on pieces.
pub(crate) trait OnPiece: Send + Sync + std::fmt::Debug {
    /// Makes of `piece` what is queued in its place; `free` is when the one before it leaves. Order is kept by the queue.
    fn shape(&self, piece: Piece, free: Duration, dice: &mut Stream, out: &mut Vec<Piece>);
}

/// A whole number below `bound`; 0 if that is 0.
pub(crate) fn below(dice: &mut Stream, bound: usize) -> usize {
    ((dice.unit() * bound as f64) as usize).min(bound.saturating_sub(1))
}
