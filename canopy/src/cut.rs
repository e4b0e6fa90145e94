//! Trees found in the data: where one ends and the next begins.
//!
//! The row's profile is kept in bins of [`BIN_M`] along Y. Two ways to cut it, both after the stream:
//! - **trunk**: returns below the crown, close to the row plane, come from trunks; every heap of them is a tree, and the border lies
//!   half way to the next.
//! - **valley**: the impacted area along the row rises and falls with the crowns; every hill is a tree, and the border lies at the lowest
//!   place between two. How far hills are apart, about, is the rig's spacing, or else the distance at which the row resembles
//!   itself most. Crowns that reach into each other leave no valley: then it finds too few.
//!
//! Nothing at all between two heaps for longer than a tree is a gap: a tree reaches no farther than half the usual distance.

use serde::{Deserialize, Serialize};

/// Length of a bin, metres.
pub(crate) const BIN_M: f64 = 0.05;
/// Most of the way over the profile one tree may take, metres.
const WIDEST_TREE_M: f64 = 8.0;
/// Least distance between two trunks, metres.
const NARROWEST_TREE_M: f64 = 0.4;

/// How trees are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutMethod {
    /// By the returns below the crown.
    Trunk,
    /// By the lows of the impacted area along the row.
    Valley,
}

impl CutMethod {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Trunk, Self::Valley];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trunk => "trunk",
            Self::Valley => "valley",
        }
    }

    /// The one of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn named(name: &str) -> Result<Self, UnknownCut> {
        let unknown = || UnknownCut { found: name.to_owned() };
        Self::ALL.into_iter().find(|method| method.name() == name).ok_or_else(unknown)
    }
}

/// A name that is no way to tell trees apart.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("trees: expected `trunk` or `valley`, found `{found}`")]
pub struct UnknownCut {
    /// The name.
    pub found: String,
}

/// A tree found in the data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FoundTree {
    /// Where it stands: the middle of its trunk's returns, or of its hill; metres.
    pub y_m: f64,
    /// Its border before, metres.
    pub y_from_m: f64,
    /// Its border behind, metres.
    pub y_to_m: f64,
    /// I_T between the borders, m².
    pub impacted_total_area_m2: f64,
    /// Leaf area by contact frequency between the borders, no fitted factor, m²; `None` where leaf areas are withheld.
    pub leaf_area_contact_raw_m2: Option<f64>,
}

/// One bin of the row.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    scanned_m: f64,
    impacted_m2: f64,
    contact_m2: f64,
    /// Σ line weight over returns from where trunks are.
    trunk: f64,
}

/// The row along Y, in bins; bounded.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    first: i64,
    bins: Vec<Bin>,
    max: usize,
}

/// The heights between which trunks are bare, and how far before and behind the row plane they stand, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TrunkZone {
    pub(crate) z_m: [f64; 2],
    pub(crate) reach_m: f64,
}

impl TrunkZone {
    /// Above the grass, below the crown of every tree that a sprayer can pass.
    pub(crate) fn above(clearance_m: f64) -> Self {
        Self { z_m: [clearance_m.max(0.0) + 0.05, clearance_m.max(0.0) + 0.35], reach_m: 0.35 }
    }

    pub(crate) fn holds(&self, x_m: f64, z_m: f64, row_m: f64) -> bool {
        (self.z_m[0]..self.z_m[1]).contains(&z_m) && (x_m - row_m).abs() < self.reach_m
    }
}

impl Profile {
    /// Keeps `max` bins at most; what comes after them belongs to no tree.
    pub(crate) fn new(max: usize) -> Self {
        Self { first: 0, bins: Vec::new(), max }
    }

    fn at(&mut self, y_m: f64) -> Option<&mut Bin> {
        let index = (y_m / BIN_M + 1e-9).floor() as i64;
        if self.bins.is_empty() {
            self.first = index;
        }
        let offset =
            usize::try_from(index.checked_sub(self.first)?).ok().filter(|offset| *offset < self.max)?;
        if offset >= self.bins.len() {
            self.bins.resize(offset + 1, Bin::default());
        }
        self.bins.get_mut(offset)
    }

