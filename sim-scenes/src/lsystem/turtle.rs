//! The turtle that draws a string as a tree.
//!
//! | sign | does |
//! |---|---|
//! | `F` | grows a piece of wood of one step, or of its number in metres |
//! | `f` | goes as far without wood |
//! | `+` `-` | turns left, right (yaw) by the angle, or by its number in degrees |
//! | `&` `^` | pitches down, up |
//! | `\` `/` | rolls left, right |
//! | `\|` | turns about |
//! | `$` | rolls until its left is level |
//! | `[` `]` | starts a branch, and goes back to where it started |
//! | `!` | multiplies the diameter by the taper, or by its number |
//! | `"` | multiplies the step by the contraction, or by its number |
//! | `~` | grows a leaf on its upper side: shape and insertion of `[orchard.tree]` |
//!
//! All other letters are buds: they draw nothing. It starts at the foot, looking up.

use glam::DVec3;

use super::grammar::{Grammar, Letter};
use crate::generator::draft::{Age, Blade, Draft, Segment};
use crate::growth::TreeParameters;
use crate::growth::foliage::Stem;
use crate::growth::leaf_angle::LeafAngles;
use crate::growth::rotation::rotate;
use crate::seed::Stream;

/// Where the turtle is, where it looks, and what it draws with.
#[derive(Clone, Copy, Debug)]
struct Turtle {
    at: DVec3,
    heading: DVec3,
    left: DVec3,
    radius_m: f64,
    step_m: f64,
    /// The piece of wood it stands on, and how far up.
    on: Option<(usize, f64)>,
    /// True on the first axis: outside all branches.
    is_trunk: bool,
}

impl Turtle {
    fn up(&self) -> DVec3 {
        self.heading.cross(self.left)
    }

    fn yaw(&mut self, angle_deg: f64) {
        let up = self.up();
        self.heading = rotate(self.heading, up, angle_deg).normalize_or_zero();
        self.left = rotate(self.left, up, angle_deg).normalize_or_zero();
    }

    fn pitch_down(&mut self, angle_deg: f64) {
        self.heading = rotate(self.heading, self.left, angle_deg).normalize_or_zero();
    }

    fn roll_left(&mut self, angle_deg: f64) {
        self.left = rotate(self.left, self.heading, -angle_deg).normalize_or_zero();
    }

    /// Left becomes level; nothing happens where it looks straight up or down.
    fn level(&mut self) {
        self.left = DVec3::Z.cross(self.heading).try_normalize().unwrap_or(self.left);
    }
}

