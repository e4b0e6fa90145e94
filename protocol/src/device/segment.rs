//! A mirror turn as Compact telegrams: one a segment, due when its last beam is measured; readings of IMU and encoder beside them.

use alloc::vec;
use alloc::vec::Vec;
use core::net::SocketAddrV4;
use core::time::Duration;

use super::datagram::{Datagram, Silent, Stream};
use super::measured::MeasuredLine;
use super::seen::{LayersSent, Seen};
use super::state::Device;
use super::turn::Turn;
use super::variable::Value;
use crate::compact::{Encoder, Imu, Telegram};
use crate::time::SimTime;

/// ScanDataFormat: Compact.
const COMPACT: i64 = 2;
/// ScanDataFormat: LMDscandata.
const LMD_SCANDATA: i64 = 3;
/// Protocol of a destination: UDP.
const UDP: i64 = 1;

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

    /// Appends the telegrams of the turn that [`Device::measure`] counted last and whose first beams were at `at`; a line for each of
    /// [`Device::mirrors`].
    pub fn segments(&mut self, at: SimTime, lines: &[MeasuredLine<'_>], out: &mut Vec<Datagram>) {
        let Some(compact) = self.model.compact.filter(|_| self.destination(Stream::Scan).is_ok()) else {
            return;
        };
        let frame = self.counters.turns.saturating_sub(1);
        if !frame.is_multiple_of(self.turn_interval()) {
            return;
        }
        let seen = Seen::new(&self.settings.variables);
        let lines = Turn::lines(self, compact, lines, &seen);
        let turn_s = self.mirror().turn_s();
        let turn = Turn { device: self, compact, lines, frame, at, turn_s, seen };
        let before = out.len();
        out.extend(turn.datagrams());
        if let Some(last) = out.get_mut(before..).and_then(<[Datagram]>::last_mut) {
            last.ends_turn = Some(frame);
        }
    }

    /// Lines that a turn is sent with.
    pub fn lines_a_turn(&self) -> usize {
        let layers = self.model.compact.map_or(0, |compact| compact.layers.len());
        let sent = LayersSent::new(&self.settings.variables);
        if layers == 0 { 1 } else { (0..layers).filter(|layer| sent.sends(*layer)).count() }
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

    /// The encoder's reading at the turn that was measured last, which began at `at`: ticks since power-up, and speed in mm/s.
    pub fn encoder_telegram(&mut self, at: SimTime, speed_mm_s: f32) -> Datagram {
        let (tick, time_us) = (self.ticks.ticks as i64 as u32, self.uptime_us(at));
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
