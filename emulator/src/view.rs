//! What the scanner sees: the orchard through the caster and the optics, from where the tractor stands.

use std::sync::Arc;
use std::time::Duration;

use rowscan_protocol::angle::BeamGrid;
use rowscan_protocol::device::{MeasuredEcho, MeasuredLine, Mirror};
use rowscan_protocol::rig::{Attitude, Axes, Mount, Rig, RowSide};
use rowscan_protocol::scan::{LEVEL_DEG, Pose};
use rowscan_protocol::time::SimTime;
use rowscan_scenes::optics::{self, Eye, RangeLimits};
use rowscan_scenes::{BeamFan, Caster, Cone, Lean, Orchard, Return, Scratch, Wind};
use rowscan_vehicle::Tractor;
use rowscan_vehicle::encoder::Encoder;
use rowscan_vehicle::trajectory::{Alley, Course};

use crate::sight::Sight;

/// One scanner's view of an orchard.
#[derive(Debug)]
pub struct ScannerView {
    caster: Arc<Caster>,
    /// What there is where no rows are: bare ground.
    headland: Caster,
    tractor: Tractor,
    encoder: Encoder,
    mount: Mount,
    row_spacing_m: f64,
    /// How much the ground rises a metre along X.
    rise: f64,
    tree_spacing_m: f64,
    wind: (Wind, u64),
    limits: RangeLimits,
    scratch: Scratch,
    /// The device's eye as it was handed in; without it, the ideal scanner's.
    eye: Option<Eye>,
    /// The lines of a turn, a layer each; never empty.
    lines: Vec<Line>,
}

/// A line of one layer, and what it takes to cast the next one.
#[derive(Debug)]
struct Line {
    fan: BeamFan,
    /// The fan's beams where the layer is inclined.
    cone: Cone,
    returns: Vec<Return>,
    eye: Option<Eye>,
    /// First echo first; never empty.
    echoes: Vec<MeasuredEcho>,
    seen: Option<(Mirror, Viewpoint)>,
}

impl Line {
    /// Through this eye, of layer number `layer` of a turn.
    fn new(eye: Option<Eye>, layer: usize) -> Self {
        let depth = eye.as_ref().map_or(1, Eye::depth);
        Self {
            fan: BeamFan::from_degrees(0.0, 0.0, 0),
            cone: Cone::new(&BeamFan::from_degrees(0.0, 0.0, 0), 0.0),
            returns: Vec::new(),
            eye: eye.map(|eye| eye.of_layer(layer)),
            echoes: vec![MeasuredEcho::default(); depth],
            seen: None,
        }
    }

    /// Points its beams, unless they are pointed so.
    fn turn_to(&mut self, mount: &Mount, mirror: Mirror, view: Viewpoint) {
        let stale = |(before, from): (Mirror, Viewpoint)| {
            before.beams != mirror.beams || from.towards_x != view.towards_x || from.tilt_rad != view.tilt_rad
        };
        if self.seen.is_none_or(stale) {
            self.fan = BeamFan::tilted(mount, mirror.beams, view.towards_x, view.tilt_rad);
            self.returns.resize(mirror.beams.len(), Return::MISS);
        }
        self.fan.lean(view.axes);
        let other = |(_, from): (Mirror, Viewpoint)| (from.axes, from.bend_rad) != (view.axes, view.bend_rad);
        let turned = self.seen.is_none_or(|seen| stale(seen) || other(seen));
        if let Some(eye) = self.eye.as_mut().filter(|_| turned) {
            eye.elevate(view.bend_rad);
            eye.turn_to(&self.fan, view.towards_x);
        } else if turned && view.bend_rad != 0.0 {
            self.cone = Cone::new(&self.fan, view.bend_rad);
        }
        self.fan.advance(view.advance_m);
    }

    /// Casts it past what `caster` holds, without an eye.
    fn cast(&mut self, caster: &Caster, view: Viewpoint, limits: RangeLimits, scratch: &mut Scratch) {
        if view.bend_rad == 0.0 {
            caster.cast(view.pose, &self.fan, scratch, &mut self.returns);
        } else {
            self.cone.cast(caster, (view.pose, 0.0), view.advance_m, scratch, &mut self.returns);
        }
        for echo in &mut self.echoes {
            optics::measure(&self.returns, limits, &mut echo.range_mm, &mut echo.remission);
        }
    }

    fn measured(&self) -> MeasuredLine<'_> {
        let grid = self.seen.map_or_else(BeamGrid::default, |(mirror, _)| mirror.beams);
        MeasuredLine { grid, echoes: &self.echoes }
    }
}

