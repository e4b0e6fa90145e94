//! Fills a telegram of values with what a sweep has measured.

use alloc::vec::Vec;

use super::Device;
use super::sweep::{Collected, Sweep};
use crate::angle::BeamGrid;
use crate::lms2xx::values::{CountWord, MeasuringMode, NoRange, Output, Span, Unit};

/// Reflectivity of an `F5` has a scale of its own, to about 13 000.
const PARTS_SCALE: u16 = 5;
/// Bits of a Cartesian value, and the sign of X.
const CARTESIAN: u16 = 0x1FFF;
const LEFT: u16 = 0x8000;
/// Fields A and B in the Y of a Cartesian value: the reverse of measuring mode 0.
const CARTESIAN_FIELDS: [u16; 3] = [0x8000, 0x4000, 0];

/// One scan, and how its values are written.
struct Seen<'a> {
    beams: BeamGrid,
    range_mm: &'a [u16],
    remission: &'a [u16],
    mode: MeasuringMode,
    unit: Unit,
    /// The beams in each field.
    infringed: [Vec<bool>; 3],
    /// Means carry no flags.
    flags: bool,
}

impl Seen<'_> {
    fn range(&self, place: usize) -> u16 {
        self.range_mm.get(place).copied().unwrap_or_default()
    }

    /// A value, without what the fields add.
    fn plain(&self, place: usize) -> u16 {
        self.mode.encode(self.unit, self.range(place), self.remission.get(place).copied().unwrap_or_default())
    }

    fn value(&self, place: usize) -> u16 {
        match self.flags {
            true => self.plain(place) | self.field_flags(place, self.mode.field_bits()),
            false => self.plain(place),
        }
    }

    fn field_flags(&self, place: usize, bits: [u16; 3]) -> u16 {
        let set = |(held, bit): (&Vec<bool>, u16)| match held.get(place) {
            Some(true) => bit,
            _ => 0,
        };
        self.infringed.iter().zip(bits).map(set).fold(0, |flags, flag| flags | flag)
    }

    /// The smallest value of these places.
    fn smallest(&self, places: core::ops::Range<usize>) -> u16 {
        let nearest = places.filter(|place| self.range(*place) > 0).min_by_key(|place| self.range(*place));
        nearest.map_or(self.mode.code(NoRange::Weak), |place| self.value(place))
    }

    /// The smallest value of each of so many equal segments of these places.
    fn smallest_of(&self, places: core::ops::Range<usize>, segments: usize, out: &mut Vec<u16>) {
        let (from, count) = (places.start, places.len());
        let edge = |segment: usize| from + segment * count / segments.max(1);
        out.extend((0..segments).map(|segment| self.smallest(edge(segment)..edge(segment + 1))));
    }

    /// X and Y; no echo reads as the largest value in both.
    fn cartesian(&self, place: usize) -> [u16; 2] {
        let flags = self.field_flags(place, CARTESIAN_FIELDS);
        let range = f64::from(self.range(place));
        if range <= 0.0 {
            return [CARTESIAN, CARTESIAN | flags];
        }
        let angle = self.beams.angle_deg(place).to_radians();
        let digits = |mm: f64| self.unit.digits(mm as u16).min(CARTESIAN);
        let x = range * libm::cos(angle);
        let sign = if x < 0.0 { LEFT } else { 0 };
        [digits(x.abs()) | sign, digits((range * libm::sin(angle)).max(0.0)) | flags]
    }
}

fn places(span: Span) -> core::ops::Range<usize> {
    usize::from(span.first.max(1)) - 1..usize::from(span.last)
}

