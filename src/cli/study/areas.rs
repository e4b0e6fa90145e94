//! `rowscan study areas`: the paper's twenty orchards and six regressions.

use std::path::{Path, PathBuf};

use comfy_table::Cell;
use rowscan_canopy::Sample;
use rowscan_canopy::calibration::Provenance;
use serde::Serialize;

use super::confirmed;
use super::orchards::OrchardArgs;
use super::rows::Seeds;
use super::shards::ShardArgs;
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number, say};
use crate::cli::scan::ScanArgs;
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::areas::{AreasReport, AreasStudy, Orchard, View, report, symbol};
use rowscan_study::search::ConfirmStudy;
use rowscan_study::{Whole, figure};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    orchards_of: OrchardArgs,
    /// Iterations of growth
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "7,8,9,10,11")]
    iterations: Vec<u32>,
    /// Shady thresholds, percent; above 100 keeps every leaf
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "60,70,80,101")]
    shady: Vec<f64>,
    /// Count the leaves of all rows, not of the first alone
    #[arg(long)]
    whole_orchard: bool,
    /// Do the whole study at each of these seeds, at least ten, and report medians with intervals
    #[arg(long, value_name = "A..B", conflicts_with_all = ["seed", "calibration"])]
    seeds: Option<Seeds>,
    /// Write the medians as docs/paper.md holds them
    #[arg(long, requires = "seeds", conflicts_with = "format")]
    markdown: bool,
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    pub(super) shards: ShardArgs,
    /// Write a calibration for `estimate`, fitted to drives of the scene's rig past these orchards
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,
    #[command(flatten)]
    tell: TellArgs,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let scene = args.orchards_of.scene()?;
    let whole = AreasStudy::new(scene);
    let study = AreasStudy {
        iterations: args.iterations,
        shady_percent: args.shady,
        lateral: args.scan.over(whole.lateral),
        zenith: args.scan.over(whole.zenith),
        clearance_m: args.orchards_of.clearance,
        whole_orchard: args.whole_orchard,
        scene: whole.scene,
    };
    let files = || args.tell.files().chain(args.calibration.as_deref());
    if let Some(Seeds(seeds)) = args.seeds {
        return match args.shards.run(ConfirmStudy::of_areas(study, seeds)?, files()).await? {
            Some(whole) => confirmed::tell(&args.tell, args.markdown, whole),
            None => Ok(Outcome::Done),
        };
    }
    match args.shards.run(study, files()).await? {
        Some(whole) => tell(&args.tell, args.calibration.as_deref(), whole),
        None => Ok(Outcome::Done),
    }
}

/// Reports on a whole study.
pub(super) fn tell(
    args: &TellArgs,
    calibration_to: Option<&Path>,
    (header, units): Whole<AreasStudy>,
) -> Result<Outcome, Failure> {
    let report = report(header, units);
    if let Some(path) = calibration_to {
        output::write_file(path, &calibration(&report)?)?;
        say(format_args!("wrote {}", path.display()));
    }
    args.draw(|| figure::areas(&report))?;
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => {
            output::print_rows(args.format, &report.orchards.iter().map(Row::from).collect::<Vec<_>>())?;
        }
        Format::Table => output::print(&table(&report))?,
    }
    Ok(Outcome::Done)
}

fn calibration(report: &AreasReport) -> Result<String, Failure> {
    let samples: Vec<Sample> = report.orchards.iter().filter_map(|orchard| orchard.sample).collect();
    let study = &report.provenance.settings;
    let provenance = Provenance {
        command: format!(
            "rowscan study areas {} --seed {} --calibration",
            report.provenance.scene, report.provenance.seed
        ),
        seeds: report.orchards.iter().map(|orchard| orchard.seed).collect(),
    };
    let calibration = rowscan_canopy::fit(&samples, study.class(), provenance)?;
    output::calibration_text(&calibration)
}

/// An orchard on one line.
#[derive(Serialize)]
struct Row {
    iterations: u32,
    shady_percent: f64,
    seed: u64,
    leaf_area_m2: f64,
    wood_area_m2: f64,
    distance_m: f64,
    #[serde(rename = "lateral_I_L_m2")]
    lateral_leaf: f64,
    #[serde(rename = "lateral_I_T_m2")]
    lateral_total: f64,
    #[serde(rename = "lateral_I_3L_m2")]
    lateral_three: f64,
    #[serde(rename = "zenith_I_L_m2")]
    zenith_leaf: f64,
    #[serde(rename = "zenith_I_T_m2")]
    zenith_total: f64,
    #[serde(rename = "zenith_I_3L_m2")]
    zenith_three: f64,
}

