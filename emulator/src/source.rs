//! A source of the timeline: one thing that acts in simulated time.

use std::io;
use std::task::{Context, Poll};

use rowscan_faults::StreamFaults;
use rowscan_ports::Delivery;
use rowscan_ports::in_flight::InFlight;
use rowscan_protocol::time::SimTime;

use crate::bus_output::BusOutput;
use crate::datagram_source::DatagramSource;
use crate::fault_source::FaultSource;
use crate::firing::{Claim, Firing};
use crate::gnss_output::GnssOutput;
use crate::line_changes::LineChanges;
use crate::lms2xx::Lms2xxScanner;
use crate::mirror::MirrorSource;
use crate::scan_moment::LastScan;

/// One thing that acts in simulated time.
#[derive(Debug)]
pub(crate) enum Source {
    /// A CoLa scanner's mirror.
    Mirror(Box<MirrorSource>),
    /// An LMS2xx with its serial line.
    Lms2xx(Box<Lms2xxScanner>),
    /// A scanner's Compact telegrams.
    Datagrams(DatagramSource),
    /// What goes wrong.
    Faults(FaultSource),
    /// A scanner's digital lines.
    LineChanges(LineChanges),
    /// The tractor's control function on its bus.
    Bus(Box<BusOutput>),
    /// The tractor's GNSS receiver.
    Gnss(Box<GnssOutput>),
}

impl Source {
    pub(crate) fn next(&mut self) -> Option<SimTime> {
        match self {
            Self::Mirror(mirror) => Some(mirror.next()),
            Self::Lms2xx(scanner) => scanner.next(),
            Self::Datagrams(datagrams) => datagrams.next(),
            Self::Faults(faults) => faults.next(),
            Self::LineChanges(changes) => changes.next(),
            Self::Bus(bus) => bus.next(),
            Self::Gnss(gnss) => gnss.next(),
        }
    }

    pub(crate) fn prepare(&mut self, at: SimTime, hurries: bool) {
        if let Self::Mirror(mirror) = self {
            mirror.prepare(at, hurries);
        }
    }

    /// True if a scan, a sentence or a frame went to a taker.
    pub(crate) async fn fire(&mut self, firing: Firing) -> io::Result<bool> {
        match self {
            Self::Mirror(mirror) => Ok(mirror.fire(firing).await),
            Self::Lms2xx(scanner) => scanner.fire(firing).await,
            Self::Datagrams(datagrams) => {
                datagrams.fire(firing).await;
                Ok(false)
            }
            Self::Faults(faults) => Ok(faults.fire(firing.at)),
            Self::LineChanges(changes) => Ok(changes.fire(firing.at)),
            Self::Bus(bus) => Ok(bus.fire(firing).await),
            Self::Gnss(gnss) => Ok(gnss.fire(firing).await),
        }
    }

    /// Sends the rest of the scan that is under way, now.
    pub(crate) async fn finish(&mut self, now: SimTime, delivery: Delivery) -> io::Result<()> {
        match self {
            Self::Lms2xx(scanner) => scanner.finish(delivery).await,
            Self::Datagrams(datagrams) => {
                datagrams.finish(now).await;
                Ok(())
            }
            // A scanner's telegrams over CoLa leave whole, and so do frames and sentences.
            Self::Mirror(_) | Self::Faults(_) | Self::LineChanges(_) | Self::Bus(_) | Self::Gnss(_) => Ok(()),
        }
    }

    pub(crate) fn poll_input(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self {
            Self::Lms2xx(scanner) => scanner.poll_input(cx),
            Self::Bus(bus) => bus.poll_input(cx).map(Ok),
            Self::Mirror(_) | Self::Datagrams(_) | Self::Faults(_) | Self::LineChanges(_) | Self::Gnss(_) => {
                Poll::Pending
            }
        }
    }

    pub(crate) async fn respond(&mut self, now: SimTime, delivery: Delivery) {
        if let Self::Bus(bus) = self {
            bus.respond(now, delivery).await;
        }
    }

