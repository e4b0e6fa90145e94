//! What a device answers, in the words of its text dialect.

use std::time::Duration;

use crate::bench::Bench;
use rowscan_protocol::device::{AfterReply, DialectPolicy, MeasuredLine, Options, Reply, Session};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::model::MODELS;
use rowscan_protocol::time::SimTime;

#[test]
fn a_warm_lms111_tells_who_it_is() {
    Bench::new("lms111").table(&[
        ("sRN DeviceIdent", "sRA DeviceIdent 10 LMS10x_FieldEval 10 V1.36-21.10.2010"),
        ("sRI 0", "sRA 0 10 LMS10x_FieldEval 10 V1.36-21.10.2010"),
        ("sRN FirmwareVersion", "sRA FirmwareVersion 9 V1.80.2  "),
        ("sRN SerialNumber", "sRA SerialNumber 8 24070042"),
        ("sRN LocationName", "sRA LocationName B not defined"),
        ("sRN SCdevicestate", "sRA SCdevicestate 1"),
        ("sRN STlms", "sRA STlms 7 0 8 00:00:00 8 01.01.70 0 0 0"),
        ("sRN LCMstate", "sRA LCMstate 0"),
        ("sRN ODoprh", "sRA ODoprh 4D2"),
        ("sRN ODopdaily", "sRA ODopdaily 0"),
        ("sRN ODpwrc", "sRA ODpwrc 38"),
        ("sRN TSCTCtimezone", "sRA TSCTCtimezone C"),
        ("sRN TSCTCmaxoffset", "sRA TSCTCmaxoffset 00000000"),
        ("sRN TSCTCdelay", "sRA TSCTCdelay 00000000"),
        ("sRN LMPautostartmeas", "sRA LMPautostartmeas 1"),
        ("sRN LMPoutputRange", "sRA LMPoutputRange 1 1388 FFF92230 225510"),
        ("sRN LMPscancfg", "sRA LMPscancfg 1388 1 1388 FFF92230 225510"),
        ("sRN field010", "sRA field010 0"),
        ("sRN LIDinputstate", "sRA LIDinputstate 1 0 2 2 2 2 0"),
    ]);
}

#[test]
fn a_warm_lms511_reads_the_recorded_range() {
    Bench::new("lms511").table(&[
        ("sRN LMPoutputRange", "sRA LMPoutputRange 1 683 FFFF3CB0 1C3A90"),
        ("sRN FirmwareVersion", "sRA FirmwareVersion 9 V1.80    "),
    ]);
}

#[test]
fn what_it_does_not_know_is_refused_by_kind() {
    Bench::logged_in("lms111").table(&[
        ("sRN NoSuchVariable", "sFA 3"),
        ("sWN NoSuchVariable 1", "sFA 3"),
        ("sRN LMCstartmeas", "sFA 3"),
        ("sRN field030", "sFA 3"),
        ("sRN field1", "sFA 3"),
        ("sRI 7", "sFA 3"),
        ("sMN NoSuchMethod", "sFA 2"),
        ("sEN NoSuchEvent 1", "sFA F"),
        ("sEN DeviceIdent 1", "sFA F"),
        ("sWN DeviceIdent 1 X 1 Y", "sFA A"),
        ("sRIO", "sFA C"),
        ("sXY nonsense", "sFA C"),
        ("sRA DeviceIdent", "sFA C"),
    ]);
}

