//! Faults of parts on an emulated rig, in virtual time: what a client sees of each, and that nothing of it is there without it.

use std::sync::Arc;
use std::time::Duration;

use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig, Rig, Running, StageRow};
use rowscan_faults::{FaultControl, FaultEvents, Language, Medium, What, read};
use rowscan_protocol::device::{Options, Profile};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::validity::DeviceStatus;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, timeout};

use crate::common::{RawClient, raw_client, small_scene};

/// A scanner with faults of its own and of its tractor.
struct Bench {
    emulator: Emulator,
    control: FaultControl,
    events: FaultEvents,
    rig: Stage,
    began: Instant,
    _running: Running,
}

impl Bench {
    /// Waits until so many seconds of simulated time.
    async fn until(&self, s: f64) {
        tokio::time::sleep_until(self.began + Duration::from_secs_f64(s)).await;
    }

    fn told(&mut self) -> Vec<(What, f64)> {
        std::iter::from_fn(|| self.events.take()).map(|event| (event.what, event.at_s)).collect()
    }
}

fn faulty(options: Options, faults: &str) -> Bench {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let tractor = stage.tractor();
    let model = model::by_name("lms111").expect("known");
    let (device, view) = stage.scanner_on(&tractor, 0, model).expect("it fits");
    let (began, mut rig) = (Instant::now(), Rig::new(tractor.clone(), TimeScale::Paced(1.0)));
    let row = Arc::new(StageRow::new(tractor, &stage.orchard));
    let (control, events) = FaultControl::new(1, rig.clock(), Some(row));
    let stream = control.stream("scanner0", Medium::Tcp, Language::Cola);
    let config = EmulatorConfig { faults: Some(stream), ..EmulatorConfig::default() };
    let emulator = rig.scanner(device.with_options(options), view, config);
    control.add_all(read(faults).expect(faults)).expect(faults);
    Bench { emulator, control, events, rig: stage, began, _running: rig.run() }
}

fn bench(faults: &str) -> Bench {
    faulty(Options::default(), faults)
}

/// A client that asks in CoLa A.
struct Asking(DuplexStream);

impl Asking {
    fn of(bench: &mut Bench) -> Self {
        let (here, there) = tokio::io::duplex(64 * 1024);
        bench.emulator.attach(there);
        Self(here)
    }

    /// The answer, or none within a second.
    async fn ask(&mut self, command: &str) -> Option<String> {
        self.0.write_all(format!("\x02{command}\x03").as_bytes()).await.ok()?;
        let mut answer = Vec::new();
        let read = async {
            while let Ok(byte) = self.0.read_u8().await {
                match byte {
                    2 => answer.clear(),
                    3 => return Some(String::from_utf8_lossy(&answer).into_owned()),
                    _ => answer.push(byte),
                }
            }
            None
        };
        timeout(Duration::from_secs(1), read).await.ok().flatten()
    }

    async fn log_in(&mut self) -> Option<String> {
        self.ask("sMN SetAccessMode 03 F4724744").await
    }
}

async fn scans(client: &mut RawClient, count: usize) -> Vec<Scan> {
    let mut scans = Vec::new();
    while scans.len() < count {
        scans.push(client.next_scan().await);
    }
    scans
}

#[tokio::test(start_paused = true)]
async fn a_scanner_without_power_is_gone_boots_as_long_as_a_real_one_and_knows_only_its_eeprom() {
    let fault = "[[fault]]\nname = \"power\"\nat = { s = 20 }\nfor = { s = 1.4 }\n";
    let mut bench = faulty(Options { profile: Profile::Field, ..Options::default() }, fault);
    let boot_s = model::by_name("lms111").expect("known").times.boot.as_secs_f64();
    let mut client = Asking::of(&mut bench);
    assert_eq!(client.log_in().await.as_deref(), Some("sAN SetAccessMode 1"));
    assert_eq!(
        client.ask("sWN LocationName +4 left").await.as_deref(),
        Some("sWA LocationName"),
        "not saved"
    );
    bench.until(20.1).await;
    assert_eq!(client.ask("sRN LocationName").await, None, "not a word");
    bench.until(21.5).await;
    let mut early = Asking::of(&mut bench);
    assert_eq!(early.ask("sRN LocationName").await, None, "it boots for {boot_s} s");
    bench.until(21.4 + boot_s + 0.1).await;
    let mut late = Asking::of(&mut bench);
    let name = late.ask("sRN LocationName").await.expect("it is up");
    assert!(name.ends_with("not defined"), "{name}");
    // The old connection is unknown to the device.
    assert_eq!(client.ask("sRN LocationName").await, None);
    assert_eq!(client.0.read(&mut [0; 16]).await.unwrap_or(0), 0, "it is closed");
    let told: Vec<What> = bench.told().into_iter().map(|(what, _)| what).collect();
    assert_eq!(told, [What::Begin, What::Act, What::End]);
}

