//! What a leaf area holds for: the canopy a calibration was made on, or the one that an estimator without calibration assumes.
//!
//! Known of a row from its description (a scene, an orchard's papers), never from scans or truth. It is compared and told; no number depends
//! on it, but whether one is told: [`Withheld::MostlyWood`](crate::Withheld::MostlyWood).

use serde::Serialize;

use crate::calibration::canopy::CanopyClass;
use crate::calibration::model::{CalibrationClass, Optics};
use crate::footprint::LeafShape;
use rowscan_protocol::rig::BeamWidth;

/// What is known of a row that is scanned.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RowClass {
    /// Training system: an orchard preset's name.
    pub preset: Option<String>,
    /// Its leaves and wood.
    pub canopy: CanopyClass,
}

/// A property by which classes are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ClassKey {
    /// [`CanopyClass::leaf_angle_deg`].
    LeafAngle,
    /// [`CanopyClass::leaf_area_cm2`].
    LeafSize,
    /// [`CanopyClass::season`].
    Season,
    /// [`CanopyClass::generator`].
    Generator,
    /// [`CanopyClass::wood_share`].
    WoodShare,
    /// [`RowClass::preset`].
    TrainingSystem,
    /// How wide the beams are.
    Optics,
    /// From the scanner to the row plane: wide beams meet more rims the farther they go.
    Distance,
    /// Height of the mirror above the ground: wide beams from high above meet the crown's top, and less of its foot.
    Height,
    /// Between lines: few lines a voxel read high.
    LineSpacing,
    /// How deep across the row the crowns are seen: as many leaves in narrower crowns stand closer together, and read lower.
    CrownDepth,
}

impl ClassKey {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::LeafAngle,
        Self::LeafSize,
        Self::Season,
        Self::Generator,
        Self::WoodShare,
        Self::TrainingSystem,
        Self::Optics,
        Self::Distance,
        Self::Height,
        Self::LineSpacing,
        Self::CrownDepth,
    ];

    /// Its name in warnings, studies and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::LeafAngle => "leaf_angle",
            Self::LeafSize => "leaf_size",
            Self::Season => "season",
            Self::Generator => "generator",
            Self::WoodShare => "wood_share",
            Self::TrainingSystem => "training_system",
            Self::Optics => "optics",
            Self::Distance => "distance",
            Self::Height => "height",
            Self::LineSpacing => "line_spacing",
            Self::CrownDepth => "crown_depth",
        }
    }

    /// The key of that name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|key| key.name() == name)
    }

    /// True if its values are numbers, false if they are names.
    pub fn is_number(self) -> bool {
        matches!(
            self,
            Self::LeafAngle
                | Self::LeafSize
                | Self::WoodShare
                | Self::Distance
                | Self::Height
                | Self::LineSpacing
                | Self::CrownDepth
        )
    }

    /// The property as a number: degrees, cm², a share, metres. `None` where it is unknown, and for properties that are names.
    pub fn number(self, canopy: &CanopyClass, geometry: ScanGeometry) -> Option<f64> {
        match self {
            Self::LeafAngle => canopy.leaf_angle_deg,
            Self::LeafSize => canopy.leaf_area_cm2,
            Self::WoodShare => canopy.wood_share,
            Self::Distance => geometry.distance_m,
            Self::Height => geometry.height_m,
            Self::LineSpacing => geometry.line_spacing_m,
            Self::CrownDepth => geometry.crown_depth_m,
            Self::Season | Self::Generator | Self::TrainingSystem | Self::Optics => None,
        }
    }

    /// What the contact frequency takes the property for without calibration: leaves turned any way, no wood. `None` where it assumes nothing.
    pub fn assumed(self) -> Option<f64> {
        match self {
            Self::LeafAngle => Some(SPHERICAL_DEG),
            Self::LeafSize => Some(LeafShape::default().area_m2 * 1e4),
            Self::WoodShare => Some(0.0),
            Self::Distance
            | Self::Height
            | Self::LineSpacing
            | Self::CrownDepth
            | Self::Season
            | Self::Generator
            | Self::TrainingSystem
            | Self::Optics => None,
        }
    }

    /// How far apart two such numbers are: leaf sizes, distances, heights and depths of crowns by the logarithm of their ratio, others by their difference.
    pub fn apart(self, one: f64, other: f64) -> f64 {
        match self {
            Self::LeafSize | Self::Distance | Self::Height | Self::CrownDepth => (one / other).ln().abs(),
            _ => (one - other).abs(),
        }
    }

    /// True if two such numbers count as the same.
    pub(crate) fn is_same(self, one: f64, other: f64) -> bool {
        self.apart(one, other) <= self.tolerance()
    }

    /// Up to which difference two classes count as the same in warnings.
    pub(crate) fn tolerance(self) -> f64 {
        match self {
            Self::LeafAngle => ANGLE_TOLERANCE_DEG,
            Self::WoodShare => WOOD_TOLERANCE,
            Self::LineSpacing => SPACING_TOLERANCE_M,
            _ => RATIO_TOLERANCE.ln(),
        }
    }

    /// Such a number in words.
    fn text(self, value: f64) -> String {
        match self {
            Self::LeafAngle => format!("{value:.0}°"),
            Self::LeafSize => format!("{value:.1} cm²"),
            Self::Distance | Self::Height => format!("{value:.1} m"),
            Self::CrownDepth => format!("{value:.2} m"),
            Self::LineSpacing => format!("{value:.3} m"),
            _ => format!("{:.0} %", 100.0 * value),
        }
    }
}

