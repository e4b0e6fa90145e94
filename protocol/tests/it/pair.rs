//! Both sides joined, without a socket: the client's frames go into the session and back, under virtual time.

use std::time::Duration;

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::{
    Device, DialectPolicy, Identity, MeasuredEcho, MeasuredLine, Options, Session, scan_event,
};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::model::{MODELS, Model, RemissionWidth};
use rowscan_protocol::rig::EchoChoice;
use rowscan_protocol::scan::NO_ECHO;
use rowscan_protocol::telegram::{SopasError, fr_echo_filter};
use rowscan_protocol::time::SimTime;

/// A scanner, one connection, and a client.
pub(crate) struct Pair {
    pub(crate) device: Device,
    session: Session,
    pub(crate) client: ColaClient,
    now: Duration,
    /// Bytes the client gets at once.
    piece: usize,
    /// Events other than scans.
    pub(crate) events: Vec<HostEvent>,
}

impl Pair {
    pub(crate) fn new(device: Device, policy: DialectPolicy, config: ColaConfig, dialect: Dialect) -> Self {
        let session = Session::new(policy);
        Self {
            device,
            session,
            client: ColaClient::new(config, dialect),
            now: Duration::ZERO,
            piece: 1460,
            events: Vec::new(),
        }
    }

    fn sim_time(&self) -> SimTime {
        SimTime::ZERO + self.now
    }

    /// Lets both sides talk until neither has anything to say.
    pub(crate) fn settle(&mut self) {
        while let Some(request) = self.client.poll_transmit().and_then(Transmit::into_frame) {
            let mut replies = Vec::new();
            let now = self.sim_time();
            for piece in request.chunks(7) {
                self.session.handle_bytes(&mut self.device, now, piece, &mut replies);
            }
            self.now += Duration::from_millis(2);
            for reply in replies {
                self.receive(&reply.bytes);
            }
        }
    }

    /// The client gets `bytes`; scans are counted.
    fn receive(&mut self, bytes: &[u8]) -> usize {
        let mut scans = 0;
        for piece in bytes.chunks(self.piece) {
            self.client.handle_bytes(self.now, piece);
            while let Some(event) = self.client.poll_event() {
                match event {
                    HostEvent::Scan => scans += 1,
                    other => self.events.push(other),
                }
            }
        }
        scans
    }

    /// One mirror turn. True if the client got a scan.
    pub(crate) fn turn(&mut self, echoes: &[MeasuredEcho]) -> bool {
        self.now +=
            Duration::from_micros(1_000_000 * 100 / u64::from(self.device.mirror().frequency_centihz));
        let at = self.sim_time();
        let Some(scan) = self.device.measure(at, &MeasuredLine { grid: self.device.mirror().beams, echoes })
        else {
            return false;
        };
        let mut bytes = Vec::new();
        if self.session.subscribed() {
            scan_event(self.session.dialect(), scan, &mut bytes);
        }
        self.receive(&bytes) == 1
    }
}

/// Ranges and remissions that differ from beam to beam and turn to turn, with misses.
pub(crate) fn measured(beams: usize, echoes: usize, turn: usize) -> Vec<MeasuredEcho> {
    (0..echoes)
        .map(|echo| {
            let seed = |beam: usize| beam * 7919 + echo * 104_729 + turn * 1_299_709;
            MeasuredEcho {
                range_mm: (0..beams)
                    .map(|beam| if seed(beam) % 5 == 0 { 0 } else { 16 + (seed(beam) % 65_000) as u16 })
                    .collect(),
                remission: (0..beams).map(|beam| (seed(beam) % 65_536) as u16).collect(),
            }
        })
        .collect()
}

fn device(model: &'static Model) -> Device {
    Device::new(model, Identity::default())
}

