//! The conversation with a scanner: REST until it streams, then datagrams.

use std::collections::VecDeque;
use std::net::{SocketAddr, SocketAddrV4};
use std::time::Duration;

use rowscan_protocol::challenge::{REALM, response};
use rowscan_protocol::compact::{CompactListener, SegmentCounts};
use rowscan_protocol::frame::FrameCounts;
use rowscan_protocol::heard_settings::SettingsInForce;
use rowscan_protocol::host::{DeviceInfo, HostEvent, HostSession, Language, OtherSender, Refusal, Transmit};
use rowscan_protocol::scan::Scan;
use serde_json::{Value, json};

use super::http::{self, Answer};
use super::piece::{self, ANSWER, DATAGRAM};
use super::step::{self, Step};
use crate::config::DriverConfig;
use crate::picoscan_address::PicoscanAddress;

/// What is refused where a login is.
pub(super) const LOGIN: &str = "getChallenge";
/// What does not come where no datagram does.
pub(super) const DATAGRAMS: &str = "datagrams";
/// `header.status` of a nonce that is used up, and of a wrong password.
const INVALID_CHALLENGE: u64 = 10;
/// `header.status` of too many requests.
const TOO_MANY: u64 = 11;
/// `header.status` of an internal error, as one that is busy has.
const BUSY: u64 = 3;
/// The code of HTTP of one that is busy.
const UNAVAILABLE: u16 = 503;
/// Pauses before a request that was one too many is made again.
pub(super) const PAUSES: [Duration; 3] =
    [Duration::from_millis(500), Duration::from_millis(1000), Duration::from_millis(2000)];
/// Numbers of salt that are believed.
const MAX_SALT: usize = 64;

/// One conversation.
#[derive(Debug)]
pub(crate) struct PicoSession {
    place: PicoscanAddress,
    reply_timeout: Duration,
    datagram_timeout: Duration,
    steps: VecDeque<Step>,
    state: State,
    /// How often the step's login was refused, and how often it was to be asked again later.
    refused: u32,
    put_off: usize,
    /// Streams beside the scans that this session has switched on.
    switched_on: Vec<&'static str>,
    /// A login was taken: the password is right.
    is_known: bool,
    info: DeviceInfo,
    listener: CompactListener,
    events: VecDeque<HostEvent>,
    is_stopping: bool,
}

/// Where the conversation stands.
#[derive(Clone, Debug, PartialEq, Eq)]
enum State {
    /// The next step is to be asked, from this time on.
    Next(Option<Duration>),
    /// An answer is awaited: to a challenge, if so, else to the step itself; since the time it was sent, once that is known.
    Asked {
        for_challenge: bool,
        until: Option<Duration>,
    },
    /// A challenge has come: the header of the POST.
    Challenged(String),
    /// All is set; the first datagram is awaited.
    Set {
        until: Option<Duration>,
    },
    /// Scans come.
    Streams,
    Done,
}

impl PicoSession {
    pub(super) fn new(place: &PicoscanAddress, to: Option<SocketAddrV4>, config: &DriverConfig) -> Self {
        let (steps, has_mode) = to.map_or((Vec::new(), true), |to| step::start_up(to, place, &config.cola));
        let limited = HostEvent::Limited {
            what: "no picoScan or multiScan has a mode of the rig's frequency and resolution: it keeps its own",
        };
        Self {
            place: place.clone(),
            reply_timeout: config.cola.reply_timeout,
            datagram_timeout: config.first_datagram_timeout,
            steps: steps.into(),
            state: State::Next(None),
            refused: 0,
            put_off: 0,
            switched_on: Vec::new(),
            is_known: false,
            info: DeviceInfo { ident: String::new(), firmware: String::new(), language: Language::Compact },
            listener: CompactListener::default(),
            events: (!has_mode).then_some(limited).into_iter().collect(),
            is_stopping: false,
        }
    }

    fn datagram(&mut self, now: Duration, from: SocketAddr, bytes: &[u8]) {
        if self.is_set() {
            self.listener.handle_datagram_from(now, from, bytes);
            self.begin();
        }
    }

