//! What SICK's clients meet: login, reading, writing, methods, and every refusal by its number.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use std::time::Duration;

use rowscan_protocol::device::variable::{Access, VARIABLES};
use rowscan_protocol::device::{Device, Identity, Stream};
use rowscan_protocol::model::by_name;
use rowscan_protocol::time::SimTime;
use rowscan_rest::{
    Answer, LOCKED_FOR, MAX_CHALLENGES, MAX_FAILURES, NOT_MODELLED, PASSWORD, Request, Rest, Verb, response,
};
use serde_json::{Value, json};

struct Bench {
    rest: Rest,
    device: Device,
    now: SimTime,
}

impl Bench {
    fn new() -> Self {
        Self::of("picoscan150")
    }

    fn of(model: &str) -> Self {
        let device = Device::new(by_name(model).unwrap(), Identity::default());
        Self { rest: Rest::new(7, device.serial_number()), device, now: SimTime::ZERO }
    }

    fn ask(&mut self, verb: Verb, name: &str, body: &[u8]) -> Answer {
        self.rest.answer(&Request { verb, name, body }, &mut self.device, self.now)
    }

    fn get(&mut self, name: &str) -> Value {
        let answer = self.ask(Verb::Get, name, b"");
        assert_eq!((answer.http, status(&answer)), (200, 0), "{name}: {}", answer.body);
        answer.body["data"].clone()
    }

