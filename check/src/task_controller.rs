//! The rig's own task controller on a bus: `[[bus]] task_controller = { … }`. It commands a client by a list of times, and faults act on it.

use std::collections::VecDeque;
use std::time::Duration;

use rowscan_bus::isobus::role::{ClientLog, Role, StepTold};
use rowscan_bus::isobus::server::{News, TaskServer, Untold, What, Wishes};
use rowscan_bus::isobus::trouble::TroubleDesk;
use rowscan_faults::{Fit, Order, Part};
use rowscan_protocol::time::SimTime;
use rowscan_settings::fault_table::PartFault;
use serde::Deserialize;

/// What faults and `on` call it.
pub(crate) const NAME: &str = "task_controller";
/// The highest number of a section: 16 words of 16 sections.
const MOST_SECTIONS: u16 = 256;

/// `task_controller = { … }`
#[derive(Clone, Debug, Default, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TaskControllerTable {
    /// What it wants of its clients, one after the other; nothing, and all sections shut, until the first.
    pub(crate) step: Option<Vec<StepTable>>,
}

/// A step of a task.
#[derive(Clone, Debug, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct StepTable {
    /// From when on, simulated seconds.
    #[schemars(range(min = 0), example = 2.0)]
    pub(crate) at_s: f64,
    /// The sections that are open then, by their places in the client's object pool, from 1; all others shut.
    #[schemars(example = [1, 3])]
    pub(crate) open: Option<Vec<u16>>,
    /// The rate from then on, litres per hectare; as before where left out.
    #[schemars(range(min = 0, max = 100_000), example = 300.0)]
    pub(crate) rate_l_ha: Option<f64>,
}

/// A task, its values checked: what is wanted, and from when on.
#[derive(Clone, Debug, Default)]
pub struct TaskSpec(VecDeque<(SimTime, Wishes)>);

impl TaskSpec {
    /// Of this table.
    pub(crate) fn new(table: TaskControllerTable) -> Result<Self, String> {
        let mut steps = VecDeque::new();
        let mut last = (-1.0, None);
        for step in table.step.unwrap_or_default() {
            let at_s = step.at_s;
            if !(at_s >= 0.0 && at_s.is_finite() && at_s > last.0) {
                return Err(format!(
                    "`task_controller.step`: expected `at_s` of 0 or more, each later than the one before, found {at_s}"
                ));
            }
            if let Some(rate) = step.rate_l_ha.filter(|rate| !(0.0..=100_000.0).contains(rate)) {
                return Err(format!(
                    "`task_controller.step`: expected `rate_l_ha` of 0 to 100000, found {rate}"
                ));
            }
            let open = step.open.unwrap_or_default();
            if let Some(wrong) = open.iter().find(|number| !(1..=MOST_SECTIONS).contains(*number)) {
                return Err(format!(
                    "`task_controller.step`: expected sections 1 to {MOST_SECTIONS}, found {wrong}"
                ));
            }
            let count = open.iter().copied().max().unwrap_or(0);
            last = (at_s, step.rate_l_ha.or(last.1));
            let wishes = Wishes {
                rate_l_ha: last.1,
                sections: (1..=count).map(|number| open.contains(&number)).collect(),
            };
            steps.push_back((SimTime((at_s * 1e9).round() as u64), wishes));
        }
        Ok(Self(steps))
    }

    /// The control function that carries it out.
    pub(crate) fn role(&self, (log, troubles): (ClientLog, TroubleDesk)) -> Role {
        let server = Box::new(TaskServer::new(Wishes::default()));
        Role::Server { server, task: self.0.clone(), log, troubles }
    }

    /// What of this task could not be carried out, and what clients did not take, in words.
    pub(crate) fn told(&self, news: &[News], steps: &[StepTold]) -> Vec<String> {
        let most = self.0.iter().map(|(_, wishes)| wishes.sections.len()).max().unwrap_or(0);
        let mut told: Vec<String> = Vec::new();
        for News { client, what, .. } in news {
            let words = match what {
                What::Active { sections } if most > *sections => format!(
                    "a step opens section {most}, and the client at 0x{client:02X} has {sections} sections: what it lacks is opened nowhere"
                ),
                What::Refused(error) => {
                    format!("the pool of the client at 0x{client:02X} is refused: {error}")
                }
                What::NotTaken(element, ddi, reasons) => {
                    format!(
                        "the client at 0x{client:02X} did not take DDI {ddi} of element {element} (reasons 0x{reasons:02X})"
                    )
                }
                What::Active { .. } | What::Lost | What::Told(_) => continue,
            };
            let words = format!("`task_controller`: {words}");
            if !told.contains(&words) {
                told.push(words);
            }
        }
        if !news.iter().any(|news| matches!(news.what, What::Active { .. })) {
            told.push("`task_controller`: no client's pool was ever in use: nobody was commanded".to_owned());
            return told;
        }
        told.extend(self.0.iter().filter_map(|step| unsent(step, news, steps)));
        told
    }
}

