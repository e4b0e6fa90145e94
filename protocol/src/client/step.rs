//! The start-up, one line a step, in the order of the table.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use super::config::{ColaConfig, Login};
use crate::frame::{self, Dialect};
use crate::leftover::{LEFTOVERS, Leftover};
use crate::model::{self, RemissionWidth};
use crate::rig::EchoChoice;
use crate::telegram::device_ident::DeviceIdent;
use crate::telegram::firmware_version::FirmwareVersion;
use crate::telegram::fr_echo_filter::{self, EchoFilter};
use crate::telegram::lic_encoder::{
    self, EncoderResolution, EncoderSetting, IncrementSource, InputsThreeAndFour,
};
use crate::telegram::lmc_meas::{ACCEPTED, StartMeasurement};
use crate::telegram::lmd_scandatacfg::{REMISSION_8_BIT, REMISSION_16_BIT, ScanDataConfig};
use crate::telegram::lmp_output_range::{OutputRange, Sector};
use crate::telegram::lmp_scancfg::{self, ScanConfig, SetScanConfig, SetScanConfigReply};
use crate::telegram::performance_profile_number::PerformanceProfileNumber;
use crate::telegram::run::Run;
use crate::telegram::scan_data_format::{self, ScanDataFormat};
use crate::telegram::set_access_mode::{PasswordHash, SetAccessMode};
use crate::telegram::wire::{Fields, LowHigh};
use crate::telegram::{Args, Kind, LmdScandata, Method, SopasError, Variable, encode_frame};

/// The start-up, in its order.
pub(super) fn start_up() -> impl Iterator<Item = Step> {
    let leftovers = LEFTOVERS.iter().flat_map(|row| [Step::look(row), Step::put_right(row)]);
    LOGIN_AND_MODE.iter().copied().chain(leftovers).chain(CONTENTS.iter().copied())
}

/// Who the device is, the login, and how it scans. Settings that others have left follow.
static LOGIN_AND_MODE: &[Step] = &[
    read::<DeviceIdent>(take_ident),
    read::<FirmwareVersion>(take_firmware),
    call::<SetAccessMode>(log_in, take_yes),
    call::<SetScanConfig>(set_scan_mode, take_scan_mode)
        .only_if(|plan| plan.config.scan_mode.is_some() && compact_model(plan).is_none())
        .slow(),
    write::<PerformanceProfileNumber>(set_profile).only_if(|plan| profile(plan).is_some()).slow(),
    write::<ScanDataFormat>(set_format).only_if(|plan| compact_model(plan).is_some()),
];

/// What scans hold, and their begin.
static CONTENTS: &[Step] = &[
    read::<OutputRange>(take_step).only_if(|plan| plan.config.output_range.is_some()),
    write::<OutputRange>(set_output_range).only_if(|plan| plan.config.output_range.is_some()),
    write::<InputsThreeAndFour>(set_encoder_inputs).only_if(wants_encoder).where_known(),
    write::<EncoderSetting>(set_encoder).only_if(wants_encoder),
    write::<IncrementSource>(set_increments).only_if(wants_encoder),
    write::<EncoderResolution>(set_encoder_resolution).only_if(wants_encoder),
    read::<EchoFilter>(take_echo_filter).only_if(may_have_echo_filter).where_known(),
    Step { take: take_written_echo, ..write::<EchoFilter>(set_echo_filter) }
        .only_if(wants_echo_filter)
        .where_known(),
    write::<ScanDataConfig>(set_scan_data),
    call::<StartMeasurement>(|_, dialect, out| ask::<StartMeasurement>(dialect, out), take_accepted).slow(),
    call::<Run>(|_, dialect, out| ask::<Run>(dialect, out), take_yes),
    subscribe(true),
];

/// The clean stop.
pub(super) static STOP: Step = subscribe(false);

/// One request and what is made of its reply.
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub(super) command: &'static str,
    /// The reply this step waits for.
    pub(super) reply_kind: Kind,
    needed: fn(&Plan) -> bool,
    /// Appends the whole request frame.
    request: Request,
    /// Takes the reply; an error counts like `sFA`.
    take: Take,
    /// The setting that it reads or puts right.
    leftover: Option<&'static Leftover>,
    /// The start-up cannot go on if it is refused.
    pub(super) required: bool,
    /// Models that do not know it need it not; their refusal is no news.
    pub(super) where_known: bool,
    /// Reply time-outs it is given.
    pub(super) patience: u32,
}

/// What the steps share.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    pub(super) config: ColaConfig,
    /// DeviceIdent: name and version.
    pub(super) ident: String,
    /// FirmwareVersion, without the blanks devices pad it with.
    pub(super) firmware: String,
    /// The angular step LMPoutputRange reads; it must be sent back with a new range.
    pub(super) output_step: u32,
    /// The telegram that puts the leftover right which was read last.
    pub(super) put_right: Option<Vec<u8>>,
    /// The code of the echo filter, once it was read, or another was written.
    pub(super) echo_filter: Option<u8>,
}

