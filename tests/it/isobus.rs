//! ISOBUS in scenarios: the virtual sprayer as client of a controller's task controller, the rig's task controller for a client, and what goes wrong between
//! them. The other side's bytes are Python's of tools/scenarios/sprayer, nothing of ours.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::binary::{assert_says, run, text};

/// A verdict: name, verdict, message.
type Verdict = (String, String, String);

/// The folder of the scenarios in a temporary one, where a test may change them.
fn scenarios(folder: &Path) -> PathBuf {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/scenarios");
    for part in ["sprayer", "survey"] {
        std::fs::create_dir_all(folder.join(part)).expect("a folder");
        for entry in std::fs::read_dir(source.join(part)).expect("it is there") {
            let path = entry.expect("an entry").path();
            if path.is_file() {
                std::fs::copy(&path, folder.join(part).join(path.file_name().expect("a name")))
                    .expect("copied");
            }
        }
    }
    folder.join("sprayer")
}

/// What `check` says of a scenario, with one of the errors of the Python side. None without Python.
fn judged(path: &Path, fault: &str, keep: &Path) -> Option<Vec<Verdict>> {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("SKIPPED: isobus: no python3 on this machine");
        return None;
    }
    let ended = Command::new(env!("CARGO_BIN_EXE_rowscan"))
        .args(["check", text(path), "--format", "jsonl", "--keep", text(keep)])
        .env("SPRAY_FAULT", fault)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .expect("it runs");
    let told = String::from_utf8_lossy(&ended.stdout).into_owned();
    let lines = told.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).expect("JSON"));
    let word = |line: &serde_json::Value, key: &str| line[key].as_str().unwrap_or_default().to_owned();
    let verdicts = lines.filter(|line| line["kind"] == "verdict");
    let all: Vec<Verdict> =
        verdicts.map(|line| (word(&line, "name"), word(&line, "verdict"), word(&line, "message"))).collect();
    assert!(!all.is_empty(), "{told}{}", String::from_utf8_lossy(&ended.stderr));
    Some(all)
}

fn passes(found: &[Verdict]) {
    assert!(found.iter().all(|(_, verdict, _)| verdict == "passed"), "{found:#?}");
}

/// The verdict of the expectation whose name holds `named`.
fn verdict<'a>(found: &'a [Verdict], named: &str) -> &'a Verdict {
    found.iter().find(|(name, ..)| name.contains(named)).unwrap_or_else(|| panic!("{named}: {found:#?}"))
}

/// The one run that was kept, as JSON, and its folder.
fn kept(keep: &Path) -> (serde_json::Value, PathBuf) {
    let of = |folder: &Path| {
        let mut folders =
            std::fs::read_dir(folder).expect("kept").map(|entry| entry.expect("an entry").path());
        folders.find(|path| path.is_dir()).expect("a folder")
    };
    let run = of(&of(keep));
    let bytes = std::fs::read(run.join("sprayer.json")).expect("it is kept");
    (serde_json::from_slice(&bytes).expect("JSON"), run)
}

/// When sections change, ns: commands that repeat what holds are left out.
fn changes(run: &serde_json::Value) -> Vec<(u64, String, bool)> {
    let mut last = std::collections::BTreeMap::new();
    let mut all = Vec::new();
    for said in run["commands"].as_array().expect("commands") {
        let (at, target) = (said["t_ns"].as_u64().expect("a time"), said["target"].to_string());
        let open = said["duty"].as_f64().expect("a duty") > 0.0;
        if last.insert(target.clone(), open).unwrap_or(false) != open {
            all.push((at, target, open));
        }
    }
    all.sort();
    all
}

fn score(keep: &Path, code: i32) -> serde_json::Value {
    let ended = run(&["score", text(keep), "--format", "json"]);
    assert_eq!(ended.code, Some(code), "{}", ended.stderr);
    serde_json::from_str(&ended.stdout).expect("JSON")
}

