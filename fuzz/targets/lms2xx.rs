//! LMS2xx: the frame decoder in any pieces, the device fed by anyone, and the host's client fed by anything.
#![no_main]

use core::time::Duration;

use libfuzzer_sys::fuzz_target;
use rowscan_protocol::device::Profile;
use rowscan_protocol::host::HostSession;
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::{Beams, Device, Options};
use rowscan_protocol::lms2xx::frame::{FrameDecoder, Listener, MAX_BODY, OVERHEAD, Received};
use rowscan_protocol::lms2xx::model::MODELS;
use rowscan_protocol::time::SimTime;

fuzz_target!(|data: &[u8]| {
    let Some((&[choice, cut], bytes)) = data.split_first_chunk::<2>() else { return };
    let pieces = bytes.chunks(usize::from(cut % 64) + 1);

    let mut decoder = FrameDecoder::new([Listener::Device, Listener::Host, Listener::Either][usize::from(choice % 3)]);
    let (mut framed, mut marks) = (0, 0);
    for piece in pieces.clone() {
        decoder.push(piece);
        while let Some(heard) = decoder.next_received() {
            match heard {
                Received::Frame(frame) => framed += frame.len as u64,
                Received::Ack | Received::Nak => marks += 1,
                Received::Broken | Received::CutOff { .. } => {}
            }
        }
        assert!(decoder.pending() <= 2 * (MAX_BODY + OVERHEAD));
    }
    decoder.finish();
    while let Some(heard) = decoder.next_received() {
        match heard {
            Received::Frame(frame) => framed += frame.len as u64,
            Received::Ack | Received::Nak => marks += 1,
            Received::Broken | Received::CutOff { .. } => {}
        }
    }
    // Every byte is part of a good frame, an acknowledgement, or counted.
    assert_eq!(framed + marks + decoder.counts().skipped_bytes, bytes.len() as u64);

    let profile = if choice & 4 == 0 { Profile::Bench } else { Profile::Field };
    let model = MODELS[usize::from(choice >> 3) % MODELS.len()];
    let mut device = Device::new(model, Options { profile, ..Options::default() });
    let mut now = SimTime::ZERO;
    for piece in pieces.clone() {
        now = now + Duration::from_millis(u64::from(cut));
        device.handle_bytes(now, Duration::from_micros(u64::from(cut)), piece);
        while let Some(sent) = device.poll_transmit(now) {
            assert!(sent.len() <= MAX_BODY + OVERHEAD);
            device.transmitted(now);
        }
        if let Some(sweep) = device.plan(now) {
            // A mean of 255 scans is the most turns a telegram has.
            assert!(sweep.turns <= 255 * 4);
            let turn = sweep.first;
            let range_mm = vec![1000; device.turn_beams(turn).len()];
            device.measure(sweep, turn, Beams { range_mm: &range_mm, remission: &range_mm });
            device.finish(now, sweep);
        }
    }

    let mut client = if choice & 1 == 0 { Lms2xxClient::listen() } else { Lms2xxClient::new(Lms2xxConfig::default()) };
    for (index, piece) in pieces.enumerate() {
        let now = Duration::from_millis(index as u64 * u64::from(cut));
        client.handle_timeout(now);
        client.handle_bytes(now, piece);
        while client.poll_transmit().is_some() {}
        while client.poll_event().is_some() {
            assert!(client.scan().echoes.iter().all(|echo| echo.range_m.len() == client.scan().beams.len()));
        }
    }
});
