//! The conversation against a scanner that a test plays, in time that it tells.

use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::compact::{Imu, Telegram};
use rowscan_protocol::device::{Device, Identity, MeasuredLine};
use rowscan_protocol::model::{ScanMode, by_name};
use rowscan_protocol::reading::Reading;
use rowscan_protocol::rig::EchoChoice;
use rowscan_protocol::time::SimTime;

use super::*;
use crate::DriverError;

mod answers;

/// The scanner's number, in its telegrams too.
const SERIAL: u32 = 24_130_021;

/// Plays the scanner: what it is asked, and what it answers.
struct Bench {
    session: PicoSession,
    now: Duration,
    nonces: u32,
    /// Writes and methods that were taken, in their order.
    taken: Vec<(String, Value)>,
    /// The filters that the model has.
    filters: Vec<(&'static str, Value)>,
}

fn place(password: &str) -> PicoscanAddress {
    PicoscanAddress { password: password.into(), ..PicoscanAddress::new("pico:80".into()) }
}

fn answer(http: u16, body: &Value) -> Vec<u8> {
    let body = body.to_string();
    let mut piece = vec![ANSWER];
    piece.extend(format!("HTTP/1.1 {http} X\r\nContent-Length: {}\r\n\r\n{body}", body.len()).bytes());
    piece
}

fn refusal(http: u16, status: u64) -> Vec<u8> {
    answer(http, &json!({ "header": { "status": status, "message": "" } }))
}

/// Where the scanner's datagrams come from.
const HERE: &str = "127.0.0.1:50001";

/// What stands before a datagram from there.
fn head_from(place: &str) -> Vec<u8> {
    piece::datagram_head(place.parse().expect("an address")).to_vec()
}

fn head() -> Vec<u8> {
    head_from(HERE)
}

/// The datagrams of a turn of the scanner with this number, from this place.
fn turn(serial_number: u32, place: &str, number: u64) -> Vec<Vec<u8>> {
    let identity = Identity { serial_number, ..Identity::default() };
    let mut device = Device::new(by_name("picoscan150").expect("a model"), identity);
    device.direct("127.0.0.1:2115".parse().expect("an address"));
    device.enable_streaming();
    let line = MeasuredLine { grid: device.mirror().beams, echoes: &[] };
    let mut waiting = Vec::new();
    for _ in 0..=number {
        waiting.clear();
        device.measure(SimTime::ZERO, &line).expect("it measures");
        device.segments(SimTime::ZERO, &[line], &mut waiting);
    }
    let sent = |datagram| [head_from(place), device.send(datagram).expect("it streams").1].concat();
    waiting.into_iter().map(sent).collect()
}

/// A reading that says its number in its time.
fn imu(place: &str, time_us: u64) -> Vec<u8> {
    let mut piece = head_from(place);
    Telegram::Imu(Imu { time_us, ..Imu::default() }).encode(&mut piece).expect("it is encoded");
    piece
}

fn datagram() -> Vec<u8> {
    let mut piece = head();
    Telegram::Imu(Imu::default()).encode(&mut piece).expect("it is encoded");
    piece
}

impl Bench {
    fn new(password: &str, config: &DriverConfig) -> Self {
        let to = Some("127.0.0.1:2115".parse().expect("an address"));
        let session = PicoSession::new(&place(password), to, config);
        Self { session, now: Duration::ZERO, nonces: 0, taken: Vec::new(), filters: Vec::new() }
    }

    fn request(&mut self) -> Option<(String, Value)> {
        let frame = self.session.poll_transmit()?.into_frame()?;
        self.session.handle_timeout(self.now);
        let text = String::from_utf8(frame).expect("text");
        let (head, body) = text.split_once("\r\n\r\n").expect("a head and a body");
        let target = head.split(' ').take(2).collect::<Vec<_>>().join(" ");
        let body = if body.is_empty() { Value::Null } else { serde_json::from_str(body).expect("JSON") };
        Some((target, body))
    }

