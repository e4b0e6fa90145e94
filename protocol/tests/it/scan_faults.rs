//! Telegrams that pass their checksum and whose numbers cannot be a scan.

use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::wire::FixedText;
use rowscan_protocol::telegram::{Channel, LmdScandata};
use rowscan_protocol::validity::{DeviceStatus, ScanFault};

fn telegram(channel: Channel<u16>) -> LmdScandata {
    LmdScandata { telegram_counter: 7, channels16: vec![channel], ..LmdScandata::default() }
}

fn channel() -> Channel<u16> {
    Channel {
        name: FixedText(*b"DIST1"),
        scale: 1.0,
        offset: 0.0,
        start_angle: -450_000,
        step: 5000,
        values: vec![1500; 541],
    }
}

fn fault(channel: Channel<u16>) -> &'static str {
    let before = Scan { telegram_counter: 99, ..Scan::default() };
    let mut scan = before.clone();
    let fault = telegram(channel).to_scan_into(&mut scan).unwrap_err();
    assert_eq!(scan, before, "a refused telegram leaves the scan as it was");
    fault.code()
}

#[test]
fn numbers_that_cannot_be_ranges_are_refused_by_cause() {
    for scale in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, 1e-30] {
        assert_eq!(fault(Channel { scale, ..channel() }), "scale_factor", "{scale}");
    }
    for offset in [f32::NAN, f32::INFINITY, -1e9] {
        assert_eq!(fault(Channel { offset, ..channel() }), "scale_offset", "{offset}");
    }
    assert_eq!(fault(Channel { step: 0, ..channel() }), "angular_step");
    assert_eq!(fault(Channel { values: Vec::new(), ..channel() }), "no_beams");
    for (start_angle, step) in [(i32::MAX, 5000), (i32::MIN, 5000), (-450_000, 65_535), (5_000_000, 5000)] {
        assert_eq!(fault(Channel { start_angle, step, ..channel() }), "field", "{start_angle} {step}");
    }
    let mut second = telegram(channel());
    second.channels16.push(Channel { name: FixedText(*b"DIST2"), scale: 0.0, ..channel() });
    let refused = second.to_scan_into(&mut Scan::default());
    assert!(matches!(refused, Err(ScanFault::ScaleFactor { .. })), "a later echo counts too: {refused:?}");
}

#[test]
fn what_known_devices_send_is_taken() {
    let full_turn = Channel { start_angle: 0, step: 10_000, values: vec![20; 361], ..channel() };
    let one_beam = Channel { step: 0, values: vec![20], ..channel() };
    let tenths = Channel { scale: 0.1, ..channel() };
    let doubled = Channel { scale: 2.0, ..channel() };
    for taken in [channel(), full_turn, one_beam, tenths, doubled] {
        telegram(taken).to_scan_into(&mut Scan::default()).unwrap();
    }
}

#[test]
fn layer_and_status_come_with_the_scan() {
    let mut telegram = telegram(channel());
    (telegram.layer_angle, telegram.device_status) = (-250, [0, 4]);
    let mut scan = Scan::default();
    telegram.to_scan_into(&mut scan).unwrap();
    assert_eq!((scan.layer_centideg, scan.status), (-250, DeviceStatus::ContaminationError));
}