    fn challenge(&mut self) -> Value {
        let answer = self.ask(Verb::Post, "getChallenge", br#"{"data":{"user":"Service"}}"#);
        assert_eq!(status(&answer), 0);
        answer.body["challenge"].clone()
    }

    /// A header that answers `challenge` with this password.
    fn header(challenge: &Value, password: &str, name: &str) -> Value {
        let salt: Vec<u8> =
            challenge["salt"].as_array().unwrap().iter().map(|byte| byte.as_u64().unwrap() as u8).collect();
        let nonce = challenge["nonce"].as_str().unwrap();
        json!({
            "user": "Service", "realm": challenge["realm"], "nonce": nonce, "opaque": challenge["opaque"],
            "response": response("Service", password, &salt, nonce, name),
        })
    }

    fn post_with(&mut self, password: &str, name: &str, data: Value) -> Answer {
        let challenge = self.challenge();
        let body = json!({ "header": Self::header(&challenge, password, name), "data": data });
        self.ask(Verb::Post, name, body.to_string().as_bytes())
    }

    fn post(&mut self, name: &str, data: Value) -> Answer {
        self.post_with(PASSWORD, name, data)
    }

    fn set(&mut self, name: &str, value: Value) -> u64 {
        status(&self.post(name, json!({ name: value })))
    }
}

fn status(answer: &Answer) -> u64 {
    answer.body["header"]["status"].as_u64().unwrap()
}

#[test]
fn a_challenge_has_sixteen_numbers_of_salt_beside_the_header() {
    let mut bench = Bench::new();
    let answer = bench.ask(Verb::Post, "getChallenge", br#"{"data":{"user":"Service"}}"#);
    assert!(answer.body.get("data").is_none(), "it stands beside the header: {}", answer.body);
    let challenge = &answer.body["challenge"];
    assert_eq!(challenge["realm"], "SICK Sensor");
    // An empty list or none makes one client of the two log in wrongly or abort.
    let salt = challenge["salt"].as_array().unwrap();
    assert!(salt.len() == 16 && salt.iter().all(|byte| byte.as_u64().is_some_and(|byte| byte < 256)));
    let first = challenge["nonce"].clone();
    assert_ne!(bench.challenge()["nonce"], first);
    assert_eq!(Bench::new().challenge()["nonce"], first, "the same seed");
}

#[test]
fn the_start_of_sicks_sdk_is_answered() {
    let mut bench = Bench::new();
    for (name, value) in [
        ("ScanDataEthSettings", json!({ "Protocol": 1, "IPAddress": [127, 0, 0, 1], "Port": 2115 })),
        ("ScanDataFormat", json!(2)),
        ("ScanDataEnable", json!(true)),
        ("ImuDataEthSettings", json!({ "Protocol": 1, "IPAddress": [127, 0, 0, 1], "Port": 7503 })),
        ("ImuDataEnable", json!(true)),
        ("EncoderDataEthSettings", json!({ "Protocol": 1, "IPAddress": [127, 0, 0, 1], "Port": 7504 })),
        ("EncoderDataEnable", json!(true)),
    ] {
        assert_eq!(bench.set(name, value.clone()), 0, "{name}");
        // What is a struct is wrapped by its name.
        assert_eq!(bench.get(name), json!({ name: value }));
    }
    for (stream, to) in Stream::ALL.into_iter().zip(["127.0.0.1:2115", "127.0.0.1:7503", "127.0.0.1:7504"]) {
        assert_eq!(bench.device.destination(stream).unwrap().to_string(), to);
    }
}

#[test]
fn the_configuration_example_reads_and_writes() {
    let mut bench = Bench::new();
    assert_eq!(
        bench.get("DeviceIdent"),
        json!({ "DeviceIdent": { "Name": "picoScan", "Version": "2.2.1.0R" } })
    );
    assert_eq!(bench.get("DeviceType"), json!({ "DeviceType": "picoScan1xx" }));
    assert_eq!(bench.get("LocationName"), json!({ "LocationName": "not defined" }));
    assert_eq!(bench.get("EtherIPAddress"), json!({ "EtherIPAddress": [192, 168, 0, 1] }));
    assert_eq!(bench.get("OpHours"), json!({ "OpHours": 1234 }));
    assert_eq!(bench.get("DeviceStatus"), json!({ "DeviceStatus": 3 }));
    assert_eq!(bench.get("PerformanceProfileNumber"), json!({ "PerformanceProfileNumber": 2 }));
    bench.now = SimTime(1_000_000_000);
    let time = json!({ "uiYear": 1970, "usiMonth": 1, "usiDay": 1, "usiHour": 0, "usiMinute": 0, "usiSec": 1, "udiUSec": 0 });
    assert_eq!(bench.get("LSPdatetime"), json!({ "LSPdatetime": time }));
    let range = json!({ "udiAngleRes": 3333, "diStartAngle": -1_380_000, "diStopAngle": 1_380_000 });
    let config = json!({ "udiScanFreq": 1500, "ScanRange": { "uiLength": 1, "aRange": [range] } });
    assert_eq!(bench.get("ScanConfig"), json!({ "ScanConfig": config }));
    for code in [2, 0] {
        assert_eq!(bench.set("FREchoFilter", json!(code)), 0);
        assert_eq!(bench.get("FREchoFilter"), json!({ "FREchoFilter": code }));
    }
}

#[test]
fn every_row_is_read_and_what_may_be_written_takes_what_it_reads() {
    let mut known = std::collections::BTreeSet::new();
    for model in rowscan_protocol::model::SEGMENTED {
        let mut bench = Bench::of(model.name);
        let variables: Vec<_> = bench.device.variables().collect();
        for variable in variables {
            let read = bench.get(variable.name)[variable.name].clone();
            assert!(!read.is_null(), "{}", variable.name);
            assert_eq!(read.is_object(), variable.is_struct(), "{}", variable.name);
            let expected = if variable.access == Access::ReadOnly { 8 } else { 0 };
            assert_eq!(bench.set(variable.name, read.clone()), expected, "{}", variable.name);
            if expected == 0 {
                assert_eq!(bench.get(variable.name)[variable.name], read);
            }
            known.insert(variable.name);
        }
    }
    assert_eq!(known.len(), VARIABLES.len(), "every row is of some model");
}

#[test]
fn a_picoscan120_has_what_its_table_has() {
    let mut bench = Bench::of("picoscan120");
    let names: Vec<&str> = bench.device.variables().map(|variable| variable.name).collect();
    assert!(names.contains(&"ScanDataEnable") && !names.contains(&"FREchoFilter"));
    for variable in VARIABLES {
        let answer = bench.ask(Verb::Get, variable.name, b"");
        let expected = if names.contains(&variable.name) { (200, 0) } else { (404, 5) };
        assert_eq!((answer.http, status(&answer)), expected, "{}", variable.name);
    }
    assert_eq!(bench.get("DeviceIdent")["DeviceIdent"]["Name"], "picoScan120");
    assert_eq!(bench.set("ScanDataEnable", json!(true)), 0);
    assert_eq!(bench.set("PerformanceProfileNumber", json!(3)), 5);
    assert_eq!(bench.get("ScanConfig")["ScanConfig"]["udiScanFreq"], 2000);
}

#[test]
fn a_multiscan136_has_its_own_field_and_a_filter_of_layers() {
    let mut bench = Bench::of("multiscan136");
    assert_eq!(bench.get("DeviceIdent")["DeviceIdent"]["Name"], "multiScan");
    assert_eq!(bench.get("DeviceType"), json!({ "DeviceType": "multiScan1xxx" }));
    let mut layers = bench.get("LFPlayerFilter")["LFPlayerFilter"].clone();
    assert_eq!(layers, json!({ "bEnable": false, "aLayers": vec![true; 16] }));
    layers["aLayers"][3] = json!(false);
    assert_eq!(bench.set("LFPlayerFilter", layers.clone()), 0);
    assert_eq!(bench.get("LFPlayerFilter")["LFPlayerFilter"], layers);
    // A list that is too short, and one of numbers.
    for wrong in [json!(vec![true; 15]), json!(vec![1; 16])] {
        assert_eq!(bench.set("LFPlayerFilter", json!({ "bEnable": true, "aLayers": wrong })), 2);
    }
    assert_eq!(bench.set("ScanDataPreformatting", json!(2)), 6);
    for name in ["PerformanceProfileNumber", "ScanConfig"] {
        assert_eq!(status(&bench.ask(Verb::Get, name, b"")), 5, "{name}");
    }
    let angles = |theta: i64| json!({ "bEnable": true, "fThetaStart": -theta, "fThetaStop": theta, "fPhiStart": -900_000, "fPhiStop": 900_000, "uiBeamIncrement": 1 });
    assert_eq!(bench.set("LFPangleRangeFilter", angles(1_800_000)), 0);
    assert_eq!(bench.set("LFPangleRangeFilter", angles(1_800_001)), 6);
    let mut pico = Bench::of("picoscan150");
    assert_eq!(pico.set("LFPangleRangeFilter", angles(1_380_000)), 0);
    assert_eq!(pico.set("LFPangleRangeFilter", angles(1_380_001)), 6);
    assert_eq!(status(&pico.ask(Verb::Get, "LFPlayerFilter", b"")), 5);
}

#[test]
fn a_nonce_is_good_for_one_request() {
    let mut bench = Bench::new();
    let challenge = bench.challenge();
    let header = Bench::header(&challenge, PASSWORD, "ScanDataEnable");
    let body = json!({ "header": header, "data": { "ScanDataEnable": true } }).to_string();
    assert_eq!(status(&bench.ask(Verb::Post, "ScanDataEnable", body.as_bytes())), 0);
    let again = bench.ask(Verb::Post, "ScanDataEnable", body.as_bytes());
    assert_eq!((again.http, status(&again)), (401, 10));
    // The response is of one name.
    let challenge = bench.challenge();
    let header = Bench::header(&challenge, PASSWORD, "ScanDataEnable");
    let body = json!({ "header": header, "data": { "ScanDataFormat": 3 } }).to_string();
    assert_eq!(status(&bench.ask(Verb::Post, "ScanDataFormat", body.as_bytes())), 10);
    assert_eq!(bench.get("ScanDataFormat"), json!({ "ScanDataFormat": 2 }));
}

#[test]
fn nobody_writes_without_the_password() {
    let mut bench = Bench::new();
    let plain = bench.ask(Verb::Post, "ScanDataEnable", br#"{"data":{"ScanDataEnable":true}}"#);
    assert_eq!((plain.http, status(&plain)), (401, 10));
    assert_eq!(status(&bench.post_with("client", "ScanDataEnable", json!({ "ScanDataEnable": true }))), 10);
    assert_eq!(bench.get("ScanDataEnable"), json!({ "ScanDataEnable": false }));
    assert_eq!(status(&bench.post_with(PASSWORD, "checkCredentials", Value::Null)), 0);
    for (user, expected) in [("Run", 4), ("AuthorizedClient", 4), ("Nobody", 9)] {
        let body = json!({ "data": { "user": user } }).to_string();
        assert_eq!(status(&bench.ask(Verb::Post, "getChallenge", body.as_bytes())), expected, "{user}");
    }
}

#[test]
fn five_failed_logins_lock_for_thirty_seconds() {
    let mut bench = Bench::new();
    for _ in 0..MAX_FAILURES {
        assert_eq!(status(&bench.post_with("wrong", "checkCredentials", Value::Null)), 10);
    }
    let ask = br#"{"data":{"user":"Service"}}"#;
    let locked = bench.ask(Verb::Post, "getChallenge", ask);
    assert_eq!((locked.http, status(&locked)), (429, 11));
    // Reading needs no login.
    bench.get("DeviceIdent");
    bench.now = SimTime::ZERO + (LOCKED_FOR - Duration::from_nanos(1));
    assert_eq!(status(&bench.ask(Verb::Post, "getChallenge", ask)), 11);
    bench.now = SimTime::ZERO + LOCKED_FOR;
    assert_eq!(bench.set("ScanDataEnable", json!(true)), 0);
    // Four failures and a success are none.
    for _ in 0..3 {
        for _ in 0..MAX_FAILURES - 1 {
            bench.post_with("wrong", "checkCredentials", Value::Null);
        }
        assert_eq!(bench.set("ScanDataEnable", json!(true)), 0);
    }
}

#[test]
fn challenges_are_bounded_and_the_oldest_makes_room() {
    let mut bench = Bench::new();
    let first = bench.challenge();
    let second = bench.challenge();
    for _ in 0..MAX_CHALLENGES - 1 {
        bench.challenge();
    }
    let post = |bench: &mut Bench, challenge: &Value| {
        let body = json!({ "header": Bench::header(challenge, PASSWORD, "checkCredentials") }).to_string();
        status(&bench.ask(Verb::Post, "checkCredentials", body.as_bytes()))
    };
    assert_eq!(post(&mut bench, &first), 10);
    assert_eq!(post(&mut bench, &second), 0);
}

#[test]
fn each_refusal_has_its_number() {
    let mut bench = Bench::new();
    for (name, value, expected) in [
        ("ScanDataEnable", json!(1), 2),
        ("ScanDataEnable", json!("true"), 2),
        ("ScanDataFormat", json!(2.0), 2),
        ("ScanDataFormat", json!(5), 6),
        ("ScanDataFormat", json!(u64::MAX), 6),
        ("ScanDataEthSettings", json!({ "Protocol": 1, "Port": 2115 }), 2),
        ("ScanDataEthSettings", json!({ "Protocol": 1, "IPAddress": [1, 2, 3], "Port": 2115 }), 7),
        ("ScanDataEthSettings", json!({ "Protocol": 1, "IPAddress": [1, 2, 3, 256], "Port": 2115 }), 6),
        ("ScanDataEthSettings", json!({ "Protocol": 1, "IPAddress": [1, 2, 3, 4], "Port": 65536 }), 6),
        (
            "LFPangleRangeFilter",
            json!({ "bEnable": true, "fThetaStart": -10.5, "fThetaStop": 10, "fPhiStart": 0, "fPhiStop": 0, "uiBeamIncrement": 1 }),
            2,
        ),
        ("LocationName", json!("a name that is too long for it"), 7),
        ("SerialNumber", json!("1"), 8),
    ] {
        let before = bench.get(name);
        assert_eq!(bench.set(name, value.clone()), expected, "{name} {value}");
        assert_eq!(bench.get(name), before);
    }
    for body in [b"".as_slice(), b"{", b"[]", b"null", b"\xFF"] {
        assert_eq!(status(&bench.ask(Verb::Post, "ScanDataEnable", body)), 1);
    }
    for name in NOT_MODELLED {
        assert_eq!(status(&bench.ask(Verb::Get, name, b"")), 1, "{name}");
        assert_eq!(status(&bench.ask(Verb::Post, name, b"{}")), 1, "{name}");
    }
    let unknown = bench.ask(Verb::Get, "ScanDataEnabled", b"");
    assert_eq!((unknown.http, status(&unknown)), (404, 5));
    assert_eq!(status(&bench.ask(Verb::Post, "ScanDataEnabled", b"{}")), 5);
}

#[test]
fn what_the_schema_has_is_modelled_or_listed_once() {
    for name in NOT_MODELLED {
        assert!(VARIABLES.iter().all(|variable| variable.name != *name), "{name}");
        assert_eq!(NOT_MODELLED.iter().filter(|other| *other == name).count(), 1, "{name}");
    }
    assert!(NOT_MODELLED.is_sorted());
}

#[test]
fn methods_answer_in_data_and_do_what_they_say() {
    let mut bench = Bench::new();
    bench.set("ScanDataEnable", json!(true));
    let data = |answer: Answer| answer.body["data"].clone();
    assert_eq!(data(bench.post("mStopMeasure", Value::Null)), json!({ "ErrorCode": 0 }));
    assert!(bench.device.destination(Stream::Scan).is_err());
    assert_eq!(data(bench.post("mStartMeasure", Value::Null)), json!({ "ErrorCode": 0 }));
    assert!(bench.device.destination(Stream::Scan).is_ok());
    // What is not saved does not live through a restart; what is does.
    bench.post("SoftReset", json!({ "ProcessorNbr": 0 }));
    assert_eq!(bench.get("ScanDataEnable"), json!({ "ScanDataEnable": false }));
    bench.set("PerformanceProfileNumber", json!(8));
    assert_eq!(data(bench.post("WriteEeprom", Value::Null)), json!({ "Success": true }));
    bench.post("SoftReset", Value::Null);
    assert_eq!(bench.get("PerformanceProfileNumber"), json!({ "PerformanceProfileNumber": 8 }));
    bench.set("PerformanceProfileNumber", json!(9));
    bench.post("RebootDevice", Value::Null);
    assert_eq!(bench.get("PerformanceProfileNumber"), json!({ "PerformanceProfileNumber": 9 }));
    bench.post("LoadFactoryDefaults", Value::Null);
    assert_eq!(bench.get("PerformanceProfileNumber"), json!({ "PerformanceProfileNumber": 2 }));
    // The calendar has whole milliseconds, as recorded devices tell it.
    let time = json!({ "uiYear": 2026, "usiMonth": 11, "usiDay": 25, "usiHour": 1, "usiMinute": 2, "usiSec": 3, "udiUSec": 4000 });
    assert_eq!(data(bench.post("LSPsetdatetime", json!({ "DateTime": time }))), json!({ "ErrorCode": 0 }));
    assert_eq!(bench.get("LSPdatetime"), json!({ "LSPdatetime": time }));
    // A method is no variable.
    assert_eq!(status(&bench.ask(Verb::Get, "WriteEeprom", b"")), 1);
}
