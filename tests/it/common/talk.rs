//! A scanner and somebody who talks with it, for recordings of what was said.

use std::time::Duration;

use rowscan_protocol::device::{
    Device, DialectPolicy, Identity, MeasuredEcho, MeasuredLine, Session, scan_event,
};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::model::Model;
use rowscan_protocol::telegram::set_access_mode::{PasswordHash, SetAccessMode};
use rowscan_protocol::telegram::{Kind, Method, encode_frame};
use rowscan_protocol::time::SimTime;
use rowscan_recording::Side;

use super::replayed::Packets;

/// A device and somebody who is logged in to it, in one dialect.
pub struct Talk {
    pub device: Device,
    session: Session,
    dialect: Dialect,
    /// What was said.
    packets: Packets,
    turns: u64,
}

pub fn framed(dialect: Dialect, payload: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    encode(dialect, payload, &mut frame);
    frame
}

pub fn payload(dialect: Dialect, frame: &[u8]) -> Vec<u8> {
    let mut decoder = FrameDecoder::new(Accept::Only(dialect), 64 * 1024);
    decoder.push(frame);
    decoder.next_frame().expect("a frame").payload.to_vec()
}

pub fn login(model: &Model, dialect: Dialect) -> Vec<u8> {
    let login = model.logins.iter().find(|login| login.level >= 3).expect("one");
    let (level, password) = (login.level, PasswordHash(login.hash));
    let mut frame = Vec::new();
    encode_frame(dialect, Kind::Mn, SetAccessMode::NAME, &SetAccessMode { level, password }, &mut frame);
    payload(dialect, &frame)
}

impl Talk {
    pub fn with(model: &'static Model, dialect: Dialect) -> Self {
        Self::to(Device::new(model, Identity::of(model, 0)), dialect)
    }

    /// The same with this device.
    pub fn to(device: Device, dialect: Dialect) -> Self {
        let model = device.model();
        let session = Session::new(DialectPolicy::Auto);
        let mut talk = Self { device, session, dialect, packets: Packets::new(), turns: 0 };
        talk.ask(&login(model, dialect));
        talk
    }

    /// The reply's payload.
    pub fn ask(&mut self, request: &[u8]) -> Vec<u8> {
        let (frame, mut replies) = (framed(self.dialect, request), Vec::new());
        self.session.handle_bytes(&mut self.device, SimTime::ZERO, &frame, &mut replies);
        let at = self.now();
        self.packets.push((at, Side::Host, frame));
        let reply = replies.remove(0).bytes;
        self.packets.push((at, Side::Device, reply.clone()));
        payload(self.dialect, &reply)
    }

    /// Sets all of these that the model has; how many it took.
    pub fn set(&mut self, writes: &[&str]) -> usize {
        let session = std::mem::replace(&mut self.session, Session::new(DialectPolicy::Auto));
        let dialect = std::mem::replace(&mut self.dialect, Dialect::A);
        let model = self.device.model();
        self.ask(&login(model, Dialect::A));
        let taken = writes.iter().filter(|write| self.ask(write.as_bytes()).starts_with(b"sWA")).count();
        (self.session, self.dialect) = (session, dialect);
        taken
    }

    /// The request that would set a variable to what it is, in this dialect.
    pub fn as_write(&self, name: &str, dialect: Dialect) -> Vec<u8> {
        let mut other = Self::to(self.device.clone(), dialect);
        let value = other.ask(format!("sRN {name}").as_bytes());
        assert!(value.starts_with(b"sRA "), "{name}: {}", value.escape_ascii());
        [b"sWN ", &value[4..]].concat()
    }

    /// So many scans of a wall at 2 m come, a turn of 20 ms each.
    pub fn scans(&mut self, scans: usize) {
        let mut sent = 0;
        for turn in self.turns..self.turns + 100 * scans as u64 {
            if sent == scans {
                return;
            }
            self.turns = turn + 1;
            let (at, grid) = (SimTime(turn * 20_000_000), self.device.mirror().beams);
            self.device.set_encoder_ticks(turn as f64);
            let wall = MeasuredEcho { range_mm: vec![2000; grid.len()], remission: vec![100; grid.len()] };
            let Some(scan) = self.device.measure(at, &MeasuredLine { grid, echoes: &[wall] }) else {
                continue;
            };
            let mut frame = Vec::new();
            scan_event(self.dialect, scan, &mut frame);
            self.packets.push((self.now(), Side::Device, frame));
            sent += 1;
        }
        assert_eq!(sent, scans, "{} sends no scans", self.device.model().name);
    }

    /// The recording, with so many scans behind what was said.
    pub fn recorded(mut self, scans: usize) -> Packets {
        self.scans(scans);
        self.packets
    }

    fn now(&self) -> Duration {
        Duration::from_millis(self.packets.len() as u64) + Duration::from_millis(20 * self.turns)
    }
}
