//! Somebody or something of known size beside the trees.

use glam::DVec3;

use crate::mesh::{Finish, Mesh, Patch};
use crate::tube::{self, Ring};

/// What stands beside the first tree, for the size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Figure {
    /// Nothing.
    None,
    /// A grower, 1.75 m with the hat.
    #[default]
    Person,
    /// A ranging pole of 2 m with bands of half a metre, red and white.
    Pole,
}

/// Height of the person.
const PERSON_M: f64 = 1.75;
/// Height of the pole.
const POLE_M: f64 = 2.0;

const SKIN: [u8; 3] = [190, 140, 112];
const SHIRT: [u8; 3] = [58, 88, 134];
const TROUSERS: [u8; 3] = [92, 84, 70];
const BOOTS: [u8; 3] = [50, 42, 36];
const HAT: [u8; 3] = [206, 180, 128];

/// A limb: from, to (X, Y, Z over the foot, metres), radii at both, colour.
type Limb = ([f64; 3], [f64; 3], f64, f64, [u8; 3]);

/// One side of the body; Y is mirrored for the other. The person looks along +X, at the row.
const SIDE: [Limb; 6] = [
    ([0.08, 0.10, 0.03], [-0.06, 0.10, 0.05], 0.035, 0.05, BOOTS),
    ([-0.02, 0.10, 0.02], [-0.02, 0.10, 0.14], 0.055, 0.055, BOOTS),
    ([-0.02, 0.10, 0.12], [0.01, 0.10, 0.50], 0.058, 0.070, TROUSERS),
    ([0.01, 0.10, 0.50], [0.0, 0.085, 0.90], 0.070, 0.090, TROUSERS),
    ([0.0, 0.19, 1.40], [-0.03, 0.25, 1.13], 0.056, 0.046, SHIRT),
    ([-0.03, 0.25, 1.13], [0.06, 0.26, 0.87], 0.042, 0.034, SKIN),
];

/// What is in the middle: flatter from front to back.
const MIDDLE: [Limb; 6] = [
    ([0.0, 0.0, 0.84], [0.0, 0.0, 1.02], 0.175, 0.165, TROUSERS),
    ([0.0, 0.0, 0.98], [0.0, 0.0, 1.32], 0.165, 0.205, SHIRT),
    ([0.0, 0.0, 1.32], [0.0, 0.0, 1.45], 0.205, 0.120, SHIRT),
    ([0.0, 0.0, 1.43], [0.0, 0.0, 1.54], 0.052, 0.050, SKIN),
    ([0.01, 0.0, 1.50], [0.01, 0.0, 1.60], 0.062, 0.088, SKIN),
    ([0.01, 0.0, 1.60], [0.01, 0.0, 1.67], 0.088, 0.085, SKIN),
];

/// The hat: brim and crown, round.
const ROUND: [Limb; 3] = [
    ([0.01, 0.0, 1.645], [0.01, 0.0, 1.662], 0.185, 0.165, HAT),
    ([0.01, 0.0, 1.655], [0.01, 0.0, 1.72], 0.100, 0.094, HAT),
    ([0.01, 0.0, 1.72], [0.01, 0.0, PERSON_M], 0.094, 0.055, HAT),
];

/// Depth of the body over its width.
const FLAT: f64 = 0.62;

impl Figure {
    /// Adds it with its feet at a point, and gives half its size along X and Y and its height; None for nothing.
    pub(crate) fn add(self, mesh: &mut Mesh, foot: DVec3) -> Option<DVec3> {
        match self {
            Self::None => None,
            Self::Person => {
                person(mesh, foot);
                Some(DVec3::new(0.25, 0.32, PERSON_M))
            }
            Self::Pole => {
                let limb = ([0.0; 3], [0.0, 0.0, POLE_M], 0.02, 0.02, [0; 3]);
                add(mesh, foot, &limb, DVec3::ONE, Finish::Banded);
                Some(DVec3::new(0.02, 0.02, POLE_M))
            }
        }
    }
}

fn person(mesh: &mut Mesh, foot: DVec3) {
    for (from, to, from_m, to_m, colour) in SIDE {
        for side in [-1.0, 1.0] {
            let mirrored = |[x, y, z]: [f64; 3]| [x, side * y, z];
            let limb = (mirrored(from), mirrored(to), from_m, to_m, colour);
            add(mesh, foot, &limb, DVec3::ONE, Finish::Plain(colour));
        }
    }
    for limb in MIDDLE {
        let by = if limb.2 > 0.1 { DVec3::new(FLAT, 1.0, 1.0) } else { DVec3::ONE };
        add(mesh, foot, &limb, by, Finish::Plain(limb.4));
    }
    for limb in ROUND {
        add(mesh, foot, &limb, DVec3::ONE, Finish::Plain(limb.4));
    }
}

fn add(mesh: &mut Mesh, foot: DVec3, limb: &Limb, by: DVec3, finish: Finish) {
    let &(from, to, from_m, to_m, _) = limb;
    let [base, tip] = [from, to].map(|end| foot + DVec3::from_array(end));
    let axis = (tip - base).normalize_or(DVec3::Z);
    let flat = DVec3::ZERO.as_vec3();
    let patch =
        mesh.patch(Patch { finish, lot: 0, foot: foot.as_vec3(), along: DVec3::Z.as_vec3(), across: flat });
    let ends = [Ring { middle: base, axis, radius_m: from_m }, Ring { middle: tip, axis, radius_m: to_m }];
    tube::stretched(mesh, ends, by, 18, patch);
}
