//! What the device says of its settings, and what they are to be.

use super::super::step::Step;
use super::Machine;
use crate::host::HostEvent;
use crate::lms2xx::Variant;
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

    /// Tells what the configuration block, now read, shows that the device cannot do, and what another client has left that takes values away. Neither is
    /// written here: the block and its EEPROM are the user's.
    pub(super) fn tell_limits(&mut self) {
        let of_block = match self.known.configuration {
            None => Some("its configuration block has an unknown length: it keeps its settings"),
            Some(block) if !block.has_indices() && self.config.real_time_index => Some(
                "its firmware has no scan index (a configuration block of 32 bytes): lost scans cannot be counted",
            ),
            Some(_) => None,
        };
        let fades_out = self.known.configuration.is_some_and(|block| block.fades_out_single_values()).then_some(
            "its threshold for single values is on (A2 of the configuration block): weak echoes look like misses; switch it off with the maker's software",
        );
        let narrow = self.is_narrow().then_some(
            "it sends 100° where its model has 180° at this resolution (3B): nothing is known of the rest; name the mount's resolution_deg, or set the angle with the \
             maker's software",
        );
        let all = [of_block, fades_out, narrow].into_iter().flatten();
        self.events.extend(all.map(|what| HostEvent::Limited { what }));
    }

    /// True where its angle is narrower than its model's at the same resolution, and no other is asked for.
    fn is_narrow(&self) -> bool {
        let widest = |variant: Variant| {
            let alike = self.known.model.map_or(&[][..], |model| model.variants).iter();
            alike
                .filter(move |other| other.step_centideg == variant.step_centideg)
                .map(|other| other.angle_deg)
                .max()
        };
        let kept = self.known.variant.filter(|_| self.config.variant.is_none());
        kept.is_some_and(|variant| widest(variant) > Some(variant.angle_deg))
    }
}