/// Eight bytes of process data that `source` sent, with their times in microseconds, by the kept candump log.
fn process_data(run: &Path, identifier: &str) -> Vec<(u64, Vec<u8>)> {
    let log = std::fs::read_to_string(run.join("can0.candump")).expect("it is kept");
    let lines = log.lines().filter_map(|line| {
        let (id, data) = line.split_whitespace().nth(2)?.split_once('#')?;
        let time = line.split_whitespace().next()?.trim_matches(['(', ')']);
        let (s, us) = time.split_once('.')?;
        let at = s.parse::<u64>().ok()? * 1_000_000 + us.parse::<u64>().ok()?;
        let byte = |place: usize| u8::from_str_radix(data.get(place..place + 2)?, 16).ok();
        (id == identifier).then(|| (at, (0..data.len()).step_by(2).filter_map(byte).collect()))
    });
    lines.collect()
}

#[test]
fn sections_set_by_a_task_controller_move_as_by_our_own_message() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let [own, isobus] = ["row", "isobus"].map(|name| folder.path().join(format!("kept-{name}")));
    let Some(found) = judged(&scenarios.join("row.toml"), "none", &own) else { return };
    passes(&found);
    passes(&judged(&scenarios.join("isobus.toml"), "none", &isobus).expect("Python is there"));
    let (mine, theirs) = (kept(&own), kept(&isobus));
    // The controller decides at the same instants, and its words take effect when they are heard: every change at the same nanosecond.
    assert!(changes(&mine.0).len() > 8, "sections moved");
    assert_eq!(changes(&mine.0), changes(&theirs.0));
    let (mine, scores) = (score(&own, 0), score(&isobus, 0));
    for key in ["recall", "waste", "litres", "saved_litres"] {
        let (own, isobus) = (mine[key].as_f64().expect(key), scores[key].as_f64().expect(key));
        assert!((own - isobus).abs() <= 1e-12 * own.abs(), "{key}: {own} {isobus}");
    }
    // The verdict's number is that of the kept run.
    let recall = scores["recall"].as_f64().expect("leaves passed");
    let found = judged(&scenarios.join("isobus.toml"), "none", &folder.path().join("again")).expect("Python");
    assert!(verdict(&found, "recall").2.contains(&format!("found {recall:.4}")), "{found:#?}");
    assert_eq!(kept(&folder.path().join("again")).0, theirs.0, "the same run again");
    // What was set by DDI 290 was told by DDI 161 after the dead time (150 ms to open, 100 ms to close), and at the second look at the valves at the latest.
    let set = process_data(&theirs.1, "0CCB91F7");
    let set: Vec<_> = set.iter().filter(|(_, data)| data[..4] == [0x23, 0, 0x22, 1]).collect();
    let told = process_data(&theirs.1, "0CCBF791");
    let told: Vec<_> = told.iter().filter(|(_, data)| data[..4] == [0x23, 0, 0xA1, 0]).collect();
    let alone = set.windows(2).filter(|pair| pair[1].0 - pair[0].0 > 200_000);
    let (mut seen, mut held) = (0, &[0, 255, 255, 255][..]);
    for [(at, data), _] in alone.filter_map(|pair| pair.first_chunk()) {
        // What holds already is no change, and is not told again.
        if std::mem::replace(&mut held, &data[4..]) == &data[4..] {
            continue;
        }
        let answer = told.iter().rfind(|(told, _)| told > at && *told <= at + 171_000);
        assert_eq!(answer.map(|(_, told)| &told[4..]), Some(&data[4..]), "set at {at} µs");
        seen += 1;
    }
    assert!(seen > 2, "{set:?}");
}

