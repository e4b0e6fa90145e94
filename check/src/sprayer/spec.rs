//! `sprayer = { … }`: the boom, and where its commands are heard.

use std::path::Path;

use rowscan_bus::field::Field;
use rowscan_bus::pgn::sprayer::{NOZZLE_DUTY, SECTION_DUTY, nozzle_duties, section_duties};
use rowscan_bus::{CanId, J1939Id};
use rowscan_sprayer::{Boom, Target};
use serde::Deserialize;

use crate::signal::{SignalKeys, Source, Ways};

/// The largest file of a boom.
const LARGEST: u64 = 1024 * 1024;
/// What stands for a section's number in a signal's name.
const NUMBER: &str = "{n}";

/// `sprayer = { … }`
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SprayerTable {
    /// The file that describes the boom, from this file; docs/sprayer.md has its keys.
    #[schemars(example = &"boom.toml")]
    pub(crate) boom: String,
    /// The bus on which its commands are heard: `NozzleDuty` and `SectionDuty` of docs/rowscan.dbc.
    #[schemars(example = &"can0")]
    pub(crate) bus: Option<String>,
    /// Signals of a DBC file that are its commands in their place, `{n}` for the section's number: a duty in %, or 0 and 1.
    #[schemars(example = &"can0:Nozzles.Section{n}")]
    pub(crate) command: Option<String>,
}

/// A sprayer, its values checked.
#[derive(Clone, Debug)]
pub struct SprayerSpec {
    /// The boom.
    pub boom: Boom,
    /// The bus on which its commands are heard.
    pub bus: String,
    /// The signals that are its commands, by section number; our own messages where there are none.
    fields: Vec<(u16, Field)>,
}

/// The sprayer of a scenario in `folder`.
pub(crate) fn settled(table: SprayerTable, folder: &Path, ways: &Ways<'_>) -> Result<SprayerSpec, String> {
    let path = folder.join(&table.boom);
    let told = |why: &dyn std::fmt::Display| format!("`sprayer.boom`, {}: {why}", path.display());
    let bytes = rowscan_files::read(&path, LARGEST).map_err(|cause| told(&cause))?;
    let text =
        String::from_utf8(bytes).map_err(|_| told(&"expected text, found bytes that are not UTF-8"))?;
    let boom = Boom::read(&text).map_err(|error| told(&error))?;
    let known: Vec<&str> = ways.buses.iter().map(|(bus, _)| *bus).collect();
    match (table.bus, table.command) {
        (Some(_), Some(_)) => {
            Err("`sprayer`: `bus` and `command` both say where commands are heard; leave one out".to_owned())
        }
        (None, None) => Err("`sprayer`: nothing says where its commands are heard; add `bus`".to_owned()),
        (Some(bus), None) if known.contains(&bus.as_str()) => {
            Ok(SprayerSpec { boom, bus, fields: Vec::new() })
        }
        (Some(bus), None) => Err(format!(
            "`sprayer.bus`: there is no bus `{bus}`{}",
            rowscan_strict_toml::suggestion(&bus, &known)
        )),
        (None, Some(name)) => named(boom, &name, ways),
    }
}

/// A sprayer whose sections are told by signals of a DBC file.
fn named(boom: Boom, name: &str, ways: &Ways<'_>) -> Result<SprayerSpec, String> {
    if !name.contains(NUMBER) && boom.sections.len() > 1 {
        return Err(format!(
            "`sprayer.command`: expected `{{n}}` for the section's number, as in \"can0:Nozzles.Section{{n}}\", found \"{name}\""
        ));
    }
    let (mut bus, mut fields) = (String::new(), Vec::new());
    for number in boom.numbers() {
        let name = name.replace(NUMBER, &number.to_string());
        let keys =
            SignalKeys { name: name.clone(), pgn: None, bytes: None, must: crate::signal::Must::default() };
        let told = |why: &str| format!("`sprayer.command` of section {number}: {why}");
        match Source::resolve(&keys, false, ways).map_err(|why| told(&why))? {
            Source::Field { bus: of, field } => {
                bus = of;
                fields.push((number, *field));
            }
            _ => return Err(told(&format!("expected a signal on a bus, found \"{name}\""))),
        }
    }
    Ok(SprayerSpec { boom, bus, fields })
}

impl SprayerSpec {
    /// What a message on its bus commands: for whom, and the duty, 0 to 1.
    pub(crate) fn commands(&self, id: CanId, bytes: &[u8]) -> Vec<(Target, f64)> {
        if self.fields.is_empty() {
            return ours(id, bytes);
        }
        let fitting = self.fields.iter().filter(|(_, field)| field.address.fits(id) && field.is_in(bytes));
        fitting.filter_map(|(number, field)| Some((Target::Section(*number), duty(field, bytes)?))).collect()
    }
}

fn ours(id: CanId, bytes: &[u8]) -> Vec<(Target, f64)> {
    match J1939Id::of(id).map(|id| id.pgn) {
        Some(pgn) if pgn == NOZZLE_DUTY.pgn => {
            nozzle_duties(bytes).map(|(number, duty)| (Target::Nozzle(number.into()), duty)).collect()
        }
        Some(pgn) if pgn == SECTION_DUTY.pgn => {
            section_duties(bytes).map(|(number, duty)| (Target::Section(number), duty)).collect()
        }
        _ => Vec::new(),
    }
}

/// A signal's value as a duty; none where it is neither a share nor a state.
fn duty(field: &Field, bytes: &[u8]) -> Option<f64> {
    let value = field.value(bytes)?;
    let duty = if field.unit == "%" { value / 100.0 } else { value };
    // Of a state of two bits, 2 and 3 are error and not available.
    (0.0..=1.0).contains(&duty).then_some(duty)
}
