//! The model that a recording says its scans are of.

use std::collections::BTreeSet;
use std::path::Path;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_recording::{About, Format, Recording, streams_with_scans};

use crate::Source;

/// Packets of a file, beyond the first, in which it may say of which model its scanner is: a live scanner that is recorded says so once it has started.
const MOST_AHEAD: usize = 1024;

impl Source {
    /// The model that a recording names for the stream that is read. `None` of live scanners, of files that name none or several that it can be, and of
    /// what is no file to be opened twice. Whatever is wrong with a file is told by [`Scanner::open`](crate::Scanner::open).
    pub fn recorded_model(&self) -> Option<AnyModel> {
        match self.models_in(&self.peek()?).as_slice() {
            [model] => Some(*model),
            _ => None,
        }
    }

    /// The models that the scanner of the stream that is read can be, by its recording, which is open already: one where it is known.
    pub fn models_in(&self, recording: &Recording) -> Vec<AnyModel> {
        let Self::Recording { path, stream } = self else { return Vec::new() };
        let about = recording.about();
        // Which stream is read is looked for only where it decides.
        let decides = !(about.models.is_empty() && about.candidates.is_empty());
        models_of(about, read_stream(path, stream.as_ref(), recording, decides).as_deref())
    }

    /// Which of its rig's scanners, from 0, the stream that is read is of, by its recording, which is open already; `None` where that does not say.
    pub fn mount_in(&self, recording: &Recording) -> Option<usize> {
        let Self::Recording { path, stream } = self else { return None };
        let about = recording.about();
        about.mount_of(&read_stream(path, stream.as_ref(), recording, !about.mounts.is_empty())?)
    }

    /// Which of this rig's scanners, from 0, its recording says that it is of; `None` of live scanners, and where the recording does not say or the rig has
    /// none such.
    pub fn mount_on(&self, rig: &Rig) -> Option<usize> {
        self.mount_in(&self.peek()?).filter(|mount| *mount < rig.scanners.len())
    }

    /// The model that such a recording is read as: the one it names. Of several that it can be, that of the rig if it is one of them, else the first.
    pub fn model_in(&self, recording: &Recording, of_rig: Option<AnyModel>) -> Option<AnyModel> {
        let models = self.models_in(recording);
        of_rig.filter(|of_rig| models.contains(of_rig)).or_else(|| models.first().copied())
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

/// The stream that is read: the one that is named, else the first with scans, which is looked for where that decides.
fn read_stream(path: &Path, named: Option<&String>, recording: &Recording, decides: bool) -> Option<String> {
    let first = || seen_ahead(path, recording).pop_first();
    named.cloned().or_else(|| decides.then(first).flatten())
}

/// The models that a recording names for this stream, else for all of them.
pub(crate) fn models_of(about: &About, stream: Option<&str>) -> Vec<AnyModel> {
    let names = match stream {
        Some(stream) => about.candidates_of(stream),
        None => about.only_model().into_iter().collect(),
    };
    names.into_iter().filter_map(AnyModel::by_name).collect()
}

/// The streams of a file that may hold several: those with scans, of which the first is read. Empty where no other stream than the open one can be seen
/// ahead, and of what is no file, as a pipe, which is read only once. What is wrong with a file is told by who reads it.
pub(crate) fn seen_ahead(path: &Path, recording: &Recording) -> BTreeSet<String> {
    let may_be_several = recording.format() == Format::Mcap || recording.streams().len() > 1;
    let again = (may_be_several && path.is_file()).then(|| Recording::open(path).ok());
    again.flatten().and_then(|recording| streams_with_scans(recording).ok()).unwrap_or_default()
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
        holding(folder, about, streams, b"\x02sRA STlms\x03")
    }

    fn holding(folder: &Path, about: &About, streams: &[&str], bytes: &[u8]) -> String {
        let mut writer = McapWriter::new(Cursor::new(Vec::new()), about, Decoded::default()).unwrap();
        for name in streams {
            let stream = writer.add_stream(name, StreamKind::Cola).unwrap();
            writer.write(stream, Side::Device, 1, 0, bytes).unwrap();
        }
        writer.finish().unwrap();
        let path = folder.join(format!("{}.mcap", std::fs::read_dir(folder).unwrap().count()));
        std::fs::write(&path, writer.into_inner().into_inner()).unwrap();
        path.to_str().unwrap().to_owned()
    }

    /// The same, and each model is told of its stream.
    fn named(folder: &Path, models: &[&'static str], streams: &[&str]) -> String {
        let scanners = models.iter().zip(streams).enumerate();
        let scanners = scanners.map(|(mount, (model, stream))| (*model, mount, [(*stream).to_owned()]));
        written(folder, &About::default().of_scanners(scanners), streams)
    }

    const SCAN: &[u8] = b"\x02sSN LMDscandata 1 1 16F4C7A 0 0 7 9 3E8 4B0 0 0 4 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 3E8 0 7D0 0 0 0 0 0 0\x03";

    fn recorded_model(source: &str) -> Option<&'static str> {
        source.parse::<Source>().unwrap().recorded_model().map(AnyModel::name)
    }

    /// The first by name is read, in whichever order they came.
    #[test]
    fn of_several_streams_the_model_is_that_of_the_one_that_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let all: Vec<&str> = AnyModel::all().map(AnyModel::name).collect();
        for pair in all.windows(2) {
            let [first, second] = pair else { panic!("two") };
            for streams in [["left", "right"], ["right", "left"]] {
                let scanners = [(*first, 2, ["left".to_owned()]), (*second, 5, ["right".to_owned()])];
                let about = About::default().of_scanners(scanners);
                let path = holding(folder.path(), &about, &streams, SCAN);
                for (source, expected, mount) in [
                    (path.clone(), *first, 2),
                    (format!("{path}#left"), *first, 2),
                    (format!("{path}#right"), *second, 5),
                ] {
                    assert_eq!(recorded_model(&source), Some(expected), "{source} of {streams:?}");
                    let source: Source = source.parse().unwrap();
                    assert_eq!(
                        source.mount_in(&source.peek().unwrap()),
                        Some(mount),
                        "{source} of {streams:?}"
                    );
                }
            }
        }
    }

    /// Of a family's name the rig's model is taken if it is of the family, else the family's first.
    #[test]
    fn a_recording_of_a_family_is_read_as_the_rigs_model_or_the_first() {
        let folder = tempfile::tempdir().unwrap();
        let all: Vec<AnyModel> = AnyModel::all().collect();
        for family in all.windows(2) {
            let names: Vec<&str> = family.iter().map(|model| model.name()).collect();
            let candidates = [("scanner".to_owned(), names.join(", "))].into();
            let path = holding(folder.path(), &About { candidates, ..About::default() }, &["scanner"], SCAN);
            for source in [path.clone(), format!("{path}#scanner")] {
                let source: Source = source.parse().unwrap();
                assert_eq!(source.recorded_model(), None, "it is one of two");
                let recording = source.peek().unwrap();
                for of_rig in all.iter().copied().map(Some).chain([None]) {
                    let is_one = of_rig.is_some_and(|of_rig| family.contains(&of_rig));
                    let expected = if is_one { of_rig } else { family.first().copied() };
                    assert_eq!(source.model_in(&recording, of_rig), expected, "{names:?}, {of_rig:?}");
                }
            }
        }
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
            assert_eq!(recorded_model(&told), None, "none is read: they hold no scan");
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
