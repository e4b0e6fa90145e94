//! How far a leaf area may be off: what the row's own blocks tell, what another class would have told, and both together.

mod between_class;
pub(crate) mod blocks;
mod uneven;

use serde::Serialize;

use crate::class::{ClassKey, Compared, Standing};
use crate::leaf::Count;
use crate::regression::Z95;

pub use between_class::{BetweenClass, between_class};
pub(crate) use blocks::relative_sd;
pub(crate) use uneven::uneven;

/// Relative standard deviations of a leaf area, each from one cause; `None` where it is unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Uncertainty {
    /// Of the row's blocks about their common leaf area per impacted area: what the sampling of beams, leaves and trees makes.
    pub sampling: Option<f64>,
    /// Of classes about the one that the estimate holds for, by the transfer study: the properties that differ from it or are not told. `None`
    /// where nothing is known of the row.
    pub between_class: Option<f64>,
    /// Of rows denser or thinner than all that the calibration was fitted on; without a calibration, of what too few beams reached and was filled. `None` where
    /// nothing is known of the row.
    pub density: Option<f64>,
    /// Not a standard deviation but a shift: the logarithm of the leaf area that the law of the calibration's own rows tells over the one that is told. The
    /// interval reaches from the one to the other, and on either side beyond. `None` where these rows had no larger exponent than is applied.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_law: Option<f64>,
    /// By what an error of the raw leaf area weighs more in the law of the calibration's own rows than in the one that is applied: the ratio of their exponents.
    /// `None` as `own_law`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_law_weighs: Option<f64>,
    /// A shift as well: the logarithm of the leaf area that the law of the calibration tells tree by tree over the one that is told. The interval reaches there,
    /// and beyond. `None` of a law that makes no difference, and where trees are not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub uneven: Option<f64>,
    /// Of the rows that the calibration was fitted on about their own law: rows of one class differ by so much that the scans do not tell. It stands in the
    /// place of `sampling` where it is larger, for it has the sampling of those rows in it. `None` where the calibration does not say, and without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<f64>,
    /// Of the wood that rows of a class have more or less of than its mean, which the calibration takes out; `None` where it takes none out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wood: Option<f64>,
    /// Of the factor of a calibration that was fitted on few rows, or few pieces of a real orchard; `None` elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<f64>,
    /// Of what shares of spots tell, where the leaf area is made of them: how leaves of an echo share its remission, and of a card the power that a full leaf
    /// returns. `None` elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remission: Option<f64>,
    /// Of how well the smallest share of a spot is known that is an echo; `None` where the rig does not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_share: Option<f64>,
    /// Of how well the distance to the row axis is known, by how much of the canopy is hidden; `None` where the rig does not say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<f64>,
    /// Of voxels of another edge than the calibration was fitted in; `None` elsewhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voxels: Option<f64>,
    /// Of two passes as one, by calibrations and a fill rule that know one pass; `None` of one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sides: Option<f64>,
    /// Of a row that is taller, or wider open, than all that the calibration was fitted on: by how much its impacted area a metre lies beyond theirs. `None` of
    /// a row among them, and where the calibration has no such areas.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outline: Option<f64>,
    /// Of a row whose trees stand farther apart than those of the calibration's rows, or nearer; `None` of the same spacing, and where the rig tells none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<f64>,
    /// A shift as well, down: the logarithm of the leaf area without what grows in the alley over the one that is told. `None` where nothing shows there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub growth: Option<f64>,
    /// A shift as well, up: the logarithm of the leaf area that beams which dense leaves stopped may have left unseen over the one that is told. `None` with a
    /// calibration, whose rows hid as much.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unresolved: Option<f64>,
    /// A shift as well, down: the logarithm of the leaf area without what a yaw of the scanner adds over the one that is told. `None` of an upright plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaw: Option<f64>,
    /// Blocks of row that were drawn from.
    pub blocks: u32,
}

/// What the estimator misses where all that it assumes holds: slabs of leaves turned any way, by rays, read up to 2.3 % high.
const SLABS_SD: f64 = 0.015;

