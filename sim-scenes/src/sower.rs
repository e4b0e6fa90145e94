//! Leaves that are added to a tree: on its own thin wood, and where that bears enough of them, on shoots that are added too.
//!
//! Wood that bears many times its own leaves forms tufts with gaps between them, which real crowns with so many leaves do not have. A tree with more leaves has
//! more shoots.

use glam::DVec3;

use crate::generator::draft::{Age, Blade, Draft, Segment};
use crate::growth::prune::Envelope;
use crate::growth::rotation::fork;
use crate::organ::Leaf;
use crate::placement::Placement;
use crate::seed::Stream;

/// Wood thicker than this bears no added leaf where thinner wood is there, metres of radius.
const BEARING_RADIUS_M: f64 = 0.015;

/// How often an added leaf, or shoot, looks for a place before the target is given up.
const TRIES: u32 = 64;

/// Times its own leaves that a tree may be given.
const MOST_ADDED: usize = 50;

/// Times its own leaves that a tree's own wood may be given.
const MOST_ON_OWN_WOOD: usize = 1;

/// An added shoot: length and radius in metres, number of leaves, and the least and greatest angle to its bearer, degrees.
const SHOOT_M: f64 = 0.3;
const SHOOT_RADIUS_M: f64 = 0.002;
const SHOOT_LEAVES: u32 = 12;
const SHOOT_TURN_DEG: [f64; 2] = [30.0, 90.0];

/// Adds leaves to one tree.
pub(crate) struct Sower {
    number: usize,
    stream: Stream,
    /// Leaves that may be copied: the tree's own.
    own: usize,
    /// Thin pieces of wood with the length up to each one's end.
    bearers: Vec<(usize, f64)>,
    /// The latest added shoot, and leaves that it has room for.
    shoot: Option<(usize, u32)>,
    /// Lowest and highest coordinates of the tree's own leaves, metres: added shoots fill the crown and do not enlarge it.
    crown: [DVec3; 2],
}

