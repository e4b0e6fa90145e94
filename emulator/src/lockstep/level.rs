//! Levels of acknowledgement, and how they are written.

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
    /// So many outputs come in at a place.
    Output(OutputAck),
    /// Somebody grants the next step ([`RigControl::step`](crate::RigControl::step)).
    Clock,
}

/// What the kernel can tell of the peers, weakest first. Of several such levels the strongest counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum KernelLevel {
    Sent,
    Read,
    Idle,
}

impl Ack {
    /// The level, if the kernel tells it.
    pub(super) fn kernel(&self) -> Option<KernelLevel> {
        match self {
            Self::Sent => Some(KernelLevel::Sent),
            Self::Read => Some(KernelLevel::Read),
            Self::Idle => Some(KernelLevel::Idle),
            Self::Reply(_) | Self::Output(_) | Self::Clock => None,
        }
    }
}

/// Outputs that acknowledge a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputAck {
    /// Where they come in.
    pub port: OutputPort,
    /// How many make a step.
    pub count: u64,
}

/// Where outputs come in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OutputPort {
    /// Frames that others send on the rig's bus; those of one identifier, if one is given.
    Can(Option<u32>),
    /// Lines, over connections to this address.
    Tcp(String),
    /// Datagrams to this address.
    Udp(String),
}

/// A name that is no level.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected sent, read, idle, reply:HOST:PORT, output:can0[,id=HEX][,count=K], output:tcp:HOST:PORT[,count=K], output:udp:HOST:PORT[,count=K] or \
     clock, found `{0}`"
)]
pub struct AckError(String);

impl FromStr for Ack {
    type Err = AckError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let wrong = || AckError(text.to_owned());
        match text {
            "sent" => Ok(Self::Sent),
            "read" => Ok(Self::Read),
            "idle" => Ok(Self::Idle),
            "clock" => Ok(Self::Clock),
            _ => match text.split_once(':').ok_or_else(wrong)? {
                ("reply", address) if address.contains(':') => Ok(Self::Reply(address.to_owned())),
                ("output", output) => output_ack(output).map(Self::Output).ok_or_else(wrong),
                _ => Err(wrong()),
            },
        }
    }
}

fn output_ack(text: &str) -> Option<OutputAck> {
    let mut parts = text.split(',');
    let mut port = match parts.next()? {
        "can0" => OutputPort::Can(None),
        place => match place.split_once(':')? {
            ("tcp", address) if address.contains(':') => OutputPort::Tcp(address.to_owned()),
            ("udp", address) if address.contains(':') => OutputPort::Udp(address.to_owned()),
            _ => return None,
        },
    };
    let mut count = 1;
    for part in parts {
        match (part.split_once('=')?, &mut port) {
            (("count", number), _) => count = number.parse().ok().filter(|count| *count > 0)?,
            (("id", number), OutputPort::Can(id)) => {
                let hex = number.strip_prefix("0x").unwrap_or(number);
                *id = Some(u32::from_str_radix(hex, 16).ok().filter(|id| *id < 1 << 29)?);
            }
            _ => return None,
        }
    }
    Some(OutputAck { port, count })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_named() {
        let output = |port, count| Ok(Ack::Output(OutputAck { port, count }));
        let local = || "127.0.0.1:0".to_owned();
        assert_eq!("idle".parse(), Ok(Ack::Idle));
        assert_eq!("clock".parse(), Ok(Ack::Clock));
        assert_eq!("reply:127.0.0.1:0".parse(), Ok(Ack::Reply(local())));
        assert_eq!("output:can0".parse(), output(OutputPort::Can(None), 1));
        assert_eq!(
            "output:can0,id=0x18FF1080,count=2".parse(),
            output(OutputPort::Can(Some(0x18FF_1080)), 2)
        );
        assert_eq!("output:tcp:127.0.0.1:0,count=3".parse(), output(OutputPort::Tcp(local()), 3));
        assert_eq!("output:udp:127.0.0.1:0".parse(), output(OutputPort::Udp(local()), 1));
        for wrong in [
            "",
            "never",
            "reply",
            "reply:",
            "reply:5",
            "output",
            "output:",
            "output:can7",
            "output:can0,count=0",
            "output:can0,id=20000000",
            "output:tcp:5",
            "output:tcp:a:5,id=1",
            "output:udp:a:5,count",
        ] {
            let message = wrong.parse::<Ack>().expect_err(wrong).to_string();
            assert!(message.contains("sent, read, idle, reply:HOST:PORT"), "{message}");
        }
    }

    #[test]
    fn levels_of_the_kernel_have_an_order() {
        assert!(KernelLevel::Idle > KernelLevel::Read && KernelLevel::Read > KernelLevel::Sent);
    }
}
