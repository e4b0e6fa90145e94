//! `sprayer = { … }`: the boom, and where its commands are heard.

use std::path::Path;

use rowscan_bus::field::Field;
use rowscan_bus::pgn::sprayer::{
    NOZZLE_DUTY, SPRAYER_CONTROL, nozzle_duties, section_duties, sprayer_control,
};
use rowscan_bus::{CanId, J1939Id};
use rowscan_sprayer::{Boom, Target};
use serde::Deserialize;

use super::client::{ClientSpec, OnLossValue, SectionControlValue};
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
    /// The bus on which its commands are heard: `NozzleDuty`, `SectionDuty`, `MoreSectionDuty` and `SprayerControl` of docs/rowscan.dbc.
    #[schemars(example = &"can0")]
    pub(crate) bus: Option<String>,
    /// Signals of a DBC file that are its commands in their place, `{n}` for the section's number: a duty in %, or 0 and 1.
    #[schemars(example = &"can0:Nozzles.Section{n}")]
    pub(crate) command: Option<String>,
    /// The signal that says how far the regulating valve shall be open, in % or 0 to 1; `SprayerControl.RegulatorOpening` where left out.
    #[schemars(example = &"can0:Rate.Opening")]
    pub(crate) regulator: Option<String>,
    /// The signal that tells the litres which the controller believes it has sprayed; `SprayerControl.ReportedLitres` where left out.
    #[schemars(example = &"can0:Rate.Litres")]
    pub(crate) reported_litres: Option<String>,
    /// The bus on which it is a client of the controller's ISOBUS task controller, in the place of `bus` and `command`; docs/sprayer.md.
    #[schemars(example = &"can0")]
    pub(crate) isobus: Option<String>,
    /// With `isobus`: what sections do when their task controller is lost, `close` [close] or `hold`.
    #[schemars(example = &"hold")]
    pub(crate) on_loss: Option<OnLossValue>,
    /// With `isobus`: section control (DDI 160) at the start, `manual` [manual], so that the task controller has to set it, or `automatic`.
    #[schemars(example = &"automatic")]
    pub(crate) section_control: Option<SectionControlValue>,
    /// With `isobus`: what its tank holds at the start, litres, where the boom's file does not say; it never runs dry where neither does.
    #[schemars(range(min = 0.01, max = 100_000), example = 400.0)]
    pub(crate) tank_l: Option<f64>,
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
    /// The signal that moves the regulating valve.
    regulator: Option<Field>,
    /// The signal that tells the controller's litres.
    reported: Option<Field>,
    /// It is a client of a task controller on this bus.
    pub(crate) client: Option<ClientSpec>,
}

/// The sprayer of a scenario in `folder`.
pub(crate) fn settled(table: SprayerTable, folder: &Path, ways: &Ways<'_>) -> Result<SprayerSpec, String> {
    let path = folder.join(&table.boom);
    let told = |why: &dyn std::fmt::Display| format!("`sprayer.boom`, {}: {why}", path.display());
    let bytes = rowscan_files::read(&path, LARGEST).map_err(|cause| told(&cause))?;
    let text =
        String::from_utf8(bytes).map_err(|_| told(&"expected text, found bytes that are not UTF-8"))?;
    let boom = Boom::read(&text).map_err(|error| told(&error))?;
    let boom = match table.tank_l {
        Some(tank_l) => boom.with_tank("sprayer.tank_l", tank_l).map_err(|error| error.to_string())?,
        None => boom,
    };
    let known: Vec<&str> = ways.buses.iter().map(|(bus, _)| *bus).collect();
    let there = |key: &str, bus: String| match known.contains(&bus.as_str()) {
        true => Ok(bus),
        false => Err(format!(
            "`sprayer.{key}`: there is no bus `{bus}`{}",
            rowscan_settings::suggestion(&bus, &known)
        )),
    };
    if table.isobus.is_none()
        && (table.on_loss.is_some() || table.section_control.is_some() || table.tank_l.is_some())
    {
        return Err(
            "`sprayer`: `on_loss`, `section_control` and `tank_l` are of a client of a task controller; add `isobus`".to_owned()
        );
    }
    if let (Some(_), Some(watchdog_s)) = (&table.isobus, boom.watchdog_s) {
        return Err(format!(
            "`sprayer.isobus`: the boom has `watchdog_s = {watchdog_s}`, and a task controller sends setpoints only when they change: the valves would shut in between; leave \
             `watchdog_s` out of the boom: the client shuts them itself, by `on_loss`, 6 s after the task controller's last status"
        ));
    }
    let heard_on = |bus, client| SprayerSpec {
        boom: boom.clone(),
        bus,
        fields: Vec::new(),
        regulator: None,
        reported: None,
        client,
    };
    let mut spec = match (table.bus, table.command, table.isobus) {
        (None, None, None) => {
            Err("`sprayer`: nothing says where its commands are heard; add `bus`".to_owned())
        }
        (Some(bus), None, None) => Ok(heard_on(there("bus", bus)?, None)),
        (None, Some(name), None) => named(boom.clone(), &name, ways),
        (None, None, Some(bus)) => {
            let client = ClientSpec::new(table.on_loss, table.section_control);
            Ok(heard_on(there("isobus", bus)?, Some(client)))
        }
        (bus, command, _) => {
            let keys = match (bus.is_some(), command.is_some()) {
                (true, true) => "`bus` and `command`",
                (true, false) => "`bus` and `isobus`",
                _ => "`command` and `isobus`",
            };
            Err(format!("`sprayer`: {keys} both say where commands are heard; leave one out"))
        }
    }?;
    let one = |key: &str, name: Option<String>| {
        let Some(name) = name else { return Ok(None) };
        match field(&name, ways).map_err(|why| format!("`sprayer.{key}`: {why}"))? {
            (bus, field) if bus == spec.bus => Ok(Some(field)),
            (bus, _) => Err(format!(
                "`sprayer.{key}`: expected a signal on {}, where commands are heard, found one on {bus}",
                spec.bus
            )),
        }
    };
    (spec.regulator, spec.reported) =
        (one("regulator", table.regulator)?, one("reported_litres", table.reported_litres)?);
    Ok(spec)
}

