//! The page beside `rowscan check`: each run while it goes on, at one address after the other.

use std::sync::Arc;

use rowscan_check::{Look, Onlooker};
use rowscan_emulator::clock::SimClock;
use rowscan_emulator::{RigControl, SeenRig};
use rowscan_ports::task;
use rowscan_recording::Taps;
use rowscan_web::Show;
use tokio::runtime::Handle;
use tokio::sync::{Mutex, oneshot};
use tokio::task::JoinSet;

use super::Format;
use super::output::say;
use super::web::{Watching, WebArgs};

/// Shows every run. It is served by this program's own threads, so that a browser takes none of the run's time.
pub(super) struct CheckPage {
    web: WebArgs,
    format: Format,
    on: Handle,
    /// Held by whoever has the address: the page of the last run is gone before the next one comes.
    place: Arc<Mutex<()>>,
}

impl CheckPage {
    /// Called within the runtime that serves it.
    pub(super) fn new(web: WebArgs, format: Format) -> Self {
        Self { web, format, on: Handle::current(), place: Arc::default() }
    }
}

impl Onlooker for CheckPage {
    fn come(&self, clock: Arc<SimClock>) -> Box<dyn Look> {
        let (web, place) = (self.web.clone(), Arc::clone(&self.place));
        let (on, format) = (self.on.clone(), self.format);
        Box::new(RunPage { watching: Watching::new(clock), web, format, on, place })
    }
}

/// The page of one run.
struct RunPage {
    watching: Watching,
    web: WebArgs,
    format: Format,
    on: Handle,
    place: Arc<Mutex<()>>,
}

/// What goes on for as long as the run is shown.
struct Shown {
    _over: oneshot::Sender<()>,
    _tasks: JoinSet<()>,
}

impl Look for RunPage {
    fn taps(&self) -> Taps {
        self.watching.taps()
    }

    fn begin(self: Box<Self>, rig: SeenRig<'_>, control: RigControl) -> Box<dyn Send> {
        let Self { watching, web, format, on, place } = *self;
        let mut tasks = JoinSet::new();
        let show = watching.show(rig, &mut tasks, &on);
        let (over, is_over) = oneshot::channel();
        on.spawn(task(serve((web, format), show, control, is_over, place)));
        Box::new(Shown { _over: over, _tasks: tasks })
    }
}

/// Serves the page until the run is over.
async fn serve(
    (web, format): (WebArgs, Format),
    show: Show,
    control: RigControl,
    is_over: oneshot::Receiver<()>,
    place: Arc<Mutex<()>>,
) {
    let _place = place.lock().await;
    match web.open(show, None, format).await {
        Ok(opened) => {
            opened.addresses().for_each(|address| control.exclude(address));
            // Nothing is ever sent: the run is over when nobody could.
            let _ = is_over.await;
            opened.close().await;
        }
        // The verdict does not depend on who looks.
        Err(cause) => say(cause),
    }
}