impl Sower {
    /// Of the draft of this number; None for a tree without leaves or without wood.
    pub(crate) fn new(number: usize, draft: &Draft, stream: Stream) -> Option<Self> {
        // Where none of its leaves stands on old wood, none is added there.
        let is_old = |blade: &Blade| draft.segments.get(blade.segment).is_some_and(|at| at.age == Age::Older);
        let on_old_wood = draft.blades.iter().any(is_old);
        let bearers = |most_m: f64| -> Vec<(usize, f64)> {
            let mut end_m = 0.0;
            let thin = draft.segments.iter().enumerate();
            thin.filter(|(_, segment)| segment.length_m > 0.0 && segment.radius_m <= most_m)
                .filter(|(_, segment)| on_old_wood || segment.age != Age::Older)
                .map(|(number, segment)| {
                    end_m += segment.length_m;
                    (number, end_m)
                })
                .collect()
        };
        let thin = bearers(BEARING_RADIUS_M);
        let bearers = if thin.is_empty() { bearers(f64::INFINITY) } else { thin };
        let own = draft.blades.len();
        let places = draft.blades.iter().map(|blade| DVec3::from(blade.leaf.centroid()));
        let crown =
            places.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[from, to], at| [from.min(at), to.max(at)]);
        (own > 0 && !bearers.is_empty()).then_some(Self { number, stream, own, bearers, shoot: None, crown })
    }

    /// Number of the draft.
    pub(crate) fn number(&self) -> usize {
        self.number
    }

    /// A copy of one of the tree's leaves, turned about the vertical, as far from its wood as the leaf was. None where no room was found, or the tree has been
    /// given enough.
    pub(crate) fn next(&mut self, draft: &mut Draft, envelope: Option<&Envelope>) -> Option<Blade> {
        let times = draft.blades.len() / self.own;
        if times > MOST_ADDED {
            return None;
        }
        let on_shoot = times > MOST_ON_OWN_WOOD;
        (0..TRIES).find_map(|_| {
            let donor = draft.blades.get((self.stream.unit() * self.own as f64) as usize)?.clone();
            let place = if on_shoot { self.on_shoot(draft, envelope) } else { self.on_wood(draft) }?;
            let blade = self.copy(draft, &donor, place, envelope)?;
            (!on_shoot || self.is_in_crown(blade.leaf.centroid().into())).then_some(blade)
        })
    }

    fn is_in_crown(&self, point: DVec3) -> bool {
        let [from, to] = self.crown;
        point.cmpge(from).all() && point.cmple(to).all()
    }

    /// A random point of the thin wood: the segment, and metres of it below the point.
    fn on_wood(&mut self, draft: &Draft) -> Option<(usize, f64)> {
        let total_m = self.bearers.last()?.1;
        let at_m = self.stream.unit() * total_m;
        let bearer = self.bearers.partition_point(|(_, end_m)| *end_m <= at_m);
        let (number, end_m) = *self.bearers.get(bearer)?;
        let segment = draft.segments.get(number)?;
        Some((number, (segment.length_m - (end_m - at_m)).clamp(0.0, segment.length_m)))
    }

    /// The next place on an added shoot, which is made if need be.
    fn on_shoot(&mut self, draft: &mut Draft, envelope: Option<&Envelope>) -> Option<(usize, f64)> {
        let (number, room) = match self.shoot.filter(|(_, room)| *room > 0) {
            Some(shoot) => shoot,
            None => (self.grow(draft, envelope)?, SHOOT_LEAVES),
        };
        self.shoot = Some((number, room - 1));
        Some((number, SHOOT_M * (f64::from(room) - 0.5) / f64::from(SHOOT_LEAVES)))
    }

    /// Adds a shoot at a random point of the thin wood, and counts it as thin wood from then on. None where no room was found.
    fn grow(&mut self, draft: &mut Draft, envelope: Option<&Envelope>) -> Option<usize> {
        let shoot = (0..TRIES).find_map(|_| {
            let (number, bearer_m) = self.on_wood(draft)?;
            let bearer = draft.segments.get(number)?;
            let [least_deg, most_deg] = SHOOT_TURN_DEG;
            let turn_deg = least_deg + self.stream.unit() * (most_deg - least_deg);
            let direction = fork(bearer.direction, turn_deg, self.stream.unit() * 360.0);
            let base = bearer.base + bearer.direction * bearer_m;
            let tip = base + direction * SHOOT_M;
            let is_inside = |point: DVec3| {
                self.is_in_crown(point) && envelope.is_none_or(|envelope| envelope.contains(point.to_array()))
            };
            let age = if bearer.age == Age::Unknown { Age::Unknown } else { Age::Current };
            (is_inside(base) && is_inside(tip)).then_some(Segment {
                bearer: Some(number),
                bearer_m,
                base,
                direction,
                length_m: SHOOT_M,
                radius_m: SHOOT_RADIUS_M,
                is_trunk: false,
                age,
            })
        })?;
        let number = draft.segments.len();
        draft.segments.push(shoot);
        self.bearers.push((number, self.bearers.last()?.1 + SHOOT_M));
        Some(number)
    }

    /// A copy of that leaf on this place, unless it reaches beyond the envelope.
    fn copy(
        &mut self,
        draft: &Draft,
        donor: &Blade,
        (segment, along_m): (usize, f64),
        envelope: Option<&Envelope>,
    ) -> Option<Blade> {
        let bearer = draft.segments.get(segment)?;
        let stalk = bearer.base + bearer.direction * along_m;
        let from = draft.segments.get(donor.segment)?;
        let was = from.base + from.direction * donor.along_m;
        let turn_deg = self.stream.unit() * 360.0;
        let to_origin = Placement::at((-was).to_array());
        let to_stalk = Placement::at(stalk.to_array()).turned(turn_deg);
        let leaf: Leaf = donor.leaf.placed(&to_origin).placed(&to_stalk);
        let inside = |leaf: &Leaf| {
            envelope.is_none_or(|envelope| leaf.outline().iter().all(|vertex| envelope.contains(*vertex)))
        };
        let petiole = donor.petiole.map(|petiole| petiole.placed(&to_origin).placed(&to_stalk));
        inside(&leaf).then_some(Blade { segment, along_m, leaf, petiole })
    }
}
