//! A mirror turn as Compact telegrams: one a segment, due when its last beam is measured; readings of IMU and encoder beside them.

use alloc::vec;
use alloc::vec::Vec;
use core::net::SocketAddrV4;
use core::time::Duration;

use super::clock::Clock;
use super::measured::MeasuredLine;
use super::random::Stage;
use super::state::Device;
use super::variable::{Stored, Value};
use crate::compact::{
    Beams, Encoder, Imu, Module, Modules, PerLine, REFLECTOR, ScanTelegram, Shape, TO_COLA, Telegram,
    theta_code,
};
use crate::model::{CompactOutput, ScanMode};
use crate::telegram::fr_echo_filter;
use crate::time::SimTime;

/// A beam this near to the edge of the angle filter is inside, degrees: clients compute in radians.
const EDGE_TOLERANCE_DEG: f64 = 1e-3;
/// The guide's value of a reflector on the 8-bit scale.
const REFLECTS: u16 = 254;
/// ScanDataFormat: Compact.
const COMPACT: i64 = 2;
/// ScanDataFormat: LMDscandata.
const LMD_SCANDATA: i64 = 3;
/// Protocol of a destination: UDP.
const UDP: i64 = 1;

/// What a datagram holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stream {
    /// A segment of a turn.
    Scan,
    /// Attitude and motion.
    Imu,
    /// The encoder's reading.
    Encoder,
}

/// Why nothing of a stream is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Silent {
    /// It is off, or the device does not measure, or it has no such stream.
    Off,
    /// The format or the protocol is one that is not emulated, or goes out otherwise.
    Otherwise,
}

/// A telegram that waits for its instant.
#[derive(Clone, Debug)]
pub struct Datagram {
    /// When it is sent.
    pub at: SimTime,
    /// What it holds.
    pub stream: Stream,
    /// The number of the turn that ends with it.
    pub ends_turn: Option<u64>,
    telegram: Telegram,
}

impl Stream {
    /// All, in the order in which those of one instant are sent.
    pub const ALL: [Self; 3] = [Self::Scan, Self::Imu, Self::Encoder];

    /// The names of the variables that switch it on and direct it.
    pub fn variables(self) -> [&'static str; 2] {
        match self {
            Self::Scan => ["ScanDataEnable", "ScanDataEthSettings"],
            Self::Imu => ["ImuDataEnable", "ImuDataEthSettings"],
            Self::Encoder => ["EncoderDataEnable", "EncoderDataEthSettings"],
        }
    }

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scan => "scan",
            Self::Imu => "IMU",
            Self::Encoder => "encoder",
        }
    }
}

impl Device {
    /// Where telegrams of this stream go.
    ///
    /// # Errors
    /// None are sent.
    pub fn destination(&self, stream: Stream) -> Result<SocketAddrV4, Silent> {
        let compact = self.model.compact.ok_or(Silent::Off)?;
        let has = match stream {
            Stream::Scan => true,
            Stream::Imu => compact.imu_period_us.is_some(),
            Stream::Encoder => compact.encoder,
        };
        let [enable, place] = stream.variables();
        let variables = &self.settings.variables;
        if !has || variables.number(enable, 0) == 0 || !self.is_measuring() {
            return Err(Silent::Off);
        }
        let is_compact = stream != Stream::Scan || variables.number("ScanDataFormat", 0) == COMPACT;
        match variables.named(place) {
            [Value::Number(UDP), Value::Address(address), Value::Number(port)] if is_compact => {
                Ok(SocketAddrV4::new((*address).into(), *port as u16))
            }
            _ => Err(Silent::Otherwise),
        }
    }

    /// Directs all streams to this address as the operator wants it, kept over restarts: scans to its port, IMU and encoder to theirs.
    pub fn direct(&mut self, to: SocketAddrV4) {
        for stream in Stream::ALL {
            let [_, place] = stream.variables();
            for variables in [&mut self.settings.variables, &mut self.saved.variables] {
                let mut value = variables.named(place).to_vec();
                if let [_, address, port] = value.as_mut_slice() {
                    *address = Value::Address(to.ip().octets());
                    if stream == Stream::Scan {
                        *port = Value::Number(to.port().into());
                    }
                }
                variables.set_named(place, value);
            }
        }
    }

