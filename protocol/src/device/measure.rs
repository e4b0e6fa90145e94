//! One mirror turn: from what was measured to the scan telegram.

use alloc::string::String;
use alloc::vec::Vec;

use super::filter::Filters;
use super::measured::{MeasuredEcho, MeasuredLine};
use super::state::Device;
use crate::angle::BeamGrid;
use crate::frame::Dialect;
use crate::optics::DAZZLED_MM;
use crate::telegram::lmd_scandatacfg::{ANGLE_TABLE, REMISSION, REMISSION_16_BIT};
use crate::telegram::wire::{FixedText, ShortString, Word};
use crate::telegram::{
    Channel, Kind, LmdScandata, Position, Variable, encode_frame, fr_echo_filter, lmd_scandata,
};
use crate::time::SimTime;

/// Appends the whole frame `sSN LMDscandatamon …`: the same scan under the monitor's name.
pub fn monitor_event(dialect: Dialect, scan: &LmdScandata, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Sn, lmd_scandata::MONITOR, scan, out);
}

/// Appends the whole frame `sSN LMDscandata …`.
pub fn scan_event(dialect: Dialect, scan: &LmdScandata, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Sn, LmdScandata::NAME, scan, out);
}

impl Device {
    /// One mirror turn, whose zero index was at `at`. The scan counter always advances. A telegram is made while the device measures, for
    /// every n-th line as set with LMDscandatacfg; a mean filter makes one line of several turns.
    pub fn measure(&mut self, at: SimTime, line: &MeasuredLine<'_>) -> Option<&LmdScandata> {
        let (turn, scan_counter) = self.count_turn(at)?;
        if !self.settings.layers.sends(self.model, self.model.layer(turn)) {
            return None;
        }
        let rate = u64::from(self.settings.scan_data.output_rate.max(1));
        // Taken out while they are used, so that their buffers are used again.
        let mut filters = core::mem::take(&mut self.filters);
        let turns = self.model.turns_a_scan(self.settings.mode);
        filters.resize_with(turns.into(), Filters::default);
        let of_turn = filters.get_mut((turn % u64::from(turns)) as usize);
        let filtered = of_turn.and_then(|filters| filters.apply(self.settings.filters, line));
        let lines = self.counters.lines;
        self.counters.lines += u64::from(filtered.is_some());
        if let Some(line) = filtered.filter(|_| lines.is_multiple_of(rate)) {
            let mut scan = core::mem::take(&mut self.last_scan);
            self.evaluate_fields(at, &line);
            self.fill_header(&mut scan, at, turn, scan_counter);
            let of_all = measurement_frequency(scan.scan_frequency, line.grid.step);
            scan.measurement_frequency = of_all / self.model.layers.len().max(1) as u32;
            self.fill_channels(&mut scan, &line);
            self.last_scan = scan;
            self.has_scan = true;
            self.filters = filters;
            Some(&self.last_scan)
        } else {
            self.filters = filters;
            None
        }
    }

    /// A mirror turn that was not measured, because the host had no time. Everything but the telegram counter advances. True if a scan was
    /// lost.
    pub fn miss(&mut self, at: SimTime) -> bool {
        self.count_turn(at).is_some()
    }

    /// Which turn of the mirror this is, and its scan counter if it makes a scan.
    fn count_turn(&mut self, at: SimTime) -> Option<(u64, u16)> {
        let turn = self.counters.turns;
        self.counters.turns += 1;
        self.ticks.turn(at);
        let makes_scans = self.makes_scans(at);
        // A counter that restarts with LMCstartmeas waits for the first scan.
        if !makes_scans && self.is_measuring() && self.model.scan_counter_restart.is_some() {
            return None;
        }
        let scan_counter = self.counters.scan;
        self.counters.scan = scan_counter.wrapping_add(1);
        makes_scans.then_some((turn, scan_counter))
    }

