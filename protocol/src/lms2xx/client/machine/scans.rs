//! Turns telegrams of values into scans.

use alloc::string::ToString;

use super::super::clock::{Indices, fingerprint, period};
use super::Machine;
use crate::host::HostEvent;
use crate::leftover::{LMS2XX_MEAN, LMS2XX_PART};
use crate::leftover_set::LeftoverSet;
use crate::lms2xx::Variant;
use crate::lms2xx::frame::Frame;
use crate::lms2xx::model::{self, Model, TURNS_PER_SECOND};
use crate::lms2xx::values::{CountWord, Output, Unit, Values};
use crate::scan::Echo;
use crate::validity::{DeviceStatus, ScanFault};

impl Machine {
    pub(super) fn take_scan(&mut self, frame: &Frame<'_>) {
        let taken = self.values.decode_into(frame.body);
        match taken {
            Ok(()) if self.values.word.count == 0 => {
                self.events.push_back(HostEvent::Malformed { fault: ScanFault::NoBeams });
            }
            Ok(()) if self.known.variant.is_none() && self.values.output.names_values() => {
                self.events.push_back(HostEvent::Malformed { fault: ScanFault::PartOfUnknownScan });
            }
            Ok(()) => {
                self.fill_scan(frame.len, fingerprint(frame.body));
                self.events.push_back(HostEvent::Scan);
            }
            Err(error) => {
                let fault = ScanFault::Fields { reason: error.to_string() };
                self.events.push_back(HostEvent::Malformed { fault });
            }
        }
    }

    fn fill_scan(&mut self, frame: usize, bytes: u32) {
        let CountWord { mut count, partial, unit } = self.values.word;
        if let Output::Parts(parts) = self.values.output {
            // The beams of a scan follow one another: of several parts, the first.
            count = parts.spans().first().map_or(0, |span| span.count()).min(count);
        }
        let variant = self.known.variant.unwrap_or_else(|| self.guess(count));
        let whole = variant.beams();
        let mut beams = whole;
        beams.count = count;
        match self.values.output {
            Output::Range(span) | Output::MeanRange { span, .. } => {
                beams.start += i32::from(span.first.max(1) - 1) * i32::from(whole.step);
            }
            // Over 180° whatever the variant; what an S14 sends is not known.
            Output::Partial if self.known.model.is_none_or(|model| model.takes_variants) => {
                beams.start = i32::from(partial.unwrap_or_default()) * 2_500;
                beams.step = 10_000;
            }
            Output::Parts(parts) => {
                let first = parts.spans().first().map_or(1, |span| span.first.max(1));
                beams.start += i32::from(first - 1) * i32::from(whole.step);
            }
            _ => {}
        }
        let turns = match (self.values.output, self.known.model) {
            (Output::Partial, _) => 1,
            (_, Some(model)) => model.turns(variant),
            (_, None) => model::default_turns(variant),
        };
        let by_rate = period(self.rate, frame, turns);
        let Values { real_time_index, telegram_index, .. } = self.values;
        let indices = real_time_index.map(|turn| Indices { turn, telegram: telegram_index });
        let place = self.clock.count(indices, (frame, bytes), self.now);
        let known_period = if self.rate_known { Some(by_rate) } else { self.clock.period(turns) };
        // In bytes without times, index and rate nothing tells it.
        let scan_period = known_period.unwrap_or(by_rate);
        let unit = unit.unwrap_or(Unit::Mm);
        let mode = self.known.mode.unwrap_or_else(|| self.likely_mode.of(unit, &self.values.values));
        let scan = &mut self.scan;
        scan.leftovers = LeftoverSet::default();
        let is_mean = matches!(self.values.output, Output::Mean { .. } | Output::MeanRange { .. });
        scan.leftovers.set(LMS2XX_MEAN, is_mean);
        scan.leftovers.set(LMS2XX_PART, self.values.output.names_values() && count < whole.count);
        scan.status = DeviceStatus::of_lms2xx(self.values.status);
        scan.uncounted = self.values.real_time_index.is_none();
        scan.begins_anew = place.begins_anew;
        scan.telegram_counter = place.number as u16;
        scan.scan_counter = place.periods as u16;
        // Mirror turns are the clock, or the host where they are not counted; it wraps as other scanners' clocks do.
        scan.scan_time_us = match (place.turns, self.now) {
            (Some(turns), _) => (u128::from(turns) * 1_000_000 / u128::from(TURNS_PER_SECOND)) as u32,
            (None, Some(now)) => now.as_micros() as u32,
            (None, None) => (u128::from(place.number) * scan_period.as_nanos() / 1000) as u32,
        };
        scan.transmit_time_us = scan.scan_time_us;
        scan.received = self.now;
        scan.scan_frequency_hz = known_period.map_or(0.0, |period| 1.0 / period.as_secs_f64());
        scan.beams = beams;
        scan.echoes.resize_with(1, Echo::default);
        for Echo { range_m, remission } in &mut scan.echoes {
            range_m.clear();
            let values = self.values.values.iter().take(usize::from(count));
            range_m.extend(values.map(|value| mode.decode_m(unit, *value)));
            remission.clear();
            // As long as the beams, or empty.
            if self.values.reflectivity.len() == self.values.values.len() {
                remission.extend(self.values.reflectivity.iter().map(|digit| u16::from(*digit)));
            }
            remission.extend(self.values.part_reflectivity.iter().take(range_m.len()));
        }
    }

    /// The variant of so many values, where nothing else is known.
    fn guess(&self, count: u16) -> Variant {
        let of =
            |model: &&'static Model| model.variants.iter().copied().find(|variant| variant.count() == count);
        let known = self.known.model.into_iter();
        known
            .chain(model::MODELS.iter().copied())
            .find_map(|model| of(&model))
            .unwrap_or(Variant { angle_deg: count.saturating_sub(1).min(180), step_centideg: 100 })
    }
}
