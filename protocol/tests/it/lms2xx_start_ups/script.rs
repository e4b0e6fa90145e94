//! The start-ups' file format, and a host that plays one.
//!
//! Head: `client NAME`, `models NAME…`, `ack TIME` (every `06` must come within it). Then, in order:
//! - `N x TIME: REQUEST => REPLY`: asked at most N times, TIME for each reply. Both are bodies in hex; the reply's beginning, `*` for any,
//!   `06` where the acknowledgement is all that is looked at.
//! - `search N x TIME at RATES: REQUEST => REPLY`: the same at each rate in turn until it answers.
//! - `send REQUEST`, `wait TIME`, `rate RATE` (of the host), `scans N of COMMAND COUNT` (at least so many values in each).

use std::time::Duration;

use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::values::Values;

use super::line::{Heard, Line};

#[derive(Debug, Default)]
pub struct Script {
    pub client: String,
    pub models: Vec<String>,
    ack: Option<Duration>,
    steps: Vec<Step>,
}

#[derive(Debug)]
enum Step {
    Ask(Exchange),
    Search(Vec<Rate>, Exchange),
    Send(Vec<u8>),
    Wait(Duration),
    Rate(Rate),
    Scans { count: usize, command: u8, values: usize },
}

#[derive(Debug)]
struct Exchange {
    tries: u32,
    within: Duration,
    request: Vec<u8>,
    reply: Reply,
}

#[derive(Debug)]
enum Reply {
    Ack,
    Body(Vec<u8>),
}

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn duration(text: &str) -> Duration {
    let (number, unit) = text.trim().split_once(' ').unwrap();
    let number = number.parse().unwrap();
    match unit {
        "ms" => Duration::from_millis(number),
        "s" => Duration::from_secs(number),
        other => panic!("no unit {other}"),
    }
}

fn rate(text: &str) -> Rate {
    Rate::of(text.trim().parse().unwrap()).unwrap()
}

/// `N x TIME: REQUEST => REPLY`, the times already taken off.
fn exchange(times: &str, asked: &str) -> Exchange {
    let (tries, within) = times.split_once(" x ").unwrap();
    let (request, reply) = asked.split_once("=>").unwrap();
    let reply = match reply.trim() {
        "06" => Reply::Ack,
        "*" => Reply::Body(Vec::new()),
        body => Reply::Body(bytes(body)),
    };
    Exchange {
        tries: tries.trim().parse().unwrap(),
        within: duration(within),
        request: bytes(request),
        reply,
    }
}

impl Script {
    pub fn parse(source: &str) -> Self {
        let mut script = Self::default();
        for line in source.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with(';')) {
            let (word, rest) = line.split_once(' ').unwrap();
            match word {
                "client" => script.client = rest.to_owned(),
                "models" => script.models = rest.split_whitespace().map(str::to_owned).collect(),
                "ack" => script.ack = Some(duration(rest)),
                "send" => script.steps.push(Step::Send(bytes(rest))),
                "wait" => script.steps.push(Step::Wait(duration(rest))),
                "rate" => script.steps.push(Step::Rate(rate(rest))),
                "scans" => {
                    let words: Vec<&str> = rest.split_whitespace().collect();
                    let [count, "of", command, values] = words[..] else { panic!("{line}") };
                    script.steps.push(Step::Scans {
                        count: count.parse().unwrap(),
                        command: u8::from_str_radix(command, 16).unwrap(),
                        values: values.parse().unwrap(),
                    });
                }
                "search" => {
                    let (times, asked) = rest.split_once(": ").unwrap();
                    let (times, rates) = times.split_once(" at ").unwrap();
                    let rates = rates.split_whitespace().map(rate).collect();
                    script.steps.push(Step::Search(rates, exchange(times, asked)));
                }
                _ => {
                    let (times, asked) = line.split_once(": ").unwrap();
                    script.steps.push(Step::Ask(exchange(times, asked)));
                }
            }
        }
        assert!(!script.client.is_empty() && !script.models.is_empty());
        script
    }

    /// Plays it once; what went wrong, in words. The line knows when its first scan came.
    pub fn play(&self, line: &mut Line) -> Result<(), String> {
        self.steps.iter().try_for_each(|step| match step {
            Step::Ask(exchange) => self.ask(line, exchange),
            Step::Search(rates, exchange) => self.search(line, rates, exchange),
            Step::Send(request) => {
                line.send(request);
                Ok(())
            }
            Step::Wait(time) => {
                line.wait(*time);
                Ok(())
            }
            Step::Rate(rate) => {
                line.tty = *rate;
                Ok(())
            }
            Step::Scans { count, command, values } => scans(line, *count, *command, *values),
        })
    }

    fn search(&self, line: &mut Line, rates: &[Rate], exchange: &Exchange) -> Result<(), String> {
        let found = rates.iter().any(|rate| {
            line.tty = *rate;
            self.ask(line, exchange).is_ok()
        });
        found.then_some(()).ok_or_else(|| format!("{:02X?}: no answer at any rate", exchange.request))
    }

    fn ask(&self, line: &mut Line, exchange: &Exchange) -> Result<(), String> {
        let mut last = String::new();
        for _ in 0..exchange.tries {
            match self.ask_once(line, exchange) {
                Ok(()) => return Ok(()),
                Err(why) => last = why,
            }
        }
        Err(format!("{:02X?}: {last}", exchange.request))
    }

    fn ask_once(&self, line: &mut Line, exchange: &Exchange) -> Result<(), String> {
        line.send(&exchange.request);
        let asked = line.now;
        let mut acked = None;
        loop {
            let left = (asked + exchange.within).0.saturating_sub(line.now.0);
            match line.hear(Duration::from_nanos(left)) {
                Some(Heard::Ack) => {
                    acked = Some(line.now);
                    if matches!(exchange.reply, Reply::Ack) {
                        return Ok(());
                    }
                }
                Some(Heard::Nak) => return Err("15".to_owned()),
                Some(Heard::Body(body)) => match &exchange.reply {
                    // A scan that was on its way.
                    _ if matches!(body[0], 0xB0 | 0xB6 | 0xB7 | 0xF5) => {}
                    Reply::Ack => {}
                    Reply::Body(expected) if body.starts_with(expected) => {
                        let late = self.ack.filter(|ack| acked.is_none_or(|at| at > asked + *ack));
                        return late.map_or(Ok(()), |_| Err("06 came late".to_owned()));
                    }
                    Reply::Body(_) => return Err(format!("found {:02X?}", &body[..body.len().min(8)])),
                },
                None => return Err("no answer".to_owned()),
            }
        }
    }
}

/// How long a client waits for a scan.
const SCAN_LIMIT: Duration = Duration::from_secs(2);

fn scans(line: &mut Line, count: usize, command: u8, values: usize) -> Result<(), String> {
    let mut seen = 0;
    while seen < count {
        match line.hear(SCAN_LIMIT) {
            Some(Heard::Body(body)) if body[0] == command => {
                let mut scan = Values::default();
                scan.decode_into(&body).map_err(|error| error.to_string())?;
                if scan.values.len() < values {
                    return Err(format!("{} values in a scan", scan.values.len()));
                }
                line.first_scan.get_or_insert(line.now);
                seen += 1;
            }
            Some(_) => {}
            None => return Err(format!("{seen} scans only")),
        }
    }
    Ok(())
}
