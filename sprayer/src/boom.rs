//! The boom: sides, sections, nozzles and their valves, as `boom.toml` describes them.

use rowscan_protocol::rig::RowSide;
use rowscan_settings::{TomlError, from_toml};
use serde::{Deserialize, Serialize};

use crate::drops::Drops;
use crate::hydraulics::{Hydraulics, RateTable, Wrong};
use crate::sensors::Sensors;
use crate::span::Span;
use crate::valve::{self, Valve, ValveError};

/// Format of the file.
const VERSION: u32 = 1;
/// The most nozzles of a boom.
const MOST_NOZZLES: usize = 256;

/// The nearest that a nozzle is to the row's axis, metres.
const LEAST_M: f64 = 0.05;

/// A boom: file `boom.toml`. Every number that is left out is an assumption; docs/sprayer.md says which.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Boom {
    /// Format of the file.
    #[schemars(range(min = 1, max = 1), example = 1)]
    pub version: u32,
    /// How far the nozzles are behind the scanners, metres; negative ahead.
    #[serde(default = "two")]
    pub offset_y_m: f64,
    /// From the nozzles across to the axis of the row that they spray, metres.
    #[serde(default = "distance_m")]
    pub distance_m: f64,
    /// Vertical angle of the nozzles' fans where they have none of their own, degrees.
    #[serde(default = "eighty")]
    pub fan_deg: f64,
    /// The same along the row, degrees.
    #[serde(default = "twenty")]
    pub width_deg: f64,
    /// Pressure at the nozzles, bar: constant without `[hydraulics]`, nominal with it. Flow grows with its square root.
    #[serde(default = "ten")]
    pub pressure_bar: f64,
    /// Leaves within so much along the row want spray: the decision strip, metres.
    #[serde(default = "strip_m")]
    pub strip_m: f64,
    /// Gaps shorter than this are sprayed, metres.
    #[serde(default = "join_m")]
    pub join_m: f64,
    /// Below this speed nothing is wanted, m/s.
    #[serde(default = "standstill_m_s")]
    pub standstill_m_s: f64,
    /// Without a command for so long all valves close, seconds; never where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = 4.0)]
    pub watchdog_s: Option<f64>,
    /// What the tank holds at the start, litres; it never runs dry where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = 400.0)]
    pub tank_l: Option<f64>,
    /// Every section's valve that has none of its own.
    #[serde(default)]
    pub valve: Valve,
    /// Pump, hoses and regulating valve; the pressure is constant where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hydraulics: Option<Hydraulics>,
    /// What is wanted of the rate; it is not judged where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<RateTable>,
    /// What its sensors tell on the bus; nothing is told where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sensors: Option<Sensors>,
    /// The drops that its nozzles make; scanners do not see its spray where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drops: Option<Drops>,
    /// The sections.
    #[serde(rename = "section")]
    #[schemars(example = empty())]
    pub sections: Vec<Section>,
    /// Stretches of the rows that must not be sprayed.
    #[serde(default, rename = "no_spray", skip_serializing_if = "Vec::is_empty")]
    pub no_spray: Vec<Zone>,
}

fn two() -> f64 {
    2.0
}

fn ten() -> f64 {
    10.0
}

fn distance_m() -> f64 {
    1.5
}

fn twenty() -> f64 {
    20.0
}

fn strip_m() -> f64 {
    0.02
}

fn join_m() -> f64 {
    0.03
}

fn standstill_m_s() -> f64 {
    0.1
}

fn empty() -> Vec<u8> {
    Vec::new()
}

/// A side of the tractor, in its direction of travel.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// Its left.
    Left,
    /// Its right.
    Right,
}

impl From<RowSide> for Side {
    fn from(row: RowSide) -> Self {
        match row {
            RowSide::Left => Self::Left,
            RowSide::Right => Self::Right,
        }
    }
}