    /// Switches scans on, as a client does with ScanDataEnable.
    pub fn enable_streaming(&mut self) {
        self.settings.variables.set_named("ScanDataEnable", vec![Value::Number(1)]);
    }

    /// Whether subscribers get LMDscandata: with Compact output, in format 3 only.
    pub fn sends_scan_events(&self) -> bool {
        self.model.compact.is_none() || self.settings.variables.number("ScanDataFormat", 0) == LMD_SCANDATA
    }

    /// From one reading of the IMU to the next; none where it has none.
    pub fn imu_period(&self) -> Option<Duration> {
        self.model.compact?.imu_period_us.map(|us| Duration::from_micros(us.into()))
    }

    /// Appends the telegrams of the turn that [`Device::measure`] counted last and whose first beam was at `at`.
    pub fn segments(&mut self, at: SimTime, line: &MeasuredLine<'_>, out: &mut Vec<Datagram>) {
        let Some(compact) = self.model.compact.filter(|_| self.destination(Stream::Scan).is_ok()) else {
            return;
        };
        let frame = self.counters.turns.saturating_sub(1);
        if !frame.is_multiple_of(self.turn_interval()) {
            return;
        }
        let seen = Seen::new(&self.settings.variables);
        let turn = Turn { device: self, compact, line, frame, at, seen };
        let before = out.len();
        out.extend(turn.datagrams());
        if let Some(last) = out.get_mut(before..).and_then(<[Datagram]>::last_mut) {
            last.ends_turn = Some(frame);
        }
    }

    /// Turns from one that is sent as telegrams to the next.
    pub fn turn_interval(&self) -> u64 {
        let variables = &self.settings.variables;
        match variables.number("LFPintervalFilter", 0) {
            1 => variables.number("LFPintervalFilter", 1).max(1) as u64,
            _ => 1,
        }
    }

    /// The reading of the IMU at `at`; `imu` without its time.
    pub fn imu(&self, at: SimTime, imu: Imu) -> Datagram {
        let telegram = Telegram::Imu(Imu { time_us: self.uptime_us(at), ..imu });
        Datagram { at, stream: Stream::Imu, ends_turn: None, telegram }
    }

    /// The encoder's reading at the turn that was measured last, which began at `at`: ticks so far, and speed in mm/s.
    pub fn encoder_telegram(&mut self, at: SimTime, ticks: f64, speed_mm_s: f32) -> Datagram {
        let (tick, time_us) = (ticks as i64 as u32, self.uptime_us(at));
        let (before, before_us) = core::mem::replace(&mut self.counters.encoder_before, (tick, time_us));
        let telegram = Telegram::Encoder(Encoder {
            // Recorded ones are sent at whole milliseconds.
            transmit_time_us: time_us / 1000 * 1000,
            sender_id: self.identity.serial_number,
            frame_number: self.counters.turns.saturating_sub(1),
            tick,
            tick_ref1: before,
            tick_ref2: tick,
            speed: speed_mm_s,
            tick_time_us: time_us,
            ref1_time_us: before_us,
            ref2_time_us: time_us,
            ..Encoder::default()
        });
        Datagram { at, stream: Stream::Encoder, ends_turn: None, telegram }
    }

    /// Numbers and encodes a telegram whose instant has come: where it goes, and its bytes. None where its stream has been switched off meanwhile.
    pub fn send(&mut self, datagram: Datagram) -> Option<(SocketAddrV4, Vec<u8>)> {
        let to = self.destination(datagram.stream).ok()?;
        let Datagram { mut telegram, .. } = datagram;
        match &mut telegram {
            Telegram::Scan(scan) => {
                self.counters.scan_telegrams += 1;
                scan.telegram_counter = self.counters.scan_telegrams;
            }
            Telegram::Encoder(encoder) => {
                self.counters.encoder_telegrams += 1;
                encoder.telegram_counter = self.counters.encoder_telegrams;
            }
            Telegram::Imu(_) => {}
        }
        let mut bytes = Vec::new();
        // What is made here is laid out as it says.
        telegram.encode(&mut bytes).ok()?;
        Some((to, bytes))
    }
}

