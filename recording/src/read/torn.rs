//! What of a file cannot be read.

use std::fmt;

/// What stands behind a whole file.
pub(crate) const END: &str = "the end of the file";

/// Where a file ends too early, or stops making sense. All before is read, and what can be found behind it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Torn {
    /// Byte of the file where the first broken part begins.
    pub offset: u64,
    /// What should stand there.
    pub expected: &'static str,
    /// What is there instead.
    pub found: String,
    /// What was left out, where the file was read on behind it; none if it breaks off there.
    pub resumed: Option<Resumed>,
}

/// What was left out of a file that was read on behind its damage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resumed {
    /// Stretches of bytes that are no records; none where only a checksum is wrong.
    pub holes: u64,
    /// Bytes in them.
    pub bytes: u64,
    /// Where the file breaks off in the end, if it does.
    pub ends_at: Option<u64>,
}

impl Torn {
    /// Whether what is left out stands behind the end of the file, which is whole.
    pub fn is_behind(&self) -> bool {
        self.expected == END
    }

    /// Which part of the file was read, in words.
    pub fn read_part(&self) -> &'static str {
        match self.resumed {
            None => "what comes before",
            Some(Resumed { holes: 0, .. }) => "all of it, damaged bytes too",
            Some(_) if self.is_behind() => "what comes before",
            Some(_) => "what is before and behind the damage",
        }
    }
}

impl fmt::Display for Torn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { offset, expected, found, resumed } = self;
        let how = if resumed.is_some() { "damaged" } else { "broken off" };
        write!(f, "{how} at byte {offset}: expected {expected}, found {found}")?;
        let Some(Resumed { holes, bytes, ends_at }) = resumed else { return Ok(()) };
        match holes {
            0 => write!(f, "; nothing is left out")?,
            1 => write!(f, "; {bytes} bytes are lost")?,
            _ => write!(f, "; {bytes} bytes are lost in {holes} places")?,
        }
        ends_at.map_or(Ok(()), |end| write!(f, "; broken off at byte {end}"))
    }
}