    /// A line passes.
    pub(crate) fn add_line(&mut self, y_m: f64, weight_m: f64, impacted_m2: f64, trunk: f64) {
        if let Some(bin) = self.at(y_m) {
            bin.scanned_m += weight_m;
            bin.impacted_m2 += impacted_m2;
            bin.trunk += trunk;
        }
    }

    /// A slice from one place to another holds so much leaf area.
    pub(crate) fn add_leaf_area(&mut self, from_m: f64, to_m: f64, leaf_m2: f64) {
        let bins = ((to_m - from_m) / BIN_M).round().clamp(1.0, 1000.0);
        for k in 0..bins as usize {
            let y_m = from_m + (k as f64 + 0.5) * (to_m - from_m) / bins;
            if let Some(bin) = self.at(y_m) {
                bin.contact_m2 += leaf_m2 / bins;
            }
        }
    }

    /// The trees, in the order of travel; none where the row shows none.
    /// `spacing_m` is about how far they stand apart, where that is known; without it posts between trees are trunks.
    pub(crate) fn cut(&self, method: CutMethod, spacing_m: Option<f64>) -> Vec<FoundTree> {
        let heaps = match method {
            CutMethod::Trunk => without_posts(self.trunks(), spacing_m.map(|spacing_m| spacing_m / BIN_M)),
            CutMethod::Valley => self.hills(spacing_m),
        };
        self.trees(&heaps, method)
    }

    /// Middles of the heaps of trunk returns, in bins.
    fn trunks(&self) -> Vec<f64> {
        let join = (NARROWEST_TREE_M / BIN_M) as usize;
        let mut heaps: Vec<Heap> = Vec::new();
        for (i, bin) in self.bins.iter().enumerate().filter(|(_, bin)| bin.trunk > 0.0) {
            match heaps.last_mut() {
                Some(heap) if i - heap.last < join => heap.add(i, bin.trunk),
                _ => heaps.push(Heap { last: i, weight: bin.trunk, moment: bin.trunk * (i as f64 + 0.5) }),
            }
        }
        // A twig or a leaf that hangs low is no trunk.
        let mut weights: Vec<f64> = heaps.iter().map(|heap| heap.weight).collect();
        weights.sort_unstable_by(f64::total_cmp);
        let usual = weights.get(weights.len() * 3 / 4).copied().unwrap_or_default();
        heaps.iter().filter(|heap| heap.weight > 0.25 * usual).map(|heap| heap.moment / heap.weight).collect()
    }

    /// Tops of the hills of impacted area, in bins.
    fn hills(&self, spacing_m: Option<f64>) -> Vec<f64> {
        let raw: Vec<f64> = self.bins.iter().map(|bin| bin.impacted_m2).collect();
        let Some(period) = spacing_m.map(|spacing_m| spacing_m / BIN_M).or_else(|| period(&raw)) else {
            return Vec::new();
        };
        let smooth = smoothed(&raw, 0.12 * period);
        let highest = smooth.iter().copied().fold(0.0, f64::max);
        let reach = (0.4 * period).round().max(1.0) as usize;
        let mut tops = Vec::new();
        for (i, &value) in smooth.iter().enumerate() {
            let (from, to) = (i.saturating_sub(reach), (i + reach + 1).min(smooth.len()));
            let around = smooth.get(from..to).unwrap_or_default();
            let top = around
                .iter()
                .enumerate()
                .all(|(k, &other)| value > other || (value == other && from + k >= i));
            if top && value > 0.1 * highest {
                tops.push(i as f64 + 0.5);
            }
        }
        tops
    }