#[test]
fn arguments_that_make_no_sense_are_refused_by_what_is_wrong() {
    Bench::logged_in("lms111").table(&[
        ("sMN mLMPsetscancfg 1388", "sFA 8"),
        ("sMN mLMPsetscancfg \\x00\\x00\\x13\\x88", "sFA 11"),
        ("sMN SetAccessMode 3 F47247440", "sFA 10"),
        ("sWN LMDscandatacfg 01 00 1 0 0 00 00 0 0 0 1 +1 5", "sFA 7"),
        ("sEN LMDscandata 2", "sFA 5"),
        ("sEN LMDscandata", "sFA 8"),
        ("sWN LMPoutputRange 1 1388 -500000 +2250000", "sFA 4"),
        ("sWN LMPoutputRange 1 1388 +1000 -1000", "sFA 4"),
        ("sWN LMDscandatacfg 00 00 0 0 0 00 00 0 0 0 0 +1", "sFA 4"),
        ("sWN LMDscandatacfg 04 00 0 0 0 00 00 0 0 0 0 +1", "sFA 4"),
        ("sWN LMDscandatacfg 01 00 0 0 0 02 00 0 0 0 0 +1", "sFA 4"),
        ("sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 0", "sFA 4"),
        ("sWN EIHstCola 2", "sFA 4"),
        ("sMN LSPsetdatetime +2023 +2 +29 0 0 0 0", "sFA 5"),
    ]);
}

#[test]
fn writing_needs_a_login_and_run_ends_it() {
    let mut bench = Bench::new("lms111");
    bench.table(&[
        ("sWN LocationName 5 north", "sFA A"),
        ("sMN LMCstopmeas", "sFA 1"),
        ("sMN SetAccessMode 3 00000000", "sAN SetAccessMode 0"),
        ("sMN LMCstopmeas", "sFA 1"),
        ("sMN SetAccessMode 3 F4724744", "sAN SetAccessMode 1"),
        ("sRN SCdevicestate", "sRA SCdevicestate 0"),
        ("sWN LocationName 5 north", "sWA LocationName"),
        ("sRN LocationName", "sRA LocationName 5 north"),
        ("sMN Run", "sAN Run 1"),
        ("sRN SCdevicestate", "sRA SCdevicestate 1"),
        ("sWN LocationName 5 south", "sFA A"),
    ]);
}

#[test]
fn measuring_starts_and_stops() {
    let mut bench = Bench::logged_in("lms111");
    assert_eq!(bench.scans(2), 2);
    bench.table(&[
        ("sMN LMCstopmeas", "sAN LMCstopmeas 0"),
        ("sRN STlms", "sRA STlms 3 0 8 00:00:00 8 01.01.70 0 0 0"),
    ]);
    assert_eq!(bench.scans(2), 0);
    bench.table(&[("sMN LMCstartmeas", "sAN LMCstartmeas 0")]);
    assert_eq!(bench.scans(1), 1);
    let scan = bench.device.last_scan().unwrap();
    assert_eq!((scan.scan_counter, scan.telegram_counter, scan.device_status), (4, 2, [1, 0]));
    assert_eq!(bench.scans(7), 7);
    let scan = bench.device.last_scan().unwrap();
    assert_eq!((scan.device_status, scan.outputs), ([0, 0], [4, 0]));
    bench.table(&[("sMN LMCstandby", "sAN LMCstandby 0"), ("sRN SCdevicestate", "sRA SCdevicestate 3")]);
    assert_eq!(bench.scans(1), 0);
}

#[test]
fn an_lms511_keeps_counting_over_a_restart_of_the_measurement() {
    let mut bench = Bench::logged_in("lms511");
    bench.scans(10);
    bench.ask("sMN LMCstartmeas");
    bench.scans(1);
    assert_eq!(bench.device.last_scan().unwrap().scan_counter, 10);
}

#[test]
fn strict_login_holds_the_scans_until_run() {
    for (release, reply) in [("sMN Run", "sAN Run 1"), ("sMN LMCstartmeas", "sAN LMCstartmeas 0")] {
        let mut bench = Bench::new("lms111");
        bench.device = bench.device.with_options(Options { strict_login: true, ..Options::default() });
        assert_eq!(bench.scans(1), 1);
        bench.ask("sMN SetAccessMode 3 F4724744");
        assert_eq!(bench.scans(3), 0);
        bench.table(&[(release, reply)]);
        assert_eq!(bench.scans(1), 1);
    }
}

