//! A target leaf area: leaves are thinned out or added until it is reached.

use serde::Serialize;

use crate::generator::draft::Draft;
use crate::growth::prune::Envelope;
use crate::seed::Purpose;
use crate::sower::Sower;

/// How far from the target is good enough, relative.
pub(crate) const TOLERANCE: f64 = 0.01;

/// What was done to reach a leaf area index.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Adjustment {
    /// Leaf area index requested.
    pub target_lai: f64,
    /// Leaf area index of the orchard as it grew.
    pub grown_lai: f64,
    /// Leaf area index of the whole orchard, all rows, as it is.
    pub reached_lai: f64,
    /// Leaves taken away.
    pub leaves_thinned: usize,
    /// Leaves added: copies of the tree's own, turned, on its own thin wood; of a tree with twice its own leaves, on shoots that are added too.
    pub leaves_seeded: usize,
}

/// The target.
pub(crate) struct Goal<'a> {
    pub(crate) lai: f64,
    /// Ground of all places, m².
    pub(crate) ground_m2: f64,
    pub(crate) seed: u64,
    /// What added leaves keep to.
    pub(crate) envelope: Option<&'a Envelope>,
}

/// Why a leaf area cannot be reached.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TargetError {
    /// There is nothing to copy, or nothing to put a copy on.
    #[error(
        "orchard.target_lai {target} cannot be reached: {found} is there, and trees without {lacking} cannot be given leaves; choose \
         another season or generator"
    )]
    Nothing {
        /// The value requested.
        target: f64,
        /// There.
        found: f64,
        /// Leaves to copy, or wood to put them on.
        lacking: &'static str,
    },
    /// Leaves too large, or no room.
    #[error(
        "orchard.target_lai {target} cannot be reached within 1 %: {reached} is the nearest; {}",
        if reached < target { "there is no room for more leaves: ask for less, or take larger trees or leaves" } else { "take smaller leaves, or more trees" }
    )]
    Missed {
        /// The value requested.
        target: f64,
        /// Reached.
        reached: f64,
    },
}

/// Thins or adds leaves until the drafts, each standing `copies` times, come to the goal. `keys` are the rows and numbers of the
/// drafts' random streams.
pub(crate) fn reach(
    drafts: &mut [Draft],
    keys: &[(u32, u32)],
    copies: &[usize],
    goal: &Goal<'_>,
) -> Result<Adjustment, TargetError> {
    let total = |drafts: &[Draft]| -> f64 {
        let areas = drafts.iter().zip(copies).map(|(draft, copies)| draft.leaf_area_m2() * *copies as f64);
        areas.sum()
    };
    let (grown_m2, wanted_m2) = (total(drafts), goal.lai * goal.ground_m2);
    let (thinned, seeded) = if grown_m2 > wanted_m2 {
        (thin(drafts, keys, copies, goal.seed, grown_m2 - wanted_m2), 0)
    } else {
        let short_m2 = wanted_m2 - grown_m2;
        // The sum of nothing is minus zero.
        let found = (grown_m2 / goal.ground_m2).abs();
        let lacking = |lacking| TargetError::Nothing { target: goal.lai, found, lacking };
        (0, sow(drafts, keys, copies, goal, short_m2).map_err(lacking)?)
    };
    let reached_lai = total(drafts) / goal.ground_m2;
    if (reached_lai - goal.lai).abs() > TOLERANCE * goal.lai {
        return Err(TargetError::Missed { target: goal.lai, reached: reached_lai });
    }
    Ok(Adjustment {
        target_lai: goal.lai,
        grown_lai: grown_m2 / goal.ground_m2,
        reached_lai,
        leaves_thinned: thinned,
        leaves_seeded: seeded,
    })
}

/// Takes leaves away, those with the smallest lot of the orchard first, until `surplus_m2` is gone.
fn thin(drafts: &mut [Draft], keys: &[(u32, u32)], copies: &[usize], seed: u64, surplus_m2: f64) -> usize {
    let mut lots: Vec<(f64, usize, usize)> = Vec::new();
    for (number, (draft, (row, tree))) in drafts.iter().zip(keys).enumerate() {
        let mut stream = Purpose::Thinning.stream(seed, *row, *tree);
        lots.extend((0..draft.blades.len()).map(|leaf| (stream.unit(), number, leaf)));
    }
    lots.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut keep: Vec<Vec<bool>> = drafts.iter().map(|draft| vec![true; draft.blades.len()]).collect();
    let mut left_m2 = surplus_m2;
    let mut thinned = 0;
    for (_, number, leaf) in lots {
        let standing = copies.get(number).copied().unwrap_or(0);
        let blade = drafts.get(number).and_then(|draft| draft.blades.get(leaf));
        let area_m2 = blade.map_or(0.0, |blade| blade.leaf.area_m2() * standing as f64);
        // The last leaf goes if that brings the target nearer.
        if left_m2 < 0.5 * area_m2 {
            break;
        }
        left_m2 -= area_m2;
        thinned += standing;
        if let Some(keep) = keep.get_mut(number).and_then(|keep| keep.get_mut(leaf)) {
            *keep = false;
        }
    }
    for (draft, keep) in drafts.iter_mut().zip(keep) {
        draft.retain_blades(keep);
    }
    thinned
}

/// Adds leaves, one a tree in turn, until `short_m2` is there. How many; or what the trees lack.
fn sow(
    drafts: &mut [Draft],
    keys: &[(u32, u32)],
    copies: &[usize],
    goal: &Goal<'_>,
    short_m2: f64,
) -> Result<usize, &'static str> {
    if short_m2 <= 0.0 {
        return Ok(0);
    }
    let mut sowers: Vec<Sower> = Vec::new();
    for (number, (draft, (row, tree))) in drafts.iter().zip(keys).enumerate() {
        let stream = Purpose::Seeding.stream(goal.seed, *row, *tree);
        sowers.extend(Sower::new(number, draft, stream));
    }
    if sowers.is_empty() {
        let bare = drafts.iter().all(|draft| draft.blades.is_empty());
        return Err(if bare { "leaves" } else { "wood that grew here" });
    }
    let mut left_m2 = short_m2;
    let mut seeded = 0;
    while !sowers.is_empty() {
        let mut full = Vec::new();
        for (place, sower) in sowers.iter_mut().enumerate() {
            let standing = copies.get(sower.number()).copied().unwrap_or(0);
            let Some(draft) = drafts.get_mut(sower.number()) else { continue };
            let Some(blade) = sower.next(draft, goal.envelope) else {
                full.push(place);
                continue;
            };
            let area_m2 = blade.leaf.area_m2() * standing as f64;
            if left_m2 < 0.5 * area_m2 {
                return Ok(seeded);
            }
            left_m2 -= area_m2;
            seeded += standing;
            draft.blades.push(blade);
        }
        for place in full.into_iter().rev() {
            sowers.remove(place);
        }
    }
    Ok(seeded)
}
