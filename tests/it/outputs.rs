//! What commands write, and what they leave alone: nothing is destroyed that nobody told them to change.

use crate::common;

use std::io::Cursor;
use std::path::Path;

use common::binary::{Emulator, assert_says, refused, run};
use rowscan::feature::Feature;
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_recording::{About, Decoded, McapWriter, Side, StreamKind};

fn folder() -> (tempfile::TempDir, impl Fn(&str) -> String) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_owned();
    (folder, move |name: &str| path.join(name).to_str().expect("UTF-8").to_owned())
}

fn scan(counter: u16) -> Vec<u8> {
    let body = format!(
        "sSN LMDscandata 1 1 16F4C7A 0 0 {counter:X} {counter:X} {0:X} {0:X} 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 \
         7D0 0 0 0 0 0 0",
        u32::from(counter) * 20_000,
    );
    let mut bytes = Vec::new();
    encode(Dialect::A, body.as_bytes(), &mut bytes);
    bytes
}

/// A recording of so many scans, cut off before its end.
fn torn(scans: u16) -> Vec<u8> {
    let mut writer =
        McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("written");
    let stream = writer.add_stream("scanner", StreamKind::Cola).expect("written");
    for counter in 0..scans {
        let at_ns = 1_000_000_000 + u64::from(counter) * 20_000_000;
        writer.write(stream, Side::Device, at_ns, 0, &scan(counter)).expect("written");
    }
    writer.flush().expect("written");
    writer.into_inner().into_inner()
}

#[test]
fn repair_changes_nothing_but_a_torn_mcap_and_keeps_that() {
    let (_folder, file) = folder();
    let raw: Vec<u8> = (0..20).flat_map(scan).collect();
    let picture = [&b"\x89PNG\r\n\x1a\n"[..], &[7; 9000]].concat();
    for (name, bytes, says) in
        [("picture.png", &picture, "it is a PNG picture"), ("scans.bin", &raw, "add `-o NEW.mcap`")]
    {
        std::fs::write(file(name), bytes).expect("written");
        let ended = run(&["record", "--repair", &file(name)]);
        assert!(ended.code == Some(1) || ended.code == Some(2), "{name}: {:?}", ended.code);
        assert_says(&ended.stderr, &[name, says]);
        assert_eq!(&std::fs::read(file(name)).expect("there"), bytes, "{name}");
    }
    let path = file("run.mcap");
    std::fs::write(&path, torn(20)).expect("written");
    let ended = run(&["record", "--repair", &path]);
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    assert_says(&ended.stderr, &["20 messages", "run.mcap.orig"]);
    assert_eq!(std::fs::read(file("run.mcap.orig")).expect("kept"), torn(20));
    // Whole now: left as it is.
    let whole = std::fs::read(&path).expect("there");
    let ended = run(&["record", "--repair", &path]);
    assert_eq!(ended.code, Some(2), "the original of the first repair is not overwritten");
    std::fs::remove_file(file("run.mcap.orig")).expect("removed");
    let ended = run(&["record", "--repair", &path]);
    assert_eq!(
        (ended.code, std::fs::read(&path).expect("there") == whole),
        (Some(0), true),
        "{}",
        ended.stderr
    );
    assert!(!Path::new(&file("run.mcap.orig")).exists());
    std::fs::write(&path, torn(0)).expect("written");
    assert_says(&refused(&["record", "--repair", &path]), &["no packet that can be read"]);
    assert_eq!(std::fs::read(&path).expect("there"), torn(0));
}

#[test]
fn a_failed_record_is_not_in_the_way_of_the_next() {
    let (_folder, file) = folder();
    let path = file("run.mcap");
    // Nobody listens on the port of a socket that was closed again.
    let free = std::net::TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("known");
    let message = refused(&["record", &format!("tcp://{free}"), "-o", &path]);
    assert_says(&message, &["cannot connect"]);
    assert!(!Path::new(&path).exists(), "{message}");
    std::fs::write(&path, b"").expect("written");
    refused(&["record", &format!("tcp://{free}"), "-o", &path]);
    assert_eq!(std::fs::metadata(&path).expect("it was there before").len(), 0);
}

