//! Segments that come twice: unchanged copies cost nothing, and of two that contradict each other neither is believed, whichever came first.

use rowscan_protocol::compact::{CompactListener, SegmentCounts, Telegram};
use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::model::{Model, SEGMENTED};
use rowscan_protocol::scan::Scan;
use rowscan_protocol::validity::ScanFault;

use crate::datagrams::scan_of;
use crate::restarts::Turns;

/// Turns that are heard.
const TURNS: usize = 6;

/// The same datagram with all its beams at another range.
fn forged(datagram: &[u8]) -> Vec<u8> {
    let mut scan = scan_of(datagram);
    for module in scan.modules.0.iter_mut() {
        module.beams.distance.iter_mut().for_each(|counts| *counts ^= 0x0400);
    }
    let mut bytes = Vec::new();
    Telegram::Scan(scan.seal()).encode(&mut bytes).expect("it was one");
    bytes
}

/// What comes of datagrams.
#[derive(Debug, PartialEq)]
struct Heard {
    scans: Vec<Scan>,
    faults: Vec<ScanFault>,
    counts: SegmentCounts,
}

fn heard<'a>(datagrams: impl IntoIterator<Item = &'a Vec<u8>>) -> Heard {
    let mut listener = CompactListener::default();
    let (mut scans, mut faults) = (Vec::new(), Vec::new());
    let mut take = |listener: &mut CompactListener| {
        while let Some(event) = listener.poll_event() {
            match event {
                HostEvent::Scan => scans.push(listener.scan().clone()),
                HostEvent::Malformed { fault } => faults.push(fault),
                other => panic!("{other:?}"),
            }
        }
    };
    for datagram in datagrams {
        listener.handle_datagram(std::time::Duration::ZERO, datagram);
        take(&mut listener);
    }
    listener.handle_end();
    take(&mut listener);
    let counts = listener.segments();
    Heard { scans, faults, counts }
}

fn sent(model: &'static Model) -> Vec<Vec<Vec<u8>>> {
    Turns::of_unit(model, 0, TURNS as u32).telegrams
}

#[test]
fn the_order_of_two_copies_changes_nothing() {
    for model in SEGMENTED {
        let turns = sent(model);
        let last = turns[0].len() - 1;
        for turn in 0..TURNS {
            // A turn is given with its last segment: what comes behind that cannot take it back.
            for segment in 0..last {
                let with = |order: fn(Vec<u8>, Vec<u8>) -> [Vec<u8>; 2], behind: usize| {
                    let mut turns = turns.clone();
                    let right = turns[turn].remove(segment);
                    let wrong = forged(&right);
                    let [first, second] = order(right, wrong);
                    turns[turn].insert(segment, first);
                    turns[turn].insert(segment + 1 + behind.min(last - 1 - segment), second);
                    heard(turns.iter().flatten())
                };
                let place = format!("{}, segment {segment} of turn {turn}", model.name);
                for behind in 0..3 {
                    let found = with(|right, wrong| [right, wrong], behind);
                    assert_eq!(found, with(|right, wrong| [wrong, right], behind), "{place}");
                    assert_eq!((found.counts.contradicted, found.counts.doubled()), (1, 0), "{place}");
                    let fault = ScanFault::Contradicted { segment: segment as u64, turn: turn as u64 };
                    assert_eq!(found.faults, [fault], "{place}");
                    let of_turn = |scan: &&Scan| usize::from(scan.scan_counter) == turn;
                    assert_eq!(found.scans.iter().filter(of_turn).count(), 0, "{place}");
                    let whole = heard(turns.iter().flatten());
                    assert_eq!(found.scans.len() + whole.scans.len() / TURNS, whole.scans.len(), "{place}");
                }
            }
        }
    }
}

#[test]
fn one_that_comes_behind_its_turn_is_counted_and_told() {
    for model in SEGMENTED {
        let turns = sent(model);
        for first_is_right in [true, false] {
            let mut sent: Vec<Vec<u8>> = turns.concat();
            let at = 2 * turns[0].len() - 1;
            let wrong = forged(&sent[at]);
            sent.insert(at + usize::from(first_is_right), wrong);
            let Heard { scans, faults, counts } = heard(&sent);
            assert_eq!((counts.contradicted, counts.lost, faults.len()), (1, 0, 1), "{}", model.name);
            assert_eq!(scans.len(), heard(turns.iter().flatten()).scans.len(), "{}", model.name);
        }
    }
}

#[test]
fn of_two_scanners_with_one_number_nothing_is_believed() {
    for model in SEGMENTED {
        let turns = sent(model);
        for first_is_right in [true, false] {
            let pair = |right: &Vec<u8>| {
                let wrong = forged(right);
                if first_is_right { [right.clone(), wrong] } else { [wrong, right.clone()] }
            };
            let mixed: Vec<Vec<u8>> = turns.iter().flatten().flat_map(pair).collect();
            let Heard { scans, faults, counts } = heard(&mixed);
            assert_eq!((scans.len(), faults.len()), (0, TURNS), "{}", model.name);
            assert_eq!(counts.contradicted, turns.concat().len() as u64, "{}", model.name);
        }
    }
}

#[test]
fn unchanged_copies_cost_nothing_and_are_counted() {
    for model in SEGMENTED {
        let turns = sent(model);
        let whole = heard(turns.iter().flatten());
        for copies in 2..4 {
            let copied: Vec<Vec<u8>> =
                turns.iter().flatten().flat_map(|datagram| vec![datagram.clone(); copies]).collect();
            let found = heard(&copied);
            let doubled = (copies as u64 - 1) * turns.concat().len() as u64;
            assert_eq!((found.counts.doubled(), found.counts.contradicted), (doubled, 0), "{}", model.name);
            assert_eq!((found.scans, found.faults), (whole.scans.clone(), Vec::new()), "{}", model.name);
        }
    }
}
