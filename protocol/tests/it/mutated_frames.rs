//! Mutated frames for the LMS2xx device, its host's client, and the CoLa client: no panic, no endless reply, no scan whose ranges do not fit its
//! beams, and a device that answers a good request afterwards. A small number in every run; ten million by hand:
//! `cargo test -p rowscan-protocol --test mutated_frames -- --ignored --nocapture`.

use std::time::Duration;

use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::Profile;
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder as ColaDecoder, encode as encode_cola};
use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::{Beams, Device, Options, Start};
use rowscan_protocol::lms2xx::frame::{
    FrameDecoder, Listener, MAX_BODY, OVERHEAD, Received, checksum, encode,
};
use rowscan_protocol::lms2xx::listing::{LISTING, SentIn};
use rowscan_protocol::lms2xx::model;
use rowscan_protocol::random::{Rng, Stream};
use rowscan_protocol::time::SimTime;

/// Mutated frames that one session gets.
const A_SESSION: u64 = 40;

/// What came of it.
#[derive(Debug, Default, PartialEq, Eq)]
struct Figures {
    frames: u64,
    /// Good frames that the device or a client found among them.
    accepted: u64,
    /// Replies of the device, and scans that a client read.
    answers: u64,
}

fn below(random: &mut Stream, limit: usize) -> usize {
    (random.next_u64() % limit.max(1) as u64) as usize
}

/// One frame with a few changes; with its checksum made right again in every other case, so that what is behind it is reached.
fn mutate(random: &mut Stream, frame: &[u8], mend: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = frame.to_vec();
    for _ in 0..=below(random, 3) {
        let at = below(random, bytes.len());
        match below(random, 7) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << below(random, 8),
            1 if !bytes.is_empty() => bytes[at] = random.next_u64() as u8,
            2 => bytes.insert(at, random.next_u64() as u8),
            3 if !bytes.is_empty() => drop(bytes.remove(at)),
            4 => bytes.truncate(at),
            5 => {
                let piece = bytes[at..].to_vec();
                bytes.extend(piece);
            }
            _ if !bytes.is_empty() => bytes[at] = [0, 1, 2, 0x15, 0x7F, 0x80, 0xFF][below(random, 7)],
            _ => {}
        }
    }
    if below(random, 2) == 0 {
        mend(&mut bytes);
    }
    bytes
}

/// The length and the checksum of an LMS2xx frame.
fn mend_lms2xx(bytes: &mut Vec<u8>) {
    if bytes.len() <= OVERHEAD {
        return;
    }
    bytes.truncate(MAX_BODY + OVERHEAD);
    let end = bytes.len() - 2;
    bytes[0] = 0x02;
    bytes[1] &= 0x80;
    bytes[2..4].copy_from_slice(&((end - 4) as u16).to_le_bytes());
    let crc = checksum(&bytes[..end]);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
}

/// The length and the checksum of a CoLa B frame; a CoLa A one has neither.
fn mend_cola(bytes: &mut [u8]) {
    if bytes.len() <= 9 || bytes[0] != 0x02 || bytes[1] != 0x02 {
        return;
    }
    let end = bytes.len() - 1;
    bytes[..4].fill(0x02);
    bytes[4..8].copy_from_slice(&((end - 8) as u32).to_be_bytes());
    bytes[end] = bytes[8..end].iter().fold(0, |sum, byte| sum ^ byte);
}

fn device(random: &mut Stream, sent_in: SentIn) -> Device {
    let model = model::MODELS[below(random, model::MODELS.len())];
    let start = match sent_in {
        SentIn::Monitoring => Start::Streaming,
        SentIn::Installation => Start::Installation,
    };
    let profile = if below(random, 4) == 0 { Profile::Field } else { Profile::Bench };
    Device::new(model, Options { start, profile, ..Options::default() })
}

/// Sends what is due and makes a scan if one is wanted; the replies.
fn run(device: &mut Device, now: &mut SimTime, to: SimTime) -> Vec<Vec<u8>> {
    let mut replies = Vec::new();
    for turn in 0.. {
        assert!(turn < 10_000, "it answers for ever");
        device.handle_timeout(*now);
        while let Some(sent) = device.poll_transmit(*now) {
            assert!(sent.len() <= MAX_BODY + OVERHEAD);
            replies.push(sent);
            device.transmitted(*now);
        }
        if let Some(sweep) = device.plan(*now).filter(|sweep| sweep.done() <= to) {
            for turn in sweep.turns() {
                let range_mm = vec![1000 + turn as u16 % 50; device.turn_beams(turn).len()];
                device.measure(sweep, turn, Beams { range_mm: &range_mm, remission: &range_mm });
            }
            *now = (*now).max(sweep.done());
            device.finish(*now, sweep);
            continue;
        }
        match device.poll_timeout().filter(|due| *due <= to) {
            Some(due) => *now = (*now).max(due),
            None => break,
        }
    }
    *now = (*now).max(to);
    replies
}