/// The Python side asks for 64 packets at a time, so that any pool here needs several leaves to send: by TP up to 1785 bytes, by ETP beyond.
#[test]
fn a_pool_of_any_length_is_taken_in_parts_by_tp_and_by_etp() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let boom = std::fs::read_to_string(scenarios.join("boom.toml")).expect("it is there");
    for (sections, management, clear) in [(0, "1CEC91F7", 17), (12, "1CC891F7", 21)] {
        // Above the trees: nothing there is wanted.
        let more = (0..sections).map(|n| {
            let z_m = 5.0 + 0.5 * f64::from(n);
            let z_to_m = z_m + 0.5;
            format!("[[section]]\nid = \"x{n}\"\nside = \"right\"\nz_from_m = {z_m}\nz_to_m = {z_to_m}\n")
        });
        std::fs::write(scenarios.join("long.toml"), boom.clone() + &more.collect::<String>())
            .expect("written");
        let scenario = "use = \"isobus.toml\"\nsprayer = { boom = \"long.toml\", isobus = \"can0\", tank_l = 400 }\n\
            end = { row_m = 6 }\nexpect = [{ what = \"edges\", of = \"missed\", equals = 0 }, \
            { what = \"log\", matches = \"client active\", within_s = 1 }]\n";
        let path = scenarios.join("long-pool.toml");
        std::fs::write(&path, scenario).expect("written");
        let keep = folder.path().join(format!("kept-{sections}"));
        let Some(found) = judged(&path, "none", &keep) else { return };
        passes(&found);
        let run = kept(&keep).1;
        let log = std::fs::read_to_string(run.join("sut.log")).expect("it is kept");
        let length =
            log.split_once("object pool of ").and_then(|(_, rest)| rest.split(' ').next()?.parse().ok());
        assert_eq!(length.map(|length: u32| length > 1784), Some(sections > 0), "{log}");
        let asked = process_data(&run, management).into_iter().filter(|(_, data)| data[0] == clear).count();
        assert_eq!(Some(asked as u32), length.map(|length| (length + 1).div_ceil(7).div_ceil(64)), "{log}");
    }
}

#[test]
fn a_task_controller_that_never_activates_leaves_the_boom_shut_and_one_that_reverses_sections_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scenarios(folder.path()).join("isobus.toml");
    let keep = folder.path().join("never");
    let Some(found) = judged(&path, "never_activates", &keep) else { return };
    let (_, found, message) = verdict(&found, "recall");
    assert_eq!(found, "error", "{message}");
    assert!(message.contains("no command was heard"), "{message}");
    // Nothing was sprayed, and nothing of the controller is known.
    assert_eq!(kept(&keep).0["commands"].as_array().map(Vec::len), Some(0));
    assert_eq!(score(&keep, 1)["litres"].as_f64(), Some(0.0));
    let found = judged(&path, "sections_reversed", &folder.path().join("reversed")).expect("Python");
    assert_eq!(verdict(&found, "edges").1, "failed", "{found:#?}");
    assert_eq!(verdict(&found, "recall").1, "failed", "{found:#?}");
}

/// Whoever commands is judged by what came of it: a controller that keeps all shut, or whose setpoints have no effect, has failed, and is told why.
#[test]
fn a_task_controller_that_opens_nothing_has_failed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scenarios(folder.path()).join("isobus.toml");
    for (fault, why) in [
        ("dead", None),
        ("never_automatic", Some("of element 2 was set")),
        ("wrong_element", Some("DDI 290 of element 0 was set")),
    ] {
        let Some(all) = judged(&path, fault, &folder.path().join(fault)) else { return };
        let expected = if fault == "wrong_element" { "error" } else { "failed" };
        let (_, found, message) = verdict(&all, "recall");
        assert_eq!(found, expected, "{fault}: {message}");
        if fault == "never_automatic" {
            // All is shut, and one of the states that were set without effect happens to be that.
            let (_, as_set, message) = verdict(&all, "ddi 161");
            assert_eq!(as_set, "error", "{message}");
            assert!(message.contains("commanded nothing each time"), "{message}");
        }
        let report = Command::new(env!("CARGO_BIN_EXE_rowscan"))
            .args(["check", text(&path)])
            .env("SPRAY_FAULT", fault)
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .output()
            .expect("it runs");
        let said =
            String::from_utf8_lossy(&report.stdout).into_owned() + &String::from_utf8_lossy(&report.stderr);
        assert!(!report.status.success(), "{fault}");
        assert!(why.is_none_or(|why| said.contains(why)), "{fault}: {said}");
        assert_eq!(
            said.contains("section control (DDI 160) was manual"),
            fault == "never_automatic",
            "{said}"
        );
    }
    // A client that starts in automatic needs no setting.
    let scenario = "use = \"isobus.toml\"\nsprayer = { boom = \"boom.toml\", isobus = \"can0\", section_control = \"automatic\" }\n";
    let path = path.with_file_name("automatic.toml");
    std::fs::write(&path, scenario).expect("written");
    let found = judged(&path, "never_automatic", &folder.path().join("automatic")).expect("Python");
    assert_eq!(verdict(&found, "recall").1, "passed", "{found:#?}");
}

