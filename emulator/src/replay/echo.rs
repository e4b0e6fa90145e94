//! Which echo recorded scans hold, and what was taken from them.

use rowscan_protocol::heard_settings::HeardSettings;
use rowscan_protocol::leftover_set::LeftoverSet;
use rowscan_protocol::model::Model;
use rowscan_protocol::optics::FactoryEcho;
use rowscan_protocol::rig::{BeamWidth, EchoChoice, Rig};
use rowscan_protocol::telegram::fr_echo_filter;

/// Notes the settings that were in force at each scan.
#[derive(Debug, Default)]
pub(super) struct SettingsTrace {
    scans: AtScans,
    /// What took something from the first scan, and what changed behind it.
    leftovers: Option<LeftoverSet>,
    changed: LeftoverSet,
}

/// The code of FREchoFilter at the scans so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum AtScans {
    /// There was none.
    #[default]
    NoScan,
    /// The same at all of them; none where the conversation does not tell.
    One(Option<u8>),
    /// It was changed on the way.
    Several,
}

/// What a recorded conversation tells of the echo in its scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToldEcho {
    /// Nothing.
    #[default]
    Nothing,
    /// FREchoFilter had this code at all of them.
    Code(u8),
    /// Some hold another echo than the rest.
    Several,
}

impl SettingsTrace {
    /// A scan comes, with these settings in force.
    pub(super) fn scan(&mut self, heard: &HeardSettings) {
        let first = *self.leftovers.get_or_insert(heard.leftovers());
        self.changed = self.changed.or(first.differing(heard.leftovers()));
        let now = AtScans::One(heard.code());
        self.scans = if [AtScans::NoScan, now].contains(&self.scans) { now } else { AtScans::Several };
    }

    /// What took something from some scans and not from others.
    pub(super) fn changed(&self) -> LeftoverSet {
        self.changed
    }

    /// What the scans hold by it; where there was none, what was heard at last.
    pub(super) fn told(&self, heard: &HeardSettings) -> ToldEcho {
        match self.scans {
            AtScans::NoScan => heard.code().map_or(ToldEcho::Nothing, ToldEcho::Code),
            AtScans::One(code) => code.map_or(ToldEcho::Nothing, ToldEcho::Code),
            AtScans::Several => ToldEcho::Several,
        }
    }
}

/// The code of FREchoFilter that scans were made with: as the recorded conversation tells it, else as the rig says, else the factory's of the model where that
/// begins with the first echo. Of rays every echo is the first. None where nobody knows.
pub(super) fn code_of(told: ToldEcho, model: &Model, rig: Option<&Rig>) -> Option<u8> {
    match told {
        ToldEcho::Code(code) => return Some(code),
        ToldEcho::Several => return None,
        ToldEcho::Nothing => {}
    }
    let is_of_rays = rig.is_some_and(|rig| rig.optics == Some(BeamWidth::Ideal));
    match (rig.and_then(echo_of), model.optics.factory_echo) {
        (Some(EchoChoice::First), _) | (None, FactoryEcho::First) => Some(fr_echo_filter::FIRST),
        (Some(EchoChoice::Last), _) => Some(fr_echo_filter::LAST),
        (None, FactoryEcho::All) => Some(fr_echo_filter::ALL),
        (None, FactoryEcho::Last) => is_of_rays.then_some(fr_echo_filter::ALL),
    }
}

/// The echo that a rig says its scanners send, if it says one of all of them: which of them a stream is nobody tells.
pub(super) fn echo_of(rig: &Rig) -> Option<EchoChoice> {
    let (first, others) = rig.scanners.split_first()?;
    first.echo.filter(|echo| others.iter().all(|mount| mount.echo == Some(*echo)))
}

#[cfg(test)]
mod tests {
    use rowscan_protocol::model;
    use rowscan_protocol::rig::Mount;

    use super::*;

