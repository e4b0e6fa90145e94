//! The organs of one row in cells, so that a ray looks at few of them.

use glam::DVec3;
use rowscan_scenes::{Leaf, Orchard, Surface};

use super::organs::{Polygon, Ray, Shape};

/// Edge of the cells, metres: a leaf is about as long.
const EDGE_M: f64 = 0.08;
/// The most cells: larger rows have larger ones.
const MOST_CELLS: f64 = 4e6;
/// Edge of the squares of the row's plane that are leafless or not, metres.
pub(super) const SQUARE_M: f64 = 0.1;

/// What an organ is to a drop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The leaf with this place in [`Row::leaves`].
    Leaf(u32),
    Wood,
    Fruit,
}

/// A leaf, as the interception counts it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafFacts {
    /// Number of its tree in the row.
    pub(super) tree: u32,
    /// Its centroid.
    pub(super) at: DVec3,
    pub(super) area_m2: f64,
}

#[derive(Debug)]
struct Organ {
    shape: Shape,
    kind: Kind,
    low: DVec3,
    high: DVec3,
}

/// One row. It repeats with its period.
#[derive(Debug)]
pub(super) struct Row {
    /// Period, metres; infinite where it does not repeat.
    pub(super) length_m: f64,
    /// X of its axis.
    pub(super) axis_m: f64,
    pub(super) leaves: Vec<LeafFacts>,
    /// The highest leaf; none in a row without leaves.
    pub(super) top_m: Option<f64>,
    organs: Vec<Organ>,
    low: DVec3,
    edge: DVec3,
    counts: [i64; 3],
    /// Where the organs of each cell begin in `members`.
    starts: Vec<u32>,
    members: Vec<u32>,
    /// Squares of the row's plane that hold leaves.
    squares: Squares,
}

/// What a ray met first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    pub(super) kind: Kind,
    pub(super) t: f64,
    /// In which repetition of the row.
    pub(super) period: i64,
}

impl Row {
    /// Row `number` of an orchard; an empty one where there is no such row.
    pub(super) fn of(orchard: &Orchard, number: i32) -> Self {
        let axis_m = f64::from(number) * orchard.row_spacing_m().unwrap_or(0.0);
        let (mut organs, mut leaves) = (Vec::new(), Vec::new());
        let row = usize::try_from(number).ok().filter(|row| *row < orchard.rows());
        for (tree, standing) in (0..).zip(row.into_iter().flat_map(|row| orchard.trees_from_foot(row))) {
            for leaf in &standing.leaves {
                organs.push(Organ::polygon(leaf, Kind::Leaf(leaves.len() as u32)));
                let at = DVec3::from_array(leaf.centroid());
                leaves.push(LeafFacts { tree, at, area_m2: leaf.area_m2() });
            }
            organs.extend(standing.wood.iter().map(Organ::cylinder));
            organs.extend(standing.facets.iter().filter_map(|facet| {
                let kind = match facet.surface {
                    Surface::Fruit => Kind::Fruit,
                    Surface::Bark | Surface::Post | Surface::Wire => Kind::Wood,
                    // The ground is level here, as high as the row's foot.
                    Surface::Soil | Surface::Grass => return None,
                };
                Some(Organ::polygon(&facet.polygon, kind))
            }));
        }
        for (_, support) in row.into_iter().flat_map(|row| orchard.supports_of_row(row)) {
            organs.push(Organ::cylinder(&support.shape.translated([0.0, 0.0, -orchard.foot_m(number)])));
        }
        Self::made((orchard.period_m(), axis_m), leaves, organs)
    }