#[cfg(unix)]
#[test]
fn exports_go_to_devices_links_and_standard_output() {
    use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
    let (_folder, file) = folder();
    let raw: Vec<u8> = (0..3).flat_map(scan).collect();
    std::fs::write(file("scans.bin"), raw).expect("written");
    let export = |output: &str| run(&["export", &file("scans.bin"), "--to", "csv", "-o", output]);
    assert_eq!(export("/dev/null").code, Some(0));
    assert!(std::fs::metadata("/dev/null").expect("there").file_type().is_char_device());
    let piped = export("-");
    assert!(piped.stdout.starts_with("scan,") || piped.stdout.contains("_m,"), "{}", piped.stdout);
    assert!(!Path::new("-").exists());

    std::fs::write(file("real.csv"), "old").expect("written");
    std::fs::set_permissions(file("real.csv"), std::fs::Permissions::from_mode(0o640)).expect("set");
    std::os::unix::fs::symlink("real.csv", file("link.csv")).expect("linked");
    assert_eq!(export(&file("link.csv")).code, Some(0));
    assert!(Path::new(&file("link.csv")).is_symlink());
    assert_eq!(std::fs::read_to_string(file("real.csv")).expect("text"), piped.stdout);
    let mode = std::fs::metadata(file("real.csv")).expect("there").permissions().mode();
    assert_eq!(mode & 0o777, 0o640);
}

#[cfg(target_os = "linux")]
#[test]
fn a_link_that_is_served_is_not_taken_over() {
    let (_folder, file) = folder();
    let link = file("scanner");
    let first = Emulator::on_a_line("emulate", &["--model", "lms211", "--pty", &link]);
    let target = std::fs::read_link(&link).expect("a link");
    let message = refused(&["emulate", "--model", "lms211", "--pty", &link]);
    assert_says(&message, &["scanner", "served by another rowscan"]);
    assert_eq!(std::fs::read_link(&link).expect("still there"), target);
    first.end();
    assert!(std::fs::symlink_metadata(&link).is_err(), "removed with its owner");
}

#[test]
fn a_file_without_a_scan_is_named_by_what_it_holds() {
    let (_folder, file) = folder();
    let mut radar = Vec::new();
    for _ in 0..3 {
        encode(Dialect::B, b"sSN LMDradardata \0\x01\0\x01", &mut radar);
    }
    for (name, bytes, says) in [
        ("radar.bin", &radar, "holds no scan; it holds 3 LMDradardata"),
        ("run.bin.gz", &b"\x1F\x8B\x08\0packed".to_vec(), "a gzip archive that is damaged or breaks off"),
        ("run.bin.xz", &b"\xFD7zXZ\0packed".to_vec(), "it is an xz archive: unpack it"),
        ("drive.bag", &b"#ROSBAG V2.0\n\x45\0\0\0".to_vec(), "it is a ROS 1 bag"),
    ] {
        std::fs::write(file(name), bytes).expect("written");
        let output = file("out.csv");
        for command in
            [&["estimate", &file(name)][..], &["export", &file(name), "--to", "csv", "-o", &output]]
        {
            let ended = run(command);
            assert_eq!((ended.code, ended.stdout.as_str()), (Some(1), ""), "{command:?}: {}", ended.stderr);
            assert_says(&ended.stderr, &[name, says]);
        }
        assert!(!Path::new(&output).exists());
    }
}

#[test]
fn bytes_without_a_telegram_are_no_recording() {
    let (_folder, file) = folder();
    std::fs::write(file("zeros.bin"), vec![0; 300_000]).expect("written");
    // Two bytes between STX and ETX are a frame of CoLa A, and no telegram.
    let noise = (0..20_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8);
    let noise: Vec<u8> = noise.filter(|byte| !matches!(byte, 2 | 3)).chain(*b"\x02s\x03").collect();
    std::fs::write(file("noise.bin"), noise).expect("written");
    let (table, copy) = (file("out.csv"), file("out.mcap"));
    for name in ["zeros.bin", "noise.bin"] {
        for (command, more) in [
            (&["record", "--info"][..], &[][..]),
            (&["record"], &["-o", &copy]),
            (&["estimate"], &[]),
            (&["export"], &["--to", "csv", "-o", &table]),
            (&["decode"], &[]),
            (&["replay"], &[]),
        ] {
            let ended = run(&[command, &[&file(name)], more].concat());
            assert_eq!(ended.code, Some(2), "{command:?}: {}", ended.stderr);
            // `decode` shows what it found instead.
            assert!(ended.stdout.is_empty() || command == ["decode"], "{command:?}: {}", ended.stdout);
        }
        assert!(!Path::new(&table).exists() && !Path::new(&copy).exists());
    }
    let told = run(&["record", "--info", &file("zeros.bin")]).stderr;
    assert_says(&told, &["holds no SICK telegram in its 300000 bytes"]);
}