/// Relative standard deviation of a leaf area without a calibration, over the share of it that stands in voxels which too few beams reached: such a voxel is
/// filled as its surroundings are. A calibration needs no such term: the rows that it was fitted on have hidden voxels, too.
const BY_FILLED: f64 = 0.3;

/// How much more leaf than is told there may be, as a logarithm over the root of the same share: beams reach the outer leaves of what is dense, and where few voxels
/// are filled they are the densest ones. With this and the next factor the interval holds over seven training systems at LAI 0.2 to 5, by rays and by spots from
/// beside and from above (docs/accuracy.md).
const MORE_BY_FILLED: f64 = 1.3;

/// The same over the optical depth of a voxel: leaves that stand in tufts within it shade each other, the more so the more there are. Small crowns that are full
/// of leaves hide few of the row's voxels, and read low all the same: by rays rows of `paper` of LAI 0.3 to 3 7 to 58 %.
const MORE_BY_DEPTH: f64 = 0.4;

/// How much of a row's leaf area the beams did not resolve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unresolved {
    /// Share of the leaf area in voxels that too few beams reached, by the fill rule.
    pub(crate) filled: f64,
    /// How much leaf a beam meets on its way through one of the other voxels.
    pub(crate) optical_depth: f64,
}

impl Unresolved {
    /// The relative standard deviation of the row's raw leaf area for what was filled.
    pub(crate) fn relative_sd(self) -> f64 {
        combined([SLABS_SD, BY_FILLED * self.filled])
    }

    /// The logarithm of the leaf area that may be there over the one that is told. Both are signs of one error, so the larger one counts.
    pub(crate) fn more(self) -> f64 {
        (MORE_BY_FILLED * self.filled.sqrt()).max(MORE_BY_DEPTH * self.optical_depth)
    }
}

/// What a leaf area differs by where the row axis lies elsewhere, relative a metre and a canopy of which all is hidden: what is hidden is taken for the
/// mirror image of what was seen, about that axis. Root mean square over seven training systems, LAI 0.6 to 5, rays and spots, 0.1 and 0.2 m off: in proportion
/// to what is hidden, 0.3 a metre where that is a tenth and 1.4 where it is six tenths.
const BY_DISTANCE: f64 = 2.4;

/// The relative standard deviation of a leaf area by how well the distance is known, where this share of the canopy is hidden.
pub(crate) fn distance_sd(hidden: f64, distance_sd_m: f64) -> f64 {
    BY_DISTANCE * hidden * distance_sd_m
}

/// What a leaf area by two passes differs from that by one, root mean square over two scenes, three models and both optics (`rowscan study sides`, 20 rows
/// each): what one pass does not see is filled, and calibrations were fitted on rows filled so.
pub(crate) const SIDES_SD: f64 = 0.056;

/// What a row reads too much by, over the logarithm of how far its impacted area a metre lies beyond those of the calibration's rows: spindles of 4.5 m and 7 or
/// 10 years by the calibration of spindles of 3.4 m and 7, LMS111 and LMS511, rays.
const BY_OUTLINE: f64 = 0.6;

/// The relative standard deviation of a leaf area of a row whose impacted area lies so far beyond, as a logarithm.
pub(crate) fn outline_sd(beyond: f64) -> f64 {
    BY_OUTLINE * beyond
}

/// What a row is off by, over the logarithm of its tree spacing over the calibration's: root mean square of spindles 1.0 to 2.0 m apart by the calibration of 1.5 m,
/// LMS111, by rays.
const BY_SPACING: f64 = 0.35;

/// The relative standard deviation of a leaf area of a row whose trees stand so many times as far apart.
pub(crate) fn spacing_sd(ratio: f64) -> f64 {
    BY_SPACING * ratio.ln().abs()
}

/// What a row reads too much by, over the sine of the yaw, where its plane lies across the row: what it meets of one tree and of the next counts in one slice. Spindles
/// and mature trees at ±10° to ±45°, by rays and by an LMS111's spots.
const BY_YAW: f64 = 0.17;