/// Why a step was sent to no client, in words; none where it was sent.
fn unsent((at, wishes): &(SimTime, Wishes), news: &[News], steps: &[StepTold]) -> Option<String> {
    let why = match steps.iter().find(|step| step.at == *at).map(|step| step.untold) {
        Some(None) => return None,
        None => "the drive ended before".to_owned(),
        Some(Some(Untold::Unheard)) => "a fault kept the task controller from being heard".to_owned(),
        Some(Some(Untold::Busy)) => "a fault kept the task controller busy".to_owned(),
        Some(Some(Untold::NoSetpoint)) => "no client's pool has a setpoint for it".to_owned(),
        Some(Some(Untold::NoClient)) => {
            let before = |news: &&News| news.at <= *at && matches!(news.what, What::Lost);
            let last = news.iter().rfind(before).map_or(String::new(), |News { at, client, .. }| {
                format!("; the client at 0x{client:02X} was lost at {:.3} s", at.as_secs_f64())
            });
            format!("no client's pool was in use then, or until the next step{last}")
        }
    };
    let open: Vec<String> = (1..)
        .zip(&wishes.sections)
        .filter(|(_, is_open)| **is_open)
        .map(|(number, _): (u16, _)| number.to_string())
        .collect();
    let open = if open.is_empty() {
        "shuts all sections".to_owned()
    } else {
        format!("opens sections {}", open.join(", "))
    };
    let rate = wishes.rate_l_ha.map_or(String::new(), |rate| format!(", {rate} l/ha"));
    Some(format!(
        "`task_controller`: the step at {} s ({open}{rate}) was never sent: {why}",
        at.as_secs_f64()
    ))
}

/// The task controller as a part that faults act on.
#[derive(Debug)]
pub(crate) struct TaskControllerPart(pub(crate) TroubleDesk);

impl Part for TaskControllerPart {
    fn fits(&self, fault: &PartFault) -> Fit {
        match fault {
            PartFault::TaskController(_) => Fit::Acts,
            _ => Fit::Foreign,
        }
    }

    fn begin(&self, order: &Order<'_>) {
        if let PartFault::TaskController(fault) = order.fault {
            self.0.begin(order.key, *fault);
        }
    }

    fn end(&self, key: u64, _: Duration) {
        self.0.end(key);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by panicking")]

    use super::*;

    fn task(text: &str) -> Result<TaskSpec, String> {
        let table = rowscan_settings::from_toml(text).expect("a table");
        TaskSpec::new(table)
    }

    fn active(sections: usize) -> News {
        News { at: SimTime::ZERO, client: 0x81, what: What::Active { sections } }
    }

    fn step(s: u64, untold: Option<Untold>) -> StepTold {
        StepTold { at: SimTime(s * 1_000_000_000), untold }
    }

    #[test]
    fn steps_keep_their_rate_and_shut_what_they_do_not_name() {
        let text =
            "step = [{ at_s = 1, open = [1, 3], rate_l_ha = 200 }, { at_s = 2.5, open = [2] }, { at_s = 3 }]";
        let TaskSpec(steps) = task(text).expect("sound");
        let wishes = |sections: &[bool]| Wishes { rate_l_ha: Some(200.0), sections: sections.to_vec() };
        let expected = [
            (SimTime(1_000_000_000), wishes(&[true, false, true])),
            (SimTime(2_500_000_000), wishes(&[false, true])),
            (SimTime(3_000_000_000), wishes(&[])),
        ];
        assert_eq!(steps, expected);
    }

    #[test]
    fn what_could_not_be_carried_out_is_told_once() {
        let task = task("step = [{ at_s = 1, open = [9] }]").expect("sound");
        let sent = [step(1, None)];
        assert!(task.told(&[active(9)], &sent).is_empty());
        let told = task.told(&[active(8), active(8)], &sent);
        assert!(
            matches!(&told[..], [one] if one.contains("opens section 9") && one.contains("has 8")),
            "{told:?}"
        );
        let told = task.told(&[], &[step(1, Some(Untold::NoClient))]);
        assert!(matches!(&told[..], [one] if one.contains("nobody was commanded")), "{told:?}");
        let refused = News { at: SimTime::ZERO, client: 0x81, what: What::NotTaken(2, 290, 0x10) };
        assert!(task.told(&[active(9), refused], &sent)[0].contains("DDI 290 of element 2"));
    }

    #[test]
    fn every_step_that_was_sent_to_nobody_is_told_with_its_time_and_why() {
        let text = "step = [{ at_s = 1, open = [1, 3], rate_l_ha = 200 }, { at_s = 2.5 }]";
        let task = task(text).expect("sound");
        let lost = News { at: SimTime(2_000_000_000), client: 0x81, what: What::Lost };
        let news = [active(4), lost];
        let second = SimTime(2_500_000_000);
        let last = |untold| task.told(&news, &[step(1, None), StepTold { at: second, untold }]);
        assert!(last(None).is_empty(), "the wrong twin: a client was there and was told");
        for (why, says) in [
            (Untold::NoClient, "the client at 0x81 was lost at 2.000 s"),
            (Untold::Unheard, "from being heard"),
            (Untold::Busy, "busy"),
            (Untold::NoSetpoint, "no client's pool has a setpoint"),
        ] {
            let told = last(Some(why));
            let expected = "the step at 2.5 s (shuts all sections, 200 l/ha) was never sent: ";
            assert!(matches!(&told[..], [one] if one.contains(expected) && one.contains(says)), "{told:?}");
        }
        // The drive ended before the second one; nobody was there yet at the first one.
        let told = task.told(&news, &[step(1, Some(Untold::NoClient))]);
        assert!(
            matches!(&told[..], [first, second] if first.contains("opens sections 1, 3, 200 l/ha")
                && !first.contains("was lost") && second.contains("the drive ended before")),
            "{told:?}"
        );
    }

    #[test]
    fn what_is_wrong_in_a_task_is_said() {
        for (text, says) in [
            ("step = [{ at_s = 2 }, { at_s = 1 }]", "each later than the one before, found 1"),
            ("step = [{ at_s = -1 }]", "0 or more"),
            ("step = [{ at_s = 1, open = [0] }]", "expected sections 1 to 256, found 0"),
            ("step = [{ at_s = 1, rate_l_ha = -3 }]", "found -3"),
        ] {
            let why = task(text).expect_err(text);
            assert!(why.contains(says), "{why}");
        }
    }
}
