//! What the beams of a slice did, voxel by voxel: who entered, how far they went, where they ended.
//!
//! Voxels are squares in x and z within a slice along the row; beams lie in one plane, so the way of each beam through the squares
//! is worked out once per beam grid. A beam's free path runs through every voxel on its way, up to its hit or, for a miss, right
//! through, multiplied by the inflation of a wide beam ([`Footprint`](crate::Footprint)). Lines enter with their weight. The estimators read the sums when the slice ends ([`LayerSum`]).

mod paths;

pub(crate) use self::paths::{Paths, Region};
use crate::beam_line::BeamLine;
use crate::closing::Closing;
use crate::delays::Delays;
use crate::error::PipelineError;
use crate::geometry::{Beam, Frame, Reading, reading};
use crate::parameters::{Fill, Parameters};
use crate::trees::Cut;
use rowscan_protocol::rig::{Mount, Rig};

/// The voxel region in the scan plane, and the open slice's sums.
#[derive(Clone, Debug)]
pub(crate) struct Voxels {
    region: Region,
    paths: Paths,
    voxels: Vec<Voxel>,
    /// Of each, the share above the ground.
    above_ground: Vec<f64>,
    /// Metres of row in the open slice.
    length_m: f64,
    hits: u64,
    /// Of these, hits whose share is known.
    shares: u64,
    patches: u64,
    min_beams: u32,
    delays: Delays,
    /// Returns closer than this are one echo.
    merged_m: f64,
    /// How blocks of beams are made; `None` of rays.
    closing: Option<Closing>,
    parameters: Parameters,
}

/// No surface is nearer than this, metres.
const NEAREST_M: f64 = 0.05;

/// The voxels of a row: where the first one begins, and how large they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelGrid {
    /// Corner in the scene frame, metres: nearest to the scanner, at y = 0, lowest.
    pub corner_m: [f64; 3],
    /// Edges across the row, along it, in height, metres.
    pub edge_m: [f64; 3],
}

impl VoxelGrid {
    /// The voxels that a pipeline with these settings uses.
    ///
    /// # Errors
    /// A rig that no estimate could be made with.
    pub fn of(rig: &Rig, mount: &Mount, parameters: &Parameters) -> Result<Self, PipelineError> {
        let frame = Frame::new(rig, mount)?;
        let region = Region::new(&frame, rig.row_spacing_m, parameters);
        let slice_m = Cut::new(rig.tree_spacing_m, parameters.slice_m).slice_m();
        Ok(Self {
            corner_m: [region.x_m - frame.distance_m, 0.0, region.z_m + frame.foot_m],
            edge_m: [region.dx_m, slice_m, region.dz_m],
        })
    }
}

/// One voxel's sums.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Voxel {
    /// Σ line weight over hits, metres.
    pub(crate) hits_m: f64,
    /// Σ line weight · free path, m²; paths are as much longer as the beam's width makes hits more frequent.
    pub(crate) path_m2: f64,
    /// Σ line weight² · free path of the beams that hit, m³.
    pub(crate) hit_path_m3: f64,
    /// Σ line weight² over hits, m².
    pub(crate) hits_m2: f64,
    /// Σ line weight · distance across the row over hits, m², and the same of its square, m³.
    pub(crate) hits_x_m2: f64,
    pub(crate) hits_x2_m3: f64,
    /// Beams that entered.
    pub(crate) beams: u32,
    /// Σ line weight · share of the spot / range² over hits, 1/m; of beams whose remission is read.
    pub(crate) share_hits_per_m: f64,
    /// Σ line weight · ∫ dr / range² over the free paths of the shares of those beams.
    pub(crate) share_path: f64,
    /// As `hits_m`, `path_m2` and `beams`, of blocks of beams over two spots ([`Closing`]); 0 for rays.
    pub(crate) closed_hits_m: f64,
    pub(crate) closed_path_m2: f64,
    pub(crate) closed_beams: u32,
}

/// The standard deviation of a distance, metres, by the sums of weights, of weight · distance and of weight · its square; None without a weight.
pub(crate) fn scatter_m(weight_m: f64, x_m2: f64, x2_m3: f64) -> Option<f64> {
    let mean_m = x_m2 / weight_m;
    (weight_m > 0.0).then(|| (x2_m3 / weight_m - mean_m * mean_m).max(0.0).sqrt())
}

