//! A turn of a scanner with Compact output on its way into telegrams: one a segment, with the lines of all its layers.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use core::time::Duration;

use super::clock::Clock;
use super::datagram::{Datagram, Stream};
use super::layers::UnitLayer;
use super::measured::MeasuredLine;
use super::random::Stage;
use super::seen::{HALF_TURN_DEG, Seen, around};
use super::state::Device;
use crate::compact::{
    Beams, Module, Modules, PerLine, REFLECTOR, ScanTelegram, Shape, TO_COLA, Telegram, theta_code,
};
use crate::model::CompactOutput;
use crate::telegram::fr_echo_filter;
use crate::time::SimTime;

/// The guide's value of a reflector on the 8-bit scale.
const REFLECTS: u16 = 254;

/// A turn on its way into telegrams.
pub(super) struct Turn<'a> {
    pub(super) device: &'a Device,
    pub(super) compact: &'static CompactOutput,
    /// In the order of the telegram's modules.
    pub(super) lines: Vec<Line<'a>>,
    pub(super) frame: u64,
    pub(super) at: SimTime,
    /// How long it takes, seconds.
    pub(super) turn_s: f64,
    pub(super) seen: Seen,
}

/// A line of the turn.
pub(super) struct Line<'a> {
    module: u8,
    /// Elevation, degrees.
    phi_deg: f64,
    line: &'a MeasuredLine<'a>,
    /// The beams of each segment.
    segments: Vec<Range<usize>>,
}

impl Line<'_> {
    /// Angle of a beam as Compact counts it, from −180° on; of all beams of a segment without a jump.
    fn theta_deg(&self, segment: usize, beam: usize) -> f64 {
        let theta_deg = |beam| self.line.grid.angle_deg(beam) - f64::from(TO_COLA) / 10_000.0;
        let first = self.segments.get(segment).map_or(beam, |beams| beams.start);
        let beyond = if theta_deg(first) >= HALF_TURN_DEG - 1e-9 { 2.0 * HALF_TURN_DEG } else { 0.0 };
        theta_deg(beam) - beyond
    }

    /// Whether the filters leave a beam of this segment.
    fn segment_is_seen(&self, seen: &Seen, segment: usize) -> bool {
        let mut beams = self.segments.get(segment).cloned().unwrap_or_default();
        beams.any(|beam| seen.sees(beam, self.theta_deg(segment, beam), self.phi_deg))
    }

    /// Whether they leave one of any.
    pub(super) fn is_seen_by(&self, seen: &Seen) -> bool {
        (0..self.segments.len()).any(|segment| self.segment_is_seen(seen, segment))
    }
}

