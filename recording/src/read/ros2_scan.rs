//! Scans of other programs' ROS 2 bags: `sensor_msgs/msg/LaserScan` in CDR, as the telegrams they stand for.
//!
//! Ranges in metres, one that is not between `range_min` and `range_max` is no echo. The angle of a `LaserScan` is 0 straight ahead (REP 103), where a
//! scanner counts 90°. Of a scanner that looks from left to right the beams are turned round.

use super::told_scan::ToldScan;

/// The type's name.
pub(super) const TYPE: &str = "sensor_msgs/msg/LaserScan";

/// Straight ahead, device angle.
const AHEAD_DEG: f64 = 90.0;
/// Most millimetres that 1 in a telegram stands for.
const MOST_SCALE: f64 = 10.0;
/// More beams than any scanner has.
const MOST_BEAMS: usize = u16::MAX as usize;

/// The event of CoLa B that such a message stands for, number `counter`; none if it is no such message, or has angles that no telegram can tell.
pub(super) fn telegram(message: &[u8], counter: u16) -> Option<Vec<u8>> {
    let mut cdr = Cdr::of(message)?;
    let (seconds, nanoseconds) = (cdr.u32()?, cdr.u32()?);
    let name = cdr.u32()? as usize;
    cdr.skip(name)?;
    let [angle_min, _, increment, _, scan_time_s, range_min, range_max] = cdr.floats::<7>()?;
    let (mut ranges, mut remissions) = (cdr.list()?, cdr.list()?);
    let step_deg = f64::from(increment).to_degrees();
    let mut start_deg = AHEAD_DEG + f64::from(angle_min).to_degrees();
    if step_deg < 0.0 {
        start_deg += step_deg * (ranges.len().saturating_sub(1)) as f64;
        ranges.reverse();
        remissions.reverse();
    }
    let step = (step_deg.abs() * 10_000.0).round();
    if !(1.0..=f64::from(u16::MAX)).contains(&step) || start_deg.abs() > 540.0 {
        return None;
    }
    let is_met = |range: f32| range.is_finite() && range > 0.0 && (range_min..=range_max).contains(&range);
    let met_mm = |range: f32| if is_met(range) { f64::from(range) * 1000.0 } else { 0.0 };
    let farthest_mm = ranges.iter().map(|range| met_mm(*range)).fold(0.0, f64::max);
    let scale = (farthest_mm.round() / f64::from(u16::MAX)).ceil().clamp(1.0, MOST_SCALE);
    let raw = |range: &f32| match met_mm(*range) {
        0.0 => 0,
        // Lower numbers are codes.
        mm => (mm / scale).round().clamp(16.0, f64::from(u16::MAX)) as u16,
    };
    // A number that is none becomes 0.
    let grey = |value: &f32| value.round().clamp(0.0, f32::from(u16::MAX)) as u16;
    let hertz = Some(1.0 / scan_time_s).filter(|hertz| (0.01..=10_000.0).contains(hertz)).unwrap_or(0.0);
    let told = ToldScan {
        counter,
        time_us: (u64::from(seconds) * 1_000_000 + u64::from(nanoseconds / 1000)) as u32,
        frequency_centihz: (hertz * 100.0).round() as u32,
        start_deg,
        step: step as u16,
        scale,
        distances: ranges.iter().map(raw).collect(),
        remissions: remissions.iter().map(grey).collect(),
    };
    Some(told.event())
}

/// Reads CDR (OMG, XCDR1): four bytes that say the byte order, then every field at a multiple of its own size, counted from behind those.
struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

impl<'a> Cdr<'a> {
    fn of(message: &'a [u8]) -> Option<Self> {
        let ([0, order @ (0 | 1), _, _], bytes) = message.split_first_chunk::<4>()? else { return None };
        Some(Self { bytes, at: 0, is_big_endian: *order == 0 })
    }

