//! The table of refusals, line by line, on real requests.

use crate::bench::Bench;
use rowscan_protocol::device::variable::Value;
use rowscan_protocol::device::{Fault, REFUSALS};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::{self, MODELS, Model};
use rowscan_protocol::telegram::fr_echo_filter::{self, EchoFilter};
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram, Variable, encode_empty};
use rowscan_protocol::time::SimTime;

#[test]
fn every_example_of_the_table_is_refused_with_the_code_of_its_line() {
    for line in REFUSALS {
        let logged_in = ![Fault::WriteWithoutLogin, Fault::CallWithoutLogin].contains(&line.fault);
        let mut bench = if logged_in { Bench::logged_in(line.model) } else { Bench::new(line.model) };
        prepare(&mut bench, line.fault);
        let expected = format!("sFA {:X}", line.error.code());
        assert_eq!(bench.ask(line.example), expected, "{} ({})", line.example, line.what);
    }
}

/// Every known name, asked the wrong way round: something is always answered, and never with another kind than asked for.
#[test]
fn there_is_no_silence_whatever_is_asked() {
    for model in MODELS {
        let mut bench = Bench::logged_in(model.name);
        for entry in rowscan_protocol::device::command::COMMANDS {
            for kind in [Kind::Rn, Kind::Ri, Kind::Wn, Kind::Mn, Kind::En] {
                let mut payload = Vec::new();
                encode_empty(Dialect::A, kind, entry.name, false, &mut payload);
                let reply = bench.ask(std::str::from_utf8(&payload).unwrap());
                let answer = match kind {
                    Kind::Rn | Kind::Ri => "sRA",
                    Kind::Wn => "sWA",
                    Kind::Mn => "sAN",
                    _ => "sEA",
                };
                assert!(reply.starts_with(answer) || reply.starts_with("sFA "), "{payload:?}: {reply}");
                if entry.name == "mSCreboot" {
                    bench = Bench::logged_in(model.name);
                }
            }
        }
    }
}

/// The echo in recorded scans is what it is, whatever a client asks for, over CoLa and REST, of every model that has the setting.
#[test]
fn a_played_device_keeps_the_echo_of_its_scans() {
    let mut models = 0;
    let has_it = |model: &&Model| {
        model.echoes > 1 && Bench::new(model.name).ask("sRN FREchoFilter").starts_with("sRA")
    };
    for model in model::all().filter(has_it) {
        for recorded in 0..=2 {
            let mut bench = Bench::new(model.name);
            let login = model.logins.last().expect("a password");
            bench.ask(&format!("sMN SetAccessMode {} {:08X}", login.level, login.hash));
            bench.device.play_back(&LmdScandata::default(), [], Some(recorded));
            let name = EchoFilter::NAME;
            for asked in 0..=2 {
                // Of all echoes the first one is taken.
                let taken =
                    asked == recorded || (recorded, asked) == (fr_echo_filter::ALL, fr_echo_filter::FIRST);
                let case = format!("{}: {asked} of {recorded}", model.name);
                let reply = bench.ask(&format!("sWN {name} {asked}"));
                assert_eq!(reply, if taken { format!("sWA {name}") } else { "sFA 4".to_owned() }, "{case}");
                let now = if taken { asked } else { recorded };
                assert_eq!(bench.ask(&format!("sRN {name}")), format!("sRA {name} {now}"), "{case}");
                if let Some(variable) = bench.device.variable(name) {
                    let set =
                        bench.device.set_value(variable, vec![Value::Number(asked.into())], SimTime::ZERO);
                    assert_eq!(set.is_ok(), taken, "{case} by REST");
                }
                let back = if taken { format!("sWN {name} {recorded}") } else { format!("sRN {name}") };
                bench.ask(&back);
                assert_eq!(bench.ask(&format!("sRN {name}")), format!("sRA {name} {recorded}"), "{case}");
            }
            models += 1;
        }
    }
    assert!(models >= 12, "{models}");
}

/// A request that was refused changes nothing.
#[test]
fn a_refusal_leaves_the_settings_alone() {
    for line in REFUSALS {
        let mut bench = Bench::logged_in(line.model);
        prepare(&mut bench, line.fault);
        let before = saved(&mut bench);
        bench.ask(line.example);
        if ![Fault::WriteWithoutLogin, Fault::CallWithoutLogin].contains(&line.fault) {
            assert_eq!(saved(&mut bench), before, "{}", line.example);
        }
    }
}

/// One fault is that of a scanner whose scans are recorded ones, without remission.
fn prepare(bench: &mut Bench, fault: Fault) {
    if [Fault::FixedByRecording, Fault::EchoNotRecorded].contains(&fault) {
        bench.device.play_back(&LmdScandata::default(), [], None);
    }
}

fn saved(bench: &mut Bench) -> String {
    assert_eq!(bench.ask("sMN mEEwriteall"), "sAN mEEwriteall 1");
    bench.device.saved_settings()
}

#[test]
fn both_dialects_refuse_alike() {
    use rowscan_protocol::frame::encode;
    let mut bench = Bench::logged_in("lms111");
    for (name, kind, code) in
        [("x", Kind::Rn, 3), ("x", Kind::Mn, 2), ("x", Kind::En, 0xF), ("STlms", Kind::Wn, 0xA)]
    {
        let mut payload = Vec::new();
        encode_empty(Dialect::B, kind, name, false, &mut payload);
        let mut request = Vec::new();
        encode(Dialect::B, &payload, &mut request);
        bench.session = rowscan_protocol::device::Session::new(rowscan_protocol::device::DialectPolicy::Auto);
        let login = b"sMN SetAccessMode \x03\xF4\x72\x47\x44";
        let mut requests = Vec::new();
        encode(Dialect::B, login, &mut requests);
        requests.extend(request);
        let replies = bench.send(&requests);
        let telegram = Telegram::parse(Dialect::B, &replies[1].bytes[8..replies[1].bytes.len() - 1]).unwrap();
        assert_eq!(telegram.refusal().map(|error| error.code()), Some(code));
    }
}
