//! The device's eye: one line from cast to millimetres, through the stages that are on.

use pulp::Arch;
use rowscan_protocol::optics::{DAZZLED, FogFilter, Optics};
use rowscan_protocol::rig::Mount;
use rowscan_protocol::scan::Pose;

use super::air::{self, AirStage, Moment, Shot, Source};
use super::draws::{Draws, LineDraws, Use};
use super::echo::{Rules, nearest};
use super::energy;
use super::footprint::Footprint;
use super::groups::{Grouping, Sums};
use super::ideal::{self, RangeLimits};
use super::noise::UnitNoise;
use super::parts::Parts;
use super::settings::OpticsSettings;
use super::spot::{PHASES, SpotGrid};
use super::stage::Stage;
use super::touch::Echo;
use crate::caster::{BeamFan, Caster, Class, Cone, Return};
use crate::lanes::WIDTH;

/// What of a scanner model its eye needs.
#[derive(Clone, Copy, Debug)]
pub struct EyeModel<'a> {
    /// What light does in it.
    pub optics: &'a Optics,
    /// Echoes it can tell apart.
    pub echoes: u8,
    /// The distances it reports.
    pub limits: RangeLimits,
}

/// Layers whose beams are as far apart but for this share are sampled alike: to make the grid of spots anew takes longer than a turn.
const PITCHES_ALIKE: f64 = 0.01;

/// The least remission of an echo: 1 in 8 bits.
const WEAKEST: u16 = 0x0101;

/// One scanner's eye. It keeps its buffers from line to line.
#[derive(Clone, Debug)]
pub struct Eye {
    settings: OpticsSettings,
    optics: Optics,
    limits: RangeLimits,
    rules: Rules,
    seed: u64,
    unit: u64,
    /// Which way along the row its roof looks.
    roof_sense: f64,
    /// How far the beams of the layer in force leave the plane that the mirror turns in, radians.
    layer_rad: f64,
    /// For the fan in force.
    sight: Option<Sight>,
    air: Option<AirStage>,
    parts: Parts,
    groups: Vec<Sums>,
    echoes: Vec<Echo>,
    /// As many a beam as the receiver tells apart.
    found: Vec<EyeEcho>,
}

/// What the eye keeps for a fan.
#[derive(Clone, Debug)]
struct Sight {
    fan: BeamFan,
    towards_x: bool,
    footprint: Footprint,
    /// Of the beams, out of the mirror's plane.
    bend_rad: f64,
    /// Angle between beams for which the spots are sampled.
    pitch_rad: f64,
    noise: UnitNoise,
}

/// One echo of one beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeEcho {
    /// As measured, whole millimetres; [`ideal::NO_ECHO_MM`] where there is none.
    pub range_mm: u16,
    /// 16-bit scale; 8-bit values stand in both bytes.
    pub remission: u16,
    /// Before noise and rounding, metres; infinite where there is none.
    pub range_m: f64,
    /// Share of the beam that went there.
    pub share: f64,
    /// The surface that returned most of it.
    pub met: Return,
}

impl EyeEcho {
    /// No echo.
    pub const NONE: Self = Self {
        range_mm: ideal::NO_ECHO_MM,
        remission: 0,
        range_m: f64::INFINITY,
        share: 0.0,
        met: Return::MISS,
    };

    /// No echo, for the receiver is dazzled \[ASM\].
    pub const DAZZLED: Self = Self { remission: DAZZLED, ..Self::NONE };
}

