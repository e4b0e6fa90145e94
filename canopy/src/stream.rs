//! The streaming pipeline: counting, advance and row, one line behind.

use std::sync::Arc;

use rowscan_protocol::host::SettingNote;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::validity::ScanFault;

use crate::calibration::Calibration;
use crate::class::RowClass;
use crate::cut::CutMethod;
use crate::encoder_witness::Counted;
use crate::error::PipelineError;
use crate::estimate::{Estimate, Progress, RangeStatistics};
use crate::estimator::EstimatorInfo;
use crate::gate::{Field, Gate};
use crate::leaf::{Law, LeafWindow, Withheld};
use crate::odometry::{AdvanceSource, EncoderChoice, GroundSpeed, Odometry};
use crate::other_side::{Heading, OtherSide};
use crate::parameters::Parameters;
use crate::ranges::Ranges;
use crate::report;
use crate::row_pass::{LatestScan, RowPass};
use crate::warning::Warning;
use crate::window::Window;
use rowscan_protocol::counting::{Counting, Link, Turn, nominal_period_s};

/// For so long after the first scan a reading of the encoder is awaited, seconds.
const READING_AWAITED_S: f64 = 1.0;
/// An encoder that has not counted while the rig's speed covers this way, metres, is dead.
const DEAD_AFTER_M: f64 = 1.0;

/// Scans of one scanner in, an [`Estimate`] out, at any time.
///
/// Every scan is copied once and weighed when the next one comes. Without a rig only counts and range statistics are
/// made: areas are `None`.
///
/// ```
/// use rowscan_canopy::Pipeline;
/// use rowscan_protocol::rig::Rig;
/// use rowscan_protocol::scan::Scan;
///
/// let mut pipeline = Pipeline::new(Some(&Rig::default()), 0, None)?;
/// pipeline.push(&Scan::default());
/// let estimate = pipeline.finish();
/// // A scan without beams is left out, so nothing is known of the row.
/// assert_eq!((estimate.scans, estimate.scans_excluded), (1, 1));
/// assert_eq!(estimate.impacted_total_area_m2, None);
/// # Ok::<(), rowscan_canopy::PipelineError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pipeline {
    counting: Counting,
    /// What was measured beside the next scan.
    beside: Option<GroundSpeed>,
    gate: Gate,
    /// How the next line that is used follows on the last one: over those left out.
    link: Option<Link>,
    ranges: Ranges,
    latest: Option<LatestScan>,
    /// What the latest scan says of the echo that it holds; none before the first scan.
    echo: Option<Option<EchoChoice>>,
    pass: Option<RowPass>,
    /// The same by the rig's speed, while the encoder that the pass goes by has not counted yet.
    fallback: Option<Box<RowPass>>,
    /// The pass before its first line, while the first reading of the encoder that the rig has may still come.
    untouched: Option<Box<RowPass>>,
    calibration: Option<Calibration>,
    class: Option<RowClass>,
}

impl Pipeline {
    /// A pipeline for the rig's scanner number `mount_index` (from 0).
    pub fn new(
        rig: Option<&Rig>,
        mount_index: usize,
        calibration: Option<Calibration>,
    ) -> Result<Self, PipelineError> {
        Self::with_parameters(rig, mount_index, calibration, Parameters::default())
    }

    /// A pipeline with other settings than the default ones.
    pub fn with_parameters(
        rig: Option<&Rig>,
        mount_index: usize,
        calibration: Option<Calibration>,
        parameters: Parameters,
    ) -> Result<Self, PipelineError> {
        parameters.validate()?;
        if let Some(calibration) = &calibration {
            calibration.validate()?;
        }
        let pass = rig.map(|rig| RowPass::new(rig, mount_index, parameters)).transpose()?;
        Ok(Self {
            counting: Counting::default(),
            beside: None,
            gate: Gate::default(),
            link: None,
            ranges: Ranges::default(),
            latest: None,
            echo: None,
            pass,
            fallback: None,
            untouched: None,
            calibration,
            class: None,
        })
    }

