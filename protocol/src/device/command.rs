//! All commands: one line each, with everything that is a fact about the command.
//!
//! A command is its telegram (a file in [`crate::telegram`]), its effect (a trait of `device::context`, implemented in `device::effect`)
//! and a line in [`COMMANDS`].

use alloc::format;
use alloc::vec::Vec;
use core::fmt;

use super::context::{Callable, Context, Readable, Writable};
use super::event::DeviceEvent;
use super::refusal::Fault;
use crate::telegram::wire::{Fields, WireError, Writer};
use crate::telegram::{Args, Kind, LmdScandata, Method, SopasError, Telegram, Variable};
use crate::telegram::{
    device_ident, ee_writeall, ei_address, eihst_cola, field_nnn, firmware_version, fr_echo_filter,
    inertial_measurement_unit, lcm_state, lfe_rec, lfp_filter, lic_encoder, lid_inputstate, lid_outputstate,
    lmc_meas, lmd_scandata, lmd_scandatacfg, lmp_autostartmeas, lmp_output_range, lmp_scancfg, location_name,
    lsp_datetime, ms_suppmode, od_oprh, od_pwrc, ord_num, run, sc_reboot, scan_layer_filter, scdevicestate,
    serial_number, set_access_mode, set_active_applications, stlms, tsc_time_client,
};
use crate::visit::{Group, Value, Visitor, one_field};

/// The user level most methods need.
const CLIENT: u8 = 3;
/// The user level everybody has.
const EVERYBODY: u8 = 1;

/// One line a command. Saved variables stand in the order in which they are written back.
pub static COMMANDS: &[Command] = &[
    read_only::<lmp_scancfg::ScanConfig>().saved(),
    variable::<eihst_cola::HostDialect>().saved(),
    variable::<lmd_scandatacfg::ScanDataConfig>().saved().replayed(),
    variable::<lmp_output_range::OutputRange>().saved(),
    variable::<fr_echo_filter::EchoFilter>().readable(read_echo_filter).saved().replayed(),
    variable::<scan_layer_filter::ScanLayerFilter>().saved().replayed(),
    variable::<lfp_filter::MeanFilter>().saved().replayed(),
    variable::<lfp_filter::MedianFilter>().saved().replayed(),
    variable::<lfp_filter::ParticleFilter>().saved().replayed(),
    variable::<ms_suppmode::SuppressionMode>().saved().replayed(),
    variable::<lic_encoder::InputsThreeAndFour>().saved().replayed(),
    variable::<lic_encoder::IncrementSource>().saved().replayed(),
    variable::<lic_encoder::EncoderSetting>().saved().replayed(),
    variable::<lic_encoder::EncoderResolution>().saved().replayed(),
    variable::<location_name::LocationName>().saved().replayed(),
    variable::<set_active_applications::ActiveApplications>().saved(),
    read_only::<device_ident::DeviceIdent>(),
    read_only::<firmware_version::FirmwareVersion>(),
    read_only::<lcm_state::Contamination>(),
    read_only::<lfe_rec::FieldResults>().subscribable(DeviceEvent::FieldResult),
    read_only::<lid_inputstate::InputState>().subscribable(DeviceEvent::InputState),
    read_only::<lid_outputstate::OutputStates>().subscribable(DeviceEvent::OutputState),
    read_only::<lsp_datetime::CurrentDateTime>().live(),
    read_only::<od_oprh::OperatingHours>(),
    read_only::<od_oprh::HoursSincePowerUp>(),
    read_only::<od_pwrc::PowerOnCount>(),
    read_only::<ord_num::OrderNumber>(),
    read_only::<ord_num::TypeCode>(),
    read_only::<scdevicestate::DeviceState>().live(),
    read_only::<serial_number::SerialNumber>(),
    read_only::<stlms::Status>().live(),
    fixed::<ei_address::Gateway>(),
    fixed::<ei_address::IpAddress>(),
    fixed::<ei_address::NetworkMask>(),
    fixed::<lmp_autostartmeas::StartsByItself>(),
    read_only::<tsc_time_client::TimeDelay>(),
    read_only::<tsc_time_client::TimeOffset>(),
    fixed::<tsc_time_client::TimeInterface>(),
    fixed::<tsc_time_client::TimeRole>(),
    fixed::<tsc_time_client::TimeServer>(),
    fixed::<tsc_time_client::TimeUpdate>(),
    fixed::<tsc_time_client::TimeZone>(),
    method::<ee_writeall::WriteAll>(CLIENT),
    method::<lmc_meas::Standby>(CLIENT),
    method::<lmc_meas::StartMeasurement>(CLIENT),
    method::<lmc_meas::StopMeasurement>(CLIENT),
    method::<lmp_scancfg::SetScanConfig>(CLIENT),
    method::<lsp_datetime::SetDateTime>(CLIENT),
    method::<run::Run>(EVERYBODY),
    method::<sc_reboot::Reboot>(CLIENT),
    method::<set_access_mode::SetAccessMode>(EVERYBODY),
    named::<lmd_scandata::LmdScandata>(lmd_scandata::LmdScandata::NAME)
        .readable(read_last_scan)
        .subscribable(DeviceEvent::ScanData)
        .live(),
    named::<lmd_scandata::LmdScandata>(lmd_scandata::MONITOR).subscribable(DeviceEvent::Monitor),
    named::<inertial_measurement_unit::InertialMeasurementUnit>(
        inertial_measurement_unit::InertialMeasurementUnit::NAME,
    ),
];

