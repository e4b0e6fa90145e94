//! What a leaf area holds for: the canopy a calibration was made on, or the one that an estimator without calibration assumes.
//!
//! Known of a row from its description (a scene, an orchard's papers), never from scans or truth. It is compared and told; no estimate depends
//! on it.

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
}

impl ClassKey {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::LeafAngle,
        Self::LeafSize,
        Self::Season,
        Self::Generator,
        Self::WoodShare,
        Self::TrainingSystem,
        Self::Optics,
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
        }
    }

    /// The key of that name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|key| key.name() == name)
    }
}

/// Mean inclination of leaves turned any way, degrees: one radian. G = 0.5 assumes it.
const SPHERICAL_DEG: f64 = 57.295_779_513_082_32;
/// How far a mean inclination may be off, degrees: G(0°) changes by about 3 % over it.
const ANGLE_TOLERANCE_DEG: f64 = 5.0;
/// How far a leaf's area may be off, relative.
const LEAF_AREA_TOLERANCE: f64 = 0.2;
/// How far a share of wood may be off.
const WOOD_TOLERANCE: f64 = 0.03;

/// How a row stands against the class that its leaf area holds for, in one property.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Compared {
    pub(crate) key: ClassKey,
    pub(crate) standing: Standing,
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
    /// The assumptions of the contact frequency without calibration: leaves turned any way, no wood; of other things it assumes nothing.
    Assumptions,
}

impl RowClass {
    /// Compares the row with what a leaf area holds for, in every property that matters to it. `width` is what the rig says of the beams.
    pub(crate) fn compared(&self, holds: &Holds<'_>, width: Option<BeamWidth>) -> Vec<Compared> {
        let own = &self.canopy;
        match holds {
            Holds::Assumptions => {
                let leaf_cm2 = LeafShape::default().area_m2 * 1e4;
                vec![
                    numbers(
                        ClassKey::LeafAngle,
                        Some(SPHERICAL_DEG),
                        own.leaf_angle_deg,
                        ANGLE_TOLERANCE_DEG,
                    ),
                    numbers(
                        ClassKey::LeafSize,
                        Some(leaf_cm2),
                        own.leaf_area_cm2,
                        LEAF_AREA_TOLERANCE * leaf_cm2,
                    ),
                    numbers(ClassKey::WoodShare, Some(0.0), own.wood_share, WOOD_TOLERANCE),
                ]
            }
            Holds::For(class) => {
                let of = &class.canopy;
                let leaf_cm2 = of.leaf_area_cm2.unwrap_or_default();
                vec![
                    numbers(ClassKey::LeafAngle, of.leaf_angle_deg, own.leaf_angle_deg, ANGLE_TOLERANCE_DEG),
                    numbers(
                        ClassKey::LeafSize,
                        of.leaf_area_cm2,
                        own.leaf_area_cm2,
                        LEAF_AREA_TOLERANCE * leaf_cm2,
                    ),
                    names(ClassKey::Season, of.season.as_deref(), own.season.as_deref()),
                    names(ClassKey::Generator, of.generator.as_deref(), own.generator.as_deref()),
                    numbers(ClassKey::WoodShare, of.wood_share, own.wood_share, WOOD_TOLERANCE),
                    names(ClassKey::TrainingSystem, Some(&class.preset), self.preset.as_deref()),
                    names(ClassKey::Optics, Some(optics(class.optics)), width.map(beams)),
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

fn numbers(key: ClassKey, expected: Option<f64>, found: Option<f64>, tolerance: f64) -> Compared {
    let standing = match expected.zip(found) {
        None => Standing::Unknown,
        Some((expected, found)) if (found - expected).abs() <= tolerance => Standing::Same,
        Some((expected, found)) => {
            let text = |value: f64| match key {
                ClassKey::LeafAngle => format!("{value:.0}°"),
                ClassKey::LeafSize => format!("{value:.1} cm²"),
                _ => format!("{:.0} %", 100.0 * value),
            };
            Standing::Differs { expected: text(expected), found: text(found) }
        }
    };
    Compared { key, standing }
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
    Compared { key, standing }
}
