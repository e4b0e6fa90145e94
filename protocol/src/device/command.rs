//! The commands a device knows: one line each, and the rules they share.
//!
//! A command is its telegram (a file in [`crate::telegram`]), its effect (a trait of this file, implemented in [`super::effect`])
//! and a line in [`COMMANDS`].

use alloc::vec::Vec;

use super::Device;
use super::session::Access;
use crate::telegram::wire::{Fields, Writer};
use crate::telegram::{Args, Kind, Method, SopasError, Telegram, Variable, encode, encode_empty};
use crate::telegram::{
    device_ident, ee_writeall, eihst_cola, field_nnn, firmware_version, fr_echo_filter, lcm_state, lfe_rec,
    lid_inputstate, lid_outputstate, lmc_meas, lmd_scandata, lmd_scandatacfg, lmp_output_range, lmp_scancfg,
    location_name, lsp_datetime, od_oprh, od_pwrc, run, sc_reboot, scdevicestate, serial_number,
    set_access_mode, stlms,
};
use crate::time::SimTime;

/// The user level writes and most methods need.
const CLIENT: u8 = 3;
/// The user level everybody has.
const EVERYBODY: u8 = 1;

/// One line a command.
static COMMANDS: &[Command] = &[
    read_only::<device_ident::DeviceIdent>(),
    read_only::<firmware_version::FirmwareVersion>(),
    read_only::<lcm_state::Contamination>(),
    read_only::<lid_inputstate::InputState>().subscribable(Event::InputState),
    read_only::<lid_outputstate::OutputStates>().subscribable(Event::OutputState),
    read_only::<lmp_scancfg::ScanConfig>(),
    read_only::<lsp_datetime::CurrentDateTime>(),
    read_only::<od_oprh::OperatingHours>(),
    read_only::<od_pwrc::PowerOnCount>(),
    read_only::<scdevicestate::DeviceState>(),
    read_only::<serial_number::SerialNumber>(),
    read_only::<stlms::Status>(),
    variable::<eihst_cola::HostDialect>(),
    variable::<fr_echo_filter::EchoFilter>(),
    variable::<lmd_scandatacfg::ScanDataConfig>(),
    variable::<lmp_output_range::OutputRange>(),
    variable::<location_name::LocationName>(),
    method::<ee_writeall::WriteAll>(CLIENT),
    method::<lmc_meas::Standby>(CLIENT),
    method::<lmc_meas::StartMeasurement>(CLIENT),
    method::<lmc_meas::StopMeasurement>(CLIENT),
    method::<lmp_scancfg::SetScanConfig>(CLIENT),
    method::<lsp_datetime::SetDateTime>(CLIENT),
    method::<run::Run>(EVERYBODY),
    method::<sc_reboot::Reboot>(CLIENT),
    method::<set_access_mode::SetAccessMode>(EVERYBODY),
    named(lmd_scandata::LmdScandata::NAME).readable(read_last_scan).subscribable(Event::ScanData),
    named(lfe_rec::FieldResults::NAME).subscribable(Event::FieldResult),
];

/// What a session can subscribe to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    ScanData,
    FieldResult,
    InputState,
    OutputState,
}

/// All a command may read and change.
pub(super) struct Context<'a> {
    pub(super) device: &'a mut Device,
    pub(super) access: &'a mut Access,
    pub(super) now: SimTime,
}

/// A variable's value, as the device has it now.
pub(super) trait Readable: Variable {
    fn get(context: &Context<'_>) -> Self;
}

/// What writing a variable does.
pub(super) trait Writable: Readable {
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError>;
}

/// What calling a method does.
pub(super) trait Callable: Method {
    fn call(self, context: &mut Context<'_>) -> Result<Self::Reply, SopasError>;
}

type Read = fn(&Context<'_>, &mut Writer<'_>) -> Result<(), SopasError>;
type Write = fn(&mut Context<'_>, Args<'_>) -> Result<(), SopasError>;
type Call = fn(&mut Context<'_>, Args<'_>, &mut Vec<u8>) -> Result<(), SopasError>;

struct Command {
    name: &'static str,
    read: Option<Read>,
    write: Option<Write>,
    call: Option<(u8, Call)>,
    event: Option<Event>,
}

const fn named(name: &'static str) -> Command {
    Command { name, read: None, write: None, call: None, event: None }
}

const fn read_only<V: Readable>() -> Command {
    named(V::NAME).readable(|context, writer| {
        V::get(context).write(writer);
        Ok(())
    })
}

const fn variable<V: Writable>() -> Command {
    Command { write: Some(|context, args| args.decode::<V>()?.set(context)), ..read_only::<V>() }
}

const fn method<M: Callable>(level: u8) -> Command {
    let call: Call = |context, args, out| {
        let reply = args.decode::<M>()?.call(context)?;
        let mut writer = Writer::begin(args.dialect, Kind::An, M::NAME, out);
        reply.write(&mut writer);
        writer.trailing_blank();
        Ok(())
    };
    Command { call: Some((level, call)), ..named(M::NAME) }
}

impl Command {
    const fn readable(self, read: Read) -> Self {
        Self { read: Some(read), ..self }
    }

