//! What the device says of its settings, and what they are to be.

use super::super::step::Step;
use super::Machine;
use crate::host::HostEvent;
use crate::lms2xx::configuration::Configuration;
use crate::lms2xx::model;
use crate::lms2xx::settings_reply::SettingsReply;
use crate::lms2xx::values::{MeasuringMode, Output, Parts, Span};

impl Machine {
    /// Takes note of what any reply says of the device's settings.
    pub(super) fn learn(&mut self, body: &[u8]) {
        match SettingsReply::parse(body) {
            Some(SettingsReply::Type(text)) => {
                let text = text.trim_end_matches(|c: char| !c.is_ascii_graphic());
                let (ident, firmware) = text.rsplit_once(';').unwrap_or((text, ""));
                (self.ident, self.firmware) = (ident.into(), firmware.into());
                self.known.model = model::by_type_text(text);
            }
            Some(SettingsReply::Status { variant, rate, mode }) => {
                self.known.variant = Some(variant);
                self.known.mode = Some(mode);
                if let (Step::Listening, Some(rate)) = (self.step, rate) {
                    self.rate = rate;
                    self.rate_known = true;
                }
            }
            Some(SettingsReply::Variant(variant)) => self.known.variant = Some(variant),
            Some(SettingsReply::Configuration(configuration)) => {
                self.known.mode = Some(configuration.measuring_mode());
                self.known.configuration = Some(configuration);
            }
            None => {}
        }
    }

    /// The configuration to be written, if the device has another. Its EEPROM does not last for ever.
    pub(super) fn wanted_configuration(&self) -> Option<Configuration> {
        let mut wanted = self.known.configuration?;
        wanted.set_unit(self.config.unit);
        wanted.set_measuring_mode(match self.config.remission && !self.is_fast() {
            true => MeasuringMode::WITH_REMISSION,
            false => self.config.measuring_mode,
        });
        wanted.set_real_time_index(self.config.real_time_index && wanted.has_indices());
        (Some(wanted) != self.known.configuration).then_some(wanted)
    }

    /// The form of scans to ask for.
    pub(super) fn wanted_output(&self) -> Output {
        let Some(variant) = self.known.variant.filter(|_| self.config.remission) else { return Output::All };
        let whole = Span { first: 1, last: variant.count() };
        match self.is_fast() {
            true => Output::Reflectivity(whole),
            false => Parts::new(&[whole]).map_or(Output::All, Output::Parts),
        }
    }

    /// An S14 has its own way to send remission.
    pub(super) fn is_fast(&self) -> bool {
        self.known.model.is_some_and(|model| model.reflectivity)
    }

    /// Tells what the configuration block, now read, shows that the device cannot do.
    pub(super) fn tell_limits(&mut self) {
        let what = match self.known.configuration {
            None => "its configuration block has an unknown length: it keeps its settings",
            Some(block) if !block.has_indices() && self.config.real_time_index => {
                "its firmware has no scan index (a configuration block of 32 bytes): lost scans cannot be counted"
            }
            Some(_) => return,
        };
        self.events.push_back(HostEvent::Limited { what });
    }
}