/// All evaluation fields share one line; see [`field_nnn::slot`].
static FIELD: Command = named::<field_nnn::Field>("fieldNNN");

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Role {
    /// Read, written, subscribed to.
    Variable,
    /// Called.
    Method,
}

pub(super) type Read = fn(&Context<'_>, &mut Writer<'_>) -> Result<(), SopasError>;
pub(super) type Write = fn(&mut Context<'_>, Args<'_>) -> Result<(), SopasError>;
pub(super) type Call = fn(&mut Context<'_>, Args<'_>, &mut Vec<u8>) -> Result<(), SopasError>;
type Visit = fn(Args<'_>, &mut dyn Visitor) -> Result<(), WireError>;

/// One command.
pub struct Command {
    /// The manual's name.
    pub name: &'static str,
    /// What it stands for.
    pub role: Role,
    /// The event that is sent under its name.
    pub event: Option<DeviceEvent>,
    /// mEEwriteall saves it.
    pub is_saved: bool,
    /// A replayed device starts with its recorded value.
    pub is_replayed: bool,
    /// It changes by itself: after the last recorded value, a replayed device answers with its own.
    pub is_live: bool,
    pub(super) read: Option<Read>,
    pub(super) write: Option<Write>,
    /// The user level it needs, and what it does.
    pub(super) call: Option<(u8, Call)>,
    /// The variable's value, or the method's arguments.
    arguments: Visit,
    /// The method's result.
    result: Visit,
}

impl fmt::Debug for Command {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Command").field("name", &self.name).field("role", &self.role).finish_non_exhaustive()
    }
}

/// The command called `name`.
pub fn by_name(name: &str) -> Option<&'static Command> {
    COMMANDS.iter().find(|command| command.name == name)
}

/// The command whose event this is.
pub(super) fn by_event(event: DeviceEvent) -> Option<&'static Command> {
    COMMANDS.iter().find(|command| command.event == Some(event))
}

/// The variables that a client may write. Those that nothing could change here take the value in force only.
pub fn writable() -> impl Iterator<Item = &'static str> {
    COMMANDS.iter().filter(|command| command.write.is_some()).map(|command| command.name)
}

impl DeviceEvent {
    /// The event that is sent under `name`.
    pub fn by_name(name: &str) -> Option<Self> {
        by_name(name).and_then(|command| command.event)
    }
}

