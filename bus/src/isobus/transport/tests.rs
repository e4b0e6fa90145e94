//! Both ends against each other, over a bus that loses, doubles and renumbers frames.

use proptest::prelude::*;
use rowscan_protocol::time::SimTime;

use super::*;

const MS: u64 = 1_000_000;
const PGN: u32 = 0xCB00;
const A: u8 = 0x90;
const B: u8 = 0xF7;

/// What becomes of the frame with this number, counted from 0 over both directions.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Trick {
    Lose,
    Double,
    /// A data packet has another number. All other bytes are guarded by CAN's checksum alone.
    Renumber(u8),
}

/// Two ends by virtual time: what came of it at each, and how many frames went.
fn carried(bytes: &[u8], to: u8, tricks: &[(usize, Trick)]) -> (Vec<Carried>, Vec<Carried>, usize) {
    let (mut a, mut b) = (Transport::new(100_000), Transport::new(100_000));
    let (mut of_a, mut of_b) = (Vec::new(), Vec::new());
    let mut queue = std::collections::VecDeque::new();
    let mut said = Vec::new();
    a.send(SimTime::ZERO, (A, to), PGN, bytes.to_vec(), &mut said).expect("nothing is on its way");
    queue.extend(said.drain(..));
    let (mut at, mut count) = (SimTime::ZERO, 0);
    loop {
        while let Some(frame) = queue.pop_front() {
            let trick = tricks.iter().find(|(number, _)| *number == count).map(|(_, trick)| *trick);
            count += 1;
            assert!(count < 100_000, "a quarrel without end");
            let mut heard = vec![frame];
            match trick {
                Some(Trick::Lose) => heard.clear(),
                Some(Trick::Double) => heard.push(frame),
                Some(Trick::Renumber(number)) if matches!(frame.id.bits() >> 16 & 0xFF, 0xEB | 0xC7) => {
                    let mut data = frame.data().to_vec();
                    data[0] = number;
                    heard = CanFrame::new(frame.id, &data).into_iter().collect();
                }
                Some(Trick::Renumber(_)) | None => {}
            }
            for frame in heard {
                let id = J1939Id::of(frame.id).expect("29 bits");
                if id.source == A {
                    of_b.extend(b.handle(at, B, &frame, &mut said));
                } else {
                    of_a.extend(a.handle(at, A, &frame, &mut said));
                }
                queue.extend(said.drain(..));
            }
        }
        let Some(next) = a.next().into_iter().chain(b.next()).min() else { break };
        assert!(next.0 < 1_000_000 * MS, "it never ends");
        at = next;
        of_a.extend(a.poll(at, &mut said));
        of_b.extend(b.poll(at, &mut said));
        queue.extend(said.drain(..));
    }
    (of_a, of_b, count)
}

fn message(len: usize) -> Vec<u8> {
    (0..len).map(|place| (place * 7 + place / 256) as u8).collect()
}

#[test]
fn messages_of_every_form_arrive_as_they_were_sent() {
    for len in [9, 14, 20, 112, 113, 1785, 1786, 5000, 20_000] {
        let bytes = message(len);
        let (of_a, of_b, frames) = carried(&bytes, B, &[]);
        assert_eq!(of_a, [Carried::Sent { pgn: PGN, destination: B }], "{len}");
        assert_eq!(of_b, [Carried::Received { pgn: PGN, source: A, is_broadcast: false, bytes }], "{len}");
        let (packets, bursts) = (len.div_ceil(7), len.div_ceil(7).div_ceil(16));
        let offsets = if len > LONGEST_PLAIN { bursts } else { 0 };
        assert_eq!(frames, 1 + packets + bursts + offsets + 1, "{len}");
    }
    let bytes = message(30);
    let (of_a, of_b, frames) = carried(&bytes, EVERYONE, &[]);
    assert_eq!(of_a, [Carried::Sent { pgn: PGN, destination: EVERYONE }]);
    assert_eq!(of_b, [Carried::Received { pgn: PGN, source: A, is_broadcast: true, bytes }]);
    assert_eq!(frames, 6);
}

#[test]
fn lengths_and_rooms_have_ends() {
    let mut transport = Transport::new(100);
    let mut out = Vec::new();
    let mut send = |to: u8, len: usize, out: &mut Vec<CanFrame>| {
        transport.send(SimTime::ZERO, (A, to), PGN, vec![0; len], out)
    };
    assert_eq!(send(B, 8, &mut out), Err(SendError::Length { most: 117_440_505, found: 8 }));
    assert_eq!(send(EVERYONE, 1786, &mut out), Err(SendError::Length { most: 1785, found: 1786 }));
    assert_eq!((send(B, 9, &mut out), send(B, 10, &mut out)), (Ok(()), Err(SendError::Busy)));
    let heard = |control, transport: &mut Transport, source: u8| {
        let mut out = Vec::new();
        let route = Route { source, destination: B };
        let form = if let Control::Request { len, .. } = control { Form::of(len) } else { Form::Plain };
        let frame = route.control(form, PGN, control).expect("a frame");
        transport.handle(SimTime::ZERO, B, &frame, &mut out);
        out.first().map(|frame| (frame.data()[0], frame.data()[1]))
    };
    let request = |len: usize| Control::Request { len, packets: packets_of(len), at_once: 255 };
    let mut transport = Transport::new(100);
    assert_eq!(heard(request(101), &mut transport, 1), Some((255, 2)), "no room");
    assert_eq!(heard(request(5_000_000), &mut transport, 1), Some((255, 2)), "no room");
    assert_eq!(heard(request(8), &mut transport, 1), Some((255, 250)), "a frame would do");
    let wrong = Control::Request { len: 20, packets: 4, at_once: 255 };
    assert_eq!(heard(wrong, &mut transport, 1), Some((255, 250)), "20 bytes are 3 packets");
    for source in 0..8 {
        assert_eq!(heard(request(20), &mut transport, source), Some((17, 3)));
    }
    assert_eq!(heard(request(20), &mut transport, 8), Some((255, 2)), "no ninth");
    assert_eq!(heard(request(21), &mut transport, 3), Some((17, 3)), "the same again replaces it");
}

