//! LMS2xx: published frames, values, the device and the host's client on a simulated line.

use std::collections::VecDeque;
use std::time::Duration;

use proptest::prelude::*;
use rowscan_protocol::device::Profile;
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::{Beams, Device, Options, Start, Sweep};
use rowscan_protocol::lms2xx::frame::{FrameDecoder, Listener, Received, checksum, encode};
use rowscan_protocol::lms2xx::telegram::Request;
use rowscan_protocol::lms2xx::values::{MeasuringMode, Output, Span, Unit, Values};
use rowscan_protocol::lms2xx::{Rate, Variant, model};
use rowscan_protocol::scan::NO_ECHO;
use rowscan_protocol::time::SimTime;

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// Published telegrams and telegrams of public clients, with their checksums.
const FRAMES: &[&str] = &[
    "02 00 01 00 31 15 12",
    "02 00 02 00 20 24 34 08",
    "02 00 02 00 20 25 35 08",
    "02 00 02 00 20 40 50 08",
    "02 00 02 00 20 48 58 08",
    "02 00 02 00 30 01 31 18",
    "02 00 05 00 3B B4 00 64 00 97 49",
    "02 00 05 00 3B 64 00 19 00 E7 72",
    "02 00 0A 00 20 00 53 49 43 4B 5F 4C 4D 53 BE C5",
    "02 00 01 00 10 34 12",
    "02 00 01 00 3A 1E 12",
    "02 00 01 00 32 16 12",
    "02 00 01 00 74 50 12",
    "02 00 03 00 20 26 05 79 3E",
    "02 00 06 00 20 27 01 00 B5 00 12 09",
    "02 00 02 00 20 2A 3A 08",
    "02 00 06 00 20 50 01 00 B5 00 68 B6",
];

#[test]
fn requests_are_the_published_bytes_both_ways() {
    for hex in FRAMES {
        let frame = bytes(hex);
        let mut decoder = FrameDecoder::new(Listener::Device);
        decoder.push(&frame);
        let Some(Received::Frame(heard)) = decoder.next_received() else { panic!("{hex} is no frame") };
        let request = Request::parse(heard.body);
        assert!(!matches!(request, Request::Unknown(_)), "{hex}: {request:?}");
        assert_eq!(request.to_frame(), frame, "{hex}: {request:?}");
    }
}

#[test]
fn every_line_of_the_telegram_list_is_a_frame() {
    let Some(list) = crate::facts::text("lms2xx_commands.hex") else { return };
    let mut frames = 0;
    for line in list.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty()) {
        let frame = bytes(line.split(';').next().unwrap());
        let (summed, crc) = frame.split_last_chunk::<2>().unwrap();
        assert_eq!(u16::from_le_bytes(*crc), checksum(summed), "{line}");
        frames += 1;
    }
    assert!(frames >= 19, "{frames}");
}

#[test]
fn a_published_scan_telegram_decodes() {
    let mut decoder = FrameDecoder::new(Listener::Host);
    decoder.push(&bytes("02 80 0A 00 B0 03 40 E8 03 E9 03 FF 1F 10 A3 EA"));
    let Some(Received::Frame(frame)) = decoder.next_received() else { panic!("no frame") };
    let mut values = Values::default();
    values.decode_into(frame.body).unwrap();
    assert_eq!((values.word.unit, values.values.as_slice()), (Some(Unit::Mm), &[1000, 1001, 0x1FFF][..]));
    let mode = MeasuringMode(0);
    let ranges: Vec<f64> = values.values.iter().map(|value| mode.decode_m(Unit::Mm, *value)).collect();
    assert_eq!(ranges, [1.0, 1.001, NO_ECHO]);
    let mut again = Vec::new();
    values.encode(&mut again);
    assert_eq!(again, frame.body);
}

