//! The model that a recording says its scans are of.

use rowscan_protocol::model::AnyModel;
use rowscan_recording::{About, Recording};

use crate::Source;

/// Packets of a file, beyond the first, in which it may say of which model its scanner is: a live scanner that is recorded says so once it has started.
const MOST_AHEAD: usize = 1024;

impl Source {
    /// The model that a recording names for the stream that is asked for, else for all its scanners, where that is one. `None` of live scanners, of
    /// files that name none, of several models where no stream is asked for, and of what is no file to be opened twice. Whatever is wrong with a file is told by
    /// [`Scanner::open`](crate::Scanner::open).
    pub fn recorded_model(&self) -> Option<AnyModel> {
        self.model_in(&self.peek()?)
    }

    /// The same of its recording that is open already.
    pub fn model_in(&self, recording: &Recording) -> Option<AnyModel> {
        let Self::Recording { stream, .. } = self else { return None };
        model_of(recording.about(), stream.as_deref())
    }

    /// A recording with its first packets read, to see what it says of itself; `None` of live scanners and of what cannot be read.
    pub fn peek(&self) -> Option<Recording> {
        let Self::Recording { path, .. } = self else { return None };
        // What is no file, as a pipe, is read only once.
        let mut recording = path.is_file().then(|| Recording::open(path).ok()).flatten()?;
        recording.next_packet().ok()?;
        for _ in 0..MOST_AHEAD {
            // What is wrong farther on is told by who reads it.
            if recording.about().model.is_some() || !matches!(recording.next_packet(), Ok(Some(_))) {
                break;
            }
        }
        Some(recording)
    }
}

/// The model that a recording names for this stream, else for all of them.
pub(crate) fn model_of(about: &About, stream: Option<&str>) -> Option<AnyModel> {
    let name = stream.map_or_else(|| about.only_model(), |stream| about.model_of(stream))?;
    AnyModel::by_name(name)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

    use std::io::Cursor;
    use std::path::Path;

    use rowscan_recording::{Decoded, McapWriter, Side, StreamKind};

    use super::*;

    /// A recording of these models, with these streams.
    fn file(folder: &Path, models: &[&str], streams: &[&str]) -> String {
        written(folder, &About { model: Some(models.join(", ")), ..About::default() }, streams)
    }

    fn written(folder: &Path, about: &About, streams: &[&str]) -> String {
        let mut writer = McapWriter::new(Cursor::new(Vec::new()), about, Decoded::default()).unwrap();
        for name in streams {
            let stream = writer.add_stream(name, StreamKind::Cola).unwrap();
            writer.write(stream, Side::Device, 1, 0, b"\x02sRA STlms\x03").unwrap();
        }
        writer.finish().unwrap();
        let path = folder.join(format!("{}.mcap", std::fs::read_dir(folder).unwrap().count()));
        std::fs::write(&path, writer.into_inner().into_inner()).unwrap();
        path.to_str().unwrap().to_owned()
    }

    /// The same, and each model is told of its stream.
    fn named(folder: &Path, models: &[&'static str], streams: &[&str]) -> String {
        let scanners = models.iter().zip(streams).map(|(model, stream)| (*model, [(*stream).to_owned()]));
        written(folder, &About::default().of_scanners(scanners), streams)
    }

    fn recorded_model(source: &str) -> Option<&'static str> {
        source.parse::<Source>().unwrap().recorded_model().map(AnyModel::name)
    }

    #[test]
    fn a_recording_names_every_model_and_of_two_neither() {
        let folder = tempfile::tempdir().unwrap();
        let all: Vec<&str> = AnyModel::all().map(AnyModel::name).collect();
        for pair in all.windows(2) {
            let [first, second] = pair else { panic!("two") };
            let one = file(folder.path(), &[first], &["scanner"]);
            assert_eq!(recorded_model(&one), Some(*first));
            let two = file(folder.path(), pair, &["left", "right"]);
            assert_eq!(recorded_model(&format!("{two}#right")), None, "which of the two is not said");
            let told = named(folder.path(), pair, &["left", "right"]);
            assert_eq!(recorded_model(&format!("{told}#left")), Some(*first));
            assert_eq!(recorded_model(&format!("{told}#right")), Some(*second));
            assert_eq!(recorded_model(&told), None, "which stream is read is not said");
            // The twin: names swapped.
            let swapped = named(folder.path(), pair, &["right", "left"]);
            assert_eq!(recorded_model(&format!("{swapped}#left")), Some(*second));
            let same = file(folder.path(), &[second, second], &["left", "right"]);
            assert_eq!(recorded_model(&format!("{same}#right")), Some(*second));
        }
        assert_eq!(recorded_model(&file(folder.path(), &["no-such-model"], &["scanner"])), None);
        assert_eq!(recorded_model("tcp://127.0.0.1:2112"), None);
    }
}
