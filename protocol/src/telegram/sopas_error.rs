//! `sFA`: why a device refused a telegram.

/// The device's error codes (telegram listing, "sFA").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SopasError {
    /// 1: wrong user level for a method.
    #[error("access denied: the method needs a higher user level")]
    MethodAccessDenied,
    /// 2: no such method.
    #[error("unknown method")]
    UnknownMethod,
    /// 3: no such variable.
    #[error("unknown variable")]
    UnknownVariable,
    /// 4: a condition is not met, mostly a value out of range.
    #[error("value out of range, or not possible in this state")]
    LocalConditionFailed,
    /// 5: data that make no sense for the variable.
    #[error("invalid data")]
    InvalidData,
    /// 6: unknown error.
    #[default]
    #[error("unknown error")]
    UnknownError,
    /// 7: more argument bytes than the command takes.
    #[error("too many argument bytes")]
    BufferOverflow,
    /// 8: fewer argument bytes than the command takes.
    #[error("too few argument bytes")]
    BufferUnderflow,
    /// 9: unknown type.
    #[error("unknown type")]
    UnknownType,
    /// A: the variable cannot be written, or not at this user level.
    #[error("write access denied: the variable is read-only or needs a login")]
    WriteAccessDenied,
    /// B: unknown command for the name server.
    #[error("unknown command for the name server")]
    UnknownNameServerCommand,
    /// C: unknown CoLa command.
    #[error("unknown command")]
    UnknownColaCommand,
    /// D: the device works on another method.
    #[error("busy with another method")]
    MethodServerBusy,
    /// E: a flexible array or string longer than it may be.
    #[error("text or array too long")]
    FlexOutOfBounds,
    /// F: no such event.
    #[error("unknown event")]
    UnknownEvent,
    /// 10: an ASCII number too large for its field.
    #[error("number too large")]
    ValueOverflow,
    /// 11: an ASCII character that does not belong there.
    #[error("invalid character")]
    InvalidCharacter,
    /// Any other code.
    #[error("error code {0:#X}")]
    Other(u16),
}

/// Codes and what they mean, in one place for both directions.
const CODES: [(u16, SopasError); 17] = [
    (0x01, SopasError::MethodAccessDenied),
    (0x02, SopasError::UnknownMethod),
    (0x03, SopasError::UnknownVariable),
    (0x04, SopasError::LocalConditionFailed),
    (0x05, SopasError::InvalidData),
    (0x06, SopasError::UnknownError),
    (0x07, SopasError::BufferOverflow),
    (0x08, SopasError::BufferUnderflow),
    (0x09, SopasError::UnknownType),
    (0x0A, SopasError::WriteAccessDenied),
    (0x0B, SopasError::UnknownNameServerCommand),
    (0x0C, SopasError::UnknownColaCommand),
    (0x0D, SopasError::MethodServerBusy),
    (0x0E, SopasError::FlexOutOfBounds),
    (0x0F, SopasError::UnknownEvent),
    (0x10, SopasError::ValueOverflow),
    (0x11, SopasError::InvalidCharacter),
];

impl SopasError {
    /// The code on the wire.
    pub fn code(self) -> u16 {
        match self {
            Self::Other(code) => code,
            known => CODES.iter().find(|(_, error)| *error == known).map_or(0x06, |(code, _)| *code),
        }
    }

    /// What a code means.
    pub fn from_code(code: u16) -> Self {
        CODES.iter().find(|(known, _)| *known == code).map_or(Self::Other(code), |(_, error)| *error)
    }
}