#[test]
fn codes_at_the_top_are_no_ranges_in_any_width() {
    for (mode, top) in [(0, 0x1FFF_u16), (3, 0x3FFF), (4, 0x3FFF), (5, 0x7FFF), (6, 0x7FFF), (0x0F, 0x7FFF)] {
        let mode = MeasuringMode(mode);
        for below in [0, 2, 4, 5, 8] {
            assert_eq!(mode.decode_m(Unit::Mm, top - below), NO_ECHO, "{mode:?} {below}");
        }
        assert!(mode.decode_m(Unit::Mm, top - 1).is_nan(), "{mode:?}: dazzled is unknown, not a miss");
        assert_eq!(mode.decode_m(Unit::Mm, top - 9), f64::from(top - 9) / 1000.0);
        assert_eq!(mode.encode(Unit::Mm, 0, 0), top - 4, "no echo, as recorded");
        assert_eq!(mode.encode(Unit::Mm, u16::MAX, 0) & top, top - 8, "too far for the field");
    }
    // Flags beside the range do not change it.
    assert_eq!(MeasuringMode(1).decode_m(Unit::Cm, 0xA000 | 123), 1.23);
    assert_eq!(MeasuringMode(1).encode(Unit::Cm, 1230, 0xFFFF), 0xE000 | 123);
}

proptest! {
    #[test]
    fn values_come_back_as_they_were(
        count in 1_u16..=401, seed in any::<u16>(), index in any::<Option<u8>>(), which in 0_usize..6, scans in 1_u8..=250,
    ) {
        let span = Span { first: 1, last: count };
        let output = [
            Output::All, Output::Partial, Output::Mean { scans }, Output::Range(span),
            Output::MeanRange { scans, span }, Output::Reflectivity(span),
        ][which];
        let mut values = Values { output, ..Values::default() };
        values.word.count = count;
        values.word.partial = (output == Output::Partial).then_some(2);
        values.values = (0..count).map(|i| i.wrapping_mul(seed)).collect();
        if matches!(output, Output::Reflectivity(_)) {
            values.reflectivity = (0..count).map(|i| i as u8).collect();
        }
        values.real_time_index = index;
        values.status = 0x10;
        let mut body = Vec::new();
        values.encode(&mut body);
        let mut again = Values::default();
        again.decode_into(&body).unwrap();
        prop_assert_eq!(&again, &values);
        // Cut anywhere it is an error, or a telegram without what was cut off; never a panic.
        for end in 0..body.len() {
            let _ = again.decode_into(&body[..end]);
        }
    }

    /// A byte lost, flipped or added costs the telegrams it touches, and those are counted.
    #[test]
    fn one_fault_costs_one_telegram(frames in 2_usize..6, at in any::<prop::sample::Index>(), kind in 0..4, bit in 0_u32..8) {
        let mut stream = Vec::new();
        let mut ends = Vec::new();
        for i in 0..frames {
            let body: Vec<u8> = (0..30).map(|k| (k * 7 + i) as u8).collect();
            encode(0x80, &body, &mut stream);
            ends.push(stream.len());
        }
        let at = at.index(stream.len());
        let hit = ends.iter().position(|end| at < *end).unwrap();
        match kind {
            0 => { stream.remove(at); }
            1 => stream[at] ^= 1_u8 << bit,
            2 => stream.insert(at, 0x02),
            _ => { stream.drain(at..ends[hit].min(at + 9)); }
        }
        let mut decoder = FrameDecoder::new(Listener::Host);
        let mut good = 0;
        for piece in stream.chunks(13) {
            decoder.push(piece);
            while let Some(heard) = decoder.next_received() {
                good += usize::from(matches!(heard, Received::Frame(_)));
            }
        }
        decoder.finish();
        while let Some(heard) = decoder.next_received() {
            good += usize::from(matches!(heard, Received::Frame(_)));
        }
        // An insertion between two telegrams touches none.
        prop_assert!(good + 1 >= frames, "{good} of {frames}");
        prop_assert!(good <= frames);
        let skipped = decoder.counts().skipped_bytes;
        prop_assert!(good == frames || skipped > 0);
    }
}

/// Device and client on one line, in simulated time; what is sent at the wrong rate does not arrive.
struct Line {
    device: Device,
    client: Lms2xxClient,
    now: SimTime,
    /// The client's rate.
    rate: Rate,
    /// What is on its way to the client, with its arrival.
    to_client: VecDeque<(SimTime, Rate, Vec<u8>)>,
    free: SimTime,
    events: Vec<HostEvent>,
    /// Arrival and ranges of each scan.
    scans: Vec<(SimTime, usize, u16)>,
}

impl Line {
    fn new(device: Device, config: Lms2xxConfig) -> Self {
        Self {
            device,
            client: Lms2xxClient::new(config),
            now: SimTime::ZERO,
            rate: Rate::R9600,
            to_client: VecDeque::new(),
            free: SimTime::ZERO,
            events: Vec::new(),
            scans: Vec::new(),
        }
    }

