//! What scanners say that they are: by model and scanner, as real ones do.

use std::collections::BTreeSet;

use crate::bench::Bench;
use rowscan_protocol::device::{DialectPolicy, Identity, MeasuredLine, Session, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model::{self, MODELS, by_ident};
use rowscan_protocol::time::SimTime;

#[test]
fn no_two_scanners_of_a_bench_have_their_numbers_in_common() {
    let (mut serials, mut uses) = (BTreeSet::new(), BTreeSet::new());
    for model in model::all() {
        let mut of_model = BTreeSet::new();
        for index in 0..4 {
            let Identity { serial_number, operating_hours, power_on_count, .. } = Identity::of(model, index);
            assert!(serials.insert(serial_number), "{} {index}", model.name);
            assert!(of_model.insert((operating_hours, power_on_count)), "{} {index}", model.name);
            uses.insert((operating_hours, power_on_count));
        }
    }
    // Of each recorded family, four.
    assert!(uses.len() >= 12, "{uses:?}");
    assert_eq!(Identity::of(MODELS[0], 0).serial_number, 26_110_001, "golden files know it");
}

/// The first run's numbers are those that golden files know; seeds that follow on each other, and all that a program is likely to be given, are apart.
#[test]
fn no_two_runs_have_a_scanner_in_common() {
    let mut serials = BTreeSet::new();
    for seed in 0..9000 {
        for (model, index) in model::all().flat_map(|model| [0, 1].map(|index| (model, index))) {
            let of = Identity::of(model, index);
            let found = of.clone().of_run(seed).serial_number;
            assert!((10_000_000..100_000_000).contains(&found), "eight digits: {found}, seed {seed}");
            assert_eq!(found == of.serial_number, seed == 1, "{found}, seed {seed}");
            assert!(serials.insert(found), "{} {index}, seed {seed}", model.name);
        }
    }
    let last = Identity::of(MODELS[0], 0).of_run(u64::MAX).serial_number;
    assert!((10_000_000..100_000_000).contains(&last), "{last}");
}

#[test]
fn what_a_model_says_of_itself_leads_back_to_it() {
    for model in model::all() {
        let said = format!("{} {}", model.ident_name, model.ident_version);
        let found: Vec<_> = by_ident(&said).collect();
        assert!(found.iter().any(|other| other.name == model.name), "{said}");
        // The driver logs in and chooses echoes by the first of them.
        for other in found {
            assert_eq!((other.logins, other.optics.factory_echo), (model.logins, model.optics.factory_echo));
        }
    }
    for stranger in ["", "LMS", "TiM", "TiM240 V1", "MRS6xxxx 1.0.0.0R", "LMS4000 V1", "LMS10000 1.0", "é"] {
        assert_eq!(by_ident(stranger).count(), 0, "{stranger}");
    }
}

#[test]
fn what_a_scanner_shall_say_it_says() {
    let mut bench = Bench::new("lms111");
    bench.device.set_ident("LMS10x_FieldEval", "V1.80-01.02.2012");
    bench.device.set_firmware("V1.80.9");
    bench.table(&[
        ("sRN DeviceIdent", "sRA DeviceIdent 10 LMS10x_FieldEval 10 V1.80-01.02.2012"),
        ("sRN FirmwareVersion", "sRA FirmwareVersion 7 V1.80.9"),
    ]);
    bench.log_in();
    assert_eq!(bench.ask("sMN mSCreboot"), "sAN mSCreboot");
    bench.session = Session::new(DialectPolicy::Auto);
    assert_eq!(bench.ask("sRN FirmwareVersion"), "sRA FirmwareVersion 7 V1.80.9", "after a restart, too");
}

/// The tokens of the next scan in CoLa A.
fn scan(bench: &mut Bench) -> Vec<String> {
    let line = MeasuredLine { grid: bench.device.mirror().beams, echoes: &[] };
    let scan = bench.device.measure(bench.now, &line).unwrap().clone();
    let mut bytes = Vec::new();
    scan_event(Dialect::A, &scan, &mut bytes);
    let text = String::from_utf8(bytes).unwrap();
    text.trim_matches(['\x02', '\x03']).split(' ').map(str::to_owned).collect()
}

/// Recorded of a TiM571 by a public program: 1663 tokens with remission, the end `0 0 1 B not defined 0 0 0`. A public parser wants the name always.
#[test]
fn a_tim5xx_names_itself_in_every_scan() {
    for name in ["tim551", "tim561", "tim571"] {
        for (config, remission) in
            [("01 00 0 1 0 00 00 0 0 0 0 +1", false), ("01 00 1 1 0 00 00 0 0 0 0 +1", true)]
        {
            let mut bench = Bench::logged_in(name);
            assert_eq!(bench.ask(&format!("sWN LMDscandatacfg {config}")), "sWA LMDscandatacfg");
            let tokens = scan(&mut bench);
            assert_eq!(tokens[tokens.len() - 9..].join(" "), "0 0 1 B not defined 0 0 0", "{name}");
            let beams = usize::from(bench.device.mirror().beams.count);
            let expected = 26 + beams + if remission { 7 + beams } else { 0 } + 8;
            // `not defined` is two tokens.
            assert_eq!(tokens.len(), expected + usize::from(!remission), "{name} {config}");
        }
    }
    let mut bench = Bench::logged_in("tim571");
    bench.ask("sWN LMDscandatacfg 01 00 1 1 0 00 00 0 0 0 0 +1");
    assert_eq!(scan(&mut bench).len(), 1663);
    let mut bench = Bench::new("tim781");
    assert_eq!(scan(&mut bench).iter().filter(|token| *token == "defined").count(), 0, "no TiM7xx does");
}

#[test]
fn inputs_are_stamped_from_power_up_on() {
    let mut bench = Bench::new("lms511");
    let stamp = |bench: &mut Bench| bench.ask("sRN LIDinputstate");
    assert_eq!(stamp(&mut bench), "sRA LIDinputstate 0 0 0 0 0 0 1 7B2 1 1 0 0 0 0", "it is on for 0 s");
    bench.now = SimTime(9_000_000_000);
    // 2.716717 s.
    assert_eq!(stamp(&mut bench), "sRA LIDinputstate 0 29742D 0 0 0 0 1 7B2 1 1 0 0 2 AECE0");
    let mut bench = Bench { now: SimTime(9_000_000_000), ..Bench::new("lms111") };
    assert_eq!(stamp(&mut bench), "sRA LIDinputstate 1 0 2 2 2 2 0");
}
