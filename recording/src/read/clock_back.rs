//! A capture whose clock was set back while it ran, as by an NTP step.

use std::fmt;

/// Less than this is no step: packets of two interfaces, or of two processors, are some milliseconds out of order. NTP sets a clock from 128 ms on.
const LEAST_NS: u64 = 100_000_000;

/// Where the clock of a capture goes back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockBack {
    /// The first packet behind such a step, from 1 on, as Wireshark counts.
    pub packet: u64,
    /// How far it went back there, nanoseconds.
    pub by_ns: u64,
    /// How often it does.
    pub times: u64,
}

impl fmt::Display for ClockBack {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { packet, by_ns, times } = self;
        let seconds = *by_ns as f64 * 1e-9;
        write!(f, "the capture's clock goes back by {seconds:.1} s at packet {packet}")?;
        if *times > 1 {
            write!(f, " ({times} times in all)")?;
        }
        f.write_str(
            ": until it is as late again, what a connection carries has the time from before the step, and datagrams are in the order of their times; \
             go by the scanner's own times",
        )
    }
}

/// Looks for steps in the times of packets, in the order of the file.
#[derive(Debug, Default)]
pub(super) struct Watch {
    packets: u64,
    before_ns: Option<u64>,
    found: Option<ClockBack>,
}

impl Watch {
    /// The next packet of the capture; without a time, it says nothing.
    pub(super) fn see(&mut self, at_ns: Option<u64>) {
        self.packets += 1;
        let Some(at_ns) = at_ns else { return };
        let by_ns = self.before_ns.replace(at_ns).map_or(0, |before_ns| before_ns.saturating_sub(at_ns));
        if by_ns >= LEAST_NS {
            let first = ClockBack { packet: self.packets, by_ns, times: 0 };
            self.found.get_or_insert(first).times += 1;
        }
    }

    /// What was found.
    pub(super) fn found(&self) -> Option<ClockBack> {
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(times_ms: &[Option<u64>]) -> Option<ClockBack> {
        let mut watch = Watch::default();
        times_ms.iter().for_each(|at| watch.see(at.map(|at| at * 1_000_000)));
        watch.found()
    }

    #[test]
    fn a_step_back_is_told_once_with_its_packet() {
        let step = found(&[Some(20_000), Some(20_020), Some(10_040), Some(10_060)]).expect("a step");
        assert_eq!(step, ClockBack { packet: 3, by_ns: 9_980_000_000, times: 1 });
        assert!(
            step.to_string().starts_with("the capture's clock goes back by 10.0 s at packet 3: "),
            "{step}"
        );
        let twice = found(&[Some(20_000), Some(10_000), None, Some(9_000)]).expect("two");
        assert_eq!((twice.packet, twice.times), (2, 2));
    }

    #[test]
    fn packets_out_of_order_and_those_without_a_time_are_no_step() {
        assert_eq!(found(&[Some(1_000), Some(950), Some(1_020), None, Some(1_040), Some(90_000)]), None);
    }
}
