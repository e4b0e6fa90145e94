//! When the receiver speaks: every so many milliseconds of simulated time, all its sentences one behind the other.

use rowscan_protocol::time::SimTime;
use rowscan_vehicle::gnss::Receiver;
use rowscan_vehicle::{Report, Tractor};

use super::sentence::SENTENCES;

/// A speaking receiver.
#[derive(Debug)]
pub struct GnssEpochs {
    tractor: Tractor,
    receiver: Receiver,
    epochs: u64,
}

impl GnssEpochs {
    /// The receiver on `tractor`.
    pub fn new(tractor: Tractor, receiver: Receiver) -> Self {
        Self { tractor, receiver, epochs: 0 }
    }

    /// When it speaks next: epoch n at n / rate, never a sum of periods.
    pub fn next(&self) -> SimTime {
        SimTime((self.epochs as f64 * 1e9 / self.receiver.rate_hz()).round() as u64)
    }

    /// Skips what was due before `at`.
    pub fn skip_to(&mut self, at: SimTime) {
        let epochs = (at.0 as f64 * self.receiver.rate_hz() / 1e9).floor() as u64;
        self.epochs = self.epochs.max(epochs.saturating_sub(1));
        while self.next() < at {
            self.epochs += 1;
        }
    }

    /// What it says then.
    pub fn next_epoch(&mut self) -> String {
        let at = self.next();
        let each_second = self.receiver.rate_hz().round().max(1.0) as u64;
        let first_of_a_second = self.epochs.is_multiple_of(each_second);
        self.epochs += 1;
        let Report { fix, bad_checksum } = self.tractor.report(&self.receiver, at);
        let mut text = String::new();
        for sentence in SENTENCES.iter().filter(|sentence| first_of_a_second || !sentence.once_a_second) {
            sentence.write(&fix, &mut text);
        }
        if bad_checksum {
            spoil_checksums(&mut text);
        }
        text
    }
}

/// Makes every checksum another one: the last digit is inverted.
fn spoil_checksums(text: &mut String) {
    let spoilt = text.split_inclusive('\n').map(|line| {
        let end = line.trim_end().len();
        let digit = line.get(end.saturating_sub(1)..end).and_then(|digit| u8::from_str_radix(digit, 16).ok());
        match (line.get(..end.saturating_sub(1)), digit) {
            (Some(head), Some(digit)) => format!("{head}{:X}\r\n", digit ^ 0xF),
            _ => line.to_owned(),
        }
    });
    *text = spoilt.collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_settings::fault_table::vehicle::GnssFault;
    use rowscan_vehicle::VehicleFault;
    use rowscan_vehicle::gnss::Gnss;
    use rowscan_vehicle::trajectory::Trajectory;

    #[test]
    fn checksums_are_wrong_as_long_as_the_fault_lasts() {
        let tractor = Tractor::new(Trajectory::straight(0.0, 1.0));
        let fault = GnssFault { bad_checksum: true, ..GnssFault::default() };
        tractor.begin_fault(1, VehicleFault::Gnss(fault), SimTime(1_000_000_000));
        tractor.end_fault(1, SimTime(2_000_000_000));
        let mut epochs = GnssEpochs::new(tractor, Receiver::new(Gnss::default(), 1));
        let mut good = Vec::new();
        while epochs.next() < SimTime(3_000_000_000) {
            let text = epochs.next_epoch();
            let right = text.lines().filter(|line| rowscan_protocol::nmea::sentence(line).is_some()).count();
            good.push(if right == 0 { 0 } else { text.lines().count() - right + 1 });
        }
        assert_eq!(good, [[1; 10], [0; 10], [1; 10]].concat());
    }
}
