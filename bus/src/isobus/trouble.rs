//! What goes wrong between a task controller and its client, by a fault.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rowscan_settings::fault_table::task_controller::TaskControllerFault;

/// What holds now. The same faults act on either role of ours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trouble {
    /// The two do not hear each other any more.
    pub is_lost: bool,
    /// The task controller says that it is busy, and commands nothing.
    pub is_busy: bool,
    /// Pools are refused, with these bits of an activation's answer.
    pub refusal: Option<u8>,
    /// The client's status is not told any more; all else is.
    pub is_silent: bool,
}

/// What a plan of faults has ordered. Clones share it: one orders, the other one's role obeys.
#[derive(Clone, Debug, Default)]
pub struct TroubleDesk(Arc<Mutex<Vec<(u64, TaskControllerFault)>>>);

impl TroubleDesk {
    /// From now on this is wrong, until its key ends.
    pub fn begin(&self, key: u64, fault: TaskControllerFault) {
        self.lock().push((key, fault));
    }

    /// What began with this key is over.
    pub fn end(&self, key: u64) {
        self.lock().retain(|(of, _)| *of != key);
    }

    /// All that is wrong now.
    pub fn now(&self) -> Trouble {
        let mut trouble = Trouble::default();
        for (_, fault) in self.lock().iter() {
            match *fault {
                TaskControllerFault::Lost => trouble.is_lost = true,
                TaskControllerFault::Busy => trouble.is_busy = true,
                TaskControllerFault::PoolRefused(code) => trouble.refusal = Some(code),
                TaskControllerFault::Silent => trouble.is_silent = true,
            }
        }
        trouble
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(u64, TaskControllerFault)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_began_holds_until_its_own_end() {
        let desk = TroubleDesk::default();
        let role = desk.clone();
        desk.begin(1, TaskControllerFault::Lost);
        desk.begin(2, TaskControllerFault::PoolRefused(4));
        desk.begin(3, TaskControllerFault::Silent);
        desk.end(1);
        let expected = Trouble { refusal: Some(4), is_silent: true, ..Trouble::default() };
        assert_eq!(role.now(), expected);
        desk.end(2);
        desk.end(3);
        assert_eq!(role.now(), Trouble::default());
    }
}