#[test]
fn a_poll_gives_the_last_scan_even_after_stopping() {
    let mut bench = Bench::logged_in("lms111");
    assert_eq!(bench.ask("sRN LMDscandata"), "sFA 4");
    bench.scans(1);
    bench.ask("sMN LMCstopmeas");
    let scan = bench.ask("sRN LMDscandata");
    assert!(scan.starts_with("sRA LMDscandata 1 1 16F479A 0 0 0 4 0 C1C 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 21D 0"));
    assert!(scan.ends_with(" 0 0 0 0 0 0 0"));
}

#[test]
fn scan_modes_are_those_of_the_table() {
    Bench::logged_in("lms111").table(&[
        (
            "sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000",
            "sAN mLMPsetscancfg 0 9C4 1 9C4 FFF92230 225510",
        ),
        (
            "sMN mLMPsetscancfg +5000 +1 +2500 -450000 +2250000",
            "sAN mLMPsetscancfg 2 9C4 1 9C4 FFF92230 225510",
        ),
        (
            "sMN mLMPsetscancfg +1000 +1 +2500 -450000 +2250000",
            "sAN mLMPsetscancfg 1 9C4 1 9C4 FFF92230 225510",
        ),
        (
            "sMN mLMPsetscancfg +5000 +1 +3333 -450000 +2250000",
            "sAN mLMPsetscancfg 2 9C4 1 9C4 FFF92230 225510",
        ),
        ("sMN mLMPsetscancfg +1 +1 +1 -450000 +2250000", "sAN mLMPsetscancfg 3 9C4 1 9C4 FFF92230 225510"),
        ("sMN mLMPsetscancfg +5000 0", "sAN mLMPsetscancfg 5 9C4 1 9C4 FFF92230 225510"),
        ("sRN LMPscancfg", "sRA LMPscancfg 9C4 1 9C4 FFF92230 225510"),
    ]);
}

#[test]
fn a_restart_forgets_what_was_not_saved_and_drops_the_connection() {
    let mut bench = Bench::logged_in("lms111");
    bench.table(&[
        ("sWN LocationName 5 saved", "sWA LocationName"),
        ("sMN mEEwriteall", "sAN mEEwriteall 1"),
        ("sWN LocationName 4 lost", "sWA LocationName"),
    ]);
    bench.now = SimTime(5_000_000_000);
    let reply = bench.send(b"\x02sMN mSCreboot\x03\x02sRN DeviceIdent\x03");
    let expected = Reply {
        bytes: b"\x02sAN mSCreboot\x03".to_vec(),
        delay: Duration::ZERO,
        after: Some(AfterReply::Close),
    };
    assert_eq!(reply, [expected]);
    bench.session = Session::new(DialectPolicy::Auto);
    assert_eq!(bench.ask("sRN LocationName"), "sRA LocationName 5 saved");
    bench.now = SimTime(6_000_000_000);
    bench.scans(1);
    assert_eq!(bench.device.last_scan().unwrap().scan_time_us, 1_000_000);
}

#[test]
fn the_calendar_starts_in_1970_and_can_be_set() {
    let mut bench = Bench::logged_in("lms111");
    bench.ask("sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 1 +1");
    bench.now = SimTime::ZERO + Duration::from_secs(86_400 + 3661);
    bench.table(&[
        ("sRN LSPdatetime", "sRA LSPdatetime 7B2 1 2 1 1 1 0"),
        ("sMN LSPsetdatetime +2024 +2 +28 +23 +59 +59 +0", "sAN LSPsetdatetime 1"),
    ]);
    bench.now = bench.now + Duration::from_secs(1);
    bench.scans(1);
    let time = bench.device.last_scan().unwrap().time.unwrap();
    assert_eq!((time.year, time.month, time.day, time.hour), (2024, 2, 29, 0));
}