/// The logarithm of a leaf area without what a yaw adds, over that with it.
pub(crate) fn without_yaw(yaw_deg: f64) -> f64 {
    -BY_YAW * yaw_deg.to_radians().sin().abs()
}

/// What a piece of a metre is off by, over the tangent of the yaw: leaves of its neighbours count in it.
const SMEARED: f64 = 0.22;

/// Relative standard deviation of a piece of so many metres, by the yaw; metres times it.
pub(crate) fn smeared_m(yaw_deg: f64) -> f64 {
    SMEARED * yaw_deg.to_radians().tan().abs()
}

/// Share of a leaf area beyond which nothing is left to tell of a row.
const MOST_GROWTH: f64 = 0.95;

/// The logarithm of a raw leaf area without what stands no higher than growth in the alley, over that with it; `share` of it does.
pub(crate) fn without_growth(share: f64) -> f64 {
    (1.0 - share.min(MOST_GROWTH)).ln()
}

/// The relative standard deviation of a product of independent factors, from theirs: the root of the sum of squares. Every cause of error that
/// has a relative standard deviation enters by it.
pub fn combined(relative_sds: impl IntoIterator<Item = f64>) -> f64 {
    relative_sds.into_iter().fold(0.0, |sum, sd| sd.mul_add(sd, sum)).sqrt()
}

/// The 95 % interval of a value that factors of this relative standard deviation scatter: value · exp(∓1.96 sd). Never below 0.
pub fn interval(value: f64, relative_sd: f64) -> [f64; 2] {
    [value * (-Z95 * relative_sd).exp(), value * (Z95 * relative_sd).exp()]
}

/// The 95 % interval of what one law tells or another one, each with an interval of its own: from the lower end of both to the higher one.
pub(crate) fn either(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
}

/// What a property adds to the between-class term; `None` where the study did not measure it.
fn of_property(compared: &Compared, estimator: &str) -> Option<f64> {
    // The voxels lack lines with and without a calibration.
    let estimator = if compared.key == ClassKey::LineSpacing { Count::Hits.name() } else { estimator };
    let is_raw_wood = compared.key == ClassKey::WoodShare && estimator == RAW;
    match (&compared.standing, compared.apart) {
        (Standing::Same, None) => Some(0.0),
        // Wood counts as leaf, and before bud burst all is wood: the study's rows, most of them in full leaf, tell nothing of that.
        (Standing::Unknown, _) if is_raw_wood => None,
        (_, apart) => {
            let sd = between_class(compared.key, estimator, apart)?;
            Some(apart.filter(|_| is_raw_wood).map_or(sd, |share| sd.max(bare_wood_sd(share))))
        }
    }
}

/// The estimator of a row without calibration.
pub(crate) const RAW: &str = "contact_raw";
/// Beyond this a leaf area says nothing.
const NOTHING_KNOWN: f64 = 3.0;

/// What wood that counts as leaf makes of a raw leaf area, where so much of all surface is wood. Leaves hide it where they are many: over five training
/// systems from bare to full leaf the logarithm of estimate over truth was half to all of the 1.5th power of wood over leaf, by rays and by spots.
fn bare_wood_sd(share: f64) -> f64 {
    let share = share.clamp(0.0, 1.0);
    (share / (1.0 - share)).powf(1.5).min(NOTHING_KNOWN)
}