    fn hear(&mut self, piece: &[u8]) {
        self.session.handle_bytes(self.now, piece);
    }

    /// As a picoScan with the password as delivered and this salt answers; none of a body that is no more than its header.
    fn reply(&mut self, target: &str, body: &Value, salt: Option<&[u8]>) -> Vec<u8> {
        let ok = json!({ "status": 0, "message": "Ok" });
        match target {
            "GET /api/DeviceIdent" => {
                let ident = json!({ "Name": "picoScan", "Version": "2.2.1.0R" });
                answer(200, &json!({ "header": ok, "data": { "DeviceIdent": ident } }))
            }
            "GET /api/FirmwareVersion" => {
                answer(200, &json!({ "header": ok, "data": { "FirmwareVersion": "2.2.1.0R" } }))
            }
            "GET /api/SerialNumber" => {
                answer(200, &json!({ "header": ok, "data": { "SerialNumber": SERIAL.to_string() } }))
            }
            "GET /api/FREchoFilter" => answer(200, &json!({ "header": ok, "data": { "FREchoFilter": 2 } })),
            get if get.starts_with("GET /api/LFP") => {
                let found = self.filters.iter().find(|(name, _)| get.ends_with(name));
                found.map_or_else(
                    || refusal(400, 1),
                    |(_, data)| answer(200, &json!({ "header": ok, "data": data })),
                )
            }
            "POST /api/getChallenge" => {
                assert_eq!(body["data"]["user"], "Service");
                self.nonces += 1;
                let mut challenge =
                    json!({ "realm": REALM, "nonce": format!("n{}", self.nonces), "opaque": "o" });
                if let Some(salt) = salt {
                    challenge["salt"] = json!(salt);
                }
                answer(200, &json!({ "header": ok, "challenge": challenge }))
            }
            post => {
                let name = post.strip_prefix("POST /api/").expect("a POST");
                let (header, salt) = (&body["header"], salt.unwrap_or_default());
                let nonce = format!("n{}", self.nonces);
                let expected = response("Service", "servicelevel", salt, &nonce, name);
                assert_eq!((&header["nonce"], &header["opaque"]), (&json!(nonce), &json!("o")));
                if header["response"] != expected {
                    return refusal(401, INVALID_CHALLENGE);
                }
                self.taken.push((name.to_owned(), body["data"].clone()));
                answer(200, &json!({ "header": ok, "data": {} }))
            }
        }
    }

    /// Answers until nothing more is asked.
    fn answer_all(&mut self, salt: Option<&[u8]>) {
        while let Some((target, body)) = self.request() {
            let reply = self.reply(&target, &body, salt);
            self.hear(&reply);
        }
    }

    /// Answers up to the request for `wanted`, which is left open.
    fn answer_up_to(&mut self, wanted: &str) {
        while let Some((target, body)) = self.request() {
            if target.ends_with(wanted) {
                return;
            }
            let reply = self.reply(&target, &body, Some(&[1, 2]));
            self.hear(&reply);
        }
        panic!("{wanted} was not asked");
    }

