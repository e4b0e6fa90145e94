//! The transcripts' file format.
//!
//! Head: `client NAME`, `models NAME…`, `dialects A B`, `device A` (strict; else automatic, and strict in each dialect), `longest BYTES` of a
//! reply, `trailing NUL` after every frame. Then, in order:
//! - `REQUEST => REPLY`: one request, one reply. Both are `text | hex`: the whole telegram in CoLa A, and the argument bytes in CoLa B,
//!   where the name comes from the text. `*` is any token or byte, `**` any rest, a lone `?` any answer about that name or an `sFA`, and
//!   `silence` none. `{000..029}` repeats the line with each number.
//! - `every PERIOD for LIMIT: REQUEST => REPLY`: asked until the reply fits.
//! - `scans N of CHANNELS`, `poll N of CHANNELS`: scan telegrams, by event or asked for; `RSSI1:8` is an 8-bit channel, `ENC` an encoder.
//! - `wait TIME`, `within TIME` (for every reply from here on), `reconnect`, `in A`.
//! - `A:` or `B:` before any of them: in that dialect only.
#![allow(unreachable_pub, reason = "a part of a test")]

use std::time::Duration;

use rowscan_protocol::frame::Dialect;

/// One client's conversation.
#[derive(Debug, Default)]
pub struct Script {
    pub client: String,
    pub models: Vec<String>,
    pub dialects: Vec<Dialect>,
    /// The scanner is set to one dialect and silent in the other.
    pub device: Option<Dialect>,
    pub longest_reply: Option<usize>,
    pub trailing_nul: bool,
    pub steps: Vec<(Option<Dialect>, Step)>,
}

#[derive(Clone, Debug)]
pub enum Step {
    Ask(Exchange),
    Until { every: Duration, limit: Duration, ask: Exchange },
    Scans { count: usize, channels: Vec<String>, poll: bool },
    Wait(Duration),
    Within(Duration),
    Reconnect,
    In(Dialect),
}

/// A request and what must come back.
#[derive(Clone, Debug)]
pub struct Exchange {
    pub text: String,
    pub hex: String,
    pub reply: Expected,
}

#[derive(Clone, Debug)]
pub enum Expected {
    Silence,
    Any,
    Like { text: String, hex: String },
}

impl Script {
    pub fn parse(source: &str) -> Self {
        let mut script = Self::default();
        for line in source.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(';')) {
            script.line(line);
        }
        assert!(!script.models.is_empty() && !script.dialects.is_empty() && !script.client.is_empty());
        script
    }

    fn line(&mut self, line: &str) {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match word {
            "client" => self.client = rest.to_owned(),
            "models" => self.models = rest.split_whitespace().map(str::to_owned).collect(),
            "dialects" => self.dialects = rest.split_whitespace().map(dialect).collect(),
            "device" => self.device = Some(dialect(rest)),
            "longest" => self.longest_reply = Some(rest.parse().expect("a length")),
            "trailing" => self.trailing_nul = rest == "NUL",
            "A:" => self.steps(Some(Dialect::A), rest),
            "B:" => self.steps(Some(Dialect::B), rest),
            _ => self.steps(None, line),
        }
    }

    fn steps(&mut self, only: Option<Dialect>, line: &str) {
        let Some((before, range)) = line.split_once('{') else {
            self.steps.push((only, step(line)));
            return;
        };
        let (range, after) = range.split_once('}').expect("a closing brace");
        let (first, last) = range.split_once("..").expect("a range");
        let number = |text: &str| text.parse::<u32>().expect("a number");
        for n in number(first)..=number(last) {
            self.steps.push((only, step(&format!("{before}{n:0width$}{after}", width = first.len()))));
        }
    }
}

fn dialect(name: &str) -> Dialect {
    match name {
        "A" => Dialect::A,
        "B" => Dialect::B,
        other => panic!("no dialect {other}"),
    }
}

fn duration(text: &str) -> Duration {
    let (number, unit) = text.split_once(' ').unwrap_or_else(|| panic!("no duration: {text}"));
    let number = number.parse().unwrap_or_else(|_| panic!("no number: {text}"));
    match unit {
        "ms" => Duration::from_millis(number),
        "s" => Duration::from_secs(number),
        other => panic!("no unit {other}"),
    }
}

