//! When a virtual rig's drive is over by itself.

use std::time::Duration;

use rowscan_emulator::EndWhen;
use rowscan_emulator::stage::Stage;

use super::output::say;

#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[command(next_help_heading = "End")]
pub(super) struct EndArgs {
    /// End after so many simulated seconds of driving
    #[arg(long, value_name = "S", value_parser = positive, group = "end")]
    seconds: Option<f64>,
    /// End after so many metres of driving
    #[arg(long, value_name = "M", value_parser = positive, group = "end")]
    length: Option<f64>,
    /// End where the first row ends
    #[arg(long, group = "end")]
    until_row_end: bool,
    /// End when the parent process ends. In a script, start it from the process that stays: a shell that starts it in the background and exits ends it at once
    #[arg(long)]
    exit_with_parent: bool,
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number <= 1e9 => Ok(number),
        _ => Err(format!("expected a number above 0, at most 1e9, found `{text}`")),
    }
}

impl EndArgs {
    /// Where time stops, if anywhere.
    pub(super) fn end(&self, stage: &Stage) -> Option<EndWhen> {
        let way_m = self.until_row_end.then(|| (stage.orchard.length_m() - stage.rig.start_m).max(0.0));
        match self.seconds {
            Some(seconds) => Some(EndWhen::Driven(Duration::from_secs_f64(seconds))),
            None => self.length.or(way_m).map(EndWhen::WayM),
        }
    }

    /// The process to outlive by nothing, if that is asked for. Called early: whoever starts this may be gone soon.
    pub(super) fn parent(&self) -> Parent {
        Parent(self.exit_with_parent.then(parent_id).flatten())
    }
}

/// The process that started this one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parent(Option<u32>);

impl Parent {
    /// Waits until it is gone; for ever if nobody asked. Cancel safe.
    pub(super) async fn gone(self) {
        let Some(parent) = self.0 else { return std::future::pending().await };
        if parent <= 1 {
            say(
                "--exit-with-parent: the process that started this one is gone already, or is the first of all, which never ends",
            );
        }
        // A child without its parent is given another one.
        while parent_id() == Some(parent) {
            rowscan_ports::clock::retry_pause().await;
        }
    }
}

#[cfg(unix)]
fn parent_id() -> Option<u32> {
    Some(std::os::unix::process::parent_id())
}

#[cfg(not(unix))]
fn parent_id() -> Option<u32> {
    None
}
