//! A fault's own parameters, checked against its line of the table.

use std::time::Duration;

use crate::{Located, Table, TomlError, Value};

use crate::fault_table::parameter::{Form, Parameter};

/// The parameters that are given.
#[derive(Clone, Copy, Debug)]
pub struct Settings<'a> {
    table: &'a Table,
    parameters: &'static [Parameter],
}

fn wrong(found: &Located, expected: &str) -> TomlError {
    TomlError { line: found.line, message: format!("expected {expected}, found {}", found.value.kind()) }
}

/// A number of either kind.
///
/// # Errors
/// It is something else, or out of range.
pub fn read_number(found: &Located, low: f64, high: f64) -> Result<f64, TomlError> {
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
///
/// # Errors
/// It is something else, or out of range.
pub fn read_whole(found: &Located, low: i64, high: i64) -> Result<i64, TomlError> {
    match found.value {
        Value::Whole(whole) if (low..=high).contains(&whole) => Ok(whole),
        _ => Err(wrong(found, &format!("an integer from {low} to {high}"))),
    }
}

/// A string.
///
/// # Errors
/// It is something else, or out of range.
pub fn read_text<'a>(found: &'a Located, expected: &str) -> Result<&'a str, TomlError> {
    match &found.value {
        Value::Text(text) => Ok(text),
        _ => Err(wrong(found, expected)),
    }
}

impl<'a> Settings<'a> {
    /// What `table` gives of `parameters`.
    pub fn new(table: &'a Table, parameters: &'static [Parameter]) -> Self {
        Self { table, parameters }
    }

    /// What is given under `key`, and what the table says it may be. A key that the table does not have is never given.
    fn given(&self, key: &str) -> Option<(&'a Located, Form)> {
        let parameter = self.parameters.iter().find(|parameter| parameter.key == key)?;
        Some((self.table.entries.get(key)?, parameter.form))
    }

    /// The error of the fault as a whole.
    pub fn refuse(&self, message: impl Into<String>) -> TomlError {
        TomlError { line: self.table.line, message: message.into() }
    }

