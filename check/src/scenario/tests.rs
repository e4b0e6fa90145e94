#![allow(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::path::PathBuf;

use super::*;

/// What the examples share.
const BASE: &str = r#"
version = 1
scene = "spindle"
seed = 7
end = { row_m = 18 }
[[device]]
id = "left"
model = "lms111"
[[run]]
id = "sut"
command = ["./controller", "{left.tcp}"]
"#;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        folder.file("base.toml", BASE);
        folder.file(
            "boom.toml",
            "version = 1\n[[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 1\nz_to_m = 2\n",
        );
        folder
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, text).expect("written");
        path
    }

    fn load(&self, text: &str) -> Result<Scenario, ScenarioError> {
        Scenario::load(&self.file("it.toml", text))
    }

    fn refused(&self, text: &str) -> String {
        let message = self.load(text).expect_err(text).to_string();
        message.rsplit("it.toml").next().unwrap_or_default().to_owned()
    }
}

/// Examples 1 to 8 of the fact sheet, with what keeps each from running; nothing keeps 1 to 6.
const EXAMPLES: [(&str, &str); 8] = [
    (
        "",
        r#"
version = 1
scene = "spindle"
seed = 7
clock = { mode = "paced", scale = 1 }
end = { row_m = 18 }
[[device]]
id = "left"
model = "lms111"
tcp = "127.0.0.1:0"
profile = "field"
start = "off"
[[run]]
id = "sut"
command = ["./controller", "--scanner", "{left.tcp}"]
ready = { alive_s = 1 }
[[fault]]
name = "power"
on = "left"
at = { s = 0 }
for = { s = 20 }
[[expect]]
what = "first_scan"
after = "power.end"
within_s = 12
"#,
    ),
    (
        "",
        r#"
use = "base.toml"
[[fault]]
id = "crank"
name = "power"
on = "left"
at = { tree = 4 }
for = { s = 1.4 }
dips = [[0, 6.0], [300, 9.0], [900, 12.0]]
[[expect]]
what = "scans_lost"
between = ["crank", "crank.recovered"]
equals = "device"
[[expect]]
what = "streaming"
after = "crank.end"
within_s = 35
"#,
    ),
    (
        "",
        r#"
use = "base.toml"
clock = { mode = "lockstep", ack = { sut = "idle" }, deadline_wall_s = 5 }
fault = [{ name = "split", on = "left", direction = "to_client", at = { scan = 10 }, sweep = { offset = "all" } }]
expect = [{ what = "bytes_of", file = "decisions.jsonl", equals_run_without = "faults" }]
"#,
    ),
    (
        "",
        r#"
use = "base.toml"
fault = [{ id = "out", name = "half_open", on = "left", at = { row_m = 6.0 }, for = { s = 8 } }]
expect = [
  { what = "log", of = "sut", matches = "(?i)lost|disconnect", after = "out", within_s = 5 },
  { what = "valves", all = "closed", after = "out", within_s = 2 },
  { what = "reconnects", equals = 1 },
]
"#,
    ),
    (
        "",
        r#"
use = "base.toml"
fault = [{ name = "encoder", slip = 0.15, at = { tree = 3 }, until = { tree = 6 } }]
expect = [
  { what = "leaf_area_error", abs_below = 0.08 },
  { what = "latency_error_m", edge = "leading", p95_below = 0.10 },
]
"#,
    ),
    (
        "",
        r#"
use = "base.toml"
fault = [
  { name = "clock_wrap", on = "left", at = { row_m = 9 } },
  { name = "clock_step", on = "left", s = -3600, at = { row_m = 12 } },
]
expect = [{ what = "impacted_total_area_m2", equals_run_without = "faults", tolerance = 0 }]
"#,
    ),
    (
        "",
        r#"
use = "base.toml"
bus = [{ id = "can0", port = "udp-aog:127.0.0.1:2234" }]
run = [{ id = "tc", command = ["tc-server", "--udp", "2234"], ready = { frame = "pgn:0xCB00 cmd:0xE" } }]
fault = [{ id = "off", name = "bus_off", on = "can0", at = { s = 20 }, for = { s = 8 } }]
expect = [
  { what = "valves", all = "closed", after = "off", within_s = 6.5 },
  { what = "ddi", element = 1, ddi = 161, value = "as_setpoint", after = "off.end", within_s = 10 },
]
"#,
    ),
    (
        "an `ack` by an output",
        r#"
scene = "spindle"
seed = 7
version = 1
clock = { mode = "lockstep", ack = { sut = { frame = "NozzleDuty", counter = "Step" } }, deadline_wall_s = 5 }
end = { row_m = 60 }
sprayer = { boom = "boom.toml", bus = "can0" }
repeat = { seeds = 5 }
[[device]]
id = "left"
model = "lms111"
tcp = "127.0.0.1:0"
[[bus]]
id = "can0"
port = "slcan:./can"
[[run]]
id = "sut"
command = ["./controller", "{left.tcp}", "{can0.path}"]
[[fault]]
name = "jitter"
on = "left"
sd_ms = 8
p = 0.2
[[expect]]
what = "off_target_share"
below = 0.25
[[expect]]
what = "recall"
above = 0.95
[[expect]]
what = "saved_litres"
between = [0.27, 0.80]
[[expect]]
what = "same_bytes"
of = "valves.jsonl"
runs = 2
"#,
    ),
];

