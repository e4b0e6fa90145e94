//! The rig that an estimate is made by.

use rowscan_canopy::Warning;
use rowscan_driver::Source;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Rig};
use rowscan_recording::{About, Recording, StreamKind};
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::fitted_rig;

use super::super::output::say;
use super::super::recorder::rig_text;
use super::super::{Failure, models};

/// The rig of an estimate.
pub(super) struct Loaded {
    pub(super) rig: Rig,
    /// The scene it stands in, if its file names one.
    pub(super) scene: Option<Scene>,
    /// What the recording of each source says otherwise.
    pub(super) recorded: Vec<Recorded>,
}

/// What a source's recording says otherwise than the rig.
#[derive(Debug, Default)]
pub(super) struct Recorded {
    /// The width of the beams, where the recording knows it: it holds for this source.
    pub(super) optics: Option<BeamWidth>,
    pub(super) warnings: Vec<Warning>,
}

/// The rig called `name`. Its scanners, one a source, are of `model`, or else of the model that the source's recording names, and send this echo.
pub(super) fn load(
    name: &str,
    model: Option<&str>,
    (sources, scanners): (&[Source], &[usize]),
    echo: Option<EchoChoice>,
) -> Result<Loaded, Failure> {
    let (mut rig, scene) = files::load_rig(name, say)?;
    let asked = model.map(models::find).transpose()?;
    let recordings: Vec<Option<Recording>> = sources.iter().map(Source::peek).collect();
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
    let about = |recording: &Option<Recording>| {
        recording.as_ref().map_or_else(Recorded::default, |recording| Recorded::of(recording.about(), &rig))
    };
    let recorded: Vec<Recorded> = recordings.iter().map(about).collect();
    tell(sources, &recorded);
    Ok(Loaded { rig, scene, recorded })
}

/// Keys of a rig that are told where a recording was made with another.
const MOST_TOLD: usize = 5;

/// What a recording tells of its scanner itself, or has a warning of its own.
const TOLD_ELSEWHERE: [&str; 3] = ["model", "echo", "optics"];

impl Recorded {
    /// Of a recording that says this, measured by `rig`.
    fn of(about: &About, rig: &Rig) -> Self {
        let (Some(recorded), Some(here)) = (about.rig.as_deref(), rig_text(rig)) else {
            return Self::default();
        };
        let mut others = differences(recorded, &here);
        let more = others.len().saturating_sub(MOST_TOLD);
        others.truncate(MOST_TOLD);
        others.extend((more > 0).then(|| format!("{more} more")));
        let other_rig = (!others.is_empty()).then_some(Warning::OtherRig { differences: others });
        // A rig that cannot be read says nothing of optics; old ones are read as they are elsewhere.
        let optics = files::rig_from_text(recorded, |_| ()).ok().and_then(|rig| rig.optics);
        // Only an emulator has a seed, and it knows what its beams are.
        let is_known = about.seed.is_some();
        let other_optics = optics.zip(rig.optics).filter(|(recorded, given)| recorded != given);
        Self {
            optics: other_optics.map(|(recorded, _)| recorded).filter(|_| is_known),
            warnings: other_rig
                .into_iter()
                .chain(other_optics.map(|(recorded, given)| Warning::OtherOptics {
                    recorded,
                    given,
                    is_known,
                }))
                .collect(),
        }
    }

    /// The rig that this source is measured by.
    pub(super) fn decides(&self, rig: &Rig) -> Rig {
        Rig { optics: self.optics.or(rig.optics), ..rig.clone() }
    }
}

/// Says where recordings were made otherwise than the rig says; what is told of several streams of one file is told once.
fn tell(sources: &[Source], recorded: &[Recorded]) {
    let mut told: Vec<&Warning> = Vec::new();
    for (source, recorded) in sources.iter().zip(recorded) {
        for warning in &recorded.warnings {
            if !told.contains(&warning) {
                say(format_args!("{source}: {warning}"));
                told.push(warning);
            }
        }
    }
}

/// The keys that two rigs' texts have both, with other values: what was recorded, and what is here. Keys with a warning of their own are left out.
fn differences(recorded: &str, here: &str) -> Vec<String> {
    let here = keys(here);
    let other = |(key, value): (String, String)| {
        let other = here.iter().find(|(known, _)| *known == key).map(|(_, value)| value)?;
        let name = key.split_once(' ').map_or(key.as_str(), |(_, name)| name);
        (*other != value && !TOLD_ELSEWHERE.contains(&name)).then(|| format!("{name} {value} (here {other})"))
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
        let here = here.replace("lms111", "lms511");
        assert_eq!(differences(recorded, &here), ["distance_m 1.9 (here 2.5)"], "models are told elsewhere");
    }

    #[test]
    fn what_an_emulator_says_of_its_beams_decides_and_of_a_real_scanner_the_rig() {
        let rig = |optics| Rig { optics, ..Rig::default() };
        let widths = [None, Some(BeamWidth::Ideal), Some(BeamWidth::Device)];
        for (made, given, seed) in widths
            .into_iter()
            .flat_map(|made| widths.map(|given| (made, given)))
            .flat_map(|(made, given)| [None, Some(7)].map(|seed| (made, given, seed)))
        {
            let about = About { rig: rig_text(&rig(made)), seed, ..About::default() };
            let recorded = Recorded::of(&about, &rig(given));
            let differ = made.is_some() && given.is_some() && made != given;
            let case = format!("made {made:?}, given {given:?}, seed {seed:?}: {recorded:?}");
            assert_eq!(recorded.warnings.len(), usize::from(differ), "{case}");
            let expected = if differ && seed.is_some() { made } else { given };
            assert_eq!(recorded.decides(&rig(given)).optics, expected, "{case}");
        }
    }
}
