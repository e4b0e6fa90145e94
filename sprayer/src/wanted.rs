//! When each nozzle should spray: while its decision strip holds leaves and the tractor goes ahead in an alley.

use std::collections::BTreeMap;

use rowscan_scenes::Orchard;
use rowscan_vehicle::trajectory::Alley;

use crate::boom::{Boom, Nozzle, Side};
use crate::drive::{Drive, DrivePiece};
use crate::leaves::{Area, BandLeaves};
use crate::span::{Span, Spans};
use crate::zones;

/// The leaves that pass before the nozzles of a boom on a drive.
#[derive(Clone, Debug)]
pub struct Passing {
    nozzles: Vec<Nozzle>,
    /// By row and by band of height above its foot, as bits.
    bands: BTreeMap<BandKey, BandLeaves>,
    /// How much higher each row stands than the one before, metres.
    rise_a_row_m: f64,
}

/// A row, and a band of height above its foot, as bits.
type BandKey = (i32, [u64; 2]);

/// The row that a nozzle sprays at in this piece of a drive; none on the headland.
fn row_of(nozzle: &Nozzle, piece: &DrivePiece) -> Option<i32> {
    let (number, backwards) = piece.alley?;
    Some(Alley { number, backwards }.row_beside(nozzle.side == Side::Right).0)
}

/// The row before a nozzle, and its share of height above that row's foot.
fn before(nozzle: &Nozzle, piece: &DrivePiece, rise_a_row_m: f64) -> Option<(i32, Span)> {
    let row = row_of(nozzle, piece)?;
    let above_m = piece.above_m(row, rise_a_row_m);
    Some((row, Span::new(nozzle.height.from + above_m, nozzle.height.to + above_m)))
}

fn key(row: i32, height: Span) -> BandKey {
    (row, [height.from.to_bits(), height.to.to_bits()])
}

impl Passing {
    /// Looks up the rows beside the drive's alleys.
    pub fn of(boom: &Boom, orchard: &Orchard, drive: &Drive) -> Self {
        let (nozzles, rise_a_row_m) = (boom.nozzles(), orchard.foot_m(1));
        let mut bands = BTreeMap::new();
        for piece in drive.pieces() {
            for nozzle in &nozzles {
                let Some((row, height)) = before(nozzle, piece, rise_a_row_m) else { continue };
                bands.entry(key(row, height)).or_insert_with(|| BandLeaves::of(orchard, row, height));
            }
        }
        Self { nozzles, bands, rise_a_row_m }
    }

    /// When nozzle number `number` is wanted, seconds.
    pub fn wanted(&self, boom: &Boom, drive: &Drive, number: usize) -> Spans {
        let Some(nozzle) = self.nozzles.get(number) else { return Spans::default() };
        let mut by_row: BTreeMap<BandKey, Spans> = BTreeMap::new();
        let mut times = Vec::new();
        for piece in drive.pieces() {
            let Some((row, band)) = self.band(nozzle, piece) else { continue };
            let reach = by_row.entry(row).or_insert_with(|| {
                let shift_m = nozzle.ahead_m.abs();
                let ys = drive.pieces().iter().filter(|piece| piece.alley.is_some()).flat_map(ends);
                let (low, high) =
                    ys.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
                band.wanted((boom.strip_m, boom.join_m), Span::new(low - shift_m, high + shift_m))
            });
            for part in piece.monotone() {
                passed(piece, part, piece.ahead() * nozzle.ahead_m, reach, &mut times);
            }
        }
        // What must not be sprayed is not wanted, whatever stands there.
        let allowed = zones::within(boom, drive, nozzle).gaps(drive.time());
        Spans::of(times).joined(1e-9).and(&drive.going(boom.standstill_m_s)).and(&allowed)
    }

    /// Leaf area that passes before nozzle number `number` in these times. What passes twice counts twice.
    pub fn area(&self, drive: &Drive, number: usize, times: &Spans) -> Area {
        let mut area = Area::default();
        let Some(nozzle) = self.nozzles.get(number) else { return area };
        for piece in drive.pieces() {
            let Some((_, band)) = self.band(nozzle, piece) else { continue };
            let shift_m = piece.ahead() * nozzle.ahead_m;
            for part in piece.monotone() {
                for time in times.within(part).iter() {
                    let (a, b) = (piece.y_m(time.from) + shift_m, piece.y_m(time.to) + shift_m);
                    area += band.area(Span::new(a.min(b), a.max(b)));
                }
            }
        }
        area
    }

    fn band(&self, nozzle: &Nozzle, piece: &DrivePiece) -> Option<(BandKey, &BandLeaves)> {
        let (row, height) = before(nozzle, piece, self.rise_a_row_m)?;
        let key = key(row, height);
        Some((key, self.bands.get(&key)?))
    }
}

/// Where Y may be largest or smallest in a piece.
fn ends(piece: &DrivePiece) -> Vec<f64> {
    piece.monotone().flat_map(|part| [piece.y_m(part.from), piece.y_m(part.to)]).chain(piece.y_m).collect()
}

/// Adds the times of a part of a piece at which Y and `shift_m` are within `places`.
fn passed(piece: &DrivePiece, part: Span, shift_m: f64, places: &Spans, times: &mut Vec<Span>) {
    let (a, b) = (piece.y_m(part.from) + shift_m, piece.y_m(part.to) + shift_m);
    for place in places.within(Span::new(a.min(b), a.max(b))).iter() {
        let (one, other) =
            (piece.time_at(part, place.from - shift_m), piece.time_at(part, place.to - shift_m));
        times.push(Span::new(one.min(other), one.max(other)));
    }
}
