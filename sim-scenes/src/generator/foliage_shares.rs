//! On what wood leaves stand.

use serde::Serialize;

use super::draft::{Age, Draft};

/// On what wood the leaves of an orchard stand: shares of the leaf area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FoliageShares {
    /// On wood that did not grow in the season.
    pub older_share: f64,
    /// In the rosettes of spurs: short shoots of the season on older wood.
    pub spur_share: f64,
}

impl FoliageShares {
    /// Of drafts that each stand `copies` times; None without leaves, or where one of them stands on wood of unknown age.
    pub(super) fn of(drafts: &[Draft], copies: &[usize]) -> Option<Self> {
        let (mut whole, mut older, mut spurs) = (0.0, 0.0, 0.0);
        for (draft, copies) in drafts.iter().zip(copies) {
            for blade in &draft.blades {
                let area_m2 = blade.leaf.area_m2() * *copies as f64;
                whole += area_m2;
                match draft.segments.get(blade.segment)?.age {
                    Age::Current => {}
                    Age::Spur => spurs += area_m2,
                    Age::Older => older += area_m2,
                    Age::Unknown => return None,
                }
            }
        }
        (whole > 0.0).then(|| Self { older_share: older / whole, spur_share: spurs / whole })
    }
}
