//! Any bytes from a socketcand client, in any pieces: the same answers and frames, and every answer is a whole element.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rowscan_bus::link::PortEvent;
use rowscan_bus::link::socketcand::Conversation;

fn told(bytes: &[u8], piece: usize) -> (String, Vec<PortEvent>) {
    let (mut conversation, mut answers, mut heard) = (Conversation::default(), String::new(), Vec::new());
    bytes.chunks(piece).for_each(|bytes| conversation.handle_bytes(bytes, &mut answers, &mut heard));
    (answers, heard)
}

fuzz_target!(|data: &[u8]| {
    let Some((&piece, bytes)) = data.split_first() else { return };
    let (answers, heard) = told(bytes, usize::from(piece).max(1));
    assert_eq!(told(bytes, bytes.len().max(1)), (answers.clone(), heard.clone()));
    assert_eq!(answers.matches('<').count(), answers.matches('>').count());
    assert!(heard.iter().all(|heard| matches!(heard, PortEvent::Opened | PortEvent::Frame(_) | PortEvent::Refused(_))));
});