/// Draws a string.
pub(super) fn draw(
    letters: &[Letter],
    grammar: &Grammar,
    parameters: &TreeParameters,
    stream: &mut Stream,
) -> Draft {
    let angles = LeafAngles::of(parameters.leaf_angle_law());
    let mut draft = Draft::default();
    let mut waiting: Vec<Turtle> = Vec::new();
    let mut turtle = Turtle {
        at: DVec3::ZERO,
        heading: DVec3::Z,
        left: DVec3::Y,
        radius_m: grammar.diameter_m / 2.0,
        step_m: grammar.step_m,
        on: None,
        is_trunk: true,
    };
    for Letter { sign, number } in letters {
        let angle_deg = number.unwrap_or(grammar.angle_deg);
        match sign {
            'F' | 'f' => {
                let length_m = number.unwrap_or(turtle.step_m);
                if *sign == 'F' && length_m > 0.0 {
                    let (bearer, bearer_m) = turtle.on.unzip();
                    turtle.on = Some((draft.segments.len(), length_m));
                    draft.segments.push(Segment {
                        bearer,
                        bearer_m: bearer_m.unwrap_or(0.0),
                        base: turtle.at,
                        direction: turtle.heading,
                        length_m,
                        radius_m: turtle.radius_m.max(parameters.wood_floor_radius_m),
                        is_trunk: turtle.is_trunk,
                        age: Age::Unknown,
                    });
                }
                turtle.at += turtle.heading * length_m;
            }
            '+' => turtle.yaw(angle_deg),
            '-' => turtle.yaw(-angle_deg),
            '&' => turtle.pitch_down(angle_deg),
            '^' => turtle.pitch_down(-angle_deg),
            '\\' => turtle.roll_left(angle_deg),
            '/' => turtle.roll_left(-angle_deg),
            '|' => turtle.yaw(180.0),
            '$' => turtle.level(),
            '[' => {
                waiting.push(turtle);
                turtle.is_trunk = false;
            }
            ']' => turtle = waiting.pop().unwrap_or(turtle),
            '!' => turtle.radius_m *= number.unwrap_or(grammar.taper),
            '"' => turtle.step_m *= number.unwrap_or(grammar.contraction),
            '~' => {
                // A leaf grows on wood.
                let Some((segment, along_m)) = turtle.on else { continue };
                let stem = Stem { stalk: turtle.at, axis: turtle.heading, radial: turtle.up() };
                if let Some((leaf, petiole)) = stem.leaf(1.0, (parameters, &angles), stream) {
                    draft.blades.push(Blade { segment, along_m, leaf, petiole });
                }
            }
            _ => {}
        }
    }
    draft
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seed::Purpose;

    fn drawn(axiom: &str) -> Draft {
        let settings = ["angle: 90", "step: 1", "diameter: 0.1", "taper: 0.5", "contraction: 0.5"];
        let axiom = format!("axiom: {axiom}");
        let grammar = Grammar::read(settings.into_iter().chain([axiom.as_str()])).unwrap();
        let mut stream = Purpose::Foliage.stream(1, 0, 0);
        draw(&grammar.axiom, &grammar, &TreeParameters::default(), &mut stream)
    }

    fn ends(axiom: &str) -> Vec<[i32; 3]> {
        let tip = |segment: &Segment| {
            (segment.base + segment.direction * segment.length_m)
                .to_array()
                .map(|c| (c * 100.0).round() as i32)
        };
        drawn(axiom).segments.iter().map(tip).collect()
    }

    #[test]
    fn every_turn_goes_its_way() {
        // Up along Z with left along Y: up is -X.
        assert_eq!(ends("F"), [[0, 0, 100]]);
        assert_eq!(ends("+F"), [[0, 100, 0]]);
        assert_eq!(ends("-F"), [[0, -100, 0]]);
        assert_eq!(ends("&F"), [[100, 0, 0]]);
        assert_eq!(ends("^F"), [[-100, 0, 0]]);
        assert_eq!(ends("|F"), [[0, 0, -100]]);
        // Rolled left by a quarter, left is up: pitching down leads away from it.
        assert_eq!(ends("\\&F"), [[0, -100, 0]]);
        assert_eq!(ends("/&F"), [[0, 100, 0]]);
        assert_eq!(ends("+(45)+(45)f(0.5)F"), [[0, 150, 0]]);
    }

    #[test]
    fn branches_return_and_stand_on_what_bears_them() {
        let draft = drawn("F[+!\"F]F");
        assert_eq!(ends("F[+!\"F]F"), [[0, 0, 100], [0, 50, 100], [0, 0, 200]]);
        let bearers: Vec<_> = draft.segments.iter().map(|s| (s.bearer, s.bearer_m, s.is_trunk)).collect();
        assert_eq!(bearers, [(None, 0.0, true), (Some(0), 1.0, false), (Some(0), 1.0, true)]);
        let radii: Vec<f64> = draft.segments.iter().map(|s| s.radius_m).collect();
        assert_eq!(radii, [0.05, 0.025, 0.05]);
    }

    #[test]
    fn leaves_grow_on_wood_only() {
        assert_eq!(drawn("~").blades.len(), 0);
        let draft = drawn("F~/~");
        assert_eq!(draft.blades.len(), 2);
        assert!(draft.blades.iter().all(|blade| blade.segment == 0 && blade.along_m == 1.0));
        let feet: Vec<[f64; 3]> = draft.blades.iter().map(|blade| blade.leaf.outline()[0]).collect();
        // On the upper side, which a quarter roll turns from -X to Y or -Y.
        assert!(feet[0][0] < -0.02 && feet[1][1].abs() > 0.02, "{feet:?}");
    }
}