    fn fill_header(&mut self, scan: &mut LmdScandata, at: SimTime, turn: u64, scan_counter: u16) {
        let starting = self.counters.start_up_scans > 0;
        if starting {
            self.counters.start_up_scans -= 1;
        }
        scan.version = self.model.scandata_version;
        scan.device_number = self.model.device_number;
        scan.layer_angle = self.layer_of_turn(turn);
        scan.serial_number = self.identity.serial_number;
        scan.device_status = self.scan_status(starting);
        scan.inputs = [self.lines.input_mask(), 0];
        scan.outputs = [self.lines.output_mask, 0];
        if starting && self.counters.start_up_scans == 0 {
            self.switch_outputs(at, true);
        }
        scan.telegram_counter = self.counters.telegram;
        self.counters.telegram = scan.telegram_counter.wrapping_add(1);
        scan.scan_counter = scan_counter;
        let Self { settings, identity, .. } = &*self;
        scan.scan_frequency = self.model.turn_of(settings.mode).frequency_centihz;
        scan.encoders.clear();
        scan.encoders.extend((0..settings.scan_data.encoders.0.count_ones()).map(|_| self.encoder_reading()));
        scan.position = settings.scan_data.position.then(Position::default);
        let is_named = settings.scan_data.device_name || self.model.names_itself;
        set_text(&mut scan.name, is_named, &settings.location_name);
        set_text(&mut scan.comment, settings.scan_data.comment, &identity.comment);
        let us = self.uptime_us(at).saturating_add_signed(self.clock.jitter_us(turn));
        // The device's clock is 32 bits wide and wraps.
        scan.scan_time_us = us as u32;
        scan.transmit_time_us = scan.scan_time_us.wrapping_add(self.clock.transmit_delay_us(turn));
        scan.time = settings.scan_data.time.then(|| self.date_time_at(us));
    }

    fn fill_channels(&self, scan: &mut LmdScandata, line: &MeasuredLine<'_>) {
        let config = &self.settings.scan_data;
        let (first, beams) = self.settings.output_range.beams(line.grid);
        let echoes = || self.delivered_echoes();
        let remission = config.remission & REMISSION != 0;
        let wide = config.resolution == REMISSION_16_BIT;
        let count = echoes().count();

        let angles = config.remission & ANGLE_TABLE != 0;
        let values = if remission && wide { 2 * count } else { count };
        scan.channels16.resize_with(values + usize::from(angles), Channel::default);
        scan.channels8.resize_with(if remission && !wide { count } else { 0 }, Channel::default);
        let (values, tables) = scan.channels16.split_at_mut(values);
        let (distances, wide_remissions) = values.split_at_mut(count);
        for table in tables {
            lmd_scandata::fill_angles(table, beams);
        }
        for (channel, echo) in distances.iter_mut().zip(echoes()) {
            let none = if echo == 0 { self.model.no_echo } else { 0 };
            let raw = |range_mm| if range_mm == 0 { none } else { range_mm };
            self.fill(channel, Quantity::Distance, echo, line, (first, beams), raw);
        }
        for (channel, echo) in wide_remissions.iter_mut().zip(echoes()) {
            self.fill(channel, Quantity::Remission, echo, line, (first, beams), |remission| remission);
        }
        for (channel, echo) in scan.channels8.iter_mut().zip(echoes()) {
            let upper = |remission| (remission >> 8) as u8;
            self.fill(channel, Quantity::Remission, echo, line, (first, beams), upper);
        }
    }

    /// Echoes that get a channel, counted from 0. A filter that picks one echo leaves only the first channel.
    fn delivered_echoes(&self) -> impl Iterator<Item = u8> + use<> {
        let mask = self.settings.delivered_echoes(self.model);
        (0..self.model.echoes).filter(move |echo| mask >> echo & 1 == 1)
    }

