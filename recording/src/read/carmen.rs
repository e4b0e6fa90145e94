//! Logs of the CARMEN robot navigation toolkit: one message a line, ranges in metres. Scans come out as the telegrams they stand for; what the log says of
//! the robot is passed over.
//!
//! | message | after its name |
//! |---|---|
//! | `FLASER`, `RLASER`, `LASER3`, `LASER4` | count, ranges, … |
//! | `RAWLASER1` to `4`, `ROBOTLASER1`, `2` | type, first angle, field, step (radians), farthest range, accuracy, remission mode, count, ranges, count, remissions, … |
//!
//! Every line ends in the clock of who sent it, the host's name and the logger's clock, seconds. A clock may begin below 0: times then count from its
//! least reading. The older messages name no angles: 180 or 181 ranges
//! are a degree apart, 360 or 361 half of one, 201 and 401 those of a field of 100°; the first looks right, as an LMS2xx counts.

use super::told_scan::ToldScan;
use super::{ReadError, StreamInfo};
use crate::{Joint, Packet, Side, StreamKind};

/// Messages with a scan and no angles.
const OLD: [&str; 4] = ["FLASER", "RLASER", "LASER3", "LASER4"];
/// Messages with a scan and its angles.
const NEW: [&str; 6] = ["RAWLASER1", "RAWLASER2", "RAWLASER3", "RAWLASER4", "ROBOTLASER1", "ROBOTLASER2"];
/// Other messages that a log may begin with.
const OTHER: [&str; 5] = ["PARAM", "SYNC", "ODOM", "TRUEPOS", "NMEAGGA"];
/// How a log's comments may begin.
const TITLE: &str = "# CARMEN Logfile";

/// From here on an LMS2xx in centimetres tells a code and no range.
const OLD_FARTHEST_M: f64 = 81.83;
/// Most millimetres that 1 in a telegram stands for.
const MOST_SCALE: f64 = 10.0;
/// Straight ahead, device angle.
const AHEAD_DEG: f64 = 90.0;

/// Whether a log begins so: its first line, or the first that is no comment.
pub(super) fn is_log(line: &str) -> bool {
    let name = line.split_whitespace().next().unwrap_or_default();
    line.starts_with(TITLE) || [&OLD[..], &NEW, &OTHER].iter().any(|names| names.contains(&name))
}

/// One scan of the log.
struct Scan {
    stream: usize,
    time_s: f64,
    start_deg: f64,
    step_deg: f64,
    ranges_m: Vec<f64>,
    farthest_m: f64,
    remissions: Vec<f64>,
}

/// The scans, and a stream for each message that has some.
pub(super) fn packets(text: &str) -> Result<(Vec<Packet>, Vec<StreamInfo>), ReadError> {
    let (mut scans, mut streams): (Vec<Scan>, Vec<StreamInfo>) = (Vec::new(), Vec::new());
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = Words { line: number, left: line.split_whitespace() };
        let Some(name) = words.left.next() else { continue };
        if !OLD.contains(&name) && !NEW.contains(&name) {
            continue;
        }
        let stream = streams.iter().position(|stream| stream.name == name).unwrap_or_else(|| {
            streams.push(StreamInfo::new(name, StreamKind::Cola));
            streams.len() - 1
        });
        scans.push(if OLD.contains(&name) {
            words.scan_without_angles(stream)?
        } else {
            words.scan_with_angles(stream)?
        });
    }
    let farthest_mm = |scan: &Scan| {
        let met = scan.ranges_m.iter().filter(|range| **range < scan.farthest_m);
        met.fold(0.0_f64, |farthest, range| farthest.max(range * 1000.0))
    };
    let scales: Vec<f64> = (0..streams.len())
        .map(|stream| {
            let own = scans.iter().filter(|scan| scan.stream == stream);
            let farthest_mm = own.map(farthest_mm).fold(0.0, f64::max);
            (farthest_mm.round() / f64::from(u16::MAX)).ceil().clamp(1.0, MOST_SCALE)
        })
        .collect();
    let begins_s = scans.iter().map(|scan| scan.time_s).fold(0.0, f64::min);
    scans.iter_mut().for_each(|scan| scan.time_s -= begins_s);
    let mut counters = vec![0_u16; streams.len()];
    let mut packets = Vec::new();
    for scan in &scans {
        let (Some(counter), Some(scale)) = (counters.get_mut(scan.stream), scales.get(scan.stream)) else {
            continue;
        };
        *counter = counter.wrapping_add(1);
        packets.push(scan.packet(*counter, *scale));
    }
    Ok((packets, streams))
}

