//! Any bytes from a host, to any model, with mirror turns in between: every reply is one good frame that can be read.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::device::{Device, DialectPolicy, Identity, MeasuredLine, Session, scan_event};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
use rowscan_protocol::model::MODELS;
use rowscan_protocol::telegram::Telegram;
use rowscan_protocol::time::SimTime;

/// A byte that no command holds: the mirror turns.
const TURN: u8 = 0xFE;
const POLICIES: [DialectPolicy; 3] =
    [DialectPolicy::Auto, DialectPolicy::Strict(Dialect::A), DialectPolicy::Strict(Dialect::B)];

fuzz_target!(|data: &[u8]| {
    let [model, policy, bytes @ ..] = data else { return };
    let mut device = Device::new(MODELS[usize::from(*model) % MODELS.len()], Identity::default());
    let mut session = Session::new(POLICIES[usize::from(*policy) % POLICIES.len()]);
    let mut now = SimTime(0);
    let mut replies = Vec::new();
    let mut event = Vec::new();
    for piece in bytes.split_inclusive(|byte| *byte == TURN) {
        session.handle_bytes(&mut device, now, piece, &mut replies);
        now = SimTime(now.0 + 20_000_000);
        if let Some(scan) = device.measure(now, &MeasuredLine { echoes: &[] }) {
            event.clear();
            scan_event(session.dialect(), scan, &mut event);
        }
        for reply in replies.drain(..) {
            let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
            decoder.push(&reply.bytes);
            let frame = decoder.next_frame().expect("a whole frame");
            assert_eq!(frame.len, reply.bytes.len());
            Telegram::parse(frame.dialect, frame.payload).expect("a telegram");
        }
    }
});
