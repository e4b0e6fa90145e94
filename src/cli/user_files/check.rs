//! `rowscan scene check`, `rowscan rig check`

use rowscan_emulator::stage::scan_mode;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::Rig;
use rowscan_scenes::files;
use rowscan_study::reading::{CalibrationChoice, Reading};

use crate::cli::output::{print, say};
use crate::cli::{Failure, Outcome, models};
use crate::reference::Document;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Files, or names of built-in scenes
    #[arg(value_name = "FILE", required = true)]
    files: Vec<String>,
}

pub(super) fn run(document: Document, args: &Args) -> Result<Outcome, Failure> {
    let mut wrong = Vec::new();
    for name in &args.files {
        match sound(document, name) {
            Ok(told) => print(&format!("{name}: sound: {told}\n"))?,
            Err(failure) => wrong.push(failure),
        }
    }
    // The last one ends the command; those before it are told in the same words.
    let last = wrong.pop();
    wrong.iter().for_each(|failure| say(format_args!("rowscan: {failure}")));
    last.map_or(Ok(Outcome::Done), Err)
}

/// What a file is, in words; refused where it is none.
fn sound(document: Document, name: &str) -> Result<String, Failure> {
    if document == Document::Rig {
        return sound_rig(name, &files::load_rig(name, say)?.0);
    }
    let scene = files::load_scene(name, say)?;
    let layout = scene.orchard.layout();
    let preset = scene.orchard.preset;
    let rig = sound_rig(name, &scene.resolved_rig())?;
    Ok(format!("{preset}, {} row(s) of {} trees; {rig}", layout.rows, layout.trees))
}

/// What a rig is, in words; refused where a scanner, its mode or its calibration is none.
fn sound_rig(name: &str, rig: &Rig) -> Result<String, Failure> {
    let mut scanners = Vec::new();
    for (number, mount) in rig.scanners.iter().enumerate() {
        let of_scanner =
            |cause: &dyn std::fmt::Display| Failure::Usage(format!("{name}: scanner {number}: {cause}"));
        let model = models::find(&mount.model).map_err(|cause| of_scanner(&cause))?;
        if let AnyModel::Cola(model) = model {
            scan_mode(model, mount).map_err(|cause| of_scanner(&cause))?;
        }
        Reading::of(Some(rig), number, true, CalibrationChoice::OfRig).map_err(|cause| of_scanner(&cause))?;
        scanners.push(model.name());
    }
    Ok(format!("{} at {} m/s", scanners.join(", "), rig.speed_m_s))
}
