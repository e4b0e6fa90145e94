//! Whatever an earlier client has set and stored, the next one that starts the scanner gets the scans of an untouched one.

use std::collections::BTreeSet;

use crate::pair::{Pair, measured};
use rowscan_protocol::client::ColaConfig;
use rowscan_protocol::device::{Device, DialectPolicy, Identity, Session, command, variable};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::host::{HostEvent, HostSession, SettingNote, Transmit};
use rowscan_protocol::leftover::{LEFTOVERS, Leftover};
use rowscan_protocol::model::{MODELS, Model, all};
use rowscan_protocol::rig::EchoChoice;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::SopasError;
use rowscan_protocol::time::SimTime;

/// What an earlier client may write, in CoLa A.
const WRITTEN: &[(&str, &str)] = &[
    ("SetActiveApplications", "1 RANG 0"),
    ("LMPoutputRange", "1 1388 493E0 F4240"),
    ("ScanLayerFilter", "4 1 0 1 1"),
    ("ScanLayerFilter", "4 0 1 0 0"),
    ("LFPmeanfilter", "1 +3 0"),
    ("LFPmedianfilter", "1 +3"),
    ("LFPparticle", "1 +500"),
    ("MSsuppmode", "1"),
    ("FREchoFilter", "2"),
    ("FREchoFilter", "0"),
    ("LFPangleRangeFilter", "1 FFFCF2C0 30D40 FFF24460 DBBA0 3"),
    ("LFPradialDistanceRangeFilter", "1 0 7D0"),
    ("LFPintervalFilter", "1 5"),
    ("LMDscandatacfg", "1 0 1 1 0 0 0 0 0 0 0 +5"),
];

/// Settings that are stored and that a client writes anyway, or that take nothing of a scan.
const NO_LEFTOVERS: &[&str] = &[
    "LMPscancfg",
    "EIHstCola",
    "LMDscandatacfg",
    "FREchoFilter",
    "DO3And4Fnc",
    "LICsrc",
    "LICencset",
    "LICencres",
    "LocationName",
    "ScanDataEnable",
    "ScanDataFormat",
    "ScanDataEthSettings",
    "ImuDataEnable",
    "ImuDataEthSettings",
    "EncoderDataEnable",
    "EncoderDataEthSettings",
    "ScanDataPreformatting",
    "SensitivityMode",
    "EnableLongRangeMode",
    "EtherAuxEnabled",
    "EtherCoLaScanMode",
    "EncSetting",
    "TSCRole",
    // Layers of today's scanners are the user's choice, which is told.
    "LFPlayerFilter",
];

/// An earlier client: what the scanner answered to the last of these.
fn earlier(device: &mut Device, requests: &[&str]) -> String {
    let mut session = Session::new(DialectPolicy::Auto);
    let mut decoder = FrameDecoder::new(Accept::Only(Dialect::A), 4096);
    for request in requests {
        let (mut bytes, mut replies) = (Vec::new(), Vec::new());
        encode(Dialect::A, request.as_bytes(), &mut bytes);
        session.handle_bytes(device, SimTime::ZERO, &bytes, &mut replies);
        replies.iter().for_each(|reply| decoder.push(&reply.bytes));
    }
    let mut last = String::new();
    while let Some(frame) = decoder.next_frame() {
        last = String::from_utf8_lossy(frame.payload).into_owned();
    }
    last
}

fn login(model: &Model) -> String {
    let login = model.logins.last().unwrap();
    format!("sMN SetAccessMode {} {:X}", login.level, login.hash)
}

/// The scans of some turns, and what was told of settings.
fn scans(device: Device, dialect: Dialect, echo: EchoChoice) -> (Vec<Scan>, Vec<SettingNote>) {
    let config = ColaConfig { echo: Some(echo), ..ColaConfig::default() };
    let mut pair = Pair::new(device, DialectPolicy::Auto, config, dialect);
    pair.settle();
    let mut scans = Vec::new();
    for turn in 0..12 {
        let mirror = pair.device.mirror();
        let echoes = measured(mirror.beams.len(), pair.device.model().echoes.into(), turn);
        if pair.turn(&echoes) {
            // Telegrams of another count and time are alike.
            let scan = pair.client.scan();
            scans.push(Scan {
                beams: scan.beams,
                echoes: scan.echoes.clone(),
                layer_centideg: scan.layer_centideg,
                ..Scan::default()
            });
        }
    }
    assert!(pair.events.iter().any(|event| matches!(event, HostEvent::Ready(_))), "{:?}", pair.events);
    (scans, pair.events.iter().filter_map(SettingNote::of).collect())
}

