//! What a recording of the scans holds beside them.

use std::path::Path;
use std::time::Duration;

use rowscan_recording::{Packet, ReadError, Recording, Side, StreamKind};

/// Gives `take` what the first stream of this kind brought, in the order of time since the recording's beginning. What has no time is left out.
pub(super) fn read_beside(
    path: &Path,
    kind: StreamKind,
    mut take: impl FnMut(Duration, &Packet),
) -> Result<(), ReadError> {
    let mut recording = Recording::open(path)?;
    let mut first = None;
    while let Some(packet) = recording.next_packet()? {
        let of_kind = recording.streams().get(packet.stream).is_some_and(|stream| stream.kind == kind);
        if !of_kind || packet.from == Some(Side::Host) || *first.get_or_insert(packet.stream) != packet.stream
        {
            continue;
        }
        let (Some(at_ns), Some(began_ns)) = (packet.at_ns, recording.began_ns()) else { continue };
        take(Duration::from_nanos(at_ns.saturating_sub(began_ns)), &packet);
    }
    Ok(())
}
