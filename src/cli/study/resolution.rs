//! `rowscan study resolution`: how far apart scan lines and beams may be.

use super::orchards::OrchardArgs;
use super::shards::ShardArgs;
use super::tell::TellArgs;
use crate::cli::grid::Grid;
use crate::cli::output::{self, number};
use crate::cli::scan::ScanArgs;
use crate::cli::{Failure, Format, Outcome};
use rowscan_study::resolution::{ResolutionStudy, report};
use rowscan_study::{Whole, figure};

#[derive(Debug, clap::Args)]
pub(in crate::cli) struct Args {
    #[command(flatten)]
    orchards_of: OrchardArgs,
    /// Orchards
    #[arg(long, value_name = "N", default_value_t = 12)]
    orchards: usize,
    /// Random start offsets an orchard and advance
    #[arg(long, value_name = "N", default_value_t = 20)]
    offsets: usize,
    /// Distance between trees; without it 61.8 mm more than the scene's, which no advance divides, so that trees are not met in one phase
    #[arg(long, value_name = "METRES")]
    tree_spacing: Option<f64>,
    /// Advances from line to line, whole millimetres
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "2,4,5,10,20,40,50,100,200")]
    advances_mm: Vec<u32>,
    /// Angles between beams, degrees
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "0.25,0.5,1")]
    angles: Vec<f64>,
    #[command(flatten)]
    scan: ScanArgs,
    #[command(flatten)]
    pub(super) shards: ShardArgs,
    #[command(flatten)]
    tell: TellArgs,
}

pub(super) async fn run(args: Args) -> Result<Outcome, Failure> {
    let refuse = |flag: &str| Failure::Usage(format!("expected {flag} all positive and at least one"));
    if args.advances_mm.is_empty() || args.advances_mm.contains(&0) {
        return Err(refuse("the advances (--advances-mm)"));
    }
    if args.offsets == 0 {
        return Err(Failure::Usage("expected at least one start offset (--offsets), found 0".to_owned()));
    }
    let scene = args.orchards_of.scene()?;
    let study = ResolutionStudy::new(scene);
    let study = ResolutionStudy {
        orchards: args.orchards,
        offsets: args.offsets,
        tree_spacing_m: args.tree_spacing.unwrap_or(study.tree_spacing_m),
        dy_mm: args.advances_mm,
        dtheta_deg: args.angles,
        scan: args.scan.over(study.scan),
        clearance_m: args.orchards_of.clearance,
        scene: study.scene,
    };
    match args.shards.run(study, args.tell.files()).await? {
        Some(whole) => tell(&args.tell, whole),
        None => Ok(Outcome::Done),
    }
}

/// Reports on a whole study.
pub(super) fn tell(args: &TellArgs, (header, units): Whole<ResolutionStudy>) -> Result<Outcome, Failure> {
    let report = report(header, &units);
    args.draw(|| figure::resolution(&report))?;
    match args.format {
        Format::Json | Format::Jsonl => output::print_json(args.format, &report)?,
        Format::Csv => output::print_rows(args.format, &report.rows)?,
        Format::Table => {
            let mut grid = Grid::new();
            output::head(
                &mut grid,
                [
                    "Δθ °",
                    "Δy mm",
                    "n",
                    "mean e %",
                    "± %",
                    "sd %",
                    "95 % of |e| below %",
                    "Δθ against finest %",
                ],
            );
            for row in &report.rows {
                grid.add_row([
                    number(Some(row.dtheta_deg), 3),
                    number(Some(1000.0 * row.dy_m), 0),
                    number(Some(row.n as f64), 0),
                    number(Some(100.0 * row.error_mean), 3),
                    number(Some(100.0 * row.error_mean_se), 3),
                    number(Some(100.0 * row.error_sd), 3),
                    number(Some(100.0 * row.error_p95_abs), 3),
                    number(Some(100.0 * row.dtheta_error_mean), 3),
                ]);
            }
            output::print(&format!(
                "{grid}\n{} orchards, {} random start offsets each, trees {:.4} m apart; e against {} mm at the same Δθ, ± its mean's standard error; seed {}, scene {} ({}), rowscan {}\n",
                report.provenance.units,
                report.provenance.settings.offsets,
                report.provenance.settings.tree_spacing_m,
                1000.0 * report.reference_dy_m,
                report.provenance.seed,
                report.provenance.scene,
                report.provenance.scene_hash,
                report.provenance.rowscan,
            ))?;
        }
    }
    Ok(Outcome::Done)
}
