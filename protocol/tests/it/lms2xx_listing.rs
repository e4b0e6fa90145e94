//! The LMS2xx held against SICK's telegram listing: its commands, its example frames, its tables of rates and frame sizes, its timing.

use std::time::Duration;

use rowscan_protocol::device::Profile;
use rowscan_protocol::lms2xx::device::{Beams, Device, Options, Start, Sweep};
use rowscan_protocol::lms2xx::firmware::Firmware;
use rowscan_protocol::lms2xx::frame::{FrameDecoder, Listener, Received, checksum, encode};
use rowscan_protocol::lms2xx::listing::{LISTING, SentIn};
use rowscan_protocol::lms2xx::values::{Output, Span, Values};
use rowscan_protocol::lms2xx::{Rate, Variant, model};
use rowscan_protocol::time::SimTime;

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn device(name: &str, options: Options) -> Device {
    let model = model::MODELS.iter().find(|model| model.name == name).unwrap();
    Device::new(model, options)
}

fn request(body: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    encode(0, body, &mut frame);
    frame
}

/// A device with its line: what is sent is collected.
struct Bench {
    device: Device,
    now: SimTime,
}

impl Bench {
    fn new(name: &str, options: Options) -> Self {
        Self { device: device(name, options), now: SimTime::ZERO }
    }

    fn installed(name: &str, options: Options) -> Self {
        Self::new(name, Options { start: Start::Installation, ..options })
    }

    /// Looks as often as the plan says, and puts the telegram on the line.
    fn measure(&mut self) -> Option<Sweep> {
        let sweep = self.device.plan(self.now)?;
        for turn in sweep.turns() {
            let count = self.device.turn_beams(turn).len();
            let beams = Beams { range_mm: &vec![2000; count], remission: &vec![0x8000; count] };
            self.device.measure(sweep, turn, beams);
        }
        self.now = self.now.max(sweep.done());
        self.device.finish(self.now, sweep);
        Some(sweep)
    }

    fn sent(&mut self) -> Option<Vec<u8>> {
        self.device.handle_timeout(self.now);
        let sent = self.device.poll_transmit(self.now)?;
        self.device.transmitted(self.now);
        Some(sent)
    }

    /// The body of the reply to a request, after its `06`.
    fn ask(&mut self, body: &[u8]) -> Vec<u8> {
        self.device.handle_bytes(self.now, Duration::ZERO, &request(body));
        assert_eq!(self.sent(), Some(vec![0x06]), "{body:02X?}");
        if let Some(reply) = self.sent() {
            return body_of(&reply);
        }
        self.measure().unwrap_or_else(|| panic!("no reply to {body:02X?}"));
        body_of(&self.sent().unwrap())
    }
}

fn body_of(frame: &[u8]) -> Vec<u8> {
    let mut decoder = FrameDecoder::new(Listener::Host);
    decoder.push(frame);
    let Some(Received::Frame(frame)) = decoder.next_received() else { panic!("no frame: {frame:02X?}") };
    frame.body.to_vec()
}

#[test]
fn every_command_is_answered_as_the_table_says() {
    for line in LISTING {
        let mut bench = match line.sent_in {
            SentIn::Monitoring => Bench::new(line.model, Options::default()),
            SentIn::Installation => Bench::installed(line.model, Options::default()),
        };
        let reply = bench.ask(line.example);
        assert!(
            reply.starts_with(line.reply),
            "{}: {reply:02X?}, expected {:02X?}",
            line.command,
            line.reply
        );
    }
}

