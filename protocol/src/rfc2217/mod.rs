//! A serial line over TCP: telnet with the COM-PORT-OPTION of RFC 2217. Both sides, without I/O.

mod client;
mod server;

use alloc::vec::Vec;

pub use client::Client;
pub use server::{Server, Settings};

const IAC: u8 = 255;
const SE: u8 = 240;
const SB: u8 = 250;
const WILL: u8 = 251;
const WONT: u8 = 252;
const DO: u8 = 253;
const DONT: u8 = 254;

const BINARY: u8 = 0;
const ECHO: u8 = 1;
const SUPPRESS_GO_AHEAD: u8 = 3;
const COM_PORT: u8 = 44;

/// What a client asks of the port; the server's answer is 100 more.
mod ask {
    pub(super) const BAUD_RATE: u8 = 1;
    pub(super) const CONTROL: u8 = 5;
    pub(super) const PURGE: u8 = 12;
    pub(super) const NOTIFY_MODEM_STATE: u8 = 107;
    pub(super) const ANSWER: u8 = 100;
}

/// A subnegotiation is short; what is longer is cut.
const MAX_SUBNEGOTIATION: usize = 64;

/// A telnet command.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Command {
    /// WILL, WONT, DO or DONT, and the option.
    Option { verb: u8, option: u8 },
    /// COM-PORT-OPTION: what is asked or answered, and its value.
    ComPort { code: u8, value: Vec<u8> },
}

/// Takes telnet's commands out of a byte stream.
#[derive(Clone, Debug, Default)]
struct Telnet {
    state: State,
    subnegotiation: Vec<u8>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Data,
    Command,
    Option(u8),
    Subnegotiation,
    SubnegotiationCommand,
}

impl Telnet {
    /// Appends the data among `bytes` to `data` and hands each command to `command`.
    fn decode(&mut self, bytes: &[u8], data: &mut Vec<u8>, mut command: impl FnMut(Command)) {
        for &byte in bytes {
            self.state = match (self.state, byte) {
                (State::Data, IAC) => State::Command,
                (State::Data, byte) => {
                    data.push(byte);
                    State::Data
                }
                (State::Command, IAC) => {
                    data.push(IAC);
                    State::Data
                }
                (State::Command, SB) => {
                    self.subnegotiation.clear();
                    State::Subnegotiation
                }
                (State::Command, verb @ WILL..=DONT) => State::Option(verb),
                (State::Command, _) => State::Data,
                (State::Option(verb), option) => {
                    command(Command::Option { verb, option });
                    State::Data
                }
                (State::Subnegotiation, IAC) => State::SubnegotiationCommand,
                (State::SubnegotiationCommand, SE) => {
                    if let [COM_PORT, code, value @ ..] = self.subnegotiation.as_slice() {
                        command(Command::ComPort { code: *code, value: value.to_vec() });
                    }
                    State::Data
                }
                (State::Subnegotiation | State::SubnegotiationCommand, byte) => {
                    if self.subnegotiation.len() < MAX_SUBNEGOTIATION {
                        self.subnegotiation.push(byte);
                    }
                    State::Subnegotiation
                }
            };
        }
    }
}

/// Appends `bytes` as data.
pub fn escape(bytes: &[u8], out: &mut Vec<u8>) {
    for &byte in bytes {
        out.push(byte);
        if byte == IAC {
            out.push(IAC);
        }
    }
}

fn option(verb: u8, option: u8, out: &mut Vec<u8>) {
    out.extend_from_slice(&[IAC, verb, option]);
}

fn com_port(code: u8, value: &[u8], out: &mut Vec<u8>) {
    out.extend_from_slice(&[IAC, SB, COM_PORT, code]);
    escape(value, out);
    out.extend_from_slice(&[IAC, SE]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_sets_the_rate_and_bytes_pass_unharmed() {
        let (mut client, mut server) = (Client::new(), Server::new());
        let (mut to_server, mut to_client) = (Vec::new(), Vec::new());
        client.begin(&mut to_server);
        client.set_rate(500_000, &mut to_server);
        let mut data = Vec::new();
        // Byte by byte, as a network may bring it.
        for byte in &to_server {
            server.decode(&[*byte], &mut data, &mut to_client);
        }
        client.decode(&to_client, &mut data, &mut Vec::new());
        assert!(data.is_empty());
        assert_eq!(server.settings().rate, Some(500_000));
        assert_eq!(client.rate(), Some(500_000));
        assert!(client.is_agreed());

        let all: Vec<u8> = (0..=255).collect();
        let mut wire = Vec::new();
        escape(&all, &mut wire);
        server.decode(&wire, &mut data, &mut Vec::new());
        assert_eq!(data, all);
    }

    #[test]
    fn unknown_options_are_refused_once_and_agreed_ones_not_answered_again() {
        let mut server = Server::new();
        let mut answer = Vec::new();
        server.decode(&[IAC, DO, 99, IAC, WILL, 98], &mut Vec::new(), &mut answer);
        assert_eq!(answer, [IAC, WONT, 99, IAC, DONT, 98]);
        for expected in [&[IAC, DO, COM_PORT][..], &[]] {
            answer.clear();
            server.decode(&[IAC, WILL, COM_PORT], &mut Vec::new(), &mut answer);
            assert!(answer.starts_with(expected) && (expected.is_empty() == answer.is_empty()), "{answer:?}");
        }
    }

    #[test]
    fn control_lines_are_seen_and_a_long_subnegotiation_is_bounded() {
        let mut server = Server::new();
        let mut answer = Vec::new();
        let set = |value| [IAC, SB, COM_PORT, ask::CONTROL, value, IAC, SE];
        server.decode(&[set(8), set(12)].concat(), &mut Vec::new(), &mut answer);
        assert_eq!((server.settings().dtr, server.settings().rts), (true, false));
        let endless = [&[IAC, SB, COM_PORT][..], &[7; 100_000]].concat();
        server.decode(&endless, &mut Vec::new(), &mut answer);
        assert!(server.kept() <= MAX_SUBNEGOTIATION);
    }
}
