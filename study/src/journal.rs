//! What an unfinished shard has so far: one JSON object a line, the first says of what.
//!
//! A line is whole or it is not there: a run that was killed, or whose disk was full, leaves at most one torn line at the end, and reading
//! stops before it.

use std::io::{self, Write};

use serde::{Deserialize, Serialize};

use super::shard::{Header, Shard};
use super::{Study, Unit};

/// The first line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(deserialize = "S: serde::de::DeserializeOwned"))]
struct Opening<S> {
    header: Header<S>,
    shard: Shard,
}

/// Writes units as they come.
#[derive(Debug)]
pub struct Journal<W> {
    out: W,
}

/// Why a journal cannot be gone on with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JournalError {
    /// It is none.
    #[error("is no journal of a study")]
    Unknown,
    /// It belongs to something else.
    #[error("belongs to another run: its {key} differ; go on with the command line it was made with")]
    Another {
        /// What differs.
        key: &'static str,
    },
    /// It belongs to another part.
    #[error("belongs to shard {found}, not {expected}")]
    Shard {
        /// The part asked for.
        expected: Shard,
        /// The part it holds.
        found: Shard,
    },
}

/// What was read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept<R> {
    /// Finished units.
    pub units: Vec<Unit<R>>,
    /// Bytes that hold them; what follows is torn and to be cut off before going on.
    pub whole_bytes: u64,
}

impl<W: Write> Journal<W> {
    /// Begins a journal: writes the line that says of what.
    pub fn begin<S: Study>(mut out: W, study: &S, shard: Shard) -> io::Result<Self> {
        put(&mut out, &Opening { header: Header::of(study), shard })?;
        Ok(Self { out })
    }

    /// Goes on at the end of what [`read`] found whole.
    pub fn resume(out: W) -> Self {
        Self { out }
    }

    /// Keeps one unit.
    pub fn keep<R: Serialize>(&mut self, unit: &Unit<R>) -> io::Result<()> {
        put(&mut self.out, unit)
    }
}

fn put(out: &mut dyn Write, value: &dyn erased_serde::Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    out.write_all(&line)?;
    out.flush()
}

/// The finished units of a journal of this study and shard; None if not even its first line is whole.
pub fn read<S: Study>(
    bytes: &[u8],
    study: &S,
    shard: Shard,
) -> Result<Option<Kept<S::Result>>, JournalError> {
    let mut lines = bytes.split_inclusive(|byte| *byte == b'\n').take_while(|line| line.ends_with(b"\n"));
    let Some(first) = lines.next() else { return Ok(None) };
    let opening: Opening<S> = serde_json::from_slice(first).map_err(|_| JournalError::Unknown)?;
    if let Some(key) = opening.header.difference(&Header::of(study)) {
        return Err(JournalError::Another { key });
    }
    if opening.shard != shard {
        return Err(JournalError::Shard { expected: shard, found: opening.shard });
    }
    let mut kept = Kept { units: Vec::new(), whole_bytes: first.len() as u64 };
    for line in lines {
        let Ok(unit) = serde_json::from_slice(line) else { break };
        kept.units.push(unit);
        kept.whole_bytes += line.len() as u64;
    }
    Ok(Some(kept))
}