#[test]
fn every_value_measured_arrives_in_both_dialects_from_every_model_and_mode() {
    for model in MODELS {
        for dialect in [Dialect::A, Dialect::B] {
            for (index, &mode) in model.modes.iter().enumerate() {
                let width = if index % 2 == 0 { RemissionWidth::Bits8 } else { RemissionWidth::Bits16 };
                let config = ColaConfig {
                    scan_mode: Some(mode),
                    echoes: model.echoes,
                    remission: true,
                    remission_width: width,
                    ..ColaConfig::default()
                };
                let mut pair = Pair::new(device(model), DialectPolicy::Auto, config, dialect);
                pair.piece = if index == 0 { 1 } else { 1460 };
                pair.settle();
                let Some(HostEvent::Ready(info)) = pair.events.first() else { panic!("{:?}", pair.events) };
                assert_eq!(info.firmware, model.firmware.trim());
                assert_eq!(info.ident, format!("{} {}", model.ident_name, model.ident_version));

                for turn in 0..3 {
                    let told = pair.device.mirror();
                    let echoes = measured(told.beams.len(), model.echoes.into(), turn);
                    assert!(pair.turn(&echoes), "{} {dialect} {mode:?}", model.title);
                    let scan = pair.client.scan();
                    assert_eq!(scan.beams, told.beams);
                    let turns = usize::from(model.turns_a_scan(mode));
                    assert_eq!(Some(scan.beams), model.grids(mode).nth(turn % turns));
                    let turns_hz = f64::from(mode.frequency_centihz) / 100.0 * turns as f64;
                    assert_eq!(scan.scan_frequency_hz, turns_hz);
                    assert_eq!(usize::from(scan.telegram_counter), turn);
                    let first = model.scan_counter_restart.unwrap_or_default();
                    assert_eq!(usize::from(scan.scan_counter), usize::from(first) + turn);
                    assert_eq!(scan.transmit_time_us - scan.scan_time_us, model.transmit_delay_us);
                    assert_eq!(scan.echoes.len(), echoes.len());
                    for (found, echo) in scan.echoes.iter().zip(&echoes) {
                        let range = |&mm: &u16| if mm == 0 { NO_ECHO } else { f64::from(mm) / 1000.0 };
                        let remission =
                            |&value: &u16| if width == RemissionWidth::Bits8 { value >> 8 } else { value };
                        assert!(found.range_m.iter().copied().eq(echo.range_mm.iter().map(range)));
                        assert!(found.remission.iter().copied().eq(echo.remission.iter().map(remission)));
                    }
                }
                assert_eq!(pair.events.len(), 1, "{:?}", pair.events);
                assert_eq!(pair.client.counts().bad + pair.session.counts().bad, 0);
            }
        }
    }
}

#[test]
fn an_output_range_cuts_the_grid_and_keeps_every_value_at_its_angle() {
    for model in MODELS {
        let output_range = Some((450_000, 1_350_000));
        let config = ColaConfig { output_range, ..ColaConfig::default() };
        let mut pair = Pair::new(device(model), DialectPolicy::Auto, config, Dialect::B);
        pair.settle();
        let full = pair.device.mirror().beams;
        let echoes = measured(full.len(), 1, 0);
        assert!(pair.turn(&echoes));
        let scan = pair.client.scan();
        assert_eq!(scan.beams.start, 450_000);
        assert!((scan.beams.angle_deg(scan.beams.len() - 1) - 135.0).abs() < 1e-9);
        for (i, &range_m) in scan.echoes[0].range_m.iter().enumerate() {
            let beam = (0..full.len())
                .find(|&b| (full.angle_deg(b) - scan.beams.angle_deg(i)).abs() < 1e-6)
                .unwrap();
            let mm = echoes[0].range_mm[beam];
            assert_eq!(range_m, if mm == 0 { NO_ECHO } else { f64::from(mm) / 1000.0 });
        }
    }
}