    /// All but readings: the datagrams of most tests are some.
    fn events(&mut self) -> Vec<HostEvent> {
        let all = std::iter::from_fn(|| self.session.poll_event());
        all.filter(|event| !matches!(event, HostEvent::Reading(_))).collect()
    }
}

fn as_delivered() -> Bench {
    Bench::new("servicelevel", &DriverConfig::default())
}

#[test]
fn the_start_up_is_that_of_sicks_sdk_and_ends_with_a_datagram() {
    let mode = ScanMode { frequency_centihz: 2500, step: 2500 };
    let cola = ColaConfig { scan_mode: Some(mode), echo: Some(EchoChoice::Last), ..ColaConfig::default() };
    // An empty salt is none, and so is one that is missing: clients differ on it, and scanners send 16 numbers.
    for salt in [Some(&[7_u8; 16][..]), Some(&[]), None] {
        let mut bench =
            Bench::new("servicelevel", &DriverConfig { cola: cola.clone(), ..DriverConfig::default() });
        bench.hear(&datagram());
        bench.answer_all(salt);
        assert_eq!(bench.events(), [], "what came before the settings is another's stream");
        let to = json!({ "Protocol": 1, "IPAddress": [127, 0, 0, 1], "Port": 2115 });
        let expected = [
            ("ScanDataEthSettings", to),
            ("ScanDataFormat", json!(2)),
            ("PerformanceProfileNumber", json!(5)),
            ("FREchoFilter", json!(2)),
        ];
        let taken = bench.taken.iter().zip(&expected);
        assert!(taken.clone().count() == 4 && bench.taken.len() == 6, "{:?}", bench.taken);
        for ((name, data), (wanted, value)) in taken {
            assert_eq!((name.as_str(), &data[*wanted]), (*wanted, value));
        }
        assert_eq!(bench.taken[4].0, "mStartMeasure");
        assert_eq!(bench.taken[5], ("ScanDataEnable".to_owned(), json!({ "ScanDataEnable": true })));
        bench.hear(&datagram());
        let [HostEvent::Ready(info)] = &bench.events()[..] else { panic!("ready") };
        assert_eq!((info.ident.as_str(), info.firmware.as_str()), ("picoScan 2.2.1.0R", "2.2.1.0R"));
        bench.session.stop(bench.now);
        bench.answer_all(salt);
        assert_eq!(bench.taken[6], ("ScanDataEnable".to_owned(), json!({ "ScanDataEnable": false })));
        assert_eq!((bench.events(), bench.session.is_done()), (vec![HostEvent::Stopped], true));
    }
}

/// The name of a setting that was put right.
fn put_right(event: &HostEvent) -> Option<&'static str> {
    match event {
        HostEvent::Leftover { setting, refused: None } => Some(setting.name),
        _ => None,
    }
}

/// Beams that a filter takes away look like misses: what another client has left is switched off, with a message.
#[test]
fn filters_that_were_on_are_switched_off_with_a_message_whatever_the_model_has() {
    let angles =
        |on: Value| json!({ "bEnable": on, "fThetaStart": -0.3, "fThetaStop": 0.3, "uiBeamIncrement": 3 });
    for (on, off) in [(json!(true), json!(false)), (json!(1), json!(0))] {
        let mut bench = as_delivered();
        // Wrapped by its name, as devices do, and bare, as the schema shows it.
        bench.filters = vec![
            ("LFPangleRangeFilter", json!({ "LFPangleRangeFilter": angles(on.clone()) })),
            ("LFPradialDistanceRangeFilter", json!({ "bEnable": on, "ulDistMin": 0, "ulDistMax": 2000 })),
            ("LFPintervalFilter", json!({ "bEnable": off, "uiReductionFactor": 2 })),
        ];
        bench.answer_all(Some(&[1, 2]));
        let written: Vec<_> =
            bench.taken.iter().filter(|(name, _)| name.starts_with("LFP")).cloned().collect();
        let radial = json!({ "bEnable": off, "ulDistMin": 0, "ulDistMax": 2000 });
        let expected = [
            ("LFPangleRangeFilter".to_owned(), json!({ "LFPangleRangeFilter": angles(off.clone()) })),
            ("LFPradialDistanceRangeFilter".to_owned(), json!({ "LFPradialDistanceRangeFilter": radial })),
        ];
        assert_eq!(written, expected);
        let told = bench.events();
        let names: Vec<_> = told.iter().filter_map(put_right).collect();
        assert_eq!(names, ["LFPangleRangeFilter", "LFPradialDistanceRangeFilter"], "{told:?}");
    }
    let mut bench = as_delivered();
    bench.answer_all(Some(&[1, 2]));
    assert_eq!(bench.events(), [], "a model without them is no news");
    // Layers are the user's choice: they stay, and that is told.
    for (on, told) in [(true, 1), (false, 0)] {
        let mut bench = as_delivered();
        let layers = json!({ "LFPlayerFilter": { "bEnable": on, "aLayers": [true, false] } });
        bench.filters = vec![("LFPlayerFilter", layers)];
        bench.answer_all(Some(&[1, 2]));
        let limited = |event: &HostEvent| matches!(event, HostEvent::Limited { what } if what.contains("LFPlayerFilter"));
        assert_eq!(bench.events().iter().filter(|event| limited(event)).count(), told);
        assert!(bench.taken.iter().all(|(name, _)| name != "LFPlayerFilter"));
    }
    // One that keeps its filter says so with the filter's name.
    let mut bench = as_delivered();
    bench.filters = vec![("LFPintervalFilter", json!({ "bEnable": true, "uiReductionFactor": 2 }))];
    bench.answer_up_to("POST /api/getChallenge");
    bench.hear(&refusal(403, 4));
    let told = bench.events();
    assert!(matches!(told[..], [HostEvent::Refused { command: LOGIN, fatal: true, .. }]), "{told:?}");
    let mut bench = as_delivered();
    bench.filters = vec![("LFPintervalFilter", json!({ "bEnable": true, "uiReductionFactor": 2 }))];
    bench.answer_up_to("POST /api/LFPintervalFilter");
    bench.hear(&refusal(400, 8));
    bench.answer_all(Some(&[1, 2]));
    let told = bench.events();
    let [HostEvent::Leftover { setting, refused: Some(Refusal::Rest { status: Some(8), .. }) }] = &told[..]
    else {
        panic!("{told:?}")
    };
    assert_eq!(setting.name, "LFPintervalFilter");
}

