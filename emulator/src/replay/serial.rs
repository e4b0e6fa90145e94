//! A recorded LMS2xx: who it was, how it was set, what its values were measured with.

use rowscan_protocol::lms2xx::Variant;
use rowscan_protocol::lms2xx::configuration::Configuration;
use rowscan_protocol::lms2xx::settings_reply::SettingsReply;
use rowscan_protocol::lms2xx::values::Values;

/// What a recorded line tells of its device.
#[derive(Clone, Debug, Default)]
pub struct Lms2xxPart {
    pub(super) type_text: Option<String>,
    pub(super) variant: Option<Variant>,
    pub(super) found: Option<Configuration>,
    pub(super) measured: Option<Configuration>,
    /// The first telegram of values, without them.
    pub(super) values: Option<Values>,
}

impl Lms2xxPart {
    /// Takes the next telegram of the device; true if it carries values.
    pub(super) fn take(&mut self, body: &[u8]) -> bool {
        let mut values = Values::default();
        if values.decode_into(body).is_ok() {
            self.values.get_or_insert(values);
            return true;
        }
        match SettingsReply::parse(body) {
            Some(SettingsReply::Type(text)) => {
                self.type_text.get_or_insert(text.to_owned());
            }
            Some(SettingsReply::Status { variant, .. }) | Some(SettingsReply::Variant(variant))
                if self.values.is_none() =>
            {
                self.variant = Some(variant);
            }
            Some(SettingsReply::Configuration(configuration)) if self.values.is_none() => {
                self.found.get_or_insert(configuration);
                self.measured = Some(configuration);
            }
            _ => {}
        }
        false
    }

    /// What it says of itself, if it was asked.
    pub fn type_text(&self) -> Option<&str> {
        self.type_text.as_deref()
    }

    pub(super) fn count(&self) -> u16 {
        self.values.as_ref().map_or(0, |values| values.word.count)
    }
}