impl<'a> Turn<'a> {
    /// The lines of a turn as they stand in telegrams, those of layers that are switched off left out. `lines` come as [`Device::mirrors`] has them.
    pub(super) fn lines(
        device: &Device,
        compact: &CompactOutput,
        lines: &'a [MeasuredLine<'a>],
        seen: &Seen,
    ) -> Vec<Line<'a>> {
        let width_deg = f64::from(compact.segment_at(device.settings.mode.frequency_centihz)) / 10_000.0;
        let of = |module, phi_deg, line: &'a MeasuredLine<'a>| Line {
            module,
            phi_deg,
            line,
            segments: segments(line, width_deg),
        };
        let layers = device.layers_seen();
        if layers.is_empty() {
            return lines.first().map(|line| of(0, 0.0, line)).into_iter().collect();
        }
        let mut all: Vec<_> =
            layers.iter().zip(lines).filter(|(layer, _)| seen.layers.sends(layer.number)).collect();
        all.sort_by_key(|(layer, _)| (layer.layer.module, layer.number));
        let phi_deg = |layer: &UnitLayer| f64::from(layer.elevation_centideg) / 100.0;
        all.into_iter().map(|(layer, line)| of(layer.layer.module, phi_deg(layer), line)).collect()
    }

    pub(super) fn datagrams(&self) -> impl Iterator<Item = Datagram> + '_ {
        let count = self.lines.first().map_or(0, |line| line.segments.len());
        (0..count).filter_map(|number| self.segment(number))
    }

    fn segment(&self, number: usize) -> Option<Datagram> {
        let Self { device, lines, .. } = self;
        if !lines.iter().any(|line| line.segment_is_seen(&self.seen, number)) {
            return None;
        }
        // Lines of a telegram begin and end together: those with the widest steps end first.
        let ends = |line: &Line<'_>| {
            let beams = line.segments.get(number)?;
            Some([beams.start, beams.end.saturating_sub(1)].map(|beam| self.instant(line, beam)))
        };
        let [start, stop] = lines.iter().filter_map(ends).min_by_key(|[_, stop]| *stop)?;
        let key = self.frame.wrapping_mul(64).wrapping_add(number as u64);
        let clock = &device.clock;
        let within_us = self.compact.jitter_us.value;
        let start_us = stamp(device.uptime_us(start), clock.off_even_us(Stage::SegmentStart, key, within_us));
        let stop_us = stamp(device.uptime_us(stop), clock.off_even_us(Stage::SegmentStop, key, within_us));
        let modules = lines.chunk_by(|one, other| one.module == other.module);
        let modules = modules.map(|lines| self.module(number, lines, [start_us, stop_us])).collect();
        let scan = ScanTelegram {
            transmit_time_us: stamp(start_us, clock.transmit_off_us(self.compact, key)),
            modules: Modules(modules),
            ..ScanTelegram::default()
        };
        let telegram = Telegram::Scan(scan.seal());
        let transmit = Duration::from_micros(self.compact.transmit_us.max(0) as u64);
        Some(Datagram { at: stop.max(start + transmit), stream: Stream::Scan, ends_turn: None, telegram })
    }

    fn module(&self, number: usize, lines: &[Line<'_>], [start_us, stop_us]: [u64; 2]) -> Module {
        let echoes = self.device.compact_echoes();
        let beams = lines.first().and_then(|line| line.segments.get(number)).map_or(0, Range::len);
        let theta_rad = |line: &Line<'_>, place: usize| {
            let first = line.segments.get(number).map_or(0, |beams| beams.start);
            line.theta_deg(number, first + place).to_radians() as f32
        };
        Module {
            segment_counter: number as u64,
            frame_number: self.frame,
            sender_id: self.device.identity.serial_number,
            shape: Shape { lines: lines.len() as u32, beams: beams as u32, echoes: echoes as u32 },
            time_start_us: PerLine(vec![start_us; lines.len()]),
            time_stop_us: PerLine(vec![stop_us; lines.len()]),
            phi_rad: PerLine(lines.iter().map(|line| line.phi_deg.to_radians() as f32).collect()),
            theta_start_rad: PerLine(lines.iter().map(|line| theta_rad(line, 0)).collect()),
            theta_stop_rad: PerLine(
                lines.iter().map(|line| theta_rad(line, beams.saturating_sub(1))).collect(),
            ),
            availability: 1,
            beams: self.beams(number, lines, beams),
            ..Module::default()
        }
    }

    /// What the beams of a module met: beam by beam, and of each line by line.
    fn beams(&self, number: usize, lines: &[Line<'_>], count: usize) -> Beams {
        let mut beams = Beams::default();
        for place in 0..count {
            for line in lines {
                let first = line.segments.get(number).map_or(0, |beams| beams.start);
                self.beam(line, first + place, line.theta_deg(number, first + place), &mut beams);
            }
        }
        beams
    }

    fn beam(&self, line: &Line<'_>, beam: usize, theta_deg: f64, beams: &mut Beams) {
        let device_deg = around(theta_deg) + f64::from(TO_COLA) / 10_000.0;
        let is_blind = !self.device.sees_all() && self.device.is_blind_at(device_deg);
        let is_seen = !is_blind && self.seen.sees(beam, theta_deg, line.phi_deg);
        let mut strength = 0;
        for echo in 0..self.device.compact_echoes() {
            let (range_mm, remission) =
                self.echo(line.line, echo, beam).filter(|_| is_seen).unwrap_or_default();
            let eight_bits = remission >> 8;
            if range_mm > 0 {
                strength = eight_bits;
            }
            beams.distance.push(range_mm);
            beams.rssi.push(if range_mm > 0 { eight_bits * 257 } else { 0 });
        }
        beams.properties.push(if strength >= REFLECTS { REFLECTOR } else { 0 });
        beams.theta.push(theta_code(theta_deg.to_radians()));
    }

    /// Range and remission of a beam's echo, as the echo filter lets it through.
    fn echo(&self, line: &MeasuredLine<'_>, echo: usize, beam: usize) -> Option<(u16, u16)> {
        let of = |number: usize| {
            let echo = line.echoes.get(number)?;
            let range_mm = *echo.range_mm.get(beam)?;
            let remission = echo.remission.get(beam).copied().unwrap_or_default();
            self.seen.reaches(range_mm).then_some((range_mm, remission))
        };
        if self.device.settings.echo_filter == fr_echo_filter::LAST {
            (0..usize::from(self.device.model.echoes)).rev().find_map(of)
        } else {
            of(echo)
        }
    }

    /// When a beam is measured: the mirror turns evenly.
    fn instant(&self, line: &Line<'_>, beam: usize) -> SimTime {
        self.at + Duration::from_secs_f64(beam as f64 * line.line.grid.step_deg() / 360.0 * self.turn_s)
    }
}

/// The beams of each segment of a line.
fn segments(line: &MeasuredLine<'_>, width_deg: f64) -> Vec<Range<usize>> {
    let beams = ((width_deg / line.grid.step_deg() + 0.5) as usize).max(2);
    let count = line.grid.len();
    let begins = (0..count).step_by(beams).filter(|&first| first == 0 || count - first > 1);
    let segment = |first: usize| {
        let end = first + beams;
        // No module has a single beam: clients divide by the number of steps.
        first..if count.saturating_sub(end) <= 1 { count } else { end }
    };
    begins.map(segment).collect()
}

impl Device {
    /// Echoes a beam of a Compact telegram has.
    fn compact_echoes(&self) -> usize {
        if self.settings.echo_filter == fr_echo_filter::ALL { self.model.echoes.into() } else { 1 }
    }
}

fn stamp(us: u64, off_us: i64) -> u64 {
    us.saturating_add_signed(off_us)
}

impl Clock {
    /// How far a segment's start or stop is off its even place, µs.
    fn off_even_us(&self, stage: Stage, key: u64, within_us: f64) -> i64 {
        let scattered = self.random_if_scattered();
        scattered.map_or(0, |random| libm::round(within_us * random.two_sided(stage, key)) as i64)
    }

    /// From a segment's first beam to the time of transmission in its telegram, µs.
    fn transmit_off_us(&self, compact: &CompactOutput, key: u64) -> i64 {
        let [from, to] = compact.transmit_within_us.map(f64::from);
        let scattered = self.random_if_scattered();
        scattered.map_or(compact.transmit_us.into(), |random| {
            libm::round(from + (to - from) * random.unit(Stage::SegmentTransmit, key)) as i64
        })
    }
}
