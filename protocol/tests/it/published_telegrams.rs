//! Telegrams whose exact bytes are known, in both dialects, request and reply.
//!
//! Sources, as tagged on each line: REC bytes of a recorded device, CLI what a public client sends, MAN SICK's telegram listing. Hosts
//! write numbers in text as they like, so a text request is read only; everything else is read and written.

use std::fmt::Debug;

use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode as frame};
use rowscan_protocol::telegram::device_ident::DeviceIdent;
use rowscan_protocol::telegram::ee_writeall::WriteAll;
use rowscan_protocol::telegram::ei_address::IpAddress;
use rowscan_protocol::telegram::eihst_cola::HostDialect;
use rowscan_protocol::telegram::field_nnn::Field;
use rowscan_protocol::telegram::firmware_version::FirmwareVersion;
use rowscan_protocol::telegram::fr_echo_filter::EchoFilter;
use rowscan_protocol::telegram::lcm_state::Contamination;
use rowscan_protocol::telegram::lfp_filter::{MeanFilter, ParticleFilter};
use rowscan_protocol::telegram::lic_encoder::{
    EncoderResolution, EncoderSetting, IncrementSource, InputsThreeAndFour,
};
use rowscan_protocol::telegram::lmc_meas::{Standby, StartMeasurement, StopMeasurement};
use rowscan_protocol::telegram::lmd_scandatacfg::ScanDataConfig;
use rowscan_protocol::telegram::lmp_output_range::OutputRange;
use rowscan_protocol::telegram::lmp_scancfg::{ScanConfig, SetScanConfig};
use rowscan_protocol::telegram::location_name::LocationName;
use rowscan_protocol::telegram::od_oprh::OperatingHours;
use rowscan_protocol::telegram::od_pwrc::PowerOnCount;
use rowscan_protocol::telegram::run::Run;
use rowscan_protocol::telegram::sc_reboot::Reboot;
use rowscan_protocol::telegram::scdevicestate::DeviceState;
use rowscan_protocol::telegram::serial_number::SerialNumber;
use rowscan_protocol::telegram::set_access_mode::SetAccessMode;
use rowscan_protocol::telegram::set_active_applications::ActiveApplications;
use rowscan_protocol::telegram::stlms::Status;
use rowscan_protocol::telegram::tsc_time_client::{TimeInterface, TimeRole, TimeServer, TimeUpdate};
use rowscan_protocol::telegram::wire::Fields;
use rowscan_protocol::telegram::{Kind, Method, SopasError, Telegram, encode, encode_empty};

