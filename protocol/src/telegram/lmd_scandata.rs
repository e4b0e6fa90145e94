//! `LMDscandata`: one mirror turn's measured values. `LMDscandatamon` (SOPAS ET's monitor) has the same body.

use alloc::vec::Vec;

use super::Variable;
use super::wire::{Fields, FixedText, Reader, ShortString, WireError, Word, Writer, fields};
use crate::angle::BeamGrid;
use crate::optics::DAZZLED_MM;
use crate::scan::{DAZZLED, EncoderReading, NO_ECHO, Scan};
use crate::validity::{
    DeviceStatus, LARGEST_ANGLE_DEG, LARGEST_OFFSET_MM, LARGEST_SCALE, LEAST_ANGLE_DEG, LEAST_SCALE,
    ScanFault,
};
use crate::visit::{Group, Value, Visitor};

/// The monitor event with the same body.
pub const MONITOR: &str = "LMDscandatamon";

fields! {
    /// One mirror turn as the wire has it (telegram listing, "LMDscandata").
    pub struct LmdScandata {
        /// Telegram version: 1, or 0 on an LMS511 V1.80.
        pub version: u16,
        /// Device number, mostly 1.
        pub device_number: u16,
        /// Serial number.
        pub serial_number: u32,
        /// Device status; `[0, 0]` is ok. Second byte: 1 an error, 2 a contamination warning, 4 a contamination error. First byte: 1 while the laser is
        /// off, in the first scans after a start.
        pub device_status: [u8; 2],
        /// Counts telegrams; wraps.
        pub telegram_counter: u16,
        /// Counts mirror turns; wraps.
        pub scan_counter: u16,
        /// µs since power-up at the mirror's zero index; wraps after 71.6 minutes.
        pub scan_time_us: u32 ["µs"],
        /// µs since power-up when the telegram was sent; wraps.
        pub transmit_time_us: u32 ["µs"],
        /// Digital inputs, bit 0 of the first byte is input 1.
        pub inputs: [u8; 2],
        /// Digital outputs, bit 0 of the first byte is output 1.
        pub outputs: [u8; 2],
        /// Layer on scanners with several: 1/100°, negative upwards; else 0.
        pub layer_angle: i16 ["1/100°"],
        /// Mirror turns, 1/100 Hz.
        pub scan_frequency: u32 ["1/100 Hz"],
        /// Shots, 100 Hz; on newer MRS1000 firmware Hz.
        pub measurement_frequency: u32 ["100 Hz"],
        /// Encoders, 0 to 3.
        pub encoders: Vec<Encoder>,
        /// Channels of 16-bit values: DIST1…DIST5, RSSI1…, ANGL1.
        pub channels16: Vec<Channel<u16>>,
        /// Channels of 8-bit values: RSSI1….
        pub channels8: Vec<Channel<u8>>,
        /// Position block.
        pub position: Option<Position>,
        /// Device name.
        pub name: Option<ShortString>,
        /// Comment.
        pub comment: Option<ShortString>,
        /// Device date and time.
        pub time: Option<DateTime>,
        /// Event block; the order of its fields is not verified on a device.
        pub event: Option<EventInfo>,
    }

    /// One encoder's reading.
    #[derive(Copy, Eq)]
    pub struct Encoder {
        /// Ticks; wraps.
        pub position: u32 ["ticks"],
        /// Speed; the listing says ticks a millimetre, which is no speed. The unit is not verified; see
        /// [`EncoderSpeed`](crate::device::EncoderSpeed).
        pub speed: u16,
    }

    /// Position block.
    #[derive(Copy)]
    pub struct Position {
        /// Along X.
        pub x: f32,
        /// Along Y.
        pub y: f32,
        /// Along Z.
        pub z: f32,
        /// About X.
        pub rotation_x: f32,
        /// About Y.
        pub rotation_y: f32,
        /// About Z.
        pub rotation_z: f32,
        /// 0 none, 1 pitch, 2 roll, 3 free.
        pub rotation_type: u8,
    }

    /// The device's calendar; a clock that was not set starts at 1970-01-01 00:00 with power-up.
    #[derive(Copy, Eq)]
    pub struct DateTime {
        /// Year.
        pub year: u16,
        /// 1..=12.
        pub month: u8,
        /// 1..=31.
        pub day: u8,
        /// 0..=23.
        pub hour: u8,
        /// 0..=59.
        pub minute: u8,
        /// 0..=59.
        pub second: u8,
        /// 0..=999999.
        pub microsecond: u32 ["µs"],
    }

    /// Event block.
    #[derive(Copy, Eq)]
    pub struct EventInfo {
        /// What happened, mostly `FDIN`.
        pub kind: FixedText<4>,
        /// Encoder ticks.
        pub encoder_position: u32 ["ticks"],
        /// µs since power-up.
        pub time_us: u32 ["µs"],
        /// Device angle, 1/10000°.
        pub angle: i32 ["1/10000°"],
    }
}

