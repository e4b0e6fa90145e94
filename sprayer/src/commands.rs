//! What a controller has told the valves, and when.

use rowscan_protocol::time::SimTime;
use serde::{Deserialize, Serialize};

use crate::boom::{Boom, Nozzle};
use crate::hydraulics::Regulator;
use crate::valve::{Kind, Step};

/// A duty from here on counts as fully open; 249 of 250 does.
const WHOLE: f64 = 0.99;

/// Whom a command is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// All nozzles.
    All,
    /// Those of the section with this number, from 1.
    Section(u16),
    /// The nozzle with this number, from 0.
    Nozzle(u16),
    /// The regulating valve: how far it shall be open. No nozzle.
    Regulator,
}

impl Target {
    /// True if it names the nozzle with this number, in the section with that number.
    fn means(self, nozzle: usize, section: Option<&u16>) -> bool {
        match self {
            Self::All => true,
            Self::Section(named) => section == Some(&named),
            Self::Nozzle(named) => nozzle == usize::from(named),
            Self::Regulator => false,
        }
    }
}

/// A command, from an instant on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// When it took effect.
    pub at: SimTime,
    /// For whom.
    pub target: Target,
    /// How far they shall be open, 0 to 1.
    pub duty: f64,
}

/// Commands in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CommandLog(Vec<Command>);

/// Commands that open a part which the boom lacks: nothing follows from them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Unheeded {
    /// The part.
    pub target: Target,
    /// How many commands.
    pub commands: usize,
}

/// What a boom has that commands can name.
struct Parts {
    nozzles: usize,
    numbers: Vec<u16>,
    has_regulator: bool,
}

impl Parts {
    fn of(boom: &Boom) -> Self {
        let has_regulator = boom.hydraulics.is_some_and(|keys| keys.regulator == Regulator::Commanded);
        Self { nozzles: boom.nozzles().len(), numbers: boom.numbers().collect(), has_regulator }
    }

    fn have(&self, target: Target) -> bool {
        match target {
            Target::All => true,
            Target::Section(number) => self.numbers.contains(&number),
            Target::Nozzle(number) => usize::from(number) < self.nozzles,
            Target::Regulator => self.has_regulator,
        }
    }
}

impl FromIterator<Command> for CommandLog {
    fn from_iter<T: IntoIterator<Item = Command>>(commands: T) -> Self {
        let mut commands: Vec<Command> = commands.into_iter().collect();
        // Those of one instant keep their order.
        commands.sort_by_key(|command| command.at);
        Self(commands)
    }
}

impl CommandLog {
    /// All of them.
    pub fn all(&self) -> &[Command] {
        &self.0
    }

    /// True where nothing was ever said.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// True if a command names a nozzle or section of the boom.
    pub fn reaches(&self, boom: &Boom) -> bool {
        let parts = Parts::of(boom);
        self.0.iter().any(|command| command.target != Target::Regulator && parts.have(command.target))
    }

    /// Commands that open a part which the boom lacks, by part, in their order. To shut what is not there is no mistake: messages have room for more sections than booms have.
    pub fn unheeded(&self, boom: &Boom) -> Vec<Unheeded> {
        let parts = Parts::of(boom);
        let mut found: Vec<Unheeded> = Vec::new();
        for command in self.0.iter().filter(|command| command.duty > 0.0 && !parts.have(command.target)) {
            match found.iter_mut().find(|unheeded| unheeded.target == command.target) {
                Some(unheeded) => unheeded.commands += 1,
                None => found.push(Unheeded { target: command.target, commands: 1 }),
            }
        }
        found.sort_by_key(|unheeded| unheeded.target);
        found
    }