/// The signal on a bus that is called `name`.
fn field(name: &str, ways: &Ways<'_>) -> Result<(String, Field), String> {
    let keys =
        SignalKeys { name: name.to_owned(), pgn: None, bytes: None, must: crate::signal::Must::default() };
    match Source::resolve(&keys, false, ways)? {
        Source::Field { bus, field } => Ok((bus, *field)),
        _ => Err(format!("expected a signal on a bus, found \"{name}\"")),
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
        let (of, field) =
            field(&name, ways).map_err(|why| format!("`sprayer.command` of section {number}: {why}"))?;
        bus = of;
        fields.push((number, field));
    }
    Ok(SprayerSpec { boom, bus, fields, regulator: None, reported: None, client: None })
}

impl SprayerSpec {
    /// What a message on its bus commands: for whom, and the duty, 0 to 1.
    pub(crate) fn commands(&self, id: CanId, bytes: &[u8]) -> Vec<(Target, f64)> {
        let fits = |field: &&Field| field.address.fits(id) && field.is_in(bytes);
        let opening = match self.regulator.as_ref() {
            Some(field) => Some(field).filter(fits).and_then(|field| duty(field, bytes)),
            None if self.fields.is_empty() && is_ours(id) => sprayer_control(bytes).0,
            None => None,
        };
        let opening = opening.map(|opening| (Target::Regulator, opening));
        // The sections of a task controller's client hear nobody else.
        if self.client.is_some() {
            return opening.into_iter().collect();
        }
        if self.fields.is_empty() {
            return ours(id, bytes).into_iter().chain(opening).collect();
        }
        let fitting = self.fields.iter().filter(|(_, field)| fits(&field));
        let duties =
            fitting.filter_map(|(number, field)| Some((Target::Section(*number), duty(field, bytes)?)));
        duties.chain(opening).collect()
    }

    /// The litres that a message on its bus says the controller believes it has sprayed.
    pub(crate) fn reported_litres(&self, id: CanId, bytes: &[u8]) -> Option<f64> {
        match self.reported.as_ref() {
            Some(field) => (field.address.fits(id) && field.is_in(bytes)).then(|| field.value(bytes))?,
            None if self.fields.is_empty() && is_ours(id) => sprayer_control(bytes).1,
            None => None,
        }
    }
}

fn ours(id: CanId, bytes: &[u8]) -> Vec<(Target, f64)> {
    match J1939Id::of(id).map(|id| id.pgn) {
        Some(pgn) if pgn == NOZZLE_DUTY.pgn => {
            nozzle_duties(bytes).map(|(number, duty)| (Target::Nozzle(number.into()), duty)).collect()
        }
        Some(pgn) => {
            section_duties(pgn, bytes).map(|(number, duty)| (Target::Section(number), duty)).collect()
        }
        None => Vec::new(),
    }
}

/// True of a `SprayerControl`.
fn is_ours(id: CanId) -> bool {
    J1939Id::of(id).is_some_and(|id| id.pgn == SPRAYER_CONTROL.pgn)
}