/// Trees that lean about their feet are seen as upright ones are by a scanner that is turned back about them by as much.
fn before_trees(pose: Pose, [row_m, foot_m]: [f64; 2], lean: Lean) -> Pose {
    if lean == Lean::default() {
        return pose;
    }
    let Pose { x_m, y_m, z_m } = pose;
    let (from_row_m, up_m) = (x_m - row_m, z_m - foot_m);
    Pose { x_m: x_m - up_m * lean.across, y_m: y_m - up_m * lean.along, z_m: z_m + from_row_m * lean.across }
}

/// What a view without echoes shows.
static NO_ECHO: MeasuredEcho = MeasuredEcho { range_mm: Vec::new(), remission: Vec::new() };

/// From where a line is cast, and which way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Viewpoint {
    pose: Pose,
    towards_x: bool,
    /// Metres along +Y from beam to beam.
    advance_m: f64,
    headland: bool,
    /// From +X towards +Z, by which the tractor has rolled, radians.
    tilt_rad: f64,
    /// Of that, what stands for trees that lean.
    lean_rad: f64,
    /// The scan plane's axes where that leans; the tilt is in them.
    axes: Option<Axes>,
    /// How far the beams of its layer leave that plane along +Y, radians.
    bend_rad: f64,
    /// Nanoseconds since the tractor began to drive: the key of the eye's random numbers. 0 without an eye.
    moment: u64,
    /// How often nozzles have been told otherwise; 0 without an eye.
    nozzle_changes: u64,
}

/// Why a rig cannot carry this scanner.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ViewError {
    /// The rig has fewer scanners.
    #[error("there is no scanner {index}: expected a number below {found}, the count of the rig's scanners")]
    NoSuchScanner {
        /// The scanner asked for, from 0.
        index: usize,
        /// How many there are.
        found: usize,
    },
}

impl ScannerView {
    /// The view of the rig's scanner number `index`, a device that reports these distances.
    pub fn new(
        caster: Arc<Caster>,
        tractor: Tractor,
        rig: &Rig,
        index: usize,
        limits: RangeLimits,
    ) -> Result<Self, ViewError> {
        let mount = rig
            .scanners
            .get(index)
            .cloned()
            .ok_or(ViewError::NoSuchScanner { index, found: rig.scanners.len() })?;
        Ok(Self {
            caster,
            headland: Caster::new(&Orchard::from_organs(Vec::new(), Vec::new(), f64::INFINITY)),
            tractor,
            encoder: Encoder::default(),
            mount,
            row_spacing_m: rig.row_spacing_m.unwrap_or(Course::default().row_spacing_m),
            rise: 0.0,
            tree_spacing_m: rig.tree_spacing_m.unwrap_or(1.0),
            wind: (Wind::default(), 0),
            limits,
            scratch: Scratch::default(),
            eye: None,
            lines: vec![Line::new(None, 0)],
        })
    }

    /// The same with this encoder on the wheel.
    #[must_use]
    pub fn with_encoder(self, encoder: Encoder) -> Self {
        Self { encoder, ..self }
    }

    /// The same on ground that rises so much a metre along X. The tractor drives level; in each alley, its heights count from the foot of the row on its
    /// left where a scanner looks left, else of the row on its right, as an estimate counts them ([`Rig::stands_at_m`]).
    #[must_use]
    pub fn on_slope(self, rise: f64) -> Self {
        Self { rise, ..self }
    }

    /// The same in wind, in a scene with this seed.
    #[must_use]
    pub fn with_wind(self, wind: Wind, seed: u64) -> Self {
        Self { wind: (wind, seed), ..self }
    }

    /// The same through a device's eye.
    #[must_use]
    pub fn with_eye(self, eye: Option<Eye>) -> Self {
        let lines = vec![Line::new(eye.clone(), 0)];
        Self { eye, lines, ..self }
    }

    /// Casts one line: the mirror's full grid, its first beam at `at`, each beam from where the tractor then is.
    pub fn look(&mut self, mirror: Mirror, at: SimTime) {
        self.look_along(0, mirror, at);
    }

    /// Casts the lines of several layers that turn together; the first is the one that [`line`](Self::line) and all else shows.
    pub fn look_at_layers(&mut self, mirrors: &[Mirror], at: SimTime) {
        while self.lines.len() < mirrors.len() {
            self.lines.push(Line::new(self.eye.clone(), self.lines.len()));
        }
        for (number, mirror) in mirrors.iter().enumerate() {
            self.look_along(number, *mirror, at);
        }
    }

