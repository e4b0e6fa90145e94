//! `rowscan study calibration`: fits a calibration to rows driven past in memory.

use std::path::PathBuf;

use rowscan_canopy::calibration::{
    Calibration, CalibrationClass, CanopyClass, ClumpingBy, EchoRule, Provenance,
};
use rowscan_canopy::{FitError, RowClass, Sample};
use rowscan_protocol::angle::exact_step_deg;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{EchoChoice, RemissionReading};
use rowscan_scenes::Scene;
use rowscan_scenes::optics::Stage;
use rowscan_study::class::mean_class;
use rowscan_study::foliage::LaiRange;
use rowscan_study::reading::{reading_remission, rig_with};
use rowscan_study::trial::Trial;
use serde::{Deserialize, Serialize};

use super::keep::KeepArgs;
use super::rows::{Rows, Seeds, tries};
use crate::cli::output::{self, say};
use crate::cli::scene::RowSceneArgs;
use crate::cli::{Failure, Outcome};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    scene: RowSceneArgs,
    /// Seeds of the rows, first..last
    #[arg(long, value_name = "A..B", default_value = "1001..1060")]
    seeds: Seeds,
    /// Dress the rows to leaf area indices drawn from this range, low..high [default: as they grow]
    #[arg(long, value_name = "A..B")]
    lai: Option<LaiRange>,
    /// How close together leaves stand: a constant, or as each row's own scans tell it, for rows of very different densities seen by a device's beams
    #[arg(long, value_enum, default_value_t)]
    clumping: Clumps,
    /// Take the rows' mean wood out of what beams meet before the fit, for rows of very different densities: in thin ones wood is a larger part
    #[arg(long)]
    wood: bool,
    #[command(flatten)]
    keep: KeepArgs,
    /// Write the calibration to this file instead of standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What tells how close together leaves stand.
#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
enum Clumps {
    #[default]
    Constant,
    Scans,
}

/// What a fit takes of a row.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct FittedRow {
    sample: Option<Sample>,
    canopy: CanopyClass,
    line_spacing_m: Option<f64>,
    voxel_m: Option<f64>,
    crown_depth_m: Option<f64>,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let mut scene = args.scene.scene()?;
    args.output.as_deref().map_or(Ok(()), output::can_be_written)?;
    let model = args.scene.any_model(&scene.resolved_rig(), 0)?;
    let seeds = args.seeds.0;
    let range = format!("{}..{}", seeds.first().copied().unwrap_or(0), seeds.last().copied().unwrap_or(0));
    let provenance = Provenance {
        command: format!(
            "rowscan study calibration {} --model {} --seeds {range}{}{}{}{}",
            args.scene.name,
            model.name(),
            args.lai.map(|lai| format!(" --lai {lai}")).unwrap_or_default(),
            match scene.optics.stages {
                stages if stages.is_ideal() => String::new(),
                stages => format!(" --optics {stages}"),
            },
            match args.clumping {
                Clumps::Constant => "",
                Clumps::Scans => " --clumping scans",
            },
            if args.wood { " --wood" } else { "" }
        ),
        seeds: seeds.clone(),
    };
    // Scans of beams that have power tell shares of spots as well.
    let told = rig_with(&scene.resolved_rig(), 0, model.name());
    let has_power = scene.optics.stages.has(Stage::Energy) && reading_remission(&told, 0).is_some();
    if let Some(mount) = scene.rig.scanners.first_mut().filter(|_| has_power) {
        mount.remission = Some(RemissionReading::Model);
    }
    let clumping = match args.clumping {
        Clumps::Constant => ClumpingBy::Constant,
        Clumps::Scans => ClumpingBy::Scans,
    };
    let rows = Rows { seeds, lai: args.lai };
    let wood = args.wood;
    let take = move |trial: &Trial| {
        let sample = Sample::of(&trial.estimate, trial.truth.leaf_area_m2, clumping);
        FittedRow {
            sample: sample
                .map(|sample| Sample { wood_area_m2: wood.then_some(trial.truth.wood_area_m2), ..sample }),
            canopy: trial.class.canopy.clone(),
            line_spacing_m: trial.estimate.contact.and_then(|contact| contact.line_spacing_m),
            voxel_m: trial.estimate.contact.map(|contact| contact.voxel_m),
            crown_depth_m: trial.estimate.crown_depth_m,
        }
    };
    let name = format!("calibration by {clumping:?}, wood {wood}");
    let tried = tries(&scene, &rows, model, None, args.keep.open()?, name, take).await?;
    let (fitted, seeds) = with_samples(tried, &provenance.seeds);
    let provenance = Provenance { seeds, ..provenance };
    let classes: Vec<RowClass> =
        fitted.iter().map(|row| RowClass { preset: None, canopy: row.canopy.clone() }).collect();
    let canopy = mean_class(classes.iter()).canopy;
    let class = CalibrationClass {
        line_spacing_m: mean_m(fitted.iter().map(|row| row.line_spacing_m)),
        crown_depth_m: mean_m(fitted.iter().map(|row| row.crown_depth_m)),
        voxel_m: voxel_m(fitted.iter().map(|row| row.voxel_m)),
        ..class_of(&scene, model, canopy)
    };
    let samples: Vec<Sample> = fitted.iter().filter_map(|row| row.sample).collect();
    let seeds = provenance.seeds.clone();
    let calibration = rowscan_canopy::fit(&samples, class, provenance).map_err(|why| unfit(why, &seeds))?;
    tell_unlike(&calibration);
    let text = output::calibration_text(&calibration)?;
    match &args.output {
        Some(path) => {
            output::write_file(path, &text)?;
            say(format_args!("wrote {}", path.display()));
        }
        None => output::print(&text)?,
    }
    Ok(Outcome::Done)
}

