//! What is a gap, a restart, or only late: over all models, by the bytes that they send, received at times of a host.

use std::time::Duration;

use rowscan_protocol::client::ColaClient;
use rowscan_protocol::compact::{CompactListener, REORDER};
use rowscan_protocol::counting::{Counting, Turn};
use rowscan_protocol::device::{Device, Identity, MeasuredLine, scan_event};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{self, Model};
use rowscan_protocol::time::SimTime;

/// The telegrams of each turn of a scanner since it was switched on.
pub(crate) struct Turns {
    pub(crate) period: Duration,
    pub(crate) telegrams: Vec<Vec<Vec<u8>>>,
}

impl Turns {
    fn of(model: &'static Model, count: u32) -> Self {
        Self::of_unit(model, 0, count)
    }

    /// Of one of several scanners.
    pub(crate) fn of_unit(model: &'static Model, unit: usize, count: u32) -> Self {
        let mut device = Device::new(model, Identity::of(model, unit));
        device.direct("127.0.0.1:2115".parse().unwrap());
        device.enable_streaming();
        let period = Duration::from_secs_f64(100.0 / f64::from(device.mirror().frequency_centihz));
        let turn = |number: u32| {
            let at = SimTime::ZERO + period * number;
            let grids: Vec<_> = device.mirrors().iter().map(|mirror| mirror.beams).collect();
            let lines: Vec<_> = grids.iter().map(|grid| MeasuredLine { grid: *grid, echoes: &[] }).collect();
            let level = MeasuredLine { grid: device.mirror().beams, echoes: &[] };
            let mut event = Vec::new();
            scan_event(Dialect::B, device.measure(at, &level).unwrap(), &mut event);
            if device.sends_scan_events() {
                return vec![event];
            }
            let mut datagrams = Vec::new();
            device.segments(at, &lines, &mut datagrams);
            datagrams.into_iter().map(|datagram| device.send(datagram).unwrap().1).collect()
        };
        Self { period, telegrams: (0..count).map(turn).collect() }
    }

    /// Those of some turns, the first one received at `from`, and the others in step with them.
    fn sent(&self, turns: std::ops::Range<usize>, from: Duration) -> Vec<(Duration, Vec<u8>)> {
        let at = |place: usize| from + self.period * place as u32;
        let turns = self.telegrams[turns].iter().enumerate();
        turns
            .flat_map(|(place, telegrams)| telegrams.iter().map(move |bytes| (at(place), bytes.clone())))
            .collect()
    }
}

/// What a host counts of these telegrams; segments lost besides.
fn heard(model: &Model, telegrams: &[(Duration, Vec<u8>)]) -> (Counting, u64) {
    let (counting, segments_lost, _) = counted(model, telegrams);
    (counting, segments_lost)
}

/// When the last line was taken, since the first.
fn travel_s(model: &Model, telegrams: &[(Duration, Vec<u8>)]) -> f64 {
    counted(model, telegrams).2
}

fn counted(model: &Model, telegrams: &[(Duration, Vec<u8>)]) -> (Counting, u64, f64) {
    let mut session: Box<dyn HostSession> = match model.compact {
        Some(_) => Box::new(CompactListener::default()),
        None => Box::new(ColaClient::listen(64 * 1024)),
    };
    let (mut counting, mut last_s) = (Counting::default(), 0.0);
    for (at, bytes) in telegrams {
        session.handle_bytes(*at, bytes);
        session.handle_gap();
        while let Some(event) = session.poll_event() {
            if event == HostEvent::Scan
                && let Turn::Line { travel_s, .. } = counting.observe(session.scan())
            {
                last_s = travel_s;
            }
        }
    }
    (counting, session.segments_lost(), last_s)
}

const BEFORE: usize = 40;
const OFF: Duration = Duration::from_secs(30);

#[test]
fn a_restart_is_no_gap_though_counters_and_clock_happen_to_go_on() {
    for model in model::all() {
        // It stands where it stood, or so many turns farther, when it is heard again.
        for ahead in [2, 3, 20] {
            let turns = Turns::of(model, 120);
            let mut sent = turns.sent(0..BEFORE, Duration::ZERO);
            sent.extend(turns.sent(BEFORE - 1 + ahead..120, OFF));
            let (counting, segments_lost) = heard(model, &sent);
            assert_eq!((counting.restarts, counting.lost), (1, 0), "{}, {ahead} ahead", model.name);
            assert_eq!(segments_lost, 0, "{}, {ahead} ahead", model.name);
        }
    }
}

