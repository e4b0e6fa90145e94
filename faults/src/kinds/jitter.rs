//! Everything later by chance.

use std::time::Duration;

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnPiece, Piece};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "jitter",
    layer: Layer::Bytes,
    parameters: &[
        Parameter {
            key: "sd_ms",
            form: Form::Number(0.0, 3.6e6),
            default: "must be given",
            about: "standard deviation, ms",
        },
        Parameter {
            key: "mean_ms",
            form: Form::Number(0.0, 3.6e6),
            default: "0",
            about: "mean, ms; what is drawn below 0 is 0",
        },
    ],
    directions: &Direction::BOTH,
    on_wires: true,
    about: "Everything comes later by a normal draw; order is kept.",
    reports: "latency",
    recovery: "none lost; queue drained",
    make: Make::Bytes(|given| {
        let (sd_ms, mean_ms) = (given.needed("sd_ms")?, given.number("mean_ms")?.unwrap_or(0.0));
        Ok(Action::Piece(Box::new(Jitter { sd_ms, mean_ms })))
    }),
};

#[derive(Debug)]
struct Jitter {
    sd_ms: f64,
    mean_ms: f64,
}

impl OnPiece for Jitter {
    fn shape(&self, piece: Piece, _: Duration, dice: &mut Stream, out: &mut Vec<Piece>) {
        // Box and Muller; 1 - u is never 0.
        let (radius, turn) = ((-2.0 * (1.0 - dice.unit()).ln()).sqrt(), std::f64::consts::TAU * dice.unit());
        let later_ms = (self.mean_ms + self.sd_ms * radius * turn.cos()).max(0.0);
        out.push(Piece { due: piece.due.saturating_add(Duration::from_secs_f64(later_ms / 1e3)), ..piece });
    }
}