#[test]
fn the_eight_examples_parse_and_say_what_they_wait_for() {
    let folder = Folder::new();
    for (number, (waits_for, text)) in EXAMPLES.iter().enumerate() {
        let scenario = folder.load(text).unwrap_or_else(|error| panic!("example {}: {error}", number + 1));
        let refusal = scenario.refusal.unwrap_or_default();
        assert_eq!(refusal.is_empty(), waits_for.is_empty(), "example {}: {refusal}", number + 1);
        assert!(refusal.contains(waits_for), "example {}: {refusal}", number + 1);
        assert!(!scenario.faults.is_empty());
    }
}

#[test]
fn a_file_replaces_its_base_key_by_key() {
    let folder = Folder::new();
    let scenario = folder
        .load("use = \"base.toml\"\nseed = 8\nend = { scans = 5 }\nexpect = [{ what = \"scans_lost\", equals = 0 }]\n")
        .expect("sound");
    assert_eq!((scenario.seed, scenario.end), (Some(8), End::Scans(5)));
    assert_eq!((scenario.devices.len(), scenario.runs.len(), scenario.refusal), (1, 1, None));
    let message = folder.refused("use = \"it.toml\"\n");
    assert!(message.contains("in a circle"), "{message}");
}

#[test]
fn a_sweep_is_one_fault_a_scan_and_a_pause_has_its_child() {
    let folder = Folder::new();
    let of = |faults: &str| {
        let text =
            format!("use = \"base.toml\"\nexpect = [{{ what = \"exit_code\" }}]\nfault = [{faults}]\n");
        folder.load(&text).expect(faults).faults
    };
    let faults = of("{ id = \"cut\", name = \"split\", at = { scan = 10 }, sweep = { offset = [3, 5] } }");
    let [ScenarioFault::Sweep(sweep)] = faults.as_slice() else { panic!("{faults:?}") };
    let steps: Vec<_> =
        (0..9).filter_map(|number| sweep.step(number)).map(|spec| (spec.id, spec.at)).collect();
    let step = |id: &str, scan| (Some(id.to_owned()), rowscan_faults::At::Scan(scan));
    assert_eq!(steps, [step("cut[3]", 10), step("cut[4]", 11), step("cut[5]", 12)]);

    let faults = of("{ name = \"host_pause\", on = \"sut\", at = { row_m = 1 }, for = { s = 2.5 } }");
    let [ScenarioFault::Pause(pause)] = faults.as_slice() else { panic!("{faults:?}") };
    assert_eq!((pause.id.as_str(), pause.on.as_deref()), ("host_pause", Some("sut")));
    assert_eq!((&pause.at, pause.lasts), (&rowscan_faults::At::RowM(1.0), Duration::from_millis(2500)));
}