/// Requests and replies that the listing prints, with checksums that fit (addenda, part G).
#[test]
fn printed_frames_are_sent_bit_by_bit() {
    let frame = |bench: &mut Bench, body: &[u8]| {
        let mut frame = Vec::new();
        encode(0x80, &bench.ask(body), &mut frame);
        frame
    };
    let mut lms200 = Bench::installed("lms200", Options::default());
    let mut lms291 = Bench::installed("lms291", Options::default());
    assert_eq!(frame(&mut lms291, &[0x41, 1]), bytes("02 80 03 00 C1 01 10 90 C8"));
    assert_eq!(frame(&mut lms291, &[0x66, 1]), bytes("02 80 04 00 E6 01 01 10 CF FD"));
    assert_eq!(frame(&mut lms291, &[0x66, 0]), bytes("02 80 04 00 E6 01 00 10 CD FC"));
    assert_eq!(frame(&mut lms291, b"\x42\x00\x00SICK_LMS"), bytes("02 80 04 00 C2 02 00 10 E1 6B"));
    assert_eq!(frame(&mut lms291, &[0x4A]), bytes("02 80 05 00 CA 01 01 01 10 2C B8"));
    assert!(frame(&mut lms291, &[0x7B]).ends_with(&bytes("10 AE F0")));
    // The defaults of table 7-122, all contours from 80° to 100°.
    assert!(frame(&mut lms200, &[0x74]).ends_with(&bytes("10 0A 2F")));
    assert!(frame(&mut lms291, &[0x74]).ends_with(&bytes("10 AA 4F")));
    let old = Options { firmware: Some(Firmware::V0210), ..Options::default() };
    let mut old = Bench::new("lms200", old);
    let text =
        bytes("02 80 17 00 BA 4C 4D 53 32 30 30 3B 33 30 31 30 36 33 3B 56 30 32 2E 31 30 20 10 22 61");
    assert_eq!(frame(&mut old, &[0x3A]), text);
    // A block of 32 bytes, and what was asked of it by the Quick Manual's own telegram.
    assert_eq!(&frame(&mut old, &[0x74])[..5], bytes("02 80 22 00 F4"));
    let write = bytes(
        "02 00 21 00 77 00 00 00 00 00 00 01 00 00 02 02 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 FC 7E",
    );
    assert_eq!(u16::from_le_bytes(*write.last_chunk().unwrap()), checksum(&write[..write.len() - 2]));
    old.ask(b"\x20\x00SICK_LMS");
    let reply = old.ask(&write[4..write.len() - 2]);
    assert_eq!((reply.len(), &reply[..4]), (0x23, &bytes("F7 01 00 00")[..]));
}

/// The status, where the listing names a value (tables 7-32 to 7-34).
#[test]
fn the_status_has_the_listed_values() {
    let mut bench = Bench::new("lms200", Options { stored_rate: Rate::R38400, ..Options::default() });
    let body = bench.ask(&[0x31]);
    assert_eq!(body.len(), 154);
    let word = |at: usize| u16::from_le_bytes([body[at], body[at + 1]]);
    assert_eq!(&body[1..8], b"V02.30 ");
    assert_eq!((body[8], word(67), word(107), word(109)), (0x25, 148, 180, 50));
    assert_eq!((body[10..18].to_vec(), body[18]), (vec![0; 8], 0), "reserved; no special device");
    assert_eq!((body[111], word(112), word(116)), (2, 2, 0x8019));
    assert_eq!((body[118], body[119], body[121], body[122], body[123]), (2, 1, 1, 1, 1));
    assert_eq!(Bench::installed("lms291", Options::default()).ask(&[0x31])[8], 0);
    let mut bench = Bench::new("lms200", Options::default());
    bench.ask(&[0x20, 0x10]);
    assert_eq!(bench.ask(&[0x31])[8], 0x10);
}