impl Eye {
    /// The eye of scanner number `scanner` in a scene with this seed.
    pub fn new(model: EyeModel<'_>, settings: &OpticsSettings, seed: u64, scanner: usize) -> Self {
        let most = if settings.stages.has(Stage::Echoes) { usize::from(model.echoes) } else { 1 };
        let unit = settings.unit_of(seed, scanner);
        let seed = seed ^ (scanner as u64).rotate_left(32);
        Self {
            rules: Rules::of(&model.optics.pulse, settings, most),
            optics: *model.optics,
            limits: model.limits,
            seed,
            unit,
            roof_sense: Mount::default().roof_sense(),
            air: settings.stages.has(Stage::Air).then(|| AirStage::new(&settings.air, model.optics)),
            settings: settings.clone(),
            layer_rad: 0.0,
            sight: None,
            parts: Parts::default(),
            groups: Vec::new(),
            echoes: Vec::new(),
            found: Vec::new(),
        }
    }

    /// The same on a mount whose roof looks this way along the row, [`Mount::roof_sense`]; the default mount's until then.
    #[must_use]
    pub fn under_roof(self, roof_sense: f64) -> Self {
        Self { roof_sense, ..self }
    }

    /// The same for layer number `layer` of a scanner whose layers turn together: each has random numbers of its own, the first those of the eye.
    #[must_use]
    pub fn of_layer(self, layer: usize) -> Self {
        let key = (layer as u64).rotate_left(48);
        Self { seed: self.seed ^ key, unit: self.unit ^ key, sight: None, ..self }
    }

    /// Beams from the next [`turn_to`](Self::turn_to) on leave the plane in which the mirror turns by this angle: ahead, along the fan's +Y, where it is
    /// positive. So does a layer of a scanner with several.
    pub fn elevate(&mut self, layer_rad: f64) {
        self.layer_rad = layer_rad;
    }

    /// Other beams from now on; of a scanner that has its row at greater X, or at smaller.
    pub fn turn_to(&mut self, fan: &BeamFan, towards_x: bool) {
        let bend_rad = self.bend_rad() + self.layer_rad;
        let pitch_rad = fan.step_rad().abs() * Cone::pitch(bend_rad);
        let same = |sight: &Sight| {
            let alike = (pitch_rad / sight.pitch_rad - 1.0).abs() < PITCHES_ALIKE;
            sight.fan.len() == fan.len() && sight.fan.step_rad().abs() == fan.step_rad().abs() && alike
        };
        let leans_only = |sight: &&mut Sight| sight.fan.is_turned_as(fan) && sight.bend_rad == bend_rad;
        if let Some(sight) = self.sight.as_mut().filter(leans_only) {
            // Only the plane leans otherwise.
            sight.footprint.lean(fan);
            (sight.fan, sight.towards_x) = (fan.clone(), towards_x);
            return;
        }
        if let Some(sight) = self.sight.as_mut().filter(|sight| same(sight)) {
            // The same beams, tilted: spots and errors stay.
            sight.footprint.tilt(fan, bend_rad);
            (sight.fan, sight.towards_x, sight.bend_rad) = (fan.clone(), towards_x, bend_rad);
            return;
        }
        let grid = if self.settings.stages.has(Stage::Spot) {
            SpotGrid::new(&self.optics.spot, &self.settings, pitch_rad)
        } else {
            SpotGrid::thin(pitch_rad)
        };
        let noise = UnitNoise::new(&self.optics, self.settings.noise, self.unit, fan.len());
        let footprint = Footprint::new(grid, fan, bend_rad);
        self.sight = Some(Sight { fan: fan.clone(), towards_x, footprint, bend_rad, pitch_rad, noise });
    }

    /// Lines from now on are seen through what nozzles spray at this moment of the drive; `duty` is what each plume's source says, 0 to 1 and more.
    pub fn spray(&mut self, drive: Moment, duty: &dyn Fn(Source) -> Option<f64>) {
        if let Some(air) = &mut self.air {
            air.spray(drive, duty);
        }
    }

    /// Lines from now on are measured with the fog filter, or without.
    pub fn suppress_fog(&mut self, on: bool) {
        self.rules.fog = if on { self.optics.fog_filter } else { FogFilter::None };
    }