impl Voxel {
    /// Adds what other beams did in it.
    pub(crate) fn add(&mut self, other: &Self) {
        self.hits_m += other.hits_m;
        self.path_m2 += other.path_m2;
        self.hit_path_m3 += other.hit_path_m3;
        self.hits_m2 += other.hits_m2;
        self.hits_x_m2 += other.hits_x_m2;
        self.hits_x2_m3 += other.hits_x2_m3;
        self.beams = self.beams.saturating_add(other.beams);
        self.share_hits_per_m += other.share_hits_per_m;
        self.share_path += other.share_path;
        self.closed_hits_m += other.closed_hits_m;
        self.closed_path_m2 += other.closed_path_m2;
        self.closed_beams = self.closed_beams.saturating_add(other.closed_beams);
    }

    /// How far its hits scatter across the row, as a standard deviation, metres; None where nothing was hit.
    pub(crate) fn hits_sd_m(&self) -> Option<f64> {
        scatter_m(self.hits_m, self.hits_x_m2, self.hits_x2_m3)
    }

    /// As many hits of one weight as tell as much.
    pub(crate) fn hits_counted(&self) -> f64 {
        if self.hits_m2 > 0.0 { self.hits_m * self.hits_m / self.hits_m2 } else { 0.0 }
    }

    /// Contact frequency, hits a metre of free path; None where too few beams entered.
    pub(crate) fn contact_frequency(&self, min_beams: u32) -> Option<f64> {
        (self.beams >= min_beams && self.path_m2 > 0.0).then(|| self.hits_m / self.path_m2)
    }

    /// The same of blocks of beams; None as well where beams have no width.
    pub(crate) fn closed_frequency(&self, min_beams: u32) -> Option<f64> {
        let read = self.closed_beams >= min_beams && self.closed_path_m2 > 0.0;
        read.then(|| self.closed_hits_m / self.closed_path_m2)
    }

    /// The same by shares of spots; None as well where no remission was read. What only the rest of a spot entered tells nothing: what that met counts
    /// where its echo stands.
    pub(crate) fn share_frequency(&self, min_beams: u32) -> Option<f64> {
        let read = self.beams >= min_beams && self.share_path > 0.0;
        read.then(|| self.share_hits_per_m / self.share_path)
    }
}

/// The sums of a slice that is over.
#[derive(Clone, Debug, Default)]
pub(crate) struct KeptSlice {
    pub(crate) hits: u64,
    pub(crate) shares: u64,
    pub(crate) patches: u64,
    /// By their number in the region; those that no beam entered are left out.
    pub(crate) voxels: Vec<(u32, Voxel)>,
}

/// The voxels of one height: how many, and the sums of what they hold.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LayerSum {
    /// Lower and upper face, metres above ground.
    pub(crate) z_m: [f64; 2],
    /// Voxels, of those that do not lie in the ground, that enough beams entered.
    pub(crate) visited: u32,
    /// Voxels that too few beams entered.
    pub(crate) unvisited: u32,
    /// Σ density over visited voxels, each by its share above the ground.
    pub(crate) density: f64,
    /// Σ density that the fill rule gives the unvisited ones, by the same share.
    pub(crate) filled: f64,
}

/// Unvisited voxels by the reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Unseen {
    /// Voxels in all.
    pub(crate) of: u64,
    /// Beams are aimed at them, but were stopped before.
    pub(crate) occluded: u64,
    /// No beam of the grid leads there.
    pub(crate) never_visited: u64,
}

impl Voxels {
    pub(crate) fn new(frame: &Frame, row_spacing_m: Option<f64>, parameters: &Parameters) -> Self {
        let region = Region::new(frame, row_spacing_m, parameters);
        Self {
            voxels: vec![Voxel::default(); region.len()],
            above_ground: region.above_ground(frame),
            paths: Paths::default(),
            region,
            length_m: 0.0,
            hits: 0,
            shares: 0,
            patches: 0,
            min_beams: parameters.min_beams.max(1),
            delays: Delays::new(parameters),
            merged_m: parameters.footprint.map_or(0.0, |footprint| footprint.merged_m),
            closing: parameters.footprint.map(|footprint| Closing::of(&footprint, frame.distance_m)),
            parameters: *parameters,
        }
    }

