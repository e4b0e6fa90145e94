//! The client against a task controller that is played by hand, byte by byte.

use super::*;
use crate::isobus::implement::tests::implement;

const MS: u64 = 1_000_000;
const S: u64 = 1000 * MS;
/// Where task controllers sit.
const SERVER: u8 = 0xF7;
/// Its address is claimed, and its silence over.
const READY: u64 = 6 * S + 250 * MS;

/// A client, its time, and what it says.
struct Played {
    client: TaskClient,
    at: SimTime,
    said: Vec<(SimTime, CanFrame)>,
}

impl Played {
    fn new(sections: u16, on_loss: OnLoss) -> Self {
        let mut client = TaskClient::new(implement(sections), on_loss).in_automatic();
        let mut out = Vec::new();
        client.open(SimTime::ZERO, &mut out);
        Self { client, at: SimTime::ZERO, said: Vec::new() }
    }

    /// Time passes up to `until`.
    fn pass(&mut self, until: u64) {
        while let Some(next) = self.client.next().filter(|next| next.0 <= until) {
            self.at = self.at.max(next);
            let mut out = Vec::new();
            self.client.poll(self.at, &mut out);
            let at = self.at;
            self.said.extend(out.into_iter().map(|frame| (at, frame)));
        }
        self.at = SimTime(until);
    }

    fn hear(&mut self, frame: &CanFrame) {
        let mut out = Vec::new();
        self.client.handle(self.at, frame, &mut out);
        let at = self.at;
        self.said.extend(out.into_iter().map(|frame| (at, frame)));
    }

    /// The task controller says these bytes of process data.
    fn told(&mut self, bytes: [u8; 8]) {
        let everyone = bytes[0] & 0xF == command::SERVER_STATUS;
        let to = if everyone { EVERYONE } else { 0x91 };
        self.hear(&process_data::frame((SERVER, to), bytes).expect("a frame"));
    }

    fn set(&mut self, ddi: u16, value: i32) {
        let element = if ddi <= 2 || ddi == ddi::PRESCRIPTION_CONTROL { 3 } else { 2 };
        self.told(ProcessData { command: command::VALUE, element, ddi, value }.bytes());
    }

    fn status(&mut self) {
        self.told([0xFE, 0xFF, 0xFF, 0xFF, 1, 0, 0, 0xFF]);
    }

    /// What process data it has said since the last call, without its status.
    fn said(&mut self) -> Vec<[u8; 8]> {
        let said = std::mem::take(&mut self.said);
        let data = said.into_iter().filter(|(_, frame)| {
            J1939Id::of(frame.id).is_some_and(|id| id.pgn == PROCESS_DATA.pgn && id.destination == SERVER)
        });
        data.filter_map(|(_, frame)| frame.data().try_into().ok())
            .filter(|bytes: &[u8; 8]| bytes[0] & 0xF != command::CLIENT_STATUS)
            .collect()
    }

    /// Up to where its pool is in use; the pool.
    fn connect(&mut self) -> Pool {
        self.pass(READY);
        self.status();
        assert_eq!(self.said(), [[0x00, 255, 255, 255, 255, 255, 255, 255]], "the version is asked for");
        self.told([0x10, 4, 0xFF, 0x11, 0, 1, 32, 0]);
        let asked = self.said.pop().expect("the language is asked for").1;
        assert_eq!((asked.id.bits(), asked.data()), (0x18EA_F791, &[0x0F, 0xFE, 0x00][..]));
        let id = J1939Id { source: SERVER, ..LANGUAGE.id(SERVER) };
        self.hear(&CanFrame::new(id.id(), b"en\x50\0\0\0\xFF\xFF").expect("a frame"));
        assert_eq!(self.said(), [[0x01, 255, 255, 255, 255, 255, 255, 255]], "the structure label");
        self.told([0x11, 255, 255, 255, 255, 255, 255, 255]);
        let asked = self.said();
        let len = self.client.pool.bytes(Version::Fourth).len() as u32;
        let [l0, l1, l2, l3] = len.to_le_bytes();
        assert_eq!(asked, [[0x41, l0, l1, l2, l3, 255, 255, 255]]);
        self.told([0x51, 0, 255, 255, 255, 255, 255, 255]);
        let bytes = self.receive();
        assert_eq!((bytes[0], bytes.len() as u32), (0x61, len + 1));
        self.told([0x71, 0, l0, l1, l2, l3, 255, 255]);
        assert_eq!(self.said(), [[0x81, 255, 255, 255, 255, 255, 255, 255]]);
        self.told([0x91, 0, 255, 255, 255, 255, 0, 255]);
        assert_eq!(self.client.connection(), Connection::Connected);
        Pool::read(&bytes[1..], Version::Fourth).expect("a sound pool")
    }

