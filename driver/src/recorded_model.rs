//! The model that a recording says its scans are of.

use rowscan_protocol::model::AnyModel;
use rowscan_recording::{About, Recording};

use crate::Source;

impl Source {
    /// The model that a recording names for its scanners, where that is one: of several, which stream is of which is not told. `None` of live scanners, of
    /// files that name none, and of what is no file to be opened twice. Whatever is wrong with a file is told by
    /// [`Scanner::open`](crate::Scanner::open).
    pub fn recorded_model(&self) -> Option<AnyModel> {
        model_of(self.peek()?.about())
    }

    /// A recording with its first packet read, to see what it says of itself; `None` of live scanners and of what cannot be read.
    pub fn peek(&self) -> Option<Recording> {
        let Self::Recording { path, .. } = self else { return None };
        // What is no file, as a pipe, is read only once.
        let mut recording = path.is_file().then(|| Recording::open(path).ok()).flatten()?;
        recording.next_packet().ok()?;
        Some(recording)
    }
}

/// The one model that a recording names.
pub(crate) fn model_of(about: &About) -> Option<AnyModel> {
    let mut names = about.model.as_deref()?.split(',').map(str::trim);
    let first = names.next()?;
    names.all(|name| name == first).then(|| AnyModel::by_name(first))?
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
        let about = About { model: Some(models.join(", ")), ..About::default() };
        let mut writer = McapWriter::new(Cursor::new(Vec::new()), &about, Decoded::default()).unwrap();
        for name in streams {
            let stream = writer.add_stream(name, StreamKind::Cola).unwrap();
            writer.write(stream, Side::Device, 1, 0, b"\x02sRA STlms\x03").unwrap();
        }
        writer.finish().unwrap();
        let path = folder.join(format!("{}-{}.mcap", models.join("-"), streams.len()));
        std::fs::write(&path, writer.into_inner().into_inner()).unwrap();
        path.to_str().unwrap().to_owned()
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
            let same = file(folder.path(), &[second, second], &["left", "right"]);
            assert_eq!(recorded_model(&format!("{same}#right")), Some(*second));
        }
        assert_eq!(recorded_model(&file(folder.path(), &["no-such-model"], &["scanner"])), None);
        assert_eq!(recorded_model("tcp://127.0.0.1:2112"), None);
    }
}
