//! What is recorded of a device's settings, and whether others ask for more than its scans have.

use alloc::borrow::Cow;

use super::settings::Settings;
use crate::angle::BeamGrid;
use crate::model::Model;
use crate::telegram::fr_echo_filter;
use crate::telegram::lmd_scandatacfg::{REMISSION, ScanDataConfig};

/// What the recording of a played device holds.
#[derive(Clone, Debug)]
pub(super) struct Recorded {
    /// The settings that its scans were made with.
    pub(super) sent: Settings,
    /// The contents that its client asked for, if that is recorded: what it was given, however much less that is, is what such a request gives.
    pub(super) asked: Option<ScanDataConfig>,
    pub(super) echo: Echo,
}

/// What is known of the echo in recorded scans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Echo {
    /// FREchoFilter as it is among the settings.
    Known,
    /// Nothing tells which: a device that answered would make one up.
    Unknown,
    /// One echo of turns that were set up beside the recording: the first or the last.
    FirstOrLast,
}

impl Recorded {
    /// True if the recorded scans have all that these settings ask for.
    pub(super) fn honours(&self, settings: &Settings, model: &Model, full: BeamGrid) -> bool {
        self.in_terms_of_scans(settings).are_within(&self.sent, model, self.echo, full)
    }

    /// The same settings; the contents that the recorded client asked for are those that its scans have.
    pub(super) fn in_terms_of_scans<'a>(&self, settings: &'a Settings) -> Cow<'a, Settings> {
        if self.asked.as_ref() != Some(&settings.scan_data) {
            return Cow::Borrowed(settings);
        }
        Cow::Owned(Settings { scan_data: self.sent.scan_data.clone(), ..settings.clone() })
    }
}

impl Settings {
    /// True if scans made with `other` have all that these ask for: what is off may be set to anything.
    pub(super) fn are_within(&self, other: &Self, model: &Model, echo: Echo, full: BeamGrid) -> bool {
        let (asked, sent) = (&self.scan_data, &other.scan_data);
        let echoes = self.delivered_echoes(model) & !other.delivered_echoes(model) == 0;
        // Of all echoes, the first one is among them.
        let filter = model.echoes == 1
            || self.echo_filter == other.echo_filter
            || (other.echo_filter, self.echo_filter) == (fr_echo_filter::ALL, fr_echo_filter::FIRST)
            || echo == Echo::FirstOrLast
                && ![self.echo_filter, other.echo_filter].contains(&fr_echo_filter::ALL);
        let layers = self.layers == other.layers;
        let remission = asked.remission & !sent.remission == 0
            && (asked.remission & REMISSION == 0 || asked.resolution == sent.resolution);
        let encoders = asked.encoders.0 & !sent.encoders.0 == 0
            && (asked.encoders.0 == 0 || self.encoder == other.encoder);
        let blocks = [
            (asked.position, sent.position),
            (asked.device_name, sent.device_name),
            (asked.comment, sent.comment),
            (asked.time, sent.time),
        ];
        let beams = |settings: &Self| {
            let (first, beams) = match settings.output_range.is_full(model) {
                true => (0, full),
                false => settings.output_range.beams(full),
            };
            first..first + beams.len()
        };
        let (wanted, there) = (beams(self), beams(other));
        let filters = |settings: &Self| {
            let filters = settings.filters;
            (
                filters.mean.active.then_some(filters.mean),
                filters.median.active.then_some(filters.median),
                filters.particle.active.then_some(filters.particle),
            )
        };
        self.mode == other.mode
            && echoes
            && filter
            && layers
            && remission
            && encoders
            && blocks.iter().all(|(asked, sent)| !asked || *sent)
            && (asked.unit, asked.output_rate) == (sent.unit, sent.output_rate)
            && wanted.start >= there.start
            && wanted.end <= there.end
            && filters(self) == filters(other)
            && self.suppression == other.suppression
            && self.applications.ranging == other.applications.ranging
    }
}