    /// Measures by these estimators as well, from the next scan on: [`Estimate::measures`]. Without a rig they have nothing to measure.
    #[must_use]
    pub fn with_estimators(mut self, estimators: &[&'static EstimatorInfo]) -> Self {
        if let Some(pass) = &mut self.pass {
            pass.row.measure(estimators);
        }
        self
    }

    /// Tells the canopy by height as well, in bands of 0.1 to 0.5 m, from the next scan on: [`Estimate::profile`]. Without a rig there is nothing to measure.
    ///
    /// # Errors
    /// A band that is too low or too high.
    pub fn with_profile(mut self, band_m: f64) -> Result<Self, PipelineError> {
        if let Some(pass) = &mut self.pass {
            pass.row.profile_by_height(band_m)?;
        }
        Ok(self)
    }

    /// Says what canopy it is. No number depends on it: the row is compared with the class that the leaf area holds for, and warnings and the
    /// width of the interval tell the outcome. Of a class that is nearly all wood no leaf area is told without a calibration.
    #[must_use]
    pub fn of_class(self, class: RowClass) -> Self {
        Self { class: Some(class), ..self }
    }

    /// Looks for trees in the data as well, from the next scan on: [`Estimate::trees_found`].
    #[must_use]
    pub fn with_trees_found(mut self, methods: &[CutMethod]) -> Self {
        if let Some(pass) = &mut self.pass {
            pass.row.find_trees(methods);
        }
        self
    }

    /// Keeps the voxels of each slice, from the next scan on, for [`other_side`](Self::other_side).
    #[must_use]
    pub fn keeping_voxels(mut self) -> Self {
        if let Some(pass) = &mut self.pass {
            pass.row.keep_voxels(pass.mount.row);
        }
        self
    }

    /// What this pass saw, for one that drives along the same row: of a pipeline that [keeps voxels](Self::keeping_voxels), once it is finished. Its rig is
    /// that of [`Heading::rig`].
    ///
    /// # Errors
    /// Why an estimate of these scans would tell nothing.
    pub fn other_side(&self, heading: Heading) -> Result<OtherSide, Withheld> {
        let (pass, _) = self.pass_that_counts();
        let pass = report::areas_told(&self.counting, &self.gate, pass)?;
        let kept = pass.row.kept().ok_or(Withheld::NotScanned)?;
        let told = Law::of(pass, self.calibration.as_ref(), self.class.as_ref()).told();
        Ok(OtherSide::new(kept.clone(), heading, told.err()))
    }

    /// Joins what another pass saw of the row with what this one sees, from the next scan on: [`Estimate::other_side`].
    ///
    /// # Errors
    /// No rig, or voxels of another size than the other pass has.
    pub fn joined_with(mut self, other: Arc<OtherSide>) -> Result<Self, PipelineError> {
        let pass = self.pass.as_mut().ok_or(PipelineError::SidesWithoutRig)?;
        let row = pass.mount.row;
        pass.row.join(other, row)?;
        Ok(self)
    }

    /// Edge of the voxels across the row and in height, as it was asked for, metres; `None` without a rig.
    pub fn voxel_m(&self) -> Option<f64> {
        self.pass.as_ref().map(|pass| pass.row.voxel_m())
    }

    /// Length of the slices that the row is cut into, metres; `None` without a rig.
    pub fn slice_m(&self) -> Option<f64> {
        self.pass.as_ref().map(|pass| pass.row.cut().slice_m())
    }

    /// Leaves out scans whose beams point outside this field, from the next one on.
    #[must_use]
    pub fn within_field(mut self, field: Field) -> Self {
        self.gate.within(field);
        self
    }

    /// Takes this frequency, scans a second, where the scans state none.
    #[must_use]
    pub fn at_frequency(mut self, frequency_hz: f64) -> Self {
        self.counting.assume_hz(frequency_hz);
        self
    }

    /// Takes the advance from the encoder in the scans and from nothing else, from the first scan on.
    #[must_use]
    pub fn by_encoder_only(mut self) -> Self {
        if let Some(pass) = &mut self.pass {
            pass.odometry = Odometry::default().with_encoder(EncoderChoice::Only);
        }
        self
    }

    /// Takes note of what the scanner says of its settings, before its first scan. One that refused the echo it was asked for, and sends another one by itself,
    /// leaves unknown which its scans hold: beams with a width then tell no leaf area.
    pub fn set_up(&mut self, notes: &[SettingNote]) {
        if let Some(pass) = self.pass.as_mut().filter(|_| notes.iter().any(SettingNote::refuses_echo)) {
            let model = AnyModel::by_name(&pass.mount.model);
            if model.is_none_or(|model| !model.optics().factory_echo.begins_with_first()) {
                pass.row.forget_echo();
            }
        }
    }

    /// Takes the next scan, in the order of reception. The advance is the encoder's where the rig knows one and the scan has its
    /// reading, else the rig's speed times the device's time. An encoder that never counts over a metre of the rig's speed is taken for dead.
    pub fn push(&mut self, scan: &Scan) {
        self.take(scan, None);
    }

    /// Takes the next scan with the ground speed that something else measured; from the first scan on the advance is taken from that.
    pub fn push_at_speed(&mut self, scan: &Scan, speed: GroundSpeed) {
        self.take(scan, Some(speed));
    }

    /// Hears the ground speed that something measured at the next scan, beside the way that the estimate goes by: where both tell another way, it warns.
    pub fn hear_speed(&mut self, speed: GroundSpeed) {
        self.beside = Some(speed);
    }

    /// Takes note of a scan telegram that gives no scan, in the order of reception.
    pub fn push_unreadable(&mut self, fault: &ScanFault) {
        self.gate.unreadable(fault);
    }

    /// Takes note of what a scan says of the echo that it holds. From the first scan on that holds, whatever the rig or the model say. Where it changes on the
    /// way, some scans hold another echo than the rest, or nobody knows.
    fn hear_echo(&mut self, echo: Option<EchoChoice>) {
        let before = self.echo.replace(echo);
        if before == Some(echo) {
            return;
        }
        let passes = self.pass.iter_mut().chain(self.fallback.as_deref_mut());
        for pass in passes.chain(self.untouched.as_deref_mut()) {
            match (before, echo) {
                (None, None) => {}
                (None, Some(echo)) => pass.tell_echo(echo),
                (Some(_), told) if told.is_some() && told == pass.row.echo() => {}
                (Some(_), _) => pass.row.forget_echo(),
            }
        }
    }

    fn take(&mut self, scan: &Scan, speed: Option<GroundSpeed>) {
        let beside = self.beside.take();
        self.hear_echo(scan.echo);
        let restarts = self.counting.restarts;
        let turn = self.counting.observe(scan);
        self.latest = Some(LatestScan { beams: scan.beams, frequency_hz: self.counting.nominal_hz(scan) });
        let Turn::Line { travel_s, link } = turn else { return };
        let link = self.link.take().map_or(link, |before| before.and(link));
        if link == Link::Broken {
            self.gate.restart();
        }
        let excluded = self.gate.judge(scan);
        match excluded {
            Some(why) => {
                self.gate.leave_out(why);
                self.link = Some(link);
            }
            None => self.gate.take(scan),
        }
        let (range_m, remission) =
            scan.echoes.first().map_or((&[][..], &[][..]), |echo| (&echo.range_m, &echo.remission));
        // What stands beyond the grid has no angle.
        let range_m = range_m.get(..scan.beams.len()).unwrap_or(range_m);
        if excluded.is_none() {
            self.ranges.add(range_m);
        }
        let Some(pass) = &mut self.pass else { return };
        if self.counting.restarts > restarts {
            pass.odometry.restart();
        }
        if travel_s > READING_AWAITED_S {
            self.untouched = None;
        }
        // The first telegram of an encoder may be lost, or come behind the first scan: the row begins with the first scan that has a reading.
        if !scan.encoders.is_empty()
            && let Some(untouched) = self.untouched.take()
        {
            *pass = *untouched;
        }
        let ticks = scan.encoders.first().map(|reading| reading.position_ticks);
        let unsettled = pass.odometry.source().is_none();
        if unsettled {
            self.fallback = Some(Box::new(pass.without_encoder()));
            let may_come = ticks.is_none() && speed.is_none() && pass.odometry.wants_encoder(&pass.rig);
            self.untouched = may_come.then(|| Box::new(pass.clone()));
        }
        let nominal_step_m = pass.rig.speed_m_s * nominal_period_s(self.counting.nominal_hz(scan));
        let y_m = pass.odometry.y_m(&pass.rig, ticks, travel_s, speed);
        if unsettled {
            pass.settle_source();
        }
        if !pass.odometry.may_be_dead() {
            self.fallback = None;
        }
        self.gate.line(excluded, y_m, travel_s, pass.advance.longest_m(nominal_step_m));
        let fallback_y_m =
            self.fallback.as_mut().map(|pass| pass.odometry.y_m(&pass.rig, ticks, travel_s, None));
        pass.beside.observe(travel_s, (y_m, pass.odometry.source()), beside);
        if let Some((pass, y_m)) = self.fallback.as_mut().zip(fallback_y_m) {
            pass.beside.observe(travel_s, (y_m, pass.odometry.source()), beside);
        }
        if excluded.is_some() {
            return;
        }
        if let (Some(AdvanceSource::Encoder), Some(ticks)) = (pass.odometry.source(), ticks) {
            let line_m = nominal_step_m * pass.turns_a_line;
            pass.witness.observe(ticks, Counted { y_m, travel_s }, line_m, scan.beams, range_m);
        }
        pass.open(y_m, link, nominal_step_m, scan.beams, range_m, remission);
        if let Some((pass, y_m)) = self.fallback.as_mut().zip(fallback_y_m) {
            pass.open(y_m, link, nominal_step_m, scan.beams, range_m, remission);
        }
    }

    /// Scans that the estimate is made of: those left out and repeated ones are not among them.
    pub fn valid_scans(&self) -> u64 {
        self.gate.valid
    }

    /// The estimate as if the stream ended here. Costs a copy of the sums; the stream goes on untouched.
    pub fn estimate(&self) -> Estimate {
        self.clone().finish()
    }

    /// Ends the stream: closes the last line and slice. Scans may still follow, as a new stretch of the same row.
    pub fn finish(&mut self) -> Estimate {
        for pass in self.pass.iter_mut().chain(self.fallback.as_deref_mut()) {
            pass.close();
        }
        let (pass, dead) = self.pass_that_counts();
        let mut estimate = report::estimate(
            &self.counting,
            &self.gate,
            self.ranges(),
            self.latest,
            pass,
            self.calibration.as_ref(),
            self.class.as_ref(),
        );
        if dead {
            estimate.warnings.push(Warning::EncoderStood { lines: self.gate.valid });
        }
        estimate
    }

    /// How far the stream has come.
    pub fn progress(&self) -> Progress {
        Progress {
            scans: self.counting.scans,
            scans_repeated: self.counting.repeated,
            scans_lost: self.counting.all_lost(),
            turns_left_out: self.counting.turns_left_out(),
            advance_m: self.pass.as_ref().map(|pass| pass.advance.advance_m().unwrap_or(0.0)),
            y_m: self.pass.as_ref().and_then(|pass| pass.advance.y_m()),
            impacted_total_area_m2: self.pass.as_ref().map(|pass| pass.row.totals().impacted_m2),
        }
    }

    /// The metres of row that the scans so far stand for.
    pub(crate) fn covered_m(&self) -> Option<f64> {
        self.pass.as_ref().and_then(|pass| pass.advance.covered_m())
    }

    /// The pass that an estimate is made of, and whether it is the fallback.
    fn pass_that_counts(&self) -> (Option<&RowPass>, bool) {
        // An encoder that never counted while the rig's speed says that the tractor drove is dead.
        // One that stands before a picture that stands, too, is in order.
        let stands = self.pass.as_ref().is_some_and(|pass| pass.witness.stands());
        let dead = self
            .fallback
            .as_deref()
            .filter(|by_speed| !stands && by_speed.advance.advance_m() >= Some(DEAD_AFTER_M));
        (dead.or(self.pass.as_ref()), dead.is_some())
    }

    /// The canopy just driven past. Nothing is allocated.
    ///
    /// # Errors
    /// Why an estimate of the scans so far would tell nothing of the row. The leaf area has a reason of its own: [`Window::leaf`].
    pub fn window(&self) -> Result<Window, Withheld> {
        let (pass, _) = self.pass_that_counts();
        let pass = report::areas_told(&self.counting, &self.gate, pass)?;
        let law = Law::of(pass, self.calibration.as_ref(), self.class.as_ref());
        let leaf = LeafWindow::of(&law, pass.row.window_slices(), pass.row.y_m(), pass.mirror_y_m());
        Ok(Window::of(pass.row.window(), leaf))
    }

    /// What the advance is taken from, and the speed it has at the latest scan, m/s; `None` before the first one.
    pub fn ground_speed(&self) -> Option<GroundSpeed> {
        let odometry = &self.pass.as_ref()?.odometry;
        Some(GroundSpeed { source: odometry.source()?, speed_m_s: Some(odometry.speed_m_s()) })
    }

    fn ranges(&self) -> RangeStatistics {
        self.ranges.statistics()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::angle::BeamGrid;
    use rowscan_protocol::scan::Echo;

    #[test]
    fn in_steady_state_no_buffer_grows() {
        let rig = Rig { tree_spacing_m: Some(1.2), row_spacing_m: Some(3.5), ..Rig::default() };
        let all: Vec<_> = crate::estimator::TABLE.iter().collect();
        let mut pipeline = Pipeline::new(Some(&rig), 0, None).unwrap().with_estimators(&all);
        let mut scan = Scan {
            scan_frequency_hz: 50.0,
            beams: BeamGrid::spanning(-450_000, 2_250_000, 5000),
            echoes: vec![Echo { range_m: vec![1.8; 541], remission: Vec::new() }],
            ..Scan::default()
        };
        let mut push = |pipeline: &mut Pipeline, scans: u16| {
            for _ in 0..scans {
                scan.telegram_counter = scan.telegram_counter.wrapping_add(1);
                scan.scan_time_us = scan.scan_time_us.wrapping_add(20_000);
                pipeline.push(&scan);
            }
            let pass = pipeline.pass.as_ref().unwrap();
            let mut capacities = pass.row.capacities();
            capacities.push(pass.open.beams.range_m.capacity());
            capacities
        };
        // Warm after the first slice that lies in two metres.
        let warm = push(&mut pipeline, 200);
        assert_eq!(push(&mut pipeline, 2000), warm);
    }
}
