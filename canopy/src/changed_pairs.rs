//! How much changed from scan to scan, by how far apart they are.

/// Distances of pairs that are told apart: none at all, then each √2 times the one before, in lags.
const DISTANCES: usize = 30;
/// The shortest that is told from none, in lags at the rig's speed.
const SHORTEST: f64 = 1.0 / 1024.0;
/// Shares that are told apart.
const SHARES: usize = 25;

/// Pairs by their distance and by the share of their beams that changed.
#[derive(Clone, Debug)]
pub(crate) struct ChangedPairs([[u32; SHARES]; DISTANCES]);

impl Default for ChangedPairs {
    fn default() -> Self {
        Self([[0; SHARES]; DISTANCES])
    }
}

impl ChangedPairs {
    pub(crate) fn add(&mut self, lags: f64, share: f64) {
        let distance = match lags {
            lags if lags > 0.0 => 1 + ((lags / SHORTEST).log2() * 2.0).max(0.0) as usize,
            _ => 0,
        };
        let share = ((share * SHARES as f64) as usize).min(SHARES - 1);
        let row = self.0.get_mut(distance.min(DISTANCES - 1));
        row.and_then(|row| row.get_mut(share)).into_iter().for_each(|pairs| *pairs += 1);
    }

    /// Those from one distance to another, in lags: the middle of each share, and how many pairs have it.
    pub(crate) fn between(&self, least: f64, most: f64) -> impl Iterator<Item = (f64, u32)> + '_ {
        // By the far end of a distance's range: what may lie beyond is none of those.
        let farthest = |distance: usize| match distance {
            0 => 0.0,
            _ => SHORTEST * (distance as f64 / 2.0).exp2(),
        };
        let rows = self.0.iter().enumerate();
        let within = rows.filter(move |(distance, _)| (least..=most).contains(&farthest(*distance)));
        let share = |place: usize| (place as f64 + 0.5) / SHARES as f64;
        within.flat_map(move |(_, row)| {
            row.iter().enumerate().map(move |(place, pairs)| (share(place), *pairs))
        })
    }

    /// How many they are, and the mean of their shares.
    pub(crate) fn mean(found: impl Iterator<Item = (f64, u32)>) -> (u32, f64) {
        let (pairs, sum) =
            found.fold((0, 0.0), |(all, sum), (share, pairs)| (all + pairs, sum + share * f64::from(pairs)));
        (pairs, sum / f64::from(pairs.max(1)))
    }
}
