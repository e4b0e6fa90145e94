//! One mirror turn: from what was measured to the scan telegram.

use alloc::string::String;
use alloc::vec::Vec;

use super::Device;
use crate::angle::BeamGrid;
use crate::frame::Dialect;
use crate::telegram::lmd_scandatacfg::REMISSION_16_BIT;
use crate::telegram::wire::{FixedText, ShortString, Word};
use crate::telegram::{
    Channel, Encoder, Kind, LmdScandata, Position, Variable, encode_frame, fr_echo_filter, lmd_scandata,
};
use crate::time::SimTime;

/// One mirror turn's raw measurement on the mirror's full grid.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredLine<'a> {
    /// First echo first.
    pub echoes: &'a [MeasuredEcho],
}

/// One echo of every beam.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeasuredEcho {
    /// Millimetres, 0 where there was none.
    pub range_mm: Vec<u16>,
    /// Remission, 16-bit scale; 8-bit telegrams carry the upper byte.
    pub remission: Vec<u16>,
}

/// Appends the whole frame `sSN LMDscandatamon …`: the same scan under the monitor's name.
pub fn monitor_event(dialect: Dialect, scan: &LmdScandata, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Sn, lmd_scandata::MONITOR, scan, out);
}

/// Appends the whole frame `sSN LMDscandata …`.
pub fn scan_event(dialect: Dialect, scan: &LmdScandata, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Sn, LmdScandata::NAME, scan, out);
}