    /// Works out the ways of a new grid's beams.
    pub(crate) fn rebuild(&mut self, beams: &[Option<Beam>], frame: &Frame) {
        self.paths.rebuild(beams, frame, &self.region, &self.parameters);
    }

    /// Changes the ways of the beams for those of other beams, worked out before.
    pub(crate) fn swap_paths(&mut self, paths: &mut Paths) {
        core::mem::swap(&mut self.paths, paths);
    }

    /// Adds a line to the open slice. Its beams are in the order that [`rebuild`](Self::rebuild) was given; `fresh` says of
    /// each beam whether it ends on a patch no neighbour has met.
    pub(crate) fn add_line(&mut self, line: &BeamLine<'_>, fresh: &[bool], weight_m: f64) {
        self.length_m += weight_m;
        self.add_shares(line, weight_m);
        self.add_closed(line, weight_m);
        let Self { paths, voxels, delays, hits, patches, .. } = self;
        for ((way, &range_m), &fresh) in paths.ways.iter().zip(line.range_m).zip(fresh) {
            paths.follow(way, range_m, delays, |step, path_m, ends| {
                let Some(voxel) = voxels.get_mut(step.voxel) else { return };
                voxel.beams = voxel.beams.saturating_add(1);
                voxel.path_m2 += weight_m * path_m;
                if let Some(end_m) = ends {
                    let x_m = end_m * way.cos;
                    voxel.hits_m += weight_m;
                    voxel.hits_x_m2 += weight_m * x_m;
                    voxel.hits_x2_m3 += weight_m * x_m * x_m;
                    voxel.hits_m2 += weight_m * weight_m;
                    voxel.hit_path_m3 += weight_m * weight_m * path_m;
                    *hits += 1;
                    *patches += u64::from(fresh);
                }
            });
        }
    }

    /// The same of blocks of beams, which pass where any of their beams does.
    fn add_closed(&mut self, line: &BeamLine<'_>, weight_m: f64) {
        let Self { paths, voxels, delays, closing: Some(closing), .. } = self else { return };
        for (way, range_m) in paths.ways.iter().zip(closing.close(line)) {
            paths.follow(way, range_m, delays, |step, path_m, ends| {
                let Some(voxel) = voxels.get_mut(step.voxel) else { return };
                voxel.closed_beams = voxel.closed_beams.saturating_add(1);
                voxel.closed_path_m2 += weight_m * path_m;
                voxel.closed_hits_m += if ends.is_some() { weight_m } else { 0.0 };
            });
        }
    }

    /// The same by the shares of the spots. What a leaf leaves of a spot goes on for a pulse, within which all that is met is the same echo; what becomes
    /// of the rest is not told. Power falls by the square of the range, so hits and paths count by 1 / r²: then the echo's range, a mean by power, ends
    /// the paths of all its leaves where their sum is exact.
    fn add_shares(&mut self, line: &BeamLine<'_>, weight_m: f64) {
        for ((way, &range_m), &share) in self.paths.ways.iter().zip(line.range_m).zip(line.share) {
            let steps = self.paths.steps.get(way.first..way.last).unwrap_or_default();
            let (end_m, share) = match reading(range_m) {
                Reading::Return if share.is_finite() => (range_m, share),
                // What ends behind the row, on the ground or a wall, has passed it, whatever its remission.
                Reading::Return if steps.last().is_none_or(|step| range_m >= step.exit_m) => (range_m, 0.0),
                Reading::Miss => (f64::INFINITY, 0.0),
                Reading::Return | Reading::Invalid => continue,
            };
            let mut from_m = way.entry_m;
            for step in steps {
                if from_m >= end_m + self.merged_m {
                    break;
                }
                let Some(voxel) = self.voxels.get_mut(step.voxel) else { break };
                let to_m = step.exit_m;
                // ∫ dr / r².
                let way = |from_m: f64, to_m: f64| {
                    if from_m < to_m { 1.0 / from_m.max(NEAREST_M) - 1.0 / to_m.max(NEAREST_M) } else { 0.0 }
                };
                let whole = way(from_m, to_m.min(end_m));
                let rest = (1.0 - share).max(0.0) * way(from_m.max(end_m), to_m.min(end_m + self.merged_m));
                voxel.share_path += weight_m * (whole + rest);
                if (from_m..to_m).contains(&end_m) {
                    voxel.share_hits_per_m += weight_m * share / (end_m * end_m);
                    self.shares += 1;
                }
                from_m = to_m;
            }
        }
    }