#[test]
fn without_its_task_controller_the_boom_is_safe_by_on_loss() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let lost = scenarios.join("isobus-lost.toml");
    let Some(found) = judged(&lost, "none", &folder.path().join("close")) else { return };
    passes(&found);
    let words = std::fs::read_to_string(&lost).expect("it is there");
    let holds = words.replace(
        "fault =",
        "sprayer = { boom = \"boom.toml\", isobus = \"can0\", on_loss = \"hold\" }\nfault =",
    );
    assert_ne!(words, holds);
    // What the client told before it gave up says nothing of it now.
    let stale = "use = \"isobus-lost.toml\"\nend = { row_m = 16 }\nexpect = [{ what = \"ddi\", element = 2, ddi = 160, value = 1, after = \"gone\", within_s = 0.5 }, \
        { what = \"ddi\", element = 2, ddi = 160, value = 1, after = \"row:14\", within_s = 0.5 }]\n";
    std::fs::write(scenarios.join("stale.toml"), stale).expect("written");
    let found = judged(&scenarios.join("stale.toml"), "none", &folder.path().join("stale")).expect("Python");
    assert_eq!(
        found.iter().map(|(_, verdict, _)| verdict.as_str()).collect::<Vec<_>>(),
        ["passed", "failed"],
        "{found:#?}"
    );
    std::fs::write(scenarios.join("holds.toml"), holds).expect("written");
    let found = judged(&scenarios.join("holds.toml"), "none", &folder.path().join("hold")).expect("Python");
    assert_eq!(verdict(&found, "time_to_safe_s after gone").1, "failed", "{found:#?}");
}

/// The ten lines of docs/sprayer.md, and the boom's sensors beside the client on one bus.
#[test]
fn the_documented_scenario_passes_and_sensors_tell_what_the_client_was_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let page = include_str!("../../docs/sprayer.md").split_once("## ISOBUS").expect("the section").1;
    let block = page.split_once("```toml\n").and_then(|(_, rest)| rest.split_once("```")).expect("a block").0;
    let path = scenarios.join("documented.toml");
    std::fs::write(&path, block).expect("written");
    let Some(found) = judged(&path, "none", &folder.path().join("documented")) else { return };
    passes(&found);
    let boom = std::fs::read_to_string(scenarios.join("boom.toml")).expect("it is there");
    std::fs::write(scenarios.join("told.toml"), format!("{boom}[sensors]\npulses_per_l = 300\n"))
        .expect("written");
    let scenario = "use = \"isobus.toml\"\nsprayer = { boom = \"told.toml\", isobus = \"can0\" }\nexpect = [\
        { what = \"edges\", equals = 0 }, { what = \"signal\", signal = \"can0:SectionStates.Section1\", above = 99, within_s = 2 }]\n";
    let path = scenarios.join("sensors.toml");
    std::fs::write(&path, scenario).expect("written");
    passes(&judged(&path, "none", &folder.path().join("sensors")).expect("Python"));
}

/// A scenario with this fault and these expectations, beside the others.
fn with_fault(scenarios: &Path, (base, end): (&str, &str), fault: &str, expect: &str) -> PathBuf {
    let path = scenarios.join("faulted.toml");
    let scenario = format!("use = \"{base}\"\nend = {end}\nfault = [{fault}]\nexpect = [{expect}]\n");
    std::fs::write(&path, scenario).expect("written");
    path
}

/// When section `number` was on and off by a condensed word, microseconds.
fn states(frames: &[(u64, Vec<u8>)], ddi: u8, number: u32) -> Vec<(u64, bool)> {
    let mut all: Vec<(u64, bool)> = Vec::new();
    for (at, data) in frames.iter().filter(|(_, data)| data[..4] == [0x23, 0, ddi, u8::from(ddi == 0x22)]) {
        let word = u32::from_le_bytes([data[4], data[5], data[6], data[7]]);
        let is_on = word >> (2 * (number - 1)) & 3 == 1;
        if all.last().is_none_or(|(_, last)| *last != is_on) {
            all.push((*at, is_on));
        }
    }
    all
}

/// What a section was told, and what the client said that it does.
fn told_and_done(run: &Path, number: u32) -> [Vec<(u64, bool)>; 2] {
    [
        states(&process_data(run, "0CCB91F7"), 0x22, number),
        states(&process_data(run, "0CCBF791"), 0xA1, number),
    ]
}

