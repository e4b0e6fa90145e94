//! How far the tractor had come when each scan of a recording was made, by what the recording tells of its way.

use std::time::Duration;

use rowscan_canopy::{AdvanceSource, GroundSpeed};
use rowscan_emulator::replay::{Part, ReplayError, Survey};
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::rig::Rig;
use rowscan_recording::{MAX_PAYLOAD, ReadError, Recording, ScanReader};
use rowscan_study::reading::{CalibrationChoice, Reading};

use super::super::Failure;
use super::super::recorded_speed::RecordedSpeed;
use super::drive::drive_began_ns;

/// What tells the way.
pub(super) enum RecordedWay {
    /// The encoder in the scans.
    Encoder,
    /// A ground speed beside them.
    Speed(AdvanceSource, RecordedSpeed),
    /// Neither: the rig's speed, by the scanner's own clock, as in an estimate.
    OfRig,
}

impl RecordedWay {
    /// Of this stream by this rig.
    pub(super) fn found(survey: &Survey, part: &Part, rig: &Rig) -> Result<Self, Failure> {
        let counts = part.first_scan.as_ref().is_some_and(|scan| !scan.encoders.is_empty());
        if counts && rig.encoder_ticks_per_m.is_some() {
            return Ok(Self::Encoder);
        }
        let speed =
            RecordedSpeed::found_beside(&survey.path, None).map_err(|cause| unreadable(survey, cause))?;
        Ok(speed.map_or(Self::OfRig, |(source, speed)| Self::Speed(source, speed)))
    }

    /// The first scan that was made at this metre of the row or farther, by its number from 0; none where the drive began behind it, or ended before.
    pub(super) fn scan_at(
        &self,
        survey: &Survey,
        (part, rig): (&Part, &Rig),
        metre: f64,
    ) -> Result<Option<u64>, Failure> {
        if metre < rig.y_m(0.0) {
            return Ok(None);
        }
        let fail = |cause| unreadable(survey, cause);
        let mut recording = Recording::open_apart(&survey.path, &[part.name.as_str()]).map_err(fail)?;
        // Where a scanner sits beside the tractor is no part of the way.
        let reading = Reading::of_recording(Some(rig), 0, true, CalibrationChoice::Given(None))?;
        let mut pipeline = reading.pipeline;
        let Some(mut reader) = ScanReader::new(part.kind, MAX_PAYLOAD) else { return Ok(None) };
        let mut scans = 0;
        while let Some(packet) = recording.next_packet().map_err(fail)? {
            let is_part =
                recording.streams().get(packet.stream).is_some_and(|stream| stream.name == part.name);
            if !is_part {
                continue;
            }
            let at_ns = packet.at_ns.unwrap_or_default();
            let at = Duration::from_nanos(at_ns.saturating_sub(recording.began_ns().unwrap_or_default()));
            reader.push(at, &packet);
            while let Some(event) = reader.next_event() {
                if event == HostEvent::Scan && drive_began_ns(survey) > Some(at_ns) {
                    scans += 1;
                    continue;
                }
                match event {
                    HostEvent::Scan => match self {
                        Self::Encoder | Self::OfRig => pipeline.push(reader.scan()),
                        Self::Speed(source, speed) => pipeline.push_at_speed(
                            reader.scan(),
                            GroundSpeed { source: *source, speed_m_s: speed.at(at) },
                        ),
                    },
                    HostEvent::Malformed { fault } => pipeline.push_unreadable(&fault),
                    _ => continue,
                }
                if pipeline.progress().y_m.is_some_and(|y_m| y_m >= metre) {
                    return Ok(Some(scans));
                }
                scans += 1;
            }
        }
        Ok(None)
    }
}