#[test]
fn a_wrong_fault_is_told_with_its_line() {
    let folder = Folder::new();
    for (fault, expected) in [
        ("name = \"split\"\noffest = 3\n", ":3: unknown key `offest` of `split`; did you mean `offset`?"),
        ("name = \"splt\"\n", ":2: unknown fault `splt`; did you mean `split`?"),
        (
            "name = \"split\"\nsweep = { offset = \"all\" }\n",
            ":3: a fault with `sweep` begins at a scan: expected `at = { scan = N }`",
        ),
        ("name = \"split\"\nat = { scan = 1 }\nsweep = { offset = [9, 2] }\n", ":4: expected [first, last]"),
        ("name = \"host_pause\"\n", ":1: `host_pause` lasts for seconds of the host's time: add `for"),
        ("name = \"host_pause\"\nuntil = { s = 1 }\n", ":3: unknown key `until` of `host_pause`"),
    ] {
        let message = folder.refused(&format!("[[fault]]\n{fault}"));
        assert!(message.starts_with(expected), "{fault}: {message}");
    }
}

/// Whatever can have some values only: bounds that none of them keeps to, or every one, are refused, and the others are taken.
#[test]
fn bounds_that_decide_nothing_are_refused() {
    let folder = Folder::new();
    let mut tried = 0;
    for what in crate::what::WHATS {
        let Some((least, most)) = what.reach() else { continue };
        let of = match what.name {
            "fault_acts" => "of = \"cut\"\n",
            "time_to_safe_s" => "after = \"cut\"\n",
            _ => "",
        };
        let text = |bound: &str| {
            let fault = "[[fault]]\nname = \"fin\"\nid = \"cut\"\nat = { s = 1 }\n";
            format!("use = \"base.toml\"\n{fault}[[expect]]\nwhat = \"{}\"\n{of}{bound}\n", what.name)
        };
        let inside = if most.is_finite() { most } else { 7.0 };
        let takes = |key: &&(&str, String)| what.keys.contains(&key.0);
        let decides = [
            ("above", format!("above = {least}")),
            ("below", format!("below = {inside}")),
            ("equals", format!("equals = {inside}")),
            ("between", format!("between = [{least}, {}]", 0.5 * inside)),
        ];
        for (_, bound) in decides.iter().filter(takes) {
            folder.load(&text(bound)).unwrap_or_else(|error| panic!("{}: {bound}: {error}", what.name));
            tried += 1;
        }
        let beyond = if most.is_finite() { most + 1.0 } else { f64::NAN };
        let decides_nothing = [
            ("above", format!("above = {}", least - 0.1)),
            ("above", format!("above = {most}")),
            ("below", format!("below = {least}")),
            ("below", format!("below = {beyond}")),
            ("equals", format!("equals = {}", least - 1.0)),
            ("equals", format!("equals = {beyond}")),
            ("between", format!("between = [{}, {}]", least - 2.0, least - 1.0)),
            ("between", format!("between = [{least}, {most}]")),
        ];
        if what.is_whole() {
            folder.refused(&text("equals = 1.5"));
        }
        let finite = |(_, bound): &&(&str, String)| !bound.contains("inf") && !bound.contains("NaN");
        for (_, bound) in decides_nothing.iter().filter(takes).filter(finite) {
            let message = folder.refused(&text(bound));
            let expected = format!("`{}` is {least} ", what.name);
            assert!(message.contains(&expected), "{}: {bound}: {message}", what.name);
        }
    }
    assert!(tried > 30, "{tried}");
}

