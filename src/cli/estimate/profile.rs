//! The profile of an estimate: `--profile`, its lines and its table.

use rowscan_canopy::{BAND_HEIGHTS_M, Estimate};
use rowscan_emulator::stage::Stage;
use rowscan_protocol::rig::Rig;
use rowscan_study::height_truth::TruthByBand;
use rowscan_study::profile_beside::{Asked, BandBeside, BandTruth, ProfileBeside};
use serde::Serialize;

use super::super::grid::Grid;
use super::super::output::{self, number, share};

/// `--profile METRES` and what belongs to it
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(super) struct ProfileArgs {
    /// Tell leaf area, density, gaps and porosity by height, too, in bands of so many metres (0.1 to 0.5)
    #[arg(long, value_name = "METRES", value_parser = band_m)]
    pub(super) profile: Option<f64>,
    /// The truth of the rig's scene beside every band of the profile
    #[arg(long, requires = "profile")]
    pub(super) truth: bool,
}

/// The height of a band.
pub(in super::super) fn band_m(text: &str) -> Result<f64, String> {
    let [low_m, high_m] = BAND_HEIGHTS_M;
    match text.parse::<f64>() {
        Ok(metres) if (low_m..=high_m).contains(&metres) => Ok(metres),
        _ => Err(format!("expected a height of {low_m} to {high_m} metres, found `{text}`")),
    }
}

impl ProfileArgs {
    /// The profile of an estimate, beside the truth if that is asked for and known.
    pub(super) fn told(
        &self,
        estimate: &Estimate,
        scanner: usize,
        truth: Option<(&Stage, &Rig)>,
    ) -> Option<ProfileBeside> {
        let band_m = self.profile?;
        let known = truth.filter(|_| self.truth);
        let known = known.map(|(stage, rig)| {
            TruthByBand::of((&stage.orchard, stage.row_seen(scanner)), band_m, rig.first_line_m(scanner))
        });
        let asked = match &known {
            Some(truth) => Asked::Known(truth),
            None if self.truth => Asked::Unknown,
            None => Asked::No,
        };
        ProfileBeside::of(estimate, asked)
    }
}

/// A band as a line: of the row, or of a tree.
#[derive(Debug, Serialize)]
pub(super) struct BandLine {
    /// The tree; null for the row's bands.
    tree: Option<u32>,
    #[serde(flatten)]
    band: BandBeside,
}

impl BandLine {
    /// One of which nothing is known.
    pub(super) fn empty(asks_truth: bool) -> Self {
        let truth = asks_truth.then(BandTruth::default);
        Self { tree: None, band: BandBeside { truth, ..BandBeside::default() } }
    }
}

/// All bands, the row's first.
pub(super) fn lines(profile: &ProfileBeside) -> Vec<BandLine> {
    let row = profile.row.iter().map(|band| BandLine { tree: None, band: *band });
    let trees = profile
        .trees
        .iter()
        .flat_map(|told| told.bands.iter().map(|band| BandLine { tree: Some(told.tree), band: *band }));
    row.chain(trees).collect()
}

/// The row's bands, the highest first, as they stand.
pub(super) fn table(profile: &ProfileBeside) -> String {
    let mut grid = Grid::new();
    let whole = profile.row.iter().any(|line| line.band.leaf_area_interval_m2.is_some());
    let has_truth = profile.asks_truth;
    let ends = if whole { "95 % m²" } else { "sampling error m²" };
    let heads = ["from m", "to m", "leaf m²", ends, "m²/m³", "gaps", "porosity", "visited"];
    let beside = ["true m²", "error"].into_iter().filter(|_| has_truth);
    output::head(&mut grid, heads.into_iter().chain(beside));
    for BandBeside { band, truth } in profile.row.iter().rev() {
        let interval_m2 = if whole { band.leaf_area_interval_m2 } else { band.leaf_area_sampling_error_m2 };
        let interval = interval_m2.map_or_else(|| "–".into(), |[low, high]| format!("{low:.2} to {high:.2}"));
        let cells = [
            number(Some(band.from_m), 2),
            number(Some(band.to_m), 2),
            number(band.leaf_area_m2, 2),
            output::right(interval),
            number(band.density_m2_per_m3, 2),
            share(band.gap_fraction),
            share(band.porosity),
            share(band.visited),
        ];
        let beside = truth.map(|truth| [number(truth.truth_leaf_area_m2, 2), output::percent(truth.error)]);
        grid.add_row(cells.into_iter().chain(beside.into_iter().flatten()));
    }
    format!("{grid}\nbands of the row; those of trees: --format json, or --format csv --by band\n")
}
