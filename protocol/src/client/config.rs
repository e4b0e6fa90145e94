//! How a scanner is to be set up.

use core::time::Duration;

use crate::model::{Password, RemissionWidth, ScanMode};

/// How a scanner is to be set up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClientConfig {
    /// Who logs in.
    pub login: Login,
    /// Scan mode; as the device has it where absent.
    pub scan_mode: Option<ScanMode>,
    /// First and last device angle, 1/10000°; as the device has it where absent.
    pub output_range: Option<(i32, i32)>,
    /// Echoes wanted, 1..=5.
    pub echoes: u8,
    /// Ask for remission.
    pub remission: bool,
    /// In this width.
    pub remission_width: RemissionWidth,
    /// Every n-th scan.
    pub output_rate: u16,
    /// How long a reply may take. Commands that restart the mirror get five times as long.
    pub reply_timeout: Duration,
    /// Largest payload taken, bytes.
    pub max_payload: usize,
}

impl Default for ClientConfig {
    fn default() -> Self {
        Self {
            login: Login::CLIENT,
            scan_mode: None,
            output_range: None,
            echoes: 1,
            remission: false,
            remission_width: RemissionWidth::Bits8,
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
    pub const CLIENT: Self = Self::of(crate::model::CLIENT);

    const fn of(password: Password) -> Self {
        Self { level: password.level, password: password.hash }
    }
}