#[test]
fn silence_ends_a_connection_in_its_time() {
    // The request is lost: the sender waits 1250 ms.
    let (mut a, mut out) = (Transport::new(100), Vec::new());
    a.send(SimTime::ZERO, (A, B), PGN, message(20), &mut out).expect("sent");
    assert_eq!(a.next(), Some(SimTime(1250 * MS)));
    out.clear();
    let failed = a.poll(SimTime(1250 * MS), &mut out);
    assert_eq!(failed, [Carried::Failed { pgn: PGN, peer: B, is_ours: true, reason: AbortReason::TIMEOUT }]);
    assert_eq!((out[0].data()[0], out[0].data()[1], a.next()), (255, 3, None));
    // Told to wait, it waits 1050 ms.
    let mut a = Transport::new(100);
    a.send(SimTime::ZERO, (A, B), PGN, message(20), &mut out).expect("sent");
    let wait = Route { source: B, destination: A }
        .control(Form::Plain, PGN, Control::Clear { packets: 0, next: 1 })
        .expect("a frame");
    assert_eq!(a.handle(SimTime(100 * MS), A, &wait, &mut out), None);
    assert_eq!(a.next(), Some(SimTime(1150 * MS)));
}

#[test]
fn a_receiver_may_ask_again_but_not_for_ever() {
    let (mut a, mut out) = (Transport::new(100), Vec::new());
    a.send(SimTime::ZERO, (A, B), PGN, message(20), &mut out).expect("sent");
    let clear = Route { source: B, destination: A }
        .control(Form::Plain, PGN, Control::Clear { packets: 3, next: 1 })
        .expect("a frame");
    let mut failed = None;
    for round in 0..5u64 {
        let at = SimTime((100 * round + 1) * MS);
        failed = failed.or(a.handle(at, A, &clear, &mut out));
        for ms in 1..10 {
            a.poll(at + std::time::Duration::from_millis(ms), &mut out);
        }
    }
    let data = out.iter().filter(|frame| frame.id.bits() & 0xFF_0000 == 0xEB_0000).count();
    assert_eq!(data, 4 * 3);
    let reason = AbortReason::TOO_MANY_REPEATS;
    assert_eq!(failed, Some(Carried::Failed { pgn: PGN, peer: B, is_ours: true, reason }));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever is lost, doubled or renumbered: what arrives is what was sent, or nothing; and nobody is left waiting.
    #[test]
    fn a_bad_bus_ends_in_an_abort_and_never_in_another_message(
        len in prop_oneof![9usize..200, 1700usize..2100],
        broadcast in any::<bool>(),
        tricks in prop::collection::vec((any::<prop::sample::Index>(), 0u8..20, 0u8..3), 1..4),
    ) {
        let to = if broadcast && len <= LONGEST_PLAIN { EVERYONE } else { B };
        let bytes = message(len);
        let (_, _, frames) = carried(&bytes, to, &[]);
        let tricks: Vec<(usize, Trick)> = tricks
            .into_iter()
            .map(|(place, number, kind)| {
                let trick = match kind {
                    0 => Trick::Lose,
                    1 => Trick::Double,
                    _ => Trick::Renumber(number),
                };
                (place.index(frames), trick)
            })
            .collect();
        let (of_a, of_b, _) = carried(&bytes, to, &tricks);
        for event in &of_b {
            if let Carried::Received { bytes: found, .. } = event {
                prop_assert_eq!(found, &bytes);
            }
        }
        let arrived = of_b.iter().filter(|event| matches!(event, Carried::Received { .. })).count();
        prop_assert!(arrived <= 1);
        // Acknowledged is only what has come.
        if to == B && of_a.iter().any(|event| matches!(event, Carried::Sent { .. })) {
            prop_assert_eq!(arrived, 1);
        }
    }

    /// Frames of any content, from anyone: no panic, and no more connections than there is room for.
    #[test]
    fn any_frames_are_taken_in_bounds(
        frames in prop::collection::vec((0u8..4, 0usize..4, prop::collection::vec(any::<u8>(), 0..9)), 0..200),
    ) {
        let mut transport = Transport::new(2000);
        let mut out = Vec::new();
        for (place, (source, group, data)) in frames.iter().enumerate() {
            let pgn = [0xEC00, 0xEB00, 0xC800, 0xC700][*group];
            let id = J1939Id { priority: 7, pgn, source: *source, destination: B };
            let frame = CanFrame::new(id.id(), data).expect("up to eight bytes");
            let at = SimTime(place as u64 * 10 * MS);
            transport.handle(at, B, &frame, &mut out);
            transport.poll(at, &mut out);
            prop_assert!(transport.into.len() <= MOST_IN);
        }
    }
}