    /// Runs for so long.
    fn run(&mut self, time: Duration) {
        let end = self.now + time;
        while self.now < end {
            self.now = self.now + Duration::from_micros(500);
            let now = self.now;
            while let Some(transmit) = self.client.poll_transmit() {
                match transmit {
                    Transmit::Rate(rate) => self.rate = rate,
                    Transmit::Frame(frame) if self.rate == self.device.rate() => {
                        self.device.handle_bytes(now, Duration::from_micros(100), &frame);
                    }
                    Transmit::Frame(_) => self.device.handle_bytes(now, Duration::from_micros(100), &[0xF8]),
                }
            }
            self.device.handle_timeout(now);
            if self.free <= now {
                if let Some(sweep) = self.device.plan(self.free).filter(|sweep| sweep.done() <= now) {
                    for turn in sweep.turns() {
                        let range_mm: Vec<u16> =
                            (0..self.device.turn_beams(turn).count).map(|i| 1000 + i).collect();
                        let remission = vec![0x4000; range_mm.len()];
                        self.device.measure(
                            sweep,
                            turn,
                            Beams { range_mm: &range_mm, remission: &remission },
                        );
                    }
                    self.device.finish(now, sweep);
                }
                if let Some(bytes) = self.device.poll_transmit(now) {
                    let rate = self.device.rate();
                    self.free = self.device.pace().end(self.free.max(now), bytes.len());
                    self.to_client.push_back((self.free, rate, bytes));
                    self.device.transmitted(now);
                }
            }
            while self.to_client.front().is_some_and(|(at, ..)| *at <= now) {
                let Some((_, rate, bytes)) = self.to_client.pop_front() else { break };
                let heard = if rate == self.rate { bytes } else { vec![0x80; bytes.len() / 3] };
                self.client.handle_bytes(now.elapsed(), &heard);
                self.listen();
            }
            if self.client.poll_timeout().is_some_and(|due| due <= now.elapsed()) {
                self.client.handle_timeout(now.elapsed());
            }
            self.listen();
        }
    }

    fn listen(&mut self) {
        while let Some(event) = self.client.poll_event() {
            if event == HostEvent::Scan {
                let scan = self.client.scan();
                self.scans.push((self.now, scan.echoes[0].range_m.len(), scan.telegram_counter));
            } else {
                self.events.push(event);
            }
        }
    }

    fn is_ready(&self) -> bool {
        self.events.iter().any(|event| matches!(event, HostEvent::Ready(_)))
    }
}

fn device(name: &str, options: Options) -> Device {
    let model = model::MODELS.iter().find(|model| model.name == name).unwrap();
    Device::new(model, options)
}

#[test]
fn a_client_finds_any_model_at_any_rate_in_any_state() {
    for model in model::MODELS {
        for stored_rate in Rate::ALL {
            for start in [Start::Idle, Start::PowerUp, Start::Streaming, Start::Installation] {
                let options = Options { start, stored_rate, ..Options::default() };
                let mut line = Line::new(Device::new(model, options), Lms2xxConfig::default());
                line.run(Duration::from_secs(20));
                assert!(line.is_ready(), "{} {stored_rate} {start:?}: {:?}", model.name, line.events);
                assert_eq!(line.device.rate(), Rate::R38400);
                assert!(line.scans.len() > 20, "{} {stored_rate} {start:?}", model.name);
                let counters: Vec<u16> = line.scans.iter().map(|(.., counter)| *counter).collect();
                assert!(counters.is_sorted_by(|a, b| a + 1 == *b), "{counters:?}");
            }
        }
    }
}