    /// Borders between the trees at these places, and what lies between them.
    fn trees(&self, places: &[f64], method: CutMethod) -> Vec<FoundTree> {
        let mut ways: Vec<f64> = places.windows(2).filter_map(|p| Some(p.get(1)? - p.first()?)).collect();
        ways.sort_unstable_by(f64::total_cmp);
        let Some(&usual) = ways.get(ways.len() / 2).or(places.first().map(|_| &f64::INFINITY)) else {
            return Vec::new();
        };
        let smooth = smoothed(
            &self.bins.iter().map(|bin| bin.impacted_m2).collect::<Vec<_>>(),
            0.12 * usual.min(100.0),
        );
        let between = |a: f64, b: f64| match method {
            CutMethod::Trunk => (a + b) / 2.0,
            CutMethod::Valley => {
                let span = (a as usize)..=(b as usize);
                let lowest = span.min_by(|i, k| {
                    let at = |i: &usize| smooth.get(*i).copied().unwrap_or_default();
                    at(i).total_cmp(&at(k))
                });
                lowest.map_or((a + b) / 2.0, |i| i as f64 + 0.5)
            }
        };
        let end = self.bins.len() as f64;
        let half = 0.5 * usual;
        (0..places.len())
            .filter_map(|i| {
                let own = *places.get(i)?;
                let before = i.checked_sub(1).and_then(|i| places.get(i));
                let after = places.get(i + 1);
                // Wider than one and a half trees apart: a gap lies between, and half a tree is all that is known.
                let near = |other: &&f64| (**other - own).abs() < 1.5 * usual;
                let from = before.filter(near).map_or((own - half).max(0.0), |before| between(*before, own));
                let to = after.filter(near).map_or((own + half).min(end), |after| between(own, *after));
                Some(self.tree(own, from, to))
            })
            .collect()
    }

    fn tree(&self, own: f64, from: f64, to: f64) -> FoundTree {
        let y_m = |bin: f64| (self.first as f64 + bin) * BIN_M;
        let mut tree =
            FoundTree { y_m: y_m(own), y_from_m: y_m(from), y_to_m: y_m(to), ..FoundTree::default() };
        let mut contact_m2 = 0.0;
        for (i, bin) in self.bins.iter().enumerate().skip(from as usize).take((to - from) as usize + 2) {
            let share = ((i as f64 + 1.0).min(to) - (i as f64).max(from)).max(0.0);
            tree.impacted_total_area_m2 += share * bin.impacted_m2;
            contact_m2 += share * bin.contact_m2;
        }
        tree.leaf_area_contact_raw_m2 = Some(contact_m2);
        tree
    }
}

/// Share of the spacing by which trees, and posts midway between two, stand beside their places.
const ASTRAY: f64 = 0.2;
/// Neighbours within so many spacings count. Farther on, the error of the spacing adds up.
const NEIGHBOURS: f64 = 4.5;
/// Largest share of ways from one tree to the next that may not be a whole number of spacings.
const MOST_ASTRAY: f64 = 0.1;

/// Trunks without the posts of a trellis, which stand midway between two trees. A post is what has more neighbours 0.5, 1.5, 2.5, … spacings away than 1, 2, 3, …
/// The clearest one is taken out first, and the others are counted again.
fn without_posts(trunks: Vec<f64>, spacing: Option<f64>) -> Vec<f64> {
    let Some(spacing) = spacing.filter(|spacing| *spacing > 0.0) else { return trunks };
    let beside_whole = |way: f64| {
        let rest = (way / spacing).rem_euclid(1.0);
        rest.min(1.0 - rest)
    };
    let mut kept = trunks.clone();
    loop {
        let posts = kept.iter().enumerate().map(|(at, own)| {
            let ways = kept.iter().map(|other| (other - own).abs());
            let near = ways.filter(|way| *way > 0.0 && *way < NEIGHBOURS * spacing).map(beside_whole);
            let votes = near.map(|beside| i32::from(beside > 0.5 - ASTRAY) - i32::from(beside < ASTRAY));
            (votes.sum::<i32>(), at)
        });
        let Some((_, post)) = posts.filter(|(votes, _)| *votes > 0).max() else { break };
        kept.remove(post);
    }
    // If every other one would go, or the rest does not stand whole numbers of spacings apart, the spacing is wrong: which of them are trees is not known.
    let is_half = 2 * (trunks.len() - kept.len()) + 1 >= trunks.len();
    let ways: Vec<f64> = kept.iter().zip(kept.iter().skip(1)).map(|(one, next)| next - one).collect();
    let astray = ways.iter().filter(|way| beside_whole(**way) > ASTRAY).count();
    if is_half || astray as f64 > MOST_ASTRAY * ways.len() as f64 { trunks } else { kept }
}