fn answers_status(device: &mut Device, now: &mut SimTime) -> bool {
    // Past everything that it may be busy with, and silent: a power-on takes 15 s.
    for body in [&[0x20, 0x25][..], &[0x31]] {
        *now = *now + Duration::from_secs(20);
        run(device, now, *now);
        let mut frame = Vec::new();
        encode(0, body, &mut frame);
        device.handle_bytes(*now, Duration::from_micros(100), &frame);
        let end = *now + Duration::from_millis(20);
        let replies = run(device, now, end);
        if body == [0x31] {
            return replies.iter().any(|reply| reply.get(4) == Some(&0xB1));
        }
    }
    false
}

fn mutate_requests(seed: u64, sessions: u64) -> Figures {
    let mut random = Stream::keyed(seed, &[1]);
    let mut figures = Figures::default();
    for _ in 0..sessions {
        let first = &LISTING[below(&mut random, LISTING.len())];
        let mut device = device(&mut random, first.sent_in);
        let mut now = SimTime::ZERO;
        for _ in 0..A_SESSION {
            let line = &LISTING[below(&mut random, LISTING.len())];
            let mut frame = Vec::new();
            encode(0, line.example, &mut frame);
            let frame = mutate(&mut random, &frame, mend_lms2xx);
            for piece in frame.chunks(1 + below(&mut random, 40)) {
                device.handle_bytes(now, Duration::from_micros(100), piece);
            }
            let to = now + Duration::from_millis(below(&mut random, 60) as u64);
            figures.answers += run(&mut device, &mut now, to).len() as u64;
            figures.frames += 1;
        }
        figures.accepted += device.counts().frames;
        assert!(answers_status(&mut device, &mut now), "it is deaf: {device:?}");
    }
    figures
}

/// Replies of every model: of each line of the listing, and scans.
fn lms2xx_replies() -> Vec<Vec<u8>> {
    let mut replies = Vec::new();
    for line in LISTING {
        let model = model::MODELS.iter().find(|model| model.name == line.model).unwrap();
        let start = match line.sent_in {
            SentIn::Monitoring => Start::Idle,
            SentIn::Installation => Start::Installation,
        };
        let mut device = Device::new(model, Options { start, ..Options::default() });
        let (mut frame, mut now) = (Vec::new(), SimTime::ZERO);
        encode(0, line.example, &mut frame);
        device.handle_bytes(now, Duration::ZERO, &frame);
        replies.extend(run(&mut device, &mut now, SimTime(200_000_000)).into_iter().take(4));
    }
    replies
}

/// Takes what the client has to say; the frames it sends are whole ones.
fn drain(client: &mut dyn HostSession, figures: &mut Figures, is_frame: impl Fn(&[u8]) -> bool) {
    for turn in 0.. {
        assert!(turn < 10_000, "it goes on for ever");
        let sent = client.poll_transmit();
        if let Some(Transmit::Frame(frame)) = &sent {
            assert!(is_frame(frame));
        }
        let event = client.poll_event();
        if event == Some(HostEvent::Scan) {
            figures.answers += 1;
            let scan = client.scan();
            for echo in &scan.echoes {
                assert_eq!(echo.range_m.len(), scan.beams.len());
                assert!(echo.remission.is_empty() || echo.remission.len() == scan.beams.len());
            }
        }
        if sent.is_none() && event.is_none() {
            break;
        }
    }
}

fn mutate_replies(
    random: &mut Stream,
    client: &mut dyn HostSession,
    replies: &[Vec<u8>],
    mend: impl Fn(&mut Vec<u8>),
    is_frame: impl Fn(&[u8]) -> bool,
) -> Figures {
    let (mut figures, mut now) = (Figures::default(), Duration::ZERO);
    drain(client, &mut figures, &is_frame);
    for _ in 0..A_SESSION {
        let reply = &replies[below(random, replies.len())];
        // A good one now and then takes the client on.
        let bytes = if below(random, 3) == 0 { reply.clone() } else { mutate(random, reply, &mend) };
        for piece in bytes.chunks(1 + below(random, 900)) {
            client.handle_bytes(now, piece);
            drain(client, &mut figures, &is_frame);
        }
        figures.frames += 1;
        now += Duration::from_millis(below(random, 400) as u64);
        if client.poll_timeout().is_some_and(|due| due <= now) {
            client.handle_timeout(now);
            drain(client, &mut figures, &is_frame);
        }
    }
    client.stop(now);
    client.handle_end();
    drain(client, &mut figures, &is_frame);
    figures.accepted += client.counts().frames;
    figures
}