    /// False while datagrams are those of a stream that somebody else has set up. The first of one's own may come before the answer that says so.
    fn is_set(&self) -> bool {
        match &self.state {
            State::Set { .. } | State::Streams => true,
            _ if self.is_stopping => true,
            // The request that has scans sent is the last one.
            State::Asked { for_challenge: false, .. } => self.steps.len() == 1,
            _ => false,
        }
    }

    /// Scans come once all is set and a telegram was there.
    fn begin(&mut self) {
        let foreign = OtherSender::telegrams_of(self.listener.other_senders());
        if matches!(self.state, State::Set { .. }) && self.listener.counts().frames > foreign {
            self.state = State::Streams;
            self.events.push_back(HostEvent::Ready(self.info.clone()));
        }
    }

    fn answer(&mut self, now: Duration, bytes: &[u8]) {
        let State::Asked { for_challenge, .. } = self.state else { return };
        let Some(Answer { code, body }) = http::answer(bytes) else { return self.end_without_answer() };
        let Ok(json) = serde_json::from_slice::<Value>(if body.is_empty() { b"null" } else { &body }) else {
            let is_html = body.trim_ascii_start().starts_with(b"<");
            return self.refuse_step(Refusal::NotJson { is_html, http: code });
        };
        let body = json;
        let status = body.pointer("/header/status").and_then(Value::as_u64);
        if code == 429 || status == Some(TOO_MANY) {
            return self.ask_later(now, Refusal::TooMany { http: code });
        }
        if code == UNAVAILABLE || status == Some(BUSY) {
            return self.ask_later(now, Refusal::Rest { status, http: code });
        }
        match (for_challenge, status) {
            (true, Some(0)) => match self.header(&body) {
                Some(header) => self.state = State::Challenged(header),
                None => self.refuse(LOGIN, Refusal::Rest { status, http: code }, true),
            },
            (true, _) => self.refuse(LOGIN, Refusal::Rest { status, http: code }, true),
            // A nonce may have gone stale on its way: once more, with a fresh one. Then it is the password, unless that was taken before.
            (false, Some(INVALID_CHALLENGE)) if self.refused == 0 => {
                self.refused += 1;
                self.state = State::Next(None);
            }
            (false, Some(INVALID_CHALLENGE)) => {
                let refusal = match self.is_known {
                    true => Refusal::StaleNonce { http: code },
                    false => Refusal::Rest { status, http: code },
                };
                self.refuse(LOGIN, refusal, true);
            }
            (false, Some(0)) => self.done(&body),
            (false, _) => self.refuse_step(Refusal::Rest { status, http: code }),
        }
    }