/// A turn on its way into telegrams.
struct Turn<'a> {
    device: &'a Device,
    compact: &'static CompactOutput,
    line: &'a MeasuredLine<'a>,
    frame: u64,
    at: SimTime,
    seen: Seen,
}

impl Turn<'_> {
    fn datagrams(&self) -> impl Iterator<Item = Datagram> + '_ {
        let mode: ScanMode = self.device.settings.mode;
        let width_deg = f64::from(self.compact.segment_at(mode.frequency_centihz)) / 10_000.0;
        let beams = ((width_deg / self.line.grid.step_deg() + 0.5) as usize).max(2);
        let count = self.line.grid.len();
        let begins = (0..count).step_by(beams).filter(move |&first| first == 0 || count - first > 1);
        begins.enumerate().filter_map(move |(number, first)| {
            let end = first + beams;
            // No module has a single beam: clients divide by the number of steps.
            let end = if count.saturating_sub(end) <= 1 { count } else { end };
            self.segment(number as u64, first..end)
        })
    }

    fn segment(&self, number: u64, beams: core::ops::Range<usize>) -> Option<Datagram> {
        let Self { device, line, .. } = self;
        let theta_deg = |beam: usize| line.grid.angle_deg(beam) - f64::from(TO_COLA) / 10_000.0;
        if !beams.clone().any(|beam| self.seen.sees(beam, theta_deg(beam))) {
            return None;
        }
        let last = beams.end.saturating_sub(1);
        let (start, stop) = (self.instant(beams.start), self.instant(last));
        let key = self.frame.wrapping_mul(64).wrapping_add(number);
        let clock = &device.clock;
        let within_us = self.compact.jitter_us.value;
        let start_us = stamp(device.uptime_us(start), clock.off_even_us(Stage::SegmentStart, key, within_us));
        let stop_us = stamp(device.uptime_us(stop), clock.off_even_us(Stage::SegmentStop, key, within_us));
        let echoes = device.compact_echoes();
        let rad = |beam| theta_deg(beam).to_radians();
        let module = Module {
            segment_counter: number,
            frame_number: self.frame,
            sender_id: device.identity.serial_number,
            shape: Shape { lines: 1, beams: beams.len() as u32, echoes: echoes as u32 },
            time_start_us: PerLine(vec![start_us]),
            time_stop_us: PerLine(vec![stop_us]),
            phi_rad: PerLine(vec![0.0]),
            theta_start_rad: PerLine(vec![rad(beams.start) as f32]),
            theta_stop_rad: PerLine(vec![rad(last) as f32]),
            availability: 1,
            beams: self.beams(beams, echoes, theta_deg),
            ..Module::default()
        };
        let scan = ScanTelegram {
            transmit_time_us: stamp(start_us, clock.transmit_off_us(self.compact, key)),
            modules: Modules(vec![module]),
            ..ScanTelegram::default()
        };
        let telegram = Telegram::Scan(scan.seal());
        Some(Datagram { at: stop, stream: Stream::Scan, ends_turn: None, telegram })
    }

    fn beams(
        &self,
        range: core::ops::Range<usize>,
        echoes: usize,
        theta_deg: impl Fn(usize) -> f64,
    ) -> Beams {
        let mut beams = Beams::default();
        for beam in range {
            let deg = theta_deg(beam);
            let is_blind = !self.device.sees_all() && self.device.is_blind_at(self.line.grid.angle_deg(beam));
            let is_seen = !is_blind && self.seen.sees(beam, deg);
            let mut strength = 0;
            for echo in 0..echoes {
                let (range_mm, remission) = self.echo(echo, beam).filter(|_| is_seen).unwrap_or_default();
                let eight_bits = remission >> 8;
                if range_mm > 0 {
                    strength = eight_bits;
                }
                beams.distance.push(range_mm);
                beams.rssi.push(if range_mm > 0 { eight_bits * 257 } else { 0 });
            }
            beams.properties.push(if strength >= REFLECTS { REFLECTOR } else { 0 });
            beams.theta.push(theta_code(deg.to_radians()));
        }
        beams
    }

    /// Range and remission of a beam's echo, as the echo filter lets it through.
    fn echo(&self, echo: usize, beam: usize) -> Option<(u16, u16)> {
        let of = |number: usize| {
            let echo = self.line.echoes.get(number)?;
            let range_mm = *echo.range_mm.get(beam)?;
            let remission = echo.remission.get(beam).copied().unwrap_or_default();
            self.seen.reaches(range_mm).then_some((range_mm, remission))
        };
        if self.device.settings.echo_filter == fr_echo_filter::LAST {
            (0..usize::from(self.device.model.echoes)).rev().find_map(of)
        } else {
            of(echo)
        }
    }

    /// When a beam is measured: the mirror turns evenly.
    fn instant(&self, beam: usize) -> SimTime {
        let mirror = self.device.mirror();
        let turn_s =
            100.0 / f64::from(mirror.frequency_centihz.max(1)) * (1.0 + f64::from(mirror.period_ppm) * 1e-6);
        self.at + Duration::from_secs_f64(beam as f64 * self.line.grid.step_deg() / 360.0 * turn_s)
    }
}