/// Table 10-17: one scan in every so many is sent. Table 10-16: bytes of its frames, without indices and with them.
#[test]
fn rates_and_frame_sizes_are_the_listings() {
    let all: &[u8] = &[0x20, 0x24];
    let (quarter, half, whole) = ([0x64, 0, 25, 0], [0xB4, 0, 50, 0], [0xB4, 0, 100, 0]);
    type Row<'a> = (&'a str, Option<[u8; 4]>, &'a [u8], [u64; 3], usize);
    let rows: [Row<'_>; 5] = [
        ("lms291", Some(quarter), all, [16, 8, 4], 812),
        ("lms291", Some(half), all, [29, 15, 8], 732),
        ("lms291", Some(whole), all, [30, 15, 8], 372),
        ("lms291", None, &[0x20, 0x2A], [30, 15, 8], 372),
        ("lms291-s14", None, &[0x20, 0x50, 1, 0, 0xB5, 0], [44, 22, 11], 559),
    ];
    for (name, variant, stream, expected, size) in rows {
        for (stored_rate, one_in) in [Rate::R9600, Rate::R19200, Rate::R38400].into_iter().zip(expected) {
            for indices in [0, 2] {
                let options = Options { stored_rate, ..Options::default() };
                let mut bench = Bench::installed(name, options);
                bench.ask(&[0x77, 0, 0, 0x46, 0, indices]);
                if let Some(variant) = variant {
                    assert_eq!(bench.ask(&[&[0x3B][..], &variant].concat())[1], 1);
                }
                bench.ask(stream);
                let mut firsts = Vec::new();
                for _ in 0..5 {
                    let sweep = bench.measure().unwrap();
                    let telegram = bench.sent().unwrap();
                    // The first partial scan has one value more than the others.
                    let sizes = [size, size - 2].map(|size| size + usize::from(indices));
                    let partial = stream[1] == 0x2A;
                    assert!(telegram.len() == sizes[0] || partial && telegram.len() == sizes[1]);
                    // The listing's table is of frames without indices.
                    bench.now = bench.now + stored_rate.transmission(telegram.len());
                    firsts.push((sweep.first, u64::from(sweep.turns)));
                }
                if indices == 0 {
                    // Partial scans without the last value are 2 bytes shorter, and one turn sooner there at 9600.
                    let sooner = u64::from(stream[1] == 0x2A && stored_rate == Rate::R9600);
                    let apart: Vec<u64> =
                        firsts.windows(2).map(|pair| (pair[1].0 - pair[0].0) / pair[0].1).collect();
                    assert_eq!(apart[0], one_in, "{name} {stored_rate}");
                    assert!(
                        apart.iter().all(|scans| *scans + sooner >= one_in && *scans <= one_in),
                        "{apart:?}"
                    );
                }
            }
        }
    }
}

/// A public driver sets 100°/0.25° and then asks for partial scans.
#[test]
fn partial_scans_are_over_180_degrees_whatever_the_variant() {
    for variant in [[0x64, 0, 25, 0], [0x64, 0, 100, 0], [0xB4, 0, 50, 0]] {
        let mut bench = Bench::new("lms200", Options::default());
        assert_eq!(bench.ask(&[&[0x3B][..], &variant].concat())[1], 1);
        bench.ask(&[0x20, 0x2A]);
        for (part, count) in [(0, 181), (1, 180), (2, 180), (3, 180), (0, 181)] {
            let sweep = bench.device.plan(bench.now).unwrap();
            let beams = bench.device.turn_beams(sweep.first);
            assert_eq!((beams.start, beams.step), (part * 2500, 10_000));
            bench.measure();
            let mut values = Values::default();
            values.decode_into(&body_of(&bench.sent().unwrap())).unwrap();
            assert_eq!((values.output, values.word.partial), (Output::Partial, Some(part as u8)));
            assert_eq!(values.values.len(), count);
        }
        // The variant is what it was.
        let status = bench.ask(&[0x31]);
        assert_eq!((&status[107..109], &status[109..111]), (&variant[..2], &variant[2..]));
    }
}

