//! The tractor's GNSS receiver: its sentences, and the lines they go out on.

use std::sync::Arc;

use bytes::Bytes;
use rowscan_bus::Datagrams;
use rowscan_bus::nmea::{GnssEpochs, NmeaLine};
use rowscan_ports::Delivery;
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::time::SimTime;
use rowscan_recording::{Side, StreamKind, Tap, Taps};
use tokio::sync::Notify;

use crate::firing::Firing;

/// Name of the recorded stream.
const STREAM: &str = "gnss";

/// A receiver with its lines.
#[derive(Debug)]
pub(crate) struct GnssOutput {
    epochs: GnssEpochs,
    lines: Vec<NmeaLine>,
    tap: Tap,
    /// Nothing is sent before the drive starts.
    held: bool,
    /// What becomes of what goes out as datagrams.
    datagrams: Datagrams,
}

impl GnssOutput {
    pub(crate) fn new(
        epochs: GnssEpochs,
        lines: Vec<NmeaLine>,
        delivery: Delivery,
        changed: &Arc<Notify>,
        taps: &Taps,
        datagrams: Datagrams,
    ) -> Self {
        lines.iter().for_each(|line| line.notify_of_takers(changed));
        Self {
            epochs,
            lines,
            tap: taps.open(STREAM, StreamKind::Nmea),
            held: delivery.is_patient(),
            datagrams,
        }
    }

    pub(crate) fn next(&self) -> Option<SimTime> {
        (!self.held).then(|| self.epochs.next())
    }

    pub(crate) async fn fire(&mut self, firing: Firing) -> bool {
        while self.epochs.next() <= firing.at {
            let epoch = Bytes::from(self.epochs.next_epoch());
            self.tap.record(Side::Device, &epoch);
            for line in &self.lines {
                let copies = if line.is_datagrams() { self.datagrams.copies() } else { 1 };
                for _ in 0..copies {
                    line.send(epoch.clone(), firing.delivery).await;
                }
            }
        }
        false
    }

    pub(crate) fn in_flight(&self) -> impl Iterator<Item = &InFlight> {
        self.lines.iter().map(NmeaLine::in_flight)
    }

    pub(crate) fn has_taker(&self) -> bool {
        self.lines.iter().any(NmeaLine::has_taker)
    }

    pub(crate) fn begin(&mut self, at: SimTime) {
        if std::mem::take(&mut self.held) {
            self.epochs.skip_to(at);
        }
    }
}
