//! A scan that another program tells, as the telegram it stands for.

use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::wire::FixedText;
use rowscan_protocol::telegram::{Channel, Kind, LmdScandata, Variable, encode_frame};

/// What such a program tells of a scan.
pub(super) struct ToldScan {
    /// Its number.
    pub(super) counter: u16,
    /// When it was made, on the clock of who told it.
    pub(super) time_us: u32,
    /// Turns of the mirror a second, hundredths; 0 where they are not told.
    pub(super) frequency_centihz: u32,
    /// Device angle of the first beam.
    pub(super) start_deg: f64,
    /// From beam to beam, 1/10 000 of a degree.
    pub(super) step: u16,
    /// Millimetres that 1 in `distances` stands for.
    pub(super) scale: f64,
    /// 0: no echo.
    pub(super) distances: Vec<u16>,
    /// None at all, or one a beam.
    pub(super) remissions: Vec<u16>,
}

impl ToldScan {
    /// Its event of CoLa B.
    pub(super) fn event(self) -> Vec<u8> {
        let channel = |name: &[u8; 5], scale: f64, values: Vec<u16>| Channel {
            name: FixedText(*name),
            scale: scale as f32,
            offset: 0.0,
            start_angle: (self.start_deg * 10_000.0).round() as i32,
            step: self.step,
            values,
        };
        let mut channels16 = vec![channel(b"DIST1", self.scale, self.distances)];
        if !self.remissions.is_empty() {
            channels16.push(channel(b"RSSI1", 1.0, self.remissions));
        }
        let scan = LmdScandata {
            version: 1,
            device_number: 1,
            telegram_counter: self.counter,
            scan_counter: self.counter,
            scan_time_us: self.time_us,
            transmit_time_us: self.time_us,
            scan_frequency: self.frequency_centihz,
            channels16,
            ..LmdScandata::default()
        };
        let mut bytes = Vec::new();
        encode_frame(Dialect::B, Kind::Sn, LmdScandata::NAME, &scan, &mut bytes);
        bytes
    }
}
