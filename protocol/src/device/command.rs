//! The commands a device knows: one line each, and the rules they share.
//!
//! A command is its telegram (a file in [`crate::telegram`]), its effect (a trait of this file, implemented in [`super::effect`])
//! and a line in [`COMMANDS`].

use alloc::vec::Vec;

use super::Device;
use super::refusal::Fault;
use super::session::Access;
use crate::telegram::wire::{Fields, Writer};
use crate::telegram::{Args, Kind, Method, SopasError, Telegram, Variable, encode, encode_empty};
use crate::telegram::{
    device_ident, ee_writeall, ei_address, eihst_cola, field_nnn, firmware_version, fr_echo_filter,
    lcm_state, lfe_rec, lfp_filter, lic_encoder, lid_inputstate, lid_outputstate, lmc_meas, lmd_scandata,
    lmd_scandatacfg, lmp_output_range, lmp_scancfg, location_name, lsp_datetime, od_oprh, od_pwrc, ord_num,
    run, sc_reboot, scdevicestate, serial_number, set_access_mode, set_active_applications, stlms,
    tsc_time_client,
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
    read_only::<lfe_rec::FieldResults>().subscribable(Event::FieldResult),
    read_only::<lid_inputstate::InputState>().subscribable(Event::InputState),
    read_only::<lid_outputstate::OutputStates>().subscribable(Event::OutputState),
    read_only::<lmp_scancfg::ScanConfig>(),
    read_only::<lsp_datetime::CurrentDateTime>(),
    read_only::<od_oprh::OperatingHours>(),
    read_only::<od_pwrc::PowerOnCount>(),
    read_only::<ord_num::OrderNumber>(),
    read_only::<ord_num::TypeCode>(),
    read_only::<scdevicestate::DeviceState>(),
    read_only::<serial_number::SerialNumber>(),
    read_only::<stlms::Status>(),
    variable::<eihst_cola::HostDialect>(),
    variable::<fr_echo_filter::EchoFilter>(),
    variable::<lfp_filter::MeanFilter>(),
    variable::<lfp_filter::MedianFilter>(),
    variable::<lfp_filter::ParticleFilter>(),
    variable::<lic_encoder::EncoderResolution>(),
    variable::<lic_encoder::EncoderSetting>(),
    variable::<lic_encoder::IncrementSource>(),
    variable::<lic_encoder::InputsThreeAndFour>(),
    variable::<lmd_scandatacfg::ScanDataConfig>(),
    variable::<lmp_output_range::OutputRange>(),
    variable::<location_name::LocationName>(),
    variable::<set_active_applications::ActiveApplications>(),
    fixed::<ei_address::Gateway>(),
    fixed::<ei_address::IpAddress>(),
    fixed::<ei_address::NetworkMask>(),
    fixed::<tsc_time_client::TimeInterface>(),
    fixed::<tsc_time_client::TimeRole>(),
    fixed::<tsc_time_client::TimeServer>(),
    fixed::<tsc_time_client::TimeUpdate>(),
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
    named(lmd_scandata::MONITOR).subscribable(Event::Monitor),
];

/// The variables that a client may write. Those that nothing could change here take the value in force only.
pub fn writable() -> impl Iterator<Item = &'static str> {
    COMMANDS.iter().filter(|command| command.write.is_some()).map(|command| command.name)
}

/// What a session can subscribe to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Every scan.
    ScanData,
    /// The same scans under the monitor's name.
    Monitor,
    /// The result of an evaluation field.
    FieldResult,
    /// A digital input has changed.
    InputState,
    /// A digital output has changed.
    OutputState,
}

