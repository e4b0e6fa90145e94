//! Ranges as text: a header that says how they were measured, one scan a line. They come out as the scan telegrams they stand for.
//!
//! ```text
//! # rowscan ranges 1; frequency_hz 50; start_deg -45; step_deg 0.5; unit mm
//! received_s,telegram_counter,scan_time_us,status,range_0,range_1, …
//! 0.000,1,1000000,0,1523,1530, …
//! ```
//! `model` and `serial` may stand in the header too. 0, or nothing between two commas, is a beam without an echo, NaN one of which that is not known. `received_s` is the host's clock,
//! and empty or NaN where nobody knows it; older files call it `time_s`. `status` is the number of a [`DeviceStatus`]; files without it say that all is well.

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::optics::DAZZLED_MM;
use rowscan_protocol::telegram::wire::FixedText;
use rowscan_protocol::telegram::{Channel, Kind, LmdScandata, Variable, encode_frame};
use rowscan_protocol::validity::DeviceStatus;

use super::ReadError;
use crate::{About, Joint, Packet, Side};

/// How such a file begins.
pub(super) const TITLE: &str = "# rowscan ranges 1";

/// Columns before the ranges; [`STATUS`] may follow.
const LEADING: [&str; 3] = ["received_s", "telegram_counter", "scan_time_us"];

/// What older files call the first.
const OLDER: &str = "time_s";

/// The column of the device's word of itself.
const STATUS: &str = "status";

/// The columns before the ranges, as a file has them.
#[derive(Clone, Copy, Debug)]
struct Leading {
    has_status: bool,
}

impl Leading {
    fn read(line: usize, columns: &str) -> Result<Self, ReadError> {
        let mut names = columns.split(',').map(str::trim);
        let found =
            names.by_ref().take(LEADING.len()).map(|name| if name == OLDER { LEADING[0] } else { name });
        if found.ne(LEADING) {
            let expected = format!("the columns {},{STATUS},range_0, …", LEADING.join(","));
            return Err(wrong(line, expected, columns));
        }
        Ok(Self { has_status: names.next() == Some(STATUS) })
    }

    /// How many they are.
    fn count(self) -> usize {
        LEADING.len() + usize::from(self.has_status)
    }
}

/// Most millimetres that 1 in a telegram stands for.
const MOST_SCALE: f64 = 10.0;

/// What the header says.
#[derive(Clone, Debug, Default)]
struct Header {
    frequency_hz: Option<f64>,
    start_deg: Option<f64>,
    step_deg: Option<f64>,
    unit_mm: Option<f64>,
    serial: u32,
    model: Option<String>,
}

/// The scans as telegrams of CoLa B.
pub(super) fn packets(text: &str) -> Result<(Vec<Packet>, About), ReadError> {
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let (number, title) = lines.next().unwrap_or((1, ""));
    let header = Header::read(number, title)?;
    let (number, columns) = lines.next().unwrap_or((2, ""));
    let leading = Leading::read(number, columns)?;
    let lines: Vec<(usize, &str)> = lines.collect();
    let mut scan = header.blank(number)?;
    if let Some(channel) = scan.channels16.first_mut() {
        channel.scale = header.scale(&lines, leading);
    }
    let mut packets = Vec::new();
    for (number, line) in lines {
        let at_ns = header.fill(&mut scan, (number, line), leading)?;
        let mut bytes = Vec::new();
        encode_frame(Dialect::B, Kind::Sn, LmdScandata::NAME, &scan, &mut bytes);
        packets.push(Packet { stream: 0, from: Some(Side::Device), at_ns, joint: Joint::Anew, bytes });
    }
    Ok((packets, About { model: header.model, ..About::default() }))
}

fn wrong(line: usize, expected: impl Into<String>, found: &str) -> ReadError {
    ReadError::Line { line, expected: expected.into(), found: found.chars().take(40).collect() }
}

impl Header {
    fn read(line: usize, title: &str) -> Result<Self, ReadError> {
        let mut header = Self::default();
        for entry in title.split(';').skip(1).map(str::trim).filter(|entry| !entry.is_empty()) {
            let (key, value) = entry.split_once(' ').unwrap_or((entry, ""));
            let number = || value.parse::<f64>().ok().filter(|value| value.is_finite());
            let number = || number().ok_or_else(|| wrong(line, format!("a number for `{key}`"), value));
            match key {
                "frequency_hz" => header.frequency_hz = Some(number()?),
                "start_deg" => header.start_deg = Some(number()?),
                "step_deg" => header.step_deg = Some(number()?),
                "serial" => header.serial = number()? as u32,
                "model" if AnyModel::by_name(value).is_some() => {
                    header.model = Some(value.to_owned());
                }
                "model" => return Err(wrong(line, "a model that `rowscan models` lists", value)),
                "unit" => {
                    let known = [("mm", 1.0), ("cm", 10.0), ("m", 1000.0)];
                    let unit = known.iter().find(|(name, _)| *name == value).map(|(_, unit)| *unit);
                    header.unit_mm = Some(unit.ok_or_else(|| wrong(line, "the unit mm, cm or m", value))?);
                }
                _ => {
                    let keys = "one of frequency_hz, start_deg, step_deg, unit, serial, model";
                    return Err(wrong(line, keys, key));
                }
            }
        }
        Ok(header)
    }

