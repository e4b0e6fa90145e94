//! Telegrams of real devices: what they say, and that they are written back byte for byte.

use crate::facts::Recording;
use rowscan_protocol::device::command;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::scan::{NO_ECHO, Scan};
use rowscan_protocol::telegram::lmd_scandata::MONITOR;
use rowscan_protocol::telegram::wire::Word;
use rowscan_protocol::telegram::{Channel, Kind, LmdScandata, Telegram, encode};
use serde_json::Value;

fn parse<'a>(recording: &Recording, payload: &'a [u8]) -> Telegram<'a> {
    Telegram::parse(Dialect::B, payload).unwrap_or_else(|error| panic!("{}: {error}", recording.name))
}

fn is_scan(telegram: &Telegram<'_>) -> bool {
    telegram.kind == Kind::Sn && ["LMDscandata", MONITOR].contains(&telegram.name)
}

fn scans(recording: &Recording) -> Vec<&[u8]> {
    let payloads = recording.index.iter().map(|at| recording.payload(at));
    payloads.filter(|payload| is_scan(&parse(recording, payload))).collect()
}

#[test]
fn first_scans_say_what_the_index_says() {
    for recording in crate::facts::recordings() {
        let scans = scans(&recording);
        assert_eq!(
            scans.len() as u64,
            recording.json["scan_telegrams"].as_u64().unwrap(),
            "{}",
            recording.name
        );
        let scan: LmdScandata = parse(&recording, scans[0]).args.decode().unwrap();
        check_scan(&scan, &recording.json["first_scan"]);
    }
}

fn check_scan(scan: &LmdScandata, expected: &Value) {
    let numbers: [(&str, i64); 18] = [
        ("version", scan.version.into()),
        ("device_number", scan.device_number.into()),
        ("serial_number", scan.serial_number.into()),
        ("status1", scan.device_status[0].into()),
        ("status2", scan.device_status[1].into()),
        ("telegram_counter", scan.telegram_counter.into()),
        ("scan_counter", scan.scan_counter.into()),
        ("time_since_startup_us", scan.scan_time_us.into()),
        ("time_of_transmission_us", scan.transmit_time_us.into()),
        ("input_status1", scan.inputs[0].into()),
        ("input_status2", scan.inputs[1].into()),
        ("output_status1", scan.outputs[0].into()),
        ("output_status2", scan.outputs[1].into()),
        ("layer_angle_or_reserved", scan.layer_angle.into()),
        ("scan_frequency_1_100Hz", scan.scan_frequency.into()),
        ("measurement_frequency_100Hz", scan.measurement_frequency.into()),
        ("num_encoders", scan.encoders.len() as i64),
        ("time_flag", scan.time.is_some().into()),
    ];
    for (key, found) in numbers {
        assert_eq!(Some(found), expected[key].as_i64(), "{key}");
    }
    check_channels(&scan.channels16, &expected["channels16"]);
    check_channels(&scan.channels8, &expected["channels8"]);
    assert!(scan.position.is_none() && scan.name.is_none() && scan.comment.is_none() && scan.event.is_none());
    let time = scan.time.unwrap();
    let time: [(&str, u32); 7] = [
        ("year", time.year.into()),
        ("month", time.month.into()),
        ("day", time.day.into()),
        ("hour", time.hour.into()),
        ("minute", time.minute.into()),
        ("second", time.second.into()),
        ("microsecond", time.microsecond),
    ];
    for (key, found) in time {
        assert_eq!(Some(u64::from(found)), expected["time"][key].as_u64(), "{key}");
    }
}

