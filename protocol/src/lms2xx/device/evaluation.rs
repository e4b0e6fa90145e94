//! Evaluates the monitoring fields, and answers the commands that configure them: `40`, `45`, `46`, `4A`.

use alloc::vec::Vec;

use super::Device;
use super::answer::Answer;
use super::fields::{FIELDS, Field, Place};
use super::sweep::Collected;
use crate::angle::BeamGrid;
use crate::lms2xx::telegram::{REPLY, command};
use crate::lms2xx::values::{Output, When};
use crate::lms2xx::words::word_at;
use crate::time::SimTime;

/// What a scan is made for besides its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Job {
    /// `4A`: the outputs.
    Outputs,
    /// `46`: the field being taught in ends with what this scan sees.
    Teach,
}

/// A field that is being taught in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Teaching {
    place: Place,
    /// How far before the contour its border is to lie.
    before_mm: u16,
}

/// Codes in `C6`.
const NOT_ENDED: u8 = 0;
const ENDED: u8 = 1;
const ACTIVE: u8 = 3;
/// The distance to the contour where the telegram's last word is not 0.
const USUAL_DISTANCE_MM: u16 = 70;
/// The three switching outputs: low is an infringed field.
const HIGH: u8 = 1;
/// Fields are not evaluated at this resolution.
const TOO_FINE_CENTIDEG: u16 = 25;

impl Device {
    /// The fields of the active set.
    pub(super) fn active_fields(&self) -> &[Field; FIELDS] {
        self.fields.set(self.field_set)
    }

    /// Sets field number `number` (from 0) of both sets to a circle about the scanner; false if there is no such field.
    pub fn set_field(&mut self, number: usize, radius_mm: u16) -> bool {
        for set in 0..2 {
            let field = Field::radial_mm(self.variant, radius_mm);
            self.fields.put(Place { set, field: number }, field);
        }
        number < FIELDS
    }

    /// The beams that end in each field of the active set.
    pub(super) fn held(&self, output: Output, beams: BeamGrid, range_mm: &[u16]) -> [Vec<bool>; FIELDS] {
        let evaluates = !self.is_fast()
            && self.variant.step_centideg != TOO_FINE_CENTIDEG
            && !matches!(output, Output::Partial);
        let fields = self.active_fields();
        let held = |field: &Field| match evaluates {
            true => {
                let ranges = range_mm.iter().enumerate();
                ranges.map(|(place, range)| field.holds(beams.angle_deg(place), *range)).collect()
            }
            false => Vec::new(),
        };
        fields.each_ref().map(held)
    }

    /// Takes one scan into account: an infringed field counts once it was so often in a row.
    pub(super) fn evaluate(&mut self, output: Output, collected: &Collected) {
        let whole = !matches!(output, Output::Partial | Output::Direct(_));
        if !whole || self.is_fast() || self.variant.step_centideg == TOO_FINE_CENTIDEG {
            self.infringed = [0; FIELDS];
            return;
        }
        let beams = self.raster(Some(output)).0.beams();
        let blanking = self.configuration.blanking_cm();
        let now = self.fields.set(self.field_set).each_ref();
        let now = now.map(|field| field.is_infringed(beams, &collected.mean_mm, blanking));
        for (count, now) in self.infringed.iter_mut().zip(now) {
            *count = if now { count.saturating_add(output.scans()) } else { 0 };
        }
    }

    /// Whether this telegram is one that is sent, by what its scan has seen.
    pub(super) fn is_due(&self, output: Output) -> bool {
        match output {
            Output::Minima(When::Infringed) | Output::Perpendicular(When::Infringed) => {
                self.infringed.iter().any(|count| *count > 0)
            }
            _ => true,
        }
    }

    /// The outputs: a request evaluates one scan, a stream as many as the configuration asks for.
    fn outputs(&self) -> [u8; FIELDS] {
        let enough = match self.stream {
            Some(_) => self.configuration.evaluations().max(1),
            None => 1,
        };
        self.infringed.map(|count| if count >= enough { HIGH - 1 } else { HIGH })
    }

    /// `4A`: a stream has evaluated already; otherwise a scan is made.
    pub(super) fn ask_outputs(&mut self, body: &mut Vec<u8>, answer: &mut Answer) {
        if self.stream.is_some() || self.recorded.is_some() {
            body.extend_from_slice(&self.outputs());
        } else {
            self.begin(Job::Outputs, answer);
        }
    }

    fn begin(&mut self, job: Job, answer: &mut Answer) {
        self.job = Some(job);
        self.asked = Some(Output::All);
        answer.later = true;
    }

    /// `40`: C0 says whether the field was taken, and repeats it.
    pub(super) fn configure_field(&mut self, data: &[u8], body: &mut Vec<u8>) {
        let field = Field::parse(data);
        body.push(u8::from(field.is_some()));
        body.extend_from_slice(data);
        if let Some((place, field)) = field {
            self.fields.put(place, field);
        }
    }

    /// `45`: the field as it is.
    pub(super) fn read_field(&self, set: u8, field: u8, body: &mut Vec<u8>) -> Option<()> {
        let place = Place::of(set, field)?;
        body.push(set);
        self.fields.get(place)?.encode(place, body);
        Some(())
    }

    /// `46`: start, end and abort of teaching a field in.
    pub(super) fn teach(&mut self, data: &[u8], body: &mut Vec<u8>, answer: &mut Answer) -> Option<()> {
        let &[set, kind, _, _, _, _, step, ref rest @ ..] = data else { return None };
        let place = Place::of(set, kind)?;
        match (step, self.teaching) {
            (0, _) => {
                let before_mm = match (word_at(rest, 0)?, word_at(rest, 4).unwrap_or_default()) {
                    (distance, 0) => distance,
                    _ => USUAL_DISTANCE_MM,
                };
                self.teaching = Some(Teaching { place, before_mm });
                body.push(ACTIVE);
            }
            // A recorded device sees nothing by itself.
            (1, Some(_)) if self.recorded.is_none() => self.begin(Job::Teach, answer),
            (2, _) => {
                self.teaching = None;
                body.push(NOT_ENDED);
            }
            _ => return None,
        }
        Some(())
    }

    /// Ends a job with what its scan has seen.
    pub(super) fn end_job(&mut self, now: SimTime, job: Job, collected: &Collected) {
        let mut body = match job {
            Job::Outputs => alloc::vec![command::OUTPUTS | REPLY],
            Job::Teach => alloc::vec![command::TEACH | REPLY],
        };
        match (job, self.teaching.take_if(|_| job == Job::Teach)) {
            (Job::Outputs, _) => body.extend_from_slice(&self.outputs()),
            (Job::Teach, Some(Teaching { place, before_mm })) => {
                self.fields.put(place, Field::taught(self.variant, &collected.mean_mm, before_mm));
                body.push(ENDED);
            }
            (Job::Teach, None) => body.push(NOT_ENDED),
        }
        body.push(self.status_byte());
        self.send(now, &body, None);
    }
}