#[test]
fn mistakes_are_told_with_line_and_remedy() {
    let folder = Folder::new();
    let use_base = "use = \"base.toml\"\n";
    for (text, expected) in [
        ("sed = 7\n", ":1: unknown key `sed`; did you mean `seed`?"),
        ("clock = { mode = \"lockstep\", step_ms = 10 }\n", ":1: unknown key `step_ms`"),
        (
            "version = 1\n[[device]]\nid = \"a\"\nmodle = \"lms111\"\n",
            ":4: unknown key `modle`; did you mean `model`?",
        ),
        (
            "\n[[expect]]\nwhat = \"scan_lost\"\nequals = 0\n",
            ":2: unknown `what`: `scan_lost`; did you mean `scans_lost`?",
        ),
        (
            "[[expect]]\nwhat = \"exit_code\"\nmatches = \"x\"\n",
            ":1: `matches` does not go with `exit_code`; valid here: of, equals",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\n",
            ":1: `scans_lost` expects nothing yet; add `equals`, `above`, `below` or `between`",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nequals = 3\nabove = 1\n",
            ":1: `equals` and `above`: expected one of them, found both",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nabove = 5\nbelow = 3\n",
            ":1: `above` and `below`: expected numbers with others between them, found 5 and 3",
        ),
        (
            "[[expect]]\nwhat = \"recall\"\nabove = 1.5\n",
            ":1: `recall` is 0 to 1: expected bounds that some of these values keep to and others do not, found above 1.5: none of them does",
        ),
        (
            "[[expect]]\nwhat = \"waste\"\nbelow = 0\n",
            ":1: `waste` is 0 to 1: expected bounds that some of these values keep to and others do not, found below 0: none of them does",
        ),
        (
            "[[expect]]\nwhat = \"off_target_share\"\nbetween = [0.2, 20]\n",
            ":1: `off_target_share` is 0 to 1: expected bounds that some of these values keep to and others do not, found 0.2 to 20: `between` reaches beyond them",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nabove = -1\n",
            ":1: `scans_lost` is 0 and more: expected bounds that some of these values keep to and others do not, found above -1: all of them do",
        ),
        (
            "[[expect]]\nwhat = \"exit_code\"\nequals = 300\n",
            ":1: `exit_code` is 0 to 255: expected bounds that some of these values keep to and others do not, found 300: none of them does",
        ),
        ("[[expect]]\nwhat = \"log\"\nmatches = \"(\"\n", ":1: `matches`: `(` is no pattern"),
        (
            "[[expect]]\nwhat = \"scans_repeated\"\nequals = \"device\"\n",
            ":1: `equals`: expected a number, found \"device\"",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nafter = \"a\"\nbetween = [\"a\", \"b\"]\nequals = 0\n",
            ":1: `after` (a) and `between` (a, b) are two windows; leave one out",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nbetween = [\"a\", \"a\"]\nequals = 0\n",
            ":1: `between`: expected two events, found `a` twice",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nafter = \"end\"\nequals = 0\n",
            ":1: `after`: expected an event before the end, found `end`",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nbetween = [\"end\", \"a\"]\nequals = 0\n",
            ":1: `between`: expected an event before the end, found `end`",
        ),
        (
            "[[expect]]\nwhat = \"first_scan\"\nwithin_s = -1\n",
            ":1: `within_s`: expected a number from 0 on, found -1",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nbetween = [3, 1]\n",
            ":1: `between`: expected a number from 3 on, found 1",
        ),
        (
            "[[expect]]\nwhat = \"leaf_area_error\"\nabove = -inf\n",
            ":1: `above`: expected a finite number, found -inf",
        ),
        (
            "[[expect]]\nwhat = \"leaf_area_error\"\nequals = 0\ntolerance = inf\n",
            ":1: `tolerance`: expected a number from 0 on, found inf",
        ),
        (
            "[[expect]]\nwhat = \"leaf_area_error\"\nabs_below = 0\n",
            ":1: `abs_below`: expected a number above 0, found 0",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nequals = nan\n",
            ":1: `equals`: expected a number or a text, found nan or inf",
        ),
        (
            "[[expect]]\nwhat = \"scans_lost\"\nequals = \"devise\"\n",
            ":1: `equals`: expected a number or \"device\", found \"devise\"",
        ),
        (
            "[[expect]]\nwhat = \"impacted_total_area_m2\"\nequals = \"device\"\n",
            ":1: `equals`: expected a number, found \"device\"",
        ),
        (
            "[[expect]]\nwhat = \"fault_acts\"\nof = \"a\"\nequals = \"device\"\n",
            ":1: `equals`: expected a number, found \"device\"",
        ),
        (
            "[[expect]]\nwhat = \"exit_code\"\nequals = \"device\"\n",
            ":1: `equals`: expected a number, found \"device\"",
        ),
        (
            "[[expect]]\nwhat = \"bytes_of\"\nfile = \"a\"\nequals = \"\"\n",
            ":1: `equals`: expected the path of a file, found \"\"",
        ),
        (
            "[[expect]]\nwhat = \"bytes_of\"\nfile = \"a\"\nequals = 3\n",
            ":1: `equals`: expected the path of a file, found a number",
        ),
        (
            "[[expect]]\nwhat = \"log\"\nmatches = \"\"\n",
            ":1: `matches`: expected a pattern, found an empty text",
        ),
        (
            "[[expect]]\nwhat = \"leaf_area_error\"\nequals = 1\nequals_run_without = \"faults\"\n",
            ":1: `equals` and `equals_run_without` are two expected values; leave one out",
        ),
        (
            "[[expect]]\nwhat = \"bytes_of\"\nfile = \"a\"\nequals_run_without = \"seed\"\n",
            ":1: `equals_run_without`: expected \"faults\", found \"seed\"",
        ),
        (
            "[[device]]\nid = \"a\"\nmodel = \"lms111\"\nstart = \"standbye\"\n",
            ":1: unknown state `standbye`; did you mean `standby`?",
        ),
    ] {
        let message = folder.refused(text);
        assert!(message.contains(expected), "{text}: {message}");
    }
    for what in ["impacted_total_area_m2", "leaf_area_error", "fault_acts", "saved_litres"] {
        let message = folder.refused(&format!("[[expect]]\nwhat = \"{what}\"\nbetween = [\"a\", \"end\"]\n"));
        let expected = format!(":1: `between` of `{what}`: expected two numbers, found two events");
        assert!(message.starts_with(&expected), "{message}");
        assert!(
            message.ends_with(
                "Between events scans_lost, scans_repeated, segments_lost, telegrams_bad, reconnects are counted"
            ),
            "{message}"
        );
    }
    let expects = "expect = [{ what = \"scans_lost\", equals = 0 }]\n";
    for (text, expected) in [
        ("clock = { ack = { sut = \"idle\" } }\n", "add `mode = \"lockstep\"`"),
        ("clock = { mode = \"lockstep\", scale = 2 }\n", "leave `scale` out"),
        ("clock = { mode = \"lockstep\", ack = { sud = \"idle\" } }\n", "there is no [[run]] with id `sud`"),
        ("clock = { mode = \"lockstep\", ack = { sut = \"never\" } }\n", "expected sent, read, idle"),
        ("end = { row_m = 1, s = 2 }\n", "expected one of `row_m`, `s`"),
        ("end = { row_m = 0 }\n", "`end`: expected `row_m` above 0, found 0"),
        ("end = { row_m = -2.5 }\n", "`end`: expected `row_m` above 0, found -2.5"),
        ("end = { s = 0 }\n", "`end`: expected `s` above 0, up to 86400, found 0"),
        ("end = { scans = 0 }\n", "`end`: expected `scans` from 1 on, found 0"),
        (
            "run = [{ id = \"end\", command = [\"x\"] }]\n",
            "the run `end`: `end` is already the name of the end of the run",
        ),
        (
            "fault = [{ id = \"end\", name = \"split\" }]\n",
            "the fault `end`: `end` is already the name of the end of the run",
        ),
        (
            "fault = [{ id = \"sut\", name = \"split\" }]\n",
            "the fault `sut`: `sut` is already the name of the run `sut`",
        ),
        (
            "fault = [{ id = \"left.first_scan\", name = \"split\" }]\n",
            "`left.first_scan` is already the name of the device `left` or of what happens to it; choose another `id`",
        ),
        (
            "fault = [{ id = \"a\", name = \"split\" }, { id = \"a\", name = \"stall\" }]\n",
            "is already the name of the fault `a`",
        ),
        ("device = [{ id = \"left\", model = \"lms999\" }]\n", "found `lms999`"),
        ("run = [{ id = \"left\", command = [\"x\"] }]\n", "two things are called `left`"),
        ("version = 2\n", "`version`: expected 1, found 2"),
        (
            "device = [{ id = \"a\", model = \"lms111\", start = \"off\" }]\n",
            "nothing ends that: add a [[fault]] `power`",
        ),
        (
            "device = [{ id = \"a\", model = \"lms111\", start = \"installation\" }]\n",
            "a lms111 has no state `installation`",
        ),
        ("device = [{ id = \"a\", model = \"lms111\", pty = \"a\" }]\n", "leave `pty` and `rate` out"),
        (
            "device = [{ id = \"a\", model = \"lms291\", tcp = \"127.0.0.1:0\" }]\n",
            "leave `tcp`, `rest`, `udp` and `allow_destination` out",
        ),
        (
            "device = [{ id = \"a\", model = \"lms111\", rest = \"127.0.0.1:0\" }]\n",
            "a lms111 has no REST interface",
        ),
        ("device = [{ id = \"a\", model = \"lms291\", rate = 57600 }]\n", "found 57600"),
        (
            "clock = { mode = \"lockstep\" }\ndevice = [{ id = \"a\", model = \"lms291\" }]\n",
            "`a` has a serial line, and in lockstep nobody can see what its client has read",
        ),
        (
            "run = [{ id = \"x\", command = [\"x\"], ready = { frame = \"18FF\" } }]\n",
            "`ready` of run `x`: expected a frame such as 0x18FF1080",
        ),
    ] {
        let message = folder.refused(&format!("{use_base}{text}{expects}"));
        assert!(message.contains(expected), "{text}: {message}");
    }
    assert!(folder.refused(use_base).contains("it expects nothing; add an [[expect]]"));
}

#[test]
fn what_cannot_happen_is_not_waited_for() {
    let folder = Folder::new();
    let fault = "[[fault]]\nname = \"split\"\n[[fault]]\nname = \"split\"\n\
         [[fault]]\nid = \"cut\"\nname = \"split\"\nat = { scan = 1 }\nsweep = { offset = \"all\" }\n";
    let with = |expect: &str| format!("use = \"base.toml\"\nexpect = [{{ {expect} }}]\n{fault}");
    // All that can: of the rig, of children, of faults with and without an id.
    for event in
        ["left.first_scan", "sut.exited", "split", "split-2.act", "split.recovered", "cut", "cut.end"]
    {
        let expect = format!("what = \"scans_lost\", between = [\"{event}\", \"end\"], equals = 0");
        folder.load(&with(&expect)).unwrap_or_else(|error| panic!("{event}: {error}"));
    }
    for (expect, expected) in [
        (
            "what = \"scans_lost\", after = \"split.nosuch\", equals = 0",
            ": expectation 1, `scans_lost`: `after`: no event is called `split.nosuch` here; did you mean `split`?",
        ),
        (
            "what = \"telegrams_bad\", between = [\"split\", \"gone\"], equals = 0",
            ": expectation 1, `telegrams_bad`: `between`: no event is called `gone` here; valid here: cut, cut.end,",
        ),
        // A sweep acts once a value, and tells no act.
        (
            "what = \"streaming\", after = \"cut.act\", within_s = 1",
            "`after`: no event is called `cut.act` here",
        ),
        (
            "what = \"log\", matches = \"x\", after = \"other.ready\"",
            "`after`: no event is called `other.ready` here",
        ),
        (
            "what = \"fault_acts\", of = \"splt\", equals = 0",
            ": expectation 1, `fault_acts`: `of`: there is no fault `splt`; did you mean `split`?",
        ),
    ] {
        let message = folder.refused(&with(expect));
        assert!(message.contains(expected), "{expect}: {message}");
    }
}