#[tokio::test(start_paused = true)]
async fn a_crank_is_off_as_long_as_the_voltage_is_low() {
    let dips = "dips = [[0, 6.0], [300, 9.0], [900, 12.0]]";
    let mut bench = bench(&format!("[[fault]]\nname = \"power\"\nat = {{ s = 2 }}\n{dips}\n"));
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let before = scans(&mut client, 80).await.pop().expect("some");
    bench.until(2.95).await;
    let mut again = raw_client(&mut bench.emulator, Dialect::B);
    let after = scans(&mut again, 1).await.pop().expect("one");
    // 2.9 s is its new zero, and its counters are new.
    assert!(after.scan_time_us < 300_000, "{}", after.scan_time_us);
    assert!(after.telegram_counter < before.telegram_counter);
    assert_eq!(bench.told().last(), Some(&(What::End, 2.9)));
}

#[tokio::test(start_paused = true)]
async fn a_device_answers_as_its_faults_say_and_as_ever_afterwards() {
    for (fault, command, during, afterwards) in [
        ("name = \"login\"", "sMN SetAccessMode 03 F4724744", "sAN SetAccessMode 0", "sAN SetAccessMode 1"),
        ("name = \"busy\"", "sMN mEEwriteall", "sFA D", "sAN mEEwriteall 1"),
        ("name = \"eeprom_full\"", "sMN mEEwriteall", "sAN mEEwriteall 0", "sAN mEEwriteall 1"),
        (
            "name = \"fault_code\"\ncommand = \"sRN LCMstate\"\ncode = 17",
            "sRN LCMstate",
            "sFA 11",
            "sRA LCMstate 0",
        ),
        (
            "name = \"fault_code\"\ncommand = \"mEEwriteall\"",
            "sRN LCMstate",
            "sRA LCMstate 0",
            "sRA LCMstate 0",
        ),
        ("name = \"contamination\"\nlevel = 1", "sRN LCMstate", "sRA LCMstate 1", "sRA LCMstate 0"),
        ("name = \"pollution\"\nlevel = 3", "sRN LCMstate", "sRA LCMstate 3", "sRA LCMstate 0"),
        ("name = \"motor\"", "sRN SCdevicestate", "sRA SCdevicestate 2", "sRA SCdevicestate 1"),
        (
            "name = \"motor\"\nuntil_reboot = true",
            "sRN SCdevicestate",
            "sRA SCdevicestate 2",
            "sRA SCdevicestate 2",
        ),
    ] {
        let mut bench = bench(&format!("[[fault]]\n{fault}\nat = {{ s = 2 }}\nfor = {{ s = 2 }}\n"));
        let mut client = Asking::of(&mut bench);
        let logs_in = !fault.contains("motor");
        if logs_in {
            assert_eq!(client.log_in().await.as_deref(), Some("sAN SetAccessMode 1"), "{fault}: not yet");
        }
        bench.until(3.0).await;
        assert_eq!(client.ask(command).await.as_deref(), Some(during), "{fault}");
        bench.until(5.0).await;
        assert_eq!(client.ask(command).await.as_deref(), Some(afterwards), "{fault} is over");
    }
}

#[tokio::test(start_paused = true)]
async fn dirt_grows_step_by_step_and_takes_the_beams_of_its_sector() {
    let mut growing = bench(
        "[[fault]]\nname = \"contamination\"\nlevel = 3\nramp_s = 6\nat = { s = 2 }\nfor = { s = 8 }\n",
    );
    let (mut asking, mut levels) = (Asking::of(&mut growing), Vec::new());
    for s in [3.0, 5.0, 7.0, 9.0, 11.0] {
        growing.until(s).await;
        let level = asking.ask("sRN LCMstate").await.expect("an answer");
        levels.push(level.chars().last().expect("a level"));
    }
    assert_eq!(levels, ['0', '1', '2', '3', '0']);
    let mut bench = bench("[[fault]]\nname = \"contamination\"\nsector = [80, 100]\nat = { s = 2 }\n");
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let sees = |scan: &Scan, inside: bool| {
        let beams = (0..scan.beams.len())
            .filter(|beam| (80.0..=100.0).contains(&scan.beams.angle_deg(*beam)) == inside);
        beams.map(|beam| scan.echoes[0].range_m[beam]).any(f64::is_finite)
    };
    let all = scans(&mut client, 200).await;
    let (before, dirty) = all.split_at(99);
    assert!(before.iter().any(|scan| sees(scan, true)), "there is something to be seen");
    let dirty = dirty.iter().skip(2);
    assert!(dirty.clone().all(|scan| !sees(scan, true)), "all blind");
    assert!(dirty.clone().any(|scan| sees(scan, false)), "the others see");
}