#[test]
fn scans_come_as_often_as_the_line_carries_them() {
    // Values, and ms from scan to scan by rate: the first whole multiple of the scan's time that holds its transmission.
    let table = [
        (101, Variant { angle_deg: 100, step_centideg: 100 }, [226.667, 120.0, 66.667, 13.333]),
        (181, Variant { angle_deg: 180, step_centideg: 100 }, [400.0, 200.0, 106.667, 13.333]),
        (361, Variant { angle_deg: 180, step_centideg: 50 }, [773.333, 400.0, 213.333, 26.667]),
        (401, Variant { angle_deg: 100, step_centideg: 25 }, [853.333, 426.667, 213.333, 53.333]),
    ];
    for (count, variant, periods_ms) in table {
        for (rate, period_ms) in
            [Rate::R9600, Rate::R19200, Rate::R38400, Rate::R500000].into_iter().zip(periods_ms)
        {
            // Without the byte that counts turns, as the table has it.
            let config = Lms2xxConfig {
                rate,
                variant: Some(variant),
                real_time_index: false,
                ..Lms2xxConfig::default()
            };
            let mut line = Line::new(device("lms291", Options::default()), config);
            line.run(Duration::from_secs(22));
            let (first, points, _) = line.scans[1];
            let (last, ..) = line.scans[line.scans.len() - 1];
            assert_eq!(points, count);
            let measured = (last.as_secs_f64() - first.as_secs_f64()) * 1e3 / (line.scans.len() - 2) as f64;
            assert!((measured / period_ms - 1.0).abs() < 0.02, "{count} at {rate}: {measured} ms");
        }
    }
}

#[test]
fn interlaced_beams_are_mirror_turns_apart() {
    let mut device = device("lms291", Options::default());
    assert!(device.set_variant(Variant { angle_deg: 100, step_centideg: 25 }));
    device.handle_bytes(SimTime::ZERO, Duration::ZERO, &bytes("02 00 02 00 30 01 31 18"));
    assert_eq!(device.poll_transmit(SimTime::ZERO), Some(vec![0x06]));
    device.transmitted(SimTime::ZERO);
    let sweep = device.plan(SimTime::ZERO).unwrap();
    assert_eq!(sweep.turns, 4);
    assert_eq!((sweep.done().0 + 500_000) / 1_000_000, 53);
    for (part, turn) in sweep.turns().enumerate() {
        let beams = device.turn_beams(turn);
        assert_eq!((beams.start, beams.step), (400_000 + 2_500 * part as i32, 10_000));
        // What this turn sees tells which turn it was.
        let range_mm = vec![1000 + part as u16; beams.len()];
        device.measure(sweep, turn, Beams { range_mm: &range_mm, remission: &vec![0; beams.len()] });
    }
    let apart = Sweep::turn_at(sweep.first + 3).0 - Sweep::turn_at(sweep.first).0;
    assert_eq!(apart, 40_000_000, "neighbours are up to 40 ms apart");
    device.finish(sweep.done(), sweep);
    let frame = device.poll_transmit(sweep.done()).unwrap();
    let mut values = Values::default();
    values.decode_into(&frame[4..frame.len() - 2]).unwrap();
    assert_eq!(values.values.len(), 401);
    // Centimetres out of the box.
    assert_eq!(values.values[..5], [100, 100, 100, 100, 100]);
}

#[test]
fn a_pause_inside_a_telegram_drops_it_and_the_next_one_counts() {
    let mut device = device("lms200", Options { profile: Profile::Field, ..Options::default() });
    let status = bytes("02 00 01 00 31 15 12");
    device.handle_bytes(SimTime::ZERO, Duration::from_micros(1040), &status[..4]);
    let later = SimTime(20_000_000);
    device.handle_bytes(later, Duration::from_micros(1040), &status[4..]);
    assert_eq!(device.poll_transmit(later), None);
    let later = SimTime(60_000_000);
    device.handle_bytes(later, Duration::from_micros(1040), &status);
    assert_eq!(device.poll_transmit(later), Some(vec![0x06]));
}

#[test]
fn recorded_ranges_go_through_unchanged() {
    for (name, mode) in [("lms200_scans_mode4_a", 4), ("lms200_scans_mode15_a", 0x0F)] {
        let Some(text) = crate::facts::text(&format!("{name}.json")) else { return };
        let recording: serde_json::Value = serde_json::from_str(&text).unwrap();
        let mode = MeasuringMode(mode);
        let scans = recording["scans"].as_array().unwrap();
        let mut ranges = 0;
        for scan in scans {
            let recorded: Vec<u16> =
                scan["v"].as_array().unwrap().iter().map(|value| value.as_u64().unwrap() as u16).collect();
            let mut values = Values { values: recorded.clone(), ..Values::default() };
            values.word.count = recorded.len() as u16;
            let (mut body, mut line) = (Vec::new(), Vec::new());
            values.encode(&mut body);
            encode(0x80, &body, &mut line);
            let mut decoder = FrameDecoder::new(Listener::Host);
            decoder.push(&line);
            let Some(Received::Frame(frame)) = decoder.next_received() else { panic!("no frame") };
            values.decode_into(frame.body).unwrap();
            assert_eq!(values.values, recorded);
            for value in recorded {
                // What the device would have sent for that range is the recorded value.
                let metres = mode.decode_m(Unit::Mm, value);
                if metres.is_finite() {
                    assert_eq!(mode.encode(Unit::Mm, (metres * 1000.0).round() as u16, 0), value);
                    ranges += 1;
                } else {
                    assert!(mode.no_range(value).is_some());
                }
            }
        }
        assert!(scans.len() > 10 && ranges > 3000, "{name}: {} scans, {ranges} ranges", scans.len());
    }
}