    #[test]
    fn the_conversation_decides_before_the_rig_and_the_rig_before_the_factory() {
        let rig = |echoes: &[Option<EchoChoice>], optics| Rig {
            optics,
            scanners: echoes.iter().map(|echo| Mount { echo: *echo, ..Mount::default() }).collect(),
            ..Rig::default()
        };
        let device = Some(BeamWidth::Device);
        let (first, last) = (Some(EchoChoice::First), Some(EchoChoice::Last));
        for (told, model, rig, expected) in [
            (ToldEcho::Code(0), "lms511", Some(rig(&[last], device)), Some(0)),
            (ToldEcho::Code(2), "lms111", None, Some(2)),
            (ToldEcho::Several, "lms111", Some(rig(&[last], device)), None),
            (ToldEcho::Nothing, "lms511", Some(rig(&[last], device)), Some(2)),
            (ToldEcho::Nothing, "lms511", Some(rig(&[first, first], device)), Some(0)),
            (ToldEcho::Nothing, "lms511", Some(rig(&[first, last], device)), None),
            (ToldEcho::Nothing, "lms511", Some(rig(&[first, None], device)), None),
            (ToldEcho::Nothing, "lms511", Some(rig(&[None], device)), None),
            (ToldEcho::Nothing, "lms511", None, None),
            (ToldEcho::Nothing, "lms511", Some(rig(&[None], Some(BeamWidth::Ideal))), Some(1)),
            (ToldEcho::Nothing, "lms111", None, Some(1)),
            (ToldEcho::Nothing, "mrs1000", Some(rig(&[last], device)), Some(2)),
        ] {
            let model = model::by_name(model).expect("known");
            assert_eq!(code_of(told, model, rig.as_ref()), expected, "{told:?}, {}, {rig:?}", model.name);
        }
    }

    #[test]
    fn an_echo_that_changes_between_scans_is_that_of_neither() {
        use rowscan_protocol::frame::Dialect;
        use rowscan_protocol::telegram::Telegram;
        let traced = |lines: &[&str]| {
            let (mut trace, mut heard) = (SettingsTrace::default(), HeardSettings::default());
            for line in lines {
                match *line {
                    "scan" => trace.scan(&heard),
                    line => heard.take(&Telegram::parse(Dialect::A, line.as_bytes()).expect("a telegram")),
                }
            }
            (trace.told(&heard), trace.changed().iter().map(|(_, setting)| setting.name).collect::<Vec<_>>())
        };
        let told = |lines: &[&str]| traced(lines).0;
        let (first, last, yes) = ("sWN FREchoFilter 0", "sWN FREchoFilter 2", "sWA FREchoFilter");
        for (lines, expected) in [
            (&["scan", "scan"][..], ToldEcho::Nothing),
            (&[last, yes, "scan", "scan"], ToldEcho::Code(2)),
            (&[last, yes, first, yes, "scan"], ToldEcho::Code(0)),
            (&[last, yes, "scan", first, yes], ToldEcho::Code(2)),
            (&[last, yes, "scan", first, yes, "scan"], ToldEcho::Several),
            (&[last, yes, "scan", first, yes, "scan", last, yes, "scan"], ToldEcho::Several),
            (&["scan", last, yes, "scan"], ToldEcho::Several),
            (&[last, yes, "scan", first, "sFA 5", "scan"], ToldEcho::Code(2)),
            (&["sRA FREchoFilter 2"], ToldEcho::Code(2)),
        ] {
            assert_eq!(told(lines), expected, "{lines:?}");
        }
        let (on, off, yes) = ("sWN LFPparticle 1 +500", "sWN LFPparticle 0 +500", "sWA LFPparticle");
        for (lines, expected) in [
            (&["scan", "scan"][..], &[][..]),
            (&[on, yes, "scan", "scan"], &[]),
            (&[on, yes, "scan", off, yes], &[]),
            (&[on, yes, "scan", off, yes, "scan"], &["LFPparticle"]),
            (&["scan", on, yes, "scan", off, yes, "scan"], &["LFPparticle"]),
            (&["scan", on, "sFA 5", "scan"], &[]),
        ] {
            assert_eq!(traced(lines).1, expected, "{lines:?}");
        }
    }
}
