//! Writes a recording on a thread of its own, fed through a bounded queue.

use std::collections::BTreeMap;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::Duration;

use rowscan_files::{NewFile, OutputFile};

use crate::describer::Describer;
use crate::queue::{Item, Queue};
use crate::tap::Taps;
use crate::wall_clock::WallClock;
use crate::writer::{About, Decoded, McapWriter, StreamId};
use crate::{RecordError, Side};

/// Bytes are flushed at least this often: what a killed program loses at most.
const FLUSH: Duration = Duration::from_millis(200);

/// How a recording is made.
#[derive(Clone, Debug)]
pub struct RecorderOptions {
    /// What is written beside the bytes.
    pub decoded: Decoded,
    /// Wait for the disk instead of losing packets; for a source whose clock waits for its clients.
    pub waits: bool,
    /// What the recording is of.
    pub about: About,
}

/// Totals of a finished recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recorded {
    /// Packets kept.
    pub packets: u64,
    /// Bytes kept, as they were on the wire.
    pub bytes: u64,
    /// Packets lost because the writer could not keep up.
    pub lost: u64,
    /// Packets from a device: of a scanner, a GNSS receiver or a bus.
    pub from_device: u64,
}

/// A recording being written. Dropping it lets the file end without its index, as a crash would; it still opens.
#[derive(Debug)]
pub struct Recorder {
    queue: Arc<Queue>,
    describer: Describer,
    path: PathBuf,
    new_file: NewFile,
    thread: JoinHandle<Result<Recorded, RecordError>>,
}

impl Recorder {
    /// Makes the file and starts its thread, which calls `failed` at once if writing fails later.
    pub fn start(
        path: &Path,
        options: RecorderOptions,
        clock: WallClock,
        failed: impl FnOnce(&RecordError) + Send + 'static,
    ) -> Result<Self, RecordError> {
        let path = path.to_owned();
        let (file, new_file) = create(&path)?;
        let RecorderOptions { decoded, waits, about } = options;
        let file = BufWriter::with_capacity(256 * 1024, file);
        let writer = McapWriter::new(file, &about, decoded)
            .map_err(|cause| RecordError::Create { path: path.clone(), cause })?;
        let (queue, items) = Queue::new(clock.clone(), waits);
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn({
                let path = path.clone();
                move || {
                    let mut writer_thread = WriterThread {
                        writer,
                        streams: BTreeMap::new(),
                        clock,
                        recorded: Recorded::default(),
                    };
                    writer_thread.write_all(&items).map_err(|cause| {
                        let error =
                            RecordError::Write { path, cause, packets: writer_thread.recorded.packets };
                        failed(&error);
                        error
                    })?;
                    Ok(writer_thread.recorded)
                }
            })
            .map_err(|cause| RecordError::Create { path: path.clone(), cause })?;
        let describer = Describer::new(Arc::clone(&queue), about);
        Ok(Self { queue, describer, path, new_file, thread })
    }

    /// Opens its taps.
    pub fn taps(&self) -> Taps {
        self.queue.taps()
    }

    /// Tells it what is found out meanwhile.
    pub fn describer(&self) -> Describer {
        self.describer.clone()
    }

    /// The file, to be taken back after [`finish`](Self::finish) if nothing came.
    pub fn new_file(&self) -> NewFile {
        self.new_file.clone()
    }

    /// Writes what is queued, and the file's end. Waits for the disk. What taps take from now on is not kept.
    pub fn finish(self) -> Result<Recorded, RecordError> {
        self.queue.close();
        let ended = self.thread.join().unwrap_or_else(|_| {
            let cause = io::Error::other("the recorder's thread has panicked");
            Err(RecordError::Write { path: self.path, cause, packets: 0 })
        });
        ended.map(|recorded| Recorded { lost: self.queue.lost(), ..recorded })
    }
}

/// Makes a file where none is, or where nothing would be lost.
fn create(path: &Path) -> Result<(OutputFile, NewFile), RecordError> {
    OutputFile::append_to_new(path).map_err(|cause| match cause.kind() {
        io::ErrorKind::AlreadyExists => {
            let bytes = std::fs::metadata(path).map_or(0, |found| found.len());
            RecordError::Exists { path: path.to_owned(), bytes }
        }
        _ => RecordError::Create { path: path.to_owned(), cause },
    })
}

/// State of the thread: turns items into records.
struct WriterThread {
    writer: McapWriter<BufWriter<OutputFile>>,
    /// By the tap's number.
    streams: BTreeMap<u32, StreamId>,
    clock: WallClock,
    recorded: Recorded,
}

impl WriterThread {
    fn write_all(&mut self, items: &Receiver<Item>) -> io::Result<()> {
        let flush_ns = FLUSH.as_nanos() as u64;
        let mut flushed_ns = self.clock.now_ns();
        self.writer.flush()?;
        loop {
            let item = match items.recv_timeout(FLUSH) {
                Err(RecvTimeoutError::Disconnected) => return self.writer.finish(),
                Ok(item) => Some(item),
                Err(RecvTimeoutError::Timeout) => None,
            };
            let idle = item.is_none();
            item.map_or(Ok(()), |item| self.write(item))?;
            // A clock that was set back counts as time that has passed.
            let now_ns = self.clock.now_ns();
            if idle || now_ns.checked_sub(flushed_ns).is_none_or(|passed| passed >= flush_ns) {
                self.writer.flush()?;
                flushed_ns = now_ns;
            }
        }
    }

    fn write(&mut self, item: Item) -> io::Result<()> {
        match item {
            Item::Open { stream, name, kind } => {
                self.streams.insert(stream, self.writer.add_stream(&name, kind)?);
            }
            Item::About(about) => self.writer.describe(&about)?,
            Item::Packet { stream, from, at_ns, lost_before, bytes } => {
                if let Some(&stream) = self.streams.get(&stream) {
                    self.writer.write(stream, from, at_ns, lost_before, &bytes)?;
                    self.recorded.packets += 1;
                    self.recorded.from_device += u64::from(from == Side::Device);
                    self.recorded.bytes += bytes.len() as u64;
                }
            }
        }
        Ok(())
    }
}