/// A bit of an LMS2xx log is flipped: the log stays one of an LMS2xx.
#[test]
fn a_damaged_lms2xx_log_is_decoded_in_its_own_language() {
    let (_folder, file) = folder();
    let scan = b"\x02\x80\x0c\x00\xb0\x04\x40\xe8\x03\x10\x02\x73\x03\xe8\x03\x10\x08\xb1";
    let mut log = scan.repeat(5);
    log[2 * scan.len() + 7] ^= 0x10;
    std::fs::write(file("log.bin"), log).expect("written");
    let ended = run(&["decode", &file("log.bin"), "--format", "jsonl"]);
    assert_eq!(ended.code, Some(1), "{}", ended.stdout);
    let lines: Vec<serde_json::Value> =
        ended.stdout.lines().map(|line| serde_json::from_str(line).expect("json")).collect();
    let told: Vec<_> = lines.iter().map(|line| (&line["is"], &line["length"])).collect();
    let [good, bad] = [serde_json::json!("telegram"), serde_json::json!("bad")];
    let length = serde_json::json!(scan.len());
    assert_eq!(told, [&good, &good, &bad, &good, &good].map(|is| (is, &length)), "{}", ended.stdout);
    assert!(
        lines[2]["expected"].as_str().is_some_and(|expected| expected.starts_with("CRC ")),
        "{}",
        lines[2]
    );
}

#[test]
fn two_bytes_of_an_lms2xx_scan_are_no_cola_telegram() {
    let (_folder, file) = folder();
    // A scan of four ranges, among them 371 and 1000 mm: `02 73 03`.
    let scan = b"\x02\x80\x0c\x00\xb0\x04\x40\xe8\x03\x10\x02\x73\x03\xe8\x03\x10\x08\xb1";
    std::fs::write(file("sweeps.bin"), scan.repeat(5)).expect("written");
    let ended = run(&["decode", &file("sweeps.bin"), "--format", "json"]);
    assert_eq!(ended.code, Some(0), "{}", ended.stdout);
    assert!(!ended.stdout.contains("\"bad\""), "{}", ended.stdout);
    let info = run(&["record", "--info", &file("sweeps.bin"), "--format", "json"]);
    let info: serde_json::Value = serde_json::from_str(&info.stdout).expect("json");
    assert_eq!(info["streams"][0]["kind"], "lms2xx");
}