    /// Commands that give on/off valves a duty between 0 and 1: how many, and the smallest duty. Such valves open fully for any duty above 0, so the controller
    /// may use another unit than the message. `None` where there was no such command.
    pub fn in_part(&self, boom: &Boom) -> Option<(usize, f64)> {
        let nozzles = boom.nozzles();
        let numbers: Vec<u16> = boom.numbers().collect();
        let is_on_off = |target: Target| {
            let of_target = |nozzle: &&Nozzle| target.means(nozzle.number, numbers.get(nozzle.section));
            nozzles.iter().filter(of_target).any(|nozzle| nozzle.valve.kind == Kind::OnOff)
        };
        let in_part = self.0.iter().filter(|command| command.duty > 0.0 && command.duty < WHOLE);
        let duties = in_part.filter(|command| is_on_off(command.target)).map(|command| command.duty);
        let (count, least) =
            duties.fold((0, f64::INFINITY), |(count, least), duty| (count + 1, duty.min(least)));
        (count > 0).then_some((count, least))
    }

    /// The duty of every nozzle over time, shut before the first step; the boom's watchdog closes all when nothing is heard for too long.
    pub fn duties(&self, boom: &Boom) -> Vec<Vec<Step>> {
        let mut duties = Duties::new(boom);
        self.0.iter().for_each(|command| duties.tell(command));
        duties.silent(f64::INFINITY);
        duties.steps
    }

    /// Openings of the regulating valve that were commanded, 0 to 1.
    pub fn openings(&self) -> Vec<Step> {
        let own = self.0.iter().filter(|command| command.target == Target::Regulator);
        own.map(|command| (command.at.as_secs_f64(), command.duty.clamp(0.0, 1.0))).collect()
    }
}

/// The duty of every nozzle as commands come, one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Duties {
    /// The place of each nozzle's section.
    sections: Vec<usize>,
    /// The sections' numbers in commands.
    numbers: Vec<u16>,
    watchdog_s: Option<f64>,
    /// When something was heard last, if all has not been closed since.
    heard_s: Option<f64>,
    /// By nozzle.
    pub(crate) steps: Vec<Vec<Step>>,
}

impl Duties {
    pub(crate) fn new(boom: &Boom) -> Self {
        let sections: Vec<usize> = boom.nozzles().iter().map(|nozzle| nozzle.section).collect();
        let steps = vec![Vec::new(); sections.len()];
        Self {
            sections,
            numbers: boom.numbers().collect(),
            watchdog_s: boom.watchdog_s,
            heard_s: None,
            steps,
        }
    }

    pub(crate) fn tell(&mut self, command: &Command) {
        let at = command.at.as_secs_f64();
        self.silent(at);
        for ((number, section), steps) in self.sections.iter().enumerate().zip(&mut self.steps) {
            if command.target.means(number, self.numbers.get(*section)) {
                tell(steps, at, command.duty.clamp(0.0, 1.0));
            }
        }
        self.heard_s = Some(at);
    }

    /// Nothing more is heard before `until_s`: the watchdog closes all, if it is time.
    pub(crate) fn silent(&mut self, until_s: f64) {
        let Some(late) = self.heard_s.zip(self.watchdog_s).map(|(heard, watchdog)| heard + watchdog) else {
            return;
        };
        if until_s > late {
            self.steps.iter_mut().for_each(|steps| tell(steps, late, 0.0));
            self.heard_s = None;
        }
    }

    /// Forgets steps before `from_s`, but what holds then.
    pub(crate) fn forget(&mut self, from_s: f64) {
        for steps in &mut self.steps {
            let before = steps.partition_point(|(at, _)| *at <= from_s).saturating_sub(1);
            steps.drain(..before);
        }
    }
}

