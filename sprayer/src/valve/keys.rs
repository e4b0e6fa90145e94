//! Keys of `[valve]` by kind: one that its kind does not have would do nothing, and is refused.

use rowscan_settings::{Table, TomlError, Value, from_toml};
use serde::Deserialize;

use super::Kind;

/// The names of kinds.
const NAMED: [(&str, Kind); 3] =
    [("on_off", Kind::OnOff), ("pwm", Kind::Pwm), ("proportional", Kind::Proportional)];
/// Keys that not every kind has, with those that have them.
const OF_KINDS: [(&str, &[Kind]); 8] = [
    ("rise_ms", &[Kind::OnOff, Kind::Pwm]),
    ("fall_ms", &[Kind::OnOff, Kind::Pwm]),
    ("min_pulse_ms", &[Kind::OnOff, Kind::Pwm]),
    ("hz", &[Kind::Pwm]),
    ("phase", &[Kind::Pwm]),
    ("blended", &[Kind::Pwm]),
    ("tau_s", &[Kind::Proportional]),
    ("least", &[Kind::Proportional]),
];

/// The valves of a boom's file, as they are written.
#[derive(Deserialize)]
struct Written {
    valve: Option<Table>,
    #[serde(default, rename = "section")]
    sections: Vec<WrittenSection>,
}

#[derive(Deserialize)]
struct WrittenSection {
    valve: Option<Table>,
}

/// Checks that every valve in the text of a boom's file has only keys of its kind.
///
/// # Errors
/// The first key of another kind.
pub(crate) fn check(text: &str) -> Result<(), TomlError> {
    let Written { valve, sections } = from_toml(text)?;
    valve.iter().chain(sections.iter().filter_map(|section| section.valve.as_ref())).try_for_each(of_kind)
}

fn of_kind(valve: &Table) -> Result<(), TomlError> {
    let written = match valve.entries.get("kind").map(|found| &found.value) {
        Some(Value::Text(name)) => Some(name.as_str()),
        _ => None,
    };
    let default = Kind::default();
    let kind = NAMED.iter().find(|(name, _)| Some(*name) == written).map_or(default, |(_, kind)| *kind);
    let names = |kinds: &[Kind]| {
        let known = NAMED.iter().filter(|(_, known)| kinds.contains(known));
        known.map(|(name, _)| format!("`kind = \"{name}\"`")).collect::<Vec<_>>().join(" or ")
    };
    for (key, kinds) in OF_KINDS.iter().filter(|(_, kinds)| !kinds.contains(&kind)) {
        let Some(found) = valve.entries.get(*key) else { continue };
        let own = names(&[kind]);
        let left_out = if written.is_none() { ", which holds where `kind` is left out" } else { "" };
        let message = format!(
            "`{key}` of a valve: expected {} beside it, found {own}{left_out}; it would do nothing: leave it out, or change `kind`",
            names(kinds)
        );
        return Err(TomlError { line: found.line, message });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use super::*;
    use crate::Boom;
    use crate::valve::{Phase, Valve};

    /// A key, a value as it is written, and what that changes.
    type Key = (&'static str, &'static str, fn(Valve) -> Valve);

    /// Every key of a valve besides its kind, with a value that is not the default.
    const KEYS: [Key; 10] = [
        ("on_ms", "40", |valve| Valve { on_ms: 40.0, ..valve }),
        ("off_ms", "40", |valve| Valve { off_ms: 40.0, ..valve }),
        ("rise_ms", "30", |valve| Valve { rise_ms: 30.0, ..valve }),
        ("fall_ms", "30", |valve| Valve { fall_ms: 30.0, ..valve }),
        ("min_pulse_ms", "300", |valve| Valve { min_pulse_ms: 300.0, ..valve }),
        ("hz", "7", |valve| Valve { hz: 7.0, ..valve }),
        ("phase", "\"sync\"", |valve| Valve { phase: Phase::Sync, ..valve }),
        ("blended", "true", |valve| Valve { blended: true, ..valve }),
        ("tau_s", "0.2", |valve| Valve { tau_s: 0.2, ..valve }),
        ("least", "0.6", |valve| Valve { least: 0.6, ..valve }),
    ];

    fn written(valve: &str) -> [String; 2] {
        let section = "[[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\n";
        [
            format!("version = 1\n[valve]\n{valve}\n{section}"),
            format!("version = 1\n{section}[section.valve]\n{valve}\n"),
        ]
    }

    /// A key is taken by those kinds whose flow it changes, and refused by name by all others, in either place.
    #[test]
    fn a_key_is_taken_by_the_kinds_that_it_does_something_to() {
        let steps = [(0.1, 0.5), (0.31, 1.0), (0.5, 0.0), (1.0, 0.7), (1.2, 0.0)];
        for (name, kind) in NAMED {
            let plain = Valve { kind, ..Valve::default() };
            for (key, value, changed) in KEYS {
                let flow = |valve: Valve| valve.flow(&steps, (1, 3), 1.0, 3.0);
                let does_something = flow(changed(plain)) != flow(plain);
                for text in written(&format!("kind = \"{name}\"\n{key} = {value}")) {
                    let found = Boom::read(&text).map_err(|error| error.to_string());
                    assert_eq!(found.is_ok(), does_something, "{key} of {name}: {found:?}");
                    let why = found.err().unwrap_or_default();
                    assert!(does_something || why.contains(&format!("`{key}` of a valve")), "{why}");
                    assert!(does_something || why.contains(&format!("found `kind = \"{name}\"`")), "{why}");
                }
            }
        }
    }

    #[test]
    fn kinds_have_the_names_of_the_file_and_a_key_its_line() {
        for (name, kind) in NAMED {
            for text in written(&format!("kind = \"{name}\"")) {
                let boom = Boom::read(&text).expect("sound");
                assert_eq!(boom.nozzles()[0].valve.kind, kind);
            }
        }
        let [text, _] = written("hz = 7");
        let why = Boom::read(&text).expect_err("of another kind").to_string();
        let expected = "line 3: `hz` of a valve: expected `kind = \"pwm\"` beside it, found `kind = \"on_off\"`, which holds where `kind` is left out";
        assert!(why.starts_with(expected), "{why}");
    }
}
