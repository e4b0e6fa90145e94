//! Position on NMEA 2000: rapid position, rapid course and speed, and the full GNSS fix as a fast packet. Layouts as public
//! implementations of NMEA 2000 have them.

use rowscan_vehicle::gnss::{Fix, FixQuality};

use super::TRACTOR_ADDRESS;
use crate::message::{Message, Payload, Signal};

/// Position, rapid update.
pub const POSITION_RAPID: Message = Message {
    name: "PositionRapid",
    pgn: 129_025,
    priority: 2,
    period_ms: Some(100),
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "latitude and longitude of the antenna (NMEA 2000)",
    signals: &[
        Signal::new("Latitude", 0, 32, 1e-7, "deg").signed(),
        Signal::new("Longitude", 32, 32, 1e-7, "deg").signed(),
    ],
};

/// Course and speed over ground, rapid update.
pub const COURSE_RAPID: Message = Message {
    name: "CourseSpeedRapid",
    pgn: 129_026,
    priority: 2,
    period_ms: Some(250),
    len: 8,
    source: TRACTOR_ADDRESS,
    about: "course and speed over ground of the antenna (NMEA 2000)",
    signals: &[
        Signal::new("CourseSequence", 0, 8, 1.0, ""),
        Signal::choice("CourseReference", 8, 2, &[(0, "True"), (1, "Magnetic")]),
        Signal::new("CourseOverGround", 16, 16, 1e-4, "rad"),
        Signal::new("SpeedOverGround", 32, 16, 0.01, "m/s"),
    ],
};

/// GNSS position data, 43 bytes.
pub const POSITION: Message = Message {
    name: "GnssPosition",
    pgn: 129_029,
    priority: 3,
    period_ms: Some(1000),
    len: 43,
    source: TRACTOR_ADDRESS,
    about: "the full GNSS fix, a fast packet of seven frames (NMEA 2000)",
    signals: &[
        Signal::new("FixSequence", 0, 8, 1.0, ""),
        Signal::new("FixDate", 8, 16, 1.0, "d"),
        Signal::new("FixTime", 24, 32, 1e-4, "s"),
        Signal::new("FixLatitude", 56, 64, 1e-16, "deg").signed(),
        Signal::new("FixLongitude", 120, 64, 1e-16, "deg").signed(),
        Signal::new("FixAltitude", 184, 64, 1e-6, "m").signed(),
        Signal::choice("FixType", 248, 4, &[(0, "Gps"), (1, "Glonass"), (2, "GpsGlonass")]),
        Signal::choice(
            "FixMethod",
            252,
            4,
            &[(0, "NoFix"), (1, "Gnss"), (2, "Differential"), (4, "RtkFixed"), (5, "RtkFloat")],
        ),
        Signal::choice("FixIntegrity", 256, 2, &[(0, "NotChecked"), (1, "Safe"), (2, "Caution")]),
        Signal::new("Satellites", 264, 8, 1.0, ""),
        Signal::new("Hdop", 272, 16, 0.01, "").signed(),
        Signal::new("Pdop", 288, 16, 0.01, "").signed(),
        Signal::new("GeoidSeparation", 304, 32, 0.01, "m").signed(),
        Signal::new("ReferenceStations", 336, 8, 1.0, ""),
    ],
};

/// [`POSITION_RAPID`] of a fix; not available without one.
pub fn position_rapid(fix: &Fix) -> Payload {
    let known = |value| (fix.quality != FixQuality::None).then_some(value);
    POSITION_RAPID.encode(&[known(fix.latitude_deg), known(fix.longitude_deg)])
}

/// [`COURSE_RAPID`] of a fix.
pub fn course_rapid(fix: &Fix, sequence: u8) -> Payload {
    let known = |value| (fix.quality != FixQuality::None).then_some(value);
    let course = known(fix.course_deg.to_radians());
    COURSE_RAPID.encode(&[Some(f64::from(sequence % 251)), Some(0.0), course, known(fix.speed_m_s.abs())])
}

/// [`POSITION`] of a fix.
pub fn position(fix: &Fix, sequence: u8) -> Payload {
    let known = |value| (fix.quality != FixQuality::None).then_some(value);
    let days = (fix.unix_s / 86_400.0).floor();
    POSITION.encode(&[
        Some(f64::from(sequence % 251)),
        Some(days),
        Some(fix.unix_s - days * 86_400.0),
        known(fix.latitude_deg),
        known(fix.longitude_deg),
        known(fix.altitude_m),
        Some(0.0),
        Some(f64::from(fix.quality.code())),
        Some(0.0),
        Some(f64::from(fix.satellites)),
        known(fix.hdop),
        None,
        known(fix.geoid_m),
        Some(0.0),
    ])
}
