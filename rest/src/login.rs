//! Login by challenge: a client asks for a nonce that is valid for one request, and proves with it that it knows the password.

use std::collections::VecDeque;
use std::time::Duration;

pub use rowscan_protocol::challenge::{PASSWORD, REALM, response};
use rowscan_protocol::random::{Rng, Stream};
use rowscan_protocol::time::SimTime;
use serde_json::{Value, json};

use crate::answer::Status;

/// All users. Only the last is enabled as delivered.
pub const USERS: [&str; 5] = ["Run", "Operator", "Maintenance", "AuthorizedClient", "Service"];
/// Challenges that may be open at once; the oldest makes room.
pub const MAX_CHALLENGES: usize = 32;
/// After so many failed logins in a row, every login is refused for [`LOCKED_FOR`].
pub const MAX_FAILURES: u32 = 5;
/// How long that is, on the device's clock.
pub const LOCKED_FOR: Duration = Duration::from_secs(30);
/// Bytes of salt: always sent, because some clients fail on a list that is empty or missing.
const SALT: usize = 16;
/// What the random numbers are for.
const PURPOSE: u64 = 0x4E57;

/// The open challenges of one scanner.
#[derive(Debug)]
pub struct Login {
    salt: [u8; SALT],
    random: Stream,
    open: VecDeque<Challenge>,
    failures: u32,
    locked_until: Option<SimTime>,
}

#[derive(Debug, PartialEq, Eq)]
struct Challenge {
    user: String,
    nonce: String,
    opaque: String,
}

impl Login {
    /// Of the scanner with this serial number; nonces repeat with the seed.
    pub fn new(seed: u64, serial_number: u32) -> Self {
        let mut random = Stream::keyed(seed, &[PURPOSE, serial_number.into()]);
        let (first, second) = (random.next_u64().to_le_bytes(), random.next_u64().to_le_bytes());
        let mut salt = [0; SALT];
        salt.iter_mut().zip(first.iter().chain(&second)).for_each(|(salt, byte)| *salt = *byte);
        Self { salt, random, open: VecDeque::new(), failures: 0, locked_until: None }
    }

    /// Opens a challenge: the member `challenge` of the answer.
    ///
    /// # Errors
    /// There is no such user, it is not enabled, or too many logins have failed.
    pub fn challenge(&mut self, user: &str, now: SimTime) -> Result<Value, Status> {
        if self.is_locked(now) {
            return Err(Status::TooMany);
        }
        match USERS.iter().position(|known| *known == user) {
            Some(4) => {}
            Some(_) => return Err(Status::AccessDenied),
            None => return Err(Status::IllegalValue),
        }
        let (nonce, opaque) = (self.word(), self.word());
        let answer = json!({ "realm": REALM, "nonce": nonce, "opaque": opaque, "salt": self.salt });
        if self.open.len() >= MAX_CHALLENGES {
            self.open.pop_front();
        }
        self.open.push_back(Challenge { user: user.to_owned(), nonce, opaque });
        Ok(answer)
    }

    /// Judges the header of a POST of `name`.
    ///
    /// # Errors
    /// It proves nothing: no such challenge is open, or the response is not the password's. The challenge is used up either way.
    pub fn judge(&mut self, header: &Value, name: &str, now: SimTime) -> Result<(), Status> {
        if self.is_locked(now) {
            return Err(Status::TooMany);
        }
        let text = |key| header.get(key).and_then(Value::as_str).unwrap_or_default();
        let (user, nonce) = (text("user"), text("nonce"));
        let place = self.open.iter().position(|open| open.nonce == nonce);
        // A nonce that has been used, or that was never given, is stale and no attempt at the password.
        let challenge = place.and_then(|place| self.open.remove(place)).ok_or(Status::InvalidChallenge)?;
        let is_whole = challenge.user == user && challenge.opaque == text("opaque") && text("realm") == REALM;
        if is_whole && text("response") == response(user, PASSWORD, &self.salt, nonce, name) {
            self.failures = 0;
            return Ok(());
        }
        self.failures += 1;
        if self.failures >= MAX_FAILURES {
            (self.failures, self.locked_until) = (0, Some(now + LOCKED_FOR));
            self.open.clear();
        }
        Err(Status::InvalidChallenge)
    }

    fn is_locked(&self, now: SimTime) -> bool {
        self.locked_until.is_some_and(|until| now < until)
    }

    /// 64 hex digits: which form a real device gives is not known.
    fn word(&mut self) -> String {
        (0..4).map(|_| format!("{:016x}", self.random.next_u64())).collect()
    }
}