/// Scan index, then telegram index: two bytes behind the values of every telegram, or none.
#[test]
fn indices_are_two_bytes_and_old_firmware_has_none() {
    for (firmware, bytes) in [(Firmware::V0230, 734), (Firmware::V0210, 732)] {
        let options = Options { firmware: Some(firmware), ..Options::default() };
        let mut bench = Bench::installed("lms200", options);
        bench.ask(&[0x77, 0, 0, 0x46, 0, 0x02]);
        let body = bench.ask(&[0x30, 1]);
        assert_eq!(body.len() + 6, bytes);
        let mut values = Values::default();
        values.decode_into(&body).unwrap();
        let again = bench.ask(&[0x36, 2]);
        let mut mean = Values::default();
        mean.decode_into(&again).unwrap();
        match firmware {
            Firmware::V0210 => assert_eq!((values.real_time_index, values.telegram_index), (None, None)),
            _ => {
                assert_eq!((values.telegram_index, mean.telegram_index), (Some(1), Some(2)));
                assert_eq!(mean.real_time_index, values.real_time_index.map(|index| index + 4));
            }
        }
    }
}

#[test]
fn range_and_reflectivity_come_in_pairs() {
    let mut bench = Bench::new("lms200", Options::default());
    let parts: &[u8] = &[2, 0, 1, 0, 3, 0, 0x10, 0, 0x10, 0];
    let body = bench.ask(&[&[0x75][..], parts].concat());
    // Number of parts; first, last, number of pairs in millimetres, pairs; the same for the second; status.
    assert_eq!(&body[..9], &[0xF5, 2, 0, 1, 0, 3, 0, 3, 0x40]);
    assert_eq!(body.len(), 1 + 2 + (6 + 3 * 4) + (6 + 4) + 1);
    let mut values = Values::default();
    values.decode_into(&body).unwrap();
    assert_eq!((values.values.as_slice(), values.part_reflectivity.len()), (&[2000; 4][..], 4));
    assert!(values.part_reflectivity.iter().all(|value| (1..=13_200).contains(value)));
    let mut again = Vec::new();
    values.encode(&mut again);
    assert_eq!(again, body);
    // None, and more than five, are refused.
    assert_eq!(bench.ask(&[0x75, 0, 0]), [0x92, 0x10]);
    assert_eq!(bench.ask(&[&[0x75, 6, 0][..], &[1, 0, 2, 0].repeat(6)].concat()), [0x92, 0x10]);
}

/// At 9600 a scan of 361 values is on the line for 763 ms; the `06` has 60 ms.
#[test]
fn a_request_interrupts_what_is_being_sent() {
    let mut bench = Bench::new("lms200", Options::default());
    bench.ask(&[0x20, 0x24]);
    bench.measure();
    let scan = bench.device.poll_transmit(bench.now).unwrap();
    assert_eq!(scan.len(), 732);
    assert!(!bench.device.interrupts());
    // 100 bytes later a request comes.
    bench.now = bench.now + Rate::R9600.transmission(100);
    bench.device.handle_bytes(bench.now, Duration::ZERO, &request(&[0x20, 0x25]));
    assert!(bench.device.interrupts(), "the rest is not sent");
    bench.device.transmitted(bench.now);
    assert_eq!(bench.sent(), Some(vec![0x06]));
    assert!(!bench.device.interrupts());
    assert_eq!(body_of(&bench.sent().unwrap()), [0xA0, 0, 0x10]);
    // So does a broken one.
    bench.ask(&[0x20, 0x24]);
    bench.measure();
    bench.device.poll_transmit(bench.now).unwrap();
    bench.device.handle_bytes(bench.now, Duration::ZERO, &bytes("02 00 02 00 20 25 00 00"));
    assert!(bench.device.interrupts());
    bench.device.transmitted(bench.now);
    assert_eq!(bench.sent(), Some(vec![0x15]));
    // A change of the rate is told to its end.
    bench.device.handle_bytes(bench.now, Duration::ZERO, &request(&[0x20, 0x40]));
    assert_eq!(bench.sent(), Some(vec![0x06]));
    bench.device.poll_transmit(bench.now).unwrap();
    bench.device.handle_bytes(bench.now, Duration::ZERO, &request(&[0x31]));
    assert!(!bench.device.interrupts());
}