    /// Looks: beam 0 starts at `origin`, each next one `advance_m` farther along Y. `scan` is the key of the line's random numbers.
    pub fn look(&mut self, caster: &Caster, origin: Pose, advance_m: f64, scan: u64) {
        let Some(mut sight) = self.sight.take() else { return };
        let phase = (Draws::of(self.seed, Use::Phase, scan).unit() * PHASES as f64) as usize;
        let Self { settings, .. } = &*self;
        let (reflectance, wetness) = (settings.reflectance, settings.wetness);
        let by_surface = settings.stages.has(Stage::Energy);
        let dry_or_wet: [f64; Class::ALL.len()] =
            std::array::from_fn(|class| reflectance.of(Class::ALL[class], wetness));
        sight.footprint.cast(caster, origin, advance_m, phase, |found| {
            if by_surface { dry_or_wet[found.class as usize] * f64::from(found.cos_incidence) } else { 1.0 }
        });
        self.found.clear();
        let beams = sight.footprint.beams();
        self.found.resize(beams * self.rules.most, EyeEcho::NONE);
        let draws = LineDraws::of(self.seed, scan);
        for row in 0..beams.div_ceil(WIDTH) {
            self.gather(row, &sight, scan);
            for (lane, beam) in (row * WIDTH..beams).take(WIDTH).enumerate() {
                self.see(beam, lane, &sight, &draws);
            }
        }
        self.sight = Some(sight);
    }

    /// Gathers what eight beams met, in groups that are one pulse each.
    fn gather(&mut self, row: usize, sight: &Sight, scan: u64) {
        let Self { settings, limits, rules, seed, air, parts, groups, .. } = self;
        let Sight { fan, towards_x, footprint, .. } = sight;
        footprint.gather(row, parts);
        if let Some(air) = air.as_ref().filter(|air| !air.is_clear()) {
            for (lane, beam) in (row * WIDTH..footprint.beams()).take(WIDTH).enumerate() {
                let theta_rad = fan.theta_rad(beam);
                // Nozzles and windows are the scanner's: they count from the row.
                let theta_rad = if *towards_x { theta_rad } else { std::f64::consts::PI - theta_rad };
                air.act(Shot { seed: *seed, scan, beam, theta_rad }, parts, lane);
            }
        }
        // What is too near is not measured, though it stands in the way.
        parts.forget_nearer(limits.min_range_m);
        if settings.stages.has(Stage::Echoes) && rules.groups_returns() {
            Arch::new().dispatch(Grouping { parts, merged_m: rules.merged_m, groups });
        }
    }

    /// Beam `lane` of the eight that have been gathered.
    fn see(&mut self, beam: usize, lane: usize, sight: &Sight, draws: &LineDraws) {
        let Sight { fan, footprint, noise, .. } = sight;
        let stages = self.settings.stages;
        let mut rules = self.rules;
        if stages.has(Stage::Energy) {
            let normal = draws.threshold.beam(beam).normal();
            rules.least_power = energy::threshold(&self.optics, normal);
        }
        if self
            .air
            .as_ref()
            .is_some_and(|air| air.is_blinded(fan.theta_rad(beam), self.layer_rad, fan.axes()))
        {
            if draws.sun.beam(beam).unit() < air::DAZZLED_SHARE {
                if let Some(first) = self.found.get_mut(beam * rules.most) {
                    *first = EyeEcho::DAZZLED;
                }
                return;
            }
            rules.least_power *= air::POWER_FACTOR;
        }
        if stages.has(Stage::Echoes) {
            rules.echoes(&self.groups, &self.parts, lane, &mut self.echoes);
        } else {
            nearest(self.parts.beam(lane), &mut self.echoes);
            self.echoes.retain(|echo| rules.detects(echo));
        }
        let Self { settings, optics, limits, echoes, found, .. } = self;
        let measured = Measured { settings, optics, limits: *limits, noise, draws, beam };
        let places = found.iter_mut().skip(beam * rules.most).take(rules.most);
        for (number, (place, echo)) in places.zip(&*echoes).enumerate() {
            *place = measured.of(number, echo, footprint.met(echo.ray));
        }
    }