fn unreadable(survey: &Survey, cause: ReadError) -> Failure {
    ReplayError::Read { path: survey.path.clone(), cause }.into()
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;
    use std::path::Path;

    use rowscan_protocol::device::scan_event;
    use rowscan_protocol::frame::Dialect;
    use rowscan_protocol::telegram::{Encoder, LmdScandata, Telegram};
    use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind};

    use super::*;

    const START_NS: u64 = 1_700_000_000_000_000_000;
    const SCANS: u64 = 200;
    /// A scan of three beams, ten times a second.
    const SCAN: &str = "sSN LMDscandata 1 1 16F4C7A 0 0 0 0 0 0 0 0 4 0 0 3E8 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0";

    /// What tells the speed beside the scans.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Beside {
        Nothing,
        Ticks,
        Sentences,
        Frames,
    }

    /// The drive: 0.5 m/s for ten seconds, then 2 m/s.
    fn y_m(s: f64) -> f64 {
        if s < 10.0 { 0.5 * s } else { 5.0 + 2.0 * (s - 10.0) }
    }

    /// Recorded so many times as fast as it was driven: a recording of an emulator whose time ran so.
    fn recorded(path: &Path, beside: Beside, times: u64) {
        let mut writer =
            McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("begun");
        let scanner = writer.add_stream("scanner", StreamKind::Cola).expect("added");
        let gnss = writer.add_stream("gnss", StreamKind::Nmea).expect("added");
        let can = writer.add_stream("can", StreamKind::Can).expect("added");
        for number in 0..SCANS {
            let s = number as f64 / 10.0;
            let at_ns = START_NS + number * 100_000_000 / times;
            let speed_m_s = if s < 10.0 { 0.5 } else { 2.0 };
            match beside {
                Beside::Sentences => {
                    let told =
                        format!("GPVTG,0.0,T,,M,{:.3},N,{:.3},K,A", speed_m_s / 0.5144, speed_m_s * 3.6);
                    let check = told.bytes().fold(0, |check, byte| check ^ byte);
                    let line = format!("${told}*{check:02X}\r\n");
                    writer.write(gnss, Side::Device, at_ns, 0, line.as_bytes()).expect("written");
                }
                Beside::Frames => {
                    let [low, high] = ((speed_m_s * 1000.0) as u16).to_le_bytes();
                    let frame = format!("0CFE49F0#{low:02X}{high:02X}00000000FFFD");
                    writer.write(can, Side::Device, at_ns, 0, frame.as_bytes()).expect("written");
                }
                Beside::Nothing | Beside::Ticks => {}
            }
            let mut scan: LmdScandata = Telegram::parse(Dialect::A, SCAN.as_bytes())
                .expect("a telegram")
                .args
                .decode()
                .expect("a scan");
            (scan.telegram_counter, scan.scan_counter) = (number as u16, number as u16);
            scan.scan_time_us = number as u32 * 100_000;
            if beside == Beside::Ticks {
                scan.encoders = vec![Encoder { position: (y_m(s) * 1000.0) as u32, speed: 0 }];
            }
            let mut bytes = Vec::new();
            scan_event(Dialect::B, &scan, &mut bytes);
            writer.write(scanner, Side::Device, at_ns, 0, &bytes).expect("written");
        }
        writer.finish().expect("finished");
        std::fs::write(path, writer.into_inner().into_inner()).expect("kept");
    }

    #[test]
    fn a_metre_is_where_the_recording_has_it_whatever_speed_the_rig_says() {
        for (beside, times) in [
            (Beside::Ticks, 1),
            (Beside::Ticks, 4),
            (Beside::Sentences, 1),
            (Beside::Sentences, 4),
            (Beside::Frames, 1),
            (Beside::Frames, 4),
            (Beside::Nothing, 1),
            (Beside::Nothing, 4),
        ] {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("x.mcap");
            recorded(&path, beside, times);
            let survey = Survey::read(&path).expect("it can be played");
            let part = survey.choose(&[], 1).expect("a scanner").remove(0);
            let ticks = (beside == Beside::Ticks).then_some(1000.0);
            let rig = Rig { speed_m_s: 1.0, start_m: 0.0, encoder_ticks_per_m: ticks, ..Rig::default() };
            let way = RecordedWay::found(&survey, part, &rig).expect("it reads");
            assert_eq!(matches!(way, RecordedWay::OfRig), beside == Beside::Nothing, "{beside:?}");
            for metre in [1.0, 4.0, 10.0, 19.0] {
                let scan = way.scan_at(&survey, (part, &rig), metre).expect("it reads");
                let scan = scan.unwrap_or_else(|| panic!("{beside:?} × {times}: no metre {metre}")) as f64;
                let expected = match beside {
                    Beside::Nothing => 10.0 * metre,
                    _ if metre < 5.0 => 10.0 * metre / 0.5,
                    _ => 10.0 * (10.0 + (metre - 5.0) / 2.0),
                };
                assert!((scan - expected).abs() <= 1.0, "{beside:?} × {times}: metre {metre} at scan {scan}");
            }
            assert_eq!(way.scan_at(&survey, (part, &rig), 100.0).expect("it reads"), None, "{beside:?}");
        }
    }
}
