//! An MRS1000: layers in the recorded order, each in its telegrams, and the filter that leaves some out.

use crate::bench::Bench;
use crate::facts::recordings;
use rowscan_protocol::device::{MeasuredEcho, MeasuredLine, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::scan::{Scan, elevation_deg};
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram};

/// The next turn's telegram of lines with echoes at 2, 3 and 4 m.
fn turn(bench: &mut Bench) -> Option<LmdScandata> {
    let grid = bench.device.mirror().beams;
    let echo = |range_mm: u16| MeasuredEcho {
        range_mm: vec![range_mm; grid.len()],
        remission: vec![0x8000; grid.len()],
    };
    let echoes = [echo(2000), echo(3000), echo(4000)];
    bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes }).cloned()
}

fn layers(bench: &mut Bench, turns: usize) -> Vec<i16> {
    (0..turns).filter_map(|_| turn(bench)).map(|scan| scan.layer_angle).collect()
}

#[test]
fn layers_come_in_the_recorded_order_each_where_its_code_says() {
    let mut bench = Bench::logged_in("mrs1000");
    assert_eq!(layers(&mut bench, 9), [250, -500, 0, -250, 250, -500, 0, -250, 250]);
    assert_eq!([250, 0, -250, -500].map(elevation_deg), [-2.5, 0.0, 2.5, 5.0]);
    for _ in 0..8 {
        // What the mirror says is cast is what the telegram then says.
        let told = bench.device.mirror().layer_centideg;
        let scan = turn(&mut bench).unwrap();
        assert_eq!(scan.layer_angle, told);
        let mut meant = Scan::default();
        scan.to_scan_into(&mut meant).unwrap();
        assert_eq!(meant.layer_centideg, told);
    }
    let mut single = Bench::logged_in("lms111");
    assert_eq!(layers(&mut single, 5), [0; 5], "one plane has no layers");
}

#[test]
fn the_code_stands_in_byte_50_and_51_of_a_binary_telegram() {
    let mut bench = Bench::logged_in("mrs1000");
    for code in [250_i16, -500, 0, -250] {
        let mut bytes = Vec::new();
        scan_event(Dialect::B, &turn(&mut bench).unwrap(), &mut bytes);
        assert_eq!(bytes[50..52], code.to_be_bytes());
    }
}

#[test]
fn three_echoes_are_there_and_a_filter_leaves_one_channel() {
    let mut bench = Bench::logged_in("mrs1000");
    bench.ask("sWN LMDscandatacfg 07 00 1 0 0 00 00 0 0 0 1 +1");
    let names = |scan: &LmdScandata| -> Vec<String> {
        let wide = scan.channels16.iter().map(|channel| channel.name.to_string());
        wide.chain(scan.channels8.iter().map(|channel| channel.name.to_string())).collect()
    };
    let scan = turn(&mut bench).unwrap();
    assert_eq!(names(&scan), ["DIST1", "DIST2", "DIST3", "RSSI1", "RSSI2", "RSSI3"]);
    assert_eq!((scan.channels16[2].values[0], scan.channels8[0].values[0]), (4000, 0x80));
    bench.ask("sWN FREchoFilter 2");
    let scan = turn(&mut bench).unwrap();
    assert_eq!((names(&scan), scan.channels16[0].values[0]), (vec!["DIST1".into(), "RSSI1".into()], 4000));
    assert_eq!(bench.ask("sWN LMDscandatacfg 0F 00 1 0 0 00 00 0 0 0 1 +1"), "sFA 4", "there is no fourth");
}

