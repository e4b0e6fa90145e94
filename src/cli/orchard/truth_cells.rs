//! `rowscan orchard truth --cells`: exact areas by row, tree, cell and height band, and what of them a side can see.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use rowscan_emulator::stage::Stage;
use rowscan_scenes::{Cell, CellGrid, RowCells, SeenCell, Track};
use serde::Serialize;

use crate::cli::blocking::off_runtime;
use crate::cli::output::{self, say};
use crate::cli::table_file::TableFile;
use crate::cli::{Failure, Format, Outcome};
use crate::export::{Column, Kind, Table, TableFormat};

/// The flags of the cells.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct CellArgs {
    /// Length of a cell along the row, metres
    #[arg(long, value_name = "METRES", default_value_t = CellGrid::default().cell_m, requires = "cells", value_parser = size)]
    cell: f64,
    /// Thickness of a height band, metres
    #[arg(long, value_name = "METRES", default_value_t = CellGrid::default().band_m, requires = "cells", value_parser = size)]
    band: f64,
    /// Add what of each cell a scanner driven past on this side could see at best, and what is hidden from it; the mirror has the distance and height of the
    /// rig's first scanner
    #[arg(long, value_enum, value_name = "SIDE", requires = "cells")]
    seen_from: Option<Side>,
    /// Write the cells to this file, by its name as CSV, Parquet, JSON or JSON lines
    #[arg(short, long, value_name = "FILE", requires = "cells", conflicts_with = "format")]
    output: Option<PathBuf>,
}

/// A side of the row, for who looks along +Y.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Side {
    /// Where X is smaller: the row stands to the right of the tractor
    Left,
    /// Where X is larger
    Right,
}

fn size(text: &str) -> Result<f64, String> {
    let metres = text.parse::<f64>().ok().filter(|metres| metres.is_finite() && *metres > 0.0);
    metres.ok_or_else(|| format!("expected a positive number of metres, found `{text}`"))
}

/// A cell on a line.
trait Line: Serialize + Send {
    /// Its columns.
    fn columns() -> Vec<Column>;
    /// Their numbers.
    fn numbers(&self) -> Vec<f64>;
}

impl Line for Cell {
    fn columns() -> Vec<Column> {
        let faces =
            ["y_from_m", "y_to_m", "z_from_m", "z_to_m", "leaf_area_m2", "wood_area_m2", "fruit_area_m2"];
        let whole = ["row", "tree"].map(|name| Column::new(name, Kind::U32));
        whole.into_iter().chain(faces.map(|name| Column::new(name, Kind::F64))).collect()
    }

    fn numbers(&self) -> Vec<f64> {
        let Self { row, tree, y_from_m, y_to_m, z_from_m, z_to_m, areas } = *self;
        let areas = [areas.leaf_area_m2, areas.wood_area_m2, areas.fruit_area_m2];
        [&[row as f64, f64::from(tree), y_from_m, y_to_m, z_from_m, z_to_m], &areas[..]].concat()
    }
}

impl Line for SeenCell {
    fn columns() -> Vec<Column> {
        let seen = [
            "leaf_visible_m2",
            "leaf_hidden_m2",
            "wood_visible_m2",
            "wood_hidden_m2",
            "fruit_visible_m2",
            "fruit_hidden_m2",
        ];
        Cell::columns().into_iter().chain(seen.map(|name| Column::new(name, Kind::F64))).collect()
    }

    fn numbers(&self) -> Vec<f64> {
        let seen = [
            self.leaf_visible_m2,
            self.leaf_hidden_m2,
            self.wood_visible_m2,
            self.wood_hidden_m2,
            self.fruit_visible_m2,
            self.fruit_hidden_m2,
        ];
        [self.cell.numbers(), seen.to_vec()].concat()
    }
}

pub(super) async fn run(args: &CellArgs, format: Format, stage: Stage) -> Result<Outcome, Failure> {
    let grid = CellGrid { cell_m: args.cell, band_m: args.band };
    match args.seen_from {
        None => {
            let rows = stage.orchard.cells(grid);
            tell(args, format, &rows.iter().flat_map(RowCells::cells).collect::<Vec<_>>())
        }
        Some(side) => {
            let track = track(&stage, side)?;
            let work = move || -> Result<Vec<SeenCell>, Failure> {
                let rows = 0..stage.orchard.rows();
                let seen = |row| stage.orchard.seen_cells(stage.caster(), row, grid, track);
                Ok(rows.into_par_iter().filter_map(seen).collect::<Vec<_>>().concat())
            };
            tell(args, format, &off_runtime("ask what can be seen", work).await?)
        }
    }
}

fn track(stage: &Stage, side: Side) -> Result<Track, Failure> {
    let Some(mount) = stage.rig.scanners.first() else {
        return Err(Failure::Usage(
            "--seen-from needs a scanner: expected [[rig.scanner]] with distance_m and height_m in the scene, found none"
                .to_owned(),
        ));
    };
    let aside_m = match side {
        Side::Left => -mount.distance_m,
        Side::Right => mount.distance_m,
    };
    Ok(Track { aside_m, height_m: mount.height_m })
}

fn tell<T: Line>(args: &CellArgs, format: Format, cells: &[T]) -> Result<Outcome, Failure> {
    let Some(path) = &args.output else {
        output::print_rows(format, cells)?;
        return Ok(Outcome::Done);
    };
    match path.extension().and_then(|extension| extension.to_str()).unwrap_or_default() {
        "csv" => write_table(path, TableFormat::Csv, cells)?,
        "parquet" => write_table(path, TableFormat::Parquet, cells)?,
        "json" => output::write_file(path, &json(path, &cells)?)?,
        "jsonl" => {
            let lines: Result<Vec<String>, Failure> = cells.iter().map(|cell| json(path, cell)).collect();
            output::write_file(path, &lines?.concat())?;
        }
        found => {
            return Err(Failure::Usage(format!(
                "--output {}: expected a name that ends in .csv, .parquet, .json or .jsonl, found `.{found}`",
                path.display()
            )));
        }
    }
    say(format_args!("wrote {}: {} cells", path.display(), cells.len()));
    Ok(Outcome::Done)
}

fn write_table<T: Line>(path: &Path, format: TableFormat, cells: &[T]) -> Result<(), Failure> {
    let mut file = TableFile::create(path, format, &Table { columns: T::columns(), ..Table::default() })?;
    for cell in cells {
        file.row(&cell.numbers()).map_err(|cause| file.failure(cause))?;
    }
    file.commit()?;
    Ok(())
}

fn json(path: &Path, value: &dyn erased_serde::Serialize) -> Result<String, Failure> {
    let what = || path.display().to_string();
    let text =
        serde_json::to_string(value).map_err(|cause| Failure::Write { what: what(), cause: cause.into() })?;
    Ok(text + "\n")
}