fn step(line: &str) -> Step {
    if let Some((request, reply)) = line.split_once(" => ") {
        if let Some(rest) = request.strip_prefix("every ") {
            let (times, request) = rest.split_once(": ").expect("a colon");
            let (every, limit) = times.split_once(" for ").expect("a limit");
            return Step::Until {
                every: duration(every),
                limit: duration(limit),
                ask: exchange(request, reply),
            };
        }
        return Step::Ask(exchange(request, reply));
    }
    let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
    let rest = rest.trim();
    match word {
        "scans" | "poll" => {
            let (count, channels) = rest.split_once(" of ").unwrap_or((rest, ""));
            Step::Scans {
                count: count.parse().expect("a count"),
                channels: channels.split_whitespace().map(str::to_owned).collect(),
                poll: word == "poll",
            }
        }
        "wait" => Step::Wait(duration(rest)),
        "within" => Step::Within(duration(rest)),
        "reconnect" => Step::Reconnect,
        "in" => Step::In(dialect(rest)),
        _ => panic!("no step: {line}"),
    }
}

fn exchange(request: &str, reply: &str) -> Exchange {
    let halves = |line: &str| {
        let (text, hex) = line.split_once(" | ").unwrap_or((line, ""));
        (text.trim().to_owned(), hex.trim().to_owned())
    };
    let (text, hex) = halves(request);
    let reply = match reply {
        "silence" => Expected::Silence,
        "?" => Expected::Any,
        other => {
            let (text, hex) = halves(other);
            Expected::Like { text, hex }
        }
    };
    Exchange { text, hex, reply }
}

/// `sXX name` of a telegram.
fn command(text: &str) -> String {
    text.split(' ').take(2).collect::<Vec<_>>().join(" ")
}

impl Exchange {
    /// The request's payload.
    pub fn payload(&self, dialect: Dialect) -> Vec<u8> {
        let hex = |word: &str| u8::from_str_radix(word, 16).unwrap_or_else(|_| panic!("no byte: {word}"));
        match dialect {
            Dialect::A => self.text.clone().into_bytes(),
            Dialect::B if self.hex.is_empty() => command(&self.text).into_bytes(),
            Dialect::B => {
                let mut payload = (command(&self.text) + " ").into_bytes();
                payload.extend(self.hex.split(' ').map(hex));
                payload
            }
        }
    }

    /// True if the reply's payload has the shape that the client waits for.
    pub fn accepts(&self, dialect: Dialect, payload: &[u8]) -> bool {
        match &self.reply {
            Expected::Silence => false,
            Expected::Any => {
                let name = self.text.split(' ').nth(1).unwrap_or_default();
                let about = |kind: &str| payload.starts_with(format!("{kind} {name}").as_bytes());
                payload.starts_with(b"sFA") || ["sRA", "sWA", "sAN", "sEA"].into_iter().any(about)
            }
            Expected::Like { text, .. } if dialect == Dialect::A => {
                let found = String::from_utf8_lossy(payload).into_owned();
                fits(text.split(' '), found.split(' '))
            }
            Expected::Like { text, hex } => {
                let Some(rest) = payload.strip_prefix(command(text).as_bytes()) else { return false };
                // Some replies without a value end in a blank.
                let rest = rest.strip_prefix(b" ").unwrap_or(rest);
                let found: Vec<String> = rest.iter().map(|b| format!("{b:02X}")).collect();
                fits(hex.split_whitespace(), found.iter().map(String::as_str))
            }
        }
    }
}

fn fits<'a>(mut pattern: impl Iterator<Item = &'a str>, mut found: impl Iterator<Item = &'a str>) -> bool {
    loop {
        match (pattern.next(), found.next()) {
            (Some("**"), _) | (None, None) => return true,
            (Some(_), None) | (None, Some(_)) => return false,
            (Some(word), Some(other)) if word == "*" || word == other => {}
            _ => return false,
        }
    }
}