type Request = fn(&Plan, Dialect, &mut Vec<u8>);
type Take = fn(&mut Plan, Args<'_>) -> Result<(), SopasError>;

const fn step(command: &'static str, reply_kind: Kind, request: Request, take: Take) -> Step {
    Step {
        command,
        reply_kind,
        needed: |_| true,
        request,
        take,
        leftover: None,
        required: false,
        where_known: false,
        patience: 1,
    }
}

const fn read<V: Variable>(take: Take) -> Step {
    step(V::NAME, Kind::Ra, |_, dialect, out| encode_frame(dialect, Kind::Rn, V::NAME, &(), out), take)
}

const fn write<V: Variable>(request: Request) -> Step {
    step(V::NAME, Kind::Wa, request, |_, _| Ok(()))
}

const fn call<M: Method>(request: Request, take: Take) -> Step {
    step(M::NAME, Kind::An, request, take)
}

const fn subscribe(on: bool) -> Step {
    let request: Request = match on {
        true => |_, dialect, out| encode_frame(dialect, Kind::En, LmdScandata::NAME, &true, out),
        false => |_, dialect, out| encode_frame(dialect, Kind::En, LmdScandata::NAME, &false, out),
    };
    Step { required: true, ..step(LmdScandata::NAME, Kind::Ea, request, |_, _| Ok(())) }
}

impl Step {
    /// Reads a setting that others may have left.
    fn look(row: &'static Leftover) -> Self {
        let nothing: Request = |_, _, _| {};
        Self { leftover: Some(row), ..step(row.name, Kind::Ra, nothing, |_, _| Ok(())) }.where_known()
    }

    /// Puts it right, if need be.
    fn put_right(row: &'static Leftover) -> Self {
        Self { reply_kind: Kind::Wa, where_known: false, ..Self::look(row) }
    }

    fn looks(&self) -> bool {
        self.reply_kind == Kind::Ra
    }

    pub(super) fn is_needed(&self, plan: &Plan) -> bool {
        match self.leftover {
            None => (self.needed)(plan),
            Some(_) if !self.looks() => plan.put_right.is_some(),
            // A range that is asked for is written anyway.
            Some(row) if row.name == OutputRange::NAME && plan.config.output_range.is_some() => false,
            Some(row) => Leftover::of(known_model(plan)).any(|other| other == row),
        }
    }

    /// Appends the whole request frame.
    pub(super) fn request(&self, plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
        match self.leftover {
            None => (self.request)(plan, dialect, out),
            Some(row) if self.looks() => encode_frame(dialect, Kind::Rn, row.name, &(), out),
            Some(_) => frame::encode(dialect, plan.put_right.as_deref().unwrap_or_default(), out),
        }
    }

    /// Takes the reply; an error counts like `sFA`.
    pub(super) fn take(&self, plan: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
        match self.leftover.filter(|_| self.looks()) {
            None => (self.take)(plan, args),
            Some(row) => {
                plan.put_right = row.put_right(known_model(plan), args)?;
                Ok(())
            }
        }
    }

    /// The setting that was to be put right by this; that is over, whatever the reply was.
    pub(super) fn was_to_put_right(&self, plan: &mut Plan) -> Option<&'static Leftover> {
        let row = self.leftover.filter(|_| !self.looks())?;
        plan.put_right = None;
        Some(row)
    }

    const fn only_if(self, needed: fn(&Plan) -> bool) -> Self {
        Self { needed, ..self }
    }

    const fn where_known(self) -> Self {
        Self { where_known: true, ..self }
    }

    const fn slow(self) -> Self {
        Self { patience: 5, ..self }
    }
}

/// A method without arguments.
fn ask<M: Method>(dialect: Dialect, out: &mut Vec<u8>) {
    tell(dialect, &M::default(), out);
}

fn tell<M: Method>(dialect: Dialect, method: &M, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Mn, M::NAME, method, out);
}

fn set<V: Variable>(dialect: Dialect, value: &V, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Wn, V::NAME, value, out);
}

fn log_in(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    let login = plan.config.login.unwrap_or_else(|| Login::for_ident(&plan.ident));
    tell(dialect, &SetAccessMode { level: login.level, password: PasswordHash(login.password) }, out);
}

/// The angles are ignored by the devices known here and must be sent: zero to 180° is inside every model's range.
fn set_scan_mode(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    let mode = plan.config.scan_mode;
    let step = mode.map_or(0, |mode| u32::from(mode.step));
    let sectors = vec![Sector { step, start: 0, stop: 1_800_000 }];
    let frequency_centihz = mode.map_or(0, |mode| mode.frequency_centihz);
    tell(dialect, &SetScanConfig { config: ScanConfig { frequency_centihz, sectors } }, out);
}

/// The device's model. Models that share a name are alike in their field and in what they know.
fn known_model(plan: &Plan) -> Option<&'static model::Model> {
    model::by_ident(&plan.ident).next()
}

/// The device's model, if it is one that sends scans as Compact telegrams unless it is told otherwise.
fn compact_model(plan: &Plan) -> Option<&'static model::Model> {
    known_model(plan).filter(|model| model.compact.is_some())
}