    /// The channel of `echo`: what `raw` makes of the values of `beams`, of 0 where there was no echo. `first` is the mirror's beam that
    /// the channel begins with.
    fn fill<T: Word>(
        &self,
        channel: &mut Channel<T>,
        quantity: Quantity,
        echo: u8,
        line: &MeasuredLine<'_>,
        (first, beams): (usize, BeamGrid),
        raw: impl Fn(u16) -> T,
    ) {
        let [a, b, c, d] = *quantity.channel();
        channel.name = FixedText([a, b, c, d, b'1' + echo]);
        channel.scale = 1.0;
        channel.offset = 0.0;
        channel.start_angle = beams.start;
        channel.step = beams.step;
        channel.values.clear();
        let last = first + beams.len();
        self.fill_seen(channel, quantity, echo, line, (first, last), &raw);
        channel.values.resize(beams.len(), raw(0));
        if !self.sees_all() {
            for (beam, value) in channel.values.iter_mut().enumerate() {
                if self.is_blind_at(beams.angle_deg(beam)) {
                    *value = raw(0);
                }
            }
        }
    }

    /// Appends what `raw` makes of the beams from `first` to before `last`, as far as there is something.
    fn fill_seen<T: Word>(
        &self,
        channel: &mut Channel<T>,
        quantity: Quantity,
        echo: u8,
        line: &MeasuredLine<'_>,
        (first, last): (usize, usize),
        raw: &impl Fn(u16) -> T,
    ) {
        if self.settings.echo_filter == fr_echo_filter::LAST {
            let told = |beam| quantity.told(echo, line, beam, quantity.of_last_echo(line, beam));
            channel.values.extend((first..last).map(|beam| raw(told(beam))));
            return;
        }
        let seen = line.echoes.get(usize::from(echo)).map(|echo| quantity.of(echo)).unwrap_or_default();
        let seen = seen.get(first..last.min(seen.len())).unwrap_or_default();
        let told = |(place, &value): (usize, &u16)| quantity.told(echo, line, first + place, value);
        channel.values.extend(seen.iter().enumerate().map(|seen| raw(told(seen))));
    }
}

/// What a channel holds.
#[derive(Clone, Copy, Debug)]
enum Quantity {
    Distance,
    Remission,
}

impl Quantity {
    /// How its channels' names begin.
    fn channel(self) -> &'static [u8; 4] {
        match self {
            Self::Distance => b"DIST",
            Self::Remission => b"RSSI",
        }
    }

    fn of(self, echo: &MeasuredEcho) -> &[u16] {
        match self {
            Self::Distance => &echo.range_mm,
            Self::Remission => &echo.remission,
        }
    }

    /// The value of a beam's last echo that has a range.
    fn of_last_echo(self, line: &MeasuredLine<'_>, beam: usize) -> u16 {
        let at = |values: &[u16]| values.get(beam).copied().unwrap_or_default();
        let last = line.echoes.iter().rev().find(|echo| at(&echo.range_mm) > 0);
        last.or(line.echoes.first()).map_or(0, |echo| at(self.of(echo)))
    }

    /// What a channel of echo `echo` says of a beam with this value.
    fn told(self, echo: u8, line: &MeasuredLine<'_>, beam: usize, value: u16) -> u16 {
        let has_code = matches!(self, Self::Distance) && echo == 0 && value == 0 && line.is_dazzled(beam);
        if has_code { DAZZLED_MM } else { value }
    }
}

fn set_text(text: &mut Option<ShortString>, on: bool, value: &String) {
    if on {
        text.get_or_insert_default().0.clone_from(value);
    } else {
        *text = None;
    }
}

/// Shots in units of 100 Hz, as if the mirror measured all round: 50 Hz with 0.5° steps is 360.
fn measurement_frequency(frequency_centihz: u32, step: u16) -> u32 {
    let shots_a_turn = 360.0 / crate::angle::exact_step_deg(step);
    (f64::from(frequency_centihz) / 100.0 * shots_a_turn / 100.0 + 0.5) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurement_frequencies_are_the_recorded_ones() {
        for (frequency_centihz, step, expected) in [(5000, 5000, 360), (2500, 1667, 540), (1500, 3333, 162)] {
            assert_eq!(measurement_frequency(frequency_centihz, step), expected);
        }
    }
}
