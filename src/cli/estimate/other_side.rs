//! The pass from the row's other side, which an estimate joins with its own: `--other-side`.

use std::path::Path;
use std::sync::Arc;

use rowscan_canopy::{Heading, OtherSide, Pipeline};
use rowscan_driver::{Arrival, DriverConfig, Scanner, Source};
use rowscan_protocol::rig::Rig;
use rowscan_scenes::Scene;
use rowscan_study::reading::{CalibrationChoice, Reading};
use rowscan_study::sides::SidesError;

use super::super::Failure;
use super::super::output::say;
use super::on_earth::{Antenna, SceneAntenna, Way, row_by_receiver};
use super::rig::{self, Beams, Loaded, Recorded, Scanners};
use crate::export::map::RowOnEarth;

/// Beside each other by more than this two axes are two rows, metres, where the rig tells no row spacing to take the half of.
const OTHER_ROW_M: f64 = 1.5;

#[derive(Clone, Debug, clap::Args)]
pub(super) struct OtherSideArgs {
    /// Recording of another pass along the same row, from its other alley: both are one estimate
    #[arg(long, value_name = "FILE")]
    other_side: Option<Source>,
    /// Where the scanner sat on that pass: a rig file, a scene file or a built-in scene's name [default: as --rig]
    #[arg(long, value_name = "RIG", requires = "other_side")]
    other_rig: Option<String>,
    /// That rig's scanner it is, from 0 [default: the one that its recording says, else as this one]
    #[arg(long, value_name = "N", requires = "other_side")]
    other_scanner: Option<usize>,
    /// Where along the row that pass began, metres, by this pass's count; `gnss`: there, and that way, where the receivers in both recordings say [default: its rig's start_m]
    #[arg(long, value_name = "METRES|gnss", requires = "other_side", allow_negative_numbers = true, value_parser = start)]
    other_start: Option<Start>,
    /// That pass went back, towards the row's start
    #[arg(long, requires = "other_start")]
    other_back: bool,
}

/// Where a pass began.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Start {
    /// So many metres along the row.
    At(f64),
    /// Where the receivers say.
    ByReceivers,
}

fn start(text: &str) -> Result<Start, String> {
    match text.parse::<f64>() {
        Ok(metres) if metres.abs() <= 1e5 => Ok(Start::At(metres)),
        _ if text == "gnss" => Ok(Start::ByReceivers),
        _ => Err(format!("expected metres along the row, from -100000 to 100000, or gnss, found `{text}`")),
    }
}

/// The pass that another one is joined with.
pub(super) struct Here<'a> {
    pub(super) source: &'a Source,
    pub(super) rig: &'a Rig,
    pub(super) scanner: usize,
    pub(super) pipeline: &'a Pipeline,
    pub(super) scene: Option<&'a Scene>,
    /// Where the antenna is, if the user says.
    pub(super) antenna: Option<Antenna>,
}

impl Here<'_> {
    /// The antenna of a drive, by the user or its scene.
    fn antenna_of(&self, (rig, scanner): (&Rig, usize), scene: Option<&Scene>) -> Option<Antenna> {
        self.antenna.or_else(|| scene.map(|scene| SceneAntenna::of(scene).beside(rig, scanner)))
    }
}

/// Gives a pipeline all that a recording holds, and keeps the way.
async fn drive(source: &Source, pipeline: &mut Pipeline) -> Result<Way, Failure> {
    let mut way = Way::default();
    let mut passed = Scanner::open(source, DriverConfig::default()).await?;
    while let Some(arrival) = passed.arrival().await? {
        match arrival {
            Arrival::Scan(record) => {
                let at = record.received.0;
                pipeline.push(record.scan);
                way.push(at, pipeline.progress().y_m);
            }
            Arrival::Unreadable { fault, .. } => pipeline.push_unreadable(&fault),
            Arrival::Reading { .. } => {}
        }
        // A recording never waits by itself.
        tokio::task::coop::consume_budget().await;
    }
    Ok(way)
}

impl OtherSideArgs {
    pub(super) fn is_given(&self) -> bool {
        self.other_side.is_some()
    }

    /// The receivers say where that pass lies.
    pub(super) fn is_by_receivers(&self) -> bool {
        self.other_start == Some(Start::ByReceivers)
    }

    /// Refuses what cannot be joined.
    pub(super) fn check(&self, sources: &[Source]) -> Result<(), Failure> {
        let Some(source) = &self.other_side else { return Ok(()) };
        let [here] = sources else {
            return Err(Failure::Usage(format!(
                "--other-side joins a pass with that of one source, found {}: estimate each scanner by itself",
                sources.len()
            )));
        };
        if self.is_by_receivers() && here.file().is_none() {
            return Err(Failure::Usage(format!(
                "--other-start gnss needs the receiver of this pass too, and {here} is live: record it first, or say --other-start METRES"
            )));
        }
        if self.is_by_receivers() && self.other_back {
            let why = "--other-start gnss says itself which way that pass went: leave --other-back out";
            return Err(Failure::Usage(why.to_owned()));
        }
        if source.file().is_none() {
            return Err(Failure::Usage(format!(
                "--other-side must be a recording, found `{source}`: it is read whole before this pass"
            )));
        }
        Ok(())
    }