/// Mean inclination of leaves turned any way, degrees: one radian. G = 0.5 assumes it.
const SPHERICAL_DEG: f64 = 57.295_779_513_082_32;
/// How far a mean inclination may be off, degrees: G(0°) changes by about 3 % over it.
const ANGLE_TOLERANCE_DEG: f64 = 5.0;
/// How many times as large a leaf or a distance may be.
const RATIO_TOLERANCE: f64 = 1.25;
/// How far a share of wood may be off.
const WOOD_TOLERANCE: f64 = 0.03;

/// How much farther apart, or nearer, lines may be, metres: contact changes by about 1.5 % over it.
const SPACING_TOLERANCE_M: f64 = 0.0125;

/// How rows are looked at; `None` where it is not known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScanGeometry {
    /// From the scanner to the row plane, metres.
    pub distance_m: Option<f64>,
    /// Height of the mirror above the ground, metres.
    pub height_m: Option<f64>,
    /// Between lines, metres.
    pub line_spacing_m: Option<f64>,
    /// How deep the crowns are seen, metres ([`Estimate::crown_depth_m`](crate::Estimate::crown_depth_m)).
    pub crown_depth_m: Option<f64>,
}

/// How a row stands against the class that its leaf area holds for, in one property.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Compared {
    pub(crate) key: ClassKey,
    pub(crate) standing: Standing,
    /// How far apart they are, by [`ClassKey::apart`]; `None` where one of them is unknown or they are names.
    pub(crate) apart: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Standing {
    Same,
    Differs {
        expected: String,
        found: String,
    },
    /// The row or the calibration does not say.
    Unknown,
}

/// What a leaf area holds for.
pub(crate) enum Holds<'a> {
    /// A calibration's class.
    For(&'a CalibrationClass),
    /// The assumptions of the contact frequency without calibration.
    Assumptions,
}

/// How the row is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) width: Option<BeamWidth>,
    pub(crate) geometry: ScanGeometry,
    /// The spacing of lines that the voxels' edge was chosen for, metres; `None` where it is not known or the edge is given.
    pub(crate) planned_spacing_m: Option<f64>,
}

impl RowClass {
    /// Compares the row with what a leaf area holds for, in every property that matters to it.
    pub(crate) fn compared(&self, holds: &Holds<'_>, look: Look) -> Vec<Compared> {
        let own = &self.canopy;
        let found = |key: ClassKey| key.number(own, look.geometry);
        match holds {
            Holds::Assumptions => {
                let assumed = [ClassKey::LeafAngle, ClassKey::LeafSize, ClassKey::WoodShare];
                let planned = look.planned_spacing_m.map(|planned_m| {
                    numbers(ClassKey::LineSpacing, Some(planned_m), found(ClassKey::LineSpacing))
                });
                let assumed = assumed.into_iter().map(|key| numbers(key, key.assumed(), found(key)));
                assumed.chain(planned).collect()
            }
            Holds::For(class) => {
                let of = &class.canopy;
                let fitted = ScanGeometry {
                    distance_m: class.distance_m,
                    height_m: class.height_m,
                    line_spacing_m: class.line_spacing_m,
                    crown_depth_m: class.crown_depth_m,
                };
                let numbers = |key: ClassKey| numbers(key, key.number(of, fitted), found(key));
                vec![
                    numbers(ClassKey::LeafAngle),
                    numbers(ClassKey::LeafSize),
                    names(ClassKey::Season, of.season.as_deref(), own.season.as_deref()),
                    names(ClassKey::Generator, of.generator.as_deref(), own.generator.as_deref()),
                    numbers(ClassKey::WoodShare),
                    names(ClassKey::TrainingSystem, Some(&class.preset), self.preset.as_deref()),
                    names(ClassKey::Optics, Some(optics(class.optics)), look.width.map(beams)),
                    numbers(ClassKey::Distance),
                    numbers(ClassKey::Height),
                    numbers(ClassKey::LineSpacing),
                    numbers(ClassKey::CrownDepth),
                ]
            }
        }
    }
}

fn optics(optics: Optics) -> &'static str {
    match optics {
        Optics::Ideal => "ideal",
        Optics::Footprint => "footprint",
        Optics::Measured => "measured",
    }
}

fn beams(width: BeamWidth) -> &'static str {
    match width {
        BeamWidth::Ideal => "ideal",
        BeamWidth::Device => "device",
    }
}

fn numbers(key: ClassKey, expected: Option<f64>, found: Option<f64>) -> Compared {
    let Some((expected, found)) = expected.zip(found) else {
        return Compared { key, standing: Standing::Unknown, apart: None };
    };
    let apart = key.apart(expected, found);
    if !apart.is_finite() {
        return Compared { key, standing: Standing::Unknown, apart: None };
    }
    let standing = if apart <= key.tolerance() {
        Standing::Same
    } else {
        Standing::Differs { expected: key.text(expected), found: key.text(found) }
    };
    Compared { key, standing, apart: Some(apart) }
}

fn names(key: ClassKey, expected: Option<&str>, found: Option<&str>) -> Compared {
    let standing = match expected.zip(found) {
        None => Standing::Unknown,
        // A device's beams are what a calibration with a footprint, or a measured one, was made with.
        Some(("footprint" | "measured", "device")) => Standing::Same,
        Some((expected, found)) if expected == found => Standing::Same,
        Some((expected, found)) => {
            Standing::Differs { expected: expected.to_owned(), found: found.to_owned() }
        }
    };
    Compared { key, standing, apart: None }
}