impl Event {
    /// The event that is told under `name`.
    pub fn by_name(name: &str) -> Option<Self> {
        COMMANDS.iter().find(|command| command.name == name).and_then(|command| command.event)
    }
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

/// A variable that exists and that nothing here could change: only the value in force is accepted.
const fn fixed<V: Readable + PartialEq>() -> Command {
    let write: Write = |context, args| match args.decode::<V>()? == V::get(context) {
        true => Ok(()),
        false => Err(Fault::FixedHere.into()),
    };
    Command { write: Some(write), ..read_only::<V>() }
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
    let command = known(context.device, name);
    match kind {
        Kind::Rn if command.is_none() => read_field(context, name, args, out),
        Kind::Rn => {
            let read = command.and_then(|command| command.read).ok_or(Fault::NoVariable)?;
            read(context, &mut Writer::begin(args.dialect, Kind::Ra, name, out))
        }
        Kind::Ri if name == device_ident::INDEX => {
            let ident = device_ident::DeviceIdent::get(context);
            encode(args.dialect, Kind::Ra, name, &ident, out);
            Ok(())
        }
        Kind::Ri => Err(Fault::NoVariable.into()),
        Kind::Wn => {
            let command = command.filter(|command| command.read.is_some()).ok_or(Fault::NoVariable)?;
            let write = command.write.ok_or(Fault::ReadOnly)?;
            if context.access.level < CLIENT {
                return Err(Fault::WriteWithoutLogin.into());
            }
            let before = context.device.settings.clone();
            write(context, args)?;
            context.device.keep_scans(before)?;
            let blank = !context.device.model.replies_without_blank.contains(&name);
            encode_empty(args.dialect, Kind::Wa, name, blank, out);
            Ok(())
        }
        Kind::Mn => {
            let (level, call) = command.and_then(|command| command.call).ok_or(Fault::NoMethod)?;
            if context.access.level < level {
                return Err(Fault::CallWithoutLogin.into());
            }
            call(context, args, out)
        }
        Kind::En => {
            let event = command.and_then(|command| command.event).ok_or(Fault::NoEvent)?;
            let on = args.decode::<bool>()?;
            context.access.subscribe(event, on);
            encode(args.dialect, Kind::Ea, name, &on, out);
            Ok(())
        }
        Kind::Ra | Kind::Wa | Kind::Ma | Kind::An | Kind::Ea | Kind::Sn | Kind::Fa => {
            Err(Fault::NoCommand.into())
        }
    }
}

/// The command called `name`, if this model has it.
fn known(device: &Device, name: &str) -> Option<&'static Command> {
    COMMANDS.iter().find(|command| command.name == name).filter(|_| !device.model.lacks.contains(&name))
}

/// Does what a line of saved settings says, as a logged-in client's write would.
pub(super) fn write_saved(context: &mut Context<'_>, name: &str, args: Args<'_>) -> Result<(), SopasError> {
    let write = known(context.device, name).and_then(|command| command.write);
    write.ok_or(Fault::NoVariable)?(context, args)
}

/// Appends the payload `sWN name value` that would set a variable to what it is now.
pub(super) fn read_saved(context: &Context<'_>, name: &str, out: &mut Vec<u8>) -> Result<(), SopasError> {
    let read = known(context.device, name).and_then(|command| command.read).ok_or(Fault::NoVariable)?;
    read(context, &mut Writer::begin(crate::frame::Dialect::A, Kind::Wn, name, out))
}

/// Appends the payload `sSN name value` of a variable that can be subscribed to.
pub(super) fn write_event(event: Event, context: &Context<'_>, out: &mut Vec<u8>) {
    let told = |command: &&Command| command.event == Some(event);
    if let Some(Command { name, read: Some(read), .. }) = COMMANDS.iter().find(told) {
        // No event is told before it has happened, so its value can be read.
        let _ = read(context, &mut Writer::begin(context.access.dialect, Kind::Sn, name, out));
    }
}

fn read_last_scan(context: &Context<'_>, writer: &mut Writer<'_>) -> Result<(), SopasError> {
    let scan = context.device.last_scan().ok_or(Fault::NoScanYet)?;
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
    let slot = field_nnn::slot(name).ok_or(Fault::NoVariable)?;
    if slot >= context.device.model.fields {
        return Err(Fault::NoVariable.into());
    }
    encode(args.dialect, Kind::Ra, name, &field_nnn::Field::unused(args.dialect), out);
    Ok(())
}
