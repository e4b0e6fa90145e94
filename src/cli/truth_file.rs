//! `--truth FILE`: what was truly beside the tractor at each scan, for whoever scores what a client makes of the scans.

use std::collections::BTreeMap;
use std::io::{BufWriter, IntoInnerError, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};

use rowscan_emulator::ScanMoment;
use rowscan_emulator::stage::Stage;
use rowscan_files::OutputFile;
use rowscan_protocol::rig::RowSide;
use rowscan_protocol::time::SimTime;
use rowscan_scenes::{CellColumn, CellGrid, RowCells};
use rowscan_vehicle::trajectory::{Alley, Motion};
use serde::Serialize;
use tokio::task::JoinHandle;

use super::Failure;
use super::output::{name_of, say};

/// `--truth FILE`
#[derive(Debug, clap::Args)]
pub(super) struct TruthArgs {
    /// Keep the truth in this file, a line of JSON for each scan of the first scanner that went to a client: where the tractor really was, and the leaf, wood and
    /// fruit areas on both sides; docs/bench.md
    #[arg(long, value_name = "FILE", conflicts_with = "no_scanner")]
    truth: Option<PathBuf>,
}

/// A file of truth that may be written beside a command. Without [`finish`](Self::finish) there is no file.
#[derive(Debug, Default)]
pub(super) struct TruthFile(Option<Writing>);

#[derive(Debug)]
struct Writing {
    name: String,
    writer: JoinHandle<std::io::Result<Written>>,
}

#[derive(Debug)]
struct Written {
    out: BufWriter<OutputFile>,
    scans: u64,
}

impl TruthArgs {
    /// Begins the file, if it was asked for, and gives the way to it; the scans are those of the rig's first scanner, number `scanner` of the stage.
    pub(super) fn start(
        &self,
        stage: &Stage,
        scanner: Option<usize>,
    ) -> Result<(Option<Sender<ScanMoment>>, TruthFile), Failure> {
        let Some(path) = &self.truth else { return Ok((None, TruthFile::default())) };
        check_text(path)?;
        let name = name_of(path);
        let file = OutputFile::create(path).map_err(|cause| Failure::Write { what: name.clone(), cause })?;
        let mount = scanner.and_then(|index| stage.rig.scanners.get(index));
        let looks_right = mount.map(|mount| mount.row == RowSide::Right);
        let truth = RowTruth { rows: rows_beside(stage), looks_right };
        // A thread of its own: the rig never waits for the disk.
        let (moments, told) = channel();
        let writer = tokio::task::spawn_blocking(move || write(BufWriter::new(file), &told, &truth));
        Ok((Some(moments), TruthFile(Some(Writing { name, writer }))))
    }
}

impl TruthFile {
    /// Puts the file in its place, when the rig has ended; one without a scan is not kept, and what was there stays.
    pub(super) async fn finish(self) -> Result<(), Failure> {
        let Some(Writing { name, writer }) = self.0 else { return Ok(()) };
        let written = writer.await.unwrap_or_else(|cause| Err(std::io::Error::other(cause)));
        let failed = |cause| Failure::Write { what: name.clone(), cause };
        let Written { out, scans } = written.map_err(failed)?;
        if scans == 0 {
            say(format_args!("no scan went to a client: {name} is not kept"));
            return Ok(());
        }
        let commit =
            |out: BufWriter<OutputFile>| out.into_inner().map_err(IntoInnerError::into_error)?.commit();
        commit(out).map_err(failed)
    }
}

/// Other formats have an extension of their own, and would not be read.
fn check_text(path: &Path) -> Result<(), Failure> {
    let foreign = ["parquet", "csv", "json"];
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
    if foreign.contains(&extension) {
        return Err(Failure::Usage(format!(
            "--truth {}: it is written as JSON lines, expected a name such as truth.jsonl, found .{extension}",
            path.display()
        )));
    }
    Ok(())
}

/// Writes records until the rig has ended.
fn write(
    mut out: BufWriter<OutputFile>,
    told: &Receiver<ScanMoment>,
    truth: &RowTruth,
) -> std::io::Result<Written> {
    let mut scans = 0;
    for moment in told {
        serde_json::to_writer(&mut out, &truth.record(&moment))?;
        out.write_all(b"\n")?;
        scans += 1;
    }
    Ok(Written { out, scans })
}

/// The cells of all rows that the drive passes, by row.
fn rows_beside(stage: &Stage) -> BTreeMap<i32, RowCells> {
    let start = stage.tractor().motion(SimTime::ZERO).place.alley;
    let alleys = stage.scene.drive.alleys.unwrap_or(1);
    // A start beyond the rows turns at once, and tells no alley.
    let passed = start.map_or(0..=i32::MAX, |alley| {
        alley.number.saturating_sub(1)..=alley.number.saturating_add_unsigned(alleys.saturating_sub(1))
    });
    let rows = (0..stage.orchard.rows()).filter_map(|row| Some((i32::try_from(row).ok()?, row)));
    rows.filter(|(number, _)| passed.contains(number))
        .filter_map(|(number, row)| Some((number, stage.orchard.cells_of_row(row, CellGrid::default())?)))
        .collect()
}

/// What stands where.
#[derive(Debug)]
struct RowTruth {
    rows: BTreeMap<i32, RowCells>,
    looks_right: Option<bool>,
}

/// One line. What is not known is left out.
#[derive(Debug, Serialize)]
struct Record {
    t_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    telegram_counter: Option<u16>,
    x_m: f64,
    y_m: f64,
    heading_deg: f64,
    speed_m_s: f64,
    wheel_speed_m_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    slip: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    row: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    alley: Option<i32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    left: Option<Beside>,
    #[serde(skip_serializing_if = "Option::is_none")]
    right: Option<Beside>,
}

/// The cell of a row beside the tractor.
#[derive(Debug, Serialize)]
struct Beside {
    row: i32,
    #[serde(flatten)]
    column: CellColumn,
}

impl RowTruth {
    fn record(&self, moment: &ScanMoment) -> Record {
        let ScanMoment { at, telegram_counter, motion } = moment;
        let Motion { place, speed_m_s, wheel_speed_m_s, .. } = *motion;
        let alley = place.alley;
        Record {
            t_s: at.elapsed().as_secs_f64(),
            telegram_counter: *telegram_counter,
            x_m: place.x_m,
            y_m: place.y_m,
            heading_deg: place.heading_rad.to_degrees(),
            speed_m_s,
            wheel_speed_m_s,
            slip: (wheel_speed_m_s != 0.0).then(|| 1.0 - speed_m_s / wheel_speed_m_s),
            row: alley
                .zip(self.looks_right)
                .map(|(alley, right)| alley.row_beside(right).0)
                .filter(|row| self.rows.contains_key(row)),
            alley: alley.map(|alley| alley.number),
            left: alley.and_then(|alley| self.beside(alley, false, place.y_m)),
            right: alley.and_then(|alley| self.beside(alley, true, place.y_m)),
        }
    }

    /// The cell to the right (or left) of the tractor; None where no row is.
    fn beside(&self, alley: Alley, right: bool, y_m: f64) -> Option<Beside> {
        let (row, _) = alley.row_beside(right);
        Some(Beside { row, column: self.rows.get(&row)?.column(y_m) })
    }
}