/// The words of a line that are still to be read.
struct Words<'a> {
    line: usize,
    left: std::str::SplitWhitespace<'a>,
}

impl Words<'_> {
    fn wrong(&self, expected: &str, found: &str) -> ReadError {
        ReadError::Line {
            line: self.line,
            expected: expected.to_owned(),
            found: found.chars().take(40).collect(),
        }
    }

    fn number(&mut self, expected: &str) -> Result<f64, ReadError> {
        let word = self.left.next().unwrap_or_default();
        let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| self.wrong(expected, word))
    }

    /// So many numbers, with their count before them.
    fn counted(&mut self, what: &str) -> Result<Vec<f64>, ReadError> {
        let count = self.number(&format!("how many {what} follow"))?;
        if !(0.0..=f64::from(u16::MAX)).contains(&count) || count.fract() != 0.0 {
            return Err(self.wrong(&format!("how many {what} follow, from 0 to 65535"), &count.to_string()));
        }
        (0..count as usize)
            .map(|number| self.number(&format!("{what}: {count} numbers, number {number}")))
            .collect()
    }

    /// The logger's clock: the line's last word.
    fn time_s(&mut self) -> Result<f64, ReadError> {
        let rest: Vec<&str> = self.left.by_ref().collect();
        let [.., _, _, last] = rest.as_slice() else {
            return Err(self.wrong(
                "the sender's clock, a host's name and the logger's clock at the end",
                &rest.join(" "),
            ));
        };
        let time_s = last.parse::<f64>().ok().filter(|time_s| time_s.abs() < 1e10);
        time_s.ok_or_else(|| self.wrong("the logger's clock in seconds at the end", last))
    }

    fn scan_without_angles(mut self, stream: usize) -> Result<Scan, ReadError> {
        let ranges_m = self.counted("ranges")?;
        let (field_deg, step_deg) = match ranges_m.len() {
            180 | 181 => (180.0, 1.0),
            360 | 361 => (180.0, 0.5),
            201 => (100.0, 0.5),
            401 => (100.0, 0.25),
            found => {
                let expected = "180, 181, 201, 360, 361 or 401 ranges: the message names no angles";
                return Err(self.wrong(expected, &found.to_string()));
            }
        };
        let (start_deg, time_s) = (AHEAD_DEG - field_deg / 2.0, self.time_s()?);
        let (farthest_m, remissions) = (OLD_FARTHEST_M, Vec::new());
        Ok(Scan { stream, time_s, start_deg, step_deg, ranges_m, farthest_m, remissions })
    }

    fn scan_with_angles(mut self, stream: usize) -> Result<Scan, ReadError> {
        self.number("the laser's type")?;
        let start_deg = AHEAD_DEG + self.number("the first angle in radians")?.to_degrees();
        self.number("the field of view in radians")?;
        let step_deg = self.number("the angle between ranges in radians")?.to_degrees();
        let farthest_m = self.number("the farthest range in metres")?;
        self.number("the accuracy")?;
        self.number("the remission mode")?;
        let ranges_m = self.counted("ranges")?;
        let remissions = self.counted("remissions")?;
        if !(0.001..=6.0).contains(&step_deg) || start_deg.abs() > 360.0 {
            let found = format!("a step of {step_deg:.4}° from {start_deg:.2}°");
            return Err(self.wrong("a step of 0.001 to 6 degrees and a start within 360 degrees", &found));
        }
        let time_s = self.time_s()?;
        Ok(Scan { stream, time_s, start_deg, step_deg, ranges_m, farthest_m, remissions })
    }
}

