//! The valves of a boom while it runs: what they were told so far, and what they let through.

use crate::boom::{Boom, Nozzle};
use crate::commands::{Command, Duties};
use crate::flow::Flow;
use crate::pass::valve_flows;
use crate::troubles::Troubles;
use crate::valve::{Kind, SETTLED, Valve};

/// The valves of a boom, which are told commands as they come.
#[derive(Clone, Debug)]
pub(super) struct Valves {
    boom: Boom,
    nozzles: Vec<Nozzle>,
    /// Of valves that run free.
    seed: u64,
    pub(super) duties: Duties,
    /// What they do depends on what they were told in so many seconds before.
    memory_s: f64,
}

impl Valves {
    /// Those of `boom` at time 0, all shut. Phases of valves that run free follow from `seed`, as in [`crate::Pass`].
    pub(super) fn new(boom: Boom, seed: u64) -> Self {
        let nozzles = boom.nozzles();
        let memory_s = nozzles.iter().map(|nozzle| memory_s(&nozzle.valve)).fold(0.0, f64::max);
        Self { duties: Duties::new(&boom), boom, nozzles, seed, memory_s }
    }

    /// The boom.
    pub(super) fn boom(&self) -> &Boom {
        &self.boom
    }

    /// The nozzles behind them.
    pub(super) fn nozzles(&self) -> &[Nozzle] {
        &self.nozzles
    }

    /// A command was heard, not before the last look.
    pub(super) fn tell(&mut self, command: &Command) {
        self.duties.tell(command);
    }

    /// Looks at `at_s`, with what has gone wrong so far: what each let through at the nominal pressure. Looks come in the order of time.
    pub(super) fn look(&mut self, at_s: f64, troubles: &Troubles) -> Vec<Flow> {
        self.duties.silent(at_s);
        let told = self.duties.steps.clone();
        let flows = valve_flows((&self.boom, &self.nozzles, self.seed), told, troubles, at_s);
        let began = troubles.0.iter().map(|trouble| trouble.from).fold(at_s, f64::min);
        self.duties.forget(began - self.memory_s);
        flows
    }
}

/// How long what a valve was told still acts, seconds.
fn memory_s(valve: &Valve) -> f64 {
    let ramps_ms = valve.on_ms + valve.off_ms + valve.rise_ms + valve.fall_ms + valve.min_pulse_ms;
    let own_s = match valve.kind {
        Kind::OnOff => 0.0,
        Kind::Pwm => 2.0 / valve.hz,
        Kind::Proportional => SETTLED * valve.tau_s,
    };
    2.0 * ramps_ms / 1e3 + own_s
}