/// Neighbouring bins with trunk returns.
struct Heap {
    last: usize,
    weight: f64,
    moment: f64,
}

impl Heap {
    fn add(&mut self, i: usize, weight: f64) {
        self.last = i;
        self.weight += weight;
        self.moment += weight * (i as f64 + 0.5);
    }
}

/// The distance, in bins, at which a profile resembles itself most: the first and highest hill of its autocorrelation beyond its first low.
fn period(profile: &[f64]) -> Option<f64> {
    let n = profile.len();
    let mean = profile.iter().sum::<f64>() / n.max(1) as f64;
    let around: Vec<f64> = smoothed(&profile.iter().map(|v| v - mean).collect::<Vec<_>>(), 2.0);
    let longest = ((WIDEST_TREE_M / BIN_M) as usize).min(n / 2);
    let correlation: Vec<f64> = (0..=longest)
        .map(|lag| {
            let pairs = around.iter().zip(around.iter().skip(lag));
            pairs.map(|(a, b)| a * b).sum::<f64>() / (n - lag).max(1) as f64
        })
        .collect();
    let none = *correlation.first()?;
    if none <= 0.0 {
        return None;
    }
    let low = correlation
        .iter()
        .position(|value| *value < 0.0)
        .unwrap_or(0)
        .max((NARROWEST_TREE_M / BIN_M) as usize);
    let hills = (low..longest).filter(|&lag| {
        let at = |lag: usize| correlation.get(lag).copied().unwrap_or_default();
        at(lag) >= at(lag.saturating_sub(1)) && at(lag) > at(lag + 1)
    });
    let best = correlation.iter().skip(low).copied().fold(0.0, f64::max);
    // Twice the period resembles as much: the first hill nearly as high is meant.
    let mut hills = hills.filter(|&lag| correlation.get(lag).is_some_and(|value| *value > 0.6 * best));
    hills.next().map(|lag| lag as f64)
}

