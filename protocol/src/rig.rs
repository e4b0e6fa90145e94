//! The rig: where scanners sit on the tractor, how device angles map into the scene frame, how the tractor moves.
//!
//! Scene frame: X across the row from the scanner into the vegetation, Y along the row (travel), Z up; metres; the row
//! axis is X = 0. θ is measured from +X, positive up.

use alloc::string::String;
use alloc::vec::Vec;

use crate::scan::Pose;

mod apart;
mod attitude;
mod remission;
mod roof;
mod version;

pub use crate::echo::EchoChoice;
pub use apart::Apart;
pub use attitude::{Attitude, Axes};
pub use remission::{CardReading, RemissionReading};
pub use roof::Roof;
pub use version::{OLDEST_VERSION, OldRoof, VERSION};

/// A tractor with its scanners. Speed and spacing are what the *estimator believes*; a scene fills them from the truth.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Rig {
    /// Ground speed, m/s.
    pub speed_m_s: f64,
    /// Y of the first scan line, metres.
    pub start_m: f64,
    /// Distance between trees in the row, metres; without it nothing is reported by tree, and LAI is null.
    #[cfg_attr(feature = "schema", schemars(example = 1.5))]
    pub tree_spacing_m: Option<f64>,
    /// Distance between rows, metres; without it LAI is null.
    #[cfg_attr(feature = "schema", schemars(example = 4.0))]
    pub row_spacing_m: Option<f64>,
    /// Trees in the row, if it ends; tree `i` owns y in `[i, i + 1) * tree_spacing_m`.
    #[cfg_attr(feature = "schema", schemars(example = 12))]
    pub trees: Option<u32>,
    /// Returns lower than this above Z = 0 are ground, metres.
    pub ground_clearance_m: f64,
    /// Slope of the ground across the rows, degrees, against the level that the mounts' angles count from: positive where it rises to the tractor's right, as
    /// a scene's towards +X. Rows stand on it, and Z = 0 is where row 0 does: the one on the right, or on the left where a scanner looks left. Level where
    /// left out; a scene's is its ground's.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 6.0))]
    pub ground_slope_deg: Option<f64>,
    /// Ticks a metre of the wheel encoder in the scan telegrams; negative where it counts down driving forward. Without it the advance
    /// is not taken from an encoder.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 1000.0))]
    pub encoder_ticks_per_m: Option<f64>,
    /// Share of the row, 0 to 1, that may lie too far from a valid scan to be filled by it (device error, dirty window, unreadable or lost telegrams, five steps and more in a row) before areas are withheld.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_default_share"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = MAX_EXCLUDED)))]
    pub max_excluded: f64,
    /// How wide the scanners' beams are: taken out of leaf areas where it is known.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = &"ideal"))]
    pub optics: Option<BeamWidth>,
    /// One-sided area of a leaf, cm², for what a wide beam does at its rim; an apple leaf's 24 where left out.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 24.0))]
    pub leaf_area_cm2: Option<f64>,
    /// Share of light that a leaf returns at the scanner's wavelength, square on: at 905 nm an apple leaf's 0.47 where left out. Shares of spots go by it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 0.47))]
    pub leaf_reflectance: Option<f64>,
    /// Standard deviation of `leaf_reflectance`, as it is: widens the interval of a leaf area by shares.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub leaf_reflectance_sd: f64,
    /// Edge of the voxels that densities are measured in, metres; by a rule from beams and leaves where left out.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 0.1))]
    pub voxel_edge_m: Option<f64>,
    /// Calibration class that turns impacted area into leaf area: a shipped calibration's name or a file.
    #[cfg_attr(feature = "schema", schemars(example = &"spindle"))]
    pub calibration: Option<String>,
    /// The scanners, in the order of the emulator's ports.
    #[cfg_attr(feature = "serde", serde(rename = "scanner", deserialize_with = "apart::placed"))]
    pub scanners: Vec<Mount>,
}

/// The share of the row that may have no valid scan where the rig says nothing.
pub const MAX_EXCLUDED: f64 = 0.05;

#[cfg(feature = "serde")]
fn is_default_share(share: &f64) -> bool {
    *share == MAX_EXCLUDED
}

#[cfg(feature = "serde")]
fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

#[cfg(feature = "serde")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