    fn u32(&mut self) -> Option<u32> {
        let at = self.at.next_multiple_of(4);
        let bytes = *self.bytes.get(at..)?.first_chunk::<4>()?;
        self.at = at + 4;
        Some(if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    fn skip(&mut self, bytes: usize) -> Option<()> {
        self.at = self.at.checked_add(bytes).filter(|at| *at <= self.bytes.len())?;
        Some(())
    }

    fn floats<const N: usize>(&mut self) -> Option<[f32; N]> {
        let mut floats = [0.0; N];
        for float in &mut floats {
            *float = f32::from_bits(self.u32()?);
        }
        Some(floats)
    }

    fn list(&mut self) -> Option<Vec<f32>> {
        let count = self.u32()? as usize;
        let is_there = count <= MOST_BEAMS && 4 * count <= self.bytes.len().saturating_sub(self.at) + 3;
        (0..count).map(|_| self.u32().map(f32::from_bits)).collect::<Option<Vec<f32>>>().filter(|_| is_there)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::scan_reader::{MAX_PAYLOAD, ScanReader};
    use crate::{Packet, Side, StreamKind};

    /// A message of this byte order: ranges of 1 m, but for the given ones.
    fn message(is_big_endian: bool, first_rad: f32, increment: f32, ranges: &[f32]) -> Vec<u8> {
        let number = |bits: u32| if is_big_endian { bits.to_be_bytes() } else { bits.to_le_bytes() };
        let mut message = vec![0, u8::from(!is_big_endian), 0, 0];
        message.extend([number(7), number(500_000_000), number(6)].concat());
        message.extend(b"laser\0\0\0");
        let last = first_rad + increment * (ranges.len() as f32 - 1.0);
        for float in [first_rad, last, increment, 0.0, 0.02, 0.1, 30.0] {
            message.extend(number(float.to_bits()));
        }
        for list in [ranges, &[7.0, 300.0, f32::NAN][..]] {
            message.extend(number(list.len() as u32));
            list.iter().for_each(|value| message.extend(number(value.to_bits())));
        }
        message
    }

    fn read(message: &[u8]) -> rowscan_protocol::scan::Scan {
        let bytes = telegram(message, 9).expect("a scan");
        let packet = Packet { from: Some(Side::Device), bytes, ..Packet::default() };
        let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a scanner's");
        reader.push(Duration::ZERO, &packet);
        reader.next_scan().expect("a scan").clone()
    }

    #[test]
    fn a_message_is_the_scan_it_says() {
        for is_big_endian in [false, true] {
            let message =
                message(is_big_endian, -0.5_f32.to_radians(), 0.5_f32.to_radians(), &[2.5, 0.05, 29.9]);
            let scan = read(&message);
            assert_eq!(scan.echoes[0].range_m, [2.5, f64::INFINITY, 29.9]);
            assert_eq!(scan.echoes[0].remission, [7, 300, 0]);
            assert_eq!((scan.beams.start, scan.beams.step, scan.telegram_counter), (895_000, 5000, 9));
            assert_eq!((scan.scan_time_us, scan.scan_frequency_hz), (7_500_000, 50.0));
        }
    }

    #[test]
    fn a_scanner_that_looks_from_left_to_right_is_turned_round() {
        let scan = read(&message(false, 1.0_f32.to_radians(), -1.0_f32.to_radians(), &[1.0, 2.0, 3.0]));
        assert_eq!((scan.beams.start, scan.beams.step), (890_000, 10_000));
        assert_eq!(scan.echoes[0].range_m, [3.0, 2.0, 1.0]);
    }

    #[test]
    fn any_bytes_are_read_without_panic() {
        let whole = message(false, 0.0, 0.01, &[1.0; 40]);
        for end in 0..whole.len() {
            assert_eq!(telegram(&whole[..end], 0), None, "cut at {end}");
        }
        for at in 0..whole.len() {
            for flip in [0x01, 0x80, 0xFF] {
                let mut broken = whole.clone();
                broken[at] ^= flip;
                let _ = telegram(&broken, 0);
            }
        }
    }
}