    fn made((length_m, axis_m): (f64, f64), leaves: Vec<LeafFacts>, organs: Vec<Organ>) -> Self {
        let mut low = organs.iter().fold(DVec3::INFINITY, |low, organ| low.min(organ.low));
        let mut high = organs.iter().fold(DVec3::NEG_INFINITY, |high, organ| high.max(organ.high));
        if organs.is_empty() {
            (low, high) = (DVec3::ZERO, DVec3::ZERO);
        }
        if length_m.is_finite() {
            (low.y, high.y) = (0.0, length_m);
        }
        let size = (high - low).max(DVec3::splat(1e-6));
        let edge_m = EDGE_M.max(libm::cbrt(size.x * size.y * size.z / MOST_CELLS));
        let counts = size.to_array().map(|size| (size / edge_m).ceil().max(1.0) as i64);
        let edge = DVec3::from_array([0, 1, 2].map(|axis: usize| {
            size.to_array().get(axis).copied().unwrap_or(1.0) / counts.get(axis).map_or(1.0, |n| *n as f64)
        }));
        let mut row = Self {
            squares: Squares::of(&organs, (low.y, high.y), high.z),
            length_m,
            axis_m,
            leaves,
            top_m: None,
            organs,
            low,
            edge,
            counts,
            starts: Vec::new(),
            members: Vec::new(),
        };
        let tops = row.organs.iter().filter(|organ| organ.is_leaf()).map(|organ| organ.high.z);
        row.top_m = tops.fold(None, |top: Option<f64>, z| Some(top.map_or(z, |top| top.max(z))));
        row.sort_into_cells();
        row
    }

    fn sort_into_cells(&mut self) {
        let cells = self.counts.iter().product::<i64>() as usize;
        let mut counted = vec![0_u32; cells + 1];
        for organ in &self.organs {
            self.cells_of(organ, |cell| counted[cell + 1] += 1);
        }
        let mut sum = 0;
        for count in &mut counted {
            sum += *count;
            *count = sum;
        }
        let mut next = counted.clone();
        let mut members = vec![0; sum as usize];
        for (number, organ) in (0..).zip(&self.organs) {
            self.cells_of(organ, |cell| {
                members[next[cell] as usize] = number;
                next[cell] += 1;
            });
        }
        (self.starts, self.members) = (counted, members);
    }

    /// Every cell that the organ may be in; along a row that repeats the cells of its images too.
    fn cells_of(&self, organ: &Organ, mut with: impl FnMut(usize)) {
        let place = |at: f64, axis: usize| {
            let (low, edge) = (self.low.to_array(), self.edge.to_array());
            ((at - low[axis]) / edge[axis]).floor() as i64
        };
        let span = |axis: usize| {
            let (low, high) = (organ.low.to_array(), organ.high.to_array());
            // Half a micrometre more: no edge of a cell lets a ray through.
            (place(low[axis] - 5e-7, axis), place(high[axis] + 5e-7, axis))
        };
        let clamped = |(from, to): (i64, i64), axis: usize| {
            (from.clamp(0, self.counts[axis] - 1), to.clamp(0, self.counts[axis] - 1))
        };
        let ((x0, x1), (z0, z1)) = (clamped(span(0), 0), clamped(span(2), 2));
        let along = span(1);
        let (y0, y1) = if self.length_m.is_finite() {
            // More than a whole period is every cell once.
            (along.0, along.1.min(along.0 + self.counts[1] - 1))
        } else {
            clamped(along, 1)
        };
        for y in y0..=y1 {
            let y = y.rem_euclid(self.counts[1]);
            for x in x0..=x1 {
                for z in z0..=z1 {
                    with(((y * self.counts[0] + x) * self.counts[2] + z) as usize);
                }
            }
        }
    }

    /// The first organ that a ray meets.
    pub(super) fn first(&self, ray: Ray) -> Option<Met> {
        if self.organs.is_empty() {
            return None;
        }
        let mut walk = Walk::of(self, ray)?;
        let mut best: Option<Met> = None;
        loop {
            let [x, y, z] = walk.cell;
            let (period, y) = (y.div_euclid(self.counts[1]), y.rem_euclid(self.counts[1]));
            let cell = ((y * self.counts[0] + x) * self.counts[2] + z) as usize;
            let members = self.members.get(self.starts[cell] as usize..self.starts[cell + 1] as usize);
            for member in members.unwrap_or_default() {
                let organ = &self.organs[*member as usize];
                self.meet(organ, ray, period, &mut best);
            }
            let end = walk.end();
            if best.is_some_and(|met| met.t <= end) || !walk.goes_on() {
                return best;
            }
        }
    }

    /// Meets an organ, or its image that lies in this period.
    fn meet(&self, organ: &Organ, ray: Ray, period: i64, best: &mut Option<Met>) {
        let periods = if self.length_m.is_finite() {
            // An organ that reaches over the row's end stands in the cells of the next period by its image from this one.
            let into = |y: f64| (y / self.length_m).floor() as i64;
            period - into(organ.high.y + 5e-7)..=period - into(organ.low.y - 5e-7)
        } else {
            0..=0
        };
        for period in periods {
            let shift_m = if period == 0 { 0.0 } else { period as f64 * self.length_m };
            let image = Ray { from: ray.from - DVec3::Y * shift_m, ..ray };
            if let Some(t) = organ.shape.met(image).filter(|t| best.is_none_or(|met| *t < met.t)) {
                *best = Some(Met { kind: organ.kind, t, period });
            }
        }
    }

