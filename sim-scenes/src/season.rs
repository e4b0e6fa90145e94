//! The season: how many of a tree's leaves are out, and how large they are.

use crate::generator::draft::Blade;
use crate::parameters::choices;
use crate::seed::Stream;

choices! {
    /// Stage of the year, after the principal stages of the BBCH scale for pome fruit.
    pub enum Season {
        /// BBCH 00: no leaf.
        Dormant = "dormant",
        /// BBCH 09: green tips; a tenth of the leaves at a tenth of their length.
        BudBurst = "bud_burst",
        /// BBCH 15: leaves unfolding; half of them, at a third of their length.
        Unfolding = "unfolding",
        /// BBCH 65: full bloom; three quarters of the leaves, at half their length.
        Bloom = "bloom",
        /// BBCH 72: fruit as large as hazelnuts; nine tenths, at eight tenths of their length.
        FruitSet = "fruit_set",
        /// BBCH 79: all leaves, full size.
        FullLeaf = "full_leaf",
        /// BBCH 95: half of the leaves have fallen.
        LeafFall = "leaf_fall",
    }
}

impl Season {
    /// Share of the leaves that are out.
    ///
    /// Round figures of ours: they order the stages from bare to full; no source measures them for a tree of this kind.
    pub fn share(self) -> f64 {
        match self {
            Self::Dormant => 0.0,
            Self::BudBurst => 0.1,
            Self::Unfolding | Self::LeafFall => 0.5,
            Self::Bloom => 0.75,
            Self::FruitSet => 0.9,
            Self::FullLeaf => 1.0,
        }
    }

    /// Length and width of those leaves over their full size.
    pub fn size(self) -> f64 {
        match self {
            Self::Dormant | Self::BudBurst => 0.1,
            Self::Unfolding => 0.33,
            Self::Bloom => 0.5,
            Self::FruitSet => 0.8,
            Self::FullLeaf | Self::LeafFall => 1.0,
        }
    }
}

/// Leaves only what is out, at its size. A leaf keeps its lot: what is out early is out later too, and falls last.
pub(crate) fn dress(blades: &mut Vec<Blade>, season: Season, stream: &mut Stream) {
    if season == Season::FullLeaf {
        return;
    }
    blades.retain(|_| stream.unit() < season.share());
    if season.size() < 1.0 {
        for blade in blades {
            // A leaf that shrinks below what has an area keeps its size.
            if let Ok(smaller) = blade.leaf.scaled(season.size()) {
                blade.leaf = smaller;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::organ::Leaf;
    use crate::seed::Purpose;

    fn dressed(season: Season) -> Vec<Blade> {
        let leaf = |i: f64| Leaf::new([[i, 0.0, 0.0], [i + 0.1, 0.0, 0.0], [i, 0.1, 0.0]]).unwrap();
        let blade = |i: u32| Blade { segment: 0, along_m: 0.0, leaf: leaf(f64::from(i)), petiole: None };
        let mut blades: Vec<Blade> = (0..2000).map(blade).collect();
        dress(&mut blades, season, &mut Purpose::Season.stream(1, 0, 0));
        blades
    }

    #[test]
    fn leaf_area_rises_from_nothing_to_full_and_falls() {
        let area = |season| dressed(season).iter().map(|blade| blade.leaf.area_m2()).sum::<f64>();
        let areas: Vec<f64> = Season::ALL.iter().map(|season| area(*season)).collect();
        assert_eq!(areas[0], 0.0);
        assert!(areas[..6].windows(2).all(|pair| pair[0] < pair[1]), "{areas:?}");
        assert!((areas[5] - 10.0).abs() < 1e-9 && (areas[6] / areas[5] - 0.5).abs() < 0.05);
        let expected = Season::Bloom.share() * Season::Bloom.size() * Season::Bloom.size();
        assert!((areas[3] / areas[5] - expected).abs() < 0.03);
    }

    #[test]
    fn what_is_out_early_is_out_later() {
        let feet = |season| -> Vec<u64> {
            dressed(season).iter().map(|blade| blade.leaf.outline()[0][0].to_bits()).collect()
        };
        let (early, late) = (feet(Season::BudBurst), feet(Season::Bloom));
        assert!(early.len() > 100 && early.iter().all(|foot| late.contains(foot)));
    }
}