fn bytes(hex: &str) -> Vec<u8> {
    hex.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// The payload of exactly one frame.
fn payload(dialect: Dialect, framed: &[u8]) -> Vec<u8> {
    let mut decoder = FrameDecoder::new(Accept::Only(dialect), 1000);
    decoder.push(framed);
    let frame = decoder.next_frame().unwrap_or_else(|| panic!("no {dialect} frame in {framed:02X?}"));
    assert_eq!(frame.len, framed.len());
    frame.payload.to_vec()
}

fn value<T: Fields + Default>(dialect: Dialect, kind: Kind, payload: &[u8]) -> (T, String) {
    let telegram = Telegram::parse(dialect, payload).unwrap();
    assert_eq!(telegram.kind, kind);
    let decoded = telegram.args.decode();
    (decoded.unwrap_or_else(|error| panic!("{telegram:?}: {error}")), telegram.name.to_owned())
}

/// Reads `T` from both dialects and writes the binary form, and the text form where a device wrote it.
fn agree<T: Fields + Default + Debug + PartialEq>(
    kind: Kind,
    text: &str,
    hex: &str,
    written_by_device: bool,
) {
    let framed = bytes(hex);
    let binary = payload(Dialect::B, &framed);
    let (from_binary, name) = value::<T>(Dialect::B, kind, &binary);
    let (from_text, _) = value::<T>(Dialect::A, kind, text.as_bytes());
    assert_eq!(from_binary, from_text, "{text}");
    let mut again = Vec::new();
    encode(Dialect::B, kind, &name, &from_text, &mut again);
    let mut framed_again = Vec::new();
    frame(Dialect::B, &again, &mut framed_again);
    assert_eq!(framed_again, framed, "{text}");
    if written_by_device {
        again.clear();
        encode(Dialect::A, kind, &name, &from_binary, &mut again);
        assert_eq!(String::from_utf8(again).unwrap(), text);
    }
}

/// A reply without a value: binary may or may not end in a blank.
fn bare(kind: Kind, text: &str, hex: &str) {
    agree_bare(Dialect::A, kind, text.as_bytes());
    agree_bare(Dialect::B, kind, &payload(Dialect::B, &bytes(hex)));
}

fn agree_bare(dialect: Dialect, kind: Kind, payload: &[u8]) {
    let ((), name) = value::<()>(dialect, kind, payload);
    let mut again = Vec::new();
    encode_empty(dialect, kind, &name, payload.ends_with(b" "), &mut again);
    assert_eq!(again, payload);
}

fn read<T: Fields + Default + Debug + PartialEq>(
    request: &str,
    request_hex: &str,
    reply: &str,
    reply_hex: &str,
) {
    bare(Telegram::parse(Dialect::A, request.as_bytes()).unwrap().kind, request, request_hex);
    if request.contains("field") {
        // Not taken apart, so the two dialects' bodies stay different.
        assert_eq!(value::<Field>(Dialect::A, Kind::Ra, reply.as_bytes()).0, Field::unused(Dialect::A));
        let binary = payload(Dialect::B, &bytes(reply_hex));
        assert_eq!(value::<Field>(Dialect::B, Kind::Ra, &binary).0, Field::unused(Dialect::B));
    } else {
        agree::<T>(Kind::Ra, reply, reply_hex, true);
    }
}

fn write<T: Fields + Default + Debug + PartialEq>(
    request: &str,
    request_hex: &str,
    reply: &str,
    reply_hex: &str,
) {
    agree::<T>(Kind::Wn, request, request_hex, false);
    bare(Kind::Wa, reply, reply_hex);
}

fn call<M: Method + PartialEq>(request: &str, request_hex: &str, reply: &str, reply_hex: &str)
where
    M::Reply: PartialEq,
{
    agree::<M>(Kind::Mn, request, request_hex, false);
    if reply.ends_with(M::NAME) {
        bare(Kind::An, reply, reply_hex);
    } else {
        agree::<M::Reply>(Kind::An, reply, reply_hex, true);
    }
}

fn subscribe(request: &str, request_hex: &str, reply: &str, reply_hex: &str) {
    agree::<bool>(Kind::En, request, request_hex, true);
    agree::<bool>(Kind::Ea, reply, reply_hex, true);
}

#[test]
fn a_refusal_has_no_blank_in_binary() {
    let framed = bytes("02 02 02 02 00 00 00 05 73 46 41 00 03 77");
    let binary = payload(Dialect::B, &framed);
    for (dialect, payload) in [(Dialect::A, b"sFA 3".as_slice()), (Dialect::B, &binary)] {
        let telegram = Telegram::parse(dialect, payload).unwrap();
        assert_eq!(telegram.refusal(), Some(SopasError::UnknownVariable));
        let mut again = Vec::new();
        encode(dialect, Kind::Fa, "", &SopasError::UnknownVariable.code(), &mut again);
        assert_eq!(again, payload);
    }
}

#[test]
#[rustfmt::skip] // one telegram a line
fn published_telegrams_are_read_and_written_in_both_dialects() {
    // SetAccessMode 3 (client): [REC]
    call::<SetAccessMode>("sMN SetAccessMode 03 F4724744", "02 02 02 02 00 00 00 17 73 4D 4E 20 53 65 74 41 63 63 65 73 73 4D 6F 64 65 20 03 F4 72 47 44 B3", "sAN SetAccessMode 1", "02 02 02 02 00 00 00 13 73 41 4E 20 53 65 74 41 63 63 65 73 73 4D 6F 64 65 20 01 38");
    // SetAccessMode 3 (TiM7xxS): [REC]
    call::<SetAccessMode>("sMN SetAccessMode 3 6FD62C05", "02 02 02 02 00 00 00 17 73 4D 4E 20 53 65 74 41 63 63 65 73 73 4D 6F 64 65 20 03 6F D6 2C 05 A6", "sAN SetAccessMode 1", "02 02 02 02 00 00 00 13 73 41 4E 20 53 65 74 41 63 63 65 73 73 4D 6F 64 65 20 01 38");
    // EIHstCola (0 = A, 1 = B): [REC]
    write::<HostDialect>("sWN EIHstCola 1", "02 02 02 02 00 00 00 0F 73 57 4E 20 45 49 48 73 74 43 6F 6C 61 20 01 09", "sWA EIHstCola", "02 02 02 02 00 00 00 0E 73 57 41 20 45 49 48 73 74 43 6F 6C 61 20 07");
    // DeviceIdent: [REC]
    read::<DeviceIdent>("sRN DeviceIdent", "02 02 02 02 00 00 00 0F 73 52 4E 20 44 65 76 69 63 65 49 64 65 6E 74 25", "sRA DeviceIdent 8 MRS1xxxx 8 1.0.0.0R", "02 02 02 02 00 00 00 24 73 52 41 20 44 65 76 69 63 65 49 64 65 6E 74 20 00 08 4D 52 53 31 78 78 78 78 00 08 31 2E 30 2E 30 2E 30 52 0A");
    // DeviceIdent, short form: [CLI] shape as DeviceIdent
    read::<DeviceIdent>("sRI 0", "02 02 02 02 00 00 00 05 73 52 49 20 30 78", "sRA 0 6 LMS10x 5 V1.10", "02 02 02 02 00 00 00 15 73 52 41 20 30 20 00 06 4C 4D 53 31 30 78 00 05 56 31 2E 31 30 30");
    // SerialNumber: [REC]
    read::<SerialNumber>("sRN SerialNumber", "02 02 02 02 00 00 00 10 73 52 4E 20 53 65 72 69 61 6C 4E 75 6D 62 65 72 4C", "sRA SerialNumber 8 17100001", "02 02 02 02 00 00 00 1B 73 52 41 20 53 65 72 69 61 6C 4E 75 6D 62 65 72 20 00 08 31 37 31 30 30 30 30 31 6D");
    // FirmwareVersion (LMS111): [REC]
    read::<FirmwareVersion>("sRN FirmwareVersion", "02 02 02 02 00 00 00 13 73 52 4E 20 46 69 72 6D 77 61 72 65 56 65 72 73 69 6F 6E 24", "sRA FirmwareVersion 9 V1.80.2  ", "02 02 02 02 00 00 00 1F 73 52 41 20 46 69 72 6D 77 61 72 65 56 65 72 73 69 6F 6E 20 00 09 56 31 2E 38 30 2E 32 20 20 5F");
    // SCdevicestate: [REC shows 0, [CLI] waits for 1]
    read::<DeviceState>("sRN SCdevicestate", "02 02 02 02 00 00 00 11 73 52 4E 20 53 43 64 65 76 69 63 65 73 74 61 74 65 30", "sRA SCdevicestate 1", "02 02 02 02 00 00 00 13 73 52 41 20 53 43 64 65 76 69 63 65 73 74 61 74 65 20 01 1E");
    // ODoprh (operating hours, 1/10 h): [REC]
    read::<OperatingHours>("sRN ODoprh", "02 02 02 02 00 00 00 0A 73 52 4E 20 4F 44 6F 70 72 68 41", "sRA ODoprh 456", "02 02 02 02 00 00 00 0F 73 52 41 20 4F 44 6F 70 72 68 20 00 00 04 56 3C");
    // ODpwrc (power-on count): [REC]
    read::<PowerOnCount>("sRN ODpwrc", "02 02 02 02 00 00 00 0A 73 52 4E 20 4F 44 70 77 72 63 52", "sRA ODpwrc 3F", "02 02 02 02 00 00 00 0F 73 52 41 20 4F 44 70 77 72 63 20 00 00 00 3F 42");
    // LocationName: [REC]
    read::<LocationName>("sRN LocationName", "02 02 02 02 00 00 00 10 73 52 4E 20 4C 6F 63 61 74 69 6F 6E 4E 61 6D 65 55", "sRA LocationName B not defined", "02 02 02 02 00 00 00 1E 73 52 41 20 4C 6F 63 61 74 69 6F 6E 4E 61 6D 65 20 00 0B 6E 6F 74 20 64 65 66 69 6E 65 64 45");
    // LMPoutputRange read (LMS111): [REC]
    read::<OutputRange>("sRN LMPoutputRange", "02 02 02 02 00 00 00 12 73 52 4E 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 5E", "sRA LMPoutputRange 1 1388 FFF92233 22550D", "02 02 02 02 00 00 00 21 73 52 41 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 20 00 01 00 00 13 88 FF F9 22 33 00 22 55 0D 86");
    // LMPoutputRange read (LMS511): [REC]
    read::<OutputRange>("sRN LMPoutputRange", "02 02 02 02 00 00 00 12 73 52 4E 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 5E", "sRA LMPoutputRange 1 683 FFFF3CB0 1C3A90", "02 02 02 02 00 00 00 21 73 52 41 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 20 00 01 00 00 06 83 FF FF 3C B0 00 1C 3A 90 CF");
    // LMPoutputRange read (TiM781S): [REC]
    read::<OutputRange>("sRN LMPoutputRange", "02 02 02 02 00 00 00 12 73 52 4E 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 5E", "sRA LMPoutputRange 1 D05 FFF92230 225510", "02 02 02 02 00 00 00 21 73 52 41 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 20 00 01 00 00 0D 05 FF F9 22 30 00 22 55 10 0B");
    // LMPoutputRange write: [CLI], reply [REC]
    write::<OutputRange>("sWN LMPoutputRange 1 1388 FFF92230 225510", "02 02 02 02 00 00 00 21 73 57 4E 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 20 00 01 00 00 13 88 FF F9 22 30 00 22 55 10 92", "sWA LMPoutputRange", "02 02 02 02 00 00 00 13 73 57 41 20 4C 4D 50 6F 75 74 70 75 74 52 61 6E 67 65 20 74");
    // LMPscancfg read: [CLI]+[MAN]
    read::<ScanConfig>("sRN LMPscancfg", "02 02 02 02 00 00 00 0E 73 52 4E 20 4C 4D 50 73 63 61 6E 63 66 67 63", "sRA LMPscancfg 1388 1 1388 FFF92230 225510", "02 02 02 02 00 00 00 21 73 52 41 20 4C 4D 50 73 63 61 6E 63 66 67 20 00 00 13 88 00 01 00 00 13 88 FF F9 22 30 00 22 55 10 3E");
    // mLMPsetscancfg: [CLI]+[MAN]+issue log
    call::<SetScanConfig>("sMN mLMPsetscancfg +5000 +1 +5000 -450000 +2250000", "02 02 02 02 00 00 00 25 73 4D 4E 20 6D 4C 4D 50 73 65 74 73 63 61 6E 63 66 67 20 00 00 13 88 00 01 00 00 13 88 FF F9 22 30 00 22 55 10 21", "sAN mLMPsetscancfg 0 1388 1 1388 FFF92230 225510", "02 02 02 02 00 00 00 26 73 41 4E 20 6D 4C 4D 50 73 65 74 73 63 61 6E 63 66 67 20 00 00 00 13 88 00 01 00 00 13 88 FF F9 22 30 00 22 55 10 2D");
    // LMDscandatacfg write (channel 1, RSSI on, 8 bit, time on, every scan): [REC]
    write::<ScanDataConfig>("sWN LMDscandatacfg 01 00 1 0 0 00 00 0 0 0 1 +1", "02 02 02 02 00 00 00 20 73 57 4E 20 4C 4D 44 73 63 61 6E 64 61 74 61 63 66 67 20 01 00 01 00 00 00 00 00 00 00 01 00 01 42", "sWA LMDscandatacfg", "02 02 02 02 00 00 00 13 73 57 41 20 4C 4D 44 73 63 61 6E 64 61 74 61 63 66 67 20 4D");
    // LMDscandatacfg read: [REC]
    read::<ScanDataConfig>("sRN LMDscandatacfg", "02 02 02 02 00 00 00 12 73 52 4E 20 4C 4D 44 73 63 61 6E 64 61 74 61 63 66 67 67", "sRA LMDscandatacfg 1 0 1 0 0 0 0 0 0 0 1 1", "02 02 02 02 00 00 00 20 73 52 41 20 4C 4D 44 73 63 61 6E 64 61 74 61 63 66 67 20 01 00 01 00 00 00 00 00 00 00 01 00 01 48");
    // FREchoFilter (0 first, 1 all, 2 last): [REC] (MRS1104: no trailing blank in the reply)
    write::<EchoFilter>("sWN FREchoFilter 2", "02 02 02 02 00 00 00 12 73 57 4E 20 46 52 45 63 68 6F 46 69 6C 74 65 72 20 02 7D", "sWA FREchoFilter", "02 02 02 02 00 00 00 10 73 57 41 20 46 52 45 63 68 6F 46 69 6C 74 65 72 50");
    // SetActiveApplications RANG on: [REC] (no trailing blank)
    write::<ActiveApplications>("sWN SetActiveApplications 1 RANG 1", "02 02 02 02 00 00 00 21 73 57 4E 20 53 65 74 41 63 74 69 76 65 41 70 70 6C 69 63 61 74 69 6F 6E 73 20 00 01 52 41 4E 47 01 37", "sWA SetActiveApplications", "02 02 02 02 00 00 00 19 73 57 41 20 53 65 74 41 63 74 69 76 65 41 70 70 6C 69 63 61 74 69 6F 6E 73 02");
    // LMCstartmeas: [REC] 0 = accepted
    call::<StartMeasurement>("sMN LMCstartmeas", "02 02 02 02 00 00 00 10 73 4D 4E 20 4C 4D 43 73 74 61 72 74 6D 65 61 73 68", "sAN LMCstartmeas 0", "02 02 02 02 00 00 00 12 73 41 4E 20 4C 4D 43 73 74 61 72 74 6D 65 61 73 20 00 44");
    // LMCstopmeas: [REC] 0 = accepted
    call::<StopMeasurement>("sMN LMCstopmeas", "02 02 02 02 00 00 00 0F 73 4D 4E 20 4C 4D 43 73 74 6F 70 6D 65 61 73 10", "sAN LMCstopmeas 0", "02 02 02 02 00 00 00 11 73 41 4E 20 4C 4D 43 73 74 6F 70 6D 65 61 73 20 00 3C");
    // LMCstandby: [CLI]
    call::<Standby>("sMN LMCstandby", "02 02 02 02 00 00 00 0E 73 4D 4E 20 4C 4D 43 73 74 61 6E 64 62 79 65", "sAN LMCstandby 0", "02 02 02 02 00 00 00 10 73 41 4E 20 4C 4D 43 73 74 61 6E 64 62 79 20 00 49");
    // Run (log out): [REC] 1 = ok
    call::<Run>("sMN Run", "02 02 02 02 00 00 00 07 73 4D 4E 20 52 75 6E 19", "sAN Run 1", "02 02 02 02 00 00 00 09 73 41 4E 20 52 75 6E 20 01 34");
    // mEEwriteall (save): [MAN] 1 = ok
    call::<WriteAll>("sMN mEEwriteall", "02 02 02 02 00 00 00 0F 73 4D 4E 20 6D 45 45 77 72 69 74 65 61 6C 6C 21", "sAN mEEwriteall 1", "02 02 02 02 00 00 00 11 73 41 4E 20 6D 45 45 77 72 69 74 65 61 6C 6C 20 01 0C");
    // mSCreboot: [CLI]; then the TCP connection drops
    call::<Reboot>("sMN mSCreboot", "02 02 02 02 00 00 00 0D 73 4D 4E 20 6D 53 43 72 65 62 6F 6F 74 2C", "sAN mSCreboot", "02 02 02 02 00 00 00 0E 73 41 4E 20 6D 53 43 72 65 62 6F 6F 74 20 00");
    // STlms: [MAN]; binary layout derived from the field types, not seen on the wire
    read::<Status>("sRN STlms", "02 02 02 02 00 00 00 09 73 52 4E 20 53 54 6C 6D 73 3A", "sRA STlms 7 0 8 00:00:00 8 01.01.06 0 0 0", "02 02 02 02 00 00 00 2D 73 52 41 20 53 54 6C 6D 73 20 00 07 00 00 08 30 30 3A 30 30 3A 30 30 00 08 30 31 2E 30 31 2E 30 36 00 00 00 00 00 00 00 00 00 00 00 00 14");
    // LCMstate (contamination): [MAN]
    read::<Contamination>("sRN LCMstate", "02 02 02 02 00 00 00 0C 73 52 4E 20 4C 43 4D 73 74 61 74 65 7A", "sRA LCMstate 0", "02 02 02 02 00 00 00 0E 73 52 41 20 4C 43 4D 73 74 61 74 65 20 00 55");
    // LMDscandata events on: [REC]
    subscribe("sEN LMDscandata 1", "02 02 02 02 00 00 00 11 73 45 4E 20 4C 4D 44 73 63 61 6E 64 61 74 61 20 01 33", "sEA LMDscandata 1", "02 02 02 02 00 00 00 11 73 45 41 20 4C 4D 44 73 63 61 6E 64 61 74 61 20 01 3C");
    // LMDscandata events off: [MAN]
    subscribe("sEN LMDscandata 0", "02 02 02 02 00 00 00 11 73 45 4E 20 4C 4D 44 73 63 61 6E 64 61 74 61 20 00 32", "sEA LMDscandata 0", "02 02 02 02 00 00 00 11 73 45 41 20 4C 4D 44 73 63 61 6E 64 61 74 61 20 00 3D");
    // LFErec events: [REC]
    subscribe("sEN LFErec 1", "02 02 02 02 00 00 00 0C 73 45 4E 20 4C 46 45 72 65 63 20 01 42", "sEA LFErec 1", "02 02 02 02 00 00 00 0C 73 45 41 20 4C 46 45 72 65 63 20 01 4D");
    // LIDoutputstate events: [REC]
    subscribe("sEN LIDoutputstate 1", "02 02 02 02 00 00 00 14 73 45 4E 20 4C 49 44 6F 75 74 70 75 74 73 74 61 74 65 20 01 50", "sEA LIDoutputstate 1", "02 02 02 02 00 00 00 14 73 45 41 20 4C 49 44 6F 75 74 70 75 74 73 74 61 74 65 20 01 5F");
    // LIDinputstate events: [REC]
    subscribe("sEN LIDinputstate 1", "02 02 02 02 00 00 00 13 73 45 4E 20 4C 49 44 69 6E 70 75 74 73 74 61 74 65 20 01 39", "sEA LIDinputstate 1", "02 02 02 02 00 00 00 13 73 45 41 20 4C 49 44 69 6E 70 75 74 73 74 61 74 65 20 01 36");
    // fieldNNN read (unused slot): [REC]
    read::<Field>("sRN field010", "02 02 02 02 00 00 00 0C 73 52 4E 20 66 69 65 6C 64 30 31 30 1C", "sRA field010 0", "02 02 02 02 00 00 00 0E 73 52 41 20 66 69 65 6C 64 30 31 30 20 00 33");
    // CLI, replies by their shape; LFPparticle's layout is not verified.
    write::<InputsThreeAndFour>("sWN DO3And4Fnc 1", "02 02 02 02 00 00 00 10 73 57 4E 20 44 4F 33 41 6E 64 34 46 6E 63 20 01 67", "sWA DO3And4Fnc", "02 02 02 02 00 00 00 0F 73 57 41 20 44 4F 33 41 6E 64 34 46 6E 63 20 69");
    write::<IncrementSource>("sWN LICsrc 1", "02 02 02 02 00 00 00 0C 73 57 4E 20 4C 49 43 73 72 63 20 01 4F", "sWA LICsrc", "02 02 02 02 00 00 00 0B 73 57 41 20 4C 49 43 73 72 63 20 41");
    write::<EncoderSetting>("sWN LICencset 1", "02 02 02 02 00 00 00 0F 73 57 4E 20 4C 49 43 65 6E 63 73 65 74 20 01 27", "sWA LICencset", "02 02 02 02 00 00 00 0E 73 57 41 20 4C 49 43 65 6E 63 73 65 74 20 29");
    write::<EncoderResolution>("sWN LICencres 1", "02 02 02 02 00 00 00 12 73 57 4E 20 4C 49 43 65 6E 63 72 65 73 20 3F 80 00 00 9F", "sWA LICencres", "02 02 02 02 00 00 00 0E 73 57 41 20 4C 49 43 65 6E 63 72 65 73 20 2F");
    write::<MeanFilter>("sWN LFPmeanfilter 1 +2 0", "02 02 02 02 00 00 00 16 73 57 4E 20 4C 46 50 6D 65 61 6E 66 69 6C 74 65 72 20 01 00 02 00 34", "sWA LFPmeanfilter", "02 02 02 02 00 00 00 12 73 57 41 20 4C 46 50 6D 65 61 6E 66 69 6C 74 65 72 20 38");
    write::<ParticleFilter>("sWN LFPparticle 1 +500", "02 02 02 02 00 00 00 13 73 57 4E 20 4C 46 50 70 61 72 74 69 63 6C 65 20 01 01 F4 D0", "sWA LFPparticle", "02 02 02 02 00 00 00 10 73 57 41 20 4C 46 50 70 61 72 74 69 63 6C 65 20 2B");
    write::<TimeRole>("sWN TSCRole 1", "02 02 02 02 00 00 00 0D 73 57 4E 20 54 53 43 52 6F 6C 65 20 01 1B", "sWA TSCRole", "02 02 02 02 00 00 00 0C 73 57 41 20 54 53 43 52 6F 6C 65 20 15");
    write::<TimeInterface>("sWN TSCTCInterface 0", "02 02 02 02 00 00 00 14 73 57 4E 20 54 53 43 54 43 49 6E 74 65 72 66 61 63 65 20 00 7C", "sWA TSCTCInterface", "02 02 02 02 00 00 00 13 73 57 41 20 54 53 43 54 43 49 6E 74 65 72 66 61 63 65 20 73");
    write::<TimeServer>("sWN TSCTCSrvAddr C0 A8 00 64", "02 02 02 02 00 00 00 15 73 57 4E 20 54 53 43 54 43 53 72 76 41 64 64 72 20 C0 A8 00 64 51", "sWA TSCTCSrvAddr", "02 02 02 02 00 00 00 11 73 57 41 20 54 53 43 54 43 53 72 76 41 64 64 72 20 52");
    write::<TimeUpdate>("sWN TSCTCupdatetime A", "02 02 02 02 00 00 00 18 73 57 4E 20 54 53 43 54 43 75 70 64 61 74 65 74 69 6D 65 20 00 00 00 0A 37", "sWA TSCTCupdatetime", "02 02 02 02 00 00 00 14 73 57 41 20 54 53 43 54 43 75 70 64 61 74 65 74 69 6D 65 20 32");
    write::<IpAddress>("sWN EIIpAddr C0 A8 00 01", "02 02 02 02 00 00 00 11 73 57 4E 20 45 49 49 70 41 64 64 72 20 C0 A8 00 01 05", "sWA EIIpAddr", "02 02 02 02 00 00 00 0D 73 57 41 20 45 49 49 70 41 64 64 72 20 63");
}
