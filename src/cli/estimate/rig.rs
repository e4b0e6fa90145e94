//! The rig that an estimate is made by.

use rowscan_driver::Source;
use rowscan_protocol::rig::{EchoChoice, Rig};
use rowscan_recording::{About, Recording, StreamKind};
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::fitted_rig;

use super::super::output::say;
use super::super::recorder::rig_text;
use super::super::{Failure, models};

/// The rig called `name`, and the scene it stands in, if it names one. Its scanners, one a source, are of `model`, or else of the model that the
/// source's recording names, and send this echo.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    (sources, scanners): (&[Source], &[usize]),
    echo: Option<EchoChoice>,
) -> Result<(Rig, Option<Scene>), Failure> {
    let (mut rig, scene) = files::load_rig(name, say)?;
    let asked = model.map(models::find).transpose()?;
    let recordings: Vec<Option<Recording>> = sources.iter().map(Source::peek).collect();
    tell_other_rigs(&rig, sources.iter().zip(&recordings));
    for ((source, recording), scanner) in sources.iter().zip(&recordings).zip(scanners) {
        let recorded = recording.as_ref().and_then(|recording| source.model_in(recording));
        if let (None, Some(recorded), Some(mount)) = (asked, recorded, rig.scanners.get(*scanner))
            && mount.model != recorded.name()
        {
            let (told, of_rig) = (recorded.name(), &mount.model);
            say(format_args!(
                "{source} names the model {told}, and is read as one; the rig has {of_rig} there; --model decides"
            ));
        }
        rig = fitted_rig(rig, &[*scanner], asked.or(recorded), echo);
    }
    Ok((rig, scene))
}

/// Keys of a rig that are told where a recording was made with another.
const MOST_TOLD: usize = 5;

/// Says where recordings were made with another rig: what is measured goes by the one that is given.
fn tell_other_rigs<'a>(rig: &Rig, sources: impl Iterator<Item = (&'a Source, &'a Option<Recording>)>) {
    let Some(here) = rig_text(rig) else { return };
    let mut seen: Vec<&str> = Vec::new();
    for (source, recording) in sources {
        let Some(recorded) = recording.as_ref().and_then(|recording| recording.about().rig.as_deref()) else {
            continue;
        };
        let others = differences(recorded, &here);
        // Several streams of one file.
        if others.is_empty() || seen.contains(&recorded) {
            continue;
        }
        let told: Vec<&str> = others.iter().take(MOST_TOLD).map(String::as_str).collect();
        let more = others.len().saturating_sub(MOST_TOLD);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        say(format_args!(
            "{source} was made with another rig than --rig says, which decides: {}{more}",
            told.join(", ")
        ));
        seen.push(recorded);
    }
}

/// The keys that two rigs' texts have both, with other values: what was recorded, and what is here.
fn differences(recorded: &str, here: &str) -> Vec<String> {
    let here = keys(here);
    let other = |(key, value): (String, String)| {
        let other = here.iter().find(|(known, _)| *known == key).map(|(_, value)| value)?;
        let name = key.split_once(' ').map_or(key.as_str(), |(_, name)| name);
        (*other != value).then(|| format!("{name} {value} (here {other})"))
    };
    keys(recorded).into_iter().filter_map(other).collect()
}

/// A rig's text as its keys, each behind the number of its table, with their values.
fn keys(text: &str) -> Vec<(String, String)> {
    let mut table = 0;
    let mut keys = Vec::new();
    for line in text.lines() {
        if line.starts_with('[') {
            table += 1;
        } else if let Some((key, value)) = line.split_once('=') {
            keys.push((format!("{table} {}", key.trim()), value.trim().to_owned()));
        }
    }
    keys
}

/// What the first scanner's bytes are in a recording.
pub(super) fn recorded_kind(source: &Source) -> Option<StreamKind> {
    source.peek()?.streams().iter().map(|stream| stream.kind).find(|kind| kind.is_scanner())
}

/// The seed that the first recording among `sources` was made with, as far as it is of the scene called `name`.
pub(super) fn recorded_seed(sources: &[Source], name: Option<&str>) -> Option<u64> {
    let recording = sources.iter().find_map(Source::peek)?;
    let About { scene, seed, .. } = recording.about();
    seed.filter(|_| scene.is_none() || scene.as_deref() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_rig_is_told_key_by_key() {
        let recorded = "version = 2\nspeed_m_s = 1.0\n\n[[scanner]]\nmodel = \"lms111\"\ndistance_m = 1.9\n[[scanner]]\ndistance_m = 2.0\n";
        assert_eq!(differences(recorded, recorded), Vec::<String>::new());
        let here = recorded.replace("1.9", "2.5").replace("speed_m_s = 1.0\n", "");
        assert_eq!(differences(recorded, &here), ["distance_m 1.9 (here 2.5)"]);
    }
}