    /// The other end of the transport protocol.
    fn receive(&mut self) -> Vec<u8> {
        let mut transport = Transport::new(100_000);
        loop {
            for (at, frame) in std::mem::take(&mut self.said) {
                let mut out = Vec::new();
                let carried = transport.handle(at, SERVER, &frame, &mut out);
                out.iter().for_each(|frame| self.hear(frame));
                if let Some(Carried::Received { bytes, .. }) = carried {
                    self.said.clear();
                    return bytes;
                }
            }
            let next = self.client.next().expect("it goes on");
            self.pass(next.0);
        }
    }
}

fn word(on: &[u16], off: &[u16]) -> i32 {
    let work = |place: u16| match (on.contains(&place), off.contains(&place)) {
        (true, _) => ddi::Work::On,
        (_, true) => ddi::Work::Off,
        _ => ddi::Work::Absent,
    };
    ddi::condensed((1..=16).map(work))
}

#[test]
fn it_is_silent_for_six_seconds_and_then_waits_for_a_task_controller() {
    let mut played = Played::new(4, OnLoss::Close);
    played.pass(3 * S);
    played.status();
    played.pass(60 * S);
    assert_eq!((played.client.connection(), played.said.len()), (Connection::Alone, 0));
    played.status();
    let ids: Vec<(u32, u8)> =
        played.said.iter().map(|(_, frame)| (frame.id.bits(), frame.data()[0])).collect();
    assert_eq!(ids, [(0x1CFE_0D91, 1), (0x0CCB_F791, 0xFF), (0x14CB_F791, 0x00)]);
}

#[test]
fn from_power_up_to_sections() {
    for sections in [4, 16, 40] {
        let mut played = Played::new(sections, OnLoss::Close);
        let pool = played.connect();
        assert_eq!(pool, implement(sections).pool(), "{sections}");
        // The sheet's vector: sections 1 and 3 on, 2 and 4 off, the rest as they are.
        played.told([0x23, 0x00, 0x22, 0x01, 0x11, 0xFF, 0xFF, 0xFF]);
        let told: Vec<_> =
            played.client.take_orders().iter().map(|order| (order.number, order.is_open)).collect();
        assert_eq!(told, [(1, true), (2, false), (3, true), (4, false)], "{sections}");
        let at = played.at.0;
        played.pass(at + 15 * MS);
        let said = played.said();
        let present: Vec<u16> = (1..=sections.min(16)).collect();
        let state = word(&[1, 3], &present).to_le_bytes();
        let actual = |bytes: &[u8; 8]| bytes[..4] == [0x23, 0x00, 0xA1, 0x00];
        let told: Vec<_> = said.iter().filter(|bytes| actual(bytes)).collect();
        assert_eq!(told.last().map(|bytes| &bytes[4..]), Some(&state[..]), "{sections}: {said:02X?}");
    }
}

#[test]
fn its_status_comes_every_two_seconds() {
    let mut played = Played::new(4, OnLoss::Close);
    played.connect();
    played.said.clear();
    for s in 1..14 {
        played.pass(READY + s * S);
        played.status();
    }
    let beats: Vec<_> = played.said.iter().filter(|(_, frame)| frame.data()[0] == 0xFF).collect();
    assert_eq!(beats.len(), 6);
    assert!(beats.windows(2).all(|pair| pair[1].0.0 - pair[0].0.0 == 2 * S));
    assert_eq!(beats[0].1.data(), [0xFF, 0xFF, 0xFF, 0xFF, 1, 0, 0, 0], "the task is active");
}