#[test]
fn readings_are_asked_for_at_the_port_of_scans_and_told() {
    let asked = |imu, encoder| {
        let mut bench = as_delivered();
        let place = PicoscanAddress { imu, encoder, ..place("servicelevel") };
        let to = Some("127.0.0.1:2115".parse().expect("an address"));
        bench.session = PicoSession::new(&place, to, &DriverConfig::default());
        bench.answer_all(Some(&[1, 2]));
        turn(SERIAL, HERE, 0).iter().take(1).for_each(|piece| bench.hear(piece));
        bench.hear(&datagram());
        let events: Vec<_> = std::iter::from_fn(|| bench.session.poll_event()).collect();
        assert!(matches!(events[..], [HostEvent::Ready(_), HostEvent::Reading(_)]), "{events:?}");
        let names = bench.taken.iter().map(|(name, _)| name.clone());
        let last = names.skip_while(|name| name != "mStartMeasure").skip(1);
        for (name, data) in bench.taken.iter().filter(|(name, _)| name.ends_with("EthSettings")) {
            assert_eq!(data[name.as_str()]["Port"], 2115, "{name}");
        }
        last.collect::<Vec<_>>()
    };
    let imu = ["ImuDataEthSettings", "ImuDataEnable"];
    let encoder = ["EncoderDataEthSettings", "EncoderDataEnable"];
    assert_eq!(asked(false, false), ["ScanDataEnable"]);
    assert_eq!(asked(true, false), [&imu[..], &["ScanDataEnable"]].concat());
    assert_eq!(asked(false, true), [&encoder[..], &["ScanDataEnable"]].concat());
    assert_eq!(asked(true, true), [&imu[..], &encoder[..], &["ScanDataEnable"]].concat());
}

