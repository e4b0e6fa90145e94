//! The sprayer as a part that faults act on: it notes what goes wrong with it, and when.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rowscan_bus::isobus::trouble::TroubleDesk;
use rowscan_faults::{Fit, Order, Part};
use rowscan_settings::fault_table::PartFault;
use rowscan_sprayer::troubles::refusal;
use rowscan_sprayer::{Boom, Trouble, Troubles};

/// What faults and `on` call it.
pub(crate) const NAME: &str = "sprayer";

/// A boom, and what the plan of faults orders of it.
#[derive(Debug)]
pub(crate) struct SprayerPart {
    boom: Boom,
    /// What goes wrong between it and its task controller, if it is the client of one.
    client: Option<TroubleDesk>,
    /// By the key that their end is told by.
    orders: Mutex<Vec<(u64, Trouble)>>,
}

impl SprayerPart {
    pub(crate) fn new(boom: Boom, client: Option<TroubleDesk>) -> Self {
        Self { boom, client, orders: Mutex::default() }
    }

    /// What has gone wrong so far.
    pub(crate) fn troubles(&self) -> Troubles {
        Troubles(self.lock().iter().map(|(_, trouble)| *trouble).collect())
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(u64, Trouble)>> {
        self.orders.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Part for SprayerPart {
    fn fits(&self, fault: &PartFault) -> Fit {
        match fault {
            PartFault::Sprayer(fault) => refusal(&self.boom, fault).map_or(Fit::Acts, Fit::Refuses),
            PartFault::TaskController(_) if self.client.is_some() => Fit::Acts,
            PartFault::TaskController(_) => {
                Fit::Refuses("it has no task controller; give it one by `isobus`".to_owned())
            }
            _ => Fit::Foreign,
        }
    }

    fn begin(&self, order: &Order<'_>) {
        match (order.fault, &self.client) {
            (PartFault::Sprayer(fault), _) => {
                let trouble = Trouble { fault: *fault, from: order.at.as_secs_f64(), to: None };
                self.lock().push((order.key, trouble));
            }
            (PartFault::TaskController(fault), Some(client)) => client.begin(order.key, *fault),
            _ => {}
        }
    }

    fn end(&self, key: u64, at: Duration) {
        if let Some(client) = &self.client {
            client.end(key);
        }
        let mut orders = self.lock();
        // A fault that comes again has the same key: the one that still acts ends.
        let own = orders.iter_mut().find(|(of, trouble)| *of == key && trouble.to.is_none());
        if let Some((_, trouble)) = own {
            trouble.to = Some(at.as_secs_f64());
        }
    }
}

#[cfg(test)]
mod tests {
    use rowscan_settings::fault_table::sprayer::{SprayerFault, Valves};
    use rowscan_settings::fault_table::task_controller::TaskControllerFault;

    use super::*;

    fn boom() -> Boom {
        Boom::read("version = 1\n[[section]]\nid = \"a\"\nside = \"left\"\nz_from_m = 0\nz_to_m = 1\n")
            .expect("a boom")
    }

    #[test]
    fn faults_are_noted_with_their_times_and_what_the_boom_lacks_is_refused() {
        let part = SprayerPart::new(boom(), None);
        let fault = PartFault::Sprayer(SprayerFault::CoilOpen(Valves::All));
        let order = |key, s| Order { key, at: Duration::from_secs(s), fault: &fault, seed: 0, p: 1.0 };
        part.begin(&order(3, 1));
        part.begin(&order(4, 2));
        part.end(3, Duration::from_secs(5));
        part.begin(&order(3, 7));
        let found = part.troubles().0;
        let times: Vec<_> = found.iter().map(|trouble| (trouble.from, trouble.to)).collect();
        assert_eq!(times, [(1.0, Some(5.0)), (2.0, None), (7.0, None)]);
        assert_eq!(part.fits(&fault), Fit::Acts);
        let other = PartFault::Sprayer(SprayerFault::CoilOpen(Valves::Section(2)));
        assert_eq!(part.fits(&other), Fit::Refuses("the boom has no section 2; it has 1".to_owned()));
        let low = PartFault::Sprayer(SprayerFault::PumpLow(0.5));
        assert!(matches!(part.fits(&low), Fit::Refuses(why) if why.contains("[hydraulics]")));
        let lost = PartFault::TaskController(TaskControllerFault::Lost);
        assert!(matches!(part.fits(&lost), Fit::Refuses(why) if why.contains("`isobus`")));
        let desk = TroubleDesk::default();
        let part = SprayerPart::new(boom(), Some(desk.clone()));
        assert_eq!(part.fits(&lost), Fit::Acts);
        part.begin(&Order { fault: &lost, ..order(1, 2) });
        assert!(desk.now().is_lost && part.troubles().is_empty());
        part.end(1, Duration::from_secs(3));
        assert!(!desk.now().is_lost);
    }
}