impl Default for Rig {
    fn default() -> Self {
        Self {
            speed_m_s: 1.0,
            start_m: 0.0,
            tree_spacing_m: None,
            row_spacing_m: None,
            trees: None,
            ground_clearance_m: 0.1,
            ground_slope_deg: None,
            encoder_ticks_per_m: None,
            max_excluded: MAX_EXCLUDED,
            optics: None,
            leaf_area_cm2: None,
            leaf_reflectance: None,
            leaf_reflectance_sd: 0.0,
            voxel_edge_m: None,
            calibration: None,
            scanners: alloc::vec![Mount::default()],
        }
    }
}

/// How wide a scanner's beams are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum BeamWidth {
    /// Rays: simulated ones.
    Ideal,
    /// The spot of the scanner's model.
    Device,
}

impl BeamWidth {
    /// Its name in a rig file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Device => "device",
        }
    }
}

/// How one scanner sits on the tractor.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
pub struct Mount {
    /// Scanner model, by the name `rowscan models` lists.
    pub model: String,
    /// Which way device-ahead (90°) points.
    pub orientation: Orientation,
    /// Which way along the drive the roof of the housing looks; turns the sense of the angle. Left out: device angles of a side mount grow upwards
    /// (`backward` where it looks right, `forward` where it looks left), and 0° of an up mount points to the tractor's right (`backward`). In a file of
    /// version 1 it means something else: docs/rigs.md.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = Roof::Backward))]
    pub roof: Option<Roof>,
    /// Which way a layer of positive elevation points. The two public clients of the multiScan read its phi with opposite signs: `up` is SICK's SDK and
    /// guide, `down` sick_scan_xd. Scene and estimate both go by it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Phi::is_up"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = "up")))]
    pub phi: Phi,
    /// The row it looks at.
    pub row: RowSide,
    /// Height of the mirror above Z = 0, metres.
    pub height_m: f64,
    /// Horizontal distance from the mirror to the row axis, metres.
    pub distance_m: f64,
    /// How well `distance_m` is known, standard deviation, metres: widens the interval of a leaf area. A tractor that is driven by hand may need 0.05 to 0.1.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub distance_sd_m: f64,
    /// How far the mirror sits ahead of the tractor's reference point, metres.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub offset_y_m: f64,
    /// Instead of `offset_y_m`: how far the mirror sits ahead of that of the scanner before it in the list, metres; negative behind it.
    // Used up where a file is read: `offset_y_m` has it then.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 0.9))]
    pub ahead_of_previous_m: Option<f64>,
    /// Instead of `height_m`: how far the mirror sits above that of the scanner before it in the list, metres; negative below it.
    // Used up where a file is read: `height_m` has it then.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = 0.9))]
    pub above_previous_m: Option<f64>,
    /// How the scanner is turned from its place square to the row, degrees: how far its beams at the row turn ahead.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub yaw_deg: f64,
    /// How far its top leans back, degrees.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub pitch_deg: f64,
    /// How far its top leans to the row, degrees.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub roll_deg: f64,
    /// Mirror turns a second; the model's own default where absent.
    #[cfg_attr(feature = "schema", schemars(example = 50.0))]
    pub frequency_hz: Option<f64>,
    /// Angle between beams, degrees; the model's own default where absent.
    #[cfg_attr(feature = "schema", schemars(example = 0.5))]
    pub resolution_deg: Option<f64>,
    /// The echo that its scans hold: a live scanner is asked for it. Left out: the first of a live scanner, of a recording the factory setting
    /// where that is the first.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = &"first"))]
    pub echo: Option<EchoChoice>,
    /// How remission tells what share of a spot leaves took: a live scanner is asked for it. Left out: it is not read. `curve = "model"` alone, or
    /// `curve = "card"` with `reflectance`, `digits_a_decade`, `readings` and `power_sd` of a card that was measured.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    #[cfg_attr(feature = "schema", schemars(example = RemissionReading::Model))]
    pub remission: Option<RemissionReading>,
    /// Share of the light that the scanner's window lets through, one way: 1 where it is clean. A card that was read through the same window needs none.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_one"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 1.0)))]
    pub window_transmission: f64,
    /// Standard deviation of `window_transmission`, as it is: widens the interval of a leaf area by shares.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub window_transmission_sd: f64,
    /// Share of the spot that the unit needs for an echo, 0 to 1: 0.06 of an LMS1xx whose fog filter is on; 0 is what is known of factory settings.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub min_share: f64,
    /// Standard deviation of `min_share`, as it is: widens the interval of a leaf area. A unit that nobody has tried may need 0.05 to 0.15.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "is_zero"))]
    #[cfg_attr(feature = "schema", schemars(extend("default" = 0.0)))]
    pub min_share_sd: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self {
            model: String::from("lms111"),
            orientation: Orientation::Side,
            roof: None,
            phi: Phi::Up,
            row: RowSide::Right,
            height_m: 1.6,
            distance_m: 1.9,
            distance_sd_m: 0.0,
            offset_y_m: 0.0,
            ahead_of_previous_m: None,
            above_previous_m: None,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            frequency_hz: None,
            resolution_deg: None,
            echo: None,
            remission: None,
            window_transmission: 1.0,
            window_transmission_sd: 0.0,
            min_share: 0.0,
            min_share_sd: 0.0,
        }
    }
}

