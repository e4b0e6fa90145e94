//! Answers that say no, not now, or nothing of a scanner; and the end.

use super::*;
use crate::endpoint::Endpoint;

#[test]
fn streams_that_were_switched_on_are_switched_off_at_the_end_and_no_others() {
    for (imu, encoder) in [(false, false), (true, false), (false, true), (true, true)] {
        let mut bench = as_delivered();
        let place = PicoscanAddress { imu, encoder, ..place("servicelevel") };
        let to = Some("127.0.0.1:2115".parse().expect("an address"));
        bench.session = PicoSession::new(&place, to, &DriverConfig::default());
        bench.answer_all(Some(&[1, 2]));
        bench.hear(&datagram());
        bench.taken.clear();
        bench.session.stop(bench.now);
        bench.answer_all(Some(&[1, 2]));
        let off: Vec<_> =
            bench.taken.iter().map(|(name, data)| (name.as_str(), &data[name.as_str()])).collect();
        let streams = [(true, "ScanDataEnable"), (imu, "ImuDataEnable"), (encoder, "EncoderDataEnable")];
        let expected: Vec<_> =
            streams.iter().filter(|(on, _)| *on).map(|(_, name)| (*name, &json!(false))).collect();
        assert_eq!(off, expected);
        assert!(bench.session.is_done());
    }
}

#[test]
fn one_that_is_busy_is_asked_again_in_the_logins_pauses_and_then_told() {
    for busy in [refusal(200, BUSY), refusal(503, 0), refusal(503, BUSY)] {
        for often in 0..=PAUSES.len() + 1 {
            let cola = ColaConfig { echo: Some(EchoChoice::Last), ..ColaConfig::default() };
            let mut bench = Bench::new("servicelevel", &DriverConfig { cola, ..DriverConfig::default() });
            for pause in [Duration::ZERO].iter().chain(&PAUSES).take(often) {
                bench.now += *pause;
                bench.session.handle_timeout(bench.now);
                bench.answer_up_to("POST /api/FREchoFilter");
                bench.hear(&busy);
            }
            bench.now += PAUSES.iter().sum::<Duration>();
            bench.session.handle_timeout(bench.now);
            bench.answer_all(Some(&[1, 2]));
            let told = bench.events();
            let taken = bench.taken.iter().any(|(name, _)| name == "FREchoFilter");
            assert_eq!(taken, often <= PAUSES.len(), "{often} {told:?}");
            let refused =
                matches!(told[..], [HostEvent::Refused { command: "FREchoFilter", fatal: false, .. }]);
            assert_eq!((refused, told.is_empty()), (!taken, taken), "{often} {told:?}");
        }
    }
}

#[test]
fn a_method_that_failed_is_told_with_its_code() {
    for data in [json!({ "ErrorCode": 3 }), json!({ "mStartMeasure": { "ErrorCode": 3 } })] {
        let mut bench = as_delivered();
        bench.answer_up_to("POST /api/mStartMeasure");
        bench.hear(&answer(200, &json!({ "header": { "status": 0 }, "data": data })));
        bench.answer_all(Some(&[1, 2]));
        let error = Some(Refusal::Method { code: 3 });
        assert_eq!(bench.events(), [HostEvent::Refused { command: "mStartMeasure", error, fatal: false }]);
    }
}

#[test]
fn another_web_server_is_told_from_a_scanner() {
    let page = |code: u16, body: &str| {
        let mut piece = vec![ANSWER];
        piece.extend(format!("HTTP/1.1 {code} X\r\nContent-Length: {}\r\n\r\n{body}", body.len()).bytes());
        piece
    };
    for (code, body, is_html) in
        [(200, "\n<!DOCTYPE html><p>printer", true), (404, "<html>", true), (200, "hello", false)]
    {
        let mut bench = as_delivered();
        assert!(bench.request().is_some());
        bench.hear(&page(code, body));
        let error = Refusal::NotJson { is_html, http: code };
        let refused = HostEvent::Refused { command: "DeviceIdent", error: Some(error), fatal: true };
        assert_eq!(bench.events(), [refused]);
        let endpoint = crate::picoscan::PicoEndpoint::new(place("servicelevel"), &DriverConfig::default());
        let told = endpoint.refused("DeviceIdent", Some(error)).to_string();
        let found = if is_html { "found HTML" } else { "found no JSON" };
        assert!(told.contains("expected JSON of a picoScan") && told.contains(found), "{told}");
    }
}
