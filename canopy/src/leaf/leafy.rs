//! How much of what was met is leaf.

use crate::calibration::Calibration;
use crate::class::{ClassKey, RowClass};

/// Share of what was met that is no wood, as far as the calibration and the row's class tell of wood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Leafy {
    pub(crate) share: f64,
    /// Whether the row's class says so: it has more wood than the calibration's rows, or there is no calibration, and wood counts as leaf.
    pub(crate) by_class: bool,
}

impl Leafy {
    /// Of a raw leaf area of so many m² a metre.
    pub(crate) fn of(calibration: Option<&Calibration>, class: Option<&RowClass>, raw_m2_per_m: f64) -> Self {
        let by_calibration = calibration.map_or(1.0, |fitted| fitted.leafy_share(raw_m2_per_m));
        let fitted = calibration.and_then(|fitted| fitted.class.canopy.wood_share);
        let is_more =
            |wood: &f64| fitted.is_none_or(|fitted| wood - fitted > ClassKey::WoodShare.tolerance());
        let by_class = class.and_then(|class| class.canopy.wood_share).filter(is_more);
        match by_class.map(|wood| 1.0 - wood) {
            Some(share) if share < by_calibration => Self { share, by_class: true },
            _ => Self { share: by_calibration, by_class: false },
        }
    }
}