/// Which way device-ahead (device angle 90°) points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Orientation {
    /// At the row.
    #[default]
    Side,
    /// At the sky: one scanner sees the rows on both sides.
    Up,
}

/// Which way a layer of positive elevation points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Phi {
    /// To the side of the roof: z = + d sin phi.
    #[default]
    Up,
    /// To the side of the floor: z = − d sin phi.
    Down,
}

#[cfg(feature = "serde")]
impl Phi {
    fn is_up(&self) -> bool {
        *self == Self::Up
    }
}

/// The row that a scanner looks at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum RowSide {
    /// The one on the tractor's right.
    #[default]
    Right,
    /// The one on its left.
    Left,
}

/// No orchard stands on a steeper slope, degrees: what a scene's ground may have.
const STEEPEST_GROUND_DEG: f64 = 45.0;

/// A scan plane that leans more would see along the row, degrees.
const STEEPEST_DEG: f64 = 45.0;

impl Mount {
    /// The mirror's place when the tractor is at `y_m`.
    pub fn pose(&self, y_m: f64) -> Pose {
        Pose { x_m: -self.distance_m, y_m: y_m + self.offset_y_m, z_m: self.height_m }
    }

    /// How it is turned from its place square to the row.
    pub fn attitude(&self) -> Attitude {
        Attitude {
            yaw_rad: self.yaw_deg.to_radians(),
            pitch_rad: self.pitch_deg.to_radians(),
            roll_rad: self.roll_deg.to_radians(),
        }
    }

    /// How far ahead of its mirror the scanner sees what is so far across and up from it, metres; `None` where no beam of its plane goes there.
    pub fn ahead_m(&self, across_m: f64, up_m: f64) -> Option<f64> {
        let Axes { to_row, up, .. } = self.attitude().axes();
        let area = to_row[0] * up[2] - to_row[2] * up[0];
        let (cos, sin) =
            ((across_m * up[2] - up_m * up[0]) / area, (up_m * to_row[0] - across_m * to_row[2]) / area);
        let ahead_m = cos * to_row[1] + sin * up[1];
        ahead_m.is_finite().then_some(ahead_m)
    }

    /// Where the scan plane meets the row's axis, metres ahead of the rig's reference point, at the height of the mirror. A line of an estimate lies there.
    pub fn meets_axis_m(&self) -> f64 {
        self.offset_y_m + self.ahead_m(self.distance_m, 0.0).unwrap_or(0.0)
    }

    /// Refuses a place or an attitude that no scanner has.
    fn validate(&self) -> Result<(), RigError> {
        within("scanner.distance_m", self.distance_m, 0.0, 100.0)?;
        within("scanner.distance_sd_m", self.distance_sd_m, 0.0, 1.0)?;
        within("scanner.height_m", self.height_m, 0.0, 100.0)?;
        within("scanner.frequency_hz", self.frequency_hz.unwrap_or(1.0), 0.1, 1000.0)?;
        within("scanner.resolution_deg", self.resolution_deg.unwrap_or(1.0), 0.001, 10.0)?;
        within("scanner.offset_y_m", self.offset_y_m, -20.0, 20.0)?;
        within("scanner.yaw_deg", self.yaw_deg, -STEEPEST_DEG, STEEPEST_DEG)?;
        within("scanner.pitch_deg", self.pitch_deg, -STEEPEST_DEG, STEEPEST_DEG)?;
        within("scanner.window_transmission", self.window_transmission, 0.05, 1.0)?;
        within("scanner.window_transmission_sd", self.window_transmission_sd, 0.0, 1.0)?;
        within("scanner.min_share", self.min_share, 0.0, 0.5)?;
        within("scanner.min_share_sd", self.min_share_sd, 0.0, 0.5)?;
        within("scanner.roll_deg", self.roll_deg, -180.0, 180.0)
    }
}

impl Rig {
    /// Y of the tractor `travel_s` seconds after its first scan line, metres.
    pub fn y_m(&self, travel_s: f64) -> f64 {
        self.start_m + self.speed_m_s * travel_s
    }