/// Two public clients wait for 2.4 and 2.5 s in all; the listing allows 7 s only where the unit changes.
#[test]
fn a_write_of_the_configuration_takes_long_only_where_the_unit_changes() {
    let write_in = |bench: &mut Bench, unit: u8| {
        let body = [0x77, 0, 0, 0x46, 0, 0, 6, unit];
        bench.device.handle_bytes(bench.now, Duration::ZERO, &request(&body));
        assert_eq!(bench.sent(), Some(vec![0x06]));
        let due = bench.device.poll_timeout().unwrap();
        let took = due.0 - bench.now.0;
        // What is sent meanwhile is not heard.
        let meanwhile = bench.now + Duration::from_millis(200);
        bench.device.handle_bytes(meanwhile, Duration::ZERO, &request(&[0x31]));
        bench.now = due;
        assert_eq!(body_of(&bench.sent().unwrap())[..2], [0xF7, 1]);
        assert_eq!(bench.sent(), None);
        Duration::from_nanos(took)
    };
    let options = Options { profile: Profile::Field, ..Options::default() };
    let mut bench = Bench::installed("lms200", options);
    assert_eq!(write_in(&mut bench, 1), Duration::from_millis(400));
    assert_eq!(write_in(&mut bench, 0), Duration::from_secs(7));
    let mut bench = Bench::installed("lms200", Options { save: Some(Duration::from_secs(1)), ..options });
    assert_eq!(write_in(&mut bench, 0), Duration::from_secs(1));
}

/// 143 and 323 ms were seen between two bytes of a client on a busy host.
#[test]
fn on_the_bench_a_busy_client_may_take_its_time() {
    for (profile, pause_ms, answered) in [
        (Profile::Bench, 323, true),
        (Profile::Bench, 600, false),
        (Profile::Field, 5, true),
        (Profile::Field, 8, false),
    ] {
        let mut bench = Bench::new("lms200", Options { profile, ..Options::default() });
        for byte in request(&[0x31]) {
            bench.device.handle_bytes(bench.now, Duration::ZERO, &[byte]);
            bench.now = bench.now + Duration::from_millis(pause_ms);
        }
        assert_eq!(bench.sent().is_some(), answered, "{profile:?}, {pause_ms} ms");
    }
}

#[test]
fn what_is_permanent_is_there_after_a_restart_and_nothing_else() {
    let mut bench = Bench::new("lms291", Options::default());
    bench.ask(&[0x20, 0x48]);
    assert_eq!(bench.device.rate(), Rate::R500000);
    bench.ask(b"\x20\x00SICK_LMS");
    bench.ask(&[0x3B, 0x64, 0, 0x64, 0]);
    assert_eq!(bench.ask(&[0x66, 1]), [0xE6, 1, 1, 0x10]);
    assert_eq!(bench.ask(&[0x10]), [0x91, 0x10]);
    assert_eq!(body_of(&bench.sent().unwrap())[0], 0x90);
    let fine = Variant { angle_deg: 180, step_centideg: 50 };
    assert_eq!((bench.device.rate(), bench.device.variant()), (Rate::R500000, fine));
    bench.ask(b"\x20\x00SICK_LMS");
    bench.ask(&[0x3B, 0x64, 0, 0x64, 0]);
    bench.ask(&[0x66, 2]);
    bench.ask(&[0x66, 0]);
    bench.ask(&[0x10]);
    bench.sent();
    let coarse = Variant { angle_deg: 100, step_centideg: 100 };
    assert_eq!((bench.device.rate(), bench.device.variant()), (Rate::R9600, coarse));
}

#[test]
fn an_lms211_has_201_values_in_centimetres_out_of_the_box() {
    let body = Bench::new("lms211", Options::default()).ask(&[0x30, 1]);
    assert_eq!(body[..3], [0xB0, 0xC9, 0x00]);
    let body = Bench::new("lms200", Options::default()).ask(&[0x30, 1]);
    assert_eq!(body[..3], [0xB0, 0x69, 0x41]);
}