/// A moving mean with the weights of a bell curve; `width` bins is its standard deviation.
fn smoothed(values: &[f64], width: f64) -> Vec<f64> {
    let width = width.max(0.5);
    let reach = (3.0 * width).ceil() as usize;
    let bell: Vec<f64> = (0..=reach).map(|k| (-0.5 * (k as f64 / width).powi(2)).exp()).collect();
    (0..values.len())
        .map(|i| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for k in i.saturating_sub(reach)..(i + reach + 1).min(values.len()) {
                let own = bell.get(k.abs_diff(i)).copied().unwrap_or_default();
                sum += own * values.get(k).copied().unwrap_or_default();
                weight += own;
            }
            sum / weight
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Crowns like bells, 2 m apart from y = 1 m, trunks 0.1 m wide; those at `missing` are not there.
    fn row(trees: u32, missing: &[u32]) -> Profile {
        let mut profile = Profile::new(10_000);
        for line in 0..trees * 100 {
            let y_m = f64::from(line) * 0.02;
            let stands = (0..trees).filter(|i| !missing.contains(i)).map(|i| 2.0 * f64::from(i) + 1.0);
            let crown: f64 = stands.clone().map(|at| (-((y_m - at) / 0.6).powi(2)).exp()).sum();
            let trunk = if stands.clone().any(|at| (y_m - at).abs() < 0.05) { 0.2 } else { 0.0 };
            profile.add_line(y_m, 0.02, 0.02 * crown, trunk);
            profile.add_leaf_area(y_m, y_m + 0.02, 0.1 * crown);
        }
        profile
    }

    #[test]
    fn both_ways_find_every_tree_and_its_borders() {
        for (method, spacing_m) in
            [(CutMethod::Trunk, None), (CutMethod::Valley, None), (CutMethod::Valley, Some(1.8))]
        {
            let trees = row(10, &[]).cut(method, spacing_m);
            assert_eq!(trees.len(), 10, "{method:?} {spacing_m:?}");
            for (i, tree) in trees.iter().enumerate() {
                let from_m = 2.0 * i as f64;
                assert!((tree.y_m - from_m - 1.0).abs() < 0.1, "{method:?} {tree:?}");
                assert!(
                    (tree.y_from_m - from_m).abs() < 0.1 && (tree.y_to_m - from_m - 2.0).abs() < 0.1,
                    "{tree:?}"
                );
                // 5 m² of leaves a tree: 0.1 / 0.02 · ∫ bell.
                assert!(
                    (tree.leaf_area_contact_raw_m2.unwrap() / tree.impacted_total_area_m2 - 5.0).abs() < 0.05,
                    "{tree:?}"
                );
            }
        }
    }

    #[test]
    fn a_missing_tree_is_a_gap_that_no_neighbour_fills() {
        for method in CutMethod::ALL {
            let trees = row(10, &[4]).cut(method, None);
            assert_eq!(trees.len(), 9, "{method:?}");
            assert!(
                (trees[3].y_to_m - 8.0).abs() < 0.15 && (trees[4].y_from_m - 10.0).abs() < 0.15,
                "{trees:?}"
            );
        }
    }

    #[test]
    fn a_row_that_shows_nothing_has_no_trees() {
        for method in CutMethod::ALL {
            assert_eq!(Profile::new(10).cut(method, None), []);
            let mut even = Profile::new(10_000);
            (0..2000).for_each(|i| even.add_line(f64::from(i) * 0.02, 0.02, 0.0, 0.0));
            assert_eq!(even.cut(method, None), []);
        }
    }

    /// Posts midway between two trees, one each so many trees, the first and the last one before and behind the row, too; trees a tenth of the spacing beside
    /// their places, and one that is missing.
    #[test]
    fn posts_between_trees_are_no_trunks_where_the_spacing_is_known() {
        for every in 2..=6 {
            for missing in [None, Some(0), Some(5), Some(7), Some(11)] {
                for ends in [false, true] {
                    let beside = |i: usize| [0.0, 0.1, -0.08, 0.05][i % 4];
                    let trees: Vec<f64> = (0..12)
                        .filter(|i| Some(*i) != missing)
                        .map(|i| 15.0 * (i as f64 + 0.5 + beside(i)))
                        .collect();
                    let posts = (usize::from(!ends)..12).step_by(every).map(|i| 15.0 * i as f64);
                    let posts = posts.filter(|at| ends || *at > 10.0);
                    let mut all: Vec<f64> = trees.iter().copied().chain(posts).collect();
                    all.sort_unstable_by(f64::total_cmp);
                    let case = format!("a post each {every} trees, {missing:?} missing, ends {ends}");
                    let found = without_posts(all.clone(), Some(15.0));
                    assert_eq!(found, trees, "{case}");
                    // Of another spacing, or of none, nothing is taken for a post.
                    assert_eq!(without_posts(all.clone(), None), all, "{case}");
                    assert_eq!(without_posts(trees.clone(), Some(15.0)), trees, "{case}");
                    assert_eq!(without_posts(trees.clone(), Some(30.0)), trees, "{case}");
                    assert_eq!(without_posts(trees.clone(), Some(10.0)), trees, "{case}");
                }
            }
        }
    }

    /// Trunks as a scanner finds them: some are hidden, and posts stand at both ends.
    #[test]
    fn posts_at_the_ends_and_beside_hidden_trunks_are_told() {
        let trees = [0.76, 2.24, 3.71, 5.24, 6.75, 11.25, 12.74, 14.24];
        let mut all = [&trees[..], &[0.05, 4.5, 9.0, 13.5, 14.96]].concat();
        all.sort_unstable_by(f64::total_cmp);
        assert_eq!(without_posts(all.clone(), Some(1.5)), trees);
        assert_eq!(without_posts(all.clone(), Some(3.0)), all);
    }

    #[test]
    fn only_so_many_bins_are_kept() {
        let mut profile = Profile::new(3);
        profile.add_line(0.0, 0.02, 1.0, 0.0);
        profile.add_line(100.0, 0.02, 1.0, 0.0);
        profile.add_line(-5.0, 0.02, 1.0, 0.0);
        assert_eq!(profile.bins.len(), 1);
    }
}
