//! Login by challenge: a client asks for a nonce that is valid for one request, and proves with it that it knows the password.

use std::collections::VecDeque;
use std::time::Duration;

use rowscan_protocol::random::{Rng, Stream};
use rowscan_protocol::time::SimTime;
use serde_json::{Value, json};

use crate::answer::Status;
use crate::sha256;

/// The realm of every challenge.
pub const REALM: &str = "SICK Sensor";
/// The password of the one user that is enabled as delivered.
pub const PASSWORD: &str = "servicelevel";
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

/// The response that proves the password for a POST of `name`: what a client computes.
pub fn response(user: &str, password: &str, salt: &[u8], nonce: &str, name: &str) -> String {
    let mut secret = format!("{user}:{REALM}:{password}").into_bytes();
    if !salt.is_empty() {
        secret.push(b':');
        secret.extend_from_slice(salt);
    }
    let (secret, asked) = (sha256::hex(&secret), sha256::hex(format!("POST:{name}").as_bytes()));
    sha256::hex(format!("{secret}:{nonce}:{asked}").as_bytes())
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

#[cfg(test)]
mod tests {
    use super::*;

    /// As the fact sheet works it out, equal with SICK's own Python client.
    #[test]
    fn the_worked_example() {
        let salt: Vec<u8> = (1..=16).collect();
        let nonce = "0123456789abcdef0123456789abcdef";
        let found = response("Service", PASSWORD, &salt, nonce, "ScanDataEnable");
        assert_eq!(found, "539b96ac6bd891cb9f2d2e1cfbcf59a68230b7e9a734e69b37307f8366363d73");
        let mut secret = b"Service:SICK Sensor:servicelevel:".to_vec();
        secret.extend(&salt);
        assert_eq!(sha256::hex(&secret), "341d54cda98b6031c574c64cee5a4424858e1c2b427f83f051309828e9c9523b");
        assert_eq!(
            sha256::hex(b"POST:ScanDataEnable"),
            "68cc174dca111fb57a1c0c0e9709c81399496cef62a0afac3407bdd50e93311d"
        );
    }
}
