//! Which mirror turns make the next scan telegram, and making it.

use alloc::vec::Vec;
use core::time::Duration;

use super::Device;
use crate::angle::BeamGrid;
use crate::lms2xx::Variant;
use crate::lms2xx::frame::FROM_DEVICE;
use crate::lms2xx::frame::encode_with;
use crate::lms2xx::model::TURNS_PER_SECOND;
use crate::lms2xx::values::{Output, Values};
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
    pub(super) remission: Vec<u16>,
    /// Beam by beam: the mean of the turns that saw something, 0 if none did.
    pub(super) mean_mm: Vec<u16>,
    pub(super) values: Values,
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
    pub(super) fn raster(&self, output: Option<Output>) -> (Variant, u32) {
        match output {
            // What an S14 sends is not known: its own turns.
            Some(Output::Partial) if !self.is_fast() => (PARTIAL, PARTIAL_TURNS),
            _ => (self.variant, self.model.turns(self.variant).max(1)),
        }
    }

    /// Which of its `turns` this one is. Partial scans come in turn however many mirror turns lie between them, so that a host can put them
    /// together on a slow line too.
    pub(super) fn part(&self, output: Option<Output>, turn: u64, turns: u64) -> u64 {
        match output {
            Some(Output::Partial | Output::Direct(_)) => self.partials % turns.max(1),
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
            Output::Partial | Output::Direct(_) => 1,
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

    /// Puts the telegram of a sweep on the line; false if what it saw is not to be sent.
    pub fn finish(&mut self, now: SimTime, sweep: Sweep) -> bool {
        let Some(output) = self.output() else { return false };
        let turns = self.raster(Some(output)).1;
        self.next_turn = sweep.first + u64::from(sweep.turns);
        let mut collected = core::mem::take(&mut self.collected);
        collected.mean();
        self.evaluate(output, &collected);
        let job = self.job.take();
        if let Some(job) = job {
            self.end_job(now, job, &collected);
        } else if self.is_due(output) || self.asked.is_some() {
            self.fill(&mut collected, output, sweep);
            self.partials += u64::from(matches!(output, Output::Partial | Output::Direct(_)));
            self.send_values(now, &mut collected.values);
        }
        // A request for the partial scans of a sub-range is answered by as many telegrams.
        let more = matches!(output, Output::Direct(_)) && !self.partials.is_multiple_of(turns.into());
        if !more {
            self.asked = None;
        }
        self.collected = collected;
        !self.waiting.is_empty()
    }

    fn send_values(&mut self, now: SimTime, values: &mut Values) {
        if self.configuration.real_time_index() && self.firmware.has_indices() {
            values.real_time_index = Some((self.next_turn % 256) as u8);
            self.telegrams = self.telegrams.wrapping_add(1);
            values.telegram_index = Some(self.telegrams);
        }
        let mut frame = Vec::new();
        encode_with(FROM_DEVICE, &mut frame, |out| values.encode(out));
        self.queue_values(now, frame);
    }
}

impl Collected {
    fn mean(&mut self) {
        self.mean_mm.clear();
        let mean = |(sum, hits): (&u64, &u32)| (sum / u64::from((*hits).max(1))) as u16;
        self.mean_mm.extend(self.range_mm.iter().zip(&self.hits).map(mean));
    }
}

/// The first turn that begins at `at` or later.
fn first_turn_from(at: SimTime) -> u64 {
    let turns = u128::from(at.0) * u128::from(TURNS_PER_SECOND);
    // Turn begins are rounded down to a nanosecond, so look one back.
    let near = turns.div_ceil(Duration::from_secs(1).as_nanos()) as u64;
    if near > 0 && Sweep::turn_at(near - 1) >= at { near - 1 } else { near }
}