/// Adds a step; what holds already is none, and of several at one instant the last counts.
fn tell(steps: &mut Vec<Step>, at: f64, duty: f64) {
    if steps.last().is_some_and(|(last, _)| *last >= at) {
        steps.pop();
    }
    if steps.last().map_or(0.0, |(_, duty)| *duty) != duty {
        steps.push((at, duty));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boom(watchdog: &str) -> Boom {
        let section =
            |id: &str| format!("[[section]]\nid = \"{id}\"\nside = \"left\"\nz_from_m = 0\nz_to_m = 1\n");
        Boom::read(&format!(
            "version = 1\n{watchdog}\n{}nozzles = 2\n{}number = 7\n",
            section("a"),
            section("b")
        ))
        .expect("a boom")
    }

    fn command(s: f64, target: Target, duty: f64) -> Command {
        Command { at: SimTime((s * 1e9) as u64), target, duty }
    }

    #[test]
    fn a_duty_holds_until_the_next_and_repeats_are_no_steps() {
        let log: CommandLog = [
            command(1.0, Target::Section(1), 1.0),
            command(2.0, Target::Section(1), 1.0),
            command(3.0, Target::Nozzle(1), 0.25),
            command(3.0, Target::Nozzle(1), 0.5),
            command(4.0, Target::All, 0.0),
            command(5.0, Target::Section(7), 2.0),
            command(6.0, Target::Section(99), 1.0),
        ]
        .into_iter()
        .collect();
        assert_eq!(
            log.duties(&boom("")),
            [vec![(1.0, 1.0), (4.0, 0.0)], vec![(1.0, 1.0), (3.0, 0.5), (4.0, 0.0)], vec![(5.0, 1.0)],]
        );
    }

    #[test]
    fn commands_that_name_nothing_on_the_boom_reach_it_not() {
        let reach =
            |target| [command(1.0, target, 1.0)].into_iter().collect::<CommandLog>().reaches(&boom(""));
        assert!(reach(Target::All) && reach(Target::Section(1)) && reach(Target::Section(7)));
        assert!(reach(Target::Nozzle(0)) && reach(Target::Nozzle(2)));
        assert!(!reach(Target::Section(2)) && !reach(Target::Nozzle(3)));
        assert!(!CommandLog::default().reaches(&boom("")));
    }

    #[test]
    fn what_opens_a_part_that_is_not_there_is_counted_and_nothing_else() {
        let log: CommandLog = [
            command(1.0, Target::Section(9), 1.0),
            command(2.0, Target::Section(9), 0.5),
            command(2.5, Target::Section(8), 0.0),
            command(3.0, Target::Nozzle(99), 1.0),
            command(4.0, Target::Regulator, 0.4),
            command(5.0, Target::All, 1.0),
            command(6.0, Target::Section(7), 1.0),
            command(7.0, Target::Nozzle(2), 1.0),
        ]
        .into_iter()
        .collect();
        let unheeded = |target, commands| Unheeded { target, commands };
        let lacking = [unheeded(Target::Section(9), 2), unheeded(Target::Nozzle(99), 1)];
        assert_eq!(log.unheeded(&boom("")), [&lacking[..], &[unheeded(Target::Regulator, 1)]].concat());
        let pump = "[hydraulics]\npump_l_min = 10\nregulator = \"commanded\"\n";
        assert_eq!(log.unheeded(&boom(pump)), lacking);
    }

    #[test]
    fn duties_in_part_are_told_of_valves_that_have_none() {
        let in_part = |target, duty, keys: &str| {
            let log: CommandLog =
                [command(1.0, target, duty), command(2.0, target, 0.0)].into_iter().collect();
            log.in_part(&boom(keys))
        };
        // 1 and 100 of 250, where 250 was meant.
        for duty in [1.0 / 250.0, 100.0 / 250.0] {
            for target in [Target::All, Target::Section(1), Target::Nozzle(2)] {
                assert_eq!(in_part(target, duty, ""), Some((1, duty)));
                for kind in ["pwm", "proportional"] {
                    assert_eq!(in_part(target, duty, &format!("[valve]\nkind = \"{kind}\"\n")), None);
                }
            }
            assert_eq!(
                (in_part(Target::Regulator, duty, ""), in_part(Target::Section(9), duty, "")),
                (None, None)
            );
        }
        assert_eq!((in_part(Target::All, 1.0, ""), in_part(Target::All, 249.0 / 250.0, "")), (None, None));
    }

    #[test]
    fn silence_closes_all_and_a_later_command_opens_only_whom_it_names() {
        let log: CommandLog = [
            command(1.0, Target::All, 1.0),
            command(2.0, Target::All, 1.0),
            command(9.0, Target::Section(7), 1.0),
        ]
        .into_iter()
        .collect();
        let found = log.duties(&boom("watchdog_s = 1.5"));
        assert_eq!(found[0], [(1.0, 1.0), (3.5, 0.0)]);
        assert_eq!(found[2], [(1.0, 1.0), (3.5, 0.0), (9.0, 1.0), (10.5, 0.0)]);
    }
}