    /// True where the square of the row's plane at this place holds leaves.
    pub(super) fn has_leaves(&self, y_m: f64, z_m: f64) -> bool {
        let y_m = if self.length_m.is_finite() { y_m.rem_euclid(self.length_m) } else { y_m };
        self.squares.has(y_m, z_m)
    }
}

impl Organ {
    fn polygon(leaf: &Leaf, kind: Kind) -> Self {
        let corners = || leaf.outline().iter().map(|corner| DVec3::from_array(*corner));
        Self {
            shape: Shape::Polygon(Polygon::of(leaf)),
            kind,
            low: corners().fold(DVec3::INFINITY, DVec3::min),
            high: corners().fold(DVec3::NEG_INFINITY, DVec3::max),
        }
    }

    fn cylinder(piece: &rowscan_scenes::Cylinder) -> Self {
        let (base, tip) = (DVec3::from_array(piece.base()), DVec3::from_array(piece.tip()));
        let radius = DVec3::splat(piece.radius_m());
        Self {
            shape: Shape::Cylinder(*piece),
            kind: Kind::Wood,
            low: base.min(tip) - radius,
            high: base.max(tip) + radius,
        }
    }

    fn is_leaf(&self) -> bool {
        matches!(self.kind, Kind::Leaf(_))
    }
}

/// A ray on its way through cells.
struct Walk {
    cell: [i64; 3],
    step: [i64; 3],
    /// How far along the ray the next cell begins, by axis.
    next: [f64; 3],
    /// How far it is from one to the next.
    each: [f64; 3],
    /// Cells by axis; without end along a row that repeats.
    counts: [i64; 3],
    out: f64,
}

impl Walk {
    /// From where the ray enters the row's box; none where it passes it.
    fn of(row: &Row, ray: Ray) -> Option<Self> {
        let (from, along) = (ray.from.to_array(), ray.along.to_array());
        let (low, edge) = (row.low.to_array(), row.edge.to_array());
        let is_endless = |axis: usize| axis == 1 && row.length_m.is_finite();
        let (mut enter, mut out) = (0.0_f64, f64::INFINITY);
        for axis in (0..3).filter(|axis| !is_endless(*axis)) {
            let (near, far) = (low[axis] - 1e-6, low[axis] + row.counts[axis] as f64 * edge[axis] + 1e-6);
            if along[axis] == 0.0 {
                if !(near..=far).contains(&from[axis]) {
                    return None;
                }
                continue;
            }
            let (a, b) = ((near - from[axis]) / along[axis], (far - from[axis]) / along[axis]);
            (enter, out) = (enter.max(a.min(b)), out.min(a.max(b)));
        }
        // A ray along the row alone would have no end.
        if enter > out || !out.is_finite() {
            return None;
        }
        let at = ray.at(enter).to_array();
        let mut walk = Self {
            cell: [0; 3],
            step: [0; 3],
            next: [f64::INFINITY; 3],
            each: [f64::INFINITY; 3],
            counts: row.counts,
            out,
        };
        for axis in 0..3 {
            let place = ((at[axis] - low[axis]) / edge[axis]).floor() as i64;
            let place = if is_endless(axis) { place } else { place.clamp(0, row.counts[axis] - 1) };
            walk.cell[axis] = place;
            if is_endless(axis) {
                walk.counts[axis] = i64::MAX;
            }
            if along[axis] != 0.0 {
                walk.step[axis] = if along[axis] > 0.0 { 1 } else { -1 };
                let border = low[axis] + (place + i64::from(along[axis] > 0.0)) as f64 * edge[axis];
                walk.next[axis] = (border - from[axis]) / along[axis];
                walk.each[axis] = edge[axis] / along[axis].abs();
            }
        }
        Some(walk)
    }

