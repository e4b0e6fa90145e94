//! Levels of acknowledgement, weakest first.

use std::str::FromStr;

/// What counts as an acknowledgement of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ack {
    /// The peers' kernels have everything; says nothing of who has read it.
    Sent,
    /// The peers, on this machine, have read everything; says nothing of what they make of it.
    Read,
    /// The peers, programs on this machine, have read everything and wait for input.
    Idle,
    /// Participants say so at this address.
    Reply(String),
}

/// A name that is no level.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected sent, read, idle or reply:HOST:PORT, found `{0}`")]
pub struct AckError(String);

impl FromStr for Ack {
    type Err = AckError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "sent" => Ok(Self::Sent),
            "read" => Ok(Self::Read),
            "idle" => Ok(Self::Idle),
            _ => match text.strip_prefix("reply:") {
                Some(address) if address.contains(':') => Ok(Self::Reply(address.to_owned())),
                _ => Err(AckError(text.to_owned())),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_named() {
        assert_eq!("idle".parse(), Ok(Ack::Idle));
        assert_eq!("reply:127.0.0.1:0".parse(), Ok(Ack::Reply("127.0.0.1:0".to_owned())));
        for wrong in ["", "never", "reply", "reply:", "reply:5"] {
            let message = wrong.parse::<Ack>().expect_err(wrong).to_string();
            assert!(message.contains("sent, read, idle or reply:HOST:PORT"), "{message}");
        }
    }
}