    const fn subscribable(self, event: Event) -> Self {
        Self { event: Some(event), ..self }
    }
}

/// Does what `telegram` asks and appends the reply's payload.
pub(super) fn answer(context: &mut Context<'_>, telegram: &Telegram<'_>, out: &mut Vec<u8>) {
    let start = out.len();
    if let Err(error) = try_answer(context, telegram, out) {
        out.truncate(start);
        refuse(telegram.args.dialect, error, out);
    }
}

/// Appends the payload of `sFA`.
pub(super) fn refuse(dialect: crate::frame::Dialect, error: SopasError, out: &mut Vec<u8>) {
    encode(dialect, Kind::Fa, "", &error.code(), out);
}

fn try_answer(
    context: &mut Context<'_>,
    telegram: &Telegram<'_>,
    out: &mut Vec<u8>,
) -> Result<(), SopasError> {
    let Telegram { kind, name, args } = *telegram;
    let command = COMMANDS.iter().find(|command| command.name == name);
    match kind {
        Kind::Rn if command.is_none() => read_field(context, name, args, out),
        Kind::Rn => {
            let read = command.and_then(|command| command.read).ok_or(SopasError::UnknownVariable)?;
            read(context, &mut Writer::begin(args.dialect, Kind::Ra, name, out))
        }
        Kind::Ri if name == device_ident::INDEX => {
            let ident = device_ident::DeviceIdent::get(context);
            encode(args.dialect, Kind::Ra, name, &ident, out);
            Ok(())
        }
        Kind::Ri => Err(SopasError::UnknownVariable),
        Kind::Wn => {
            let command =
                command.filter(|command| command.read.is_some()).ok_or(SopasError::UnknownVariable)?;
            let write = command.write.ok_or(SopasError::WriteAccessDenied)?;
            if context.access.level < CLIENT {
                return Err(SopasError::WriteAccessDenied);
            }
            write(context, args)?;
            let blank = !context.device.model.replies_without_blank.contains(&name);
            encode_empty(args.dialect, Kind::Wa, name, blank, out);
            Ok(())
        }
        Kind::Mn => {
            let (level, call) = command.and_then(|command| command.call).ok_or(SopasError::UnknownMethod)?;
            if context.access.level < level {
                return Err(SopasError::MethodAccessDenied);
            }
            call(context, args, out)
        }
        Kind::En => {
            let event = command.and_then(|command| command.event).ok_or(SopasError::UnknownEvent)?;
            let on = args.decode::<bool>()?;
            context.access.subscribe(event, on);
            encode(args.dialect, Kind::Ea, name, &on, out);
            Ok(())
        }
        Kind::Ra | Kind::Wa | Kind::Ma | Kind::An | Kind::Ea | Kind::Sn | Kind::Fa => {
            Err(SopasError::UnknownColaCommand)
        }
    }
}

fn read_last_scan(context: &Context<'_>, writer: &mut Writer<'_>) -> Result<(), SopasError> {
    let scan = context.device.last_scan().ok_or(SopasError::LocalConditionFailed)?;
    scan.write(writer);
    Ok(())
}

/// Every evaluation field is unused.
fn read_field(
    context: &Context<'_>,
    name: &str,
    args: Args<'_>,
    out: &mut Vec<u8>,
) -> Result<(), SopasError> {
    let slot = field_nnn::slot(name).ok_or(SopasError::UnknownVariable)?;
    if slot >= context.device.model.fields {
        return Err(SopasError::UnknownVariable);
    }
    encode(args.dialect, Kind::Ra, name, &field_nnn::Field::unused(args.dialect), out);
    Ok(())
}
