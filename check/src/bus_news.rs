//! What clients of a run's buses sent that was refused: a controller whose frames are not well formed commands nothing, and its report has to say so.

use rowscan_bus::{BusLoss, BusNews};
use tokio::sync::mpsc;

/// Pieces of news of a bus that wait to be read; further ones are left out.
const WAITING: usize = 64;

/// News of each bus, by its id.
#[derive(Debug, Default)]
pub(crate) struct RefusedOnBuses(Vec<(String, mpsc::Receiver<BusNews>)>);

impl RefusedOnBuses {
    /// Where news of this bus go.
    pub(crate) fn of(&mut self, bus: &str) -> mpsc::Sender<BusNews> {
        let (news, told) = mpsc::channel(WAITING);
        self.0.push((bus.to_owned(), told));
        news
    }

    /// What was refused, and adapters that were opened at another rate, in words. Faults tell the rest themselves.
    pub(crate) fn told(&mut self) -> Vec<String> {
        let mut words = Vec::new();
        for (bus, told) in &mut self.0 {
            while let Ok(news) = told.try_recv() {
                if matches!(news, BusNews::Refused(_) | BusNews::Off(BusLoss::WrongRate)) {
                    words.push(format!("bus `{bus}`: {news}"));
                }
            }
        }
        words
    }
}
