//! Scans, positions and raw bytes as ROS 2 messages in CDR, so that a recording is a ROS 2 bag.
//!
//! CDR (OMG, XCDR1): four bytes that say little-endian, then every field at a multiple of its own size, counted from behind those four.

use rowscan_protocol::scan::Scan;

use crate::fix::Fix;
use crate::schema::{Language, Schema};

/// A scan: `sensor_msgs/msg/LaserScan`.
pub(crate) const LASER_SCAN: Schema =
    message("scan", "sensor_msgs/msg/LaserScan", include_str!("ros2/LaserScan.msg"));
/// A position: `sensor_msgs/msg/NavSatFix`.
pub(crate) const NAV_SAT_FIX: Schema =
    message("fix", "sensor_msgs/msg/NavSatFix", include_str!("ros2/NavSatFix.msg"));
/// The bytes of a packet: `std_msgs/msg/UInt8MultiArray`.
pub(crate) const BYTES: Schema =
    message("", "std_msgs/msg/UInt8MultiArray", include_str!("ros2/UInt8MultiArray.msg"));

const fn message(topic: &'static str, name: &'static str, text: &'static str) -> Schema {
    Schema { topic, name, text, language: Language::Ros2 }
}

/// CDR in little-endian.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
/// Before the bytes of a `UInt8MultiArray`: no dimensions, no offset, and the count of the bytes.
const BYTES_HEAD: usize = 16;

/// Writes fields one after the other.
struct Cdr(Vec<u8>);

impl Cdr {
    fn new() -> Self {
        Self(LITTLE_ENDIAN.to_vec())
    }

    /// A field of so many bytes, at a multiple of them.
    fn field<const N: usize>(&mut self, bytes: [u8; N]) {
        while !(self.0.len() - LITTLE_ENDIAN.len()).is_multiple_of(N) {
            self.0.push(0);
        }
        self.0.extend_from_slice(&bytes);
    }

    fn count(&mut self, count: usize) {
        self.field(u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.count(text.len() + 1);
        self.0.extend_from_slice(text.as_bytes());
        self.0.push(0);
    }

    fn float(&mut self, value: f64) {
        self.field((value as f32).to_le_bytes());
    }

    fn double(&mut self, value: f64) {
        self.field(value.to_le_bytes());
    }

    /// `std_msgs/Header`
    fn header(&mut self, at_ns: u64, frame: &str) {
        self.field(((at_ns / 1_000_000_000) as i32).to_le_bytes());
        self.field(((at_ns % 1_000_000_000) as u32).to_le_bytes());
        self.text(frame);
    }
}

/// The scan's frame: x along device angle 0°, y along 90°, in metres. A beam without an echo is +∞ (REP 117). How far the scanner sees no telegram says: every finite
/// range counts.
pub(crate) fn laser_scan(at_ns: u64, frame: &str, scan: &Scan) -> Vec<u8> {
    let beams = scan.beams;
    let angle = |beam: usize| beams.angle_deg(beam).to_radians();
    let turn_s = if scan.scan_frequency_hz > 0.0 { scan.scan_frequency_hz.recip() } else { 0.0 };
    let mut cdr = Cdr::new();
    cdr.header(at_ns, frame);
    cdr.float(angle(0));
    cdr.float(angle(beams.len().saturating_sub(1)));
    cdr.float(beams.step_deg().to_radians());
    cdr.float(turn_s * beams.step_deg().abs() / 360.0);
    cdr.float(turn_s);
    cdr.float(0.0);
    cdr.float(f64::from(f32::MAX));
    let first = scan.echoes.first();
    let (ranges, remissions) = first.map_or((&[][..], &[][..]), |echo| (&echo.range_m, &echo.remission));
    cdr.count(ranges.len());
    ranges.iter().for_each(|range| cdr.float(*range));
    cdr.count(remissions.len());
    remissions.iter().for_each(|remission| cdr.float(f64::from(*remission)));
    cdr.0
}

/// A position of a receiver with a fix. How exact it is GGA does not say: covariance unknown.
pub(crate) fn nav_sat_fix(at_ns: u64, frame: &str, fix: &Fix) -> Vec<u8> {
    const STATUS_FIX: i8 = 0;
    const SERVICE_GPS: u16 = 1;
    const COVARIANCE_UNKNOWN: u8 = 0;
    let mut cdr = Cdr::new();
    cdr.header(at_ns, frame);
    cdr.field(STATUS_FIX.to_le_bytes());
    cdr.field(SERVICE_GPS.to_le_bytes());
    [fix.latitude_deg, fix.longitude_deg, fix.altitude_m].into_iter().for_each(|value| cdr.double(value));
    (0..9).for_each(|_| cdr.double(0.0));
    cdr.field([COVARIANCE_UNKNOWN]);
    cdr.0
}

/// The bytes of a packet.
pub(crate) fn bytes(packet: &[u8]) -> Vec<u8> {
    let mut cdr = Cdr::new();
    cdr.count(0);
    cdr.count(0);
    cdr.count(packet.len());
    cdr.0.extend_from_slice(packet);
    cdr.0
}

/// The bytes of the packet in such a message; none if it is no such message.
pub(crate) fn packet(message: &[u8]) -> Option<&[u8]> {
    let (head, packet) = message.split_at_checked(BYTES_HEAD)?;
    (head == bytes(packet).get(..BYTES_HEAD)?).then_some(packet)
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::scan::{Echo, NO_ECHO};

    use super::*;

    #[test]
    fn fields_stand_at_multiples_of_their_size() {
        let echo = Echo { range_m: vec![1.5, NO_ECHO], remission: vec![7, 0] };
        let beams = BeamGrid { start: 0, step: 10_000, count: 2 };
        let scan = Scan { beams, scan_frequency_hz: 50.0, echoes: vec![echo], ..Scan::default() };
        let found = laser_scan(1_500_000_000, "left", &scan);
        // Four bytes, two of time, the frame's name of 5 with its count, three to fill, seven numbers.
        assert_eq!(found[..4], LITTLE_ENDIAN);
        assert_eq!(found[4..12], [1, 0, 0, 0, 0x00, 0x65, 0xCD, 0x1D]);
        assert_eq!(found[12..24], [5, 0, 0, 0, b'l', b'e', b'f', b't', 0, 0, 0, 0]);
        let number = |at: usize| f32::from_le_bytes([found[at], found[at + 1], found[at + 2], found[at + 3]]);
        assert_eq!((number(24), number(28)), (0.0, 1.0_f32.to_radians()));
        assert_eq!((number(40), number(48)), (0.02, f32::MAX));
        assert_eq!((found[52], number(56), number(60)), (2, 1.5, f32::INFINITY));
        assert_eq!((found[64], number(68), number(72), found.len()), (2, 7.0, 0.0, 76));
        let fix = Fix { latitude_deg: 41.0, longitude_deg: 0.5, altitude_m: 200.0 };
        let found = nav_sat_fix(0, "gnss", &fix);
        // Behind the name: status, one to fill, service, and the first double at 24 of what follows the four.
        assert_eq!(found[28..36], 41.0_f64.to_le_bytes());
        assert_eq!(found.len(), 28 + 12 * 8 + 1);
    }

    #[test]
    fn a_packet_comes_out_as_it_went_in() {
        for packet in [&b""[..], b"\x02sRN DeviceIdent\x03"] {
            assert_eq!(super::packet(&bytes(packet)), Some(packet));
        }
        let mut short = bytes(b"abc");
        short.pop();
        assert_eq!(super::packet(&short), None);
        assert_eq!(super::packet(b"\0\x01\0\0"), None);
    }
}
