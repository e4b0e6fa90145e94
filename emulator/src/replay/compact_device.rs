//! The device that answers in the place of a recorded picoScan or multiScan.

use rowscan_protocol::device::{Device, EchoOfTurns, Identity};
use rowscan_protocol::heard_settings::first_sent;
use rowscan_protocol::model::{Model, SEGMENTED};
use rowscan_protocol::rig::Rig;

use super::echo::{ToldEcho, echo_of};
use super::{Part, ReplayError, Survey};

/// The scanner of recorded datagrams: the model asked for, the one that the recording tells, or the first one that has such turns.
pub fn compact_model_of(
    survey: &Survey,
    part: &Part,
    asked: Option<&'static Model>,
) -> Result<&'static Model, ReplayError> {
    let told =
        || SEGMENTED.iter().find(|model| Some(model.name) == survey.about.model_of(&part.name)).copied();
    let by_turns = || SEGMENTED.iter().find(|model| part.compact.mode(model).is_some()).copied();
    let model = asked.or_else(told).or_else(by_turns);
    model.filter(|model| part.compact.mode(model).is_some()).ok_or_else(|| ReplayError::UnknownModel {
        found: part.compact.first.as_ref().map_or_else(
            || "nameless and sends no whole turn".to_owned(),
            |scan| {
                let step_deg = scan.beams.step_deg();
                format!(
                    "nameless and turns {:.2} times a second with beams of {step_deg:.3}°",
                    scan.scan_frequency_hz
                )
            },
        ),
    })
}

/// The device that answers in the place of the recorded one, set as that was. Which echo its turns hold, where it is one, a recorded conversation over CoLa
/// tells, else `rig`: over REST it was asked for beside the recording.
pub fn compact_device_of(part: &Part, model: &'static Model, rig: Option<&Rig>) -> Device {
    let mut device = Device::new(model, Identity::of(model, 0));
    if let (Some(scan), Some(mode)) = (&part.compact.first, part.compact.mode(model)) {
        let echo = match part.told_echo() {
            ToldEcho::Code(code) => first_sent(code).map_or(EchoOfTurns::Untold, EchoOfTurns::One),
            ToldEcho::Several => EchoOfTurns::Changing,
            ToldEcho::Nothing => rig.and_then(echo_of).map_or(EchoOfTurns::Untold, EchoOfTurns::One),
        };
        device.play_back_turns(scan.serial_number, mode, scan.echoes.len(), echo);
    }
    device
}
