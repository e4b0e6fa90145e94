//! A table on its way to a file, row by row.

use std::io::{self, BufWriter};
use std::path::Path;

use rowscan_files::OutputFile;

use super::Failure;
use super::output::name_of;
use crate::export::{ExportError, Table, TableFormat, TableWriter};

/// A table being written to a path. Dropped before [`commit`](Self::commit), nothing has happened there.
pub(super) struct TableFile {
    writer: Box<dyn TableWriter<BufWriter<OutputFile>>>,
    name: String,
    rows: u64,
}

impl TableFile {
    /// Begins a table.
    pub(super) fn create(path: &Path, format: TableFormat, table: &Table) -> Result<Self, Failure> {
        format.check()?;
        let name = name_of(path);
        let out = if format.is_rewound() {
            // What cannot be rewound, such as a pipe, gets it from a file in the folder for those.
            OutputFile::create_rewound(path, &std::env::temp_dir())
        } else {
            OutputFile::create(path)
        };
        let out = out.map_err(|cause| Failure::Write { what: name.clone(), cause })?;
        let writer = format.begin(BufWriter::new(out), table).map_err(|cause| failure(&name, cause))?;
        Ok(Self { writer, name, rows: 0 })
    }

    /// Writes a row.
    pub(super) fn row(&mut self, row: &[f64]) -> Result<(), ExportError> {
        self.rows += 1;
        self.writer.row(row)
    }

    /// What a failure to write a row is for the user.
    pub(super) fn failure(&self, cause: ExportError) -> Failure {
        failure(&self.name, cause)
    }

    /// Puts the table in its place; the rows it has.
    pub(super) fn commit(self) -> Result<u64, Failure> {
        let Self { writer, name, rows } = self;
        let out = writer.finish().map_err(|cause| failure(&name, cause))?;
        let put = || out.into_inner().map_err(io::IntoInnerError::into_error)?.commit();
        put().map_err(|cause| Failure::Write { what: name, cause })?;
        Ok(rows)
    }
}

fn failure(name: &str, cause: ExportError) -> Failure {
    Failure::Write { what: name.to_owned(), cause: io_error(cause) }
}

/// The system's error where it is one, so that a closed pipe is known as such.
fn io_error(cause: ExportError) -> io::Error {
    match cause.downcast::<io::Error>() {
        Ok(cause) => *cause,
        Err(cause) => match cause.downcast::<csv::Error>() {
            Ok(cause) if cause.is_io_error() => match cause.into_kind() {
                csv::ErrorKind::Io(cause) => cause,
                _ => io::ErrorKind::Other.into(),
            },
            Ok(cause) => io::Error::other(cause),
            Err(cause) => io::Error::other(cause),
        },
    }
}