#[test]
fn without_a_status_for_six_seconds_the_task_controller_is_lost() {
    for (on_loss, closed) in [(OnLoss::Close, vec![(1, false), (2, false)]), (OnLoss::Hold, vec![])] {
        let mut played = Played::new(4, on_loss);
        played.connect();
        played.set(290, word(&[1, 2], &[]));
        played.client.take_orders();
        let heard = played.client.session.heard.0;
        played.pass(heard + 6 * S - MS);
        assert_eq!(
            (played.client.connection(), played.client.take_orders()),
            (Connection::Connected, vec![])
        );
        played.pass(heard + 6 * S);
        let told: Vec<_> =
            played.client.take_orders().iter().map(|order| (order.number, order.is_open)).collect();
        assert_eq!(told, closed);
        assert!(matches!(played.client.connection(), Connection::Silent(_)));
        // It comes back by itself.
        played.pass(heard + 12 * S);
        played.said.clear();
        played.status();
        assert_eq!(played.said().len(), 1);
    }
}

/// Whoever sets something learns why nothing came of it; what was told over a connection that was given up holds no more.
#[test]
fn setpoints_that_nobody_takes_are_noted_with_the_reason() {
    let mut played = Played::new(4, OnLoss::Close);
    let idle = |played: &mut Played| -> Vec<_> {
        played.client.take_idle().into_iter().map(|idle| (idle.element, idle.ddi, idle.why)).collect()
    };
    played.pass(READY);
    played.status();
    played.set(290, word(&[1], &[]));
    assert_eq!(idle(&mut played), [(2, 290, IdleReason::NotConnected)], "its pool is not active");
    let mut played = Played::new(4, OnLoss::Close);
    played.connect();
    played.set(290, word(&[1], &[2, 3, 4]));
    assert_eq!((idle(&mut played), played.client.take_given_up()), (vec![], vec![]));
    // The fifth of four; the first is shut all the same.
    played.set(290, word(&[5], &[1]));
    assert_eq!(idle(&mut played), [(2, 290, IdleReason::NoSuchSection)]);
    assert_eq!(
        played.client.take_orders().last().map(|order| (order.number, order.is_open)),
        Some((1, false))
    );
    let open = ProcessData { command: command::VALUE, element: 2, ddi: 290, value: 1 }.bytes();
    played.hear(&process_data::frame((SERVER + 1, 0x91), open).expect("a frame"));
    assert_eq!(idle(&mut played), [(2, 290, IdleReason::OtherSender)]);
    let lost_at = played.client.session.heard.0 + 6 * S;
    played.pass(lost_at);
    assert_eq!(played.client.take_given_up(), [SimTime(lost_at)]);
    played.set(160, 1);
    assert_eq!(idle(&mut played), [(2, 160, IdleReason::NotConnected)]);
}

#[test]
fn a_pool_that_is_there_is_used_and_another_one_is_deleted_first() {
    let mut played = Played::new(4, OnLoss::Close);
    played.pass(READY);
    played.status();
    played.told([0x10, 4, 0xFF, 0x11, 0, 1, 32, 0]);
    // Nobody answers what the language is.
    played.pass(READY + 2 * S);
    let [s0, s1, s2, s3, s4, s5, s6] = played.client.session.structure;
    played.said();
    played.told([0x11, s0, s1, s2, s3, s4, s5, s6]);
    assert_eq!(played.said()[0][0], 0x21, "the language label");
    let [l0, l1, l2, l3, l4, l5, l6] = played.client.session.localization;
    played.told([0x31, l0, l1, l2, l3, l4, l5, l6]);
    assert_eq!(played.said()[0][0], 0x81, "it is activated without an upload");
    let mut played = Played::new(4, OnLoss::Close);
    played.pass(READY);
    played.status();
    played.told([0x10, 3, 0xFF, 0x11, 0, 1, 32, 0]);
    played.pass(READY + 2 * S);
    played.said();
    played.told([0x11, b'o', b'l', b'd', b' ', b' ', b' ', b' ']);
    assert_eq!(played.said()[0][0], 0xA1);
    played.told([0xB1, 0, 255, 255, 255, 255, 255, 255]);
    let len = played.client.pool.bytes(Version::Third).len() as u32;
    assert_eq!(played.said()[0][1..5], len.to_le_bytes(), "of version 3");
}