/// The offset of the second field set's evaluations (7C) and H (77) stay within 1 to 125 together, whichever is written.
#[test]
fn evaluations_and_their_offset_fit_together() {
    let mut bench = Bench::installed("lms200", Options::default());
    assert_eq!(bench.ask(&[0x7C, 0, 0, 0, 0, 100])[..2], [0xFC, 1]);
    let with = |evaluations: u8| [0x77, 0, 0, 0x46, 0, 0, 0, 1, 0, 0, evaluations];
    assert_eq!(bench.ask(&with(25))[..2], [0xF7, 1]);
    assert_eq!(bench.ask(&with(26))[..2], [0xF7, 0]);
}

/// A host of another age sends more or less than the device knows.
#[test]
fn bytes_beyond_what_is_known_are_ignored() {
    let mut bench = Bench::installed("lms200", Options::default());
    assert_eq!(bench.ask(&[0x31, 1, 2])[0], 0xB1);
    let block = bench.ask(&[0x74])[1..35].to_vec();
    assert_eq!(bench.ask(&[&[0x77][..], &block, &[0; 6]].concat())[..2], [0xF7, 1]);
    assert_eq!(bench.ask(&[0x20, 0x25, 7]), [0xA0, 0, 0x10]);
}

fn values_of(body: &[u8]) -> Values {
    let mut values = Values::default();
    values.decode_into(body).unwrap();
    values
}

/// Everything is 2 m away; the field's border 2.5 m to the right half, 0.5 m to the left.
fn right_half(bench: &mut Bench, field: u8) {
    let mut body = vec![0x40, 1, 0x40 | field, 0xB4, 0, 50, 0, 2, 0, 10];
    let radii = (0..11).map(|ray| if ray < 5 { 2500_u16 } else { 500 });
    radii.for_each(|radius| body.extend(radius.to_le_bytes()));
    assert_eq!(bench.ask(&body)[..2], [0xC0, 1]);
}

#[test]
fn a_field_sets_the_flags_of_the_values_in_it_and_pulls_its_output_low() {
    let mut bench = Bench::installed("lms200", Options::default());
    right_half(&mut bench, 0);
    let configured = bench.ask(&[0x45, 1, 0]);
    assert_eq!(configured[..10], [0xC5, 1, 0x42, 0, 0xB4, 0, 50, 0, 0, 10]);
    let flags = |bench: &mut Bench| -> Vec<u16> {
        values_of(&bench.ask(&[0x30, 1])).values.iter().map(|value| value >> 13).collect()
    };
    // Mode 0: bit 13 is field A. 0° to 89.5° lie in it.
    assert_eq!(flags(&mut bench), [[1; 180].as_slice(), &[0; 181]].concat());
    assert_eq!(bench.ask(&[0x4A]), [0xCA, 0, 1, 1, 0x10]);
    // Mode 4: bit 14. Means carry none.
    bench.ask(&[0x77, 0, 0, 0x46, 0, 0, 4, 1]);
    assert_eq!(flags(&mut bench)[..2], [2, 2]);
    assert!(values_of(&bench.ask(&[0x36, 2])).values.iter().all(|value| *value == 2000));
    // The other set is as delivered.
    bench.ask(&[0x41, 2]);
    assert_eq!(bench.ask(&[0x4A]), [0xCA, 1, 1, 1, 0x10]);
    // An object must be wider than the blanking: half a circle of 2 m is 3.1 m.
    bench.ask(&[0x41, 1]);
    for (blanking_cm, level) in [(300_u16, 0), (330, 1)] {
        bench.ask(&[&[0x77][..], &blanking_cm.to_le_bytes()].concat());
        assert_eq!(bench.ask(&[0x4A])[1], level, "{blanking_cm} cm");
    }
}

#[test]
fn an_output_waits_for_as_many_scans_as_the_configuration_asks_for() {
    let mut bench = Bench::installed("lms200", Options::default());
    right_half(&mut bench, 1);
    bench.ask(&[0x77, 0, 0, 0x46, 0, 0, 0, 1, 0, 0, 3]);
    bench.ask(&[0x20, 0x24]);
    let mut levels = Vec::new();
    for _ in 0..4 {
        bench.measure();
        bench.sent();
        bench.device.handle_bytes(bench.now, Duration::ZERO, &request(&[0x4A]));
        assert_eq!(bench.sent(), Some(vec![0x06]));
        levels.push(body_of(&bench.sent().unwrap())[2]);
    }
    assert_eq!(levels, [1, 1, 0, 0]);
}

