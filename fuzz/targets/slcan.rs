//! Any bytes from a host to a Lawicel adapter, in any pieces: the same answers and frames, and a frame that was sent comes back as it was.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_bus::link::PortEvent;
use rowscan_bus::link::slcan::Adapter;
use rowscan_protocol::time::SimTime;

fn told(adapter: &mut Adapter, bytes: &[u8], piece: usize) -> (Vec<u8>, Vec<PortEvent>) {
    let (mut answers, mut heard) = (Vec::new(), Vec::new());
    bytes.chunks(piece).for_each(|bytes| adapter.handle_bytes(bytes, &mut answers, &mut heard));
    (answers, heard)
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    let mut adapter = Adapter::default();
    let (answers, heard) = told(&mut adapter, bytes, usize::from(piece).max(1));
    assert_eq!(told(&mut Adapter::default(), bytes, bytes.len().max(1)), (answers.clone(), heard.clone()));
    assert!(answers.len() <= 8 * bytes.len());
    for heard in heard {
        let PortEvent::Frame(frame) = heard else { continue };
        let (mut open, mut line) = (Adapter::default(), Vec::new());
        told(&mut open, b"S5\rO\r", 8);
        open.frame(SimTime::ZERO, &frame, &mut line);
        assert_eq!(told(&mut open, &line, 1).1, [PortEvent::Frame(frame)]);
    }
});