    /// The step is done.
    fn done(&mut self, body: &Value) {
        let Some(step) = self.steps.front() else { return };
        self.is_known |= step.data.is_some();
        // Of a method; devices may wrap it by the method's name.
        let code = ["/data/ErrorCode".to_owned(), format!("/data/{}/ErrorCode", step.name)];
        let code = code.iter().find_map(|pointer| body.pointer(pointer)).and_then(Value::as_u64);
        if let Some(code) = code.filter(|code| *code != 0) {
            return self.refuse_step(Refusal::Method { code });
        }
        let Some(step) = self.steps.pop_front() else { return };
        let text = |pointer: &str| body.pointer(pointer).and_then(Value::as_str).unwrap_or_default();
        match step.name {
            // Real devices wrap structs by their name; the schema shows them bare.
            "DeviceIdent" => {
                let [name, version] = ["Name", "Version"].map(|part| {
                    let wrapped = text(&format!("/data/DeviceIdent/{part}"));
                    if wrapped.is_empty() { text(&format!("/data/{part}")) } else { wrapped }
                });
                self.info.ident = format!("{name} {version}");
                version.clone_into(&mut self.info.firmware);
            }
            "SerialNumber" => {
                if let Ok(number) = text("/data/SerialNumber").trim().parse() {
                    self.listener.follow(number);
                }
            }
            // The scanner has refused another one.
            step::ECHO if step.data.is_none() => {
                let code = body.pointer("/data/FREchoFilter").and_then(Value::as_u64);
                let code = code.and_then(|code| u8::try_from(code).ok());
                if let Some(heard) = self.listener.heard_settings() {
                    heard.set_in_force(SettingsInForce { code, ..SettingsInForce::default() });
                }
            }
            "FirmwareVersion" => text("/data/FirmwareVersion").clone_into(&mut self.info.firmware),
            _ => match (step.leftover, &step.data) {
                (Some(setting), Some(_)) => {
                    self.events.push_back(HostEvent::Leftover { setting, refused: None });
                }
                (Some(setting), None) => {
                    let off = body.get("data").and_then(|data| step::off(setting, data));
                    off.into_iter().for_each(|off| self.steps.push_front(off));
                }
                (None, None) if step.told.is_some() => {
                    let is_on = body.get("data").and_then(|data| step::is_on(step.name, data));
                    let told = step.told.filter(|_| is_on == Some(true));
                    self.events.extend(told.map(|what| HostEvent::Limited { what }));
                }
                (None, _) if !self.is_stopping => self.switched_on.extend(step.switches_on()),
                _ => {}
            },
        }
        self.go_on();
    }

    fn go_on(&mut self) {
        (self.refused, self.put_off) = (0, 0);
        self.state = match (self.steps.is_empty(), self.is_stopping) {
            (false, _) => State::Next(None),
            (true, false) => State::Set { until: None },
            (true, true) => {
                self.events.push_back(HostEvent::Stopped);
                State::Done
            }
        };
        self.begin();
    }

    /// Asks again after a pause; once all pauses are over, it is refused.
    fn ask_later(&mut self, now: Duration, refusal: Refusal) {
        match PAUSES.get(self.put_off) {
            Some(pause) => {
                self.put_off += 1;
                self.state = State::Next(Some(now.saturating_add(*pause)));
            }
            None if matches!(refusal, Refusal::TooMany { .. }) => self.refuse(LOGIN, refusal, true),
            None => self.refuse_step(refusal),
        }
    }

    /// The step itself is refused.
    fn refuse_step(&mut self, refusal: Refusal) {
        let (name, is_needed) =
            self.steps.front().map_or((DATAGRAMS, true), |step| (step.name, step.is_needed));
        self.refuse(name, refusal, is_needed);
    }

    fn refuse(&mut self, command: &'static str, refusal: Refusal, fatal: bool) {
        let step = self.steps.front();
        if !fatal && step.is_some_and(|step| step.may_lack) {
            self.steps.pop_front();
            return self.go_on();
        }
        self.events.push_back(match step.and_then(|step| step.leftover).filter(|_| !fatal) {
            Some(setting) => HostEvent::Leftover { setting, refused: Some(refusal) },
            None => HostEvent::Refused { command, error: Some(refusal), fatal },
        });
        if fatal && !self.is_stopping {
            self.state = State::Done;
            return;
        }
        let read_back = self.steps.pop_front().and_then(|step| step.read_back());
        read_back.into_iter().for_each(|step| self.steps.push_front(step));
        self.go_on();
    }

    fn end_without_answer(&mut self) {
        let command = self.steps.front().map_or(DATAGRAMS, |step| step.name);
        let event = if self.is_stopping { HostEvent::Stopped } else { HostEvent::NoAnswer { command } };
        self.events.push_back(event);
        self.state = State::Done;
    }