/// A client sets another scan mode after the line was cast and before the device has it.
#[test]
fn a_line_keeps_the_beams_it_was_cast_with() {
    use rowscan_protocol::device::MeasuredEcho;
    let mut bench = Bench::logged_in("lms111");
    let grid = bench.device.mirror().beams;
    let echoes = [MeasuredEcho { range_mm: (1000..).take(grid.len()).collect(), ..MeasuredEcho::default() }];
    let set = bench.ask("sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000");
    assert!(set.starts_with("sAN mLMPsetscancfg 0 "), "{set}");
    assert_ne!(bench.device.mirror().beams, grid);
    let scan = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes }).unwrap();
    let channel = &scan.channels16[0];
    assert_eq!((channel.start_angle, channel.step), (grid.start, grid.step));
    assert_eq!(channel.values, echoes[0].range_mm);
    // 50 Hz with 0.5 degrees is 360; the mirror turns at 25 Hz already.
    assert_eq!((scan.scan_frequency, scan.measurement_frequency), (2500, 180));
}

#[test]
fn a_mean_is_not_made_of_lines_with_different_beams() {
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::device::MeasuredEcho;
    let mut bench = Bench::logged_in("lms111");
    bench.ask("sWN LFPmeanfilter 1 +2 0");
    let grid = bench.device.mirror().beams;
    let moved = BeamGrid { start: grid.start + 2500, ..grid };
    let mut measure = |grid: BeamGrid, mm: u16| {
        let echoes = [MeasuredEcho { range_mm: vec![mm; grid.len()], ..MeasuredEcho::default() }];
        let scan = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes });
        scan.map(|scan| scan.channels16[0].values[1])
    };
    assert_eq!([measure(grid, 1000), measure(moved, 2000), measure(moved, 3000)], [None, None, Some(2500)]);
}

/// Whatever output range and scan mode are accepted, scans have values.
#[test]
fn no_scan_is_without_a_beam() {
    let mut bench = Bench::logged_in("lms111");
    // Between two beams of 0.5 degrees.
    assert_eq!(bench.ask("sWN LMPoutputRange 1 1388 +12345 +13000"), "sFA 4");
    assert_eq!(bench.ask("sRN LMPoutputRange"), "sRA LMPoutputRange 1 1388 FFF92230 225510");
    // Around one beam of 0.25 degrees, which the coarser grid does not have.
    let set = bench.ask("sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000");
    assert!(set.starts_with("sAN mLMPsetscancfg 0 "), "{set}");
    assert_eq!(bench.ask("sWN LMPoutputRange 1 9C4 +12345 +13000"), "sWA LMPoutputRange");
    let set = bench.ask("sMN mLMPsetscancfg +2500 +1 +5000 -450000 +2250000");
    assert!(set.starts_with("sAN mLMPsetscancfg 4 9C4 1 9C4 "), "{set}");
    let grid = bench.device.mirror().beams;
    let scan = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &[] }).unwrap();
    let channel = &scan.channels16[0];
    assert_eq!((channel.start_angle, channel.values.len()), (12_500, 1));
}

#[test]
fn an_output_range_reads_back_as_it_was_written_and_the_beams_stay() {
    let mut bench = Bench::logged_in("lms111");
    assert_eq!(bench.ask("sWN LMPoutputRange 1 9C4 FFF92233 22550D"), "sWA LMPoutputRange");
    assert_eq!(bench.ask("sRN LMPoutputRange"), "sRA LMPoutputRange 1 9C4 FFF92233 22550D");
    let grid = bench.device.mirror().beams;
    let scan = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &[] }).unwrap();
    let channel = &scan.channels16[0];
    assert_eq!((channel.start_angle, channel.step, channel.values.len()), (-450_000, 5000, 541));
    // Saved as well; a new scan mode brings its own step.
    bench.ask("sMN mEEwriteall");
    bench.ask("sMN mSCreboot");
    bench.session = Session::new(DialectPolicy::Auto);
    assert_eq!(bench.ask("sRN LMPoutputRange"), "sRA LMPoutputRange 1 9C4 FFF92233 22550D");
    bench.ask("sMN SetAccessMode 3 F4724744");
    bench.ask("sMN mLMPsetscancfg +2500 +1 +5000 -450000 +2250000");
    assert_eq!(bench.ask("sRN LMPoutputRange"), "sRA LMPoutputRange 1 1388 FFF92233 22550D");
}

