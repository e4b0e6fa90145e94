//! The side that wants a port.

use alloc::vec::Vec;

use super::{
    BINARY, COM_PORT, Command, DO, DONT, SUPPRESS_GO_AHEAD, Telnet, WILL, WONT, ask, com_port, option,
};

/// A connection to a port.
#[derive(Clone, Debug, Default)]
pub struct Client {
    telnet: Telnet,
    agreed: bool,
    refused: bool,
    rate: Option<u32>,
}

impl Client {
    /// A fresh connection.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends what is to be sent first.
    pub fn begin(&self, out: &mut Vec<u8>) {
        for wanted in [BINARY, SUPPRESS_GO_AHEAD] {
            option(WILL, wanted, out);
            option(DO, wanted, out);
        }
        option(WILL, COM_PORT, out);
        // 8 data bits, no parity, one stop bit, no flow control.
        for (code, value) in [(2, 8), (3, 1), (4, 1), (ask::CONTROL, 1)] {
            com_port(code, &[value], out);
        }
    }

    /// Appends a change of the port's rate.
    pub fn set_rate(&mut self, rate: u32, out: &mut Vec<u8>) {
        self.rate = None;
        com_port(ask::BAUD_RATE, &rate.to_be_bytes(), out);
    }

    /// The rate the server has confirmed since it was last set.
    pub fn rate(&self) -> Option<u32> {
        self.rate
    }

    /// The server has the option.
    pub fn is_agreed(&self) -> bool {
        self.agreed
    }

    /// The server does not have it: it is no RFC 2217 port.
    pub fn is_refused(&self) -> bool {
        self.refused
    }

    /// Takes received bytes: appends data to `data`, and what is to be answered to `answer`.
    pub fn decode(&mut self, bytes: &[u8], data: &mut Vec<u8>, answer: &mut Vec<u8>) {
        let Self { telnet, agreed, refused, rate } = self;
        telnet.decode(bytes, data, |command| match command {
            Command::Option { verb: DO, option: COM_PORT } => *agreed = true,
            Command::Option { verb: DONT, option: COM_PORT } => *refused = true,
            // What was asked for is answered by that; anything else is not wanted.
            Command::Option { verb: DO, option: asked } if !matches!(asked, BINARY | SUPPRESS_GO_AHEAD) => {
                option(WONT, asked, answer);
            }
            Command::Option { verb: WILL, option: asked }
                if !matches!(asked, BINARY | SUPPRESS_GO_AHEAD | COM_PORT) =>
            {
                option(DONT, asked, answer);
            }
            Command::ComPort { code, value } if code == ask::BAUD_RATE + ask::ANSWER => {
                *rate = value.as_slice().try_into().ok().map(u32::from_be_bytes);
            }
            _ => {}
        });
    }
}
