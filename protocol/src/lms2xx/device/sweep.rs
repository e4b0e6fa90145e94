//! Which mirror turns make the next scan telegram, and making it.

use alloc::vec::Vec;
use core::time::Duration;

use super::Device;
use crate::angle::BeamGrid;
use crate::lms2xx::Variant;
use crate::lms2xx::frame::FROM_DEVICE;
use crate::lms2xx::frame::encode_with;
use crate::lms2xx::model::TURNS_PER_SECOND;
use crate::lms2xx::telegram::STATUS_OK;
use crate::lms2xx::values::{CountWord, Output, Values};
use crate::time::SimTime;

/// Mirror turns that a telegram will hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sweep {
    /// The first turn, counted from simulated time zero.
    pub first: u64,
    /// How many.
    pub turns: u32,
}

/// One turn's beams with what they met.
#[derive(Clone, Copy, Debug)]
pub struct Beams<'a> {
    /// Millimetres, 0 for no echo.
    pub range_mm: &'a [u16],
    /// Remission, 16-bit scale.
    pub remission: &'a [u16],
}

impl Sweep {
    /// When turn `turn` begins.
    pub fn turn_at(turn: u64) -> SimTime {
        SimTime((u128::from(turn) * 1_000_000_000 / u128::from(TURNS_PER_SECOND)) as u64)
    }

    /// The turn that `at` lies in.
    pub fn turn_of(at: SimTime) -> u64 {
        let near = (u128::from(at.0) * u128::from(TURNS_PER_SECOND) / 1_000_000_000) as u64;
        // Turn begins are rounded down to a nanosecond, so look one on.
        if Self::turn_at(near + 1) <= at { near + 1 } else { near }
    }

    /// When its last turn is over.
    pub fn done(&self) -> SimTime {
        Self::turn_at(self.first + u64::from(self.turns))
    }

    /// Its turns.
    pub fn turns(&self) -> impl Iterator<Item = u64> + use<> {
        self.first..self.first + u64::from(self.turns)
    }
}

/// Sums of what was measured, beam by beam; used again from telegram to telegram.
#[derive(Clone, Debug, Default)]
pub(super) struct Collected {
    range_mm: Vec<u64>,
    hits: Vec<u32>,
    remission: Vec<u16>,
    values: Values,
}

/// Partial scans are those of 180° in steps of a quarter, whatever variant is set.
const PARTIAL: Variant = Variant { angle_deg: 180, step_centideg: 25 };
const PARTIAL_TURNS: u32 = 4;

impl Device {
    /// What it is about to send.
    fn output(&self) -> Option<Output> {
        self.asked.or(self.stream)
    }

    /// What the mirror's turns measure in this form, and how many of them make a whole scan.
    fn raster(&self, output: Option<Output>) -> (Variant, u32) {
        match output {
            // What an S14 sends is not known: its own turns.
            Some(Output::Partial) if !self.is_fast() => (PARTIAL, PARTIAL_TURNS),
            _ => (self.variant, self.model.turns(self.variant).max(1)),
        }
    }

    /// Which of its `turns` this one is. Partial scans come in turn however many mirror turns lie between them, so that a host can put them
    /// together on a slow line too.
    fn part(&self, output: Option<Output>, turn: u64, turns: u64) -> u64 {
        match output {
            Some(Output::Partial) => self.partials % turns.max(1),
            _ => turn % turns.max(1),
        }
    }

    /// The turns of the next scan telegram, where one is wanted; the line is free from `free` on. The device measures always and
    /// sends the first scan that is complete by then, so that scans come at whole multiples of the scan's own time.
    pub fn plan(&self, free: SimTime) -> Option<Sweep> {
        if self.condition != super::Condition::Up || !self.waiting.is_empty() {
            return None;
        }
        let output = self.output()?;
        let unit = match output {
            Output::Partial => 1,
            _ => u64::from(self.raster(Some(output)).1),
        };
        let turns = unit * u64::from(output.scans());
        // The first unit that ends at `free` or later, and holds nothing that was sent before.
        let ends = first_turn_from(free).max(turns);
        let first = (ends - turns).max(self.next_turn).div_ceil(unit) * unit;
        Some(Sweep { first, turns: u32::try_from(turns).ok()? })
    }

    /// The beams of one turn: an interlaced scan's turns lie between one another.
    pub fn turn_beams(&self, turn: u64) -> BeamGrid {
        let (variant, turns) = self.raster(self.output());
        let (whole, turns) = (variant.beams(), turns as u16);
        let part = self.part(self.output(), turn, turns.into()) as u16;
        BeamGrid {
            start: whole.start + i32::from(part) * i32::from(whole.step),
            step: whole.step.saturating_mul(turns),
            count: (whole.count - part).div_ceil(turns),
        }
    }