/// The rule: what the client tells is what its machine does, by the same sensors as `SectionStates` and `SprayerState`.
#[test]
fn faults_of_valves_show_in_what_the_client_tells() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let kept_with = |name: &str, fault: &str| {
        let path = with_fault(
            &scenarios,
            ("isobus.toml", "{ row_m = 12 }"),
            fault,
            "{ what = \"recall\", above = 0 }",
        );
        let keep = folder.path().join(name);
        judged(&path, "none", &keep).map(|_| kept(&keep).1)
    };
    let on = |states: &[(u64, bool)]| states.iter().any(|(_, is_on)| *is_on);
    let Some(sound) = kept_with("sound", "") else { return };
    let [told, done] = told_and_done(&sound, 2);
    assert!(on(&told) && done.len() == told.len(), "{told:?} {done:?}");
    let coil = kept_with("coil", "{ name = \"coil_open\", section = 2, at = { s = 0 } }").expect("Python");
    let [told, done] = told_and_done(&coil, 2);
    assert!(on(&told) && !on(&done), "no current, no spray: {told:?} {done:?}");
    let stuck =
        kept_with("stuck", "{ name = \"valve_stuck\", section = 2, state = \"open\", at = { s = 2 } }")
            .expect("Python");
    let [told, done] = told_and_done(&stuck, 2);
    let last = |states: &[(u64, bool)]| *states.last().expect("told");
    assert!(!last(&told).1 && last(&done).1, "it stays open: {told:?} {done:?}");
    let swapped = kept_with("swapped", "{ name = \"swapped_wires\", section = 1, with = 4, at = { s = 0 } }")
        .expect("Python");
    let ([told, _], [_, done]) = (told_and_done(&swapped, 1), told_and_done(&swapped, 4));
    assert!(
        on(&told) && told.len() == done.len(),
        "section 4 does what section 1 is told: {told:?} {done:?}"
    );
    // Each begins with what holds when it is connected.
    let mut moves = told.iter().zip(&done).skip(1);
    assert!(moves.all(|((told, _), (done, _))| (*told..told + 171_000).contains(done)), "{told:?} {done:?}");
    let slow = kept_with("slow", "{ name = \"valve_slow\", ms = 300, at = { s = 0 } }").expect("Python");
    let [told, done] = told_and_done(&slow, 2);
    let late = told.iter().zip(&done).skip(1).map(|((told, _), (done, _))| done - told).min();
    assert!(late.is_some_and(|late| late > 350_000), "{told:?} {done:?}");
}

/// One tank: dry for the boom's sensors, for the rule and for the score.
#[test]
fn the_tank_is_one_for_sensors_rule_and_score() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let boom = std::fs::read_to_string(scenarios.join("boom.toml")).expect("it is there");
    std::fs::write(scenarios.join("tank.toml"), format!("{boom}[sensors]\npulses_per_l = 300\n"))
        .expect("written");
    let path = scenarios.join("dry.toml");
    let scenario = |tank: &str| {
        format!(
            "use = \"isobus.toml\"\nsprayer = {{ boom = \"tank.toml\", isobus = \"can0\"{tank} }}\nexpect = [\
             {{ what = \"recall\", below = 0.9 }},              {{ what = \"signal\", signal = \"can0:SprayerState.TankEmpty\", above = 0.5, within_s = 20, for_s = 0.5 }}]\n"
        )
    };
    std::fs::write(&path, scenario(", tank_l = 0.002")).expect("written");
    assert_says(&run_check(&path), &["`sprayer.tank_l`: expected 0.01 to 100000 l, found 0.002"]);
    std::fs::write(
        scenarios.join("tank.toml"),
        format!("{boom}[sensors]\npulses_per_l = 300\ntank_l = 0.2\n"),
    )
    .expect("written");
    std::fs::write(&path, scenario(", tank_l = 2")).expect("written");
    assert_says(&run_check(&path), &["sprayer.tank_l", "2 beside 0.2"]);
    std::fs::write(&path, scenario("")).expect("written");
    let keep = folder.path().join("dry");
    let Some(found) = judged(&path, "none", &keep) else { return };
    passes(&found);
    let told = score(&keep, 0);
    assert!((told["litres"].as_f64().expect("litres") - 0.2).abs() < 1e-9, "{told}");
    assert!(told["oracle"]["recall"].as_f64() > Some(0.999), "the oracle's tank is full enough");
    let rule = |told: &serde_json::Value| {
        let rules = told["forbidden"].as_array().expect("rules").clone();
        rules.into_iter().find(|rule| rule["rule"] == "tank_empty")
    };
    let dry = rule(&told).expect("it ran dry");
    // Nothing flows any more, and this controller goes on to open valves over the empty tank.
    assert!(dry["forbidden_s"].as_f64() > Some(0.5) && dry["litres"].as_f64() > Some(0.1), "{dry}");
}