#[test]
fn values_that_cannot_be_are_refused() {
    let (_folder, file) = folder();
    assert_says(&refused(&["scan", "--wood", "mesh:1e308,3,1e-300"]), &["half width of 0 to 1 m"]);
    assert_says(&refused(&["scan", "--pitch", "nan"]), &["--pitch", "expected a number"]);
    for value in ["nan", "-1", "0", "inf"] {
        assert_says(&refused(&["estimate", "x", "--length", value]), &["--length", "metres above 0", value]);
        let message = refused(&["record", "tcp://127.0.0.1:1", "-o", "y", "--seconds", value]);
        assert_says(&message, &["--seconds", "seconds above 0", value]);
    }
    assert_says(&refused(&["estimate", "x", "--model", "lms111"]), &["--rig"]);
    assert_says(&refused(&["emulate", "--max-clients", "100000"]), &["1 to 1000 clients"]);
    assert_says(&refused(&["emulate", "--idle-limit", "nan"]), &["0 to 1000000 seconds"]);
    std::fs::write(file("zero.toml"), "version = 1\n[rig]\nspeed_m_s = 0\n").expect("written");
    assert_says(&refused(&["demo", &file("zero.toml")]), &["a speed above 0", "speed_m_s = 0"]);
    let no_such = ["export", "x", "--to", "csv", "-o", "y", "--rig", "spindle", "--scanner", "99"];
    assert_says(&refused(&no_such), &["99"]);
    std::fs::write(file("many.toml"), "version = 1\n[orchard]\ntrees = 100000\n").expect("written");
    assert_says(&refused(&["orchard", "truth", &file("many.toml")]), &["distinct_trees"]);
    let import = |name: &str, key: &str, content: &str| {
        std::fs::write(file(name), content).expect("written");
        let scene =
            format!("version = 1\n[orchard]\ngenerator = \"import\"\n[orchard.import]\n{key} = \"{name}\"\n");
        std::fs::write(file("scene.toml"), scene).expect("written");
        refused(&["orchard", "truth", &file("scene.toml")])
    };
    assert_says(
        &import("far.txt", "branches", "0 0 0 0 0 1e9 0.1\n"),
        &["far.txt:1", "1000 m of the ground"],
    );
    assert_says(&import("empty.obj", "mesh", "v 0 0 0\n"), &["empty.obj", "no face"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_limit_on_the_size_of_files_is_told_and_nothing_half_written_stays() {
    let (_folder, file) = folder();
    std::fs::write(file("scans.bin"), (0..2000).flat_map(scan).collect::<Vec<u8>>()).expect("written");
    std::fs::create_dir(file("out")).expect("made");
    let more = if Feature::Tables.is_built() { &["las", "parquet"][..] } else { &[] };
    for format in ["csv", "ply", "npy"].iter().chain(more) {
        let output = file(&format!("out/points.{format}"));
        let started = std::process::Command::new("sh")
            .args(["-c", "ulimit -f 8; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_rowscan")])
            .args(["export", &file("scans.bin"), "--to", format, "-o", &output])
            .stdin(std::process::Stdio::null())
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .expect("it runs");
        let ended = common::binary::finish(started);
        assert_eq!(ended.code, Some(2), "{}", ended.stderr);
        assert_says(&ended.stderr, &["cannot write", &format!("points.{format}"), "too large"]);
        assert!(!ended.stderr.contains("panicked"), "{}", ended.stderr);
        assert_eq!(std::fs::read_dir(file("out")).expect("there").count(), 0);
    }
}

#[test]
fn a_replay_that_would_end_before_it_begins_is_refused() {
    let (_folder, file) = folder();
    std::fs::write(file("scans.bin"), (0..200).flat_map(scan).collect::<Vec<u8>>()).expect("written");
    let of =
        |places: &[&str]| refused(&[&["replay", &file("scans.bin"), "--model", "lms111"], places].concat());
    for places in [
        &["--from", "3s", "--until", "2s"][..],
        &["--from", "scan:9", "--until", "scan:9"],
        &["--until", "scan:0"],
        &["--until", "0s"],
    ] {
        assert_says(&of(places), &["--until lies at or before --from"]);
    }
}

/// What is exported of a recording that breaks off is a part: as of `record --info`, a finding.
#[test]
fn a_torn_recording_is_exported_as_far_as_it_goes_and_that_is_a_finding() {
    let (_folder, file) = folder();
    let (path, whole) = (file("run.mcap"), file("whole.mcap"));
    std::fs::write(&path, torn(20)).expect("written");
    assert_eq!(run(&["record", "--repair", &path, "-o", &whole]).code, Some(0));
    for (source, code) in [(&path, 1), (&whole, 0)] {
        let to = file("scans.csv");
        let ended = run(&["export", source, "--to", "csv", "--what", "scans", "-o", &to]);
        assert_eq!(ended.code, Some(code), "{source}: {}", ended.stderr);
        assert!(std::fs::read_to_string(&to).expect("written").lines().count() > 10, "{source}");
    }
    // Nothing takes a recording's place.
    let before = std::fs::read(&whole).expect("there");
    let ended = run(&["export", &path, "--to", "csv", "-o", &whole]);
    assert_eq!(ended.code, Some(2), "{}", ended.stderr);
    assert_says(&ended.stderr, &["holds a recording"]);
    assert_eq!(std::fs::read(&whole).expect("there"), before);
}

/// Whatever a file holds: scans come out, or a reason.
#[tokio::test]
async fn any_bytes_give_a_scan_or_a_reason() {
    use rowscan_driver::{DriverConfig, Scanner, Source};
    let (_folder, file) = folder();
    let path = file("any");
    let whole: Vec<u8> = (0..6).flat_map(scan).collect();
    let starts: [&[u8]; 6] =
        [b"", b"\x89MCAP0\r\n", b"\xD4\xC3\xB2\xA1\x02\0\x04\0", b"\x02\x02\x02\x02", &torn(5), &whole];
    let mut state = 7_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let (mut with_scans, mut refused) = (0, 0);
    for round in 0..300 {
        let start = starts[round % starts.len()];
        let mut bytes = start[..start.len() - random() % (start.len() / 2 + 1)].to_vec();
        bytes.extend((0..random() % 2000).map(|_| random() as u8));
        if let (Some(bits), true) = (bytes.len().checked_mul(8).filter(|bits| *bits > 0), round % 2 == 0) {
            let bit = random() % bits;
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        std::fs::write(&path, &bytes).expect("written");
        let source = Source::Recording { path: path.clone().into(), stream: None };
        let Ok(mut scanner) = Scanner::open(&source, DriverConfig::default()).await else {
            refused += 1;
            continue;
        };
        let mut scans = 0;
        loop {
            match scanner.next().await {
                Ok(Some(_)) => scans += 1,
                Ok(None) => {
                    assert!(scans > 0, "round {round}: the end without a scan and without a reason");
                    with_scans += 1;
                    break;
                }
                Err(_) => {
                    refused += 1;
                    break;
                }
            }
        }
    }
    assert!(with_scans > 20 && refused > 100, "{with_scans} with scans, {refused} refused");
}

#[test]
fn a_raw_file_that_ends_inside_a_telegram_is_converted_and_told() {
    let (_folder, file) = folder();
    let whole: Vec<u8> = (0..5).flat_map(scan).collect();
    std::fs::write(file("cut.bin"), &whole[..whole.len() - 7]).expect("written");
    let ended = run(&["record", &file("cut.bin"), "-o", &file("cut.mcap")]);
    assert_eq!(ended.code, Some(1), "{}", ended.stderr);
    let (begins, rest) = (whole.len() - scan(4).len(), scan(4).len() - 7);
    let torn = format!(
        "broken off at byte {begins}: expected the rest of a telegram, found the end of the file, {rest} bytes into it"
    );
    assert_says(&ended.stderr, &["4 packets", &torn]);
    let info = run(&["record", "--info", &file("cut.bin"), "--format", "json"]);
    let told: serde_json::Value = serde_json::from_str(&info.stdout).expect("json");
    assert_eq!((info.code, told["torn"].as_str()), (Some(1), Some(&*torn)), "{}", info.stderr);
    // Scripts read the document, not stderr; what is there is told all the same.
    let warned = |name: &str| {
        let ended = run(&["estimate", &file(name), "--format", "json"]);
        assert_eq!(ended.code, Some(0), "{}", ended.stderr);
        let told: serde_json::Value = serde_json::from_str(&ended.stdout).expect("json");
        (told["warnings"].to_string().contains(&format!("broken_off: the recording is {torn}")), ended.stderr)
    };
    let (is_warned, stderr) = warned("cut.bin");
    assert!(is_warned);
    assert_says(&stderr, &[&torn]);
    // What the file says by itself is said once.
    let decoded = run(&["decode", &file("cut.bin"), "--format", "jsonl"]);
    assert_eq!((decoded.code, decoded.stdout.matches("\"bad\"").count()), (Some(1), 1), "{}", decoded.stdout);
    std::fs::write(file("whole.bin"), &whole).expect("written");
    assert!(!warned("whole.bin").0);
    let ended = run(&["record", &file("whole.bin"), "-o", &file("whole.mcap")]);
    assert_eq!((ended.code, ended.stderr.contains("broken off")), (Some(0), false), "{}", ended.stderr);
}
