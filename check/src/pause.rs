//! Children that are stopped and go on: the fault `host_pause`.

use std::time::Duration;

use rowscan_emulator::StageRow;
use rowscan_faults::{At, Row};
use rowscan_ports::clock::rest;

use crate::child::Stopper;
use crate::fault::Pause;
use crate::fault_desk::FaultDesk;
use crate::journal::Journal;
use crate::witness::Witness;

/// Between two looks at whether a pause is due, host time.
const LOOK_EVERY: Duration = Duration::from_millis(2);

/// What a pause is timed by.
pub(crate) struct Timing {
    pub(crate) journal: Journal,
    pub(crate) witness: Witness,
    pub(crate) row: StageRow,
    pub(crate) desk: FaultDesk,
}

/// Waits for the pause's time and stops the child for as long as it says.
pub(crate) async fn pause(pause: Pause, stopper: Stopper, timing: Timing) {
    while !is_due(&pause.at, &timing) {
        rest(LOOK_EVERY).await;
    }
    let Timing { journal, desk, .. } = timing;
    journal.note(pause.id.clone(), format!("host_pause of {:?}", pause.lasts));
    desk.has_begun(&pause.id);
    stopper.stop();
    rest(pause.lasts).await;
    stopper.go_on();
    journal.note(format!("{}.end", pause.id), "");
    desk.has_ended(&pause.id);
}

fn is_due(at: &At, timing: &Timing) -> bool {
    let now = timing.journal.now().elapsed();
    match at {
        At::Start => true,
        At::Time(at) => now >= *at,
        At::Scan(scan) => timing.witness.scans() >= *scan,
        // Refused when it was read.
        At::Command(_) => false,
        At::RowM(row_m) => timing.row.row_m(now).is_some_and(|here| here >= *row_m),
        At::Tree(tree) => timing.row.tree(now).is_some_and(|here| here >= *tree),
        At::After { id, end, plus } => {
            let name = if *end { format!("{id}.end") } else { id.clone() };
            let happened = timing.journal.first(&name);
            happened.is_some_and(|at| now >= at.elapsed().saturating_add(*plus).max(Duration::ZERO))
        }
    }
}