    /// How far every beam of this unit leaves the plane that the mirror turns in, radians; ahead where positive. A unit's cone opens towards its
    /// roof or its floor, by an angle of its own. 0 unless the settings ask for a bent plane and the model's is.
    pub fn bend_rad(&self) -> f64 {
        let bends = self.settings.bent_plane && self.settings.stages.has(Stage::Spot);
        let part = 2.0 * Draws::of(self.unit, Use::Bend, 0).unit() - 1.0;
        let to_floor = -self.roof_sense;
        if bends { to_floor * (part * self.optics.bend_deg.value).to_radians() } else { 0.0 }
    }

    /// Planes of a line, and rays cast in each; 0 before the first [`turn_to`](Self::turn_to).
    pub fn rays(&self) -> [usize; 2] {
        self.sight.as_ref().map_or([0; 2], |sight| sight.footprint.rays())
    }

    /// Echoes that the receiver tells apart.
    pub fn depth(&self) -> usize {
        self.rules.most
    }

    /// The echoes of a beam in the line last looked at, nearest first.
    pub fn beam(&self, beam: usize) -> &[EyeEcho] {
        let most = self.rules.most;
        self.found.get(beam * most..(beam + 1) * most).unwrap_or(&[])
    }

    /// Writes echo number `number` of every beam.
    pub fn write(&self, number: usize, range_mm: &mut Vec<u16>, remission: &mut Vec<u16>) {
        let echoes = || self.found.iter().skip(number).step_by(self.rules.most.max(1));
        range_mm.clear();
        range_mm.extend(echoes().map(|echo| echo.range_mm));
        remission.clear();
        remission.extend(echoes().map(|echo| echo.remission));
    }
}

/// From echoes to what the scanner says of them.
struct Measured<'a> {
    settings: &'a OpticsSettings,
    optics: &'a Optics,
    limits: RangeLimits,
    noise: &'a UnitNoise,
    draws: &'a LineDraws,
    beam: usize,
}

impl Measured<'_> {
    fn of(&self, number: usize, echo: &Echo, met: Return) -> EyeEcho {
        let Self { settings, optics, limits, .. } = self;
        let stages = settings.stages;
        let of = |draws: Draws| draws.beam(self.beam).echo(number);
        let mut range_m = echo.range_m;
        let mut scatter = 0.0;
        if stages.has(Stage::Noise) {
            let weakness = if stages.has(Stage::Energy) { optics.least_power() / echo.power } else { 0.0 };
            // Drops have no slant.
            let cos_incidence = if met.is_hit() { f64::from(met.cos_incidence) } else { 1.0 };
            let sigma_mm = self.noise.sigma_mm(range_m, cos_incidence, weakness);
            let mut white = of(self.draws.white);
            let error_mm = self.noise.draw(&mut white) * sigma_mm + self.noise.fixed_mm(self.beam, range_m);
            // Noise moves an echo, it does not take it away.
            range_m = (range_m + 1e-3 * error_mm).clamp(limits.min_range_m, limits.max_range_m.max(range_m));
            scatter = of(self.draws.remission).normal();
        }
        let range_mm = ideal::millimetres(range_m, *limits);
        if range_mm == ideal::NO_ECHO_MM {
            return EyeEcho::NONE;
        }
        let remission = if !stages.has(Stage::Energy) {
            ideal::remission(&met).max(WEAKEST)
        } else if energy::dazzles(echo.power, echo.range_m) {
            DAZZLED
        } else {
            energy::remission(optics, echo.power, echo.range_m, echo.spread_m, scatter)
        };
        EyeEcho { range_mm, remission, range_m: echo.range_m, share: echo.share, met }
    }
}