    /// Reads that pass; none if there is no other side.
    pub(super) async fn read(
        &self,
        (name, beams): (Option<&str>, Beams),
        here: Here<'_>,
    ) -> Result<Option<Arc<OtherSide>>, Failure> {
        let Some(source) = &self.other_side else { return Ok(None) };
        let (Some(slice_m), Some(voxel_m)) = (here.pipeline.slice_m(), here.pipeline.voxel_m()) else {
            return Ok(None);
        };
        let asked = self.other_scanner.as_slice();
        let asked = if asked.is_empty() { Scanners::From(here.scanner) } else { Scanners::Asked(asked) };
        let name = self.other_rig.as_deref().or(name);
        let loaded = rig::load(name, None, (std::slice::from_ref(source), asked), beams)?;
        let Loaded { rig, scanners, recorded, scene } = loaded.ok_or_else(|| {
            Failure::Usage(format!("{source} keeps no rig: say where its scanner sat with --other-rig"))
        })?;
        let scanner = scanners.first().copied().unwrap_or(here.scanner);
        let rig = recorded.first().map_or_else(|| rig.clone(), |told: &Recorded| told.decides(&rig));
        let heading = match self.other_start {
            None => Heading { start_m: rig.start_m, back: self.other_back },
            Some(Start::At(start_m)) => Heading { start_m, back: self.other_back },
            Some(Start::ByReceivers) => by_receivers(&here, (source, &rig, scanner), scene.as_ref()).await?,
        };
        // Its voxels are as large as this pass's, whatever its own speed asks for.
        let rig = Rig { voxel_edge_m: Some(voxel_m), ..heading.rig(&rig, slice_m) };
        let no_calibration = CalibrationChoice::Given(None);
        let reading = Reading::of_recording(Some(&rig), scanner, true, no_calibration)?;
        let mut pipeline = reading.pipeline.keeping_voxels();
        drive(source, &mut pipeline).await?;
        let estimate = pipeline.finish();
        let of_a_class = ["uncalibrated", "class_unknown", "class"];
        for warning in estimate.warnings.iter().filter(|warning| !of_a_class.contains(&warning.code())) {
            say(format_args!("{source}, the other side: {warning}"));
        }
        Ok(Some(Arc::new(pipeline.other_side(heading).map_err(SidesError::from)?)))
    }
}

/// Where another pass began along this pass's row, and which way it went, by the positions in both recordings. Both are driven once for it.
async fn by_receivers(
    here: &Here<'_>,
    (source, rig, scanner): (&Source, &Rig, usize),
    scene: Option<&Scene>,
) -> Result<Heading, Failure> {
    let own_way = drive(here.source, &mut here.pipeline.clone()).await?;
    let own_row = row(here, (here.source, here.rig, here.scanner), here.scene, &own_way)?;
    let from_its_start = Rig { start_m: 0.0, ..rig.clone() };
    let no_calibration = CalibrationChoice::Given(None);
    let mut reading = Reading::of_recording(Some(&from_its_start), scanner, true, no_calibration)?;
    let other_way = drive(source, &mut reading.pipeline).await?;
    let other_row = row(here, (source, rig, scanner), scene, &other_way)?;
    let found = own_row.registered(&other_row).ok_or_else(|| {
        Failure::Usage(format!(
            "the positions in {} and {source} tell no straight way of 2 m or more; a pass that turns is not straight: keep one straight pass of it (`record` what `replay --from … --until …` plays), or say --other-start METRES",
            here.source
        ))
    })?;
    let most_m = rig.row_spacing_m.map_or(OTHER_ROW_M, |spacing_m| spacing_m / 2.0);
    if found.right_m.abs() > most_m {
        return Err(Failure::Usage(format!(
            "{source} passed another row: by the receivers its row lies {:.1} m to the right of this one's, where at most {most_m:.1} m are one row; check the rigs' distance_m and row, and --antenna",
            found.right_m
        )));
    }
    let way = if found.back { "back" } else { "on" };
    say(format_args!(
        "{source} began {:.2} m along the row and went {way}, by the receivers; the two axes lie {:.2} m apart",
        found.start_m,
        found.right_m.abs()
    ));
    Ok(Heading { start_m: found.start_m, back: found.back })
}

/// The row that a recorded drive went past.
fn row(
    here: &Here<'_>,
    (source, rig, scanner): (&Source, &Rig, usize),
    scene: Option<&Scene>,
    way: &Way,
) -> Result<RowOnEarth, Failure> {
    let path = source.file().unwrap_or(Path::new(""));
    let antenna = here.antenna_of((rig, scanner), scene);
    row_by_receiver(path, (rig, scanner), way, antenna, "say --other-start METRES")
}