impl Scan {
    /// Its telegram, as an event of CoLa B. How often the mirror turns the log does not say: 0.
    fn packet(&self, counter: u16, scale: f64) -> Packet {
        let ranges = self.ranges_m.iter().map(|range_m| match range_m {
            // Too far, or nothing: no echo.
            range_m if *range_m <= 0.0 || *range_m >= self.farthest_m => 0,
            range_m => (range_m * 1000.0 / scale).round().clamp(1.0, f64::from(u16::MAX)) as u16,
        });
        let remissions =
            self.remissions.iter().map(|value| value.round().clamp(0.0, f64::from(u16::MAX)) as u16);
        let told = ToldScan {
            counter,
            time_us: (self.time_s * 1e6).round() as u64 as u32,
            frequency_centihz: 0,
            start_deg: self.start_deg,
            step: (self.step_deg * 10_000.0).round() as u16,
            scale,
            distances: ranges.collect(),
            remissions: remissions.collect(),
        };
        let at_ns = Some((self.time_s * 1e9).round() as u64);
        Packet {
            stream: self.stream,
            from: Some(Side::Device),
            at_ns,
            joint: Joint::Anew,
            bytes: told.event(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::ScanReader;
    use crate::scan_reader::MAX_PAYLOAD;

    /// 181 ranges of a metre, but for the first three.
    fn flaser(end: &str) -> String {
        format!("FLASER 181 2.5 0 81.91{} 0 0 0 0 0 0 {end}", " 1.0".repeat(178))
    }

    fn read(packet: &Packet) -> rowscan_protocol::scan::Scan {
        let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a scanner's");
        reader.push(Duration::ZERO, packet);
        reader.next_scan().expect("a scan").clone()
    }

    #[test]
    fn a_scan_without_angles_looks_from_right_to_left() {
        let text = format!("# CARMEN Logfile\nODOM 0 0 0 0 0 0 1 host 1\n{}\n", flaser("1000.25 host 1.5"));
        let (packets, streams) = packets(&text).expect("sound");
        assert_eq!((packets.len(), streams[0].name.as_str()), (1, "FLASER"));
        assert_eq!(packets[0].at_ns, Some(1_500_000_000));
        let scan = read(&packets[0]);
        assert_eq!(scan.echoes[0].range_m[..4], [2.5, f64::INFINITY, f64::INFINITY, 1.0]);
        assert_eq!((scan.beams.angle_deg(0), scan.beams.angle_deg(180)), (0.0, 180.0));
        assert_eq!((scan.scan_time_us, scan.scan_frequency_hz), (1_500_000, 0.0));
    }

    #[test]
    fn a_scan_with_angles_says_how_far_it_sees_and_how_bright() {
        let text = "ROBOTLASER1 0 -0.7853981634 0.0349065850 0.0174532925 30 0.01 1 3 1 29.999 30 3 7 8 9 0 0 0 0 0 0 0 0 0 0 0 2 h 3\n";
        let (packets, _) = packets(text).expect("sound");
        let scan = read(&packets[0]);
        assert_eq!(scan.echoes[0].range_m, [1.0, 29.999, f64::INFINITY]);
        assert_eq!(scan.echoes[0].remission, [7, 8, 9]);
        assert_eq!((scan.beams.angle_deg(0), scan.beams.angle_deg(2)), (45.0, 47.0));
    }

    #[test]
    fn a_clock_that_begins_below_zero_counts_from_its_least_reading() {
        let log = [flaser("-3.5 h -3.5"), flaser("-3.25 h -3.25"), flaser("0.5 h 0.5")].join("\n");
        let (packets, _) = packets(&log).expect("sound");
        let times: Vec<_> = packets.iter().map(|packet| packet.at_ns).collect();
        assert_eq!(times, [Some(0), Some(250_000_000), Some(4_000_000_000)]);
        assert_eq!(read(&packets[1]).scan_time_us, 250_000);
    }

    #[test]
    fn front_and_rear_are_streams_and_far_ranges_keep_their_place() {
        let rear = flaser("1 h 2").replace("FLASER", "RLASER").replace(" 2.5 ", " 80.0 ");
        let (packets, streams) = packets(&format!("{}\n{rear}\n", flaser("1 h 1"))).expect("sound");
        assert_eq!(streams.iter().map(|stream| &*stream.name).collect::<Vec<_>>(), ["FLASER", "RLASER"]);
        let found = read(&packets[1]).echoes[0].range_m[0];
        assert!((found - 80.0).abs() < 0.002, "{found}");
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, part) in [
            (
                "ODOM 1\nFLASER 3 1 2 3 0 0 0 0 0 0 1 h 1".to_owned(),
                "line 2: expected 180, 181, 201, 360, 361 or 401 ranges",
            ),
            ("FLASER x".to_owned(), "line 1: expected how many ranges follow, found `x`"),
            ("FLASER 3 1 2".to_owned(), "line 1: expected ranges: 3 numbers, number 2, found ``"),
            ("FLASER 70000 1".to_owned(), "line 1: expected how many ranges follow, from 0 to 65535"),
            (flaser("soon"), "line 1: expected the logger's clock in seconds at the end, found `soon`"),
            (
                "RAWLASER1 0 0 1 0 80 0 0 0 0 1 h 1".to_owned(),
                "line 1: expected a step of 0.001 to 6 degrees",
            ),
        ] {
            let error = packets(&text).expect_err(part).to_string();
            assert!(error.starts_with(part), "expected `{part}` in: {error}");
        }
    }
}
