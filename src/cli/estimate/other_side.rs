//! The pass from the row's other side, which an estimate joins with its own: `--other-side`.

use std::sync::Arc;

use rowscan_canopy::{Heading, OtherSide, Pipeline};
use rowscan_driver::{Arrival, DriverConfig, Scanner, Source};
use rowscan_protocol::rig::Rig;
use rowscan_study::reading::{CalibrationChoice, Reading};
use rowscan_study::sides::SidesError;

use super::super::Failure;
use super::super::output::say;
use super::rig::{self, Beams, Loaded, Recorded};

#[derive(Clone, Debug, clap::Args)]
pub(super) struct OtherSideArgs {
    /// Recording of another pass along the same row, from its other alley: both are one estimate
    #[arg(long, value_name = "FILE", requires = "rig")]
    other_side: Option<Source>,
    /// Where the scanner sat on that pass: a rig file, a scene file or a built-in scene's name [default: as --rig]
    #[arg(long, value_name = "RIG", requires = "other_side")]
    other_rig: Option<String>,
    /// That rig's scanner it is, from 0 [default: as this one]
    #[arg(long, value_name = "N", requires = "other_side")]
    other_scanner: Option<usize>,
    /// Where along the row that pass began, metres, by this pass's count [default: its rig's start_m]
    #[arg(long, value_name = "METRES", requires = "other_side", allow_negative_numbers = true, value_parser = place)]
    other_start: Option<f64>,
    /// That pass went back, towards the row's start
    #[arg(long, requires = "other_start")]
    other_back: bool,
}

/// A place along the row.
fn place(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(metres) if metres.abs() <= 1e5 => Ok(metres),
        _ => Err(format!("expected metres along the row, from -100000 to 100000, found `{text}`")),
    }
}

impl OtherSideArgs {
    pub(super) fn is_given(&self) -> bool {
        self.other_side.is_some()
    }

    /// Refuses what cannot be joined.
    pub(super) fn check(&self, sources: usize) -> Result<(), Failure> {
        let Some(source) = &self.other_side else { return Ok(()) };
        if sources != 1 {
            return Err(Failure::Usage(format!(
                "--other-side joins a pass with that of one source, found {sources}: estimate each scanner by itself"
            )));
        }
        if !matches!(source, Source::Recording { .. }) {
            return Err(Failure::Usage(format!(
                "--other-side must be a recording, found `{source}`: it is read whole before this pass"
            )));
        }
        Ok(())
    }

    /// Reads that pass, for one by `here`'s rig and scanner whose pipeline this is; none if there is no other side.
    pub(super) async fn read(
        &self,
        (name, beams): (Option<&str>, Beams),
        scanner: usize,
        pipeline: &Pipeline,
    ) -> Result<Option<Arc<OtherSide>>, Failure> {
        let (Some(source), Some(name)) = (&self.other_side, self.other_rig.as_deref().or(name)) else {
            return Ok(None);
        };
        let (Some(slice_m), Some(voxel_m)) = (pipeline.slice_m(), pipeline.voxel_m()) else {
            return Ok(None);
        };
        let scanner = self.other_scanner.unwrap_or(scanner);
        let Loaded { rig, recorded, .. } =
            rig::load(name, None, (std::slice::from_ref(source), &[scanner]), beams)?;
        let rig = recorded.first().map_or_else(|| rig.clone(), |told: &Recorded| told.decides(&rig));
        let heading = Heading { start_m: self.other_start.unwrap_or(rig.start_m), back: self.other_back };
        // Its voxels are as large as this pass's, whatever its own speed asks for.
        let rig = Rig { voxel_edge_m: Some(voxel_m), ..heading.rig(&rig, slice_m) };
        let no_calibration = CalibrationChoice::Given(None);
        let reading = Reading::of_recording(Some(&rig), scanner, true, no_calibration)?;
        let mut pipeline = reading.pipeline.keeping_voxels();
        let mut passed = Scanner::open(source, DriverConfig::default()).await?;
        while let Some(arrival) = passed.arrival().await? {
            match arrival {
                Arrival::Scan(record) => pipeline.push(record.scan),
                Arrival::Unreadable { fault, .. } => pipeline.push_unreadable(&fault),
                Arrival::Reading { .. } => {}
            }
            // A recording never waits by itself.
            tokio::task::coop::consume_budget().await;
        }
        let estimate = pipeline.finish();
        let of_a_class = ["uncalibrated", "class_unknown", "class"];
        for warning in estimate.warnings.iter().filter(|warning| !of_a_class.contains(&warning.code())) {
            say(format_args!("{source}, the other side: {warning}"));
        }
        Ok(Some(Arc::new(pipeline.other_side(heading).map_err(SidesError::from)?)))
    }
}
