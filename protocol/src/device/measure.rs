//! One mirror turn: from what was measured to the scan telegram.

use alloc::vec::Vec;

use super::Device;
use crate::angle::BeamGrid;
use crate::frame::Dialect;
use crate::telegram::lmd_scandatacfg::REMISSION_16_BIT;
use crate::telegram::wire::{FixedText, ShortString, Word};
use crate::telegram::{Channel, Kind, LmdScandata, Variable, encode_frame, fr_echo_filter};
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

/// Appends the whole frame `sSN LMDscandata …`.
pub fn scan_event(dialect: Dialect, scan: &LmdScandata, out: &mut Vec<u8>) {
    encode_frame(dialect, Kind::Sn, LmdScandata::NAME, scan, out);
}

impl Device {
    /// One mirror turn, whose zero index was at `at`. The scan counter advances always; a telegram comes while measuring,
    /// on every n-th turn as LMDscandatacfg says.
    pub fn measure(&mut self, at: SimTime, line: &MeasuredLine<'_>) -> Option<&LmdScandata> {
        let scan_counter = self.counters.scan;
        self.counters.scan = scan_counter.wrapping_add(1);
        let turn = self.counters.turns;
        self.counters.turns += 1;
        let rate = u64::from(self.settings.scan_data.output_rate.max(1));
        if !self.is_measuring() || !turn.is_multiple_of(rate) {
            return None;
        }
        // Taken out while it is filled, so that its buffers are reused.
        let mut scan = core::mem::take(&mut self.last_scan);
        self.fill_header(&mut scan, at, scan_counter);
        self.fill_channels(&mut scan, line);
        self.last_scan = scan;
        self.has_scan = true;
        Some(&self.last_scan)
    }

    fn fill_header(&mut self, scan: &mut LmdScandata, at: SimTime, scan_counter: u16) {
        let Self { model, counters, settings, .. } = self;
        let starting = counters.start_up_scans > 0;
        counters.start_up_scans = counters.start_up_scans.saturating_sub(1);
        scan.version = model.scandata_version;
        scan.device_number = 1;
        scan.serial_number = self.identity.serial_number;
        scan.device_status = if starting { [model.start_up.status, 0] } else { [0, 0] };
        scan.outputs = [if starting { model.start_up.outputs } else { model.outputs }, 0];
        scan.telegram_counter = counters.telegram;
        counters.telegram = counters.telegram.wrapping_add(1);
        scan.scan_counter = scan_counter;
        scan.scan_frequency = settings.mode.frequency_centihz;
        scan.measurement_frequency =
            measurement_frequency(settings.mode.frequency_centihz, settings.mode.step);
        if settings.scan_data.device_name {
            scan.name.get_or_insert_default().0.clone_from(&settings.location_name);
        } else {
            scan.name = None::<ShortString>;
        }
        let timed = settings.scan_data.time;
        // The device's clock is 32 bits wide and wraps.
        scan.scan_time_us = self.uptime_us(at) as u32;
        scan.transmit_time_us = scan.scan_time_us.wrapping_add(self.model.transmit_delay_us);
        scan.time = timed.then(|| self.date_time(at));
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
        let (distances, wide_remissions) = scan.channels16.split_at_mut(count);
        for (channel, echo) in distances.iter_mut().zip(echoes()) {
            self.fill(channel, b"DIST", echo, beams, |beam| self.echo(line, echo, first + beam).0);
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