/// Visits a telegram's arguments: always one struct. `None` for a name that is not in the table. Then, and after an error, the visitor was
/// not called.
pub fn visit(telegram: &Telegram<'_>, visitor: &mut dyn Visitor) -> Option<Result<(), WireError>> {
    if let Some(error) = telegram.refusal() {
        visitor.begin(Group::Struct);
        visitor.field("error", None);
        visitor.value(Value::Integer(error.code().into()));
        visitor.field("meaning", None);
        visitor.value(Value::Text(&format!("{error}")));
        visitor.end();
        return Some(Ok(()));
    }
    let name =
        if telegram.name == device_ident::INDEX { device_ident::DeviceIdent::NAME } else { telegram.name };
    let command = by_name(name).or_else(|| field_nnn::slot(name).map(|_| &FIELD))?;
    let args = telegram.args;
    Some(match telegram.kind {
        Kind::En | Kind::Ea => {
            args.decode::<bool>().map(|on| one_field(visitor, "on", |visitor| visitor.value(Value::Flag(on))))
        }
        Kind::Rn | Kind::Ri | Kind::Wa | Kind::Ma | Kind::Fa => visit_as::<()>(args, visitor),
        Kind::Ra | Kind::Wn | Kind::Sn | Kind::Mn => (command.arguments)(args, visitor),
        Kind::An => (command.result)(args, visitor),
    })
}

fn visit_as<T: Fields + Default>(args: Args<'_>, visitor: &mut dyn Visitor) -> Result<(), WireError> {
    args.decode::<T>().map(|value| value.visit(visitor))
}

/// A line for `name` with the value `V` that does nothing.
const fn named<V: Fields + Default>(name: &'static str) -> Command {
    Command {
        name,
        role: Role::Variable,
        event: None,
        is_saved: false,
        is_replayed: false,
        is_live: false,
        read: None,
        write: None,
        call: None,
        arguments: visit_as::<V>,
        result: visit_as::<()>,
    }
}

const fn read_only<V: Readable>() -> Command {
    named::<V>(V::NAME).readable(|context, writer| {
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
    Command { role: Role::Method, call: Some((level, call)), result: visit_reply::<M>, ..named::<M>(M::NAME) }
}

impl Command {
    const fn readable(self, read: Read) -> Self {
        Self { read: Some(read), ..self }
    }

    const fn subscribable(self, event: DeviceEvent) -> Self {
        Self { event: Some(event), ..self }
    }

    const fn saved(self) -> Self {
        Self { is_saved: true, ..self }
    }

    const fn replayed(self) -> Self {
        Self { is_replayed: true, ..self }
    }

    const fn live(self) -> Self {
        Self { is_live: true, ..self }
    }
}

/// A result is mostly one code or flag, which has no name of its own.
fn visit_reply<M: Method>(args: Args<'_>, visitor: &mut dyn Visitor) -> Result<(), WireError> {
    args.decode::<M::Reply>().map(|reply| match M::Reply::IS_STRUCT {
        true => reply.visit(visitor),
        false => one_field(visitor, "result", |visitor| reply.visit(visitor)),
    })
}

/// A replayed device whose recording does not tell says so.
fn read_echo_filter(context: &Context<'_>, writer: &mut Writer<'_>) -> Result<(), SopasError> {
    if context.device.lacks_the_echo() {
        return Err(Fault::EchoNotRecorded.into());
    }
    fr_echo_filter::EchoFilter::get(context).write(writer);
    Ok(())
}

fn read_last_scan(context: &Context<'_>, writer: &mut Writer<'_>) -> Result<(), SopasError> {
    let device = &*context.device;
    match device.last_scan() {
        Some(scan) if device.is_cut() => {
            let mut scan = scan.clone();
            device.cut_to_measure(&mut scan);
            scan.write(writer);
        }
        Some(scan) => scan.write(writer),
        None if device.model().zeros_before_first_scan => LmdScandata::default().write(writer),
        None => return Err(Fault::NoScanYet.into()),
    }
    Ok(())
}