#[tokio::test(start_paused = true)]
async fn scans_stop_with_the_motor_go_blind_with_the_laser_and_tell_the_temperature() {
    let mut stopped = bench("[[fault]]\nname = \"motor\"\nat = { s = 1 }\nfor = { s = 2 }\n");
    let mut client = raw_client(&mut stopped.emulator, Dialect::B);
    let times: Vec<u32> = scans(&mut client, 80).await.iter().map(|scan| scan.scan_time_us).collect();
    let gap = times.windows(2).map(|pair| pair[1] - pair[0]).max().expect("some");
    assert!((2_000_000..2_100_000).contains(&gap), "{gap} µs");
    let mut blind = bench("[[fault]]\nname = \"laser\"\nat = { s = 1 }\nfor = { s = 2 }\n");
    let mut client = raw_client(&mut blind.emulator, Dialect::B);
    let seen: Vec<bool> = scans(&mut client, 200)
        .await
        .iter()
        .map(|scan| scan.echoes[0].range_m.iter().any(|range| range.is_finite()))
        .collect();
    let dark = seen.iter().filter(|sees| !**sees).count();
    assert!((99..=101).contains(&dark), "{dark} blind scans in two seconds");
    let mut hot = bench("[[fault]]\nname = \"temperature\"\nat = { s = 1 }\n");
    let mut asking = Asking::of(&mut hot);
    hot.until(2.0).await;
    let status = asking.ask("sRN STlms").await.expect("an answer");
    assert!(status.starts_with("sRA STlms 7 1 "), "{status}");
    hot.control.reset();
    hot.until(2.5).await;
    let status = asking.ask("sRN STlms").await.expect("an answer");
    assert!(status.starts_with("sRA STlms 7 0 "), "healed: {status}");
}

/// Stamps of the scans of some seconds, µs from one to the next, and the first and the last.
async fn stamps(fault: &str) -> (Vec<i64>, Vec<u32>) {
    let mut bench = bench(&format!("[[fault]]\n{fault}\n"));
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let times: Vec<u32> = scans(&mut client, 200).await.iter().map(|scan| scan.scan_time_us).collect();
    let steps = times.windows(2).map(|pair| i64::from(pair[1].wrapping_sub(pair[0]) as i32)).collect();
    (steps, times)
}

#[tokio::test(start_paused = true)]
async fn a_clock_that_is_wrong_changes_stamps_and_nothing_else() {
    let even = |steps: &[i64]| steps.iter().filter(|step| **step == 20_000).count();
    let (steps, _) = stamps("name = \"clock_step\"\ns = -1.5\nat = { s = 2 }\nfor = { s = 1 }").await;
    let odd: Vec<i64> = steps.iter().copied().filter(|step| *step != 20_000).collect();
    assert_eq!(odd, [20_000 - 1_500_000, 20_000 + 1_500_000]);
    let (steps, _) = stamps("name = \"clock_drift\"\nppm = 10000\nat = { s = 2 }\nfor = { s = 1 }").await;
    assert_eq!((even(&steps), steps.iter().filter(|step| **step == 20_200).count()), (149, 50));
    let (steps, times) = stamps("name = \"clock_wrap\"\nat = { s = 2 }").await;
    assert!(times.contains(&0), "the scan at that moment");
    assert_eq!(even(&steps), steps.len(), "it goes on as if nothing were");
    assert!(times[0] > 4_290_000_000, "{}", times[0]);
    let (steps, times) = stamps("name = \"clock_wrap\"\nat = { row_m = 1 }").await;
    assert!(even(&steps) == steps.len() && times[0] > 4_290_000_000 && times.iter().any(|us| *us < 20_000));
    let (steps, _) = stamps("name = \"clock_wrap\"\nat = { scan = 50 }").await;
    assert_eq!(even(&steps), steps.len() - 1, "nobody could know");
    let (steps, _) = stamps("name = \"clock_step\"\ns = 5\nat = { s = 900 }").await;
    assert_eq!(even(&steps), steps.len(), "not yet");
}