#[test]
fn an_output_rate_skips_turns_and_the_scan_counter_tells() {
    let config = ColaConfig { output_rate: 3, ..ColaConfig::default() };
    let mut pair = Pair::new(device(MODELS[0]), DialectPolicy::Auto, config, Dialect::B);
    pair.settle();
    let mut counters = Vec::new();
    for _ in 0..9 {
        if pair.turn(&[]) {
            counters.push((pair.client.scan().scan_counter, pair.client.scan().telegram_counter));
        }
    }
    assert_eq!(counters, [(4, 0), (7, 1), (10, 2)]);
}

#[test]
fn the_device_clock_wraps_after_71_minutes() {
    let options = Options {
        power_up_before: Duration::from_micros(u64::from(u32::MAX) - 60_000),
        ..Options::default()
    };
    let device = device(MODELS[0]).with_options(options);
    let mut pair = Pair::new(device, DialectPolicy::Auto, ColaConfig::default(), Dialect::B);
    pair.settle();
    let mut times = Vec::new();
    for _ in 0..3 {
        assert!(pair.turn(&[]));
        times.push(pair.client.scan().scan_time_us);
    }
    assert!(times[0] > times[2]);
    assert!(times.windows(2).all(|pair| pair[1].wrapping_sub(pair[0]) == 20_000));
}

#[test]
fn a_strict_device_is_silent_in_the_other_dialect_and_the_client_says_so() {
    for (device_speaks, client_speaks) in [(Dialect::A, Dialect::B), (Dialect::B, Dialect::A)] {
        let policy = DialectPolicy::Strict(device_speaks);
        let mut pair = Pair::new(device(MODELS[0]), policy, ColaConfig::default(), client_speaks);
        pair.settle();
        assert!(pair.events.is_empty());
        pair.client.handle_timeout(pair.now);
        pair.now = pair.client.poll_timeout().unwrap();
        pair.client.handle_timeout(pair.now);
        let event = pair.client.poll_event();
        assert_eq!(event, Some(HostEvent::NoAnswer { command: "DeviceIdent" }));
        assert!(pair.client.is_done() && pair.client.poll_timeout().is_none());
    }
}

#[test]
fn a_clean_stop_unsubscribes_and_leaves_the_device_measuring() {
    let mut pair = Pair::new(device(MODELS[0]), DialectPolicy::Auto, ColaConfig::default(), Dialect::A);
    pair.settle();
    assert!(pair.turn(&[]));
    pair.client.stop(pair.now);
    pair.settle();
    assert_eq!(pair.events.last(), Some(&HostEvent::Stopped));
    assert!(!pair.session.subscribed() && pair.device.is_measuring());
    assert!(!pair.turn(&[]));
}

#[test]
fn a_scanner_that_would_send_the_last_echo_is_asked_for_the_one_wanted() {
    let asked = |model: &'static Model, echo, echoes| {
        let mut scanner = device(model);
        scanner.set_factory_echo(model.optics.factory_echo);
        let config = ColaConfig { echo, echoes, ..ColaConfig::default() };
        let mut pair = Pair::new(scanner, DialectPolicy::Auto, config, Dialect::B);
        pair.settle();
        assert!(matches!(pair.events[..], [HostEvent::Ready(_)]), "{:?}", pair.events);
        let mut request = Vec::new();
        encode(Dialect::B, b"sRN FREchoFilter", &mut request);
        let mut replies = Vec::new();
        let now = pair.sim_time();
        pair.session.handle_bytes(&mut pair.device, now, &request, &mut replies);
        // The code stands before the checksum.
        replies[0].bytes[replies[0].bytes.len() - 2]
    };
    let lms511 = rowscan_protocol::model::by_name("lms511").unwrap();
    let [first, last] = [EchoChoice::First, EchoChoice::Last].map(Some);
    assert_eq!(asked(lms511, None, 1), fr_echo_filter::LAST, "as it was left");
    assert_eq!(asked(lms511, first, 1), fr_echo_filter::FIRST);
    assert_eq!(asked(lms511, last, 1), fr_echo_filter::LAST);
    assert_eq!(asked(lms511, first, 3), fr_echo_filter::ALL);
    // Of all echoes, the first stands in the first channel.
    let lms111 = rowscan_protocol::model::by_name("lms111").unwrap();
    assert_eq!(asked(lms111, first, 1), fr_echo_filter::ALL);
    assert_eq!(asked(lms111, last, 1), fr_echo_filter::LAST);
}

