//! The task controller against our own client over a bus that loses frames, against bytes written by hand, and against noise.

use proptest::prelude::*;

use super::*;
use crate::isobus::client::{Connection, OnLoss, TaskClient};
use crate::isobus::implement::tests::implement;
use crate::isobus::pool::Version;
use crate::isobus::process_data::{descriptor, descriptor_message};
use crate::pgn::network::REQUEST;

const MS: u64 = 1_000_000;
const S: u64 = 1000 * MS;
/// Where clients sit here.
const CLIENT: u8 = 0x91;

/// Numbers that look like chance: splitmix64.
struct Chance(u64);

impl Chance {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn is(&mut self, per_million: u64) -> bool {
        self.next() % 1_000_000 < per_million
    }
}

/// A client and a server on one bus, which loses so many frames of a million.
struct Pair {
    client: TaskClient,
    server: TaskServer,
    at: SimTime,
    chance: Chance,
    lost: u64,
    passed: u64,
}

impl Pair {
    fn new(sections: u16, (seed, lost): (u64, u64)) -> Self {
        let client = TaskClient::new(implement(sections), OnLoss::Close);
        let server = TaskServer::new(Wishes::default());
        let mut pair = Self { client, server, at: SimTime::ZERO, chance: Chance(seed), lost, passed: 0 };
        let (mut ours, mut theirs) = (Vec::new(), Vec::new());
        pair.client.open(SimTime::ZERO, &mut ours);
        pair.server.open(SimTime::ZERO, &mut theirs);
        pair.carry(ours, theirs);
        pair
    }

    /// Frames of both pass until both are silent.
    fn carry(&mut self, mut of_client: Vec<CanFrame>, mut of_server: Vec<CanFrame>) {
        while !of_client.is_empty() || !of_server.is_empty() {
            let (mut client, mut server) = (Vec::new(), Vec::new());
            for frame in of_client.drain(..) {
                if !self.chance.is(self.lost) {
                    self.server.handle(self.at, &frame, &mut server);
                }
            }
            for frame in of_server.drain(..) {
                if !self.chance.is(self.lost) {
                    self.client.handle(self.at, &frame, &mut client);
                }
            }
            self.passed += (client.len() + server.len()) as u64;
            assert!(self.passed < 5_000_000, "they talk without end");
            (of_client, of_server) = (client, server);
        }
    }

    fn pass(&mut self, until: u64) {
        loop {
            let next = [self.client.next(), self.server.next()].into_iter().flatten().min();
            let Some(next) = next.filter(|next| next.0 <= until) else { break };
            self.at = self.at.max(next);
            let (mut ours, mut theirs) = (Vec::new(), Vec::new());
            self.client.poll(self.at, &mut ours);
            self.server.poll(self.at, &mut theirs);
            self.carry(ours, theirs);
        }
        self.at = SimTime(until);
    }

    fn wish(&mut self, wishes: Wishes) {
        let mut out = Vec::new();
        self.server.command(self.at, wishes, &mut out);
        self.carry(Vec::new(), out);
    }

    fn is_active(&self) -> bool {
        self.client.connection() == Connection::Connected && self.server.pool(CLIENT).is_some()
    }
}

fn wishes(open: &[bool], rate_l_ha: f64) -> Wishes {
    Wishes { rate_l_ha: Some(rate_l_ha), sections: open.to_vec() }
}

#[test]
fn our_client_is_served_from_its_pool_to_its_sections() {
    for sections in [2, 16, 40] {
        let mut pair = Pair::new(sections, (1, 0));
        pair.wish(wishes(&[true, false, true], 300.0));
        pair.pass(12 * S);
        assert!(pair.is_active(), "{sections}: {:?}", pair.client.connection());
        assert_eq!(pair.server.pool(CLIENT), Some(&implement(sections).pool()));
        let news = pair.server.take_news();
        let active = What::Active { sections: sections.into() };
        assert!(news.iter().any(|news| news.what == active && news.client == CLIENT), "{news:?}");
        let orders = pair.client.take_orders();
        let open: Vec<u16> = orders.iter().filter(|order| order.is_open).map(|order| order.number).collect();
        let wanted: Vec<u16> = [1, 3].into_iter().filter(|number| *number <= sections).collect();
        assert_eq!(open, wanted);
        let actual = pair.server.value(CLIENT, 2, 161).expect("it was told");
        assert_eq!(actual & 0xF, 1, "section 1 is on, section 2 off");
        // The rate comes by time once the speed is known; nothing is known of it here.
        assert_eq!(pair.server.value(CLIENT, 3, 2), None);
        // A minute later nothing is said again but status.
        let before = pair.passed;
        pair.pass(70 * S);
        assert_eq!((pair.passed, pair.is_active()), (before, true));
    }
}