fn check_channels<T: Word>(channels: &[Channel<T>], expected: &Value) {
    let expected = expected.as_array().unwrap();
    assert_eq!(channels.len(), expected.len());
    for (channel, expected) in channels.iter().zip(expected) {
        let values: Vec<u64> = channel.values.iter().map(|&value| u64::from(value.into())).collect();
        let listed = |key: &str| -> Vec<u64> {
            expected[key].as_array().unwrap().iter().map(|value| value.as_u64().unwrap()).collect()
        };
        assert_eq!(channel.name.to_string(), expected["content"].as_str().unwrap());
        assert_eq!(f64::from(channel.scale), expected["scale_factor"].as_f64().unwrap());
        assert_eq!(f64::from(channel.offset), expected["scale_offset"].as_f64().unwrap());
        assert_eq!(i64::from(channel.start_angle), expected["start_angle_1_10000deg"].as_i64().unwrap());
        assert_eq!(i64::from(channel.step), expected["step_1_10000deg"].as_i64().unwrap());
        assert_eq!(values.len() as u64, expected["count"].as_u64().unwrap());
        assert!(values.starts_with(&listed("first_values")));
        assert!(values.ends_with(&listed("last_values")));
        assert_eq!(values.iter().min().copied(), expected["min"].as_u64());
        assert_eq!(values.iter().max().copied(), expected["max"].as_u64());
        assert_eq!(Some(values.iter().sum()), expected["sum"].as_u64());
    }
}

#[test]
fn every_scan_is_written_back_byte_for_byte_directly_and_by_way_of_text() {
    for recording in crate::facts::recordings() {
        let (mut scan, mut from_text) = (LmdScandata::default(), LmdScandata::default());
        let (mut binary, mut text) = (Vec::new(), Vec::new());
        for payload in scans(&recording) {
            let telegram = parse(&recording, payload);
            telegram.args.decode_into(&mut scan).unwrap();
            binary.clear();
            encode(Dialect::B, telegram.kind, telegram.name, &scan, &mut binary);
            assert!(binary == payload, "{}", recording.name);

            text.clear();
            encode(Dialect::A, telegram.kind, telegram.name, &scan, &mut text);
            let telegram = Telegram::parse(Dialect::A, &text).unwrap();
            telegram.args.decode_into(&mut from_text).unwrap();
            binary.clear();
            encode(Dialect::B, telegram.kind, telegram.name, &from_text, &mut binary);
            assert!(binary == payload, "{} by way of text", recording.name);
        }
    }
}

#[test]
fn scans_mean_metres() {
    for recording in crate::facts::recordings() {
        let mut scan = Scan::default();
        for payload in scans(&recording) {
            let telegram: LmdScandata = parse(&recording, payload).args.decode().unwrap();
            telegram.to_scan_into(&mut scan).unwrap();
            let distance = &telegram.channels16[0];
            assert_eq!(scan.echoes.len(), 1);
            assert_eq!(scan.beams.len(), distance.values.len());
            for (range_m, &raw) in scan.echoes[0].range_m.iter().zip(&distance.values) {
                let expected = if raw < 16 { NO_ECHO } else { f64::from(raw) / 1000.0 };
                assert_eq!(*range_m, expected);
            }
            let has_remission = recording.json["first_scan"]["channels16"].as_array().unwrap().len() == 2
                || recording.json["first_scan"]["channels8"].as_array().unwrap().len() == 1;
            assert_eq!(scan.echoes[0].remission.len(), if has_remission { scan.beams.len() } else { 0 });
        }
    }
}

/// Everything recorded that the table knows is read, and written back with the same bytes.
#[test]
fn every_recorded_telegram_of_the_table_is_understood() {
    for recording in crate::facts::recordings() {
        let mut understood = 0;
        for at in &recording.index {
            let telegram = parse(&recording, recording.payload(at));
            match command::visit(&telegram, &mut ()) {
                Some(told) => {
                    understood += 1;
                    told.unwrap_or_else(|error| panic!("{} {telegram:?}: {error}", recording.name));
                }
                None => assert_eq!(telegram.name, "InertialMeasurementUnit", "{}", recording.name),
            }
        }
        assert!(understood >= recording.index.len() - 1);
    }
}