/// Nozzles with one command: table `[[section]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Its name.
    #[schemars(example = &"left-1")]
    pub id: String,
    /// The side it sprays to.
    #[schemars(example = &"left")]
    pub side: Side,
    /// Its number in commands, from 1; its place in the file where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 64), example = 1)]
    pub number: Option<u16>,
    /// Lower end of its share of height, metres.
    #[schemars(example = 0.5)]
    pub z_from_m: f64,
    /// Upper end, metres.
    #[schemars(example = 1.0)]
    pub z_to_m: f64,
    /// Nozzles, evenly over its height; one where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 64), example = 2)]
    pub nozzles: Option<u16>,
    /// Flow of each, l/min.
    #[serde(default = "one")]
    pub flow_l_min: f64,
    /// Pressure at which they have that flow, bar.
    #[serde(default = "ten")]
    pub at_bar: f64,
    /// Its valves, where they differ from the boom's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub valve: Option<Valve>,
    /// Its nozzles one by one, in the place of `nozzles`.
    #[serde(default, rename = "nozzle", skip_serializing_if = "Vec::is_empty")]
    pub each: Vec<NozzleTable>,
}

fn one() -> f64 {
    1.0
}

/// One nozzle: table `[[section.nozzle]]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NozzleTable {
    /// Lower end of its share of height, metres.
    #[schemars(example = 0.5)]
    pub z_from_m: f64,
    /// Upper end, metres.
    #[schemars(example = 0.75)]
    pub z_to_m: f64,
    /// Behind the boom's plane, metres; negative ahead.
    #[serde(default)]
    pub behind_m: f64,
    /// Farther out towards the row than its neighbours, metres.
    #[serde(default)]
    pub out_m: f64,
    /// Where its axis points, degrees above level.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Vertical angle of its fan, degrees; the boom's where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = 80.0)]
    pub fan_deg: Option<f64>,
    /// The same along the row, degrees; the boom's where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = 20.0)]
    pub width_deg: Option<f64>,
    /// Its flow, l/min; the section's where left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(example = 1.0)]
    pub flow_l_min: Option<f64>,
}

fn eighty() -> f64 {
    80.0
}

impl NozzleTable {
    /// A nozzle with this share of height, and all else as where it is left out.
    pub fn between(z_from_m: f64, z_to_m: f64) -> Self {
        Self {
            z_from_m,
            z_to_m,
            behind_m: 0.0,
            out_m: 0.0,
            pitch_deg: 0.0,
            fan_deg: None,
            width_deg: None,
            flow_l_min: None,
        }
    }
}

/// A stretch of the rows: table `[[no_spray]]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Zone {
    /// Its beginning along the rows, metres.
    #[schemars(example = 3.0)]
    pub y_from_m: f64,
    /// Its end, metres.
    #[schemars(example = 5.0)]
    pub y_to_m: f64,
    /// The side of the tractor that it is on; none is both. Of no file.
    #[serde(skip)]
    pub side: Option<Side>,
}

/// A nozzle with everything that its section and boom say of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nozzle {
    /// Its number over the boom, from 0: sections in the file's order.
    pub number: usize,
    /// Its section's place in the file, from 0.
    pub section: usize,
    /// The side it sprays to.
    pub side: Side,
    /// Its share of height, metres.
    pub height: Span,
    /// Ahead of the scanners, metres.
    pub ahead_m: f64,
    /// Full flow, litres a second.
    pub flow_l_s: f64,
    /// Its valve.
    pub valve: Valve,
    /// How what leaves it flies.
    pub jet: Jet,
}

/// How what leaves a nozzle flies: straight, within a fan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// Height of the nozzle, metres: the middle of its share of height.
    pub z_m: f64,
    /// From the nozzle across to the row's axis, metres.
    pub distance_m: f64,
    /// Where its axis points, degrees above level.
    pub pitch_deg: f64,
    /// Vertical angle of the fan, degrees.
    pub fan_deg: f64,
    /// Angle of the fan along the row, degrees.
    pub width_deg: f64,
}