/// The rule: the rig's machines have sat on their bus for long when a drive starts, on whatever clock.
#[test]
fn on_a_paced_clock_the_client_listens_from_the_start_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let words = std::fs::read_to_string(scenarios.join("base.toml")).expect("it is there");
    let paced = words.lines().map(|line| match line.split_once(" = ") {
        Some(("clock", _)) => "clock = { mode = \"paced\" }",
        Some(("compute", _)) => "",
        _ => line,
    });
    std::fs::write(scenarios.join("base.toml"), paced.collect::<Vec<_>>().join("\n")).expect("written");
    let words = std::fs::read_to_string(scenarios.join("isobus.toml")).expect("it is there");
    let words = words.replace(", compute = { s = 0.02 }", "");
    let (before, _) = words.split_once("expect = [").expect("expectations");
    let path = scenarios.join("paced.toml");
    std::fs::write(
        &path,
        format!("{before}end = {{ row_m = 8 }}\nexpect = [{{ what = \"recall\", above = 0 }}]\n"),
    )
    .expect("written");
    let keep = folder.path().join("paced");
    let Some(_) = judged(&path, "none", &keep) else { return };
    let (_, run) = kept(&keep);
    // It answers the task controller's first status, and not after a silence of 6 s.
    let status: Vec<u64> = process_data(&run, "0CCBFFF7").iter().map(|(at, _)| *at).collect();
    let answered = process_data(&run, "0CCBF791");
    let (first, answer) = (status.first().expect("a status"), &answered.first().expect("an answer").0);
    assert!(answer < &(first + 2_000_000), "status {first} µs, answer {answer} µs");
}

#[test]
fn a_client_whose_status_stops_is_shut_by_its_task_controller_and_a_deaf_one_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = with_fault(
        &scenarios(folder.path()),
        ("isobus.toml", "{ row_m = 14 }"),
        "{ id = \"mute\", name = \"heartbeat_stop\", at = { row_m = 4 } }",
        "{ what = \"time_to_safe_s\", after = \"mute\", below = 6.3 }, { what = \"fault_acts\", of = \"mute\", equals = 1 }, \
         { what = \"log\", matches = \"client lost\", after = \"mute\", within_s = 6.2 }",
    );
    let Some(found) = judged(&path, "none", &folder.path().join("good")) else { return };
    passes(&found);
    let found = judged(&path, "deaf", &folder.path().join("deaf")).expect("Python");
    assert_eq!(verdict(&found, "time_to_safe_s after mute").1, "failed", "{found:#?}");
    assert_eq!(verdict(&found, "log").1, "failed", "{found:#?}");
}

#[test]
fn a_busy_task_controller_commands_nothing_until_it_is_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = with_fault(
        &scenarios(folder.path()),
        ("isobus.toml", "{ row_m = 12 }"),
        "{ id = \"busy\", name = \"tc_busy\", at = { row_m = 4 }, for = { s = 2 } }",
        "{ what = \"waste\", above = 0.1 }, { what = \"edges\", of = \"missed\", above = 0 }, { what = \"fault_acts\", of = \"busy\", equals = 1 }",
    );
    let keep = folder.path().join("busy");
    let Some(found) = judged(&path, "none", &keep) else { return };
    passes(&found);
    // From 1.5 to 3.5 s nothing moves; before and after it does.
    let changes = changes(&kept(&keep).0);
    let within = |from: u64, to: u64| changes.iter().any(|(at, ..)| (from..to).contains(&(at / 1_000_000)));
    assert!(within(0, 1500) && !within(1500, 3500) && within(3500, 9000), "{changes:?}");
}

