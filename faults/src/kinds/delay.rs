//! Everything later.

use std::time::Duration;

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnPiece, Piece};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "delay",
    layer: Layer::Bytes,
    parameters: &[Parameter {
        key: "ms",
        form: Form::Strength(0.0, 3.6e6),
        default: "must be given",
        about: "later, ms",
    }],
    directions: &Direction::BOTH,
    on_wires: true,
    about: "Everything comes later; order is kept.",
    reports: "latency",
    recovery: "none lost; queue drained",
    make: Make::Bytes(|given| {
        Ok(Action::Piece(Box::new(Delay { later: Duration::from_secs_f64(given.needed("ms")? / 1e3) })))
    }),
};

#[derive(Debug)]
struct Delay {
    later: Duration,
}

impl OnPiece for Delay {
    fn shape(&self, piece: Piece, _: Duration, _: &mut Stream, out: &mut Vec<Piece>) {
        out.push(Piece { due: piece.due.saturating_add(self.later), ..piece });
    }
}