/// Why a boom cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoomError {
    /// The text is refused.
    #[error(transparent)]
    Text(#[from] TomlError),
    /// A number out of its range.
    #[error("`{key}`: expected {expected}, found {found}")]
    Value {
        /// The key.
        key: String,
        /// The values allowed.
        expected: &'static str,
        /// The value found.
        found: String,
    },
    /// A valve.
    #[error("{of}: {cause}")]
    Valve {
        /// Whose.
        of: String,
        /// What is wrong.
        cause: ValveError,
    },
    /// Two of a kind.
    #[error("two sections have the {what} {which}; change one")]
    Twice {
        /// `id` or `number`.
        what: &'static str,
        /// Which.
        which: String,
    },
}

impl Boom {
    /// Reads the text of `boom.toml`.
    ///
    /// # Errors
    /// Unknown keys, keys of another kind of valve, values out of range, two sections of one name or number.
    pub fn read(text: &str) -> Result<Self, BoomError> {
        let boom = from_toml::<Self>(text)?;
        valve::keys::check(text)?;
        boom.settled()
    }

    /// The same, its values checked, with its tank where it is used.
    ///
    /// # Errors
    /// The first value that is wrong.
    pub fn settled(self) -> Result<Self, BoomError> {
        self.validate()?;
        match self.sensors.and_then(|sensors| sensors.tank_l) {
            Some(tank_l) => self.with_tank("sensors.tank_l", tank_l),
            None => Ok(self),
        }
    }

    /// The same with so many litres in its tank, as `key` of a file says.
    ///
    /// # Errors
    /// A tank holds another number of litres, or the boom's own `tank_l` says otherwise: a boom has one tank.
    pub fn with_tank(self, key: &str, tank_l: f64) -> Result<Self, BoomError> {
        match self.tank_l {
            Some(own_l) if own_l != tank_l => {
                let expected = "the litres of the boom's `tank_l`, or only one of the two";
                Err(value_error(key, expected, format!("{tank_l} beside {own_l}")))
            }
            _ => {
                in_tank(key, Some(tank_l))?;
                Ok(Self { tank_l: Some(tank_l), ..self })
            }
        }
    }