#[test]
fn a_saved_configuration_comes_back_and_a_damaged_one_does_not() {
    let mut device = device("lms291", Options { start: Start::Installation, ..Options::default() });
    let mut write = bytes("77 46 00 00 00 02 06 01");
    let mut frame = Vec::new();
    encode(0, &write, &mut frame);
    device.handle_bytes(SimTime::ZERO, Duration::ZERO, &frame);
    assert_eq!(device.saves(), 1);
    let text = device.saved_settings();
    let mut other = self::device("lms291", Options::default());
    other.restore(&text).unwrap();
    assert_eq!(other.saved_settings(), text);
    for damaged in ["", "LMS2xx configuration 46", &text.replace("06 01", "06 07"), &(text.clone() + "00")] {
        assert!(other.restore(damaged).is_err(), "{damaged}");
    }
    // Outside the installation mode nothing is written.
    write[5] = 0;
    let mut frame = Vec::new();
    encode(0, &write, &mut frame);
    other.handle_bytes(SimTime::ZERO, Duration::ZERO, &frame);
    assert_eq!(other.saves(), 0);
}

/// A device with a block of 32 bytes is set up, and its values are read in the unit and mode that were written.
#[test]
fn a_client_sets_up_old_firmware() {
    use rowscan_protocol::lms2xx::firmware::Firmware;
    for name in ["lms200", "lms291"] {
        let options = Options { firmware: Some(Firmware::V0210), ..Options::default() };
        let mut line = Line::new(device(name, options), Lms2xxConfig::default());
        line.run(Duration::from_secs(20));
        assert!(line.is_ready(), "{name}: {:?}", line.events);
        assert!(line.scans.len() > 20);
        assert_eq!(line.device.saves(), 1, "its memory is written once");
        let told =
            |event: &HostEvent| matches!(event, HostEvent::Limited { what } if what.contains("32 bytes"));
        assert_eq!(line.events.iter().filter(|event| told(event)).count(), 1, "{:?}", line.events);
        assert!((line.client.scan().echoes[0].range_m[0] - 1.0).abs() < 0.001);
        // And found as it should be the next time.
        let again = Line { client: Lms2xxClient::new(Lms2xxConfig::default()), events: Vec::new(), ..line };
        let mut again = Line { rate: Rate::R9600, ..again };
        again.run(Duration::from_secs(20));
        assert!(again.is_ready());
        assert_eq!(again.device.saves(), 1);
    }
}

/// Remission beside the ranges: `F5`, and `C4` from an S14.
#[test]
fn a_client_reads_remission_where_it_asks_for_it() {
    for (name, count, remission) in
        [("lms200", 361, 0x4000 / 5), ("lms211", 201, 0x4000 / 5), ("lms291-s14", 181, 0x40)]
    {
        let config = Lms2xxConfig { remission: true, ..Lms2xxConfig::default() };
        let mut line = Line::new(device(name, Options::default()), config);
        line.run(Duration::from_secs(20));
        assert!(line.is_ready(), "{name}: {:?}", line.events);
        assert!(line.scans.len() > 20, "{name}: {} scans", line.scans.len());
        let echo = &line.client.scan().echoes[0];
        assert_eq!((echo.range_m.len(), echo.remission.clone()), (count, vec![remission; count]), "{name}");
        // 1 m and a millimetre a beam of each turn: no bit of a value is taken for something else.
        let furthest = echo.range_m.iter().copied().fold(0.0, f64::max);
        assert!((echo.range_m[0] - 1.0).abs() < 1e-9 && furthest < 1.19, "{name}: {furthest}");
    }
}
