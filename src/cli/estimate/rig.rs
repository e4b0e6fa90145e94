//! The rig that an estimate is made by.

use rowscan_canopy::Warning;
use rowscan_driver::Source;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Mount, Rig, Roof};
use rowscan_recording::{About, Recording, StreamKind};
use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_study::reading::fitted_rig;

use super::super::output::say;
use super::super::recorder::{kept_rig, rig_text};
use super::super::{Failure, models};
use super::other_scene::other_scene;

/// The rig of an estimate.
pub(super) struct Loaded {
    pub(super) rig: Rig,
    /// Which of its scanners each source is.
    pub(super) scanners: Vec<usize>,
    /// The scene it stands in, if its file names one.
    pub(super) scene: Option<Scene>,
    /// What the recording of each source says otherwise.
    pub(super) recorded: Vec<Recorded>,
}

/// What a source's recording says otherwise than the rig: it holds for this source and no other one, whichever of the rig's scanners they are.
#[derive(Debug, Default)]
pub(super) struct Recorded {
    /// The rig's scanner that the source is.
    scanner: usize,
    /// The model that it is read as, where the recording tells and the user does not.
    model: Option<AnyModel>,
    /// The width of the beams, where the recording knows it.
    optics: Option<BeamWidth>,
    /// The echo that the scanner was asked for when the recording was made, where neither the rig nor the user says one.
    echo: Option<EchoChoice>,
    /// The seed that it was made with, where the recording knows it.
    pub(super) seed: Option<u64>,
    pub(super) warnings: Vec<Warning>,
    /// Why the truth of the rig's scene is not its truth.
    pub(super) other_scene: Option<String>,
}

/// Which of the rig's scanners the sources are.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scanners<'a> {
    /// As the command line says, one a source.
    Asked(&'a [usize]),
    /// What its recording says of each, where the rig has that one; else the first one is this one, and so on.
    From(usize),
}

impl Scanners<'_> {
    /// One for each source without a rig, where none is told.
    pub(super) fn in_order(self, sources: usize) -> Vec<usize> {
        match self {
            Self::Asked(scanners) => scanners.to_vec(),
            Self::From(first) => (first..first + sources).collect(),
        }
    }

    /// One for each source, of this rig. One that a recording keeps does not tell them apart where it has more scanners than there are sources.
    fn of(self, sources: &[Source], rig: &Rig, is_kept: bool) -> Result<Vec<usize>, Failure> {
        let Self::From(_) = self else { return Ok(self.in_order(sources.len())) };
        let mounted = rig.scanners.len();
        let mut scanners = self.in_order(sources.len());
        for (source, scanner) in sources.iter().zip(&mut scanners) {
            let recorded = source.mount_on(rig);
            if recorded.is_none() && is_kept && mounted > sources.len() {
                return Err(Failure::Usage(format!(
                    "the kept rig has {mounted} scanners, and {source} does not say which of them it is: say it with --scanner, from 0"
                )));
            }
            *scanner = recorded.unwrap_or(*scanner);
        }
        Ok(scanners)
    }
}

/// What the command line says of the beams, before the rig.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beams {
    pub(super) echo: Option<EchoChoice>,
    pub(super) optics: Option<BeamWidth>,
}