#[test]
fn what_is_only_told_while_a_field_is_infringed_is_silent_otherwise() {
    for (mode, count) in [(0x21, 10), (0x23, 3)] {
        let mut bench = Bench::installed("lms200", Options::default());
        bench.ask(&[0x20, mode]);
        bench.measure().unwrap();
        assert_eq!(bench.sent(), None, "20 {mode:02X}");
        bench.ask(b"\x20\x00SICK_LMS");
        right_half(&mut bench, 0);
        bench.ask(&[0x20, mode]);
        bench.measure().unwrap();
        let values = values_of(&body_of(&bench.sent().unwrap()));
        assert_eq!(values.values.len(), count);
        match mode {
            // 18° a segment; the first five are in the field.
            0x21 => assert_eq!(values.values, [[0x2000 | 2000; 5], [2000; 5]].concat()),
            // At 0.5° an object of 2 m is 0 mm ahead of the scanner's own line, or nearly.
            _ => assert_eq!((values.values[0], values.values[1..].to_vec()), (1, vec![0x1FFD, 0x1FFD])),
        }
    }
}

#[test]
fn values_come_with_fields_as_coordinates_and_by_segments() {
    let mut bench = Bench::installed("lms200", Options::default());
    right_half(&mut bench, 2);
    let body = bench.ask(&[0x3E, 180, 0, 181, 0]);
    // 89.5° and 90°: the value, and how far A, B and C reach.
    let values = values_of(&body);
    assert_eq!(values.values, [2000, 50, 50, 2500, 2000, 50, 50, 500]);
    assert_eq!(bench.ask(&[0x3E, 1, 0, 101, 0]), [0x92, 0x10], "100 at most");
    let body = bench.ask(&[0x76, 1, 0, 121, 0]);
    let values = values_of(&body);
    assert_eq!(values.values[..2], [2000, 0]);
    // 60°.
    assert_eq!(values.values[240..], [1000, 1732]);
    let body = bench.ask(&[0x76, 0x69, 1, 0x69, 1]);
    assert_eq!(values_of(&body).values, [0x8000 | 2000, 0], "to the left, X is negative");
    assert_eq!(bench.ask(&[0x20, 0x2C, 4, 1, 0, 100, 0]), [0xA0, 0, 0x10]);
    bench.measure();
    let values = values_of(&body_of(&bench.sent().unwrap()));
    assert_eq!((values.output, values.values), (Output::Range(Span { first: 1, last: 100 }), vec![2000; 4]));
    assert_eq!(bench.ask(&[0x20, 0x2C, 1, 0, 1, 0, 100, 0]), [0x92, 0x10]);
}

#[test]
fn a_field_is_taught_in() {
    let mut bench = Bench::installed("lms200", Options::default());
    let teach = |step: u8| [0x46, 1, 0x40, 0xB4, 0, 50, 0, step, 100, 0, 0, 0, 0, 0];
    assert_eq!(bench.ask(&teach(0)), [0xC6, 3, 0x10]);
    assert_eq!(bench.ask(&teach(1)), [0xC6, 1, 0x10]);
    // 100 mm before the contour; 361 radii behind nine bytes.
    let configured = bench.ask(&[0x45, 1, 0]);
    assert_eq!(configured[..9], [0xC5, 1, 0x43, 0, 0xB4, 0, 50, 0, 0]);
    assert_eq!((configured.len(), &configured[9..11]), (9 + 2 * 361 + 1, &1900_u16.to_le_bytes()[..]));
    assert_eq!(values_of(&bench.ask(&[0x30, 3])).values, vec![1900; 361]);
    assert_eq!(bench.ask(&[0x4A])[1..4], [1, 1, 1]);
    assert_eq!(bench.ask(&teach(1)), [0x92, 0x10]);
    bench.ask(&teach(0));
    assert_eq!(bench.ask(&teach(2)), [0xC6, 0, 0x10]);
}