    /// Checks all values.
    ///
    /// # Errors
    /// The first that is wrong.
    pub fn validate(&self) -> Result<(), BoomError> {
        let within = |key: &str, value: f64, low: f64, high: f64, expected| {
            (low..=high).contains(&value).then_some(()).ok_or_else(|| value_error(key, expected, value))
        };
        if self.version != VERSION {
            return Err(value_error("version", "1", self.version));
        }
        within("offset_y_m", self.offset_y_m, -20.0, 20.0, "-20 to 20 m")?;
        within("distance_m", self.distance_m, 0.05, 20.0, "0.05 to 20 m")?;
        within("fan_deg", self.fan_deg, 0.0, 170.0, "0 to 170 degrees")?;
        within("width_deg", self.width_deg, 0.0, 170.0, "0 to 170 degrees")?;
        within("pressure_bar", self.pressure_bar, 0.1, 100.0, "0.1 to 100 bar")?;
        within("strip_m", self.strip_m, 0.0, 1.0, "0 to 1 m")?;
        within("join_m", self.join_m, 0.0, 10.0, "0 to 10 m")?;
        within("standstill_m_s", self.standstill_m_s, 0.0, 5.0, "0 to 5 m/s")?;
        within("watchdog_s", self.watchdog_s.unwrap_or(1.0), 0.001, 3600.0, "0.001 to 3600 s")?;
        in_tank("tank_l", self.tank_l)?;
        self.valve.validate().map_err(|cause| BoomError::Valve { of: "`valve`".to_owned(), cause })?;
        self.validate_hydraulics()?;
        if let Some(sensors) = self.sensors {
            let expected = "0.01 to 100000 pulses a litre";
            within("sensors.pulses_per_l", sensors.pulses_per_l, 0.01, 1e5, expected)?;
            in_tank("sensors.tank_l", sensors.tank_l)?;
        }
        if let Some(drops) = self.drops {
            within("drops.drop_um", drops.drop_um, 10.0, 5000.0, "10 to 5000 µm")?;
            within("drops.speed_m_s", drops.speed_m_s, 0.1, 200.0, "0.1 to 200 m/s")?;
        }
        if self.sections.is_empty() {
            return Err(value_error("section", "1 section or more", 0));
        }
        for section in &self.sections {
            section.validate(self.distance_m)?;
        }
        for zone in &self.no_spray {
            let expected = "a number above `y_from_m`";
            (zone.y_to_m > zone.y_from_m)
                .then_some(())
                .ok_or_else(|| value_error("no_spray.y_to_m", expected, zone.y_to_m))?;
        }
        let nozzles: usize = self.sections.iter().map(|section| section.tables().count()).sum();
        if nozzles > MOST_NOZZLES {
            return Err(value_error("section", "256 nozzles or fewer", nozzles));
        }
        let mut numbers: Vec<u16> = self.numbers().collect();
        numbers.sort_unstable();
        let mut ids: Vec<&str> = self.sections.iter().map(|section| section.id.as_str()).collect();
        ids.sort_unstable();
        if let Some(pair) = numbers.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(BoomError::Twice { what: "number", which: pair[0].to_string() });
        }
        match ids.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(BoomError::Twice { what: "id", which: format!("`{}`", pair[0]) }),
            None => Ok(()),
        }
    }

    fn validate_hydraulics(&self) -> Result<(), BoomError> {
        use crate::hydraulics::Regulator;

        let told = |Wrong { key, expected, found }: Wrong| BoomError::Value { key, expected, found };
        self.rate.as_ref().map_or(Ok(()), RateTable::validate).map_err(told)?;
        let Some(hydraulics) = &self.hydraulics else { return Ok(()) };
        hydraulics.validate().map_err(told)?;
        match (hydraulics.regulator, self.rate) {
            (Regulator::Rate, None) => {
                let expected = "a table `[rate]` beside `regulator = \"rate\"`";
                Err(value_error("hydraulics.regulator", expected, "none"))
            }
            _ => Ok(()),
        }
    }

    /// Width that it treats in a pass, metres: an alley serves half of the rows on its sides, and a boom with one side does half of it.
    pub fn swath_m(&self, row_spacing_m: f64) -> f64 {
        let has = |side: Side| self.sections.iter().any(|section| section.side == side);
        let sides = [Side::Left, Side::Right].into_iter().filter(|side| has(*side)).count();
        row_spacing_m / 2.0 * sides as f64
    }

    /// The sections' numbers in commands.
    pub fn numbers(&self) -> impl Iterator<Item = u16> + '_ {
        (1..).zip(&self.sections).map(|(place, section)| section.number.unwrap_or(place))
    }

    /// The place of the section with this number in commands.
    pub fn section(&self, number: u16) -> Option<usize> {
        self.numbers().position(|known| known == number)
    }

    /// Its nozzles, in their order.
    pub fn nozzles(&self) -> Vec<Nozzle> {
        let all = self
            .sections
            .iter()
            .enumerate()
            .flat_map(|(place, section)| section.tables().map(move |table| (place, section, table)));
        all.enumerate()
            .map(|(number, (place, section, table))| {
                let flow_l_min = table.flow_l_min.unwrap_or(section.flow_l_min);
                Nozzle {
                    number,
                    section: place,
                    side: section.side,
                    height: Span::new(table.z_from_m, table.z_to_m),
                    ahead_m: -(self.offset_y_m + table.behind_m),
                    flow_l_s: flow_l_min / 60.0 * (self.pressure_bar / section.at_bar).sqrt(),
                    valve: section.valve.unwrap_or(self.valve),
                    jet: Jet {
                        z_m: table.z_from_m.midpoint(table.z_to_m),
                        distance_m: self.distance_m - table.out_m,
                        pitch_deg: table.pitch_deg,
                        fan_deg: table.fan_deg.unwrap_or(self.fan_deg),
                        width_deg: table.width_deg.unwrap_or(self.width_deg),
                    },
                }
            })
            .collect()
    }
}