#[test]
fn a_client_that_is_silent_is_lost_after_six_seconds_and_served_again() {
    let mut pair = Pair::new(4, (1, 0));
    pair.pass(12 * S);
    pair.server.take_news();
    pair.client.set_trouble(Trouble { is_silent: true, ..Trouble::default() });
    pair.pass(20 * S);
    let lost: Vec<_> = pair.server.take_news();
    assert!(lost.iter().any(|news| news.what == What::Lost && news.at.0 <= 18 * S), "{lost:?}");
    assert!(pair.server.pool(CLIENT).is_none());
    // What it says then is refused, and it begins anew: with the pool that is kept.
    pair.client.set_trouble(Trouble::default());
    pair.pass(60 * S);
    assert!(pair.is_active(), "{:?}", pair.client.connection());
}

#[test]
fn troubles_keep_it_from_serving() {
    let trouble = |trouble: Trouble| {
        let mut pair = Pair::new(4, (1, 0));
        pair.server.set_trouble(trouble);
        pair.pass(30 * S);
        pair
    };
    let lost = trouble(Trouble { is_lost: true, ..Trouble::default() });
    assert_eq!(lost.client.connection(), Connection::Alone);
    let busy = trouble(Trouble { is_busy: true, ..Trouble::default() });
    assert!(!busy.is_active() && busy.client.connection() != Connection::Alone);
    let mut refused = trouble(Trouble { refusal: Some(2), ..Trouble::default() });
    let Connection::Refused(why, _) = refused.client.connection() else {
        panic!("{:?}", refused.client.connection())
    };
    assert_eq!((why.code, why.at_transfer), (2, false));
    refused.server.set_trouble(Trouble::default());
    refused.pass(60 * S);
    assert!(refused.is_active());
    let silent = trouble(Trouble { is_silent: true, ..Trouble::default() });
    assert!(!silent.is_active());
}

/// What a server answers to one frame of process data from a client, and its news.
struct ByHand(TaskServer);

impl ByHand {
    fn new() -> Self {
        let mut server = TaskServer::new(wishes(&[true], 100.0));
        let mut out = Vec::new();
        server.open(SimTime::ZERO, &mut out);
        server.poll(SimTime(250 * MS), &mut out);
        let status = out.last().expect("its status");
        assert_eq!(
            (status.id.bits(), status.data()),
            (0x0CCB_FFF7, &[0xFE, 0xFF, 0xFF, 0xFF, 1, 0, 0, 0xFF][..])
        );
        Self(server)
    }

    fn hear(&mut self, id: u32, data: &[u8]) -> Vec<CanFrame> {
        let mut out = Vec::new();
        let frame = CanFrame::new(crate::frame::CanId::Extended(id), data).expect("a frame");
        self.0.handle(SimTime(300 * MS), &frame, &mut out);
        out
    }

    fn introduce(&mut self, source: u8) {
        let said = self.hear(0x1CFE_0D00 | u32::from(source), &[1, 255, 255, 255, 255, 255, 255, 255]);
        assert!(said.is_empty());
    }

    fn ask(&mut self, source: u8, data: [u8; 8]) -> Vec<Vec<u8>> {
        let said = self.hear(0x14CB_F700 | u32::from(source), &data);
        said.iter().map(|frame| frame.data().to_vec()).collect()
    }

    /// A whole message of process data, as the transport protocol hands it over.
    fn carry(&mut self, source: u8, bytes: Vec<u8>) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        let carried = Carried::Received { pgn: PROCESS_DATA.pgn, source, is_broadcast: false, bytes };
        self.0.carried(SimTime(400 * MS), carried, &mut out);
        out.iter().map(|frame| frame.data().to_vec()).collect()
    }
}