/// What is added while scans flow counts its times from then; a clock that has told its time can no longer have started elsewhere.
#[tokio::test(start_paused = true)]
async fn faults_that_are_added_to_what_runs_count_from_then() {
    let mut bench = bench("");
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let first = scans(&mut client, 100).await;
    let wrap = read("[[fault]]\nname = \"clock_wrap\"\nat = { s = 1 }\n").expect("sound");
    let refused = bench.control.add_from_now(wrap).expect_err("too late").to_string();
    assert!(refused.contains("give it before the first one"), "{refused}");
    let dirt = "[[fault]]\nname = \"contamination\"\nat = { s = 1 }\nuntil = { s = 2 }\n";
    bench.control.add_from_now(read(dirt).expect("sound")).expect("fits");
    let later = scans(&mut client, 150).await;
    let is_dirty = |scan: &Scan| scan.status == DeviceStatus::ContaminationError;
    assert!(!first.iter().any(is_dirty));
    let (from, to) = (later.iter().position(is_dirty), later.iter().rposition(is_dirty));
    // 50 scans a second, one or two of them under way.
    assert!(from.is_some_and(|from| (46..=51).contains(&from)), "{from:?}");
    assert!(to.is_some_and(|to| (95..=101).contains(&to)), "{to:?}");
}

#[tokio::test(start_paused = true)]
async fn a_fault_begins_with_the_command_that_it_waits_for() {
    for dialect in [Dialect::A, Dialect::B] {
        let mut bench = bench(
            "[[fault]]\nname = \"contamination\"\nat = { command = \"sEN LMDscandata\" }\nfor = { scans = 20 }\n",
        );
        let mut asking = Asking::of(&mut bench);
        bench.until(1.0).await;
        assert_eq!(asking.ask("sRN LCMstate").await.as_deref(), Some("sRA LCMstate 0"));
        let mut client = raw_client(&mut bench.emulator, dialect);
        let dirty = scans(&mut client, 30)
            .await
            .iter()
            .filter(|scan| scan.status == DeviceStatus::ContaminationError)
            .count();
        // The device measures one scan ahead of the twentieth's delivery.
        assert!((19..=21).contains(&dirty), "{dirty} in {dialect:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn the_tractor_stops_and_the_scans_and_the_events_say_where() {
    let mut bench =
        bench("[[fault]]\nname = \"stop\"\nat = { row_m = 1 }\nfor = { s = 5 }\nchange_m_s2 = 100\n");
    let mut client = raw_client(&mut bench.emulator, Dialect::B);
    let all = scans(&mut client, 600).await;
    // Before the trees one scan is like another too, for a second at most.
    let (mut still, mut run) = (0, 0);
    for pair in all.windows(2) {
        run = if pair[0].echoes == pair[1].echoes { run + 1 } else { 0 };
        still = still.max(run);
    }
    assert!((240..=255).contains(&still), "{still} scans from one place in five seconds");
    let places: Vec<f64> =
        std::iter::from_fn(|| bench.events.take()).filter_map(|event| event.row_m).collect();
    assert!(places.len() == 2 && (places[0] - places[1]).abs() < 0.02 && places[0] >= 1.0, "{places:?}");
}

#[tokio::test(start_paused = true)]
async fn the_scanner_sees_that_the_tractor_drives_beside_its_way_and_bounces() {
    for fault in
        ["name = \"lateral\"\nm = 0.3\nover_s = 0", "name = \"bounce\"\nm = 0.2\nhz = 3\nroll_deg = 2"]
    {
        // One after the other: each has its own time, and begins with its client.
        let mut still = bench("");
        let mut client = raw_client(&mut still.emulator, Dialect::B);
        let plain = scans(&mut client, 250).await;
        let text = format!("[[fault]]\n{fault}\nat = {{ s = 2 }}\nfor = {{ s = 1 }}\n");
        let mut swaying = bench(&text);
        let mut client = raw_client(&mut swaying.emulator, Dialect::B);
        let moved = scans(&mut client, 250).await;
        let other = plain.iter().zip(&moved).filter(|(one, other)| one.echoes != other.echoes).count();
        assert!((40..=51).contains(&other), "{fault}: {other} scans in one second");
    }
}

#[tokio::test(start_paused = true)]
async fn faults_without_a_part_are_refused_with_the_reason() {
    let bench = bench("");
    for (fault, why) in [
        ("name = \"bus_off\"", "`bus_off` is a fault of the bus, and nothing here has one"),
        ("name = \"gnss\"\nlost = true", "nothing here tells positions; add"),
        ("name = \"power\"\non = \"tractor\"", "`on` must be one of scanner0"),
        ("name = \"stop\"\nat = { scan = 5 }", "scans and commands pass on a scanner's stream"),
        ("name = \"stored\"\nrate = 9600", "`rate` and `streaming` are an LMS2xx's"),
        ("name = \"drop\"\non = \"encoder\"", "`on` must be one of scanner0"),
    ] {
        let specs = read(&format!("[[fault]]\n{fault}\n")).expect(fault);
        let refused = bench.control.add_all(specs).expect_err(fault).to_string();
        assert!(refused.contains(why), "{refused}");
    }
    assert!(bench.rig.rig.scanners.len() == 1 && bench.control.list().is_empty());
}