    /// A number.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn number(&self, key: &str) -> Result<Option<f64>, TomlError> {
        match self.given(key) {
            Some((found, Form::Number(low, high))) => read_number(found, low, high).map(Some),
            Some((found, Form::Strength(low, high))) => match read_number(found, low, high)? {
                0.0 => Err(TomlError {
                    line: found.line,
                    message: format!("expected `{key}` other than 0: nothing would happen"),
                }),
                strength => Ok(Some(strength)),
            },
            _ => Ok(None),
        }
    }

    /// A number that must be given.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn needed(&self, key: &str) -> Result<f64, TomlError> {
        self.number(key)?.ok_or_else(|| self.refuse(format!("the key `{key}` is missing; add it")))
    }

    /// An integer.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn whole(&self, key: &str) -> Result<Option<i64>, TomlError> {
        match self.given(key) {
            Some((found, Form::Whole(low, high))) => read_whole(found, low, high).map(Some),
            _ => Ok(None),
        }
    }

    /// A count, a size or an offset.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn size(&self, key: &str) -> Result<Option<usize>, TomlError> {
        Ok(self.whole(key)?.and_then(|whole| usize::try_from(whole).ok()))
    }

    /// The same as 32 bits.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn count(&self, key: &str, default: u32) -> Result<u32, TomlError> {
        Ok(self.whole(key)?.and_then(|whole| u32::try_from(whole).ok()).unwrap_or(default))
    }

    /// A time in µs.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn micros(&self, key: &str, default: u64) -> Result<Duration, TomlError> {
        let micros = self.whole(key)?.and_then(|whole| u64::try_from(whole).ok()).unwrap_or(default);
        Ok(Duration::from_micros(micros))
    }

    /// One offset, or several.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn sizes(&self, key: &str) -> Result<Option<Vec<usize>>, TomlError> {
        let Some((found, Form::Wholes(low, high))) = self.given(key) else { return Ok(None) };
        let items = match &found.value {
            Value::List(items) => items.as_slice(),
            _ => std::slice::from_ref(found),
        };
        let one =
            |item: &Located| read_whole(item, low, high).map(|whole| usize::try_from(whole).unwrap_or(0));
        items.iter().map(one).collect::<Result<_, _>>().map(Some)
    }

    /// One of the words.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn word(&self, key: &str) -> Result<Option<&'static str>, TomlError> {
        let Some((found, Form::Word(words))) = self.given(key) else { return Ok(None) };
        let given = read_text(found, &format!("one of {}", words.join(", ")))?;
        let known = words.iter().find(|word| **word == given);
        let refuse = || TomlError {
            line: found.line,
            message: format!("unknown value `{given}`{}", crate::suggestion(given, words)),
        };
        known.map(|word| Some(*word)).ok_or_else(refuse)
    }

    /// Bytes.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn hex(&self, key: &str) -> Result<Option<Vec<u8>>, TomlError> {
        let Some((found, Form::Hex)) = self.given(key) else { return Ok(None) };
        let expected = "pairs of hex digits such as \"02 ff\"";
        let digits: String = read_text(found, expected)?.split_whitespace().collect();
        let byte = |pair: &[u8]| {
            let pair =
                std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2 && !pair.starts_with('+'))?;
            u8::from_str_radix(pair, 16).ok()
        };
        let bytes: Option<Vec<u8>> = digits.as_bytes().chunks(2).map(byte).collect();
        bytes.filter(|bytes| !bytes.is_empty()).map(Some).ok_or_else(|| wrong(found, expected))
    }

    /// A switch; off where absent.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn flag(&self, key: &str) -> Result<bool, TomlError> {
        match self.given(key) {
            Some((Located { value: Value::Flag(flag), .. }, Form::Flag)) => Ok(*flag),
            Some((found, Form::Flag)) => Err(wrong(found, "true or false")),
            _ => Ok(false),
        }
    }

    /// A text.
    ///
    /// # Errors
    /// What is given is something else, or empty.
    pub fn text(&self, key: &str) -> Result<Option<&'a str>, TomlError> {
        match self.given(key) {
            Some((found, Form::Text(expected))) => {
                let given = read_text(found, expected)?;
                if given.trim().is_empty() { Err(wrong(found, expected)) } else { Ok(Some(given.trim())) }
            }
            _ => Ok(None),
        }
    }

    /// Two numbers.
    ///
    /// # Errors
    /// What is given is something else.
    pub fn pair(&self, key: &str) -> Result<Option<(f64, f64)>, TomlError> {
        let Some((found, Form::Pair(low, high))) = self.given(key) else { return Ok(None) };
        match &found.value {
            Value::List(items) => match items.as_slice() {
                [one, other] => Ok(Some((read_number(one, low, high)?, read_number(other, low, high)?))),
                _ => Err(wrong(found, "a list of two numbers")),
            },
            _ => Err(wrong(found, "a list of two numbers")),
        }
    }

    /// Pairs of a time and a number, in the order of time.
    ///
    /// # Errors
    /// What is given is something else, or out of order.
    pub fn timed(&self, key: &str) -> Result<Option<Vec<(Duration, f64)>>, TomlError> {
        const EXPECTED: &str = "a list of [ms, number] in the order of time";
        let Some((found, Form::Timed(low, high))) = self.given(key) else { return Ok(None) };
        let Value::List(items) = &found.value else { return Err(wrong(found, EXPECTED)) };
        let mut timed: Vec<(Duration, f64)> = Vec::new();
        for item in items {
            let Value::List(pair) = &item.value else { return Err(wrong(item, EXPECTED)) };
            let [ms, value] = pair.as_slice() else { return Err(wrong(item, EXPECTED)) };
            let at = Duration::from_secs_f64(read_number(ms, 0.0, 3.6e6)? / 1000.0);
            if timed.last().is_some_and(|(before, _)| *before >= at) {
                return Err(wrong(item, EXPECTED));
            }
            timed.push((at, read_number(value, low, high)?));
        }
        Ok(Some(timed).filter(|timed| !timed.is_empty()))
    }
}