/// The between-class term of a row: every property in which it differs from the class, or of which one of them says nothing, by the study's
/// table. `None` if the table lacks one of them: then there is no interval.
pub(crate) fn term(compared: &[Compared], estimator: &str) -> Option<f64> {
    let sds: Option<Vec<f64>> = compared.iter().map(|compared| of_property(compared, estimator)).collect();
    sds.map(combined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn independent_factors_add_by_squares_and_intervals_are_positive() {
        assert!((combined([0.03, 0.04]) - 0.05).abs() < 1e-12);
        assert_eq!(combined([]), 0.0);
        let [low, high] = interval(10.0, 2.0);
        assert!(low > 0.0 && (low * high - 100.0).abs() < 1e-9);
        // The one law's whole interval and the other's, whichever is wider.
        for (other, expected) in
            [([8.0, 9.5], [8.0, 11.0]), ([10.5, 12.0], [9.0, 12.0]), ([8.0, 12.0], [8.0, 12.0])]
        {
            assert_eq!(either([9.0, 11.0], other), expected);
            assert_eq!(either(other, [9.0, 11.0]), expected);
        }
        // 95 % of a normal law lie within 1.96 standard deviations.
        assert!((interval(1.0, 0.1)[1].ln() - 0.195_996).abs() < 1e-5);
    }

    #[test]
    fn what_no_beam_reached_may_be_more_and_hardly_less() {
        // A spindle of LAI 5 by rays, rows of `paper` of LAI 0.3 and 3 by rays, and of 2 through an eye: by so much they read low, as a logarithm.
        for (filled, optical_depth, low) in
            [(0.32, 1.18, 0.22), (0.08, 0.73, 0.35), (0.45, 1.55, 0.88), (0.59, 1.6, 1.13)]
        {
            let row = Unresolved { filled, optical_depth };
            let up = row.more() + Z95 * combined([row.relative_sd(), 0.08]);
            assert!(up > low, "{row:?}: {up}");
            assert!(row.relative_sd() < 0.2 * low.max(1.0), "{row:?}");
        }
        // What every beam passes is told.
        let seen = Unresolved { filled: 0.0, optical_depth: 0.05 };
        assert!(seen.more() < 0.03 && seen.relative_sd() < 0.02);
    }

    #[test]
    fn wood_that_no_leaf_hides_widens_a_raw_leaf_area_until_nothing_is_known() {
        let of_wood = |share: f64, estimator: &str| {
            let standing = Standing::Differs { expected: "0 %".into(), found: format!("{share}") };
            let compared = Compared { key: ClassKey::WoodShare, standing, apart: Some(share) };
            term(&[compared], estimator).unwrap()
        };
        // In full leaf about the study's; at leaf fall a fifth is wood; a bare row is wood alone.
        assert!(of_wood(0.12, RAW) < 0.06);
        for (share, at_least) in [(0.21, 0.13), (0.41, 0.5), (0.9, NOTHING_KNOWN), (1.0, NOTHING_KNOWN)] {
            let found = of_wood(share, RAW);
            assert!(found >= at_least && found.is_finite(), "{share}: {found}");
        }
        // Of a share that is not told nothing is known.
        let untold = Compared { key: ClassKey::WoodShare, standing: Standing::Unknown, apart: None };
        assert_eq!(term(std::slice::from_ref(&untold), RAW), None);
        assert!(term(&[untold], "contact").is_some_and(|sd| sd < 0.1));
        // A calibration holds the wood of its own rows.
        assert!(of_wood(0.41, "contact") < 0.5);
    }

    #[test]
    fn a_property_that_is_not_told_widens_as_much_as_the_studys_classes_differ() {
        let with = |standing, apart| [Compared { key: ClassKey::LeafAngle, standing, apart }];
        let differs = || Standing::Differs { expected: "57°".into(), found: "30°".into() };
        assert_eq!(term(&with(Standing::Same, Some(0.0)), "contact"), Some(0.0));
        let unknown = term(&with(Standing::Unknown, None), "contact").unwrap();
        let near = term(&with(Standing::Same, Some(3.0)), "contact").unwrap();
        let far = term(&with(differs(), Some(27.0)), "contact").unwrap();
        assert!(0.0 < near && near < unknown && (far / near - 9.0).abs() < 1e-9, "{near} {unknown} {far}");
        assert_eq!(term(&with(Standing::Unknown, None), "no such estimator"), None);
    }

    #[test]
    fn names_are_the_same_or_they_are_not() {
        let with = |standing| [Compared { key: ClassKey::Season, standing, apart: None }];
        let differs = Standing::Differs { expected: "full_leaf".into(), found: "bloom".into() };
        assert_eq!(term(&with(Standing::Same), "contact"), Some(0.0));
        assert_eq!(term(&with(differs), "contact"), term(&with(Standing::Unknown), "contact"));
    }
}
