//! Stretches of the row that must not be sprayed: when a nozzle is in one.

use crate::boom::{Boom, Nozzle};
use crate::drive::Drive;
use crate::span::{Span, Spans};

/// When a nozzle is in a stretch that must not be sprayed.
pub(crate) fn within(boom: &Boom, drive: &Drive, nozzle: &Nozzle) -> Spans {
    let ahead_m = nozzle.ahead_m;
    let of_side = boom.no_spray.iter().filter(|zone| zone.side.is_none_or(|side| side == nozzle.side));
    let zones: Spans = of_side.map(|zone| Span::new(zone.y_from_m, zone.y_to_m)).collect();
    let pieces = drive.pieces().iter().filter(|piece| piece.alley.is_some());
    let parts = pieces.flat_map(|piece| piece.monotone().map(move |part| (piece, part)));
    parts
        .flat_map(|(piece, part)| {
            let shift_m = piece.ahead() * ahead_m;
            let (a, b) = (piece.y_m(part.from) + shift_m, piece.y_m(part.to) + shift_m);
            let inside = zones.within(Span::new(a.min(b), a.max(b)));
            let times = inside.iter().map(|zone| {
                let (one, other) =
                    (piece.time_at(part, zone.from - shift_m), piece.time_at(part, zone.to - shift_m));
                Span::new(one.min(other), one.max(other))
            });
            times.collect::<Vec<_>>()
        })
        .collect()
}