impl Device {
    /// Echoes a beam of a Compact telegram has.
    fn compact_echoes(&self) -> usize {
        if self.settings.echo_filter == fr_echo_filter::ALL { self.model.echoes.into() } else { 1 }
    }
}

/// What the filters leave.
struct Seen {
    angles_deg: Option<[f64; 2]>,
    increment: usize,
    ranges_mm: Option<[i64; 2]>,
}

impl Seen {
    fn new(variables: &Stored) -> Self {
        let part = |number| variables.number("LFPangleRangeFilter", number);
        let is_on = part(0) == 1;
        let deg = |number| part(number) as f64 / 10_000.0;
        let is_level = deg(3) <= 0.0 && deg(4) >= 0.0;
        let angles_deg = if is_level { [deg(1), deg(2)] } else { [f64::INFINITY, f64::NEG_INFINITY] };
        let radial = |number| variables.number("LFPradialDistanceRangeFilter", number);
        Self {
            angles_deg: is_on.then_some(angles_deg),
            increment: if is_on { part(5).max(1) as usize } else { 1 },
            ranges_mm: (radial(0) == 1).then(|| [radial(1), radial(2)]),
        }
    }

    fn sees(&self, beam: usize, theta_deg: f64) -> bool {
        let is_inside = self.angles_deg.is_none_or(|[from, to]| {
            (from - EDGE_TOLERANCE_DEG..=to + EDGE_TOLERANCE_DEG).contains(&theta_deg)
        });
        is_inside && beam.is_multiple_of(self.increment)
    }

    /// True of an echo: there is one at this range, and it is let through.
    fn reaches(&self, range_mm: u16) -> bool {
        range_mm > 0 && self.ranges_mm.is_none_or(|[from, to]| (from..=to).contains(&range_mm.into()))
    }
}

fn stamp(us: u64, off_us: i64) -> u64 {
    us.saturating_add_signed(off_us)
}

impl Clock {
    /// How far a segment's start or stop is off its even place, µs.
    fn off_even_us(&self, stage: Stage, key: u64, within_us: f64) -> i64 {
        let scattered = self.random_if_scattered();
        scattered.map_or(0, |random| libm::round(within_us * random.two_sided(stage, key)) as i64)
    }

    /// From a segment's first beam to the time of transmission in its telegram, µs.
    fn transmit_off_us(&self, compact: &CompactOutput, key: u64) -> i64 {
        let [from, to] = compact.transmit_within_us.map(f64::from);
        let scattered = self.random_if_scattered();
        scattered.map_or(compact.transmit_us.into(), |random| {
            libm::round(from + (to - from) * random.unit(Stage::SegmentTransmit, key)) as i64
        })
    }
}
