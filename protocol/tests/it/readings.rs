//! Readings of inertial measurement units and encoders, as a host's session hears them.

use core::time::Duration;

use rowscan_protocol::client::ColaClient;
use rowscan_protocol::compact::{Encoder, Imu, Telegram as Compact};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::reading::{ImuReading, Reading, ReadingCounts, WheelReading};
use rowscan_protocol::telegram::inertial_measurement_unit::InertialMeasurementUnit;
use rowscan_protocol::telegram::{Kind, Variable, encode_frame};

use crate::datagrams::heard;

fn readings(events: &[HostEvent]) -> Vec<Reading> {
    let reading = |event: &HostEvent| match event {
        HostEvent::Reading(reading) => Some(*reading),
        _ => None,
    };
    events.iter().filter_map(reading).collect()
}

#[test]
fn datagrams_of_imu_and_encoder_are_told_in_their_order() {
    let imu = |time_us: u64| Imu {
        acceleration_m_s2: [0.5, -0.25, 9.81],
        rate_rad_s: [0.1, 0.2, -0.3],
        orientation_wxyz: [1.0, 0.0, 0.5, 0.25],
        time_us,
        ..Imu::default()
    };
    let wheel =
        Encoder { tick: 4_000_000_000, speed: -1.5, tick_time_us: 7, ref1_time_us: 5, ..Encoder::default() };
    let telegrams = [Compact::Imu(imu(5_000_000_000)), Compact::Encoder(wheel), Compact::Imu(imu(6))];
    let mut datagrams = telegrams.map(|telegram| {
        let mut bytes = Vec::new();
        telegram.encode(&mut bytes).unwrap();
        bytes
    });
    let told = |time_us: u64| {
        Reading::Imu(ImuReading {
            time_us,
            acceleration_m_s2: [0.5, -0.25, 9.81],
            rate_rad_s: [0.1, 0.2, -0.3],
            orientation_wxyz: [1.0, 0.0, 0.5, 0.25],
        })
    };
    let told_wheel = Reading::Wheel(WheelReading { time_us: 7, tick: 4_000_000_000, speed: -1.5 });
    let mut events = Vec::new();
    let (scans, _) = heard(&datagrams, |event| events.push(event));
    assert!(scans.is_empty());
    assert_eq!(readings(&events), [told(5_000_000_000), told_wheel, told(6)]);
    let mut counts = ReadingCounts::default();
    readings(&events).iter().for_each(|reading| counts.count(reading));
    assert_eq!(counts, ReadingCounts { imu: 2, wheel: 1, unreadable: 0 });
    // The twin: one that is damaged is no reading, and is counted as a bad telegram.
    datagrams[1][40] ^= 1;
    let mut events = Vec::new();
    let (_, listener) = heard(&datagrams, |event| events.push(event));
    assert_eq!(readings(&events), [told(5_000_000_000), told(6)]);
    assert_eq!(listener.counts().bad, 1);
}

#[test]
fn an_mrs1000_s_event_is_a_reading_and_a_short_one_is_told_as_unreadable() {
    let event = InertialMeasurementUnit {
        acceleration_x: 1.0,
        acceleration_y: 2.0,
        acceleration_z: 3.0,
        rate_x: 4.0,
        rate_y: 5.0,
        rate_z: 6.0,
        magnetic_x: 7.0,
        magnetic_y: 8.0,
        magnetic_z: 9.0,
        orientation_w: 10.0,
        orientation_x: 11.0,
        orientation_y: 12.0,
        orientation_z: 13.0,
        time_us: 14,
    };
    for dialect in [Dialect::A, Dialect::B] {
        let mut bytes = Vec::new();
        encode_frame(dialect, Kind::Sn, InertialMeasurementUnit::NAME, &event, &mut bytes);
        // One value, where there are fourteen.
        rowscan_protocol::frame::encode(dialect, b"sSN InertialMeasurementUnit 1", &mut bytes);
        let mut client = ColaClient::listen(65_536);
        client.handle_bytes(Duration::ZERO, &bytes);
        client.handle_end();
        let events: Vec<HostEvent> = std::iter::from_fn(|| client.poll_event()).collect();
        let told = ImuReading {
            time_us: 14,
            acceleration_m_s2: [1.0, 2.0, 3.0],
            rate_rad_s: [4.0, 5.0, 6.0],
            orientation_wxyz: [10.0, 11.0, 12.0, 13.0],
        };
        assert_eq!(readings(&events), [Reading::Imu(told), Reading::Unreadable], "{dialect}");
    }
}