#[test]
fn a_refused_pool_leaves_the_boom_shut() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let fault = "{ id = \"no\", name = \"ddop_refused\", code = 2, at = { s = 0 } }";
    let expect = "{ what = \"recall\", above = 0.9 }, { what = \"fault_acts\", of = \"no\", equals = 1 }";
    let path = with_fault(&scenarios, ("isobus.toml", "{ row_m = 8 }"), fault, expect);
    let keep = folder.path().join("refused");
    let Some(found) = judged(&path, "none", &keep) else { return };
    assert_eq!(verdict(&found, "recall").1, "error", "{found:#?}");
    assert_eq!(verdict(&found, "fault_acts").1, "passed", "{found:#?}");
    // The controller believes that its client is active, and sets sections of one that does not listen.
    let (run, folder) = kept(&keep);
    assert_eq!(run["commands"].as_array().map(Vec::len), Some(0));
    assert!(process_data(&folder, "0CCB91F7").iter().any(|(_, data)| data[..4] == [0x23, 0, 0x22, 1]));
    // A sprayer without a task controller cannot lose one.
    let path = with_fault(&scenarios, ("base.toml", "{ row_m = 4 }"), fault, expect);
    let ended = run_check(&path);
    assert_says(&ended, &["fault `no`: sprayer: it has no task controller; give it one by `isobus`"]);
}

fn run_check(path: &Path) -> String {
    let ended = run(&["check", text(path)]);
    assert_ne!(ended.code, Some(0), "{}", ended.stdout);
    ended.stdout + &ended.stderr
}

#[test]
fn the_rigs_task_controller_serves_a_client_of_other_hands() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let path = scenarios.join("served.toml");
    let Some(found) = judged(&path, "none", &folder.path().join("good")) else { return };
    passes(&found);
    // The status of the task controller comes every two seconds.
    let (_, run) = kept(&folder.path().join("good"));
    let status: Vec<u64> = process_data(&run, "0CCBFFF7").iter().map(|(at, _)| *at).collect();
    assert!(status.len() >= 4 && status.windows(2).all(|pair| pair[1] - pair[0] == 2_000_000), "{status:?}");
    let found = judged(&path, "sections_reversed", &folder.path().join("reversed")).expect("Python");
    assert_eq!(verdict(&found, "Section1").1, "failed", "{found:#?}");
    assert_eq!(verdict(&found, "Section4").1, "failed", "{found:#?}");
    // A pool whose section hangs nowhere is refused, with its object and its parent.
    let found = judged(&path, "bad_pool", &folder.path().join("bad")).expect("Python");
    assert_eq!(verdict(&found, "log").1, "failed", "{found:#?}");
    let answer = process_data(&kept(&folder.path().join("bad")).1, "14CB81F7");
    let refused = [0x91, 1, 0x09, 0x03, 5, 0, 2, 255];
    assert!(answer.iter().any(|(_, data)| data[..] == refused), "{answer:02X?}");
}

#[test]
fn a_client_of_the_rigs_task_controller_shuts_without_it_and_one_that_holds_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = scenarios(folder.path()).join("served-lost.toml");
    let Some(found) = judged(&path, "none", &folder.path().join("good")) else { return };
    passes(&found);
    let found = judged(&path, "holds", &folder.path().join("holds")).expect("Python");
    assert_eq!(verdict(&found, "time_to_safe_s after gone").1, "failed", "{found:#?}");
}

#[test]
fn both_roles_on_one_bus_and_wrong_keys_are_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let scenarios = scenarios(folder.path());
    let says = |change: &dyn Fn(&str) -> String, expected: &str| {
        let words = std::fs::read_to_string(scenarios.join("served.toml")).expect("it is there");
        let changed = change(&words);
        assert_ne!(words, changed);
        let path = scenarios.join("wrong.toml");
        std::fs::write(&path, changed).expect("written");
        assert_says(&run_check(&path), &[expected]);
    };
    says(
        &|words| words.replace("bus = \"can0\" }", "isobus = \"can0\" }"),
        "nothing of yours would be tested",
    );
    says(&|words| words.replace("at_s = 4.0", "at_s = 1.0"), "each later than the one before");
    says(
        &|words| words.replace("bus = \"can0\" }", "bus = \"can0\", isobus = \"can0\" }"),
        "`bus` and `isobus`",
    );
    says(&|words| words.replace("bus = \"can0\" }", "bus = \"can0\", tank_l = 5 }"), "add `isobus`");
}
