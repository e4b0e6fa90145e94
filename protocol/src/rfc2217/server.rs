//! The side that has the port.

use alloc::vec::Vec;

use super::{
    BINARY, COM_PORT, Command, DO, DONT, ECHO, SUPPRESS_GO_AHEAD, Telnet, WILL, WONT, ask, com_port, option,
};

/// Clear to send, data set ready, carrier: what a cable to a scanner that is switched on shows.
const MODEM_STATE: u8 = 0xB0;

/// How a client has set the port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settings {
    /// Bits a second; none until it has been set.
    pub rate: Option<u32>,
    /// Data terminal ready.
    pub dtr: bool,
    /// Request to send.
    pub rts: bool,
}

/// One client's connection.
#[derive(Clone, Debug, Default)]
pub struct Server {
    telnet: Telnet,
    settings: Settings,
    /// Options this side has agreed to do, and those it has agreed that the client does.
    does: Agreed,
    lets: Agreed,
}

/// Options agreed on.
#[derive(Clone, Debug, Default)]
struct Agreed([bool; 4]);

const TAKEN: [u8; 4] = [BINARY, ECHO, SUPPRESS_GO_AHEAD, COM_PORT];

impl Agreed {
    /// `Some(true)` if the option is new and taken, `Some(false)` if it is not taken, none if it was agreed on before.
    fn agree(&mut self, option: u8) -> Option<bool> {
        let Some((_, agreed)) = TAKEN.iter().zip(&mut self.0).find(|(taken, _)| **taken == option) else {
            return Some(false);
        };
        (!core::mem::replace(agreed, true)).then_some(true)
    }

    fn end(&mut self, option: u8) -> bool {
        let agreed = TAKEN.iter().zip(&mut self.0).find(|(taken, _)| **taken == option);
        agreed.is_some_and(|(_, agreed)| core::mem::take(agreed))
    }
}

impl Server {
    /// A fresh connection.
    pub fn new() -> Self {
        Self::default()
    }

    /// How the client has set the port.
    pub fn settings(&self) -> Settings {
        self.settings
    }

    /// Takes received bytes: appends data to `data`, and what is to be answered to `answer`.
    pub fn decode(&mut self, bytes: &[u8], data: &mut Vec<u8>, answer: &mut Vec<u8>) {
        let Self { telnet, settings, does, lets } = self;
        telnet.decode(bytes, data, |command| match command {
            Command::Option { verb: WILL, option: asked } => match lets.agree(asked) {
                Some(true) => {
                    option(DO, asked, answer);
                    if asked == COM_PORT {
                        com_port(ask::NOTIFY_MODEM_STATE, &[MODEM_STATE], answer);
                    }
                }
                Some(false) => option(DONT, asked, answer),
                None => {}
            },
            Command::Option { verb: DO, option: asked } => match does.agree(asked) {
                Some(true) => option(WILL, asked, answer),
                Some(false) => option(WONT, asked, answer),
                None => {}
            },
            Command::Option { verb: WONT, option: asked } => {
                if lets.end(asked) {
                    option(DONT, asked, answer);
                }
            }
            Command::Option { option: asked, .. } => {
                if does.end(asked) {
                    option(WONT, asked, answer);
                }
            }
            Command::ComPort { code, value } => settings.take(code, &value, answer),
        });
    }

    #[cfg(test)]
    pub(super) fn kept(&self) -> usize {
        self.telnet.subnegotiation.len()
    }
}

impl Settings {
    fn take(&mut self, code: u8, value: &[u8], answer: &mut Vec<u8>) {
        match (code, value) {
            (ask::BAUD_RATE, &[a, b, c, d]) => {
                let rate = u32::from_be_bytes([a, b, c, d]);
                // Zero asks for the rate as it is.
                if rate > 0 {
                    self.rate = Some(rate);
                }
                let rate = self.rate.unwrap_or(9600).to_be_bytes();
                com_port(code + ask::ANSWER, &rate, answer);
                return;
            }
            (ask::CONTROL, &[value]) => match value {
                8 => self.dtr = true,
                9 => self.dtr = false,
                11 => self.rts = true,
                12 => self.rts = false,
                _ => {}
            },
            _ => {}
        }
        // Whatever else is asked of the port (8 data bits, no parity, masks, purges) is so, or does no harm.
        if code <= ask::PURGE {
            com_port(code + ask::ANSWER, value, answer);
        }
    }
}