/// What a tank may hold, litres, whichever key says it.
fn in_tank(key: &str, tank_l: Option<f64>) -> Result<(), BoomError> {
    match tank_l.filter(|tank_l| !(0.01..=100_000.0).contains(tank_l)) {
        Some(tank_l) => Err(value_error(key, "0.01 to 100000 l", tank_l)),
        None => Ok(()),
    }
}

fn value_error(key: &str, expected: &'static str, found: impl ToString) -> BoomError {
    BoomError::Value { key: key.to_owned(), expected, found: found.to_string() }
}

impl Section {
    /// Its nozzles, one by one.
    fn tables(&self) -> impl Iterator<Item = NozzleTable> + '_ {
        let count = if self.each.is_empty() { self.nozzles.unwrap_or(1) } else { 0 };
        let step_m = (self.z_to_m - self.z_from_m) / f64::from(count.max(1));
        let at = move |place: u16| self.z_from_m + f64::from(place) * step_m;
        let evenly = (0..count).map(move |place| NozzleTable::between(at(place), at(place + 1)));
        evenly.chain(self.each.iter().copied())
    }

    fn validate(&self, distance_m: f64) -> Result<(), BoomError> {
        let key = |key: &str| format!("{key} of section {}", self.id);
        let within = |name: &str, value: f64, low: f64, high: f64, expected| {
            (low..=high)
                .contains(&value)
                .then_some(())
                .ok_or_else(|| value_error(&key(name), expected, value))
        };
        let number = self.number.unwrap_or(1);
        within("number", number.into(), 1.0, 64.0, "1 to 64")?;
        within("nozzles", self.nozzles.unwrap_or(1).into(), 1.0, 64.0, "1 to 64")?;
        within("at_bar", self.at_bar, 0.1, 100.0, "0.1 to 100 bar")?;
        if self.nozzles.is_some() && !self.each.is_empty() {
            return Err(value_error(&key("nozzles"), "either `nozzles` or tables of `nozzle`", "both"));
        }
        within("z_from_m", self.z_from_m, 0.0, 20.0, "0 to 20 m")?;
        if self.z_to_m <= self.z_from_m || self.z_to_m > 20.0 {
            return Err(value_error(&key("z_to_m"), "a number above `z_from_m`, up to 20 m", self.z_to_m));
        }
        for nozzle in self.tables() {
            within(
                "flow_l_min",
                nozzle.flow_l_min.unwrap_or(self.flow_l_min),
                0.001,
                100.0,
                "0.001 to 100 l/min",
            )?;
            within("behind_m", nozzle.behind_m, -20.0, 20.0, "-20 to 20 m")?;
            within("out_m", nozzle.out_m, -20.0, 20.0, "-20 to 20 m")?;
            if distance_m - nozzle.out_m < LEAST_M {
                return Err(value_error(&key("out_m"), "less than the boom's `distance_m`", nozzle.out_m));
            }
            within("pitch_deg", nozzle.pitch_deg, -90.0, 90.0, "-90 to 90 degrees")?;
            let angles = [("fan_deg", nozzle.fan_deg), ("width_deg", nozzle.width_deg)];
            for (name, angle_deg) in angles {
                within(name, angle_deg.unwrap_or(1.0), 0.0, 170.0, "0 to 170 degrees")?;
            }
            within("z_from_m", nozzle.z_from_m, 0.0, 20.0, "0 to 20 m")?;
            if nozzle.z_to_m <= nozzle.z_from_m || nozzle.z_to_m > 20.0 {
                return Err(value_error(
                    &key("nozzle.z_to_m"),
                    "a number above `z_from_m`, up to 20 m",
                    nozzle.z_to_m,
                ));
            }
        }
        let of = format!("section {}", self.id);
        self.valve.map_or(Ok(()), |valve| valve.validate()).map_err(|cause| BoomError::Valve { of, cause })
    }
}

#[cfg(test)]
mod tests;
