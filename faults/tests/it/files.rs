//! Files of faults: what is refused, where, and with which remedy.

use rowscan_faults::{At, FAULTS, FaultSpec, Lasts, NOT_HERE, markdown, read};
use rowscan_settings::{Table, TomlError};

fn refusal(text: &str) -> (usize, String) {
    match read(text) {
        Err(TomlError { line, message }) => (line, message),
        Ok(specs) => panic!("{text} is read as {specs:?}"),
    }
}

#[test]
fn a_file_is_read_with_every_common_key() {
    let text = "version = 1\n[[fault]]\nname = \"jitter\"\nid = \"shaky\"\non = \"left\"\nsd_ms = 8\np = 0.2\ncount = 3\n\
                at = { after = \"out.end\", plus_s = 1.5 }\nfor = { scans = 20 }\nevery = { s = 30 }\ndirection = \"to_client\"\n";
    let specs = read(text).expect("sound");
    let [spec] = specs.as_slice() else { panic!("{specs:?}") };
    assert_eq!((spec.id.as_deref(), spec.on.as_deref()), (Some("shaky"), Some("left")));
    assert!(
        matches!(&spec.at, At::After { id, end: true, plus } if id == "out" && plus.as_secs_f64() == 1.5)
    );
    assert_eq!((spec.lasts, spec.p, spec.count), (Some(Lasts::Scans(20)), Some(0.2), Some(3)));
}

#[test]
fn mistakes_name_their_line_and_the_remedy() {
    let head = "[[fault]]\n";
    for (text, line, message) in [
        ("id = \"a\"\n", 1, "the key `name` is missing; add it"),
        ("name = \"splt\"\n", 2, "unknown fault `splt`; did you mean `split`?"),
        ("name = \"split\"\n\nofset = 3\n", 4, "unknown key `ofset` of `split`; did you mean `offset`?"),
        ("name = \"split\"\noffset = 0\n", 3, "expected an integer from 1 to 1000000, found integer `0`"),
        (
            "name = \"split\"\noffset = 1\npieces = 2\n",
            1,
            "`offset` and `pieces` are two ways to say one thing; leave one out",
        ),
        ("name = \"delay\"\n", 1, "the key `ms` is missing; add it"),
        (
            "name = \"bus_off\"\nrestart_ms = 100\nfor = { s = 1 }\n",
            4,
            "`restart_ms` says when the controllers come back; leave `for` and `until` out, or `restart_ms`",
        ),
        (
            "name = \"contamination\"\nsector = [135, 45]\n",
            1,
            "`sector`: expected where it begins and where it ends, [from, to] with from below to, found [135, 45]: no beam lies between them",
        ),
        (
            "name = \"delay\"\nms = \"slow\"\n",
            3,
            "expected a number from 0 to 3600000, found string \"slow\"",
        ),
        ("name = \"flip\"\nregion = \"lenght\"\n", 3, "unknown value `lenght`; did you mean `length`?"),
        ("name = \"flip\"\nat = { row = 3 }\n", 3, "unknown key `row`; did you mean `row_m`?"),
        (
            "name = \"flip\"\nat = { s = 3, scan = 2 }\n",
            3,
            "expected one of s, scan, command, row_m, tree, after, plus_s, found several",
        ),
        ("name = \"flip\"\nat = { s = 3, plus_s = 2 }\n", 3, "`plus_s` goes with `after`; leave it out"),
        (
            "name = \"flip\"\nat = { command = \" \" }\n",
            3,
            "expected a command such as \"sWN LMDscandatacfg\", or \"20\" of an LMS2xx, found an empty text",
        ),
        ("name = \"flip\"\np = 1.5\n", 3, "expected a number from 0 to 1, found number `1.5`"),
        (
            "name = \"rst\"\nfor = { s = 2 }\n",
            3,
            "`rst` happens at once and lasts; leave `for` and `until` out",
        ),
        (
            "name = \"stall\"\nfor = { s = 2 }\nuntil = { s = 9 }\n",
            4,
            "`for` and `until` are two ways to say one thing; leave one out",
        ),
        ("name = \"stall\"\nevery = { s = 0 }\n", 3, "expected `every` of 0.001 s or more"),
        ("name = \"stall\"\nfor = { s = 0 }\n", 3, "expected `for` of more than 0 s: nothing would happen"),
        (
            "name = \"stall\"\np = 0\n",
            3,
            "expected a probability of more than 0, found 0: nothing would happen",
        ),
        ("name = \"delay\"\nms = 0\n", 3, "expected `ms` other than 0: nothing would happen"),
        ("name = \"clock_step\"\ns = 0\n", 3, "expected `s` other than 0: nothing would happen"),
        ("name = \"lateral\"\nm = 0\n", 3, "expected `m` other than 0: nothing would happen"),
        ("name = \"valve_slow\"\nms = 0\n", 3, "expected `ms` other than 0: nothing would happen"),
        ("name = \"refuse\"\ndirection = \"both\"\n", 3, "`refuse` has no direction; leave it out"),
        (
            "name = \"inject\"\nhex = \"0g\"\n",
            3,
            "expected pairs of hex digits such as \"02 ff\", found string \"0g\"",
        ),
        ("name = \"garble\"\n", 1, "it does nothing; give `noise_p`, `lost_p`, `break_p`, or both rates"),
        (
            "name = \"modem\"\n",
            2,
            "the fault `modem` is not there: no modem lines are emulated; a pseudo-terminal has none, and RFC 2217 would carry them",
        ),
        (
            "name = \"host_pause\"\n",
            2,
            "the fault `host_pause` is not there: a child's fault, and only `rowscan check` runs a child: give it there, in a scenario",
        ),
        (
            "name = \"encoder\"\n",
            1,
            "expected one of `slip`, `missed`, `extra`, `stuck`, `reversed`, `wrap`, `cable_out`: without any nothing would happen",
        ),
    ] {
        assert_eq!(refusal(&format!("{head}{text}")), (line, message.to_owned()), "{text}");
    }
    assert_eq!(refusal("[[faults]]\n"), (1, "unknown key `faults`; did you mean `fault`?".to_owned()));
    assert_eq!(refusal("version = 2\n"), (0, "expected version 1 of fault files, found 2".to_owned()));
}

#[test]
fn a_fault_may_come_as_json() {
    let table: Table =
        serde_json::from_str(r#"{"name":"flip","at":{"scan":5},"region":"payload"}"#).expect("JSON");
    let spec = FaultSpec::from_table(&table).expect("a fault");
    assert_eq!((spec.fault.name, &spec.at), ("flip", &At::Scan(5)));
}

#[test]
fn the_page_names_every_fault_parameter_and_row_that_is_not_there() {
    let page = markdown();
    for fault in FAULTS.iter() {
        assert!(page.contains(&format!("| `{}` | {} |", fault.name, fault.layer.name())), "{}", fault.name);
        for parameter in fault.parameters {
            assert!(
                page.contains(&format!("| `{}` | `{}` |", fault.name, parameter.key)),
                "{}",
                parameter.key
            );
        }
    }
    for name in NOT_HERE.iter().flat_map(|(names, _)| names.split(" / ")) {
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
}