    /// Takes one turn of a sweep that is over. Every turn of it in order, then [`Device::finish`].
    pub fn measure(&mut self, sweep: Sweep, turn: u64, beams: Beams<'_>) {
        let (variant, turns) = self.raster(self.output());
        let (count, turns) = (usize::from(variant.count()), u64::from(turns));
        if turn == sweep.first {
            self.collected.range_mm.clear();
            self.collected.range_mm.resize(count, 0);
            self.collected.hits.clear();
            self.collected.hits.resize(count, 0);
            self.collected.remission.clear();
            self.collected.remission.resize(count, 0);
        }
        let part = usize::try_from(self.part(self.output(), turn, turns)).unwrap_or_default();
        let Collected { range_mm, hits, remission, .. } = &mut self.collected;
        let places = (part..count).step_by(turns as usize);
        for ((place, range), digits) in places.zip(beams.range_mm).zip(beams.remission) {
            let (Some(sum), Some(hits), Some(kept)) =
                (range_mm.get_mut(place), hits.get_mut(place), remission.get_mut(place))
            else {
                continue;
            };
            *sum += u64::from(*range);
            *hits += u32::from(*range > 0);
            *kept = *digits;
        }
    }

    /// Puts the telegram of a sweep on the line.
    pub fn finish(&mut self, now: SimTime, sweep: Sweep) {
        let Some(output) = self.asked.take().or(self.stream) else { return };
        self.next_turn = sweep.first + u64::from(sweep.turns);
        let mut collected = core::mem::take(&mut self.collected);
        self.fill(&mut collected, output, sweep);
        self.partials += u64::from(output == Output::Partial);
        if self.configuration.real_time_index() && self.firmware.has_indices() {
            collected.values.real_time_index = Some((self.next_turn % 256) as u8);
            self.telegrams = self.telegrams.wrapping_add(1);
            collected.values.telegram_index = Some(self.telegrams);
        }
        let mut frame = Vec::new();
        encode_with(FROM_DEVICE, &mut frame, |out| collected.values.encode(out));
        self.collected = collected;
        self.queue_values(now, frame);
    }

    fn fill(&self, collected: &mut Collected, output: Output, sweep: Sweep) {
        let (mode, unit) = (self.configuration.measuring_mode(), self.configuration.unit());
        let Collected { range_mm, hits, remission, values } = collected;
        let (variant, turns) = self.raster(Some(output));
        let turns = turns as usize;
        let part = usize::try_from(self.part(Some(output), sweep.first, turns as u64)).unwrap_or_default();
        let value = |place: usize| {
            let (sum, hits) = (range_mm.get(place).copied(), hits.get(place).copied());
            // A mean over the turns that saw something.
            let mean = sum.unwrap_or_default() / u64::from(hits.unwrap_or_default().max(1));
            let digits = remission.get(place).copied().unwrap_or_default();
            mode.encode(unit.unwrap_or_default(), mean as u16, digits)
        };
        let count = usize::from(variant.count());
        values.values.clear();
        values.reflectivity.clear();
        values.part_reflectivity.clear();
        match output {
            Output::Partial => values.values.extend((part..count).step_by(turns).map(value)),
            Output::Range(span) | Output::MeanRange { span, .. } => {
                values.values.extend((usize::from(span.first.max(1)) - 1..usize::from(span.last)).map(value));
            }
            Output::Every(step) => {
                values.values.extend((0..count).step_by(usize::from(step.max(1))).map(value));
            }
            Output::Parts(parts) => {
                for span in parts.spans() {
                    let places = usize::from(span.first.max(1)) - 1..usize::from(span.last);
                    values.values.extend(places.map(value));
                    // A scale of its own, to about 13 000.
                    let reflectivity = span.of(remission).iter().map(|digits| digits / 5);
                    values.part_reflectivity.extend(reflectivity);
                }
            }
            Output::All | Output::Mean { .. } | Output::Reflectivity(_) => {
                values.values.extend((0..count).map(value));
            }
        }
        if let Output::Reflectivity(span) = output {
            values.reflectivity.extend(span.of(remission).iter().map(|digits| (digits >> 8) as u8));
        }
        // In quarter degrees, whatever the resolution.
        let quarter = part * usize::from(variant.step_centideg) / 25;
        values.output = output;
        values.word = CountWord {
            count: values.values.len() as u16,
            partial: (output == Output::Partial).then_some(quarter as u8),
            unit,
        };
        (values.real_time_index, values.telegram_index) = (None, None);
        values.status = STATUS_OK;
    }
}

/// The first turn that begins at `at` or later.
fn first_turn_from(at: SimTime) -> u64 {
    let turns = u128::from(at.0) * u128::from(TURNS_PER_SECOND);
    // Turn begins are rounded down to a nanosecond, so look one back.
    let near = turns.div_ceil(Duration::from_secs(1).as_nanos()) as u64;
    if near > 0 && Sweep::turn_at(near - 1) >= at { near - 1 } else { near }
}
