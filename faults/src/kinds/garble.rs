//! A bad serial line.

use std::time::Duration;

use rowscan_ports::uart;
use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnPiece, Piece, below};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "garble",
    layer: Layer::Bytes,
    parameters: &[
        Parameter {
            key: "noise_p",
            form: Form::Number(0.0, 1.0),
            default: "0",
            about: "probability that a byte has one bit inverted",
        },
        Parameter {
            key: "lost_p",
            form: Form::Number(0.0, 1.0),
            default: "0",
            about: "probability that a byte is lost",
        },
        Parameter {
            key: "break_p",
            form: Form::Number(0.0, 1.0),
            default: "0",
            about: "probability that a break, heard as a zero byte, comes before a byte",
        },
        Parameter {
            key: "from_baud",
            form: Form::Whole(1, 100_000_000),
            default: "–",
            about: "the sender's rate, bits a second; with `to_baud`",
        },
        Parameter {
            key: "to_baud",
            form: Form::Whole(1, 100_000_000),
            default: "–",
            about: "the receiver's rate: bytes are heard as on copper",
        },
    ],
    directions: &[Direction::ToClient],
    on_wires: true,
    about: "What noise and wrong rates make of a serial line's bytes.",
    reports: "CRC errors; rate search",
    recovery: "finds the rate, within 10 s",
    make: Make::Bytes(|given| {
        let rates = match (given.count("from_baud", 0)?, given.count("to_baud", 0)?) {
            (0, 0) => None,
            (0, _) | (_, 0) => return Err(given.refuse("`from_baud` and `to_baud` go together; give both")),
            rates => Some(rates),
        };
        let p = |key| Ok(given.number(key)?.unwrap_or(0.0));
        let garble = Garble { noise_p: p("noise_p")?, lost_p: p("lost_p")?, break_p: p("break_p")?, rates };
        if garble.noise_p + garble.lost_p + garble.break_p == 0.0 && rates.is_none() {
            return Err(given.refuse("it does nothing; give `noise_p`, `lost_p`, `break_p`, or both rates"));
        }
        Ok(Action::Piece(Box::new(garble)))
    }),
};

#[derive(Debug)]
struct Garble {
    noise_p: f64,
    lost_p: f64,
    break_p: f64,
    rates: Option<(u32, u32)>,
}

impl OnPiece for Garble {
    fn shape(&self, piece: Piece, _: Duration, dice: &mut Stream, out: &mut Vec<Piece>) {
        let sent = match self.rates {
            Some((from, to)) => uart::hear(&piece.bytes, from, to),
            None => piece.bytes,
        };
        let mut bytes = Vec::with_capacity(sent.len());
        for byte in sent {
            if dice.unit() < self.break_p {
                bytes.push(0);
            }
            if dice.unit() < self.lost_p {
                continue;
            }
            let hit = dice.unit() < self.noise_p;
            bytes.push(if hit { byte ^ 1 << below(dice, 8) } else { byte });
        }
        out.push(Piece { bytes, ..piece });
    }
}