    /// The header of a POST that answers the challenge in `body`.
    fn header(&self, body: &Value) -> Option<String> {
        let name = self.steps.front()?.name;
        let challenge = body.get("challenge")?;
        let text = |key: &str| challenge.get(key).and_then(Value::as_str);
        let (nonce, opaque) = (text("nonce")?, text("opaque")?);
        let salt = match challenge.get("salt") {
            Some(list) => list.as_array()?.iter().map(|byte| u8::try_from(byte.as_u64()?).ok()).collect(),
            None => Some(Vec::new()),
        };
        let salt: Vec<u8> = salt.filter(|salt: &Vec<u8>| salt.len() <= MAX_SALT)?;
        let PicoscanAddress { user, password, .. } = &self.place;
        let response = response(user, password, &salt, nonce, name);
        let header = json!({
            "nonce": nonce, "opaque": opaque, "realm": text("realm").unwrap_or(REALM), "response": response, "user": user,
        });
        Some(header.to_string())
    }

    fn deadline(&self) -> Option<Duration> {
        match self.state {
            State::Next(until) | State::Asked { until, .. } | State::Set { until } => until,
            State::Challenged(_) | State::Streams | State::Done => None,
        }
    }
}

impl HostSession for PicoSession {
    fn handle_bytes(&mut self, now: Duration, bytes: &[u8]) {
        match bytes.split_first() {
            Some((&DATAGRAM, rest)) => {
                if let Some((from, bytes)) = piece::datagram(rest) {
                    self.datagram(now, from, bytes);
                }
            }
            Some((&ANSWER, answer)) => self.answer(now, answer),
            _ => {}
        }
        // Deadlines run from the first time that is told after their state began.
        self.handle_timeout(now);
    }

    fn handle_end(&mut self) {
        self.listener.handle_end();
    }

    fn handle_timeout(&mut self, now: Duration) {
        match &mut self.state {
            State::Asked { until: until @ None, .. } => *until = Some(now.saturating_add(self.reply_timeout)),
            State::Set { until: until @ None } => *until = Some(now.saturating_add(self.datagram_timeout)),
            State::Next(until @ Some(_)) if *until <= Some(now) => *until = None,
            State::Asked { until: Some(until), .. } if *until <= now => self.end_without_answer(),
            State::Set { until: Some(until) } if *until <= now => {
                self.events.push_back(HostEvent::NoAnswer { command: DATAGRAMS });
                self.state = State::Done;
            }
            _ => {}
        }
    }

    fn poll_timeout(&self) -> Option<Duration> {
        match self.state {
            // To be told the time at once.
            State::Asked { until: None, .. } | State::Set { until: None } => Some(Duration::ZERO),
            _ => self.deadline(),
        }
    }

    fn poll_transmit(&mut self) -> Option<Transmit> {
        let step = self.steps.front()?;
        let host = &self.place.address;
        let (request, for_challenge) = match &self.state {
            State::Next(None) if step.data.is_none() => (http::request(host, step.name, None), false),
            State::Next(None) => {
                let body = json!({ "data": { "user": self.place.user } }).to_string();
                (http::request(host, LOGIN, Some(&body)), true)
            }
            State::Challenged(header) => {
                let data = step.data.as_ref().map_or_else(String::new, Value::to_string);
                let body = format!(r#"{{"header":{header},"data":{data}}}"#);
                (http::request(host, step.name, Some(&body)), false)
            }
            _ => return None,
        };
        self.state = State::Asked { for_challenge, until: None };
        Some(Transmit::Frame(request))
    }

    fn poll_event(&mut self) -> Option<HostEvent> {
        let is_ready = matches!(self.state, State::Streams | State::Done) || self.is_stopping;
        self.events.pop_front().or_else(|| if is_ready { self.listener.poll_event() } else { None })
    }

    fn stop(&mut self, _: Duration) {
        self.is_stopping = true;
        self.steps = step::stop(&self.switched_on);
        self.go_on();
    }

    fn scan(&self) -> &Scan {
        self.listener.scan()
    }

    fn counts(&self) -> FrameCounts {
        self.listener.counts()
    }

    fn segments(&self) -> SegmentCounts {
        self.listener.segments()
    }

    fn other_senders(&self) -> &[OtherSender] {
        self.listener.other_senders()
    }

    fn is_done(&self) -> bool {
        self.state == State::Done
    }
}

#[cfg(test)]
mod tests;
