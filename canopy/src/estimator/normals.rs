//! Mean inclination of leaves, from the planes that four neighbouring returns lie on: two beams on two lines.
//!
//! Two triangles of the four that point the same way are a piece of one leaf. It stands for leaf area w r Δθ / c, with c the cosine between its normal and the
//! beam: what turns to the beam is seen as more (Bailey and Mahaffee 2017 weight triangles of laser returns so). Beams near the horizontal are left out, for they
//! meet no leaf that lies flat, and pieces that stand edge on, for there the planes are of two leaves.
//!
//! It needs beams that are thin beside a leaf: through a spot as wide as a leaf ranges are means over leaves, and nothing is told.

use super::contract::{Estimator, EstimatorInfo, Setting, SightedLine, Sighting, Stretch};
use super::measure::{Measure, Quantity};
use crate::parameters::Parameters;

pub(super) const INFO: EstimatorInfo = EstimatorInfo {
    name: "normals",
    title: "mean leaf inclination, from planes through four neighbouring returns; thin beams only",
    source: "weights: Bailey & Mahaffee 2017, Meas. Sci. Technol. 28:064002",
    quantities: &[Quantity::LeafInclination],
    make: |setting| Box::new(Normals::new(setting)),
};

/// Triangles of one leaf point the same way to this angle, degrees.
const SAME_WAY_DEG: f64 = 15.0;
/// Pieces whose normal is farther from the beam than this cosine stand edge on.
const LEAST_COSINE: f64 = 0.3;
/// Beams nearer to the horizontal are left out, degrees.
const LEAST_ELEVATION_DEG: f64 = 15.0;
/// Fewer pieces tell nothing.
const LEAST_PIECES: u32 = 100;
/// Beams so much wider than rays meet more leaves than rays do, as a share, and their ranges are of several.
const MOST_INFLATION: f64 = 1.02;

#[derive(Clone, Debug)]
struct Normals {
    parameters: Parameters,
    distance_m: f64,
    /// The line before.
    before: Vec<Sighting>,
    pieces: u32,
    area: f64,
    inclination: f64,
}

type Vector = [f64; 3];

fn less(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Unit vector square to both; `None` where they are parallel.
fn normal(a: Vector, b: Vector) -> Option<Vector> {
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let length = dot(cross, cross).sqrt();
    (length > 1e-12).then(|| cross.map(|part| part / length))
}

impl Normals {
    fn new(setting: &Setting) -> Self {
        Self {
            parameters: setting.parameters,
            distance_m: setting.frame.distance_m,
            before: Vec::new(),
            pieces: 0,
            area: 0.0,
            inclination: 0.0,
        }
    }

    /// Two neighbouring beams on this line and on the one before, `apart_m` behind it.
    fn piece(&mut self, [a, b]: [&Sighting; 2], [a_before, b_before]: [&Sighting; 2], apart_m: f64) {
        let point = |sighting: &Sighting, y_m: f64| {
            let contact = sighting.canopy?;
            Some([contact.x_m, y_m + sighting.beam.ahead * contact.range_m, contact.z_m])
        };
        let Some((p, q)) = point(a, apart_m).zip(point(b, apart_m)) else { return };
        let Some((r, s)) = point(a_before, 0.0).zip(point(b_before, 0.0)) else { return };
        let Some((first, second)) = normal(less(q, p), less(r, p)).zip(normal(less(r, s), less(q, s))) else {
            return;
        };
        if dot(first, second) < SAME_WAY_DEG.to_radians().cos() {
            return;
        }
        let sum = [first[0] + second[0], first[1] + second[1], first[2] + second[2]];
        let length = dot(sum, sum).sqrt();
        let normal = sum.map(|part| part / length);
        let cosine = dot(normal, [a.beam.cos, a.beam.ahead, a.beam.sin]).abs();
        if cosine < LEAST_COSINE {
            return;
        }
        let range_m = a.canopy.map_or(0.0, |contact| contact.range_m);
        let area = apart_m * range_m * (b.beam.theta_rad - a.beam.theta_rad).abs() / cosine;
        self.pieces += 1;
        self.area += area;
        self.inclination += area * normal[2].abs().min(1.0).acos().to_degrees();
    }
}

impl Estimator for Normals {
    fn line(&mut self, line: &SightedLine<'_>) {
        let before = std::mem::take(&mut self.before);
        let mut at = 0;
        for pair in line.sightings.windows(2) {
            let [a, b] = pair else { continue };
            // The same beams on the line before.
            while before.get(at).is_some_and(|other| other.beam.theta_rad < a.beam.theta_rad - 1e-9) {
                at += 1;
            }
            let Some([a_before, b_before]) = before.get(at..at + 2) else { break };
            let same =
                |one: &Sighting, other: &Sighting| (one.beam.theta_rad - other.beam.theta_rad).abs() < 1e-9;
            let steep = a.beam.theta_rad.abs() >= LEAST_ELEVATION_DEG.to_radians();
            // What one beam stands for says how far the next is, unless one between them gave nothing.
            let step = a.beam.area_factor / a.beam.cos;
            let next = (b.beam.theta_rad - a.beam.theta_rad).abs() < 1.5 * step;
            if steep && next && same(a, a_before) && same(b, b_before) {
                self.piece([a, b], [a_before, b_before], line.weight_m);
            }
        }
        self.before = before;
        self.before.clear();
        self.before.extend_from_slice(line.sightings);
    }

    fn measures(&self, _stretch: &Stretch, out: &mut Vec<Measure>) {
        let thin = self.parameters.inflation(self.distance_m) < MOST_INFLATION;
        let mean = (thin && self.pieces >= LEAST_PIECES).then(|| self.inclination / self.area);
        out.push(Measure::new(INFO.name, Quantity::LeafInclination, mean));
    }

    fn clear(&mut self) {
        self.before.clear();
        (self.pieces, self.area, self.inclination) = (0, 0.0, 0.0);
    }

    fn boxed(&self) -> Box<dyn Estimator> {
        Box::new(self.clone())
    }
}
