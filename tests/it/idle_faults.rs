//! Faults that began and that nobody could notice, and what clients of a bus send for nothing: a green run by them proves nothing.

use std::fs;

use serde_json::Value;

use crate::common::binary::{run, text};

const SCENE: &str = "version = 2\n[orchard]\ntrees = 3\n[orchard.tree]\niterations = 7\n[[rig.scanner]]\nmodel = \"lms111\"\n";

/// What `check` says of a drive along the row with this fault and this expectation: its exit code, and its lines.
fn judged(fault: &str, beside: &str, (expect, further): &(&str, &str)) -> (Option<i32>, Vec<Value>, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let scenario = format!(
        "version = 1\nscene = \"row.toml\"\nend = {{ row_m = 4 }}\ndevice = [{{ id = \"left\", model = \"lms111\" }}]\nfault = [{fault}]\n{beside}\nexpect = [{expect}]\n\
         [[run]]\nid = \"sut\"\ncommand = [\"{{rowscan}}\", \"record\", \"tcp://{{left.tcp}}\", \"-o\", \"taken.mcap\"]\nready = {{ line = \"connected\" }}\n{further}"
    );
    fs::write(folder.path().join("row.toml"), SCENE).expect("written");
    let path = folder.path().join("it.toml");
    fs::write(&path, scenario).expect("written");
    let ended = run(&["check", text(&path), "--format", "jsonl"]);
    let lines = ended.stdout.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    (ended.code, lines, ended.stderr)
}

fn messages(lines: &[Value], verdict: &str) -> Vec<String> {
    let of = lines.iter().filter(|line| line["kind"] == "verdict" && line["verdict"] == verdict);
    of.filter_map(|line| line["message"].as_str().map(str::to_owned)).collect()
}

/// Each is an error by itself, and counts no act; who expects that it does nothing may have it so.
#[test]
fn a_fault_that_nobody_could_notice_is_an_error_and_no_act() {
    for (fault, why) in [
        ("name = \"encoder\", reversed = true", "nobody was told what the encoder counts"),
        ("name = \"reverse\", for = { s = 0.2 }", "over before the tractor went back"),
        ("name = \"stop\", for = { s = 0.02 }", "over before the tractor slowed down"),
        ("name = \"truncate\", on = \"left\", keep = 100000", "nothing about the telegram changes"),
    ] {
        let fault = format!("{{ id = \"f\", at = {{ row_m = 2 }}, {fault} }}");
        let (code, lines, said) = judged(&fault, "", &("{ what = \"telegrams_bad\", equals = 0 }", ""));
        let errors = messages(&lines, "error");
        assert!(errors.iter().any(|error| error.contains(why)), "{fault}: {errors:?} {said}");
        assert_eq!(code, Some(2), "{fault}: {lines:?}");
        let none = "{ what = \"fault_acts\", of = \"f\", equals = 0 }";
        let (code, lines, said) = judged(&fault, "", &(none, ""));
        assert_eq!(code, Some(0), "{fault}: {lines:?} {said}");
    }
}

#[test]
fn a_stop_that_stands_and_a_telegram_that_is_cut_are_acts() {
    for fault in [
        "name = \"stop\", for = { s = 4 }",
        "name = \"stop\", for = { s = 1 }",
        "name = \"reverse\", for = { s = 5 }",
        "name = \"truncate\", on = \"left\", bytes = 3",
    ] {
        let fault = format!("{{ id = \"f\", at = {{ row_m = 2 }}, {fault} }}");
        let (code, lines, said) =
            judged(&fault, "", &("{ what = \"fault_acts\", of = \"f\", above = 0 }", ""));
        assert_eq!(code, Some(0), "{fault}: {lines:?} {said}");
    }
}

/// A controller whose frames are not well formed says nothing on the bus; the report names the first.
#[test]
fn what_a_client_of_the_bus_sends_for_nothing_is_told() {
    let told = |sent: &str| {
        let beside = "bus = [{ id = \"can0\", port = \"socketcand:127.0.0.1:0\" }]";
        let client = format!(
            "\n[[run]]\nid = \"ecu\"\ncommand = [\"bash\", \"-c\", '''a={{can0.address}}; exec 3<>/dev/tcp/${{a%:*}}/${{a#*:}}; printf '%b' '{sent}' >&3; echo sent; sleep 60''']\nready = {{ line = \"sent\" }}\n"
        );
        let (code, lines, said) = judged("", beside, &("{ what = \"telegrams_bad\", equals = 0 }", &client));
        assert_eq!(code, Some(0), "{sent}: {lines:?} {said}");
        said
    };
    for (sent, why) in [
        (
            "< open can0 >< rawmode >< send 18FF1427 8 FA 00 >",
            "`send 18FF1427 8 FA 00`: no frame in the form",
        ),
        ("< send 123 1 00 >", "`send 123 1 00`: not in this state"),
        ("send 123 1 00\\n", "`send 123 1 00`: outside of angle brackets"),
    ] {
        let said = told(sent);
        assert!(said.contains(why) && said.contains("bus `can0`"), "{sent}: {said}");
    }
    let sound = told("< open can0 >< rawmode >< send 18FF1427 3 FA FA FA >\\n");
    assert!(!sound.contains("nothing came of it"), "{sound}");
}

/// Values of a sweep that change nothing are over like others, and are no acts; a sweep of nothing else is an error.
#[test]
fn a_sweep_goes_on_behind_a_value_that_changes_nothing() {
    let acts = |acts: u32| format!("{{ what = \"fault_acts\", of = \"f\", equals = {acts} }}");
    let swept = |fault: &str, expect: &str| {
        let fault = format!("{{ id = \"f\", on = \"left\", at = {{ scan = 5 }}, {fault} }}");
        judged(&fault, "", &(expect, ""))
    };
    let (code, lines, said) = swept("name = \"length\", sweep = { by = [-1, 1] }", &acts(2));
    assert_eq!(code, Some(0), "{lines:?} {said}");
    let beyond = "name = \"split\", sweep = { offset = [5000, 5002] }";
    let (code, lines, said) = swept(beyond, "{ what = \"telegrams_bad\", equals = 0 }");
    let errors = messages(&lines, "error");
    assert!(
        errors.iter().any(|error| error.contains("offset 5000 is beyond the telegram")),
        "{errors:?} {said}"
    );
    assert_eq!(code, Some(2), "{lines:?}");
    let (code, lines, said) = swept(beyond, &acts(0));
    assert_eq!(code, Some(0), "{lines:?} {said}");
}