#[test]
fn a_scanner_without_an_input_for_an_encoder_sends_all_else_that_was_asked_for() {
    for model in MODELS {
        let config = ColaConfig {
            echoes: model.echoes,
            remission: true,
            encoder_ticks_per_m: Some(1000),
            ..ColaConfig::default()
        };
        let mut pair = Pair::new(device(model), DialectPolicy::Auto, config, Dialect::B);
        pair.settle();
        assert!(matches!(pair.events[..], [HostEvent::Ready(_)]), "{}: {:?}", model.name, pair.events);
        let beams = pair.device.mirror().beams.len();
        assert!(pair.turn(&measured(beams, model.echoes.into(), 0)), "{}", model.name);
        let scan = pair.client.scan();
        assert!(scan.echoes.iter().all(|echo| echo.remission.len() == beams), "{}", model.name);
        assert_eq!(scan.encoders.len(), usize::from(model.encoders.min(1)), "{}", model.name);
    }
}

#[test]
fn a_refused_option_is_reported_and_the_start_up_goes_on() {
    let config = ColaConfig { output_range: Some((-3_000_000, 0)), ..ColaConfig::default() };
    let mut pair = Pair::new(device(MODELS[1]), DialectPolicy::Auto, config, Dialect::B);
    pair.settle();
    let refused = HostEvent::Refused {
        command: "LMPoutputRange",
        error: Some(SopasError::LocalConditionFailed.into()),
        fatal: false,
    };
    assert_eq!(pair.events[0], refused);
    assert!(matches!(pair.events[1], HostEvent::Ready(_)));
}

fn reply(client: &mut ColaClient, text: &str) -> Vec<HostEvent> {
    let mut bytes = Vec::new();
    encode(Dialect::A, text.as_bytes(), &mut bytes);
    client.handle_bytes(Duration::ZERO, &bytes);
    std::iter::from_fn(|| client.poll_event()).collect()
}

fn request(client: &mut ColaClient) -> String {
    let frame = client.poll_transmit().and_then(Transmit::into_frame).unwrap();
    String::from_utf8(frame[1..frame.len() - 1].to_vec()).unwrap()
}

#[test]
fn replies_that_come_twice_and_events_between_are_tolerated() {
    let mut client = ColaClient::new(ColaConfig::default(), Dialect::A);
    assert_eq!(request(&mut client), "sRN DeviceIdent");
    for _ in 0..2 {
        assert!(reply(&mut client, "sRA DeviceIdent 6 LMS10x 5 V1.10").is_empty());
    }
    assert_eq!(request(&mut client), "sRN FirmwareVersion");
    assert!(reply(&mut client, "sSN LMDscandata 1 1").is_empty());
    assert!(client.poll_transmit().is_none());
    assert!(reply(&mut client, "sRA FirmwareVersion 9 V1.80.2  ").is_empty());
    assert_eq!(request(&mut client), "sMN SetAccessMode 3 F4724744");
    let wrong = HostEvent::Refused {
        command: "SetAccessMode",
        error: Some(SopasError::MethodAccessDenied.into()),
        fatal: false,
    };
    assert_eq!(reply(&mut client, "sAN SetAccessMode 0"), [wrong]);
    // Settings that others may have left: it has none of them.
    let mut asked = request(&mut client);
    while let Some(name) = asked.strip_prefix("sRN ") {
        assert_eq!(reply(&mut client, "sFA 3"), [], "{name}");
        asked = request(&mut client);
    }
    assert_eq!(asked, "sWN LMDscandatacfg 1 0 0 0 0 0 0 0 0 0 0 1");
    reply(&mut client, "sWA LMDscandatacfg");
    assert_eq!(request(&mut client), "sMN LMCstartmeas");
    reply(&mut client, "sMA LMCstartmeas");
    assert!(client.poll_transmit().is_none());
    reply(&mut client, "sAN LMCstartmeas 0");
    assert_eq!(request(&mut client), "sMN Run");
    reply(&mut client, "sAN Run 1");
    assert_eq!(request(&mut client), "sEN LMDscandata 1");
    let refused = HostEvent::Refused {
        command: "LMDscandata",
        error: Some(SopasError::UnknownEvent.into()),
        fatal: true,
    };
    assert_eq!(reply(&mut client, "sFA F"), [refused]);
    assert!(client.is_done());
}

