//! A beam's angle in its plane, as a 16-bit code.

/// From Compact's and REST's angles, 0 straight ahead, to CoLa's, 1/10000°.
pub const TO_COLA: i32 = 900_000;
/// Codes a radian (SICK's ScanSegmentAPI and perception SDK agree).
const CODES_A_RADIAN: f64 = 5215.0;
/// The code of angle 0.
const ZERO: f64 = 16_384.0;

/// The code of an angle: rounded down, as SICK's own encoder does. Angles out of range (−3.14 to 9.42 rad) get the nearest code.
///
/// ```
/// use rowscan_protocol::compact::theta_code;
/// assert_eq!(theta_code((-48.0_f64).to_radians()), 0x2eef);
/// ```
pub fn theta_code(rad: f64) -> u16 {
    libm::floor(rad * CODES_A_RADIAN + ZERO).clamp(0.0, f64::from(u16::MAX)) as u16
}

/// The angle of a code, rad: up to 1/5215 below the angle it was made of.
pub fn theta_rad(code: u16) -> f64 {
    (f64::from(code) - ZERO) / CODES_A_RADIAN
}