    fn look_along(&mut self, number: usize, mirror: Mirror, at: SimTime) {
        let view = self.view(mirror, at);
        let Self { caster, headland, tractor, mount, limits, scratch, lines, .. } = self;
        let Some(line) = lines.get_mut(number).filter(|line| line.seen != Some((mirror, view))) else {
            return;
        };
        line.turn_to(mount, mirror, view);
        let caster = if view.headland { &*headland } else { &**caster };
        let Some(eye) = &mut line.eye else {
            line.cast(caster, view, *limits, scratch);
            line.seen = Some((mirror, view));
            return;
        };
        eye.suppress_fog(mirror.suppresses_fog);
        let driven_s = Duration::from_nanos(view.moment).as_secs_f64();
        let drive = optics::Moment { driven_s, y_m: view.pose.y_m };
        eye.spray(drive, &|source| match source {
            optics::Source::Plume(number) => tractor.nozzle_duty(number, at),
            optics::Source::Nozzle(number) => Some(tractor.nozzle_flow(number, at)),
        });
        eye.look(caster, view.pose, view.advance_m, view.moment);
        for (number, echo) in line.echoes.iter_mut().enumerate() {
            eye.write(number, &mut echo.range_mm, &mut echo.remission);
        }
        for (beam, met) in line.returns.iter_mut().enumerate() {
            *met = eye.beam(beam).first().map_or(Return::MISS, |echo| echo.met);
        }
        line.seen = Some((mirror, view));
    }

    /// What the eye's random numbers are keyed by: equal online and offline, for the drive begins with the first scan that is taken.
    fn moment(&self, at: SimTime) -> u64 {
        let began = self.tractor.began().filter(|_| self.eye.is_some());
        began.map_or(0, |began| at.0.saturating_sub(began.0))
    }

    fn view(&self, mirror: Mirror, at: SimTime) -> Viewpoint {
        let grid = mirror.beams;
        let beams = grid.len().saturating_sub(1) as f64;
        let sweep_s = beams * grid.step_deg().abs() / 360.0 * mirror.turn_s();
        let motion = self.tractor.motion(at);
        // By the chord, so that first and last beam start exactly where the tractor was.
        let swept_m = self.tractor.motion(at + Duration::from_secs_f64(sweep_s)).way_m - motion.way_m;
        let headland = motion.place.alley.is_none();
        let alley = motion.place.alley.unwrap_or(Alley { number: 0, backwards: false });
        let (row, towards_x) = alley.row_beside(self.mount.row == RowSide::Right);
        let row_m = f64::from(row) * self.row_spacing_m;
        let Pose { x_m, z_m, .. } = self.mount.pose(0.0);
        // The tractor's right is +X on its way ahead; a roll right side down takes what is up to the right, a pitch nose up takes it back.
        let right = if alley.backwards { -1.0 } else { 1.0 };
        let (to_row, pitch) = (if towards_x { 1.0 } else { -1.0 }, motion.pitch_rad.sin());
        let x_m = row_m + to_row * x_m + right * (motion.right_m + z_m * motion.roll_rad.sin());
        let y_m = motion.place.y_m + right * (self.mount.offset_y_m - z_m * pitch);
        // No row stands on a headland, and its ground is level.
        let stands_by = f64::from(motion.place.stands_by.unwrap_or(0));
        let foot_m = self.rise * stands_by * self.row_spacing_m;
        let z_m = foot_m + z_m + motion.up_m + self.mount.offset_y_m * pitch;
        let (tilt_rad, axes) = self.attitude(motion.roll_rad, motion.pitch_rad, right, to_row);
        // What looks ahead looks to smaller Y on the way back.
        let bend_rad = match self.mount.layer_deg(mirror.layer_centideg) {
            0.0 => 0.0,
            layer_deg => right * self.mount.roof_sense() * layer_deg.to_radians(),
        };
        let lean = self.lean(y_m, at);
        let foot = [row_m, self.rise * row_m];
        let (pose, lean_rad) = (before_trees(Pose { x_m, y_m, z_m }, foot, lean), lean.across);
        let tilt_rad = tilt_rad + lean_rad;
        let along_y_m = if alley.backwards { -swept_m } else { swept_m };
        let advance_m = if beams > 0.0 { along_y_m / beams } else { 0.0 };
        let moment = self.moment(at);
        let nozzle_changes = if self.eye.is_some() { self.tractor.nozzle_changes(at) } else { 0 };
        Viewpoint {
            pose,
            towards_x,
            advance_m,
            headland,
            tilt_rad,
            lean_rad,
            axes,
            bend_rad,
            moment,
            nozzle_changes,
        }
    }