    pub(crate) fn claim(&self) -> Claim {
        match self {
            Self::Mirror(mirror) => mirror.claim(),
            Self::Lms2xx(scanner) => scanner.claim(),
            Self::Datagrams(_) | Self::Faults(_) | Self::LineChanges(_) => Claim::Idle,
            Self::Bus(bus) => {
                if bus.has_taker() {
                    Claim::Taker
                } else {
                    Claim::Idle
                }
            }
            Self::Gnss(gnss) => {
                if gnss.has_taker() {
                    Claim::Taker
                } else {
                    Claim::Idle
                }
            }
        }
    }

    /// Whether it is at work on something that a connected client waits for.
    pub(crate) fn is_waited_for(&self) -> bool {
        match self {
            Self::Mirror(mirror) => mirror.is_waited_for(),
            _ => false,
        }
    }

    /// What goes wrong on its connections, if anything may.
    pub(crate) fn faults(&self) -> Option<&StreamFaults> {
        match self {
            Self::Mirror(mirror) => mirror.faults(),
            Self::Lms2xx(scanner) => scanner.faults(),
            Self::Datagrams(_) | Self::Faults(_) | Self::LineChanges(_) | Self::Bus(_) | Self::Gnss(_) => {
                None
            }
        }
    }

    /// Whether the drive may wait for somebody to take what it sends.
    pub(crate) fn has_taker(&self) -> bool {
        match self {
            Self::Mirror(mirror) => mirror.has_taker(),
            Self::Lms2xx(scanner) => scanner.has_taker(),
            Self::Datagrams(_) | Self::Faults(_) | Self::LineChanges(_) => false,
            Self::Bus(bus) => bus.has_taker(),
            Self::Gnss(gnss) => gnss.has_taker(),
        }
    }

    /// What it has handed over and is not written yet.
    pub(crate) fn in_flight(&self, all: &mut Vec<InFlight>) {
        match self {
            Self::Mirror(mirror) => all.push(mirror.in_flight().clone()),
            Self::Bus(bus) => all.push(bus.in_flight().clone()),
            Self::Gnss(gnss) => all.extend(gnss.in_flight().cloned()),
            // A line is written where it acts, and so are datagrams.
            Self::Lms2xx(_) | Self::Datagrams(_) | Self::Faults(_) | Self::LineChanges(_) => {}
        }
    }

    /// Its place among those due at the same instant.
    pub(crate) fn rank(&self) -> u8 {
        match self {
            Self::Faults(_) => 0,
            Self::LineChanges(_) => 1,
            Self::Mirror(_) | Self::Lms2xx(_) | Self::Datagrams(_) => 2,
            Self::Bus(_) => 3,
            Self::Gnss(_) => 4,
        }
    }

    /// The last scan it made, if it is a scanner.
    pub(crate) fn last_scan(&self) -> Option<LastScan> {
        match self {
            Self::Mirror(mirror) => mirror.last_scan(),
            Self::Lms2xx(scanner) => scanner.last_scan(),
            Self::Datagrams(_) | Self::Faults(_) | Self::LineChanges(_) | Self::Bus(_) | Self::Gnss(_) => {
                None
            }
        }
    }

    pub(crate) fn is_scanner(&self) -> bool {
        matches!(self, Self::Mirror(_) | Self::Lms2xx(_))
    }

    /// The drive has started.
    pub(crate) fn begin(&mut self, at: SimTime) {
        match self {
            Self::Bus(bus) => bus.begin(at),
            Self::Gnss(gnss) => gnss.begin(at),
            Self::Mirror(_)
            | Self::Lms2xx(_)
            | Self::Datagrams(_)
            | Self::Faults(_)
            | Self::LineChanges(_) => {}
        }
    }

    /// Time waits for others: whoever waits for this source's next act is answered without it.
    pub(crate) fn release(&self) {
        if let Self::Mirror(mirror) = self {
            mirror.release_polls();
        }
    }
}
