//! The table of faults for whoever makes a form of it.

use rowscan_faults::{FAULTS, Fault, FaultControl, Form, Parameter};
use serde::Serialize;

/// Every fault that can be asked for.
#[derive(Debug, Serialize)]
pub(crate) struct FaultTable {
    faults: Vec<Row>,
    /// What faults may be `on`.
    streams: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Row {
    name: &'static str,
    acts_on: &'static str,
    does: &'static str,
    recovery: &'static str,
    parameters: Vec<Entry>,
}

/// One parameter.
#[derive(Debug, Serialize)]
struct Entry {
    key: &'static str,
    about: &'static str,
    default: &'static str,
    takes: String,
    #[serde(flatten)]
    input: Input,
}

/// What a form shows for it.
#[derive(Debug, Serialize)]
#[serde(tag = "input", rename_all = "snake_case")]
enum Input {
    Number {
        low: f64,
        high: f64,
    },
    Integer {
        low: i64,
        high: i64,
    },
    Choice {
        words: &'static [&'static str],
    },
    Flag,
    Text,
    /// A value as JSON has it: a list.
    Json,
}

impl FaultTable {
    /// All faults, and the streams of this bench.
    pub(crate) fn of(control: &FaultControl) -> Self {
        Self { faults: FAULTS.iter().map(Row::of).collect(), streams: control.streams() }
    }
}

impl Row {
    fn of(fault: &Fault) -> Self {
        Self {
            name: fault.name,
            acts_on: fault.layer.name(),
            does: fault.about,
            recovery: fault.recovery,
            parameters: fault.parameters.iter().map(Entry::of).collect(),
        }
    }
}

impl Entry {
    fn of(parameter: &Parameter) -> Self {
        let Parameter { key, form, default, about } = *parameter;
        let input = match form {
            Form::Number(low, high) | Form::Strength(low, high) => Input::Number { low, high },
            Form::Whole(low, high) => Input::Integer { low, high },
            Form::Word(words) => Input::Choice { words },
            Form::Flag => Input::Flag,
            Form::Hex | Form::Text(_) => Input::Text,
            Form::Wholes(..) | Form::Pair(..) | Form::Timed(..) => Input::Json,
        };
        Self { key, about, default, takes: form.words(), input }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_is_there_with_a_form_for_each_parameter() {
        let rows: Vec<Row> = FAULTS.iter().map(Row::of).collect();
        let told = serde_json::to_value(&rows).unwrap();
        for (fault, row) in FAULTS.iter().zip(told.as_array().unwrap()) {
            assert_eq!(row["name"], fault.name);
            let parameters = row["parameters"].as_array().unwrap();
            assert_eq!(parameters.len(), fault.parameters.len(), "{}", fault.name);
            for parameter in parameters {
                assert!(parameter["input"].is_string() && parameter["key"].is_string(), "{parameter}");
            }
        }
    }
}
