//! Several scanners that send to one UDP port: one is followed, the others are told, and nothing of them gets into its scans.

use std::time::Duration;

use rowscan_protocol::compact::CompactListener;
use rowscan_protocol::host::{HostEvent, HostSession, OtherSender};
use rowscan_protocol::model::SEGMENTED;
use rowscan_protocol::scan::Scan;

use crate::datagrams::scan_of;
use crate::restarts::Turns;

/// Scans, and which others were told, by which is listened to.
fn heard(listener: &mut CompactListener, datagrams: &[Vec<u8>]) -> (Vec<Scan>, Vec<[Option<u32>; 2]>) {
    let (mut scans, mut told) = (Vec::new(), Vec::new());
    for datagram in datagrams {
        listener.handle_datagram(Duration::ZERO, datagram);
        while let Some(event) = listener.poll_event() {
            match event {
                HostEvent::Scan => scans.push(listener.scan().clone()),
                HostEvent::OtherSender { found, followed } => told.push([found, followed]),
                other => panic!("{other:?}"),
            }
        }
    }
    (scans, told)
}

/// All datagrams of some turns of two scanners, by turns.
fn together(one: &Turns, other: &Turns) -> Vec<Vec<u8>> {
    let pairs = one.telegrams.iter().zip(&other.telegrams);
    pairs.flat_map(|(one, other)| [one.clone(), other.clone()]).flatten().collect()
}

#[test]
fn scans_of_two_scanners_are_never_mixed() {
    for model in SEGMENTED {
        for neighbour in SEGMENTED {
            let (own, other) = (Turns::of_unit(model, 0, 12), Turns::of_unit(neighbour, 1, 12));
            let number = |turns: &Turns| scan_of(&turns.telegrams[0][0]).modules.0[0].sender_id;
            let (followed, found) = (number(&own), number(&other));
            assert_ne!(followed, found, "{}, {}", model.name, neighbour.name);
            let alone: Vec<Vec<u8>> = own.telegrams.concat();
            let (expected, _) = heard(&mut CompactListener::default(), &alone);
            // The one that is heard first, and the one that is asked for.
            let (mut first, mut asked) = (CompactListener::default(), CompactListener::default());
            asked.follow(followed);
            for (listener, mixed) in
                [(&mut first, together(&own, &other)), (&mut asked, together(&other, &own))]
            {
                let (scans, told) = heard(listener, &mixed);
                assert_eq!(scans.len(), expected.len(), "{}, {}", model.name, neighbour.name);
                assert!(scans.iter().all(|scan| scan.serial_number == followed));
                assert_eq!(told, [[Some(found), Some(followed)]]);
                let telegrams = other.telegrams.iter().map(Vec::len).sum::<usize>() as u64;
                assert_eq!(listener.other_senders(), [OtherSender { serial_number: Some(found), telegrams }]);
                assert_eq!((listener.segments_lost(), listener.counts().bad), (0, 0));
            }
        }
    }
}
