//! The examples do what they say, on bytes that are known.

#[path = "../../examples/cola_a_and_b.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod cola_a_and_b;
#[path = "../../examples/lms2xx_frame.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod lms2xx_frame;
#[path = "../../examples/parse_telegram.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod parse_telegram;
#[path = "../../examples/session_without_io.rs"]
#[expect(dead_code, reason = "main is the example's")]
mod session_without_io;

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::lms2xx::telegram::Request;
use rowscan_protocol::telegram::set_access_mode::{PasswordHash, SetAccessMode};

#[test]
fn a_telegram_is_described_field_by_field() {
    // Operating hours, from the telegram listing: tenths of an hour, in hexadecimal.
    let lines = parse_telegram::describe(b"junk\x02sRA ODoprh 3F4\x03\x02sFA 5\x03").unwrap();
    assert_eq!(lines.len(), 2);
    assert!(lines[0].starts_with("CoLa A: sRA ODoprh") && lines[0].ends_with(" 1012"), "{lines:?}");
    assert!(lines[1].contains("error 5"), "{lines:?}");
}

#[test]
fn a_log_in_is_the_same_in_both_dialects() {
    let login = SetAccessMode { level: 3, password: PasswordHash(0xF472_4744) };
    assert_eq!(cola_a_and_b::write(Dialect::A, &login), b"\x02sMN SetAccessMode 3 F4724744\x03");
    for dialect in [Dialect::A, Dialect::B] {
        let mut bytes = cola_a_and_b::write(dialect, &login);
        assert_eq!(cola_a_and_b::read(dialect, &bytes).unwrap(), login);
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        assert!(cola_a_and_b::read(dialect, &bytes).is_err(), "{dialect}");
    }
}

#[test]
fn an_lms291_acknowledges_and_tells_its_type() {
    let answers = lms2xx_frame::ask(&Request::Type.to_frame()).unwrap();
    assert_eq!(answers[0], "ACK");
    assert!(answers[1].starts_with("BA: LMS291"), "{answers:?}");
    assert_eq!(answers.len(), 2);
    let mut damaged = Request::Type.to_frame();
    damaged[5] ^= 1;
    assert!(!lms2xx_frame::ask(&damaged).unwrap().contains(&"ACK".to_owned()));
}

#[test]
fn a_scan_goes_from_device_to_client_in_memory() {
    let scan = session_without_io::first_scan(2500).unwrap();
    assert_eq!(scan.beams.len(), 541);
    assert!(scan.echoes[0].range_m.iter().all(|&range_m| range_m == 2.5));
}