/// Both scanners have their readings sent to this port: one machine's two emulators, two devices, and two behind one address.
#[test]
fn readings_of_two_scanners_at_one_port_are_told_apart_by_where_they_come_from() {
    const OTHER: u32 = SERIAL + 1;
    for (own, other) in
        [(HERE, "127.0.0.1:50002"), ("10.0.0.1:2115", "10.0.0.2:2115"), ("[::1]:7", "[::1]:8")]
    {
        let mut bench = as_delivered();
        bench.answer_all(Some(&[1, 2]));
        // Before the first segment nobody knows whose they are.
        bench.hear(&imu(other, 900));
        bench.hear(&imu(own, 1));
        for number in 0..3 {
            turn(OTHER, other, number).iter().for_each(|piece| bench.hear(piece));
            turn(SERIAL, own, number).iter().for_each(|piece| bench.hear(piece));
            bench.hear(&imu(other, 901 + number));
            bench.hear(&imu(own, 2 + number));
        }
        let mut times = Vec::new();
        for event in std::iter::from_fn(|| bench.session.poll_event()) {
            match event {
                HostEvent::Reading(Reading::Imu(imu)) => times.push(imu.time_us),
                HostEvent::OtherSender { found, followed } => {
                    assert_eq!((found, followed), (Some(OTHER), Some(SERIAL)), "{own}");
                }
                _ => {}
            }
        }
        assert_eq!(times, [1, 2, 3, 4], "{own}");
        // All that was left out is counted: three turns and four readings.
        let telegrams = 3 * turn(OTHER, other, 0).len() as u64 + 4;
        let counted = [OtherSender { serial_number: Some(OTHER), telegrams }];
        assert_eq!(bench.session.other_senders(), counted, "{own}");
    }
}

#[test]
fn a_wrong_password_is_tried_twice_and_no_more() {
    let mut bench = Bench::new("wrong", &DriverConfig::default());
    bench.answer_all(Some(&[1]));
    let error = Some(Refusal::Rest { status: Some(10), http: 401 });
    assert_eq!(bench.events(), [HostEvent::Refused { command: LOGIN, error, fatal: true }]);
    // Five would lock everybody out.
    assert_eq!((bench.nonces, bench.session.is_done()), (2, true));
}

#[test]
fn a_nonce_that_has_gone_stale_is_replaced() {
    let mut bench = as_delivered();
    bench.answer_up_to("/api/ScanDataFormat");
    bench.hear(&refusal(401, INVALID_CHALLENGE));
    bench.answer_all(Some(&[1, 2]));
    bench.hear(&datagram());
    assert!(matches!(bench.events()[..], [HostEvent::Ready(_)]));
    assert_eq!(bench.taken.iter().filter(|(name, _)| name == "ScanDataFormat").count(), 1);
}

/// What was taken once is right: what is refused later is the nonce.
#[test]
fn a_nonce_that_stays_stale_is_no_wrong_password() {
    let mut bench = as_delivered();
    bench.answer_up_to("/api/ScanDataFormat");
    bench.hear(&refusal(401, INVALID_CHALLENGE));
    bench.answer_up_to("/api/ScanDataFormat");
    bench.hear(&refusal(401, INVALID_CHALLENGE));
    let error = Some(Refusal::StaleNonce { http: 401 });
    assert_eq!(bench.events(), [HostEvent::Refused { command: LOGIN, error, fatal: true }]);
}

/// Each refusal has an error of its own.
#[test]
fn refusals_are_told_apart() {
    use crate::endpoint::Endpoint;
    let endpoint = super::super::PicoEndpoint::new(place("servicelevel"), &DriverConfig::default());
    let told = |refusal| endpoint.refused(LOGIN, Some(refusal));
    let wrong = Refusal::Rest { status: Some(INVALID_CHALLENGE), http: 401 };
    assert!(matches!(told(wrong), DriverError::Login { .. }));
    let busy = told(Refusal::TooMany { http: 429 });
    assert!(
        matches!(busy, DriverError::TooManyRequests { .. }) && busy.to_string().contains("nor after 3.5s")
    );
    assert!(matches!(told(Refusal::StaleNonce { http: 401 }), DriverError::StaleNonce { .. }));
}

#[test]
fn too_many_requests_are_made_again_after_pauses_that_grow() {
    let mut bench = as_delivered();
    bench.answer_up_to("/api/getChallenge");
    for pause in PAUSES {
        bench.hear(&refusal(429, TOO_MANY));
        assert_eq!(bench.request(), None, "not at once");
        assert_eq!(bench.session.poll_timeout(), Some(bench.now + pause));
        bench.now += pause;
        bench.session.handle_timeout(bench.now);
        assert_eq!(bench.request().map(|(target, _)| target).as_deref(), Some("POST /api/getChallenge"));
    }
    bench.hear(&refusal(429, TOO_MANY));
    let error = Some(Refusal::TooMany { http: 429 });
    assert_eq!(bench.events(), [HostEvent::Refused { command: LOGIN, error, fatal: true }]);
}