#[test]
fn a_gap_is_a_gap_while_the_scanner_was_on() {
    for model in model::all() {
        for ahead in [2, 20] {
            let turns = Turns::of(model, 120);
            let from = BEFORE - 1 + ahead;
            let mut sent = turns.sent(0..BEFORE, Duration::ZERO);
            // Late by as much as networks are.
            sent.extend(turns.sent(from..120, turns.period * from as u32 + Duration::from_millis(900)));
            let (counting, segments_lost) = heard(model, &sent);
            let lines = if model.compact.is_some() { turns_lines(model) } else { 1 };
            assert_eq!((counting.restarts, counting.lost), (0, (ahead as u64 - 1) * lines), "{}", model.name);
            assert_eq!(segments_lost > 0, model.compact.is_some(), "{}", model.name);
        }
    }
}

fn turns_lines(model: &'static Model) -> u64 {
    Device::new(model, Identity::default()).mirrors().len() as u64
}

/// As with a virtual scanner that runs as fast as it can: the limit that docs/record.md tells.
#[test]
fn a_host_whose_clock_stands_tells_a_restart_by_what_goes_back_alone() {
    // Farther back than what comes late.
    const TURNS: usize = 100;
    for model in model::all() {
        let turns = Turns::of(model, 160);
        let heard = |next: usize| {
            let sent = turns.sent(0..TURNS, Duration::ZERO).into_iter().chain(turns.sent(next..160, OFF));
            let sent: Vec<_> = sent.map(|(_, bytes)| (Duration::ZERO, bytes)).collect();
            let (counting, _) = heard(model, &sent);
            (counting.restarts, counting.lost > 0)
        };
        assert_eq!(heard(0), (1, false), "{}: back to the first turn", model.name);
        assert_eq!(heard(TURNS + 19), (0, true), "{}: ahead", model.name);
    }
}

#[test]
fn telegrams_that_have_waited_are_no_restart() {
    for model in model::all() {
        let turns = Turns::of(model, 80);
        let mut sent = turns.sent(0..BEFORE, Duration::ZERO);
        sent.extend(turns.sent(BEFORE..80, OFF));
        let (counting, segments_lost) = heard(model, &sent);
        assert_eq!((counting.restarts, counting.lost, segments_lost), (0, 0, 0), "{}", model.name);
    }
}

#[test]
fn a_scanner_that_runs_slower_than_its_host_has_gaps_too() {
    for model in model::all() {
        let mut turns = Turns::of(model, 120);
        turns.period *= 10;
        let mut sent = turns.sent(0..BEFORE, Duration::ZERO);
        sent.extend(turns.sent(BEFORE + 19..120, turns.period * (BEFORE as u32 + 19)));
        let (counting, _) = heard(model, &sent);
        assert_eq!(counting.restarts, 0, "{}", model.name);
        assert!(counting.lost >= 19, "{}", model.name);
    }
}

#[test]
fn what_comes_late_is_not_lost() {
    for model in model::all() {
        for by in 1..=REORDER as usize {
            let mut sent = Turns::of(model, 80).sent(0..80, Duration::ZERO);
            let count = sent.len();
            for place in (count / 4..count / 2).step_by(by + 7) {
                let times: Vec<Duration> = sent[place..=place + by].iter().map(|(at, _)| *at).collect();
                sent[place..=place + by].rotate_left(1);
                sent[place..=place + by].iter_mut().zip(times).for_each(|((at, _), time)| *at = time);
            }
            let (counting, segments_lost) = heard(model, &sent);
            let found = (counting.lost, counting.repeated, counting.restarts, segments_lost);
            assert_eq!(found, (0, 0, 0, 0), "{}, by {by}", model.name);
            assert_eq!(
                counting.late > 0,
                model.compact.is_none(),
                "{}, by {by}: segments are put in place",
                model.name
            );
        }
    }
}

#[test]
fn what_comes_late_and_again_has_come_again() {
    for model in model::all().filter(|model| model.compact.is_none()) {
        let mut sent = Turns::of(model, 80).sent(0..80, Duration::ZERO);
        let again = sent[20..23].to_vec();
        sent.splice(23..23, again.into_iter().map(|(_, bytes)| (Duration::from_secs(1), bytes)));
        let (counting, _) = heard(model, &sent);
        assert_eq!(
            (counting.lost, counting.repeated, counting.late, counting.restarts),
            (0, 3, 0, 0),
            "{}",
            model.name
        );
    }
}

#[test]
fn lines_of_one_turn_take_no_time_of_their_own() {
    for model in model::all() {
        let turns = Turns::of(model, 60);
        let (counting, _) = heard(model, &turns.sent(0..60, Duration::ZERO));
        let hertz = turns.period.as_secs_f64().recip();
        assert!((counting.frequency_hz().unwrap() - hertz).abs() < 0.02 * hertz, "{}", model.name);
        assert_eq!((counting.untimed, counting.lost), (0, 0), "{}", model.name);
        let travel_s = travel_s(model, &turns.sent(0..60, Duration::ZERO));
        assert!((travel_s * hertz - 59.0).abs() <= 1.0, "{}: {travel_s} s", model.name);
    }
}