#[test]
fn the_echo_filter_picks_the_last_echo_of_each_beam() {
    use rowscan_protocol::device::MeasuredEcho;
    let mut bench = Bench::logged_in("lms511");
    bench.ask("sWN LMDscandatacfg 1F 00 0 0 0 00 00 0 0 0 0 +1");
    let beams = bench.device.mirror().beams.len();
    let echo = |mm: &[u16]| MeasuredEcho {
        range_mm: mm.iter().copied().cycle().take(beams).collect(),
        ..MeasuredEcho::default()
    };
    let echoes = [echo(&[1000, 2000, 0]), echo(&[1500, 0, 0])];
    for (filter, channels, expected) in
        [(0, 1, [1000, 2000, 0]), (1, 5, [1000, 2000, 0]), (2, 1, [1500, 2000, 0])]
    {
        assert_eq!(bench.ask(&format!("sWN FREchoFilter {filter}")), "sWA FREchoFilter");
        let scan = bench
            .device
            .measure(bench.now, &MeasuredLine { grid: bench.device.mirror().beams, echoes: &echoes })
            .unwrap();
        assert_eq!(scan.channels16.len(), channels);
        assert_eq!(scan.channels16[0].values[..3], expected);
    }
}

#[test]
fn a_filter_that_leaves_one_echo_sends_it_whatever_the_mask_says() {
    use rowscan_protocol::device::MeasuredEcho;
    for model in ["lms111", "lms511"] {
        let mut bench = Bench::logged_in(model);
        assert_eq!(bench.ask("sWN LMDscandatacfg 02 00 1 0 0 00 00 0 0 0 0 +1"), "sWA LMDscandatacfg");
        let grid = bench.device.mirror().beams;
        let echoes = [1000, 1500]
            .map(|mm| MeasuredEcho { range_mm: vec![mm; grid.len()], remission: vec![0x1234; grid.len()] });
        for (filter, name, expected) in [(0, "DIST1", 1000), (1, "DIST2", 1500), (2, "DIST1", 1500)] {
            bench.ask(&format!("sWN FREchoFilter {filter}"));
            let scan = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes }).unwrap();
            assert_eq!((scan.channels16.len(), scan.channels8.len()), (1, 1), "{model}, filter {filter}");
            let channel = &scan.channels16[0];
            assert_eq!((channel.name.0.as_slice(), channel.values[0]), (name.as_bytes(), expected));
        }
    }
}

#[test]
fn a_dazzled_beam_has_distance_code_1_and_the_highest_remission_and_spoils_no_mean() {
    use rowscan_protocol::device::MeasuredEcho;
    use rowscan_protocol::optics::DAZZLED;
    let mut bench = Bench::logged_in("lms111");
    bench.ask("sWN LMDscandatacfg 01 00 1 1 0 00 00 0 0 0 0 +1");
    let grid = bench.device.mirror().beams;
    let beams = |values: [u16; 4]| values.into_iter().cycle().take(grid.len()).collect();
    let mut told = |filter: &str, ranges: [u16; 4], remissions: [u16; 4]| {
        bench.ask(filter);
        let echoes = [MeasuredEcho { range_mm: beams(ranges), remission: beams(remissions) }];
        let scan = bench.device.measure(bench.now, &MeasuredLine { grid, echoes: &echoes })?;
        Some([scan.channels16[0].values[..4].to_vec(), scan.channels16[1].values[..4].to_vec()])
    };
    // Dazzled, nothing, a reflector, a leaf.
    let (ranges, remissions) = ([0, 0, 3000, 2000], [DAZZLED, 0, DAZZLED, 30_000]);
    let plain = told("sWN FREchoFilter 0", ranges, remissions).unwrap();
    assert_eq!(plain, [vec![1, 0, 3000, 2000], remissions.to_vec()]);
    assert_eq!(told("sWN FREchoFilter 2", ranges, remissions).unwrap(), plain);
    // Of two scans, one dazzled: the other's range stands.
    assert_eq!(told("sWN LFPmeanfilter 1 +2 0", ranges, remissions), None);
    let mean = told("sRN SCdevicestate", [1000, 0, 3000, 2000], [20_000, 0, 30_000, 30_000]).unwrap();
    assert_eq!(mean[0], [1000, 0, 3000, 2000]);
}