#[test]
fn what_scans_can_do_without_may_be_refused() {
    let mut bench = as_delivered();
    bench.answer_up_to("/api/FREchoFilter");
    bench.hear(&refusal(404, 5));
    bench.answer_all(Some(&[1, 2]));
    bench.hear(&datagram());
    let [HostEvent::Refused { command: "FREchoFilter", fatal: false, .. }, HostEvent::Ready(_)] =
        bench.events()[..]
    else {
        panic!("it goes on")
    };
    // It has kept another one than was asked for.
    assert_eq!(bench.session.listener.heard_settings().and_then(|heard| heard.code()), Some(2));
    let mut bench = as_delivered();
    bench.answer_up_to("/api/ScanDataFormat");
    bench.hear(&refusal(400, 9));
    let error = Some(Refusal::Rest { status: Some(9), http: 400 });
    assert_eq!(bench.events(), [HostEvent::Refused { command: "ScanDataFormat", error, fatal: true }]);
}

#[test]
fn silence_and_nonsense_are_told() {
    let mut bench = as_delivered();
    assert!(bench.request().is_some());
    let due = bench.session.poll_timeout().expect("a reply is awaited");
    assert_eq!(due, bench.now + ColaConfig::default().reply_timeout);
    bench.session.handle_timeout(due);
    assert_eq!(bench.events(), [HostEvent::NoAnswer { command: "DeviceIdent" }]);
    for nonsense in [&b"\x01SSH-2.0-OpenSSH\r\n"[..], b"\x01", b"\x01HTTP/1.1 200 OK\r\n\r\n"] {
        let mut bench = as_delivered();
        assert!(bench.request().is_some());
        bench.hear(nonsense);
        let events = bench.events();
        let told = matches!(
            events[..],
            [HostEvent::NoAnswer { command: "DeviceIdent" } | HostEvent::Refused { fatal: true, .. }]
        );
        assert!(told, "{events:?}");
    }
}

/// The first datagram may come before the answer that lets it go.
#[test]
fn a_datagram_beside_the_last_answer_is_taken() {
    let mut bench = as_delivered();
    bench.hear(&datagram());
    bench.answer_up_to("POST /api/ScanDataEnable");
    bench.hear(&datagram());
    assert_eq!(
        (bench.session.counts().frames, bench.events()),
        (1, Vec::new()),
        "the first one is another's"
    );
}

#[test]
fn datagrams_that_never_come_are_waited_for_so_long() {
    let config = DriverConfig::default();
    let mut bench = Bench::new("servicelevel", &config);
    bench.answer_all(Some(&[1]));
    bench.session.handle_timeout(bench.now);
    // What is no telegram is none.
    bench.hear(&[head(), vec![2, 2, 2, 2, 1]].concat());
    let due = bench.session.poll_timeout().expect("a datagram is awaited");
    assert_eq!(due, bench.now + config.first_datagram_timeout);
    bench.session.handle_timeout(due);
    assert_eq!(bench.events(), [HostEvent::NoAnswer { command: DATAGRAMS }]);
}

#[test]
fn a_mode_that_no_profile_has_is_told() {
    let mode = ScanMode { frequency_centihz: 2500, step: 5000 };
    let cola = ColaConfig { scan_mode: Some(mode), ..ColaConfig::default() };
    let mut bench = Bench::new("servicelevel", &DriverConfig { cola, ..DriverConfig::default() });
    bench.answer_all(Some(&[1]));
    assert!(matches!(bench.events()[..], [HostEvent::Limited { .. }]));
    assert!(bench.taken.iter().all(|(name, _)| name != "PerformanceProfileNumber"));
}