fn mutate_for_lms2xx_client(seed: u64, sessions: u64) -> Figures {
    let (mut random, replies) = (Stream::keyed(seed, &[2]), lms2xx_replies());
    let is_frame = |frame: &[u8]| {
        let mut decoder = FrameDecoder::new(Listener::Device);
        decoder.push(frame);
        matches!(decoder.next_received(), Some(Received::Frame(found)) if found.len == frame.len())
    };
    let mut figures = Figures::default();
    for session in 0..sessions {
        let remission = session % 4 == 1;
        let mut client = match session % 2 {
            0 => Lms2xxClient::listen(),
            _ => Lms2xxClient::new(Lms2xxConfig { remission, ..Lms2xxConfig::default() }),
        };
        figures.add(mutate_replies(&mut random, &mut client, &replies, mend_lms2xx, is_frame));
    }
    figures
}

/// What a CoLa scanner says during a start-up, in both dialects.
fn cola_replies(dialect: Dialect) -> Vec<Vec<u8>> {
    const SAID: [&str; 12] = [
        "sAN SetAccessMode 1",
        "sRA DeviceIdent 6 LMS111 8 V5.00.00",
        "sRA LMPscancfg 1388 1 1388 FFF92230 225510",
        "sRA LMPoutputRange 1 1388 FFF92230 225510",
        "sWA LMDscandatacfg",
        "sAN LMCstartmeas 0",
        "sAN Run 1",
        "sRA STlms 7 0 8 00:00:00 8 01.01.07 0 0 0",
        "sRA SCdevicestate 1",
        "sEA LMDscandata 1",
        "sFA 3",
        "sSN LMDscandata 1 1 89A27F 0 0 343 347 27477BA9 2747813B 0 0 7 0 0 1388 168 0 1 DIST1 3F800000 00000000 186A0 1388 5 8AC 8AD 8AE 8AF 0 0 0 0 0 0 0",
    ];
    let frame = |text: &&str| {
        let mut frame = Vec::new();
        encode_cola(dialect, text.as_bytes(), &mut frame);
        frame
    };
    // As many scans as of all the rest.
    let scans = SAID.iter().rev().take(1).cycle().take(SAID.len());
    SAID.iter().chain(scans).map(frame).collect()
}

fn mutate_for_cola_client(seed: u64, sessions: u64) -> Figures {
    let mut random = Stream::keyed(seed, &[3]);
    let replies = [Dialect::A, Dialect::B].map(cola_replies);
    let is_frame = |frame: &[u8]| {
        let mut decoder = ColaDecoder::new(Accept::Either, 4096);
        decoder.push(frame);
        decoder.next_frame().is_some_and(|found| found.len == frame.len())
    };
    let mut figures = Figures::default();
    for session in 0..sessions {
        let (dialect, replies) = match session % 2 {
            0 => (Dialect::A, &replies[0]),
            _ => (Dialect::B, &replies[1]),
        };
        let mut client = match session % 3 {
            0 => ColaClient::listen(4096),
            _ => ColaClient::new(ColaConfig::default(), dialect),
        };
        figures.add(mutate_replies(&mut random, &mut client, replies, |bytes| mend_cola(bytes), is_frame));
    }
    figures
}

impl Figures {
    fn add(&mut self, other: Self) {
        self.frames += other.frames;
        self.accepted += other.accepted;
        self.answers += other.answers;
    }
}

/// The same number of frames for each of the three.
fn mutate_everywhere(seed: u64, frames: u64) -> [Figures; 3] {
    let sessions = frames.div_ceil(3 * A_SESSION);
    [
        mutate_requests(seed, sessions),
        mutate_for_lms2xx_client(seed, sessions),
        mutate_for_cola_client(seed, sessions),
    ]
}

#[test]
fn mutated_frames_do_no_harm() {
    let figures = mutate_everywhere(1, 6_000);
    for figures in &figures {
        // Some are good, and some of those have an effect: it is not only the decoder that is looked at.
        assert!(figures.frames >= 2_000 && figures.accepted > 200 && figures.answers > 50, "{figures:?}");
    }
    assert_eq!(figures, mutate_everywhere(1, 6_000), "the same seed, the same figures");
}

#[test]
#[ignore = "ten million frames take minutes: run by hand"]
fn ten_million_mutated_frames_do_no_harm() {
    let figures = mutate_everywhere(2, 10_000_000);
    for (who, figures) in ["LMS2xx device", "LMS2xx client", "CoLa client"].iter().zip(&figures) {
        eprintln!("{who}: {figures:?}");
    }
    assert!(figures.iter().map(|figures| figures.frames).sum::<u64>() >= 10_000_000);
}