impl Variable for LmdScandata {
    const NAME: &'static str = "LMDscandata";
}

/// One channel: a value a beam.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel<T> {
    /// What it holds: `DIST1`, `RSSI1`, … Unknown names are kept.
    pub name: FixedText<5>,
    /// Value = raw × scale + offset; millimetres for DIST.
    pub scale: f32,
    /// Value = raw × scale + offset.
    pub offset: f32,
    /// Device angle of the first value, 1/10000°.
    pub start_angle: i32,
    /// Angle between values, 1/10000°.
    pub step: u16,
    /// The raw values.
    pub values: Vec<T>,
}

impl<T: Word> Fields for Channel<T> {
    const IS_STRUCT: bool = true;

    fn read(&mut self, reader: &mut Reader<'_>) -> Result<(), WireError> {
        self.name.read(reader)?;
        self.scale.read(reader)?;
        self.offset.read(reader)?;
        self.start_angle.read(reader)?;
        self.step.read(reader)?;
        reader.counted(&mut self.values)
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.name.write(writer);
        self.scale.write(writer);
        self.offset.write(writer);
        self.start_angle.write(writer);
        self.step.write(writer);
        writer.counted(&self.values);
    }

    fn visit(&self, visitor: &mut dyn Visitor) {
        visitor.begin(Group::Struct);
        visitor.field("name", None);
        self.name.visit(visitor);
        visitor.field("scale", None);
        self.scale.visit(visitor);
        visitor.field("offset", None);
        self.offset.visit(visitor);
        visitor.field("start_angle", Some("1/10000°"));
        self.start_angle.visit(visitor);
        visitor.field("step", Some("1/10000°"));
        self.step.visit(visitor);
        visitor.field("values", None);
        visitor.begin(Group::List);
        self.values.iter().for_each(|&raw| visitor.value(Value::Integer(raw.into().into())));
        visitor.end();
        visitor.end();
    }
}

/// Raw distances up to this are no distances: 0 is no echo, 1..=15 are error codes (TiM scanners send 2 for no echo).
const LAST_ERROR_CODE: u16 = 15;
/// Millimetres a metre.
const MM_PER_M: f64 = 1000.0;
/// Frequencies are in hundredths.
const CENTI: f64 = 100.0;

impl LmdScandata {
    /// True if the first of its distances are of the first echo that its device sends.
    pub fn begins_with_first(&self) -> bool {
        let mut distances = self.channels16.iter().filter(|channel| channel.name.0.starts_with(b"DIST"));
        distances.next().is_some_and(|channel| channel.name.0 == *b"DIST1")
    }

    /// What the telegram means, into `scan`, whose buffers are reused.
    ///
    /// Millimetres become metres here and nowhere else: range = (raw × scale + offset) / 1000. Remission comes from the RSSI
    /// channel with the distance channel's digit, whether 8 or 16 bits wide.
    ///
    /// A telegram whose numbers cannot be ranges (scale factor 0, an angular step of 0, beams that point nowhere) is refused, and `scan` is left
    /// as it was.
    pub fn to_scan_into(&self, scan: &mut Scan) -> Result<(), ScanFault> {
        let distances = || self.channels16.iter().filter(|channel| channel.name.0.starts_with(b"DIST"));
        let Some(first) = distances().next() else {
            return Err(ScanFault::NoDistance { channels: self.channels16.len() + self.channels8.len() });
        };
        distances().try_for_each(Channel::check)?;
        scan.status = DeviceStatus::of_scandata(self.device_status);
        scan.layer_centideg = self.layer_angle;
        scan.serial_number = self.serial_number;
        scan.telegram_counter = self.telegram_counter;
        scan.scan_counter = self.scan_counter;
        scan.scan_time_us = self.scan_time_us;
        scan.transmit_time_us = self.transmit_time_us;
        scan.scan_frequency_hz = f64::from(self.scan_frequency) / CENTI;
        scan.beams.start = first.start_angle;
        scan.beams.step = first.step;
        scan.beams.count = first.values.len().min(usize::from(u16::MAX)) as u16;
        let beams = scan.beams.len();
        scan.echoes.resize_with(distances().count(), Default::default);
        for (echo, distance) in scan.echoes.iter_mut().zip(distances()) {
            distance.ranges_into(&mut echo.range_m);
            echo.range_m.resize(beams, NO_ECHO);
            echo.remission.clear();
            if self.remission_into(distance.name, &mut echo.remission) {
                echo.remission.resize(beams, 0);
            }
        }
        scan.encoders.clear();
        let readings =
            self.encoders.iter().map(|e| EncoderReading { position_ticks: e.position, speed: e.speed });
        scan.encoders.extend(readings);
        scan.device_name.clear();
        scan.device_name.push_str(self.name.as_deref().unwrap_or_default());
        Ok(())
    }