/// The rows that a fit can take, and their seeds; says which it cannot.
fn with_samples(tried: Vec<FittedRow>, seeds: &[u64]) -> (Vec<FittedRow>, Vec<u64>) {
    let (with, without): (Vec<_>, Vec<_>) =
        tried.into_iter().zip(seeds.iter().copied()).partition(|(row, _)| row.sample.is_some());
    if !without.is_empty() {
        let seeds: Vec<String> = without.iter().map(|(_, seed)| seed.to_string()).collect();
        say(format_args!(
            "not fitted: the rows of seeds {}, whose estimates tell no leaf area by contact",
            seeds.join(", ")
        ));
    }
    with.into_iter().unzip()
}

/// Why rows give no calibration, with the seed of the row that is to blame.
fn unfit(why: FitError, seeds: &[u64]) -> Failure {
    match why {
        FitError::BadSample { index, key: "leaf_area_m2", value: 0.0 } => Failure::Usage(format!(
            "seed {}: the row has no leaf, and a power law has no row without leaves: expected rows that carry leaves; leave out that seed, or give them some with --lai",
            seeds.get(index).copied().unwrap_or_default()
        )),
        why => why.into(),
    }
}

/// Says where rows were so alike that the law tells none from another.
fn tell_unlike(calibration: &Calibration) {
    let share = calibration.share.map(|law| ("share", law));
    for (name, law) in [("contact", calibration.contact)].into_iter().chain(share) {
        if law.quality.r2 <= 0.0 {
            say(format_args!(
                "[{name}] R² is {}: over these {} rows the mean leaf area is as good an estimate as the fitted one; rows of several densities (--lai LOW..HIGH) or more seeds tell them apart",
                if law.quality.r2 < -1.0 { "below -1".to_owned() } else { format!("{:.2}", law.quality.r2) },
                law.quality.n
            ));
        }
    }
}

/// What a calibration made on this scene is valid for.
fn class_of(scene: &Scene, model: AnyModel, canopy: CanopyClass) -> CalibrationClass {
    let tree = scene.orchard.tree_parameters();
    let rig = scene.resolved_rig();
    let mount = rig.scanners.first();
    CalibrationClass {
        preset: scene.orchard.training_system(),
        shady_threshold_percent: tree.shady_percent,
        growth_stage: format!("{} iterations", tree.iterations),
        tree_spacing_m: scene.orchard.layout().tree_spacing_m,
        scanner_model: model.name().to_owned(),
        resolution_deg: mount
            .and_then(|mount| mount.resolution_deg)
            .unwrap_or_else(|| exact_step_deg(model.default_step())),
        echo_rule: match mount.and_then(|mount| mount.echo) {
            Some(EchoChoice::Last) => EchoRule::Last,
            Some(EchoChoice::First) | None => EchoRule::First,
        },
        optics: rig.optics.into(),
        distance_m: mount.map(|mount| mount.distance_m),
        height_m: mount.map(|mount| mount.height_m),
        yaw_deg: mount.map(|mount| mount.yaw_deg).filter(|deg| *deg != 0.0),
        pitch_deg: mount.map(|mount| mount.pitch_deg).filter(|deg| *deg != 0.0),
        line_spacing_m: None,
        crown_depth_m: None,
        voxel_m: None,
        canopy,
    }
}

/// The edge of the voxels that all these rows were measured in; `None` where they differ.
pub(super) fn voxel_m(rows: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let mut rows = rows.into_iter();
    let first = rows.next()?;
    rows.all(|edge_m| edge_m == first).then_some(first).flatten()
}

/// The mean over these rows, metres, to a tenth of a millimetre; `None` where one does not tell.
pub(super) fn mean_m(rows: impl IntoIterator<Item = Option<f64>>) -> Option<f64> {
    let told: Option<Vec<f64>> = rows.into_iter().collect();
    let told = told.filter(|rows| !rows.is_empty())?;
    Some((rowscan_canopy::regression::mean(&told) * 1e4).round() / 1e4)
}
