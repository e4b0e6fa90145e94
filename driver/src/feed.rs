//! What a scanner's user reads from: a live link or a recording.

use std::task::{Context, Poll};
use std::time::Duration;

use rowscan_protocol::compact::SegmentCounts;
use rowscan_protocol::host::HostEvent;
use rowscan_protocol::model::AnyModel;
use rowscan_protocol::scan::Scan;
use rowscan_recording::StreamKind;

use crate::clock::HostTime;
use crate::error::DriverError;
use crate::left_out::StreamsLeftOut;

/// A source of scans that is polled. All state is in it, so that whoever polls may stop at any time and go on later.
pub(crate) trait Feed: Send {
    /// The next event; `None` once there will be no more.
    fn poll_event(&mut self, cx: &mut Context<'_>) -> Poll<Result<Option<HostEvent>, DriverError>>;

    /// Begins a clean stop, to be waited for with [`poll_stopped`](Self::poll_stopped) for at most `patience`.
    fn begin_stop(&mut self, patience: Duration);

    /// Ready once the device has stopped, or the patience is over.
    fn poll_stopped(&mut self, cx: &mut Context<'_>) -> Poll<()>;

    /// The scan of the last [`HostEvent::Scan`].
    fn scan(&self) -> Option<&Scan>;

    /// When the last bytes arrived.
    fn received(&self) -> HostTime;

    /// False where nobody knows when bytes arrived.
    fn is_timed(&self) -> bool {
        true
    }

    /// Time now on the watch that [`received`](Self::received) was read from.
    fn now(&self) -> HostTime;

    /// Connections that reached streaming.
    fn connections(&self) -> u64;

    /// What became of the parts of scans, where scans come in parts.
    fn segments(&self) -> SegmentCounts;

    /// Telegrams of other scanners that came in the same stream, and were left out.
    fn telegrams_foreign(&self) -> u64;

    /// Frames refused by checksum or length.
    fn frames_bad(&self) -> u64;

    /// The models that a recording says its scanner can be, as far as it was read: one where it is known.
    fn recorded_models(&self) -> Vec<AnyModel> {
        Vec::new()
    }

    /// What the bytes of the recorded stream are that is read, as far as it was.
    fn recorded_kind(&self) -> Option<StreamKind> {
        None
    }

    /// Of a recording with several streams of scans, of which none was named, what is left out, as far as it was read.
    fn streams_left_out(&self) -> Option<StreamsLeftOut> {
        None
    }

    /// Where a recording that was read to its end breaks off, in words.
    fn broken_off(&self) -> Option<String> {
        None
    }

    /// True of a capture that does not hold all bytes that passed.
    fn lacks_bytes(&self) -> bool {
        false
    }
}