    /// Appends the remission that belongs to a distance channel; false if there is none.
    fn remission_into(&self, distance: FixedText<5>, remission: &mut Vec<u16>) -> bool {
        let name = remission_of(distance);
        if let Some(channel) = self.channels16.iter().find(|channel| channel.name == name) {
            remission.extend_from_slice(&channel.values);
            return true;
        }
        let Some(channel) = self.channels8.iter().find(|channel| channel.name == name) else {
            return false;
        };
        remission.extend(channel.values.iter().copied().map(u16::from));
        true
    }
}

/// Name of the channel with the beams' own angles, of LMS1000 and newer MRS1000: start + i · step + (raw × scale + offset), 1/10000°.
pub const ANGLES: FixedText<5> = FixedText(*b"ANGL1");
/// What stands for no correction there; a public client takes no table whose offset is 0.
const NO_CORRECTION: u16 = 1 << 15;

/// Fills a channel with the angles of these beams, none of them corrected.
pub(crate) fn fill_angles(channel: &mut Channel<u16>, beams: BeamGrid) {
    channel.name = ANGLES;
    channel.scale = 1.0;
    channel.offset = -f32::from(NO_CORRECTION);
    channel.start_angle = beams.start;
    channel.step = beams.step;
    channel.values.clear();
    channel.values.resize(beams.len(), NO_CORRECTION);
}

/// `DISTn` to `RSSIn`.
fn remission_of(distance: FixedText<5>) -> FixedText<5> {
    let [.., digit] = distance.0;
    let [r, s, s2, i] = *b"RSSI";
    FixedText([r, s, s2, i, digit])
}

impl Channel<u16> {
    /// Refuses numbers that no ranges can be made of.
    fn check(&self) -> Result<(), ScanFault> {
        if !(LEAST_SCALE..=LARGEST_SCALE).contains(&self.scale) {
            return Err(ScanFault::ScaleFactor { value: self.scale });
        }
        if !(-LARGEST_OFFSET_MM..=LARGEST_OFFSET_MM).contains(&self.offset) {
            return Err(ScanFault::ScaleOffset { value: self.offset });
        }
        let count = self.values.len().min(usize::from(u16::MAX)) as u16;
        let Some(last) = count.checked_sub(1) else { return Err(ScanFault::NoBeams) };
        if self.step == 0 && last > 0 {
            return Err(ScanFault::AngularStep);
        }
        let grid = BeamGrid { start: self.start_angle, step: self.step, count };
        let (start_deg, stop_deg) = (grid.angle_deg(0), grid.angle_deg(usize::from(last)));
        // A full turn may state its first beam again as its last.
        let turn = stop_deg - start_deg <= 360.0 + grid.step_deg();
        if start_deg < LEAST_ANGLE_DEG || stop_deg > LARGEST_ANGLE_DEG || !turn {
            return Err(ScanFault::Field { start_deg, stop_deg });
        }
        Ok(())
    }

    fn ranges_into(&self, range_m: &mut Vec<f64>) {
        let scale = f64::from(self.scale);
        let offset = f64::from(self.offset);
        range_m.clear();
        range_m.extend(self.values.iter().map(|&raw| {
            let range = (f64::from(raw) * scale + offset) / MM_PER_M;
            match raw {
                DAZZLED_MM => DAZZLED,
                ..=LAST_ERROR_CODE => NO_ECHO,
                _ if range >= 0.0 => range,
                _ => NO_ECHO,
            }
        }));
    }
}