    /// Layer by layer from below: the sums of a density that a voxel's sums give, None where it tells nothing. What lies in the ground holds nothing.
    pub(crate) fn layers<'a>(
        &'a self,
        density: impl Fn(&Voxel) -> Option<f64> + Copy + 'a,
    ) -> impl Iterator<Item = LayerSum> + 'a {
        self.bare_layers().enumerate().map(move |(layer, (band, above))| {
            let z_m = [layer, layer + 1].map(|k| self.region.z_m + k as f64 * self.region.dz_m);
            let mut sum = LayerSum { z_m, ..LayerSum::default() };
            let standing = || band.iter().zip(above).enumerate().filter(|(_, (_, share))| **share > 0.0);
            // Σ share over visited voxels, and over the others.
            let mut shares = (0.0, 0.0);
            for (_, (voxel, share)) in standing() {
                match density(voxel) {
                    Some(found) => {
                        sum.visited += 1;
                        sum.density += found * share;
                        shares.0 += share;
                    }
                    None => {
                        sum.unvisited += 1;
                        shares.1 += share;
                    }
                }
            }
            sum.filled = match self.parameters.fill {
                Fill::LeaveOut => 0.0,
                Fill::BandMean if sum.visited == 0 => 0.0,
                Fill::BandMean => sum.density / shares.0 * shares.1,
                Fill::Mirror => {
                    let missing = standing().filter(|(_, (voxel, _))| density(voxel).is_none());
                    missing
                        .filter_map(|(i, (_, share))| Some(self.stands_in(band, i, density)? * share))
                        .sum()
                }
            };
            sum
        })
    }

    /// What an unvisited voxel of a layer is taken to hold: as much as its mirror image; where that is hidden too, as the nearest voxel before that
    /// one that beams reached.
    fn stands_in(&self, band: &[Voxel], ix: usize, density: impl Fn(&Voxel) -> Option<f64>) -> Option<f64> {
        let twin = self.region.mirrored(ix)?;
        if let Some(found) = band.get(twin).and_then(&density) {
            return Some(found);
        }
        band.get(..twin.min(ix))?.iter().rev().find_map(density)
    }

    /// Leaf area by the shares of spots, m²: 0 where no remission was read.
    pub(crate) fn share_leaf_area_m2(&self) -> f64 {
        if self.parameters.remission.is_none() {
            return 0.0;
        }
        self.leaf_area_m2(|voxel| voxel.share_frequency(self.min_beams))
    }

    /// Leaf area by blocks of beams, m²: 0 of rays.
    pub(crate) fn closed_leaf_area_m2(&self) -> f64 {
        if self.closing.is_none() {
            return 0.0;
        }
        self.leaf_area_m2(|voxel| voxel.closed_frequency(self.min_beams))
    }

    /// Leaf area by a density that a voxel's sums give, m², unvisited voxels filled.
    fn leaf_area_m2(&self, density: impl Fn(&Voxel) -> Option<f64> + Copy) -> f64 {
        let sum: f64 = self.layers(density).map(|layer| layer.density + layer.filled).sum();
        sum * self.volume_m3() / self.parameters.projection
    }

    /// Beams that ended in a voxel and told their share.
    pub(crate) fn shares(&self) -> u64 {
        self.shares
    }

    /// Where the voxels are.
    pub(crate) fn region(&self) -> Region {
        self.region
    }

    /// The open slice's sums, to be kept.
    pub(crate) fn kept(&self) -> KeptSlice {
        let holds = |voxel: &Voxel| voxel.beams > 0 || voxel.closed_beams > 0 || voxel.share_path > 0.0;
        let voxels = (0..).zip(&self.voxels).filter(|(_, voxel)| holds(voxel));
        KeptSlice {
            hits: self.hits,
            shares: self.shares,
            patches: self.patches,
            voxels: voxels.map(|(place, voxel)| (place, *voxel)).collect(),
        }
    }

    /// A voxel of the open slice.
    pub(crate) fn at_mut(&mut self, place: usize) -> Option<&mut Voxel> {
        self.voxels.get_mut(place)
    }

    /// Counts the hits of a slice whose voxels were added.
    pub(crate) fn count(&mut self, kept: &KeptSlice) {
        self.hits += kept.hits;
        self.shares += kept.shares;
        self.patches += kept.patches;
    }

    /// The voxels of each layer, from below, in the order of x; and their shares above the ground.
    pub(crate) fn bare_layers(&self) -> impl Iterator<Item = (&[Voxel], &[f64])> {
        let nx = self.region.nx.max(1);
        self.voxels.chunks(nx).zip(self.above_ground.chunks(nx))
    }

    /// Every voxel's sums.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &Voxel> {
        self.voxels.iter()
    }

    /// Unvisited voxels, by the reason.
    pub(crate) fn unseen(&self) -> Unseen {
        let mut unseen = Unseen::default();
        let voxels = self.voxels.iter().zip(&self.paths.aimed).zip(&self.above_ground);
        for ((voxel, aimed), _) in voxels.filter(|(_, share)| **share > 0.0) {
            unseen.of += 1;
            if voxel.beams < self.min_beams {
                let count = if *aimed { &mut unseen.occluded } else { &mut unseen.never_visited };
                *count += 1;
            }
        }
        unseen
    }

    /// Share of the room above the ground that no beam of the grid leads to; 0 before the first line.
    pub(crate) fn out_of_sight(&self) -> f64 {
        let aimed = self.paths.aimed.iter().zip(&self.above_ground);
        let (all, seen) = aimed.fold((0.0, 0.0), |(all, seen), (aimed, share)| {
            (all + share, seen + if *aimed { *share } else { 0.0 })
        });
        if all > 0.0 { 1.0 - seen / all } else { 0.0 }
    }

    /// How high above the ground the lowest room lies that a beam of the grid leads to, metres; 0 before the first line.
    pub(crate) fn lowest_in_sight_m(&self) -> f64 {
        let nx = self.region.nx.max(1);
        let mut layers = self.paths.aimed.chunks(nx);
        let lowest = layers.position(|layer| layer.contains(&true)).unwrap_or(0);
        (self.region.z_m + lowest as f64 * self.region.dz_m).max(0.0)
    }

    /// Metres of row in the open slice.
    pub(crate) fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Volume of one voxel of the open slice, m³.
    pub(crate) fn volume_m3(&self) -> f64 {
        self.region.dx_m * self.region.dz_m * self.length_m
    }

    /// Beams that ended in a voxel.
    pub(crate) fn hits(&self) -> u64 {
        self.hits
    }

    /// Hits a patch of surface: about how many beams one leaf stops. 1 where nothing was hit.
    pub(crate) fn hits_per_patch(&self) -> f64 {
        (self.hits as f64 / self.patches.max(1) as f64).max(1.0)
    }

    pub(crate) fn min_beams(&self) -> u32 {
        self.min_beams
    }

    /// Empties the slice.
    pub(crate) fn clear(&mut self) {
        self.voxels.fill(Voxel::default());
        self.length_m = 0.0;
        self.hits = 0;
        self.shares = 0;
        self.patches = 0;
    }

    #[cfg(test)]
    pub(crate) fn capacities(&self) -> [usize; 5] {
        let paths = &self.paths;
        [
            self.voxels.capacity(),
            paths.ways.capacity(),
            paths.steps.capacity(),
            paths.crossings.capacity(),
            paths.aimed.capacity(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::BeamTable;
    use crate::parameters::AreaForm;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::scan::NO_ECHO;

    /// One line of `range_m`, all patches new.
    fn add(voxels: &mut Voxels, range_m: &[f64], weight_m: f64) {
        let line = BeamLine { grid: BeamGrid::default(), range_m, share: &[] };
        voxels.add_line(&line, &vec![true; range_m.len()], weight_m);
    }

    fn voxels(parameters: &Parameters) -> (Voxels, BeamTable) {
        let frame = Frame::new(&Rig::default(), &Mount::default()).unwrap();
        let mut table = BeamTable::default();
        table.update(BeamGrid::spanning(0, 1_800_000, 5000), &frame, AreaForm::Midpoint);
        let mut voxels = Voxels::new(&frame, Some(4.0), parameters);
        voxels.rebuild(table.beams(), &frame);
        (voxels, table)
    }

    #[test]
    fn the_free_path_of_misses_is_their_way_through_the_region() {
        let (mut voxels, table) = voxels(&Parameters::default());
        add(&mut voxels, &vec![NO_ECHO; table.beams().len()], 2.0);
        let walked: f64 = voxels.iter().map(|v| v.path_m2).sum::<f64>() / 2.0;
        // The region is -0.1..3.9 m wide, 0.1..5 m high; the mirror stands in its nearest voxels, 1.6 m high.
        let expected: f64 = table
            .beams()
            .iter()
            .flatten()
            .map(|b| {
                let vertical = if b.sin > 0.0 { (5.0 - 1.6) / b.sin } else { (0.1 - 1.6) / b.sin };
                (3.9 / b.cos).min(if b.sin.abs() < 1e-12 { f64::INFINITY } else { vertical })
            })
            .sum();
        assert!((walked / expected - 1.0).abs() < 1e-12, "{walked} {expected}");
        assert_eq!(voxels.hits(), 0);
    }

    #[test]
    fn a_hit_ends_the_path_and_counts_in_its_voxel() {
        let (mut voxels, table) =
            voxels(&Parameters { min_beams: 1, fill: Fill::LeaveOut, ..Parameters::default() });
        let mut ranges = vec![f64::NAN; table.beams().len()];
        ranges[180] = 1.0; // level
        add(&mut voxels, &ranges, 0.1);
        let walked: f64 = voxels.iter().map(|v| v.path_m2).sum();
        assert!((walked - 0.1).abs() < 1e-12);
        assert_eq!(voxels.hits(), 1);
        // The hit stands 1.0 m off, in the fifth voxel of 0.25 m, which begins 4 · 0.25 m from the row plane, at 0.9 m.
        let frequency: f64 = voxels.iter().filter_map(|voxel| voxel.contact_frequency(1)).sum();
        assert!((frequency * (1.0 - 0.9) - 1.0).abs() < 1e-9, "{frequency}");
        assert!((voxels.volume_m3() - 0.25 * 0.245 * 0.1).abs() < 1e-12);
        assert_eq!(voxels.hits_per_patch(), 1.0);
        voxels.clear();
        assert_eq!((voxels.hits(), voxels.volume_m3()), (0, 0.0));
    }

    #[test]
    fn a_hit_before_the_region_looks_at_nothing() {
        // The region begins 1.4 m off; the return stands at 1.0 m.
        let (mut voxels, table) = voxels(&Parameters { half_width_m: Some(0.5), ..Parameters::default() });
        add(&mut voxels, &vec![1.0; table.beams().len()], 0.1);
        assert!(voxels.iter().all(|v| v.beams == 0 && v.path_m2 == 0.0 && v.hits_m == 0.0));
        assert_eq!(voxels.hits(), 0);
    }

    #[test]
    fn voxels_no_beam_leads_to_are_told_from_those_hidden() {
        let (mut voxels, table) = voxels(&Parameters::default());
        let beams = table.beams().len();
        for _ in 0..20 {
            add(&mut voxels, &vec![1.0; beams], 0.02);
        }
        let hidden = voxels.unseen();
        assert!(hidden.occluded > hidden.of / 2, "{hidden:?}");
        for _ in 0..20 {
            add(&mut voxels, &vec![NO_ECHO; beams], 0.02);
        }
        let open = voxels.unseen();
        assert_eq!((open.occluded, open.never_visited), (0, hidden.never_visited), "{open:?}");
    }
}