impl Device {
    /// One mirror turn, whose zero index was at `at`. The scan counter advances always; a telegram comes while measuring,
    /// for every n-th line as LMDscandatacfg says; a mean makes one line of its turns.
    pub fn measure(&mut self, at: SimTime, line: &MeasuredLine<'_>) -> Option<&LmdScandata> {
        let turn = self.counters.turns;
        self.counters.turns += 1;
        self.travel.turn(at);
        let makes_scans = self.makes_scans(at);
        // A counter that restarts with LMCstartmeas waits for the first scan.
        if !makes_scans && self.is_measuring() && self.model.scan_counter_restart.is_some() {
            return None;
        }
        let scan_counter = self.counters.scan;
        self.counters.scan = scan_counter.wrapping_add(1);
        if !makes_scans {
            return None;
        }
        let rate = u64::from(self.settings.scan_data.output_rate.max(1));
        // Taken out while they are used, so that their buffers are used again.
        let mut filters = core::mem::take(&mut self.filters);
        let filtered = filters.apply(self.settings.filters, line);
        let lines = self.counters.lines;
        self.counters.lines += u64::from(filtered.is_some());
        if let Some(line) = filtered.filter(|_| lines.is_multiple_of(rate)) {
            let mut scan = core::mem::take(&mut self.last_scan);
            self.evaluate_field(at, nearest_mm(&line));
            self.fill_header(&mut scan, at, turn, scan_counter);
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

    fn fill_header(&mut self, scan: &mut LmdScandata, at: SimTime, turn: u64, scan_counter: u16) {
        let starting = self.counters.start_up_scans > 0;
        if starting {
            self.counters.start_up_scans -= 1;
        }
        scan.version = self.model.scandata_version;
        scan.device_number = 1;
        scan.serial_number = self.identity.serial_number;
        scan.device_status = [self.scan_status(starting), 0];
        scan.inputs = [self.lines.input_mask(), 0];
        scan.outputs = [self.lines.output_mask, 0];
        if starting && self.counters.start_up_scans == 0 {
            self.switch_outputs(at, true);
        }
        scan.telegram_counter = self.counters.telegram;
        self.counters.telegram = scan.telegram_counter.wrapping_add(1);
        scan.scan_counter = scan_counter;
        let Self { settings, identity, .. } = &*self;
        scan.scan_frequency = settings.mode.frequency_centihz;
        scan.measurement_frequency =
            measurement_frequency(settings.mode.frequency_centihz, settings.mode.step);
        scan.encoders.clear();
        scan.encoders.extend((0..settings.scan_data.encoders.0.count_ones()).map(|_| self.encoder()));
        scan.position = settings.scan_data.position.then(Position::default);
        set_text(&mut scan.name, settings.scan_data.device_name, &settings.location_name);
        set_text(&mut scan.comment, settings.scan_data.comment, &identity.comment);
        let us = self.uptime_us(at).wrapping_add_signed(self.clock.jitter_us(turn));
        // The device's clock is 32 bits wide and wraps.
        scan.scan_time_us = us as u32;
        scan.transmit_time_us = scan.scan_time_us.wrapping_add(self.model.transmit_delay_us);
        scan.time = settings.scan_data.time.then(|| self.date_time_at(us));
    }

    /// Position in ticks, which wraps at 32 bits, and speed in ticks a millisecond. The listing says ticks a millimetre, which is
    /// no speed; not verified.
    fn encoder(&self) -> Encoder {
        let encoder = &self.settings.encoder;
        if !encoder.counts(self.model) {
            return Encoder::default();
        }
        let ticks_per_mm = f64::from(encoder.resolution.ticks_per_mm);
        let position = (self.travel.mm * ticks_per_mm) as i64 as u32;
        let speed = (self.travel.mm_per_ms.abs() * ticks_per_mm + 0.5) as u16;
        Encoder { position, speed }
    }

    fn fill_channels(&self, scan: &mut LmdScandata, line: &MeasuredLine<'_>) {
        let config = &self.settings.scan_data;
        let (first, beams) = self.settings.output_range.beams(self.mirror().beams);
        let echoes = || self.delivered_echoes();
        let remission = config.remission & 1 == 1;
        let wide = config.resolution == REMISSION_16_BIT;
        let count = echoes().count();

        scan.channels16.resize_with(if remission && wide { 2 * count } else { count }, Channel::default);
        scan.channels8.resize_with(if remission && !wide { count } else { 0 }, Channel::default);
        let none = self.model.no_echo;
        let (distances, wide_remissions) = scan.channels16.split_at_mut(count);
        for (channel, echo) in distances.iter_mut().zip(echoes()) {
            self.fill(channel, b"DIST", echo, beams, |beam| match self.echo(line, echo, first + beam).0 {
                0 if echo == 0 => none,
                range_mm => range_mm,
            });
        }
        for (channel, echo) in wide_remissions.iter_mut().zip(echoes()) {
            self.fill(channel, b"RSSI", echo, beams, |beam| self.echo(line, echo, first + beam).1);
        }
        for (channel, echo) in scan.channels8.iter_mut().zip(echoes()) {
            self.fill(channel, b"RSSI", echo, beams, |beam| {
                (self.echo(line, echo, first + beam).1 >> 8) as u8
            });
        }
    }

    /// Echoes that get a channel, counted from 0. A filter that picks one echo leaves only the first channel.
    fn delivered_echoes(&self) -> impl Iterator<Item = u8> + use<> {
        let mask = self.settings.scan_data.channels.0;
        let echoes = match self.settings.echo_filter {
            fr_echo_filter::ALL => self.model.echoes,
            _ => 1,
        };
        (0..echoes).filter(move |echo| mask >> echo & 1 == 1)
    }

    /// Range and remission of one beam in the channel of `echo`; zeros where there was no echo.
    fn echo(&self, line: &MeasuredLine<'_>, echo: u8, beam: usize) -> (u16, u16) {
        let value = |values: &[u16]| values.get(beam).copied().unwrap_or_default();
        let of = |echo: &MeasuredEcho| (value(&echo.range_mm), value(&echo.remission));
        match self.settings.echo_filter {
            fr_echo_filter::LAST => line.echoes.iter().rev().map(of).find(|(range_mm, _)| *range_mm > 0),
            _ => line.echoes.get(usize::from(echo)).map(of),
        }
        .unwrap_or_default()
    }

    fn fill<T: Word>(
        &self,
        channel: &mut Channel<T>,
        kind: &[u8; 4],
        echo: u8,
        beams: BeamGrid,
        value: impl Fn(usize) -> T,
    ) {
        let [a, b, c, d] = *kind;
        channel.name = FixedText([a, b, c, d, b'1' + echo]);
        channel.scale = 1.0;
        channel.offset = 0.0;
        channel.start_angle = beams.start;
        channel.step = beams.step;
        channel.values.clear();
        channel.values.extend((0..beams.len()).map(value));
    }
}

/// What the encoder has seen.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Travel {
    /// Way travelled.
    pub(super) mm: f64,
    mm_per_ms: f64,
    last: Option<(SimTime, f64)>,
}

impl Travel {
    fn turn(&mut self, at: SimTime) {
        if let Some((before, mm)) = self.last.filter(|(before, _)| *before < at) {
            self.mm_per_ms = (self.mm - mm) * 1e6 / (at.0 - before.0) as f64;
        }
        self.last = Some((at, self.mm));
    }
}

/// The nearest of all first echoes.
fn nearest_mm(line: &MeasuredLine<'_>) -> Option<u16> {
    line.echoes.first()?.range_mm.iter().copied().filter(|&range_mm| range_mm > 0).min()
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
