//! How a scanner is to be set up.

use core::time::Duration;

use crate::model::{self, Password, RemissionWidth, ScanMode};
use crate::rig::EchoChoice;

/// How a scanner is to be set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColaConfig {
    /// Who logs in; where absent, the authorised client with the password of the model that DeviceIdent names.
    pub login: Option<Login>,
    /// Scan mode; as the device has it where absent.
    pub scan_mode: Option<ScanMode>,
    /// First and last device angle, 1/10000°; as the device has it where absent.
    pub output_range: Option<(i32, i32)>,
    /// Echoes wanted, 1..=5.
    pub echoes: u8,
    /// The echo wanted where one is: a scanner that would send another one by itself (an LMS5xx: the last) is asked for it. As the device has it
    /// where absent.
    pub echo: Option<EchoChoice>,
    /// Ask for remission.
    pub remission: bool,
    /// In this width.
    pub remission_width: RemissionWidth,
    /// Ask for the encoder's reading in the scans; the encoder counts so many ticks a metre.
    pub encoder_ticks_per_m: Option<u32>,
    /// Every n-th scan.
    pub output_rate: u16,
    /// How long a reply may take. Commands that restart the mirror get five times as long.
    pub reply_timeout: Duration,
    /// Largest payload taken, bytes.
    pub max_payload: usize,
}

impl Default for ColaConfig {
    fn default() -> Self {
        Self {
            login: None,
            scan_mode: None,
            output_range: None,
            echoes: 1,
            echo: Some(EchoChoice::First),
            remission: false,
            remission_width: RemissionWidth::Bits8,
            encoder_ticks_per_m: None,
            output_rate: 1,
            reply_timeout: Duration::from_secs(2),
            max_payload: 64 * 1024,
        }
    }
}

/// User level and password.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Login {
    /// 2 maintenance, 3 authorised client, 4 service.
    pub level: u8,
    /// Password hash.
    pub password: u32,
}

impl Login {
    /// Authorised client of an LMS1xx or LMS5xx.
    pub const CLIENT: Self = Self::of(model::CLIENT);

    /// Authorised client of the model that a DeviceIdent names; [`Login::CLIENT`] for one that is not modelled.
    pub(crate) fn for_ident(ident: &str) -> Self {
        // Models that share a name share their passwords.
        let logins = model::by_ident(ident).next().map_or(&[][..], |model| model.logins);
        // A picoScan has switched the authorised client off.
        let client = logins.iter().find(|login| login.level == model::CLIENT.level).or(logins.last());
        client.copied().map_or(Self::CLIENT, Self::of)
    }

    const fn of(password: Password) -> Self {
        Self { level: password.level, password: password.hash }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_password_follows_the_ident() {
        assert_eq!(Login::for_ident("TiM781S V3.13").password, 0x6FD6_2C05);
        assert_eq!(Login::for_ident("TiM781 V3.13"), Login::CLIENT);
        assert_eq!(Login::for_ident("LMS10x_FieldEval V1.36-21.10.2010"), Login::CLIENT);
        assert_eq!(Login::for_ident("somebody else"), Login::CLIENT);
    }
}
