//! `--faults FILE`: the flag, and the faults at work beside a command, told as they come.

use std::path::PathBuf;
use std::sync::Arc;

use rowscan_control::Log;
use rowscan_faults::{Clock, FaultControl, FaultEvent, FaultEvents, FaultSpec, What, read};
use rowscan_ports::task;
use rowscan_scenes::files::LoadError;
use serde::Serialize;
use tokio::sync::oneshot;
use tokio::task::{JoinHandle, JoinSet};

use super::output::{self, say};
use super::{Failure, Format};

#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Faults")]
pub(super) struct FaultArgs {
    /// Have things go wrong on the way to the client and back, as this file says (docs/faults.md)
    #[arg(long = "faults", value_name = "FILE")]
    fault_file: Option<PathBuf>,
}

/// The line that tells a script what a fault did.
#[derive(Serialize)]
struct Line<'a> {
    event: &'static str,
    #[serde(flatten)]
    fault: &'a FaultEvent,
}

/// A file of faults that was read.
pub(super) struct FaultFile {
    name: String,
    specs: Vec<FaultSpec>,
}

impl FaultArgs {
    /// Reads the file, if one is given.
    pub(super) fn read(&self) -> Result<Option<FaultFile>, Failure> {
        let Some(path) = &self.fault_file else { return Ok(None) };
        let name = path.display().to_string();
        let text =
            rowscan_files::read_text(path).map_err(|cause| LoadError::Read { path: path.clone(), cause })?;
        let specs = read(&text).map_err(|error| LoadError::Content { place: name.clone(), error })?;
        Ok(Some(FaultFile { name, specs }))
    }
}

/// Faults at work. [`Faulting::finish`] heals them all.
pub(super) struct Faulting {
    control: FaultControl,
    telling: JoinHandle<Result<u64, Failure>>,
    stop: oneshot::Sender<()>,
    /// Where no bench lets them act.
    _driving: JoinSet<()>,
}

impl Faulting {
    /// Faults beside a command that has no bench.
    pub(super) fn start(seed: u64, clock: Arc<dyn Clock>, to: (Format, &Log)) -> Self {
        let (control, events) = FaultControl::new(seed, clock, None);
        let mut driving = JoinSet::new();
        let driven = control.clone();
        driving.spawn(task(async move { driven.drive().await }));
        Self { _driving: driving, ..Self::tell((control, events), to) }
    }

    /// Tells from now on what faults do; none have been added yet.
    pub(super) fn tell(
        (control, events): (FaultControl, FaultEvents),
        (format, log): (Format, &Log),
    ) -> Self {
        let (stop, stopped) = oneshot::channel();
        let telling = tokio::spawn(task(tell(events, stopped, (format, log.clone()))));
        Self { control, telling, stop, _driving: JoinSet::new() }
    }

    /// The handle to them.
    pub(super) fn control(&self) -> &FaultControl {
        &self.control
    }

    /// Begins the file's script.
    pub(super) fn begin(&self, file: Option<FaultFile>) -> Result<(), Failure> {
        let Some(FaultFile { name, specs }) = file else { return Ok(()) };
        let added = self.control.add_all(specs);
        added.map(drop).map_err(|cause| Failure::Fault { file: name, cause })
    }

    /// Heals all faults, tells the rest, and gives how many have begun.
    pub(super) async fn finish(self) -> Result<u64, Failure> {
        self.control.reset();
        let lost = self.control.events_lost();
        if lost > 0 {
            say(format_args!("{lost} events of faults came too fast to be told"));
        }
        // Whoever tells has gone only if it failed, and then its result says so.
        let _ = self.stop.send(());
        self.telling.await.unwrap_or(Ok(0))
    }
}

/// Tells events until it is stopped, and then what is left.
async fn tell(
    mut events: FaultEvents,
    stopped: oneshot::Receiver<()>,
    (format, log): (Format, Log),
) -> Result<u64, Failure> {
    let mut begun = 0;
    let mut tell = |event: FaultEvent| -> Result<(), Failure> {
        begun += u64::from(event.what == What::Begin);
        log.keep(&Line { event: "fault", fault: &event });
        tell_one(&event, format)
    };
    tokio::pin!(stopped);
    loop {
        tokio::select! {
            event = events.next() => match event {
                Some(event) => tell(event)?,
                None => break,
            },
            _ = &mut stopped => break,
        }
    }
    while let Some(event) = events.take() {
        tell(event)?;
    }
    Ok(begun)
}

fn tell_one(event: &FaultEvent, format: Format) -> Result<(), Failure> {
    if matches!(format, Format::Json | Format::Jsonl) {
        return output::print_event(format, &Line { event: "fault", fault: event });
    }
    let what = match event.what {
        What::Begin => "begins",
        What::Act => "acts",
        What::Skipped => "cannot act",
        What::End => "ends",
        What::Healed => "is healed",
    };
    let row = event.row_m.map(|row_m| format!(" at metre {row_m:.2}")).unwrap_or_default();
    let scan = event.scan.map(|scan| format!(", scan {scan}")).unwrap_or_default();
    let offset = event.offset.map(|offset| format!(", byte {offset}")).unwrap_or_default();
    let acts = event.acts.map(|acts| format!(", {acts} acts")).unwrap_or_default();
    let reason = event.reason.as_deref().map(|reason| format!(": {reason}")).unwrap_or_default();
    let (id, on, at_s) = (&event.id, &event.on, event.at_s);
    say(format_args!("{at_s:.3} s: fault {id} on {on} {what}{row}{scan}{offset}{acts}{reason}"));
    Ok(())
}
