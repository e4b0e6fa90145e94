//! A recording as a source: the file's bytes go through the client session as a live link's do.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rowscan_protocol::client::{Client, Event};

use crate::DriverError;

/// Bytes read from the file at a time.
const READ_CHUNK: usize = 64 * 1024;

/// A file of recorded telegrams being read.
#[derive(Debug)]
pub(crate) struct Recording {
    path: PathBuf,
    file: File,
    client: Client,
    chunk: Vec<u8>,
    bytes: u64,
    ended: bool,
}

impl Recording {
    /// Opens `path`; the session only listens.
    pub(crate) fn open(path: &Path, max_payload: usize) -> Result<Self, DriverError> {
        let fail = |cause| DriverError::Recording { path: path.to_owned(), cause };
        let file = File::open(path).map_err(fail)?;
        if file.metadata().map_err(fail)?.is_dir() {
            return Err(fail(std::io::Error::new(std::io::ErrorKind::IsADirectory, "it is a directory")));
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            client: Client::listen(max_payload),
            chunk: vec![0; READ_CHUNK],
            bytes: 0,
            ended: false,
        })
    }

    pub(crate) fn client(&self) -> &Client {
        &self.client
    }

    /// The next event of the session, or `None` at the end of the file.
    pub(crate) fn next_event(&mut self) -> Result<Option<Event>, DriverError> {
        loop {
            if let Some(event) = self.client.poll_event() {
                return Ok(Some(event));
            }
            let fail = |cause| DriverError::Recording { path: self.path.clone(), cause };
            let read = self.file.read(&mut self.chunk).map_err(fail)?;
            match self.chunk.get(..read) {
                Some(bytes) if !bytes.is_empty() => {
                    self.bytes += bytes.len() as u64;
                    self.client.handle_bytes(Duration::ZERO, bytes);
                }
                _ if !self.ended => {
                    self.ended = true;
                    self.client.handle_end();
                }
                _ if self.client.counts().frames == 0 => {
                    return Err(DriverError::NotARecording { path: self.path.clone(), bytes: self.bytes });
                }
                _ => return Ok(None),
            }
        }
    }
}