impl From<&Orchard> for Row {
    fn from(orchard: &Orchard) -> Self {
        let Orchard { lateral, zenith, .. } = orchard;
        Self {
            iterations: orchard.iterations,
            shady_percent: orchard.shady_percent,
            seed: orchard.seed,
            leaf_area_m2: orchard.leaf_area_m2,
            wood_area_m2: orchard.wood_area_m2,
            distance_m: orchard.distance_m,
            lateral_leaf: lateral.leaf_m2,
            lateral_total: lateral.total_m2,
            lateral_three: lateral.three_leaves_m2,
            zenith_leaf: zenith.leaf_m2,
            zenith_total: zenith.total_m2,
            zenith_three: zenith.three_leaves_m2,
        }
    }
}

fn table(report: &AreasReport) -> String {
    let mut orchards = Grid::new();
    output::head(
        &mut orchards,
        ["iterations", "shady %", "L_A m²", "lateral I_L", "I_T", "I_3L", "zenith I_L", "I_T", "I_3L"],
    );
    for Orchard { iterations, shady_percent, leaf_area_m2, lateral, zenith, .. } in &report.orchards {
        let mut row = vec![
            number(Some(f64::from(*iterations)), 0),
            number(Some(*shady_percent), 0),
            number(Some(*leaf_area_m2), 2),
        ];
        for areas in [lateral, zenith] {
            let three = [areas.leaf_m2, areas.total_m2, areas.three_leaves_m2];
            row.extend(three.map(|area| number(Some(area), 3)));
        }
        orchards.add_row(row);
    }
    let of_paper = report.provenance.settings.is_of_paper();
    let mut fits = Grid::new();
    let own = [
        "view",
        "area",
        "slope",
        "intercept m²",
        "R²",
        "R² unc.",
        "LOO",
        "slope, origin",
        "bend t",
        "power p",
        "its LOO",
    ];
    let paper = ["paper slope", "intercept m²", "R²"];
    output::head(&mut fits, own.into_iter().chain(paper.into_iter().filter(|_| of_paper)));
    for (name, view) in [("lateral", &report.lateral), ("zenith", &report.zenith)] {
        fit_rows(&mut fits, name, view, of_paper);
    }
    format!(
        "{orchards}\n{fits}\n{}{} orchards, L_A max/min {:.1}; seed {}, scene {} ({}), rowscan {}\n",
        missed(report),
        report.orchards.len(),
        report.leaf_area_max_over_min,
        report.provenance.seed,
        report.provenance.scene,
        report.provenance.scene_hash,
        report.provenance.rowscan,
    )
}

/// The gates, by those that do not hold; nothing of orchards that are not the paper's.
fn missed(report: &AreasReport) -> String {
    if report.gates.is_empty() {
        return String::new();
    }
    let missed: Vec<String> =
        report.gates.iter().filter(|gate| !gate.holds).map(ToString::to_string).collect();
    let count = format!("{} of {} gates hold", report.gates.len() - missed.len(), report.gates.len());
    if missed.is_empty() { format!("{count}\n") } else { format!("{count}, not: {}\n", missed.join("; ")) }
}

fn fit_rows(table: &mut Grid, name: &str, view: &View, of_paper: bool) {
    for (area, fit) in view.fits() {
        let Some(fit) = fit else { continue };
        let own = [
            Cell::new(name),
            Cell::new(symbol(area)),
            number(Some(fit.slope), 2),
            number(fit.intercept_m2, 2),
            number(Some(fit.r2), 3),
            number(Some(fit.r2_uncentred), 3),
            number(Some(fit.loo_rmse_relative), 3),
            number(Some(fit.slope_origin), 2),
            number(fit.residual_trend_t, 1),
            number(fit.power.map(|power| power.p), 2),
            number(fit.power.map(|power| power.loo_rmse_relative), 3),
        ];
        let paper = [
            number(fit.paper.map(|paper| paper.slope), 2),
            number(fit.paper.filter(|paper| paper.intercept_m2 != 0.0).map(|paper| paper.intercept_m2), 2),
            number(fit.paper.map(|paper| paper.r2), 2),
        ];
        table.add_row(own.into_iter().chain(paper.into_iter().filter(|_| of_paper)));
    }
}
