//! All telegrams this crate can take apart, and what a telegram says in words.

use alloc::format;
use alloc::string::String;

use super::wire::{Fields, WireError};
use super::{Args, Kind, Method, Telegram, Variable};
use super::{
    device_ident, ee_writeall, ei_address, eihst_cola, field_nnn, firmware_version, fr_echo_filter,
    lcm_state, lfe_rec, lfp_filter, lic_encoder, lid_inputstate, lid_outputstate, lmc_meas, lmd_scandata,
    lmd_scandatacfg, lmp_output_range, lmp_scancfg, location_name, lsp_datetime, od_oprh, od_pwrc, ord_num,
    run, sc_reboot, scdevicestate, serial_number, set_access_mode, set_active_applications, stlms,
    tsc_time_client,
};

/// What a name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Read, written, subscribed to.
    Variable,
    /// Called.
    Method,
}

/// One command.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// The manual's name.
    pub name: &'static str,
    /// What it stands for.
    pub role: Role,
    /// The variable's value, or the method's arguments, in words.
    words: fn(Args<'_>) -> Result<String, WireError>,
    /// The method's result in words.
    reply_words: fn(Args<'_>) -> Result<String, WireError>,
}

/// One line a command.
pub static TABLE: &[Entry] = &[
    variable::<device_ident::DeviceIdent>(),
    variable::<ei_address::Gateway>(),
    variable::<ei_address::IpAddress>(),
    variable::<ei_address::NetworkMask>(),
    variable::<eihst_cola::HostDialect>(),
    variable::<firmware_version::FirmwareVersion>(),
    variable::<fr_echo_filter::EchoFilter>(),
    variable::<lcm_state::Contamination>(),
    variable::<lfe_rec::FieldResults>(),
    variable::<lfp_filter::MeanFilter>(),
    variable::<lfp_filter::MedianFilter>(),
    variable::<lfp_filter::ParticleFilter>(),
    variable::<lic_encoder::EncoderResolution>(),
    variable::<lic_encoder::EncoderSetting>(),
    variable::<lic_encoder::IncrementSource>(),
    variable::<lic_encoder::InputsThreeAndFour>(),
    variable::<lid_inputstate::InputState>(),
    variable::<lid_outputstate::OutputStates>(),
    variable::<lmd_scandata::LmdScandata>(),
    variable::<lmd_scandatacfg::ScanDataConfig>(),
    variable::<lmp_output_range::OutputRange>(),
    variable::<lmp_scancfg::ScanConfig>(),
    variable::<location_name::LocationName>(),
    variable::<lsp_datetime::CurrentDateTime>(),
    variable::<od_oprh::OperatingHours>(),
    variable::<od_pwrc::PowerOnCount>(),
    variable::<ord_num::OrderNumber>(),
    variable::<ord_num::TypeCode>(),
    variable::<scdevicestate::DeviceState>(),
    variable::<serial_number::SerialNumber>(),
    variable::<set_active_applications::ActiveApplications>(),
    variable::<stlms::Status>(),
    variable::<tsc_time_client::TimeInterface>(),
    variable::<tsc_time_client::TimeRole>(),
    variable::<tsc_time_client::TimeServer>(),
    variable::<tsc_time_client::TimeUpdate>(),
    method::<ee_writeall::WriteAll>(),
    method::<lmc_meas::Standby>(),
    method::<lmc_meas::StartMeasurement>(),
    method::<lmc_meas::StopMeasurement>(),
    method::<lmp_scancfg::SetScanConfig>(),
    method::<lsp_datetime::SetDateTime>(),
    method::<run::Run>(),
    method::<sc_reboot::Reboot>(),
    method::<set_access_mode::SetAccessMode>(),
];

/// All evaluation fields share one line; see [`field_nnn::slot`].
static FIELD: Entry = Entry {
    name: "fieldNNN",
    role: Role::Variable,
    words: words::<field_nnn::Field>,
    reply_words: words::<()>,
};

const fn variable<V: Variable>() -> Entry {
    Entry { name: V::NAME, role: Role::Variable, words: words::<V>, reply_words: words::<()> }
}

const fn method<M: Method>() -> Entry {
    Entry { name: M::NAME, role: Role::Method, words: words::<M>, reply_words: words::<M::Reply> }
}

fn words<T: Fields + Default + core::fmt::Debug>(args: Args<'_>) -> Result<String, WireError> {
    args.decode::<T>().map(|value| format!("{value:?}"))
}

/// The line for a name.
pub fn entry(name: &str) -> Option<&'static Entry> {
    let name = match name {
        device_ident::INDEX => device_ident::DeviceIdent::NAME,
        lmd_scandata::MONITOR => lmd_scandata::LmdScandata::NAME,
        other => other,
    };
    TABLE.iter().find(|entry| entry.name == name).or_else(|| field_nnn::slot(name).map(|_| &FIELD))
}

/// What a telegram's arguments say, in words; none for a name that is not in the table.
pub fn in_words(telegram: &Telegram<'_>) -> Option<Result<String, WireError>> {
    let nothing = |args: Args<'_>| words::<()>(args).map(|_| String::new());
    if let Some(error) = telegram.refusal() {
        return Some(Ok(format!("{error}")));
    }
    let entry = entry(telegram.name)?;
    Some(match telegram.kind {
        Kind::En | Kind::Ea => words::<bool>(telegram.args),
        Kind::Rn | Kind::Ri | Kind::Wa | Kind::Ma | Kind::Fa => nothing(telegram.args),
        Kind::Ra | Kind::Wn | Kind::Sn | Kind::Mn => (entry.words)(telegram.args),
        Kind::An => (entry.reply_words)(telegram.args),
    })
}
