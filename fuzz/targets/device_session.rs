//! Any bytes from a host, to any model, with mirror turns in between: every reply is one good frame that can be read.
//!
//! A run begins with a copy of a device made once, whose output range is narrow: what a run costs is the conversation, not beams.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::device::{Device, DialectPolicy, Identity, MeasuredLine, Session, scan_event};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::model::MODELS;
use rowscan_protocol::telegram::Telegram;
use rowscan_protocol::time::SimTime;

/// A byte that no command holds: the mirror turns.
const TURN: u8 = 0xFE;
const POLICIES: [DialectPolicy; 3] =
    [DialectPolicy::Auto, DialectPolicy::Strict(Dialect::A), DialectPolicy::Strict(Dialect::B)];
/// What makes a device cheap: two degrees about straight ahead, which a restart keeps.
const NARROW: [&str; 4] = [
    "sMN SetAccessMode 3 F4724744",
    "sMN SetAccessMode 3 6FD62C05",
    "sWN LMPoutputRange 1 +5000 +890000 +910000",
    "sMN mEEwriteall",
];

/// A device of every model.
static DEVICES: LazyLock<Vec<Device>> = LazyLock::new(|| {
    let narrow = |model| {
        let mut device = Device::new(model, Identity::default());
        let mut session = Session::new(DialectPolicy::Auto);
        let mut frames = Vec::new();
        NARROW.iter().for_each(|command| encode(Dialect::A, command.as_bytes(), &mut frames));
        session.handle_bytes(&mut device, SimTime(0), &frames, &mut Vec::new());
        assert_eq!(device.saves(), 1);
        let scan = device.measure(SimTime(0), &MeasuredLine { grid: device.mirror().beams, echoes: &[] }).expect("a scan");
        assert!(scan.channels16[0].values.len() < 20);
        device
    };
    MODELS.iter().copied().map(narrow).collect()
});

fuzz_target!(|data: &[u8]| {
    let [model, policy, bytes @ ..] = data else { return };
    let mut device = DEVICES[usize::from(*model) % DEVICES.len()].clone();
    let mut session = Session::new(POLICIES[usize::from(*policy) % POLICIES.len()]);
    let mut now = SimTime(20_000_000);
    let mut replies = Vec::new();
    let mut event = Vec::new();
    let mut decoder = FrameDecoder::new(Accept::Either, 64 * 1024);
    for piece in bytes.split_inclusive(|byte| *byte == TURN) {
        session.handle_bytes(&mut device, now, piece, &mut replies);
        now = SimTime(now.0 + 20_000_000);
        if let Some(scan) = device.measure(now, &MeasuredLine { grid: device.mirror().beams, echoes: &[] }) {
            event.clear();
            scan_event(session.dialect(), scan, &mut event);
        }
        for reply in replies.drain(..) {
            decoder.push(&reply.bytes);
            let frame = decoder.next_frame().expect("a whole frame");
            assert_eq!(frame.len, reply.bytes.len());
            Telegram::parse(frame.dialect, frame.payload).expect("a telegram");
        }
    }
});
