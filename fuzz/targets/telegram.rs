//! Shared by the telegram targets: any payload is read or refused; a scan that is read is written and read again the same.

use rowscan_protocol::device::command;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::scan::Scan;
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram, encode};

pub fn read(dialect: Dialect, payload: &[u8]) {
    let Ok(telegram) = Telegram::parse(dialect, payload) else { return };
    let _ = command::visit(&telegram, &mut ());
    let _ = telegram.refusal();
    // Whatever the name says: as a scan, the telegram with the most structure.
    let mut scan = LmdScandata::default();
    if telegram.args.decode_into(&mut scan).is_err() {
        return;
    }
    let _ = scan.to_scan_into(&mut Scan::default());
    let mut again = Vec::new();
    encode(dialect, Kind::Sn, "LMDscandata", &scan, &mut again);
    let reread: LmdScandata =
        Telegram::parse(dialect, &again).expect("a telegram").args.decode().expect("what was written");
    // Not-a-number differs from itself, and a text form has its own characters: compare what is written.
    let mut once_more = Vec::new();
    encode(dialect, Kind::Sn, "LMDscandata", &reread, &mut once_more);
    assert_eq!(again, once_more);
}