    /// The telegram that all scans share.
    fn blank(&self, line: usize) -> Result<LmdScandata, ReadError> {
        let need = |value: Option<f64>, key: &str| {
            value.ok_or_else(|| wrong(line.saturating_sub(1), format!("`{key}` in the header"), "none"))
        };
        let (frequency, step) = (need(self.frequency_hz, "frequency_hz")?, need(self.step_deg, "step_deg")?);
        let start = need(self.start_deg, "start_deg")?;
        need(self.unit_mm, "unit")?;
        if !(0.0..=1000.0).contains(&frequency) || !(0.001..=6.0).contains(&step) || start.abs() > 360.0 {
            let expected = "0 to 1000 Hz, steps of 0.001 to 6 degrees, a start within 360 degrees";
            return Err(wrong(line.saturating_sub(1), expected, &format!("{frequency} {step} {start}")));
        }
        let channel = Channel {
            name: FixedText(*b"DIST1"),
            scale: 1.0,
            offset: 0.0,
            start_angle: (start * 10_000.0).round() as i32,
            step: (step * 10_000.0).round() as u16,
            values: Vec::new(),
        };
        Ok(LmdScandata {
            version: 1,
            device_number: 1,
            serial_number: self.serial,
            scan_frequency: (frequency * 100.0).round() as u32,
            measurement_frequency: (frequency * 3.6 / step).round() as u32,
            channels16: vec![channel],
            ..LmdScandata::default()
        })
    }

    /// Millimetres that 1 in the telegram stands for: what the farthest range needs to fit into 16 bits. Scanners of 80 m use 2.
    fn scale(&self, lines: &[(usize, &str)], leading: Leading) -> f32 {
        let unit_mm = self.unit_mm.unwrap_or(1.0);
        let cells = lines.iter().flat_map(|(_, line)| line.split(',').skip(leading.count()));
        let ranges = cells.filter_map(|cell| cell.trim().parse::<f64>().ok());
        let farthest_mm = ranges.map(|range| (range * unit_mm).round()).fold(0.0, f64::max);
        // What is beyond is refused with its line.
        (farthest_mm / f64::from(u16::MAX)).ceil().clamp(1.0, MOST_SCALE) as f32
    }

