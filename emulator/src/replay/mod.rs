//! A recording as live devices again: what it answers, what it sends and when.
//!
//! [`Survey`] reads the recording once and finds its streams, what was asked and answered ([`Script`]) and where the scans are. A [`Playback`] reads
//! it again while it plays, so that hours of it take no memory. It follows a [`Playhead`], which is told where to be. Both read it in one time
//! (`timed_frames.rs`): the file's, or where that stands still, that of the scans' own rate.

mod compact;
mod compact_device;
mod echo;
mod lms2xx_device;
mod moment;
mod playback;
mod playhead;
mod script;
mod serial;
mod stamps;
mod survey;
mod timed_frames;
mod traces;

use std::path::{Path, PathBuf};

use rowscan_protocol::device::{Device, Identity};
use rowscan_protocol::model::{self, Model};
use rowscan_protocol::rig::Rig;
use rowscan_recording::ReadError;

pub use compact::CompactPart;
pub use compact_device::{compact_device_of, compact_model_of};
pub use echo::ToldEcho;
pub use lms2xx_device::{lms2xx_device_of, lms2xx_model_of};
pub use moment::Moment;
pub(crate) use playback::PlaybackEvent;
pub use playback::{Playback, Played};
pub use playhead::Playhead;
pub use script::Script;
pub(crate) use script::{ScriptedReplies, polls};
pub use serial::Lms2xxPart;
pub use stamps::Stamps;
pub use survey::{Part, Survey};

/// Why a recording cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// It cannot be read.
    #[error("cannot read recording {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        cause: ReadError,
    },
    /// Nothing in it that a device sends by itself.
    #[error("{} holds nothing to play: expected scans or other events of a scanner, found {found}", path.display())]
    Nothing {
        /// The file.
        path: PathBuf,
        /// Its streams.
        found: String,
    },
    /// No such stream.
    #[error("{} has no stream `{wanted}`; it has {found}", path.display())]
    NoStream {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// Its streams.
        found: String,
    },
    /// The scanner is none that is modelled.
    #[error(
        "the recorded scanner is {found}, which no model here is; say with --model which one answers what was not recorded \
         (`rowscan models`), or replay its bytes alone with --verbatim"
    )]
    UnknownModel {
        /// What it says of itself.
        found: String,
    },
    /// A place that is not in it.
    #[error("{what}; the recording holds {scans} scans in {seconds:.3} s")]
    Seek {
        /// What is wrong.
        what: String,
        /// Scans of the first stream.
        scans: u64,
        /// From the first event to the last.
        seconds: f64,
    },
}

/// The scanner of a part: the model asked for, or the one the recording tells.
pub fn model_of(
    survey: &Survey,
    part: &Part,
    asked: Option<&'static Model>,
) -> Result<&'static Model, ReplayError> {
    if let Some(model) = asked.or_else(|| survey.about.model_of(&part.name).and_then(model::by_name)) {
        return Ok(model);
    }
    match &part.ident {
        Some(ident) => {
            let called = model::by_ident(ident);
            let beams = part.models_by_scan();
            let fits = |model: &&'static Model| beams.iter().any(|other| other.name == model.name);
            let model = called.clone().find(fits).or_else(|| called.clone().next());
            model.ok_or_else(|| ReplayError::UnknownModel { found: format!("`{ident}`") })
        }
        None => part.model_by_scan().ok_or_else(|| ReplayError::UnknownModel {
            found: part.first_scan.as_ref().map_or_else(
                || "nameless and sends no scans".to_owned(),
                |scan| {
                    format!(
                        "nameless and sends {} beams",
                        scan.channels16.first().map_or(0, |c| c.values.len())
                    )
                },
            ),
        }),
    }
}

/// The device that answers what was not recorded, set as the recorded one was. Where the recording does not tell which echo its scans hold, `rig` may.
pub fn device_of(part: &Part, model: &'static Model, rig: Option<&Rig>) -> Device {
    let mut device = Device::new(model, Identity::of(model, 0));
    let values = part.script.values();
    let echo = echo::code_of(part.told_echo(), model, rig);
    device.play_back(part.first_scan.as_ref().unwrap_or(&Default::default()), values, echo);
    // Whoever polls before it is played has a scan, as from a device that measures.
    if let Some(scan) = &part.first_scan {
        device.show_scan(scan.clone());
    }
    // Where nobody knows what its client logged in with, that may be the password of any model that it may be.
    let alike = part.models_by_scan();
    if part.passwords.is_empty() && part.ident.is_none() && alike.iter().any(|other| other.name == model.name)
    {
        alike.iter().flat_map(|other| other.logins).for_each(|login| device.take_login(*login));
    }
    device
}

pub(crate) fn unreadable(path: &Path) -> impl Fn(ReadError) -> ReplayError + '_ {
    |cause| ReplayError::Read { path: path.to_owned(), cause }
}