    fn nearest(&self) -> usize {
        let [x, y, z] = self.next;
        if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        }
    }

    /// How far along the ray this cell ends.
    fn end(&self) -> f64 {
        self.next[self.nearest()]
    }

    /// Goes on to the next cell; false where there is none.
    fn goes_on(&mut self) -> bool {
        let axis = self.nearest();
        if self.next[axis] > self.out {
            return false;
        }
        self.cell[axis] += self.step[axis];
        self.next[axis] += self.each[axis];
        self.counts[axis] == i64::MAX || (0..self.counts[axis]).contains(&self.cell[axis])
    }
}

/// Squares of the plane along the row.
#[derive(Debug)]
struct Squares {
    from_m: f64,
    edge_m: f64,
    counts: [usize; 2],
    held: Vec<bool>,
}

impl Squares {
    fn of(organs: &[Organ], (from_m, to_m): (f64, f64), top_m: f64) -> Self {
        let long = ((to_m - from_m) / SQUARE_M).ceil().clamp(1.0, 1e7);
        let high = (top_m / SQUARE_M).ceil().clamp(1.0, 1e4);
        let counts = [long as usize, high as usize];
        let edge_m = if to_m > from_m { (to_m - from_m) / long } else { SQUARE_M };
        let held = vec![false; counts[0] * counts[1]];
        let mut squares = Self { from_m, edge_m, counts, held };
        for organ in organs.iter().filter(|organ| organ.is_leaf()) {
            squares.hold(organ);
        }
        squares
    }

    fn hold(&mut self, organ: &Organ) {
        let along = |y: f64| ((y - self.from_m) / self.edge_m).floor() as i64;
        let up = |z: f64| (z / SQUARE_M).floor().max(0.0) as usize;
        // What ends where a square begins is not in it.
        let (y0, y1) = (along(organ.low.y + 1e-9), along(organ.high.y - 1e-9));
        let (z0, z1) = (up(organ.low.z + 1e-9), up(organ.high.z - 1e-9));
        for y in y0..=y1.max(y0) {
            let y = y.rem_euclid(self.counts[0] as i64) as usize;
            for z in z0..=z1.max(z0) {
                if let Some(held) = self.held.get_mut(y * self.counts[1] + z).filter(|_| z < self.counts[1]) {
                    *held = true;
                }
            }
        }
    }

    fn has(&self, y_m: f64, z_m: f64) -> bool {
        let (y, z) = (((y_m - self.from_m) / self.edge_m).floor(), (z_m / SQUARE_M).floor());
        let is_inside = y >= 0.0 && z >= 0.0 && y < self.counts[0] as f64 && z < self.counts[1] as f64;
        is_inside && self.held.get(y as usize * self.counts[1] + z as usize).copied().unwrap_or(false)
    }
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::random::Stream;
    use rowscan_scenes::OrchardParameters;
    use rowscan_scenes::orchard::Preset;

    use super::*;

    /// Every organ of the periods around, one by one.
    fn one_by_one(row: &Row, ray: Ray) -> Option<f64> {
        let each = row.organs.iter().flat_map(|organ| (-4..5).map(move |period| (organ, period)));
        let met = each.filter_map(|(organ, period)| {
            let shift_m = f64::from(period) * row.length_m;
            organ.shape.met(Ray { from: ray.from - DVec3::Y * shift_m, ..ray })
        });
        met.fold(None, |first, t| Some(first.map_or(t, |first: f64| first.min(t))))
    }

    #[test]
    fn cells_find_what_a_look_at_every_organ_finds() {
        let parameters = OrchardParameters { trees: Some(2), ..OrchardParameters::of(Preset::Paper) };
        let orchard = Orchard::grow(&parameters, 4, &|_, _| {}).expect("it grows");
        let row = Row::of(&orchard, 0);
        let mut stream = Stream::keyed(1, &[7]);
        let mut between = |low: f64, high: f64| low + (high - low) * stream.unit();
        let mut hits = 0;
        for _ in 0..300 {
            let side = if between(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
            let ray = Ray {
                from: DVec3::new(side * 1.5, between(-1.0, 2.0) * row.length_m, between(0.2, 3.0)),
                along: DVec3::new(-side * between(0.3, 1.0), between(-1.0, 1.0), between(-1.0, 1.0)),
            };
            let found = row.first(ray).map(|met| met.t);
            assert_eq!(found, one_by_one(&row, ray), "{ray:?}");
            hits += u32::from(found.is_some());
        }
        assert!((30..290).contains(&hits), "{hits}");
    }
}