    /// Takes one line in; its host time, ns, where that is known.
    fn fill(
        &self,
        scan: &mut LmdScandata,
        (line, text): (usize, &str),
        columns: Leading,
    ) -> Result<Option<u64>, ReadError> {
        let mut cells = text.split(',').map(str::trim);
        let mut leading = || cells.next().unwrap_or_default();
        let (time, counter, stamp) = (leading(), leading(), leading());
        let is_timed = !time.is_empty() && !time.eq_ignore_ascii_case("nan");
        let seconds = |time: &str| match time.parse::<f64>() {
            Ok(time_s) if (0.0..=1e10).contains(&time_s) => Ok((time_s * 1e9).round() as u64),
            _ => Err(wrong(line, "seconds from 0", time)),
        };
        let at_ns = is_timed.then(|| seconds(time)).transpose()?;
        scan.telegram_counter =
            counter.parse().map_err(|_| wrong(line, "a counter from 0 to 65535", counter))?;
        scan.scan_counter = scan.telegram_counter;
        scan.scan_time_us = stamp.parse().map_err(|_| wrong(line, "microseconds of 32 bits", stamp))?;
        scan.transmit_time_us = scan.scan_time_us;
        if columns.has_status {
            let number = leading();
            let status = number.parse().ok().and_then(DeviceStatus::of_number);
            let expected = "a status from 0 to 3 (ok, contamination warning, contamination error, error)";
            scan.device_status = status.ok_or_else(|| wrong(line, expected, number))?.scandata();
        }
        let unit_mm = self.unit_mm.unwrap_or(1.0);
        let Some(channel) = scan.channels16.first_mut() else { return Ok(at_ns) };
        let before = channel.values.len();
        channel.values.clear();
        for cell in cells {
            if cell.eq_ignore_ascii_case("nan") {
                // As devices say that they cannot tell what a beam met.
                channel.values.push(DAZZLED_MM);
                continue;
            }
            let range: f64 = if cell.is_empty() { 0.0 } else { cell.parse().unwrap_or(f64::NAN) };
            let value = (range * unit_mm / f64::from(channel.scale)).round();
            if !(0.0..=65_535.0).contains(&value) {
                return Err(wrong(line, "ranges from 0 to 655.35 m", cell));
            }
            channel.values.push(value as u16);
        }
        if before > 0 && before != channel.values.len() {
            let found = channel.values.len().to_string();
            return Err(wrong(line, format!("{before} ranges, as in the lines before"), &found));
        }
        Ok(at_ns)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan_reader::MAX_PAYLOAD;
    use crate::{ScanReader, StreamKind};
    use std::time::Duration;

    const HEAD: &str = "# rowscan ranges 1; frequency_hz 50; start_deg -45; step_deg 0.5; unit cm\ntime_s,telegram_counter,scan_time_us,range_0,range_1,range_2\n";

    #[test]
    fn a_line_is_the_scan_it_says() {
        let (packets, _) = packets(&format!("{HEAD}1.5,7,1000,100,,250.5\n")).expect("sound");
        assert_eq!(packets[0].at_ns, Some(1_500_000_000));
        let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a scanner's");
        reader.push(Duration::ZERO, &packets[0]);
        let scan = reader.next_scan().expect("a scan");
        assert_eq!(scan.echoes[0].range_m, [1.0, f64::INFINITY, 2.505]);
        assert_eq!((scan.telegram_counter, scan.scan_time_us, scan.scan_frequency_hz), (7, 1000, 50.0));
        assert_eq!((scan.beams.start, scan.beams.step), (-450_000, 5000));
    }

    #[test]
    fn a_status_and_an_unknown_time_are_read_as_they_were_told() {
        let head = HEAD.replace("time_s", "received_s").replace("us,range_0", "us,status,range_0");
        for status in DeviceStatus::ALL {
            let text = format!("{head}NaN,7,1000,{},100,,250.5\n", status.number());
            let (packets, _) = packets(&text).expect("sound");
            assert_eq!(packets[0].at_ns, None);
            let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a scanner's");
            reader.push(Duration::ZERO, &packets[0]);
            let scan = reader.next_scan().expect("a scan");
            assert_eq!((scan.status, scan.echoes[0].range_m.len()), (status, 3));
        }
    }

    #[test]
    fn what_a_beam_met_is_a_range_or_nothing_or_not_known() {
        // With each scale that a telegram may have.
        for farthest in [250.5, 8000.0, 60_000.0] {
            let (packets, _) =
                packets(&format!("{HEAD}0,1,2,NaN,0,{farthest}\n0,2,3,0,nan,NAN\n")).expect("sound");
            let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a scanner's");
            let mut told = packets.iter().map(|packet| {
                reader.push(Duration::ZERO, packet);
                let range_m = &reader.next_scan().expect("a scan").echoes[0].range_m;
                range_m.iter().map(|range| (range.is_nan(), range.is_infinite())).collect::<Vec<_>>()
            });
            let (unknown, miss, met) = ((true, false), (false, true), (false, false));
            assert_eq!(told.next(), Some(vec![unknown, miss, met]), "{farthest}");
            assert_eq!(told.next(), Some(vec![miss, unknown, unknown]), "{farthest}");
        }
    }

    #[test]
    fn ranges_beyond_16_bits_of_millimetres_are_read() {
        let (packets, _) = packets(&format!("{HEAD}0,1,2,8000.2,100,40\n")).expect("sound");
        let mut reader = ScanReader::new(StreamKind::Cola, MAX_PAYLOAD).expect("a scanner's");
        reader.push(Duration::ZERO, &packets[0]);
        let scan = reader.next_scan().expect("a scan");
        let ranges = scan.echoes[0].range_m.iter().zip([80.002, 1.0, 0.4]);
        assert!(ranges.clone().all(|(found, expected)| (found - expected).abs() < 1e-5), "{scan:?}");
    }

    #[test]
    fn a_header_names_any_model_that_there_is() {
        for model in AnyModel::all() {
            let text = format!(
                "{}0,1,2,3,4,5\n",
                HEAD.replace("; unit", &format!("; model {}; unit", model.name()))
            );
            let (_, about) =
                super::packets(&text).unwrap_or_else(|error| panic!("{}: {error}", model.name()));
            assert_eq!(about.model.as_deref(), Some(model.name()));
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        for (text, part) in [
            (
                HEAD.replace("; unit", "; model foo; unit"),
                "line 1: expected a model that `rowscan models` lists",
            ),
            (format!("{HEAD}0,1,2,70000,4,5\n"), "line 3: expected ranges from 0 to 655.35 m, found `70000`"),
            (HEAD.replace("; unit cm", ""), "line 1: expected `unit`"),
            (HEAD.replace("cm", "feet"), "line 1: expected the unit mm, cm or m, found `feet`"),
            (HEAD.replace("start_deg", "begin"), "line 1: expected one of frequency_hz"),
            (HEAD.replace("time_s", "t"), "line 2: expected the columns"),
            (
                format!("{}0,1,2,4,3,4,5\n", HEAD.replace("us,range_0", "us,status,range_0")),
                "line 3: expected a status from 0 to 3",
            ),
            (format!("{HEAD}0,1,2,3,4,5\n0,1,2,3,4\n"), "line 4: expected 3 ranges"),
            (format!("{HEAD}0,70000,2,3,4,5\n"), "line 3: expected a counter"),
            (format!("{HEAD}0,1,2,x,4,5\n"), "line 3: expected ranges from 0 to 655.35 m, found `x`"),
        ] {
            let error = packets(&text).expect_err(part).to_string();
            assert!(error.starts_with(part), "expected `{part}` in: {error}");
        }
    }
}