/// A signal's value as a duty; none where it is neither a share nor a state.
fn duty(field: &Field, bytes: &[u8]) -> Option<f64> {
    let value = field.value(bytes)?;
    let duty = if field.unit == "%" { value / 100.0 } else { value };
    // Of a state of two bits, 2 and 3 are error and not available.
    (0.0..=1.0).contains(&duty).then_some(duty)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use rowscan_bus::pgn::sprayer::{MORE_SECTION_DUTY, SECTION_DUTY};

    use super::*;

    fn spec(folder: &Path, command: Option<&str>) -> Result<SprayerSpec, String> {
        let section =
            |id: &str| format!("[[section]]\nid = \"{id}\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\n");
        let boom = format!("version = 1\n{}{}number = 4\n", section("a"), section("b"));
        std::fs::write(folder.join("boom.toml"), boom).expect("written");
        let bus = command.is_none().then(|| "can0".to_owned());
        let table = SprayerTable {
            boom: "boom.toml".to_owned(),
            bus,
            command: command.map(str::to_owned),
            regulator: None,
            reported_litres: None,
            isobus: None,
            on_loss: None,
            section_control: None,
            tank_l: None,
        };
        let ways = Ways { buses: vec![("can0", None)], nmea: Vec::new(), runs: vec!["sut"] };
        settled(table, folder, &ways)
    }

    #[test]
    fn a_watchdog_of_commands_is_refused_where_they_come_only_on_change() {
        let folder = tempfile::tempdir().expect("a folder");
        let section = "[[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\n";
        let of = |keys: &str, watchdog: &str| {
            std::fs::write(folder.path().join("boom.toml"), format!("version = 1\n{watchdog}\n{section}"))
                .expect("written");
            let table: SprayerTable =
                rowscan_settings::from_toml(&format!("boom = \"boom.toml\"\n{keys} = \"can0\"\n"))
                    .expect("a table");
            let ways = Ways { buses: vec![("can0", None)], nmea: Vec::new(), runs: Vec::new() };
            settled(table, folder.path(), &ways).map(|_| ())
        };
        let why = of("isobus", "watchdog_s = 4").expect_err("it would shut between setpoints");
        assert!(why.contains("`watchdog_s = 4`") && why.contains("leave `watchdog_s` out"), "{why}");
        assert_eq!((of("isobus", ""), of("bus", "watchdog_s = 4")), (Ok(()), Ok(())));
    }

    #[test]
    fn our_messages_name_nozzles_and_sections() {
        let folder = tempfile::tempdir().expect("a folder");
        let spec = spec(folder.path(), None).expect("sound");
        let nozzles = spec.commands(NOZZLE_DUTY.id(0x27).id(), &[3, 250, 255, 0, 255, 255, 255, 255]);
        assert_eq!(nozzles, [(Target::Nozzle(3), 1.0), (Target::Nozzle(5), 0.0)]);
        let sections = spec.commands(SECTION_DUTY.id(0x99).id(), &[255, 125, 255, 255, 255, 255, 255, 250]);
        assert_eq!(sections, [(Target::Section(2), 0.5), (Target::Section(8), 1.0)]);
        let more = spec.commands(MORE_SECTION_DUTY.id(0x99).id(), &[255, 0, 255, 255, 255, 255, 255, 250]);
        assert_eq!(more, [(Target::Section(10), 0.0), (Target::Section(16), 1.0)]);
        assert_eq!(spec.commands(CanId::Extended(0x18FE_4980), &[0; 8]), []);
    }

    #[test]
    fn signals_by_name_are_those_of_the_sections_numbers() {
        let folder = tempfile::tempdir().expect("a folder");
        let spec = |command| spec(folder.path(), Some(command));
        let named = spec("can0:SectionDuty.Section{n}").expect("sound");
        let found = named.commands(SECTION_DUTY.id(0x27).id(), &[250, 250, 250, 25, 255, 255, 255, 255]);
        assert_eq!(
            found,
            [(Target::Section(1), 1.0), (Target::Section(4), 0.1)],
            "there are sections 1 and 4"
        );
        // A group that is not the command's.
        assert_eq!(named.commands(NOZZLE_DUTY.id(0x27).id(), &[0; 8]), []);
        for (command, expected) in [
            ("can0:SectionDuty.Section1", "expected `{n}` for the section's number"),
            ("can0:SectionDuty.Teil{n}", "of section 1: `signal`: expected a message and a signal"),
            ("can1:SectionDuty.Section{n}", "there is no bus, NMEA place or run `can1`"),
        ] {
            let why = spec(command).expect_err(command);
            assert!(why.contains(expected), "{why}");
        }
    }
}
