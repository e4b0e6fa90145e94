//! Login by challenge, as scanners with a REST interface want it: the response by which a client proves the password. Both sides compute it here.
//!
//! ```
//! use rowscan_protocol::challenge::response;
//! let salt: Vec<u8> = (1..=16).collect();
//! let proof = response("Service", "servicelevel", &salt, "0123456789abcdef0123456789abcdef", "ScanDataEnable");
//! assert_eq!(proof, "539b96ac6bd891cb9f2d2e1cfbcf59a68230b7e9a734e69b37307f8366363d73");
//! ```

use alloc::format;
use alloc::string::String;
use core::fmt::Write;

use sha2::{Digest, Sha256};

/// The realm of every challenge.
pub const REALM: &str = "SICK Sensor";
/// The user that is enabled as delivered.
pub const USER: &str = "Service";
/// Its password as delivered.
pub const PASSWORD: &str = "servicelevel";

/// The response that proves the password for a POST of `name`, in lower-case hex.
pub fn response(user: &str, password: &str, salt: &[u8], nonce: &str, name: &str) -> String {
    let mut secret = format!("{user}:{REALM}:{password}").into_bytes();
    if !salt.is_empty() {
        secret.push(b':');
        secret.extend_from_slice(salt);
    }
    let (secret, asked) = (sha256(&secret), sha256(format!("POST:{name}").as_bytes()));
    sha256(format!("{secret}:{nonce}:{asked}").as_bytes())
}

/// SHA-256 in lower-case hex.
fn sha256(message: &[u8]) -> String {
    Sha256::digest(message).iter().fold(String::new(), |mut text, byte| {
        // A string takes all that is written.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the fact sheet works it out, equal with SICK's own Python client; with the steps between.
    #[test]
    fn the_worked_example() {
        let salt: alloc::vec::Vec<u8> = (1..=16).collect();
        let nonce = "0123456789abcdef0123456789abcdef";
        let found = response(USER, PASSWORD, &salt, nonce, "ScanDataEnable");
        assert_eq!(found, "539b96ac6bd891cb9f2d2e1cfbcf59a68230b7e9a734e69b37307f8366363d73");
        let mut secret = b"Service:SICK Sensor:servicelevel:".to_vec();
        secret.extend(&salt);
        assert_eq!(sha256(&secret), "341d54cda98b6031c574c64cee5a4424858e1c2b427f83f051309828e9c9523b");
        assert_eq!(
            sha256(b"POST:ScanDataEnable"),
            "68cc174dca111fb57a1c0c0e9709c81399496cef62a0afac3407bdd50e93311d"
        );
    }
}