/// The rig called `name`, else the one that the first recording of the sources keeps; `None` where none does. Its scanners, one a source, are of `model`, or else
/// of the model that the source's recording names, and have such beams.
pub(super) fn load(
    name: Option<&str>,
    model: Option<&str>,
    (sources, asked): (&[Source], Scanners<'_>),
    beams: Beams,
) -> Result<Option<Loaded>, Failure> {
    let (rig, scene) = match name {
        Some(name) => files::load_rig(name, say)?,
        None => match first_kept_rig(sources) {
            Some(rig) => (rig, None),
            None => return Ok(None),
        },
    };
    let rig = Rig { optics: beams.optics.or(rig.optics), ..rig };
    let scanners = asked.of(sources, &rig, name.is_none())?;
    let asked = model.map(models::find).transpose()?;
    let rig = fitted_rig(rig, &scanners, asked, beams.echo);
    let of_scene = name.filter(|_| scene.is_some());
    let recorded = |(source, scanner): (&Source, &usize)| {
        let Some(recording) = source.peek() else {
            return Recorded { scanner: *scanner, ..Recorded::default() };
        };
        let model = asked.is_none().then(|| recorded_model(source, &recording, (&rig, *scanner))).flatten();
        Recorded { model, ..Recorded::of(recording.about(), (&rig, *scanner), of_scene) }
    };
    let recorded: Vec<Recorded> = sources.iter().zip(&scanners).map(recorded).collect();
    tell(sources, &recorded);
    Ok(Some(Loaded { rig, scanners, scene, recorded }))
}

/// The rig that the first of these recordings keeps.
fn first_kept_rig(sources: &[Source]) -> Option<Rig> {
    let mut recordings = sources.iter().filter_map(|source| Some((source, source.peek()?)));
    let (source, recording) = recordings.find(|(_, recording)| recording.about().rig.is_some())?;
    let rig = kept_rig(recording.about(), source)?;
    say(format_args!("no --rig: by the rig that {source} keeps"));
    Some(rig)
}

/// The model that a recording is read as by this scanner of the rig; said where the rig has another one there.
fn recorded_model(source: &Source, recording: &Recording, (rig, scanner): (&Rig, usize)) -> Option<AnyModel> {
    let mount = rig.scanners.get(scanner)?;
    let model = source.model_in(recording, AnyModel::by_name(&mount.model))?;
    if mount.model != model.name() {
        let names: Vec<&str> = source.models_in(recording).into_iter().map(AnyModel::name).collect();
        let (told, read) = (names.join(" or "), if names.len() > 1 { model.name() } else { "one" });
        say(format_args!(
            "{source} names the model {told}, and is read as {read}; the rig has {} there; --model decides",
            mount.model
        ));
    }
    Some(model)
}

/// Keys of a rig that are told where a recording was made with another.
const MOST_TOLD: usize = 12;

/// Those that an area goes by most, which are told first.
const TOLD_FIRST: [&str; 5] = ["distance_m", "height_m", "speed_m_s", "roof", "row"];

/// What a recording tells of its scanner itself, or has a warning of its own.
const TOLD_ELSEWHERE: [&str; 2] = ["model", "optics"];

/// How a recording contradicts this rig, of which this scanner made it.
pub(in crate::cli) fn contradictions(source: &Source, rig: &Rig, scanner: usize) -> Vec<Warning> {
    source.peek().map_or_else(Vec::new, |found| Recorded::of(found.about(), (rig, scanner), None).warnings)
}

impl Recorded {
    /// Of a recording that says this, measured by a scanner of `rig`, which the scene of this name has.
    fn of(about: &About, (rig, scanner): (&Rig, usize), of_scene: Option<&str>) -> Self {
        let here = rig_text(rig);
        let mut others = match (about.rig.as_deref(), &here) {
            (Some(recorded), Some(here)) => differences(recorded, here),
            _ => Vec::new(),
        };
        let other_scene = of_scene.and_then(|name| other_scene(about, name, &others));
        let more = others.len().saturating_sub(MOST_TOLD);
        others.truncate(MOST_TOLD);
        others.extend((more > 0).then(|| format!("{more} more")));
        let other_rig = (!others.is_empty()).then_some(Warning::OtherRig { differences: others });
        // A rig that cannot be read says nothing of optics and echo; old ones are read as they are elsewhere.
        let recorded = about.rig.as_deref().and_then(|text| files::rig_from_text(text, |_| ()).ok());
        let echo_of = |rig: &Rig| rig.scanners.get(scanner)?.echo;
        let echo = recorded.as_ref().and_then(echo_of).filter(|_| echo_of(rig).is_none());
        let optics = recorded.and_then(|rig| rig.optics);
        // Only an emulator has a seed, and it knows what its beams are.
        let is_known = about.seed.is_some();
        let other_optics = optics.zip(rig.optics).filter(|(recorded, given)| recorded != given);
        let optics = other_optics.map(|(recorded, _)| recorded).filter(|_| is_known);
        let other_optics =
            other_optics.map(|(recorded, given)| Warning::OtherOptics { recorded, given, is_known });
        let warnings = other_rig.into_iter().chain(other_optics).collect();
        Self { scanner, optics, echo, seed: about.seed, warnings, other_scene, ..Self::default() }
    }

    /// The rig that this source is measured by.
    pub(super) fn decides(&self, rig: &Rig) -> Rig {
        let rig = Rig { optics: self.optics.or(rig.optics), ..rig.clone() };
        fitted_rig(rig, &[self.scanner], self.model, self.echo)
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

/// The keys that two rigs' texts have both, with other values: what was recorded, and what is here; those that cost most first. Keys with a warning of
/// their own are left out.
fn differences(recorded: &str, here: &str) -> Vec<String> {
    let here = keys(here);
    let other = |(key, value): (String, String)| {
        let other = here.iter().find(|(known, _)| *known == key).map(|(_, value)| value)?;
        let name = key.split_once(' ').map_or(key.as_str(), |(_, name)| name);
        (*other != value && !TOLD_ELSEWHERE.contains(&name)).then(|| format!("{name} {value} (here {other})"))
    };
    let mut others: Vec<String> = keys(recorded).into_iter().filter_map(other).collect();
    others.sort_by_key(|told| {
        let name = told.split(' ').next().unwrap_or_default();
        TOLD_FIRST.iter().position(|first| *first == name).unwrap_or(TOLD_FIRST.len())
    });
    others
}

/// A rig's text as its keys, each behind the number of its table, with their values; how its scanners sit in words where the text leaves that out.
fn keys(text: &str) -> Vec<(String, String)> {
    let rig = files::rig_from_text(text, |_| ()).ok();
    let mut mounts = rig.iter().flat_map(|rig| &rig.scanners);
    let mut table = 0;
    let mut keys: Vec<(String, String)> = Vec::new();
    for line in text.lines() {
        if line.starts_with('[') {
            table += 1;
            let mount = mounts.by_ref().take(usize::from(line.contains("scanner]]")));
            keys.extend(mount.flat_map(left_out).map(|(key, value)| (format!("{table} {key}"), value)));
        } else if let Some((key, value)) = line.split_once('=') {
            let key = format!("{table} {}", key.trim());
            if !keys.iter().any(|(known, _)| *known == key) {
                keys.push((key, value.trim().to_owned()));
            }
        }
    }
    keys
}

/// Keys of a scanner that mean something where they are left out, too, and their values in force.
fn left_out(mount: &Mount) -> [(&'static str, String); 5] {
    let roof = match mount.roof_in_force() {
        Roof::Forward => "forward",
        _ => "backward",
    };
    let degrees = |value: f64| format!("{value:?}");
    [
        ("roof", format!("\"{roof}\"")),
        ("offset_y_m", degrees(mount.offset_y_m)),
        ("yaw_deg", degrees(mount.yaw_deg)),
        ("pitch_deg", degrees(mount.pitch_deg)),
        ("roll_deg", degrees(mount.roll_deg)),
    ]
}

/// What the first scanner's bytes are in a recording.
pub(super) fn recorded_kind(source: &Source) -> Option<StreamKind> {
    source.peek()?.streams().iter().map(|stream| stream.kind).find(|kind| kind.is_scanner())
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::rig::RowSide;

    use super::*;

    #[test]
    fn another_rig_is_told_key_by_key() {
        let recorded = "version = 2\nspeed_m_s = 1.0\n\n[[scanner]]\nmodel = \"lms111\"\ndistance_m = 1.9\n[[scanner]]\ndistance_m = 2.0\n";
        assert_eq!(differences(recorded, recorded), Vec::<String>::new());
        let here = recorded.replace("1.9", "2.5").replace("speed_m_s = 1.0\n", "");
        let here = here.replace("lms111", "lms511");
        assert_eq!(differences(recorded, &here), ["distance_m 1.9 (here 2.5)"], "models are told elsewhere");
        // A scanner that sits level and as usual is one of which the rig says no more.
        let text = "version = 2\n[rig]\n[[rig.scanner]]\nmodel = \"lms111\"\ndistance_m = 1.9\n";
        let with = |keys: &str| text.replace("distance_m", &format!("{keys}distance_m"));
        let leaning = with("yaw_deg = 20.0\nroof = \"forward\"\n");
        let leans = ["roof \"backward\" (here \"forward\")", "yaw_deg 0.0 (here 20.0)"];
        assert_eq!(differences(text, &leaning), leans);
        let back = ["roof \"forward\" (here \"backward\")", "yaw_deg 20.0 (here 0.0)"];
        assert_eq!(differences(&leaning, text), back);
        let usual = with("roll_deg = 0.0\nroof = \"backward\"\n");
        assert_eq!(differences(text, &usual), Vec::<String>::new());
        // A conversation may tell the echo, and decides then; one over REST is not recorded.
        let of = |echo: &str| format!("[[scanner]]\necho = \"{echo}\"\n");
        assert_eq!(differences(&of("last"), &of("first")), ["echo \"last\" (here \"first\")"]);
    }

    /// Whatever else is another: what costs most is never among those that are only counted.
    #[test]
    fn the_keys_that_cost_most_are_told_first() {
        let rig = |value: f64| {
            let mount = Mount {
                height_m: value,
                distance_m: value,
                roof: Some(if value > 1.0 { Roof::Forward } else { Roof::Backward }),
                row: if value > 1.0 { RowSide::Left } else { RowSide::Right },
                offset_y_m: value,
                yaw_deg: value,
                pitch_deg: value,
                roll_deg: value,
                ..Mount::default()
            };
            Rig {
                speed_m_s: value,
                start_m: value,
                tree_spacing_m: Some(value),
                row_spacing_m: Some(value),
                trees: Some(value as u32),
                ground_clearance_m: value / 4.0,
                encoder_ticks_per_m: Some(value),
                leaf_area_cm2: Some(value),
                scanners: vec![mount],
                ..Rig::default()
            }
        };
        let about = About { rig: rig_text(&rig(1.0)), ..About::default() };
        let recorded = Recorded::of(&about, (&rig(2.0), 0), None);
        let [Warning::OtherRig { differences }] = recorded.warnings.as_slice() else {
            panic!("{recorded:?}")
        };
        let names: Vec<&str> = differences.iter().filter_map(|told| told.split(' ').next()).collect();
        assert_eq!(names.get(..TOLD_FIRST.len()), Some(&TOLD_FIRST[..]), "{differences:?}");
        assert_eq!(differences.len(), MOST_TOLD + 1, "{differences:?}");
        assert!(differences.last().is_some_and(|last| last.ends_with(" more")), "{differences:?}");
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
            let recorded = Recorded::of(&about, (&rig(given), 0), None);
            let differ = made.is_some() && given.is_some() && made != given;
            let case = format!("made {made:?}, given {given:?}, seed {seed:?}: {recorded:?}");
            assert_eq!(recorded.warnings.len(), usize::from(differ), "{case}");
            let expected = if differ && seed.is_some() { made } else { given };
            assert_eq!(recorded.decides(&rig(given)).optics, expected, "{case}");
        }
    }

    #[test]
    fn the_echo_that_was_asked_for_is_the_recordings_where_the_rig_says_none() {
        let rig = |echo| Rig {
            scanners: vec![Mount::default(), Mount { echo, ..Mount::default() }],
            ..Rig::default()
        };
        let echoes = [None, Some(EchoChoice::First), Some(EchoChoice::Last)];
        for (made, given) in echoes.into_iter().flat_map(|made| echoes.map(|given| (made, given))) {
            let about = About { rig: rig_text(&rig(made)), ..About::default() };
            let echo_of = |scanner: usize| {
                let recorded = Recorded::of(&about, (&rig(given), scanner), None);
                recorded.decides(&rig(given)).scanners.get(scanner).and_then(|mount| mount.echo)
            };
            assert_eq!(echo_of(1), given.or(made), "made {made:?}, given {given:?}");
            assert_eq!(echo_of(0), None, "another scanner's echo is not this one's");
        }
    }
}