#[test]
fn bytes_are_answered_as_by_other_stacks() {
    let mut hand = ByHand::new();
    // Who did not introduce itself is refused, but told the version.
    let nack = vec![vec![1, 255, 255, 255, 0x55, 0x00, 0xCB, 0x00]];
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::REQUEST_STRUCTURE, &[])), nack);
    assert_eq!(hand.ask(0x55, [0, 255, 255, 255, 255, 255, 255, 255])[0][..2], [0x10, 4]);
    hand.introduce(0x55);
    assert_eq!(hand.ask(0x55, [0, 255, 255, 255, 255, 255, 255, 255])[1][0], 0, "it asks back");
    let none = vec![vec![0x11, 255, 255, 255, 255, 255, 255, 255]];
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::REQUEST_STRUCTURE, &[])), none);
    // Pools have a bound.
    let most = (MOST_BYTES as u32).to_le_bytes();
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::REQUEST_TRANSFER, &most))[0][..2], [0x51, 0]);
    let more = (MOST_BYTES as u32 + 1).to_le_bytes();
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::REQUEST_TRANSFER, &more))[0][..2], [0x51, 1]);
    // Nothing can be activated yet; a wrong pool neither.
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::ACTIVATE, &[0xFF]))[0][..2], [0x91, 4]);
    let mut pool = vec![0x61];
    pool.extend(implement(2).pool().bytes(Version::Fourth));
    let [l0, l1, ..] = (pool.len() as u32 - 1).to_le_bytes();
    let cut = pool[..pool.len() - 1].to_vec();
    assert_eq!(hand.carry(0x55, cut)[0][..2], [0x71, 0]);
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::ACTIVATE, &[0xFF]))[0][..2], [0x91, 1]);
    assert!(matches!(hand.0.take_news()[..], [News { what: What::Refused(_), client: 0x55, .. }]));
    // In two parts it comes as well.
    let (head, rest) = pool.split_at(100);
    let rest: Vec<u8> = [0x61].into_iter().chain(rest.iter().copied()).collect();
    assert_eq!(hand.carry(0x55, head.to_vec())[0], [0x71, 0, 99, 0, 0, 0, 255, 255]);
    assert_eq!(hand.carry(0x55, rest).len(), 1);
    let said = hand.ask(0x55, descriptor_message(descriptor::ACTIVATE, &[0xFF]));
    assert_eq!(said[0], [0x91, 0, 255, 255, 255, 255, 0, 255]);
    let sets = |ddi: u16, value: i32, element| {
        let command = command::VALUE;
        said.contains(&ProcessData { command, element, ddi, value }.bytes().to_vec())
    };
    assert!(sets(160, 1, 2) && sets(1, 1_000_000, 3) && sets(290, 0xFFFF_FFF1_u32 as i32, 2), "{said:02X?}");
    assert_eq!(hand.carry(0x55, pool)[0][..4], [0x71, 2, l0, l1], "one in use is not replaced");
    // Values of what its pool has are taken, others refused.
    let told = |element, ddi| ProcessData { command: command::VALUE, element, ddi, value: 1 }.bytes();
    assert!(hand.ask(0x55, told(2, 161)).is_empty());
    assert_eq!(hand.0.value(0x55, 2, 161), Some(1));
    assert_eq!(hand.ask(0x55, told(2, 999))[0][4], refusal::DDI);
    assert_eq!(hand.ask(0x55, told(4, 161))[0][4], refusal::DDI, "a section has properties only");
    assert_eq!(hand.ask(0x55, told(77, 161))[0][4], refusal::ELEMENT);
    // What is a server's to say is no client's.
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::ACTIVATED, &[0])), nack);
    // Deactivated, and deleted.
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::ACTIVATE, &[0]))[0][..2], [0x91, 0]);
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::REQUEST_STRUCTURE, &[])).len(), 1);
    assert!(hand.0.held_bytes() > 0);
    assert_eq!(hand.ask(0x55, descriptor_message(descriptor::DELETE, &[]))[0][..2], [0xB1, 0]);
    assert_eq!(hand.0.held_bytes(), 0);
    // Its language is told to who asks.
    let id = J1939Id { destination: 0xF7, ..REQUEST.id(0x55) };
    let said = hand.hear(id.id().bits(), &[0x0F, 0xFE, 0]);
    assert_eq!(said[0].data()[..2], *b"en");
}

