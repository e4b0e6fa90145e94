//! Time that a controller needs to compute: in lockstep what it says on a bus takes effect so much later.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long a controller computes. Clones share it. By default it takes no time.
#[derive(Clone, Debug, Default)]
pub struct Compute(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    fixed: Duration,
    measured: Option<Measured>,
}

/// Processor time of processes, from step to step.
#[derive(Debug)]
struct Measured {
    processes: Vec<u32>,
    factor: f64,
    /// What they had used when the step began.
    at_step: Duration,
    longest: Duration,
}

impl Compute {
    /// Always so long.
    pub fn fixed(time: Duration) -> Self {
        Self(Arc::new(Mutex::new(State { fixed: time, measured: None })))
    }

    /// The processor time that the threads of the watched processes have used in the step, times `factor`. It differs from run to run.
    pub fn measured(factor: f64) -> Self {
        let measured =
            Measured { processes: Vec::new(), factor, at_step: Duration::ZERO, longest: Duration::ZERO };
        Self(Arc::new(Mutex::new(State { fixed: Duration::ZERO, measured: Some(measured) })))
    }

    /// Watches this process, too.
    pub fn watch(&self, process: u32) {
        if let Some(measured) = &mut self.lock().measured {
            measured.processes.push(process);
        }
    }

    /// The longest that was measured; none where nothing is.
    pub fn longest(&self) -> Option<Duration> {
        self.lock().measured.as_ref().map(|measured| measured.longest)
    }

    /// Something of a new step is about to be sent.
    pub(crate) fn begin_step(&self) {
        if let Some(measured) = &mut self.lock().measured {
            measured.at_step = measured.used();
        }
    }

    /// How much later what is said now takes effect.
    pub(crate) fn delay(&self) -> Duration {
        let mut state = self.lock();
        let fixed = state.fixed;
        let Some(measured) = &mut state.measured else { return fixed };
        let time = measured.used().saturating_sub(measured.at_step).mul_f64(measured.factor);
        measured.longest = measured.longest.max(time);
        time
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Measured {
    #[cfg(target_os = "linux")]
    fn used(&self) -> Duration {
        self.processes.iter().map(|process| crate::processes::processor_time(*process)).sum()
    }

    #[cfg(not(target_os = "linux"))]
    fn used(&self) -> Duration {
        Duration::ZERO
    }
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;

    #[test]
    fn a_fixed_time_is_always_the_same_and_a_measured_one_that_of_the_step() {
        let fixed = Compute::fixed(Duration::from_millis(80));
        fixed.begin_step();
        assert_eq!((fixed.delay(), fixed.longest()), (Duration::from_millis(80), None));
        let mut child =
            std::process::Command::new("sh").args(["-c", "while :; do :; done"]).spawn().expect("a shell");
        let measured = Compute::measured(2.0);
        measured.watch(child.id());
        measured.begin_step();
        // It computes all the time; that it gets there is the assertion.
        while measured.delay() < Duration::from_millis(20) {
            std::thread::yield_now();
        }
        measured.begin_step();
        let used = measured.delay();
        child.kill().expect("killed");
        child.wait().expect("ended");
        assert!(used < measured.longest().expect("measured"), "a new step begins anew: {used:?}");
    }
}
