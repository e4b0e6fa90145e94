//! A slow line.

use std::time::Duration;

use rowscan_protocol::random::Stream;

use crate::event::Direction;
use crate::fault::{Action, Fault, Layer, Make, OnPiece, Piece};
use rowscan_settings::fault_table::{Form, Parameter};

pub(super) const FAULT: Fault = Fault {
    name: "bandwidth",
    layer: Layer::Bytes,
    parameters: &[Parameter {
        key: "bytes_s",
        form: Form::Whole(1, 1_000_000_000),
        default: "must be given",
        about: "bytes a second",
    }],
    directions: &Direction::BOTH,
    on_wires: true,
    about: "Bytes pass at this rate.",
    reports: "lag; scans_lost where the device drops",
    recovery: "within 1 s of lift",
    make: Make::Bytes(|given| {
        let rate =
            given.size("bytes_s")?.ok_or_else(|| given.refuse("the key `bytes_s` is missing; add it"))?;
        Ok(Action::Piece(Box::new(Bandwidth { bytes_s: rate })))
    }),
};

/// Pieces a second that a rate is cut into, at most.
const PIECES_S: usize = 200;

#[derive(Debug)]
struct Bandwidth {
    bytes_s: usize,
}

impl OnPiece for Bandwidth {
    fn shape(&self, piece: Piece, free: Duration, _: &mut Stream, out: &mut Vec<Piece>) {
        let mut due = piece.due.max(free);
        for bytes in piece.bytes.chunks((self.bytes_s / PIECES_S).max(1)) {
            due += Duration::from_secs_f64(bytes.len() as f64 / self.bytes_s as f64);
            out.push(Piece { due, bytes: bytes.to_vec() });
        }
    }
}
