//! The flags every command has that can record what it does.

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_recording::foxglove::Language;
use rowscan_recording::{About, Decoded, Describer, Recorded, Recorder, RecorderOptions, Taps, WallClock};
use rowscan_scenes::files;
use tokio::sync::Notify;

use super::output::{name_of, say};
use super::{Failure, Outcome};
use rowscan_ports::clock::wall_clock_ns;

/// `--record FILE`
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Recording")]
pub(super) struct RecordArgs {
    /// Keep all bytes, both ways, in this file (MCAP)
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    #[command(flatten)]
    decoded: DecodedArgs,
}

/// What is written beside the bytes.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(super) struct DecodedArgs {
    /// What stands in the recording beside the raw bytes, for Foxglove and its like
    #[arg(long, value_enum, value_name = "WHAT", default_value_t)]
    decoded: DecodedArg,
}

impl DecodedArgs {
    /// True if something else than the default was asked for.
    pub(super) fn is_set(self) -> bool {
        self.decoded != DecodedArg::default()
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum DecodedArg {
    /// Nothing: a fifth of the size
    None,
    /// foxglove.LaserScan; positions and CAN frames, too
    #[default]
    Scans,
    /// foxglove.PointCloud instead of scans
    Points,
    /// Both
    All,
    /// A ROS 2 bag: sensor_msgs/LaserScan, sensor_msgs/NavSatFix, and the raw bytes as std_msgs/UInt8MultiArray
    Ros2,
}

impl From<DecodedArgs> for Decoded {
    fn from(args: DecodedArgs) -> Self {
        let is = |wanted: &[DecodedArg]| wanted.contains(&args.decoded);
        Self {
            scans: is(&[DecodedArg::Scans, DecodedArg::All, DecodedArg::Ros2]),
            points: is(&[DecodedArg::Points, DecodedArg::All]),
            beside: args.decoded != DecodedArg::None,
            language: match args.decoded {
                DecodedArg::Ros2 => Language::Ros2,
                _ => Language::Json,
            },
        }
    }
}

/// A recording that may be running beside a command.
#[derive(Debug, Default)]
pub(super) struct Taping(Option<Running>);

#[derive(Debug)]
struct Running {
    recorder: Recorder,
    path: PathBuf,
    /// Rung if writing fails.
    failed: Arc<Notify>,
}

impl RecordArgs {
    /// Whether it is asked for.
    pub(super) fn is_given(&self) -> bool {
        self.record.is_some()
    }

    /// Starts recording, if it was asked for. `waits`: for the disk, instead of losing packets.
    pub(super) fn start(&self, about: About, waits: bool) -> Result<Taping, Failure> {
        self.record
            .as_ref()
            .map_or_else(|| Ok(Taping::default()), |path| start(path, self.decoded.into(), about, waits))
    }
}

/// Starts recording to `path`.
pub(super) fn start(path: &Path, decoded: Decoded, about: About, waits: bool) -> Result<Taping, Failure> {
    let about = about.or(About { program: Some(program()), ..About::default() });
    let options = RecorderOptions { decoded, waits, about };
    let failed = Arc::new(Notify::new());
    let ring = Arc::clone(&failed);
    let recorder = Recorder::start(path, options, WallClock::new(wall_clock_ns()), move |error| {
        say(format_args!("rowscan: {error}"));
        ring.notify_one();
    })?;
    Ok(Taping(Some(Running { recorder, path: path.to_owned(), failed })))
}

/// This program, as files name it.
pub(super) fn program() -> String {
    format!("rowscan {}", env!("CARGO_PKG_VERSION"))
}

/// A rig as the text of its file; none if it has no such form.
pub(super) fn rig_text(rig: &Rig) -> Option<String> {
    files::rig_text(rig).ok()
}

/// The rig that a recording in `file` keeps. What the user should know of it is said, and why it cannot be read.
pub(super) fn kept_rig(about: &About, file: &dyn Display) -> Option<Rig> {
    let tell = |what: &dyn Display| say(format_args!("{file}: its rig: {what}"));
    let rig = files::rig_from_text(about.rig.as_deref()?, |old| tell(&old));
    rig.inspect_err(|why| tell(&format_args!("{why}; say --rig"))).ok()
}

impl Taping {
    /// Where the taps come from; they do nothing if nothing records.
    pub(super) fn taps(&self) -> Taps {
        self.0.as_ref().map_or_else(Taps::default, |running| running.recorder.taps())
    }

    /// Tells the recording of which models its scanners are; nothing if nothing records.
    pub(super) fn models(&self, scanners: usize) -> ModelTeller {
        ModelTeller { describer: self.0.as_ref().map(|running| running.recorder.describer()), scanners }
    }

    /// Resolves once writing has failed. Cancel safe.
    pub(super) async fn failed(&self) {
        match &self.0 {
            Some(running) => running.failed.notified().await,
            None => std::future::pending().await,
        }
    }

    /// Ends the file and tells what it holds; one in which nothing came from a device is not kept, for no command could read it. A finding if the recording is
    /// not whole; the command's own work was done.
    pub(super) fn finish(mut self) -> Outcome {
        let Some(Running { recorder, path, .. }) = self.0.take() else { return Outcome::Done };
        let file = recorder.new_file();
        // A failure was told when it happened.
        let Ok(recorded) = recorder.finish() else { return Outcome::Finding };
        if recorded.from_device == 0 && file.discard().is_ok() {
            say(format_args!("nothing was recorded: {} is not kept", name_of(&path)));
            return Outcome::Done;
        }
        tell(&path, &recorded);
        if recorded.lost > 0 { Outcome::Finding } else { Outcome::Done }
    }
}

/// A command that fails before anything has come leaves no file behind that would be in the way of the next try.
impl Drop for Taping {
    fn drop(&mut self) {
        let Some(Running { recorder, path, .. }) = self.0.take() else { return };
        let file = recorder.new_file();
        match recorder.finish() {
            Ok(recorded) if recorded.from_device == 0 => {
                // It is not the command's error that is to be told.
                let _ = file.discard();
            }
            Ok(recorded) => tell(&path, &recorded),
            // It was told when it happened.
            Err(_) => {}
        }
    }
}

/// Tells a recording of which models its scanners are, as they say themselves.
#[derive(Clone, Debug)]
pub(super) struct ModelTeller {
    describer: Option<Describer>,
    scanners: usize,
}

impl ModelTeller {
    /// The scanner of this stream can be any of these models; none where it says nothing that is known. What it is taken for is believed as far as the
    /// scanner does not say otherwise.
    pub(super) fn tell(&self, stream: &str, models: &[AnyModel], taken_for: Option<AnyModel>) {
        let Some(describer) = &self.describer else { return };
        let believed = taken_for.filter(|taken_for| models.is_empty() || models.contains(taken_for));
        let names: Vec<&str> = match believed {
            Some(model) => vec![model.name()],
            None => models.iter().map(|model| model.name()).collect(),
        };
        describer.of_models(stream, &names, self.scanners);
    }

    /// The scanner of this stream is none of the model that the rig has in its place: which of the rig's scanners it is nobody knows, and the user is told.
    pub(super) fn check_mount(&self, stream: &str, models: &[AnyModel], of_rig: Option<AnyModel>) {
        let Some(other) = of_rig.filter(|of_rig| !models.is_empty() && !models.contains(of_rig)) else {
            return;
        };
        let found: Vec<&str> = models.iter().map(|model| model.name()).collect();
        say(format_args!(
            "{stream}: expected the rig's {}, found {}: the recording does not say which of the rig's scanners this is; name the sources in the rig's order",
            other.name(),
            found.join(" or ")
        ));
        self.describer.iter().for_each(|describer| describer.not_of_mount(stream));
    }
}

/// Tells what a recording came to.
pub(super) fn tell(path: &Path, Recorded { packets, bytes, lost, .. }: &Recorded) {
    say(format_args!("{}: {packets} packets, {bytes} bytes recorded, {lost} packets lost", name_of(path)));
}