impl Device {
    /// Writes what was collected into its telegram.
    pub(super) fn fill(&self, collected: &mut Collected, output: Output, sweep: Sweep) {
        let (variant, turns) = self.raster(Some(output));
        let part = usize::try_from(self.part(Some(output), sweep.first, turns.into())).unwrap_or_default();
        let Collected { mean_mm, remission, values, .. } = collected;
        let seen = Seen {
            beams: variant.beams(),
            range_mm: mean_mm,
            remission,
            mode: self.configuration.measuring_mode(),
            unit: self.configuration.unit().unwrap_or_default(),
            infringed: self.held(output, variant.beams(), mean_mm),
            flags: output.scans() == 1,
        };
        values.values.clear();
        values.reflectivity.clear();
        values.part_reflectivity.clear();
        let interlaced = self.fill_values(&seen, output, part, turns as usize, &mut values.values);
        match output {
            Output::Parts(parts) => {
                let of = |span: &Span| span.of(seen.remission).iter().map(|digits| digits / PARTS_SCALE);
                values.part_reflectivity.extend(parts.spans().iter().flat_map(of));
            }
            Output::Reflectivity(span) => {
                let digits = span.of(seen.remission).iter().map(|digits| (digits >> 8) as u8);
                values.reflectivity.extend(digits);
            }
            _ => {}
        }
        // In quarter degrees, whatever the resolution.
        let quarter = part * usize::from(variant.step_centideg) / 25;
        values.output = output;
        values.word = CountWord {
            count: values.values.len() as u16,
            partial: interlaced.then_some(quarter as u8),
            unit: self.configuration.unit(),
        };
        (values.real_time_index, values.telegram_index) = (None, None);
        values.status = self.status_byte();
    }

    /// True if the values are those of one turn of several.
    fn fill_values(
        &self,
        seen: &Seen<'_>,
        output: Output,
        part: usize,
        turns: usize,
        out: &mut Vec<u16>,
    ) -> bool {
        let count = usize::from(seen.beams.count);
        match output {
            Output::Partial => out.extend((part..count).step_by(turns).map(|place| seen.value(place))),
            Output::Direct(span) => {
                let of_this_turn = places(span).filter(|place| place % turns == part);
                out.extend(of_this_turn.map(|place| seen.value(place)));
            }
            Output::Range(span) | Output::MeanRange { span, .. } => {
                out.extend(places(span).map(|place| seen.value(place)));
            }
            Output::Every(step) => {
                out.extend((0..count).step_by(usize::from(step.max(1))).map(|place| seen.value(place)));
            }
            Output::Parts(parts) => {
                let all = parts.spans().iter().flat_map(|span| places(*span));
                out.extend(all.map(|place| seen.value(place)));
            }
            Output::Segments { segments, span } => {
                seen.smallest_of(places(span), segments.into(), out);
            }
            Output::Minima(_) => seen.smallest_of(0..count, self.active_fields()[0].segments(), out),
            Output::Fields(span) => self.fill_with_fields(seen, span, out),
            Output::Cartesian(span) => out.extend(places(span).flat_map(|place| seen.cartesian(place))),
            Output::Perpendicular(_) => out.extend(self.perpendicular(seen)),
            Output::Taught => {
                let taught = self.active_fields()[0].taught_mm().unwrap_or_default();
                out.extend(taught.iter().map(|mm| seen.mode.encode(seen.unit, *mm, 0)));
            }
            Output::All | Output::Mean { .. } | Output::Reflectivity(_) => {
                out.extend((0..count).map(|place| seen.value(place)));
            }
        }
        matches!(output, Output::Partial | Output::Direct(_))
    }

    /// Each value with how far the three fields' borders are in its direction.
    fn fill_with_fields(&self, seen: &Seen<'_>, span: Span, out: &mut Vec<u16>) {
        for place in places(span) {
            out.push(seen.value(place));
            let angle = seen.beams.angle_deg(place);
            let border = |mm: f64| seen.unit.digits(mm as u16);
            out.extend(self.active_fields().iter().map(|field| border(field.border_mm(angle))));
        }
    }

    /// How near an object in each field is, straight ahead; overflow where there is none.
    fn perpendicular(&self, seen: &Seen<'_>) -> [u16; 3] {
        let ahead = |place: usize| {
            let angle = seen.beams.angle_deg(place).to_radians();
            (f64::from(seen.range(place)) * libm::sin(angle)) as u16
        };
        [0, 1, 2].map(|field| {
            let held = seen.infringed.get(field).map(Vec::as_slice).unwrap_or_default();
            let objects = held.iter().enumerate().filter(|(_, held)| **held).map(|(place, _)| ahead(place));
            objects
                .min()
                .map_or(seen.mode.code(NoRange::Overflow), |mm| seen.mode.encode(seen.unit, mm.max(1), 0))
        })
    }
}