#[test]
fn clients_are_bounded_and_an_address_that_another_has_is_no_longer_served() {
    let mut hand = ByHand::new();
    for source in 0x80..0x80 + MOST_CLIENTS as u8 + 1 {
        hand.introduce(source);
    }
    let last = 0x80 + MOST_CLIENTS as u8;
    assert_eq!(hand.ask(last, descriptor_message(descriptor::DELETE, &[]))[0][0], 1, "refused");
    let mut pool = vec![0x61];
    pool.extend(implement(2).pool().bytes(Version::Fourth));
    hand.carry(0x80, pool);
    hand.ask(0x80, descriptor_message(descriptor::ACTIVATE, &[0xFF]));
    assert!(hand.0.pool(0x80).is_some());
    let own = crate::isobus::implement::Implement::name().0.to_le_bytes();
    hand.hear(0x18EE_FF80, &own);
    assert!(hand.0.pool(0x80).is_some());
    hand.hear(0x18EE_FF80, &[9; 8]);
    assert!(hand.0.pool(0x80).is_none());
    assert_eq!(hand.0.take_news().last().map(|news| news.what.clone()), Some(What::Lost));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    /// Over a bus that loses up to 3 of 1000 frames, the client is served in the end, every wish reaches its sections, and wishes in their order.
    #[test]
    fn over_lost_frames_they_converge_and_sections_follow_in_order(
        seed in any::<u64>(), lost in 0_u64..3000, sections in 1_u16..6,
        wanted in prop::collection::vec(prop::collection::vec(any::<bool>(), 6), 1..6),
    ) {
        let mut pair = Pair::new(sections, (seed, lost));
        while !pair.is_active() {
            pair.pass(pair.at.0 + S);
            prop_assert!(pair.at.0 < 3600 * S, "not within an hour: {:?}", pair.client.connection());
        }
        let mut open = vec![false; usize::from(sections)];
        for (step, wish) in wanted.iter().enumerate() {
            let own: Vec<bool> = wish.iter().copied().take(sections.into()).collect();
            pair.wish(wishes(&own, 100.0 + step as f64));
            pair.pass(pair.at.0 + 30 * S);
            // A client that was lost meanwhile comes back.
            for _ in 0..3000 {
                if pair.is_active() && pair.server.next().is_none_or(|next| next > pair.at + Duration::from_secs(1)) {
                    break;
                }
                pair.pass(pair.at.0 + S);
            }
            let mut last = SimTime::ZERO;
            for order in pair.client.take_orders() {
                prop_assert!(order.at >= last, "orders go forth and back");
                last = order.at;
                open[usize::from(order.number) - 1] = order.is_open;
            }
            prop_assert_eq!(&open, &own, "step {}, lost {}", step, lost);
        }
    }

    /// Frames of noise, and frames of a client with bytes changed, never panic and never hold more than the bounds.
    #[test]
    fn noise_is_survived_within_bounds(
        frames in prop::collection::vec((0_usize..8, any::<u8>(), any::<[u8; 8]>(), 0_usize..9, any::<u32>()), 0..400),
        seed in any::<u64>(),
    ) {
        let mut hand = ByHand::new();
        let mut pool = vec![0x61];
        pool.extend(implement(2).pool().bytes(Version::Fourth));
        let mut chance = Chance(seed);
        let groups = [0x14CB_F700, 0x1CEC_F700, 0x1CEB_F700, 0x1CC8_F700, 0x1CC7_F700, 0x1CFE_0D00, 0x18EE_FF00];
        for (place, (kind, source, data, len, any)) in frames.into_iter().enumerate() {
            let source = source % 12;
            let id = groups.get(kind).map_or(any & 0x1FFF_FFFF, |group| group | u32::from(source));
            hand.hear(id, &data[..len.min(8)]);
            if place % 7 == 0 {
                let mut damaged = pool.clone();
                let at = chance.next() as usize % damaged.len();
                damaged[at] ^= chance.next() as u8;
                hand.carry(source, damaged);
                hand.ask(source, descriptor_message(descriptor::ACTIVATE, &[0xFF]));
            }
            if place % 50 == 0 {
                let next = hand.0.next().unwrap_or(SimTime::ZERO);
                hand.0.poll(next, &mut Vec::new());
            }
            prop_assert!(hand.0.peers.len() <= MOST_CLIENTS && hand.0.news.len() <= MOST_NEWS);
            prop_assert!(hand.0.held_bytes() <= MOST_CLIENTS * MOST_BYTES);
        }
    }
}