#[test]
fn a_refused_pool_is_told_with_its_object_and_tried_again() {
    let mut played = Played::new(4, OnLoss::Close);
    played.pass(READY);
    played.status();
    played.told([0x10, 4, 0xFF, 0x11, 0, 1, 32, 0]);
    played.pass(READY + 2 * S);
    played.told([0x11, 255, 255, 255, 255, 255, 255, 255]);
    played.said.clear();
    played.told([0x51, 0, 255, 255, 255, 255, 255, 255]);
    played.receive();
    played.told([0x71, 0, 0, 0, 0, 0, 255, 255]);
    played.told([0x91, 1, 3, 0, 111, 0, 2, 255]);
    let Connection::Refused(refused, until) = played.client.connection() else {
        panic!("{:?}", played.client.connection())
    };
    assert_eq!(refused, Refused { at_transfer: false, code: 1, object: Some(111) });
    played.set(290, word(&[1], &[]));
    assert_eq!(played.client.take_orders(), [], "it does not follow");
    while played.at < until {
        played.status();
        played.pass((played.at.0 + S).min(until.0));
    }
    assert!(matches!(played.client.connection(), Connection::Silent(_)));
}

#[test]
fn questions_and_triggers_are_answered_and_nonsense_is_refused() {
    let mut played = Played::new(4, OnLoss::Close);
    played.connect();
    played.said();
    let mut ask = |command: u8, element: u16, ddi: u16, value: i32| {
        played.told(ProcessData { command, element, ddi, value }.bytes());
        played.said()
    };
    let value = |element: u16, ddi: u16, value: i32| {
        vec![ProcessData { command: command::VALUE, element, ddi, value }.bytes()]
    };
    assert_eq!(ask(command::REQUEST, 2, ddi::TURN_ON_TIME, 0), value(2, 205, 15));
    assert_eq!(ask(command::REQUEST, 2, ddi::TURN_OFF_TIME, 0), value(2, 206, 10));
    assert_eq!(ask(command::REQUEST, 2, ddi::SECTION_CONTROL, 0), value(2, 160, 1));
    assert_eq!(ask(command::VALUE, 3, 1, ddi::rate(300.0)), Vec::<[u8; 8]>::new());
    assert_eq!(ask(command::REQUEST, 3, 1, 0), value(3, 1, 3_000_000));
    let unknown = [[0x0D, 0, 8, 2, refusal::RANGE, 0xF2, 255, 255]];
    assert_eq!(ask(command::REQUEST, 0, ddi::CANOPY_HEIGHT, 0), unknown, "no sensor tells it");
    assert_eq!(ask(command::SET_AND_ACKNOWLEDGE, 2, 160, 1), [[0x2D, 0, 160, 0, 0, 0xFA, 255, 255]]);
    let refused = [
        (command::VALUE, 99, 290, 0, refusal::ELEMENT),
        (command::VALUE, 2, 999, 0, refusal::DDI),
        // The first and the last section have properties, which stand in the pool; there is no fifth one.
        (command::REQUEST, 4, ddi::OFFSET_Y, 0, refusal::DDI),
        (command::REQUEST, 7, ddi::SUB_UNITS, 0, refusal::DDI),
        (command::REQUEST, 8, ddi::OFFSET_Y, 0, refusal::ELEMENT),
        (command::VALUE, 2, 161, 0, refusal::NOT_SETTABLE),
        (command::VALUE, 2, 160, 7, refusal::VALUE),
        (command::DISTANCE_INTERVAL, 2, 161, 100, refusal::TRIGGER),
        (command::PEER, 2, 161, 100, refusal::COMMAND),
    ];
    for (command, element, ddi, value, bits) in refused {
        let said = ask(command, element, ddi, value);
        assert_eq!(said.iter().map(|bytes| (bytes[0] & 0xF, bytes[4])).collect::<Vec<_>>(), [(0xD, bits)]);
    }
    // A value by time, and the canopy's height on change.
    ask(command::TIME_INTERVAL, 2, ddi::ACTUAL_WIDTH, 500);
    ask(command::ON_CHANGE, 0, ddi::CANOPY_HEIGHT, 100);
    let at = played.at.0;
    for ms in (0..1000).step_by(100) {
        played.pass(at + ms * MS);
        let height_m = if ms < 500 { 2.0 } else { 2.5 };
        let data = canopy::SUMMARY.encode(&[None, None, None, None, Some(height_m)]);
        played.hear(&CanFrame::new(canopy::SUMMARY.id(0x80).id(), data.bytes()).expect("a frame"));
    }
    let told: Vec<(u16, i32)> = played
        .said()
        .iter()
        .filter_map(|bytes| ProcessData::read(bytes))
        .map(|told| (told.ddi, told.value))
        .collect();
    assert_eq!(told, [(520, 2000), (67, 4000), (520, 2500)]);
}

