//! Programs that have closed their connections: their end belongs to the step in which they closed them.
//!
//! A program's sockets close before it has ended. Without this, time would go on in between, by as much as the host takes.

use std::time::Duration;

use rowscan_ports::clock::Stopwatch;

use crate::processes::{self, Doing};

/// How long one is waited for at most, host time: longer than a program takes to end. One that still computes then is waited for no more.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// Programs that were behind a peer, and those that have gone from there.
#[derive(Debug, Default)]
pub(super) struct HungUp {
    present: Vec<u32>,
    gone: Vec<(u32, Stopwatch)>,
}

impl HungUp {
    /// One that has hung up, and neither waits nor has ended yet as far as this program knows. `present` are all who are behind a peer now.
    pub(super) fn look(&mut self, present: impl Iterator<Item = u32>) -> Option<String> {
        let present: Vec<u32> = present.collect();
        let gone = self.present.iter().filter(|process| !present.contains(process));
        self.gone.extend(gone.map(|process| (*process, Stopwatch::start())));
        self.gone.retain(|(process, since)| {
            !present.contains(process) && since.elapsed() < MAX_WAIT && is_busy(*process)
        });
        self.present = present;
        self.gone.first().map(|(process, _)| format!("process {process} has hung up, and has not ended yet"))
    }
}

/// True of a process that runs, or whose end its parent, this program, has not noticed.
fn is_busy(process: u32) -> bool {
    match processes::doing(process) {
        Doing::Waits => false,
        // One that sleeps has no end under way.
        Doing::Works(_) => !processes::is_asleep(process),
        Doing::Gone => processes::is_unnoticed(process),
    }
}

#[cfg(test)]
mod tests {
    use std::process::{Child, Command, Stdio};

    use super::*;

    fn started(command: &[&str]) -> Child {
        Command::new(command[0]).args(&command[1..]).stdin(Stdio::piped()).spawn().unwrap()
    }

    /// Looks until it finds what is wanted: the kernel takes its time.
    fn until(hung_up: &mut HungUp, present: &[u32], is_waited_for: bool) {
        while hung_up.look(present.iter().copied()).is_some() != is_waited_for {
            std::thread::yield_now();
        }
    }

    #[test]
    fn an_end_that_nobody_has_noticed_holds_the_step_in_which_the_program_hung_up() {
        let mut child = started(&["cat"]);
        let mut hung_up = HungUp::default();
        assert_eq!(hung_up.look([child.id()].into_iter()), None, "it is there");
        child.kill().unwrap();
        // It has ended, or is about to: either way nobody knows.
        let why = hung_up.look([].into_iter()).unwrap();
        assert!(why.contains(&child.id().to_string()), "{why}");
        child.wait().unwrap();
        assert_eq!(hung_up.look([].into_iter()), None, "it is known");
    }

    #[test]
    fn one_that_sleeps_or_waits_after_it_hung_up_holds_nothing_and_one_that_computes_not_for_ever() {
        for command in [["sleep", "1000"].as_slice(), &["cat"], &["sh", "-c", "while :; do :; done"]] {
            let mut child = started(command);
            let mut hung_up = HungUp::default();
            assert_eq!(hung_up.look([child.id()].into_iter()), None);
            until(&mut hung_up, &[], false);
            child.kill().unwrap();
            child.wait().unwrap();
        }
    }

    #[test]
    fn one_that_is_back_is_waited_for_no_more() {
        let mut child = started(&["sh", "-c", "while :; do :; done"]);
        let mut hung_up = HungUp::default();
        hung_up.look([child.id()].into_iter());
        until(&mut hung_up, &[], true);
        assert_eq!(hung_up.look([child.id()].into_iter()), None);
        child.kill().unwrap();
        child.wait().unwrap();
    }
}
