//! A fault's own parameters, checked against its line of the table.

use std::time::Duration;

use rowscan_strict_toml::{Located, Table, TomlError, Value};

use crate::parameter::{Form, Parameter};

/// The parameters that are given.
#[derive(Debug)]
pub(crate) struct Settings<'a> {
    pub(crate) table: &'a Table,
    pub(crate) parameters: &'static [Parameter],
}

fn wrong(found: &Located, expected: &str) -> TomlError {
    TomlError { line: found.line, message: format!("expected {expected}, found {}", found.value.kind()) }
}

/// A number of either kind.
pub(crate) fn number(found: &Located, low: f64, high: f64) -> Result<f64, TomlError> {
    let number = match found.value {
        Value::Whole(whole) => whole as f64,
        Value::Number(number) => number,
        _ => return Err(wrong(found, &format!("a number from {low} to {high}"))),
    };
    if (low..=high).contains(&number) {
        return Ok(number);
    }
    Err(wrong(found, &format!("a number from {low} to {high}")))
}

/// An integer.
pub(crate) fn whole(found: &Located, low: i64, high: i64) -> Result<i64, TomlError> {
    match found.value {
        Value::Whole(whole) if (low..=high).contains(&whole) => Ok(whole),
        _ => Err(wrong(found, &format!("an integer from {low} to {high}"))),
    }
}

/// A string.
pub(crate) fn text<'a>(found: &'a Located, expected: &str) -> Result<&'a str, TomlError> {
    match &found.value {
        Value::Text(text) => Ok(text),
        _ => Err(wrong(found, expected)),
    }
}

impl Settings<'_> {
    /// What is given under `key`, and what the table says it may be. A key that the table does not have is never given.
    fn given(&self, key: &str) -> Option<(&Located, Form)> {
        let parameter = self.parameters.iter().find(|parameter| parameter.key == key)?;
        Some((self.table.entries.get(key)?, parameter.form))
    }

    /// The error of the fault as a whole.
    pub(crate) fn refuse(&self, message: impl Into<String>) -> TomlError {
        TomlError { line: self.table.line, message: message.into() }
    }

    pub(crate) fn number(&self, key: &str) -> Result<Option<f64>, TomlError> {
        match self.given(key) {
            Some((found, Form::Number(low, high))) => number(found, low, high).map(Some),
            _ => Ok(None),
        }
    }

    /// A number that must be given.
    pub(crate) fn needed(&self, key: &str) -> Result<f64, TomlError> {
        self.number(key)?.ok_or_else(|| self.refuse(format!("the key `{key}` is missing; add it")))
    }

    pub(crate) fn whole(&self, key: &str) -> Result<Option<i64>, TomlError> {
        match self.given(key) {
            Some((found, Form::Whole(low, high))) => whole(found, low, high).map(Some),
            _ => Ok(None),
        }
    }

    /// A count, a size or an offset.
    pub(crate) fn size(&self, key: &str) -> Result<Option<usize>, TomlError> {
        Ok(self.whole(key)?.and_then(|whole| usize::try_from(whole).ok()))
    }

    /// The same as 32 bits.
    pub(crate) fn count(&self, key: &str, default: u32) -> Result<u32, TomlError> {
        Ok(self.whole(key)?.and_then(|whole| u32::try_from(whole).ok()).unwrap_or(default))
    }

    pub(crate) fn micros(&self, key: &str, default: u64) -> Result<Duration, TomlError> {
        let micros = self.whole(key)?.and_then(|whole| u64::try_from(whole).ok()).unwrap_or(default);
        Ok(Duration::from_micros(micros))
    }

    /// One offset, or several.
    pub(crate) fn sizes(&self, key: &str) -> Result<Option<Vec<usize>>, TomlError> {
        let Some((found, Form::Wholes(low, high))) = self.given(key) else { return Ok(None) };
        let items = match &found.value {
            Value::List(items) => items.as_slice(),
            _ => std::slice::from_ref(found),
        };
        let one = |item: &Located| whole(item, low, high).map(|whole| usize::try_from(whole).unwrap_or(0));
        items.iter().map(one).collect::<Result<_, _>>().map(Some)
    }

    pub(crate) fn word(&self, key: &str) -> Result<Option<&'static str>, TomlError> {
        let Some((found, Form::Word(words))) = self.given(key) else { return Ok(None) };
        let given = text(found, &format!("one of {}", words.join(", ")))?;
        let known = words.iter().find(|word| **word == given);
        let refuse = || TomlError {
            line: found.line,
            message: format!("unknown value `{given}`{}", rowscan_strict_toml::suggestion(given, words)),
        };
        known.map(|word| Some(*word)).ok_or_else(refuse)
    }

    pub(crate) fn hex(&self, key: &str) -> Result<Option<Vec<u8>>, TomlError> {
        let Some((found, Form::Hex)) = self.given(key) else { return Ok(None) };
        let expected = "pairs of hex digits such as \"02 ff\"";
        let digits: String = text(found, expected)?.split_whitespace().collect();
        let byte = |pair: &[u8]| {
            let pair =
                std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2 && !pair.starts_with('+'))?;
            u8::from_str_radix(pair, 16).ok()
        };
        let bytes: Option<Vec<u8>> = digits.as_bytes().chunks(2).map(byte).collect();
        bytes.filter(|bytes| !bytes.is_empty()).map(Some).ok_or_else(|| wrong(found, expected))
    }
}