/// Whoever asks for anything that stands in the pool has one answer: the value, or that there is none.
#[test]
fn every_question_about_process_data_of_the_pool_has_one_answer() {
    let mut played = Played::new(20, OnLoss::Close);
    played.connect();
    played.said();
    // Open sections, and no speed: no rate either.
    played.set(290, word(&[1], &[]));
    played.pass(played.at.0 + S);
    played.said();
    let known = played.client.pool.process_data();
    let mut unknown = Vec::new();
    for (element, ddi, ..) in known.into_iter().filter(|(_, ddi, ..)| *ddi != ddi::DEFAULT_SET) {
        played.told(ProcessData { command: command::REQUEST, element, ddi, value: 0 }.bytes());
        let said = played.said();
        let [one] = said.as_slice() else { panic!("{element} {ddi}: {said:?}") };
        let told = ProcessData::read(one).expect("eight bytes");
        assert_eq!((told.element, told.ddi), (element, ddi));
        if told.command == command::ACKNOWLEDGE {
            assert_eq!(one[4], refusal::RANGE);
            unknown.push(ddi);
        }
    }
    assert_eq!(unknown, [ddi::CANOPY_HEIGHT, ddi::ACTUAL_RATE]);
}

#[test]
fn only_its_own_task_controller_is_obeyed() {
    let mut played = Played::new(4, OnLoss::Close);
    played.connect();
    let told = ProcessData { command: command::VALUE, element: 2, ddi: 290, value: word(&[1], &[]) };
    played.hear(&process_data::frame((0x33, 0x91), told.bytes()).expect("a frame"));
    played.hear(&process_data::frame((SERVER, 0x55), told.bytes()).expect("a frame"));
    assert_eq!(played.client.take_orders(), []);
    // Who does not know us says so.
    let nack = [1, 255, 255, 255, 0x91, 0x00, 0xCB, 0x00];
    let id = J1939Id { source: SERVER, destination: 0x91, ..REQUEST_ACKNOWLEDGEMENT.id(0) };
    played.hear(&CanFrame::new(id.id(), &nack).expect("a frame"));
    assert!(matches!(played.client.connection(), Connection::Silent(_)));
}

#[test]
fn troubles_keep_it_from_working() {
    let mut lost = Played::new(4, OnLoss::Close);
    lost.connect();
    lost.set(290, word(&[1], &[]));
    lost.client.take_orders();
    lost.client.set_trouble(Trouble { is_lost: true, ..Trouble::default() });
    let from = lost.client.session.heard.0;
    for s in 1..=6 {
        lost.pass(from + s * S);
        lost.status();
    }
    assert_eq!(lost.client.take_orders().len(), 1, "closed");
    let mut silent = Played::new(4, OnLoss::Close);
    silent.connect();
    silent.client.set_trouble(Trouble { is_silent: true, ..Trouble::default() });
    silent.said.clear();
    silent.pass(silent.at.0 + 5 * S);
    assert!(silent.said.is_empty());
}