/// The number of the scan mode that is wanted.
fn profile(plan: &Plan) -> Option<u8> {
    compact_model(plan)?.profile(plan.config.scan_mode?)
}

fn set_profile(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    set(dialect, &PerformanceProfileNumber { number: profile(plan).unwrap_or_default() }, out);
}

fn set_format(_: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    set(dialect, &ScanDataFormat { code: scan_data_format::LMD_SCANDATA }, out);
}

fn set_output_range(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    let (start, stop) = plan.config.output_range.unwrap_or_default();
    set(dialect, &OutputRange { sectors: vec![Sector { step: plan.output_step, start, stop }] }, out);
}

fn set_scan_data(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    let config = &plan.config;
    let contents = ScanDataConfig {
        channels: LowHigh((1 << config.echoes.clamp(1, 5)) - 1),
        remission: u8::from(config.remission),
        resolution: match config.remission_width {
            RemissionWidth::Bits8 => REMISSION_8_BIT,
            RemissionWidth::Bits16 => REMISSION_16_BIT,
        },
        encoders: LowHigh(u16::from(wants_encoder(plan))),
        output_rate: config.output_rate.max(1),
        ..ScanDataConfig::default()
    };
    set(dialect, &contents, out);
}

/// True of a device that may count in its scans. One with Compact output counts beside them: it would refuse the contents as a whole, and
/// with the encoder the remission.
fn wants_encoder(plan: &Plan) -> bool {
    plan.config.encoder_ticks_per_m.is_some() && known_model(plan).is_none_or(|model| model.encoders > 0)
}

/// The filter's code for what is wanted; several echoes need all of them.
fn echo_code(config: &ColaConfig) -> Option<u8> {
    match config.echo? {
        _ if config.echoes > 1 => Some(fr_echo_filter::ALL),
        EchoChoice::First => Some(fr_echo_filter::FIRST),
        EchoChoice::Last => Some(fr_echo_filter::LAST),
    }
}

/// Whether the filter of echoes is to be looked at: one echo is wanted, of a device that may tell several apart.
fn may_have_echo_filter(plan: &Plan) -> bool {
    plan.config.echo.is_some() && known_model(plan).is_none_or(|model| model.echoes > 1)
}

/// True of a device that would send another echo, by itself or because somebody has left it so. Where all are sent, the first channel holds the first.
fn wants_echo_filter(plan: &Plan) -> bool {
    let suffices =
        |code, found| code == found || (code, found) == (fr_echo_filter::FIRST, fr_echo_filter::ALL);
    echo_code(&plan.config).zip(plan.echo_filter).is_some_and(|(code, found)| !suffices(code, found))
}

fn take_echo_filter(plan: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    plan.echo_filter = Some(value::<EchoFilter>(args)?.code);
    Ok(())
}

fn take_written_echo(plan: &mut Plan, _: Args<'_>) -> Result<(), SopasError> {
    plan.echo_filter = echo_code(&plan.config);
    Ok(())
}

fn set_echo_filter(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    set(dialect, &EchoFilter { code: echo_code(&plan.config).unwrap_or(fr_echo_filter::FIRST) }, out);
}

/// An LMS5xx takes its encoder at inputs 3 and 4; other models refuse this, and keep what they have.
fn set_encoder_inputs(_: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    set(dialect, &InputsThreeAndFour { encoder: true }, out);
}

/// Two tracks: the count goes back when the tractor does.
fn set_encoder(_: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    set(dialect, &EncoderSetting { code: lic_encoder::PHASE }, out);
}

fn set_increments(_: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    set(dialect, &IncrementSource { code: lic_encoder::ENCODER }, out);
}

fn set_encoder_resolution(plan: &Plan, dialect: Dialect, out: &mut Vec<u8>) {
    let ticks_per_m = plan.config.encoder_ticks_per_m.unwrap_or_default();
    set(dialect, &EncoderResolution { ticks_per_mm: ticks_per_m as f32 / 1000.0 }, out);
}

fn value<T: Fields + Default>(args: Args<'_>) -> Result<T, SopasError> {
    args.decode().map_err(SopasError::from)
}

fn take_ident(plan: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    let DeviceIdent { name, version } = value(args)?;
    plan.ident = format!("{} {}", name.trim(), version.trim());
    Ok(())
}

fn take_firmware(plan: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    plan.firmware = String::from(value::<FirmwareVersion>(args)?.text.trim());
    Ok(())
}

fn take_yes(_: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    if value(args)? { Ok(()) } else { Err(SopasError::MethodAccessDenied) }
}

fn take_accepted(_: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    if value::<u8>(args)? == ACCEPTED { Ok(()) } else { Err(SopasError::LocalConditionFailed) }
}

fn take_scan_mode(_: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    let reply: SetScanConfigReply = value(args)?;
    if reply.code == lmp_scancfg::OK { Ok(()) } else { Err(SopasError::LocalConditionFailed) }
}

fn take_step(plan: &mut Plan, args: Args<'_>) -> Result<(), SopasError> {
    let range: OutputRange = value(args)?;
    plan.output_step = range.sectors.first().ok_or(SopasError::InvalidData)?.step;
    Ok(())
}
