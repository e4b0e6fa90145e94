//! What the scanner is, and how it is.

use alloc::format;

use crate::device::context::{Context, Readable, Writable};
use crate::device::refusal::Fault;
use crate::telegram::device_ident::DeviceIdent;
use crate::telegram::firmware_version::FirmwareVersion;
use crate::telegram::lcm_state::Contamination;
use crate::telegram::location_name::LocationName;
use crate::telegram::od_oprh::{HoursSincePowerUp, OperatingHours};
use crate::telegram::od_pwrc::PowerOnCount;
use crate::telegram::ord_num::{OrderNumber, TypeCode};
use crate::telegram::scdevicestate::DeviceState;
use crate::telegram::serial_number::SerialNumber;
use crate::telegram::stlms::Status;
use crate::telegram::wire::FlexString;
use crate::telegram::{DateTime, SopasError};

/// µs in a tenth of an hour.
const US_PER_TENTH_HOUR: u64 = 360_000_000;
/// Longest location name; the scan telegram has room for as many.
const MAX_LOCATION_NAME: usize = 16;

impl Readable for DeviceIdent {
    fn get(context: &Context<'_>) -> Self {
        let (model, identity) = (context.device.model, &context.device.identity);
        let own = (model.ident_name, model.ident_version);
        let (name, version) =
            identity.ident.as_ref().map_or(own, |(name, version)| (name.as_str(), version.as_str()));
        Self { name: name.into(), version: version.into() }
    }
}

impl Readable for FirmwareVersion {
    fn get(context: &Context<'_>) -> Self {
        let own = context.device.model.firmware;
        Self { text: context.device.identity.firmware.as_deref().unwrap_or(own).into() }
    }
}

impl Readable for SerialNumber {
    fn get(context: &Context<'_>) -> Self {
        Self { text: FlexString(format!("{:08}", context.device.identity.serial_number)) }
    }
}

/// Tenths of an hour since power-up.
pub(super) fn on_for(context: &Context<'_>) -> u32 {
    (context.device.uptime_us(context.now) / US_PER_TENTH_HOUR) as u32
}

impl Readable for OperatingHours {
    fn get(context: &Context<'_>) -> Self {
        Self { tenths: context.device.identity.operating_hours.wrapping_add(on_for(context)) }
    }
}

impl Readable for HoursSincePowerUp {
    fn get(context: &Context<'_>) -> Self {
        Self { tenths: on_for(context) }
    }
}

impl Readable for PowerOnCount {
    fn get(context: &Context<'_>) -> Self {
        Self { count: context.device.identity.power_on_count }
    }
}

impl Readable for LocationName {
    fn get(context: &Context<'_>) -> Self {
        Self { text: context.device.settings.location_name.as_str().into() }
    }
}

impl Writable for LocationName {
    fn set(self, context: &mut Context<'_>) -> Result<(), SopasError> {
        if self.text.chars().count() > MAX_LOCATION_NAME {
            return Err(Fault::TextTooLong.into());
        }
        context.device.settings.location_name = self.text.0;
        Ok(())
    }
}

impl Readable for OrderNumber {
    fn get(context: &Context<'_>) -> Self {
        Self { text: context.device.model.order_number.into() }
    }
}

impl Readable for TypeCode {
    fn get(context: &Context<'_>) -> Self {
        Self { text: context.device.model.type_code.into() }
    }
}

impl Readable for Contamination {
    fn get(context: &Context<'_>) -> Self {
        Self { level: context.device.contamination() }
    }
}

impl Readable for DeviceState {
    /// Ready means that scans come: a session that is logged in reads busy, as recorded.
    fn get(context: &Context<'_>) -> Self {
        Self { state: context.device.device_state(context.now, context.access.level > 1) }
    }
}

impl Readable for Status {
    fn get(context: &Context<'_>) -> Self {
        let DateTime { year, month, day, hour, minute, second, .. } = context.device.date_time(context.now);
        Self {
            state: context.device.status(context.now),
            temperature: u8::from(context.device.temperature_fails()),
            time: FlexString(format!("{hour:02}:{minute:02}:{second:02}")),
            date: FlexString(format!("{day:02}.{month:02}.{:02}", year % 100)),
            lamps: [0; 3],
        }
    }
}