    /// Y of the first line of a scanner's estimate, metres: where its plane meets the row's axis when the tractor starts. The first scanner's where the rig has no
    /// such scanner.
    pub fn first_line_m(&self, scanner: usize) -> f64 {
        let mount = self.scanners.get(scanner).or(self.scanners.first());
        self.start_m + mount.map_or(0.0, Mount::meets_axis_m)
    }

    /// Refuses values that no rig has, and none could be measured with.
    pub fn validate(&self) -> Result<(), RigError> {
        let positive = |key, value: f64| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { Err(RigError::NotPositive { key, value }) }
        };
        if !(self.speed_m_s.is_finite() && self.speed_m_s >= 0.0) {
            return Err(RigError::Negative { key: "speed_m_s", value: self.speed_m_s });
        }
        within("speed_m_s", self.speed_m_s, 0.0, 100.0)?;
        within("start_m", self.start_m, -1e6, 1e6)?;
        within("ground_clearance_m", self.ground_clearance_m, -10.0, 10.0)?;
        let slope_deg = self.ground_slope_deg.unwrap_or(0.0);
        within("ground_slope_deg", slope_deg, -STEEPEST_GROUND_DEG, STEEPEST_GROUND_DEG)?;
        within("tree_spacing_m", self.tree_spacing_m.unwrap_or(1.0), 0.05, 1000.0)?;
        within("row_spacing_m", self.row_spacing_m.unwrap_or(1.0), 0.1, 1000.0)?;
        if let Some(ticks) = self.encoder_ticks_per_m {
            positive("encoder_ticks_per_m", ticks.abs())?;
        }
        if !(0.0..=1.0).contains(&self.max_excluded) {
            return Err(RigError::NoShare { key: "max_excluded", value: self.max_excluded });
        }
        if let Some(area) = self.leaf_area_cm2 {
            positive("leaf_area_cm2", area)?;
        }
        within("leaf_reflectance", self.leaf_reflectance.unwrap_or(0.5), 0.01, 1.0)?;
        within("leaf_reflectance_sd", self.leaf_reflectance_sd, 0.0, 1.0)?;
        if let Some(edge) = self.voxel_edge_m {
            positive("voxel_edge_m", edge)?;
        }
        if self.scanners.is_empty() {
            return Err(RigError::NoScanner);
        }
        for mount in &self.scanners {
            positive("scanner.distance_m", mount.distance_m)?;
            positive("scanner.height_m", mount.height_m)?;
            mount.validate()?;
        }
        Ok(())
    }
}

fn within(key: &'static str, value: f64, low: f64, high: f64) -> Result<(), RigError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(RigError::Outside { key, value, low, high }) }
}

/// Why a rig cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// A length, speed or rate that must be a positive number is not.
    #[error("rig.{key} must be a positive number, found {value}")]
    NotPositive {
        /// The key, below `rig`.
        key: &'static str,
        /// What stands there.
        value: f64,
    },
    /// A speed that must not be negative.
    #[error("rig.{key} must be 0 or more, found {value}")]
    Negative {
        /// The key, below `rig`.
        key: &'static str,
        /// What stands there.
        value: f64,
    },
    /// A share that is none.
    #[error("rig.{key} must be between 0 and 1, found {value}")]
    NoShare {
        /// The key, below `rig`.
        key: &'static str,
        /// What stands there.
        value: f64,
    },
    /// A place or an angle beyond what is supported.
    #[error("rig.{key} must be between {low} and {high}, found {value}")]
    Outside {
        /// The key, below `rig`.
        key: &'static str,
        /// What stands there.
        value: f64,
        /// The least value.
        low: f64,
        /// The greatest.
        high: f64,
    },
    /// A version that this program does not know.
    #[error("version must be {OLDEST_VERSION} or {VERSION}, found {found}")]
    Version {
        /// Found.
        found: u32,
    },
    /// The first scanner has none before it.
    #[error(
        "rig.scanner.{key} counts from the scanner before it in the list, and the first has none; give `{instead}`"
    )]
    NoneBefore {
        /// The key, below `rig.scanner`.
        key: &'static str,
        /// What says it of the first.
        instead: &'static str,
    },
    /// Two keys for one place.
    #[error(
        "rig.scanner.{key} and rig.scanner.{other} both say where the scanner sits; leave one of them out"
    )]
    BothGiven {
        /// One key, below `rig.scanner`.
        key: &'static str,
        /// The other.
        other: &'static str,
    },
    /// A rig without scanners measures nothing.
    #[error("the rig has no scanner; add a [[rig.scanner]] table")]
    NoScanner,
}