    /// How the trees abreast lean in the wind; those behind them are taken to lean alike.
    fn lean(&self, y_m: f64, at: SimTime) -> Lean {
        let (wind, seed) = &self.wind;
        let driven = self.tractor.began().map_or(0, |began| at.0.saturating_sub(began.0));
        wind.lean(
            *seed,
            (y_m / self.tree_spacing_m).floor() as i64,
            Duration::from_nanos(driven).as_secs_f64(),
        )
    }

    /// How far its beams are tilted in a plane square to the row, or the axes of a plane that leans. `right` is where the tractor's right is
    /// along X, `to_row` where the row is.
    fn attitude(&self, roll_rad: f64, pitch_rad: f64, right: f64, to_row: f64) -> (f64, Option<Axes>) {
        let mounted = self.mount.attitude();
        if !mounted.leans() && pitch_rad == 0.0 {
            return (-right * roll_rad - to_row * mounted.roll_rad, None);
        }
        let tractor = Attitude { yaw_rad: 0.0, pitch_rad, roll_rad: right * to_row * roll_rad };
        (0.0, Some(mounted.axes().on(&tractor.axes()).in_scene(to_row, right)))
    }

    /// The scanner's own axes at `at`, in the scene: x straight ahead, y at +90° of its plane, z square to it.
    pub(crate) fn axes_at(&self, mirror: Mirror, at: SimTime) -> [[f64; 3]; 3] {
        let view = self.view(mirror, at);
        let (sense, offset_deg) = self.mount.angle_map();
        let (sense, offset_deg) =
            if view.towards_x { (sense, offset_deg) } else { (-sense, 180.0 - offset_deg) };
        let Axes { to_row, up, .. } = view.axes.unwrap_or(Axes::LEVEL);
        // Straight ahead is 90° as CoLa counts.
        let towards = |device_deg: f64| -> [f64; 3] {
            let (up_share, row_share) =
                ((sense * device_deg + offset_deg).to_radians() + view.tilt_rad - view.lean_rad).sin_cos();
            std::array::from_fn(|k| row_share * to_row[k] + up_share * up[k])
        };
        let (x, y) = (towards(90.0), towards(180.0));
        let z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
        [x, y, z]
    }

    /// How fast the wheel's rim goes at `at`, m/s.
    pub(crate) fn wheel_speed_m_s(&self, at: SimTime) -> f64 {
        self.tractor.motion(at).wheel_speed_m_s
    }

    /// The ticks that the encoder on this tractor's wheel has given by `at`.
    pub fn encoder_ticks(&self, at: SimTime) -> f64 {
        self.tractor.encoder_ticks(&self.encoder, at)
    }

    /// The tractor it rides on.
    pub fn tractor(&self) -> &Tractor {
        &self.tractor
    }

    /// The line that stands for the turn: of a scanner with several layers a turn, the level one.
    fn shown(&self) -> Option<&Line> {
        self.lines.first()
    }

    /// The line last cast, in the device's raw units.
    pub fn line(&self) -> MeasuredLine<'_> {
        let none = MeasuredLine { grid: BeamGrid::default(), echoes: &[] };
        self.shown().map_or(none, Line::measured)
    }

    /// The lines last cast, a layer each.
    pub fn lines(&self) -> Vec<MeasuredLine<'_>> {
        self.lines.iter().map(Line::measured).collect()
    }

    /// What the beams of line number `line` of the turn last cast met, as [`returns`](Self::returns) has it of the first.
    pub fn returns_of(&self, line: usize) -> &[Return] {
        self.lines.get(line).map_or(&[], |line| &line.returns)
    }

    /// Where the beams of the line last cast went out, and which they are; none before the first, and none of a layer that is more than
    /// [`LEVEL_DEG`] inclined, whose beams lie in no plane.
    pub fn sight(&self) -> Option<(BeamGrid, Sight)> {
        let line = self.shown()?;
        let (mirror, view) = line.seen.filter(|(_, view)| view.bend_rad.to_degrees().abs() <= LEVEL_DEG)?;
        let axes = view.axes.unwrap_or(Axes::LEVEL);
        let (first_rad, step_rad) = (line.fan.theta_rad(0), line.fan.step_rad());
        Some((
            mirror.beams,
            Sight { origin: view.pose, axes, first_rad, step_rad, advance_m: view.advance_m },
        ))
    }

    /// Ranges and remissions of the line last cast, first echo.
    pub fn echo(&self) -> &MeasuredEcho {
        self.shown().and_then(|line| line.echoes.first()).unwrap_or(&NO_ECHO)
    }

    /// The line last cast, beam by beam, with what each beam met: of a wide beam, the surface that returned most of its first echo.
    pub fn returns(&self) -> &[Return] {
        self.shown().map_or(&[], |line| &line.returns)
    }
}
