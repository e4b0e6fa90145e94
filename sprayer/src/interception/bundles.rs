//! The rays of a drive: a bundle from each nozzle every few millimetres of travel, and a stream of random numbers for each bundle.

use glam::DVec3;
use rowscan_protocol::random::Stream;
use rowscan_vehicle::trajectory::Alley;

use super::Settings;
use super::organs::Ray;
use crate::boom::{Nozzle, Side};
use crate::drive::Drive;
use crate::span::Span;

/// Key of the random numbers: rays of a bundle.
const PURPOSE: u64 = 302;
/// Steps of a sequence that fills a square evenly: powers of the plastic number.
const EVENLY: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

/// The side from which a row is sprayed: its number, and whether nozzles look towards +X at it.
pub(super) type Face = (i32, bool);

/// What leaves one nozzle while it passes a stretch of the row.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bundle {
    /// Nozzle and number along the drive: the key of its stream.
    key: [u64; 2],
    /// When, seconds.
    pub(super) time: Span,
    /// Y of the nozzle at both ends, metres.
    y_m: [f64; 2],
    /// None on the headland.
    pub(super) face: Option<Face>,
    /// How much higher the tractor stands than the row's foot, metres.
    above_m: f64,
}

impl Bundle {
    /// The bundles of a nozzle, where each row stands so much higher than the one before. Their times make up the drive.
    pub(super) fn of(nozzle: &Nozzle, drive: &Drive, step_m: f64, rise_a_row_m: f64) -> Vec<Self> {
        let mut bundles: Vec<Self> = Vec::new();
        let mut push = |time: Span, y_m: [f64; 2], face: Option<Face>, above_m: f64| {
            let key = [nozzle.number as u64, bundles.len() as u64];
            bundles.push(Self { key, time, y_m, face, above_m });
        };
        for piece in drive.pieces() {
            let Some((number, backwards)) = piece.alley else {
                push(piece.time, [0.0; 2], None, 0.0);
                continue;
            };
            let face = Alley { number, backwards }.row_beside(nozzle.side == Side::Right);
            let above_m = piece.above_m(face.0, rise_a_row_m);
            let shift_m = piece.ahead() * nozzle.ahead_m;
            for part in piece.monotone() {
                let (first, last) = (piece.y_m(part.from), piece.y_m(part.to));
                let count = ((last - first).abs() / step_m).ceil().max(1.0);
                let mut from = part.from;
                for step in 1..=count as u64 {
                    let at = |step: u64| first + (last - first) * step as f64 / count;
                    let to = if step == count as u64 { part.to } else { piece.time_at(part, at(step)) };
                    let y_m = [at(step - 1) + shift_m, at(step) + shift_m];
                    push(Span::new(from, to), y_m, Some(face), above_m);
                    from = to;
                }
            }
        }
        bundles
    }

    /// From where to where along the row it is sprayed.
    pub(super) fn along(&self) -> Span {
        let [a, b] = self.y_m;
        Span::new(a.min(b), a.max(b))
    }

    /// Its rays: height by strata of the fan, along the row by a Gaussian, and all over the stretch.
    pub(super) fn rays<'a>(
        &'a self,
        nozzle: &'a Nozzle,
        axis_m: f64,
        settings: &'a Settings,
    ) -> impl Iterator<Item = Ray> + 'a {
        let sign = if self.face.is_none_or(|(_, towards_x)| towards_x) { 1.0 } else { -1.0 };
        let mut stream = Stream::keyed(settings.seed, &[PURPOSE, self.key[0], self.key[1]]);
        let [u, v, w] = [(); 3].map(|()| stream.unit());
        let jet = nozzle.jet;
        let sigma = 0.5 * libm::tan(jet.width_deg.to_radians() / 2.0);
        (0..settings.rays).map(move |number| {
            let number = f64::from(number);
            let share = (number + u) / f64::from(settings.rays);
            let up = (jet.pitch_deg + jet.fan_deg * (share - 0.5)).to_radians();
            let aside = sigma * normal((v + EVENLY[0] * number).fract());
            let into = (w + EVENLY[1] * number).fract();
            let y_m = self.y_m[0] + (self.y_m[1] - self.y_m[0]) * into;
            Ray {
                from: DVec3::new(axis_m - sign * jet.distance_m, y_m, jet.z_m + self.above_m),
                along: DVec3::new(sign * libm::cos(up), aside, libm::sin(up)),
            }
        })
    }
}

/// The value of a normal variable that this share of all is below: Acklam's rational functions, to 1e-9 of it.
fn normal(share: f64) -> f64 {
    const A: [f64; 6] = [
        -3.969683028665376e1,
        2.209460984245205e2,
        -2.759285104469687e2,
        1.38357751867269e2,
        -3.066479806614716e1,
        2.506628277459239,
    ];
    const B: [f64; 5] = [
        -5.447609879822406e1,
        1.615858368580409e2,
        -1.556989798598866e2,
        6.680131188771972e1,
        -1.328068155288572e1,
    ];
    const C: [f64; 6] = [
        -7.784894002430293e-3,
        -3.223964580411365e-1,
        -2.400758277161838,
        -2.549732539343734,
        4.374664141464968,
        2.938163982698783,
    ];
    const D: [f64; 4] = [7.784695709041462e-3, 3.224671290700398e-1, 2.445134137142996, 3.754408661907416];
    let poly = |of: &[f64], x: f64| of.iter().fold(0.0, |sum, a| sum * x + a);
    let share = share.clamp(1e-9, 1.0 - 1e-9);
    let (tail, sign) = if share < 0.5 { (share, 1.0) } else { (1.0 - share, -1.0) };
    if tail < 0.02425 {
        let q = (-2.0 * libm::log(tail)).sqrt();
        return sign * poly(&C, q) / (poly(&D, q) * q + 1.0);
    }
    let q = share - 0.5;
    let r = q * q;
    q * poly(&A, r) / (poly(&B, r) * r + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_variable_are_the_tables() {
        for (share, value) in [
            (0.5, 0.0),
            (0.841_344_746_068_543, 1.0),
            (0.025, -1.959_963_984_540_054),
            (0.001, -3.090_232_306_167_814),
            (0.999, 3.090_232_306_167_814),
        ] {
            assert!((normal(share) - value).abs() < 1e-7, "{share}: {}", normal(share));
        }
    }
}