#[test]
fn layers_that_are_off_are_not_sent_and_the_others_stay_in_their_turns() {
    let mut bench = Bench::logged_in("mrs1000");
    bench.table(&[
        ("sRN ScanLayerFilter", "sRA ScanLayerFilter 4 1 1 1 1"),
        ("sWN ScanLayerFilter 4 1 0 1 1", "sWA ScanLayerFilter"),
        ("sRN ScanLayerFilter", "sRA ScanLayerFilter 4 1 0 1 1"),
    ]);
    let before = turn(&mut bench).unwrap();
    assert_eq!(before.layer_angle, 250);
    assert_eq!(layers(&mut bench, 7), [-500, -250, 250, -500, -250], "the level layer is off");
    bench.ask("sWN ScanLayerFilter 4 0 1 0 0");
    let scans: Vec<_> = (0..8).filter_map(|_| turn(&mut bench)).collect();
    assert_eq!(scans.iter().map(|scan| scan.layer_angle).collect::<Vec<_>>(), [0, 0]);
    // Telegrams are counted as they are sent, turns as they are made.
    let [first, second] = [&scans[0], &scans[1]];
    assert_eq!(second.telegram_counter - first.telegram_counter, 1);
    assert_eq!(second.scan_counter - first.scan_counter, 4);
    // Every second of those that are sent.
    bench.ask("sWN ScanLayerFilter 4 1 1 0 0");
    bench.ask("sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 +2");
    assert_eq!(layers(&mut bench, 8).len(), 2);
    for wrong in ["4 0 0 0 0", "3 1 1 1", "5 1 1 1 1 1", "0"] {
        assert_eq!(bench.ask(&format!("sWN ScanLayerFilter {wrong}")), "sFA 4", "{wrong}");
    }
    assert_eq!(Bench::logged_in("lms111").ask("sWN ScanLayerFilter 1 1"), "sFA 3", "one plane has no filter");
    for model in rowscan_protocol::model::all().filter(|model| model.layers.len() == 1) {
        assert_eq!(Bench::new(model.name).ask("sRN ScanLayerFilter"), "sFA 3", "{}", model.name);
    }
}

/// The recorded MRS1104's telegrams, and ours after the same start-up: all that does not depend on what was seen, and when.
#[test]
fn our_telegrams_are_those_of_the_recorded_one() {
    let Some(recording) = recordings().into_iter().find(|found| found.name == "mrs1104_20210722") else {
        return;
    };
    let recorded = recording.index.iter().filter(|at| at.from_device).map(|at| recording.payload(at));
    let recorded = recorded.filter(|payload| payload.starts_with(b"sSN LMDscandata "));
    let mut bench = Bench::logged_in("mrs1000");
    bench.ask("sWN LMDscandatacfg 07 00 0 0 0 00 00 0 0 0 1 +1");
    bench.ask("sWN FREchoFilter 0");
    let mut count = 0;
    for payload in recorded {
        let telegram = Telegram::parse(Dialect::B, payload).unwrap();
        assert_eq!(telegram.kind, Kind::Sn);
        let mut real: LmdScandata = telegram.args.decode().unwrap();
        let mut ours = turn(&mut bench).unwrap();
        for scan in [&mut real, &mut ours] {
            scan.channels16[0].values.fill(0);
            scan.time = scan.time.map(|_| rowscan_protocol::telegram::DateTime::default());
            (scan.serial_number, scan.telegram_counter, scan.scan_counter) = (0, 0, 0);
            (scan.scan_time_us, scan.transmit_time_us) = (0, 0);
        }
        assert_eq!(ours, real, "telegram {count}");
        count += 1;
    }
    assert_eq!(count, 40);
}

/// Layout by a public client: 13 floats and a time behind the name.
#[test]
fn an_imu_event_is_read_from_byte_36_on() {
    let mut frame = Vec::new();
    let mut payload = b"sSN InertialMeasurementUnit ".to_vec();
    for number in 0..13_u8 {
        payload.extend(f32::from(number).to_be_bytes());
    }
    payload.extend(7_000_000_u32.to_be_bytes());
    rowscan_protocol::frame::encode(Dialect::B, &payload, &mut frame);
    assert_eq!(frame[36..40], 0_f32.to_be_bytes());
    let telegram = Telegram::parse(Dialect::B, &payload).unwrap();
    let read: rowscan_protocol::telegram::inertial_measurement_unit::InertialMeasurementUnit =
        telegram.args.decode().unwrap();
    assert_eq!((read.acceleration_z, read.orientation_w, read.orientation_z), (2.0, 9.0, 12.0));
    assert_eq!(read.time_us, 7_000_000);
    let mut bench = Bench::logged_in("mrs1000");
    assert_eq!(bench.ask("sEN InertialMeasurementUnit 1"), "sFA F", "as recorded");
}
