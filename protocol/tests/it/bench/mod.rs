//! A scanner on the bench, asked in the words of its text dialect.
// Every test file uses another part; what fails here fails a test.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, clippy::panic)]

use rowscan_protocol::device::{Device, DialectPolicy, Identity, MeasuredLine, Reply, Session};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::model::by_name;
use rowscan_protocol::time::SimTime;

/// One scanner and one connection to it.
pub struct Bench {
    pub device: Device,
    pub session: Session,
    pub now: SimTime,
}

impl Bench {
    pub fn new(model: &str) -> Self {
        let device = Device::new(by_name(model).unwrap(), Identity::default());
        Self { device, session: Session::new(DialectPolicy::Auto), now: SimTime::ZERO }
    }

    pub fn logged_in(model: &str) -> Self {
        let mut bench = Self::new(model);
        bench.log_in();
        bench
    }

    pub fn log_in(&mut self) {
        let hash = self.device.model().logins.iter().find(|login| login.level == 3).unwrap().hash;
        assert_eq!(self.ask(&format!("sMN SetAccessMode 03 {hash:08X}")), "sAN SetAccessMode 1");
    }

    pub fn send(&mut self, bytes: &[u8]) -> Vec<Reply> {
        let mut replies = Vec::new();
        self.session.handle_bytes(&mut self.device, self.now, bytes, &mut replies);
        replies
    }

    /// One request, one reply, as text.
    pub fn ask(&mut self, text: &str) -> String {
        let mut request = Vec::new();
        encode(Dialect::A, text.as_bytes(), &mut request);
        let replies = self.send(&request);
        let [reply] = &replies[..] else { panic!("{} replies to {text}", replies.len()) };
        let [0x02, payload @ .., 0x03] = &reply.bytes[..] else { panic!("{reply:?}") };
        String::from_utf8(payload.to_vec()).unwrap()
    }

    pub fn table(&mut self, rows: &[(&str, &str)]) {
        for (request, reply) in rows {
            assert_eq!(self.ask(request), *reply, "to {request}");
        }
    }

    pub fn scans(&mut self, turns: usize) -> usize {
        (0..turns)
            .filter(|_| {
                self.device
                    .measure(self.now, &MeasuredLine { grid: self.device.mirror().beams, echoes: &[] })
                    .is_some()
            })
            .count()
    }
}