#[test]
fn a_hundred_other_telegrams_are_too_many() {
    let mut client = ColaClient::new(ColaConfig::default(), Dialect::A);
    assert_eq!(request(&mut client), "sRN DeviceIdent");
    for _ in 0..201 {
        assert!(reply(&mut client, "sSN LIDinputstate 1 0 2 2 2 2 0").is_empty());
    }
    assert_eq!(request(&mut client), "sRN DeviceIdent", "asked once more");
    let events = reply(&mut client, "sSN LIDinputstate 1 0 2 2 2 2 0");
    assert_eq!(events, [HostEvent::NoAnswer { command: "DeviceIdent" }]);
}

/// Each reply of the start-up is damaged once, in either dialect and at either end of the telegram: it is asked for again, and the start-up goes on.
#[test]
fn a_reply_that_is_lost_or_damaged_is_asked_for_once_more() {
    for (dialect, first_byte) in [(Dialect::A, 0), (Dialect::B, 0), (Dialect::B, 9)] {
        let replies = start_up(dialect, &|_, _| {}).1;
        for damaged in 1..replies {
            let (events, _) = start_up(dialect, &|place, bytes: &mut Vec<u8>| {
                if place == damaged {
                    bytes[first_byte] ^= 0x20;
                }
            });
            assert!(matches!(events[..], [HostEvent::Ready(_)]), "{dialect} {damaged}: {events:?}");
            // Twice is too often.
            let (events, _) = start_up(dialect, &|place, bytes: &mut Vec<u8>| {
                if place >= damaged {
                    bytes[first_byte] ^= 0x20;
                }
            });
            assert!(matches!(events[..], [HostEvent::NoAnswer { .. }]), "{dialect} {damaged}: {events:?}");
        }
    }
}

/// A start-up whose replies are damaged so, by their number: its events, and how many replies there were.
fn start_up(dialect: Dialect, damage: &dyn Fn(usize, &mut Vec<u8>)) -> (Vec<HostEvent>, usize) {
    let (mut device, mut session) = (device(MODELS[0]), Session::new(DialectPolicy::Auto));
    let mut client = ColaClient::new(ColaConfig::default(), dialect);
    let (mut now, mut place, mut events) = (Duration::ZERO, 0, Vec::new());
    while events.is_empty() {
        while let Some(request) = client.poll_transmit().and_then(Transmit::into_frame) {
            let mut replies = Vec::new();
            session.handle_bytes(&mut device, SimTime::ZERO + now, &request, &mut replies);
            for reply in replies {
                let mut bytes = reply.bytes;
                damage(place, &mut bytes);
                place += 1;
                client.handle_bytes(now, &bytes);
            }
            events.extend(std::iter::from_fn(|| client.poll_event()));
        }
        now = client.poll_timeout().unwrap_or(now);
        client.handle_timeout(now);
        events.extend(std::iter::from_fn(|| client.poll_event()));
    }
    (events, place)
}
