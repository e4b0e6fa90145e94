//! What the scanner sees: the orchard through the caster and the optics, from where the tractor stands.

use std::sync::Arc;
use std::time::Duration;

use rowscan_protocol::device::{MeasuredEcho, MeasuredLine, Mirror};
use rowscan_protocol::model::Model;
use rowscan_protocol::rig::{Mount, Rig};
use rowscan_protocol::time::SimTime;
use rowscan_scenes::optics::{self, RangeLimits};
use rowscan_scenes::{BeamFan, Caster, Return, Scratch};

/// One scanner's view of an orchard.
#[derive(Debug)]
pub struct World {
    caster: Arc<Caster>,
    rig: Rig,
    mount: Mount,
    limits: RangeLimits,
    fan: BeamFan,
    returns: Vec<Return>,
    scratch: Scratch,
    echoes: [MeasuredEcho; 1],
    seen: Option<(Mirror, Duration)>,
}

/// Why a rig cannot carry this scanner.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WorldError {
    /// The rig has fewer scanners.
    #[error("the rig has {found} scanner(s); there is no scanner number {index}")]
    NoSuchScanner {
        /// The scanner asked for, from 0.
        index: usize,
        /// How many there are.
        found: usize,
    },
}

impl World {
    /// The view of the rig's scanner number `index`, a device of this `model`.
    pub fn new(caster: Arc<Caster>, rig: Rig, index: usize, model: &Model) -> Result<Self, WorldError> {
        let mount = rig
            .scanners
            .get(index)
            .cloned()
            .ok_or(WorldError::NoSuchScanner { index, found: rig.scanners.len() })?;
        Ok(Self {
            caster,
            rig,
            mount,
            limits: RangeLimits { min_range_m: model.min_range_m, max_range_m: model.max_range_m },
            fan: BeamFan::from_degrees(0.0, 0.0, 0),
            returns: Vec::new(),
            scratch: Scratch::default(),
            echoes: [MeasuredEcho::default()],
            seen: None,
        })
    }

    /// Casts one line: the mirror's full grid, with the tractor `travelled` into its drive.
    ///
    /// One origin a line: the tractor's motion within a turn (15 mm at 1 m/s and 50 Hz) is left out.
    pub fn look(&mut self, mirror: Mirror, travelled: Duration) {
        if self.seen == Some((mirror, travelled)) {
            return;
        }
        if self.seen.is_none_or(|(before, _)| before.beams != mirror.beams) {
            self.fan = BeamFan::of_mount(&self.mount, mirror.beams);
            self.returns.resize(mirror.beams.len(), Return::MISS);
        }
        let origin = self.mount.pose(self.rig.y_m(travelled.as_secs_f64()));
        self.caster.cast(origin, &self.fan, &mut self.scratch, &mut self.returns);
        let [echo] = &mut self.echoes;
        optics::measure(&self.returns, self.limits, &mut echo.range_mm, &mut echo.remission);
        self.seen = Some((mirror, travelled));
    }

    /// The way an encoder on this tractor has counted after `travelled`.
    pub fn travelled_mm(&self, travelled: Duration) -> f64 {
        (self.rig.y_m(travelled.as_secs_f64()) - self.rig.y_m(0.0)) * 1000.0
    }

    /// The line last cast, in the device's raw units.
    pub fn line(&self) -> MeasuredLine<'_> {
        MeasuredLine { echoes: &self.echoes }
    }

    /// The line last cast, beam by beam, with what each beam met.
    pub fn returns(&self) -> &[Return] {
        &self.returns
    }
}

/// How far the tractor has driven: it stands at its start until the first scan has a taker, and drives on from there.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Drive {
    began: Option<SimTime>,
}

impl Drive {
    /// The scan at `at` has a taker; the first such scan starts the drive.
    pub(crate) fn begin(&mut self, at: SimTime) {
        self.began.get_or_insert(at);
    }

    /// Time driven at instant `at`.
    pub(crate) fn travelled(&self, at: SimTime) -> Duration {
        self.began.map_or(Duration::ZERO, |began| Duration::from_nanos(at.0.saturating_sub(began.0)))
    }
}