/// The payloads of all replies, in one dialect.
fn payloads(dialect: Dialect, replies: &[Reply]) -> Vec<Vec<u8>> {
    let mut decoder = FrameDecoder::new(Accept::Only(dialect), 4096);
    replies.iter().for_each(|reply| decoder.push(&reply.bytes));
    std::iter::from_fn(|| decoder.next_frame().map(|frame| frame.payload.to_vec())).collect()
}

#[test]
fn the_first_valid_frame_decides_the_dialect_of_a_connection() {
    let mut bench = Bench::new("lms111");
    let mut binary = Vec::new();
    encode(Dialect::B, b"sRN SCdevicestate", &mut binary);
    let replies = bench.send(&[b"\0\0".as_slice(), &binary, b"\x02sRN SCdevicestate\x03"].concat());
    assert_eq!(payloads(Dialect::B, &replies), [b"sRA SCdevicestate \x01"]);
    assert_eq!((bench.session.dialect(), bench.session.counts().frames), (Dialect::B, 1));
}

#[test]
fn eihst_cola_answers_in_the_old_dialect_and_switches_after() {
    let mut bench = Bench::new("lms111");
    bench.session = Session::new(DialectPolicy::Strict(Dialect::A));
    bench.ask("sMN SetAccessMode 3 F4724744");
    assert_eq!(bench.ask("sWN EIHstCola 1"), "sWA EIHstCola");
    assert!(bench.send(b"\x02sRN DeviceIdent\x03").is_empty());
    let mut binary = Vec::new();
    encode(Dialect::B, b"sRN EIHstCola", &mut binary);
    assert_eq!(payloads(Dialect::B, &bench.send(&binary)), [b"sRA EIHstCola \x01"]);
    // And so do connections that begin now.
    bench.session = Session::new(DialectPolicy::Strict(Dialect::A));
    assert_eq!(payloads(Dialect::B, &bench.send(&binary)).len(), 1);
}

#[test]
fn binary_replies_to_writes_end_in_a_blank_where_recorded() {
    let mut bench = Bench::new("lms111");
    let mut requests = Vec::new();
    encode(Dialect::B, b"sMN SetAccessMode \x03\xF4\x72\x47\x44", &mut requests);
    encode(Dialect::B, b"sWN LMDscandatacfg \x01\0\x01\0\0\0\0\0\0\0\x01\0\x01", &mut requests);
    encode(Dialect::B, b"sWN FREchoFilter \x02", &mut requests);
    encode(Dialect::B, b"sRN nothing", &mut requests);
    let replies = bench.send(&requests);
    let expected: [&[u8]; 4] =
        [b"sAN SetAccessMode \x01", b"sWA LMDscandatacfg ", b"sWA FREchoFilter", b"sFA\0\x03"];
    assert_eq!(payloads(Dialect::B, &replies), expected);
}

#[test]
fn a_thousand_requests_in_one_write_get_a_thousand_replies() {
    for model in MODELS {
        let mut bench = Bench::new(model.name);
        assert_eq!(bench.send(&b"\x02sRN DeviceIdent\x03".repeat(1000)).len(), 1000);
    }
}