#[test]
fn a_direct_sub_range_is_a_telegram_a_mirror_turn() {
    let mut bench = Bench::new("lms200", Options::default());
    let first = values_of(&bench.ask(&[0x37, 1, 0x80, 4, 0x80]));
    bench.measure().unwrap();
    let second = values_of(&body_of(&bench.sent().unwrap()));
    let span = Span { first: 1, last: 4 };
    assert_eq!((first.output, first.word.partial, first.values.len()), (Output::Direct(span), Some(0), 2));
    assert_eq!((second.output, second.word.partial, second.values.len()), (Output::Direct(span), Some(2), 2));
    assert!(bench.measure().is_none(), "two turns make a scan of 0.5°");
}

/// A public driver asks for remission in measuring mode 0D, over 181 values; the listing's example asks for 401.
#[test]
fn range_and_reflectivity_of_a_whole_scan_is_one_frame() {
    let mut bench = Bench::installed("lms291", Options::default());
    assert_eq!(bench.ask(&[0x77, 0, 0, 0x46, 0, 1, 0x0D, 1])[1], 1);
    for (variant, count) in [([0xB4, 0, 100, 0], 181_u16), ([0x64, 0, 25, 0], 401)] {
        bench.ask(&[&[0x3B][..], &variant].concat());
        let parts = [&[0x75, 1, 0, 1, 0][..], &count.to_le_bytes()].concat();
        let body = bench.ask(&parts);
        let values = values_of(&body);
        assert_eq!((values.values.len(), values.part_reflectivity.len()), (count.into(), count.into()));
        assert_eq!(values.values[0], 2000);
    }
    // No part beyond the scan, and no more than the longest scan has.
    assert_eq!(bench.ask(&[0x75, 1, 0, 1, 0, 0x92, 1]), [0x92, 0x10]);
    assert_eq!(bench.ask(&[0x75, 2, 0, 1, 0, 0x91, 1, 1, 0, 1, 0]), [0x92, 0x10]);
}

#[test]
fn dirt_shows_in_the_status_in_every_reply_and_among_the_errors() {
    for (contamination, status, errors, channel) in [
        (0, 0x10, &[][..], 1000_u16),
        (1, 0x92, &[2, 18], 650),
        (2, 0x93, &[3, 18], 250),
        (3, 0x93, &[3, 18, 3, 19], 250),
    ] {
        let mut bench = Bench::new("lms200", Options { contamination, ..Options::default() });
        let body = bench.ask(&[0x31]);
        assert_eq!((body[153], &body[19..21]), (status, &channel.to_le_bytes()[..]));
        assert_eq!(&body[43..45], &1000_u16.to_le_bytes(), "as it was calibrated");
        assert_eq!(bench.ask(&[0x32]), [&[0xB2][..], errors, &[status]].concat());
        assert_eq!(bench.ask(&[0x30, 1]).last(), Some(&status));
    }
}

#[test]
fn in_the_field_readings_of_the_status_vary_and_repeat() {
    let readings = || {
        let options = Options { profile: Profile::Field, ..Options::default() };
        let mut bench = Bench::new("lms200", options);
        let mut read = Vec::new();
        for _ in 0..20 {
            bench.now = bench.now + Duration::from_millis(100);
            let body = bench.ask(&[0x31]);
            let word = |at: usize| u16::from_le_bytes([body[at], body[at + 1]]);
            assert!((147..=149).contains(&word(67)), "motor {}", word(67));
            assert!((992..=1008).contains(&word(19)), "channel {}", word(19));
            read.push((word(67), word(19)));
        }
        read
    };
    let read = readings();
    assert!(read.iter().any(|one| one.0 != read[0].0) && read.iter().any(|one| one.1 != read[0].1));
    assert_eq!(read, readings());
}