#[test]
fn whatever_an_earlier_client_has_stored_the_scans_are_those_of_an_untouched_scanner() {
    let mut stored = BTreeSet::new();
    for model in all() {
        for (name, value) in WRITTEN {
            for (dialect, echo) in [(Dialect::A, EchoChoice::First), (Dialect::B, EchoChoice::Last)] {
                let mut device = Device::new(model, Identity::default());
                device.set_factory_echo(model.optics.factory_echo);
                // Over CoLa a scanner of today sends scans of this form only.
                let (untouched, none) = scans(device.clone(), dialect, echo);
                let write = format!("sWN {name} {value}");
                let reply = earlier(&mut device, &[&login(model), &write]);
                if !reply.starts_with("sWA") {
                    // The model has no such setting, or not this value of it.
                    continue;
                }
                assert!(
                    earlier(&mut device, &[&login(model), "sMN mEEwriteall", "sMN Run"])
                        .starts_with("sAN Run 1")
                );
                stored.insert(*name);
                let (found, told) = scans(device, dialect, echo);
                assert_eq!(found, untouched, "{} {write} {dialect}", model.name);
                assert_eq!(none, [], "{}: untouched", model.name);
                let is_leftover = LEFTOVERS.iter().any(|row| row.name == *name);
                let expected = LEFTOVERS.iter().filter(|row| is_leftover && row.name == *name);
                let expected: Vec<_> =
                    expected.map(|setting| SettingNote::Leftover { setting, refused: None }).collect();
                assert_eq!(told, expected, "{} {write}", model.name);
            }
        }
    }
    let all: BTreeSet<_> = WRITTEN.iter().map(|(name, _)| *name).collect();
    assert_eq!(stored, all, "each setting was tried on some model");
}

#[test]
fn each_stored_setting_is_a_leftover_or_known_to_be_none() {
    let saved = command::COMMANDS.iter().filter(|command| command.is_saved).map(|command| command.name);
    let saved = saved.chain(
        variable::VARIABLES.iter().filter(|variable| variable.is_saved()).map(|variable| variable.name),
    );
    for name in saved {
        let is_leftover = LEFTOVERS.iter().any(|row| row.name == name);
        assert!(is_leftover != NO_LEFTOVERS.contains(&name), "{name}: expected in one of both lists");
    }
}

#[test]
fn a_scanner_that_refuses_keeps_its_filter_and_that_is_told() {
    let row: &'static Leftover = LEFTOVERS.iter().find(|row| row.name == "LFPmeanfilter").unwrap();
    let mut client = rowscan_protocol::client::ColaClient::new(ColaConfig::default(), Dialect::A);
    let mut told = Vec::new();
    for _ in 0..60 {
        let Some(frame) = client.poll_transmit().and_then(Transmit::into_frame) else { break };
        let request = String::from_utf8(frame[1..frame.len() - 1].to_vec()).unwrap();
        let name = request.split(' ').nth(1).unwrap();
        let reply = match &request[..3] {
            "sRN" if name == "DeviceIdent" => "sRA DeviceIdent 6 LMS10x 5 V1.10".to_owned(),
            "sRN" if name == "LFPmeanfilter" => "sRA LFPmeanfilter 1 A 0".to_owned(),
            "sWN" if name == "LFPmeanfilter" => "sFA 5".to_owned(),
            // What it does not know, it has not.
            "sRN" => "sFA 3".to_owned(),
            "sMN" if name == "LMCstartmeas" => "sAN LMCstartmeas 0".to_owned(),
            "sMN" => format!("sAN {name} 1"),
            "sEN" => format!("sEA {name} 1"),
            _ => format!("sWA {name}"),
        };
        let mut bytes = Vec::new();
        encode(Dialect::A, reply.as_bytes(), &mut bytes);
        client.handle_bytes(std::time::Duration::ZERO, &bytes);
        told.extend(std::iter::from_fn(|| client.poll_event()));
    }
    let refused = Some(SopasError::from_code(5).into());
    let notes: Vec<_> = told.iter().filter_map(SettingNote::of).collect();
    assert!(notes.contains(&SettingNote::Leftover { setting: row, refused }), "{notes:?}");
    assert!(told.iter().any(|event| matches!(event, HostEvent::Ready(_))), "{told:?}");
    let words = SettingNote::Leftover { setting: row, refused }.to_string();
    assert!(words.contains("LFPmeanfilter") && words.contains("maker's software"), "{words}");
    assert!(MODELS.iter().all(|model| Leftover::of(Some(model)).any(|other| other == row)));
}
