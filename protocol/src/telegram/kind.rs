//! Command kinds: the three letters every telegram begins with.

use core::fmt;

/// What a telegram asks or answers: its first three letters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// `sRN`: read a variable.
    Rn,
    /// `sRI`: read a variable by index.
    Ri,
    /// `sRA`: a variable's value.
    Ra,
    /// `sWN`: write a variable.
    Wn,
    /// `sWA`: written.
    Wa,
    /// `sMN`: call a method.
    Mn,
    /// `sMA`: receipt of a slow method; the result follows.
    Ma,
    /// `sAN`: a method's result.
    An,
    /// `sEN`: subscribe to an event, or unsubscribe.
    En,
    /// `sEA`: the subscription's new state.
    Ea,
    /// `sSN`: an event.
    Sn,
    /// `sFA`: refused, with a [`SopasError`](super::SopasError).
    Fa,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 12] = [
        Self::Rn,
        Self::Ri,
        Self::Ra,
        Self::Wn,
        Self::Wa,
        Self::Mn,
        Self::Ma,
        Self::An,
        Self::En,
        Self::Ea,
        Self::Sn,
        Self::Fa,
    ];

    /// The letters on the wire.
    pub const fn letters(self) -> &'static str {
        match self {
            Self::Rn => "sRN",
            Self::Ri => "sRI",
            Self::Ra => "sRA",
            Self::Wn => "sWN",
            Self::Wa => "sWA",
            Self::Mn => "sMN",
            Self::Ma => "sMA",
            Self::An => "sAN",
            Self::En => "sEN",
            Self::Ea => "sEA",
            Self::Sn => "sSN",
            Self::Fa => "sFA",
        }
    }

    /// The kind with these letters.
    pub fn from_letters(letters: &[u8]) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.letters().as_bytes() == letters)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.letters())
    }
}
