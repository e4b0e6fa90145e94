//! One row in one of the paper's six scans, offline: its areas, and whatever is kept of its lines.

use rowscan_emulator::stage::Stage;
use rowscan_protocol::model::{AnyModel, UnknownModel};
use rowscan_scenes::caster::Class;
use rowscan_scenes::optics::{EyeCaster, EyeModel, RangeLimits, Stages};
use rowscan_scenes::scan::{
    CastLine, Casts, LAYERS, MeshError, ScanAreas, ScanError, ScanKind, ScanPlan, ScanSettings, Target,
    WoodTest,
};
use rowscan_scenes::{Beams, Scene, TruthGrid};
use serde::Serialize;

/// Why a row cannot be scanned so.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RowScanError {
    /// It cannot be laid out.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// A wood test that cannot be.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The rig's scanner is no model.
    #[error(transparent)]
    Model(#[from] UnknownModel),
    /// Beams that the optics cannot widen.
    #[error(
        "optics {0} need the beams of a mirror and exact wood: expected --type lateral, opposite or zenith and --wood exact, or --optics ideal"
    )]
    Optics(Stages),
}

/// How a scan of this kind is laid out unless told otherwise: at the distance and height of the rig's first scanner.
pub fn settings(scene: &Scene, kind: ScanKind) -> ScanSettings {
    let base = ScanSettings { kind, dy_m: 0.02, dtheta_deg: 0.5, pitch_m: 0.01, ..Default::default() };
    match scene.resolved_rig().scanners.first() {
        Some(mount) => ScanSettings { distance_m: mount.distance_m, height_m: mount.height_m, ..base },
        None => base,
    }
}

/// A scan of one row, laid out.
pub struct RowScan<'a> {
    stage: &'a Stage,
    row: usize,
    plan: ScanPlan,
    caster: Box<dyn Casts>,
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct Scanned {
    /// Which of the six types.
    #[serde(rename = "type")]
    pub kind: ScanKind,
    /// The row, from 0.
    pub row: usize,
    /// Seed of the orchard.
    pub seed: u64,
    /// Lines along the row.
    pub lines: usize,
    /// Beams of a line.
    pub beams: usize,
    /// Advance from line to line, metres.
    pub dy_m: f64,
    /// What is swept at the first beam: degrees, or metres.
    pub range_from: f64,
    /// The same at the last.
    pub range_to: f64,
    /// Where the first line is cast from, across the row, metres.
    pub origin_x_m: f64,
    /// The same, up.
    pub origin_z_m: f64,
    /// Beams that met a leaf first.
    pub leaf_hits: usize,
    /// A branch.
    pub wood_hits: usize,
    /// A fruit.
    pub fruit_hits: usize,
    /// A post or a wire.
    pub support_hits: usize,
    /// Grass.
    pub grass_hits: usize,
    /// The ground.
    pub ground_hits: usize,
    /// Nothing.
    pub escapes: usize,
    /// Its impacted areas.
    #[serde(flatten)]
    pub areas: ScanAreas,
    /// The row's leaf area, m².
    pub leaf_area_m2: f64,
}

/// One line that was cast.
struct Cast<T> {
    areas: ScanAreas,
    /// Beams by class of what they met first.
    counts: Vec<(Class, usize)>,
    kept: T,
}

impl Scanned {
    /// True if no beam met a plant or what holds it.
    pub fn is_blind(&self) -> bool {
        self.leaf_hits + self.wood_hits + self.fruit_hits + self.support_hits == 0
    }
}

impl<'a> RowScan<'a> {
    /// Lays a scan of a row out.
    ///
    /// # Errors
    /// Settings without sense, a row that is not there, optics that need other beams.
    pub fn new(stage: &'a Stage, row: usize, settings: &ScanSettings) -> Result<Self, RowScanError> {
        let kind = settings.kind;
        let target = Target::row(&stage.orchard, row).ok_or(ScanError::NothingThere { kind })?;
        let plan = ScanPlan::new(&target, settings)?;
        let caster = caster(stage, &plan)?;
        Ok(Self { stage, row, plan, caster })
    }

    /// How it is laid out.
    pub fn plan(&self) -> &ScanPlan {
        &self.plan
    }

    /// Casts all lines; what `keep` keeps of each, in their order.
    pub fn lines<T: Send>(&self, keep: impl Fn(&CastLine<'_>) -> T + Sync) -> (Scanned, Vec<T>) {
        let cast = self.plan.lines(self.caster.as_ref(), LAYERS, |line| {
            let of_class = |class| line.layers.nearest().iter().filter(|found| found.class == class).count();
            Cast {
                areas: self.plan.line_areas(line.layers),
                counts: Class::ALL.iter().map(|class| (*class, of_class(*class))).collect(),
                kept: keep(&line),
            }
        });
        let scanned = self.scanned(&cast);
        (scanned, cast.into_iter().map(|line| line.kept).collect())
    }

    fn scanned<T>(&self, cast: &[Cast<T>]) -> Scanned {
        let Self { stage, row, plan, .. } = self;
        let total = |wanted: Class| -> usize {
            let counts = cast.iter().flat_map(|line| &line.counts);
            counts.filter(|(class, _)| *class == wanted).map(|(_, count)| count).sum()
        };
        let (beams, origin) = (plan.beams().len(), plan.origin(0));
        Scanned {
            kind: plan.settings().kind,
            row: *row,
            seed: stage.scene.seed,
            lines: plan.len(),
            beams,
            dy_m: plan.settings().dy_m,
            range_from: plan.swept(0),
            range_to: plan.swept(beams.saturating_sub(1)),
            origin_x_m: origin.x_m,
            origin_z_m: origin.z_m,
            leaf_hits: total(Class::Leaf),
            wood_hits: total(Class::Wood),
            fruit_hits: total(Class::Fruit),
            support_hits: total(Class::Post) + total(Class::Wire),
            grass_hits: total(Class::Grass),
            ground_hits: total(Class::Ground),
            escapes: total(Class::None),
            areas: cast.iter().map(|line| line.areas).sum(),
            leaf_area_m2: stage.orchard.truth_of_row(*row, TruthGrid::default()).leaf_area_m2,
        }
    }
}

/// What casts the beams of a plan: the exact caster, the paper's mesh, or the eye of the rig's scanner.
fn caster(stage: &Stage, plan: &ScanPlan) -> Result<Box<dyn Casts>, RowScanError> {
    let (optics, settings) = (&stage.scene.optics, plan.settings());
    if optics.stages.is_ideal() {
        return Ok(settings.wood.caster(&stage.orchard)?);
    }
    let (Beams::Fan(fan), WoodTest::Exact) = (plan.beams(), settings.wood) else {
        return Err(RowScanError::Optics(optics.stages));
    };
    let mount = stage.rig.scanners.first();
    let model = AnyModel::named(mount.map_or("", |mount| mount.model.as_str()))?;
    let (min_range_m, max_range_m) = model.range_m();
    let limits = RangeLimits { min_range_m, max_range_m };
    let eye = EyeModel { optics: model.optics(), echoes: model.echoes(), limits };
    let towards_x = settings.kind != ScanKind::Opposite;
    let caster = EyeCaster::new(stage.caster().clone(), eye, optics, stage.scene.seed, fan, towards_x);
    Ok(Box::new(caster.asked_for(mount.and_then(|mount| mount.echo))))
}
