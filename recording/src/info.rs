//! What a recording holds: streams, rates, gaps, and how the device's clock runs against the host's.

use std::collections::{BTreeMap, VecDeque};

use rowscan_protocol::counting::{Counting, Link, Turn};
use rowscan_protocol::host::{HostEvent, OtherSender};
use rowscan_protocol::nmea::{NmeaLines, sentence};
use rowscan_protocol::reading::ReadingCounts;
use rowscan_protocol::scan::Scan;
use serde::Serialize;
use std::time::Duration;

use crate::scan_reader::MAX_PAYLOAD;
use crate::{Joint, Packet, ReadError, Recording, ScanReader, Side, StreamInfo, StreamKind};

/// Longer without a scan is an outage.
const OUTAGE_NS: u64 = 1_000_000_000;

/// Scans that may overtake one that is late.
const MAX_OVERTAKING: usize = 64;

/// A clock's drift is told where two standard errors of it are no more than this, parts per million: what quartz clocks differ by.
pub const MAX_DRIFT_ERROR_PPM: f64 = 50.0;

/// One stream's account. Times are the host's, seconds; absent where the file has none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StreamReport {
    /// Its name.
    pub stream: String,
    /// What its bytes are.
    pub kind: StreamKind,
    /// Of a capture's stream that is several connections, one after the other: their names.
    pub connections: Vec<String>,
    /// Packets from the device, and to it.
    pub packets_from_device: u64,
    /// See above.
    pub packets_to_device: u64,
    /// Bytes of both directions.
    pub bytes: u64,
    /// From the recording's first packet to this stream's first.
    pub begins_s: Option<f64>,
    /// From its first packet to its last.
    pub duration_s: Option<f64>,
    /// Packets the recorder lost, or stretches a capture lacks.
    pub packets_lost: u64,
    /// Valid scan telegrams.
    pub scans: u64,
    /// Telegrams that came again.
    pub scans_repeated: u64,
    /// Gaps in their counters; unknown where the scanner does not count, or has begun to count anew.
    pub scans_lost: Option<u64>,
    /// Telegrams that came behind later ones: neither lost nor a part of what is measured.
    pub scans_late: u64,
    /// Parts of scans that did not come, where scans come in parts (Compact); absent elsewhere.
    pub segments_lost: Option<u64>,
    /// Parts of scans that came again unchanged; they cost nothing.
    pub segments_doubled: Option<u64>,
    /// Parts of scans that came twice with different contents: neither is believed, and their scans are left out.
    pub segments_contradicting: Option<u64>,
    /// Other scanners whose telegrams are in the stream, and their number; none of them is among the counts of scans.
    pub other_scanners: Vec<OtherSender>,
    /// Times the device began to count anew.
    pub restarts: u64,
    /// Times no scan came for more than a second.
    pub outages: u64,
    /// Frames and sentences refused by checksum or length, and scans that could not be read.
    pub telegrams_bad: u64,
    /// Readings of the scanner's inertial measurement unit, of its encoder (in telegrams of their own), and those that cannot be read.
    pub imu_readings: u64,
    /// See above.
    pub encoder_readings: u64,
    /// See above.
    pub readings_bad: u64,
    /// Scans a second that came: intervals between scans over the time from the first to the last, by the device's clock. Times in which the device
    /// stood, or was switched off, are no part of it. By the host's clock, with all pauses, where the device tells no time.
    pub scan_rate_hz: Option<f64>,
    /// Scans a second that the device sent, by its clock, lost ones included.
    pub scan_rate_device_hz: Option<f64>,
    /// The longest time between two scans, by the host's clock.
    pub longest_gap_s: Option<f64>,
    /// How much faster the device's clock runs than the host's, parts per million: the slope of a straight line through all scans since the device began
    /// to count, by least squares. Absent where two standard errors of it exceed [`MAX_DRIFT_ERROR_PPM`], and where the device tells no time.
    pub clock_drift_ppm: Option<f64>,
}

/// Accounts for every stream of a recording, which is read to its end.
pub fn account(recording: &mut Recording) -> Result<Vec<StreamReport>, ReadError> {
    let mut accounts: BTreeMap<usize, StreamAccount> = BTreeMap::new();
    while let Some(packet) = recording.next_packet()? {
        let kind = recording.streams().get(packet.stream).map_or(StreamKind::Bytes, |stream| stream.kind);
        let packet = Packet { at_ns: recording.host_ns(&packet), ..packet };
        accounts.entry(packet.stream).or_insert_with(|| StreamAccount::new(kind)).enter(&packet);
    }
    let began_ns = recording.began_ns().filter(|_| !recording.about().by_device_clock);
    let reports = recording.streams().iter().enumerate().map(|(number, stream)| {
        accounts.remove(&number).unwrap_or_else(|| StreamAccount::new(stream.kind)).report(stream, began_ns)
    });
    Ok(reports.collect())
}

/// One stream's running account.
struct StreamAccount {
    kind: StreamKind,
    reader: Option<ScanReader>,
    /// Of a receiver's stream.
    sentences: NmeaLines,
    packets: [u64; 2],
    bytes: u64,
    first_ns: Option<u64>,
    last_ns: Option<u64>,
    packets_lost: u64,
    counting: Counting,
    outages: u64,
    malformed: u64,
    readings: ReadingCounts,
    first_scan_ns: Option<u64>,
    last_scan_ns: Option<u64>,
    longest_gap_ns: Option<u64>,
    /// Intervals between scans that follow on each other.
    intervals: Intervals,
    /// The host's clock over the device's.
    line: StraightLine,
}

/// Intervals between scans, by the device's clock.
#[derive(Clone, Debug, Default)]
struct Intervals {
    count: u64,
    total_s: f64,
    last_s: f64,
    /// When the earliest scan since the device began to count was measured, by its clock, µs.
    first_us: Option<u32>,
    /// When the latest scans were, those that may be overtaken.
    latest_us: VecDeque<u32>,
}

impl Intervals {
    /// A scan that follows on the one before it.
    fn line(&mut self, time_us: u32, travel_s: f64, link: Link) {
        match link {
            // Lines of one turn have no time between them.
            Link::Steps(0) => {}
            Link::Steps(1..) => {
                self.count += 1;
                self.total_s += travel_s - self.last_s;
            }
            Link::First | Link::Broken => {
                self.first_us = Some(time_us);
                self.latest_us.clear();
            }
        }
        self.last_s = travel_s;
        self.note(time_us);
    }

    /// One that others have overtaken: two intervals are where one was, but of a line whose turn has come already.
    fn late(&mut self, time_us: u32) {
        if self.latest_us.contains(&time_us) {
            return;
        }
        self.note(time_us);
        self.count += 1;
        let before_us = self.first_us.map(|first_us| first_us.wrapping_sub(time_us) as i32);
        if let Some(before_us @ 1..) = before_us {
            self.first_us = Some(time_us);
            self.total_s += f64::from(before_us) * 1e-6;
        }
    }

    fn note(&mut self, time_us: u32) {
        self.latest_us.truncate(MAX_OVERTAKING - 1);
        self.latest_us.push_front(time_us);
    }
}

impl StreamAccount {
    fn new(kind: StreamKind) -> Self {
        Self {
            kind,
            reader: ScanReader::new(kind, MAX_PAYLOAD),
            sentences: NmeaLines::default(),
            packets: [0; 2],
            bytes: 0,
            first_ns: None,
            last_ns: None,
            packets_lost: 0,
            counting: Counting::default(),
            outages: 0,
            malformed: 0,
            readings: ReadingCounts::default(),
            first_scan_ns: None,
            last_scan_ns: None,
            longest_gap_ns: None,
            intervals: Intervals::default(),
            line: StraightLine::default(),
        }
    }

    fn enter(&mut self, packet: &Packet) {
        let to_device = packet.from == Some(Side::Host);
        if let Some(count) = self.packets.get_mut(usize::from(to_device)) {
            *count += 1;
        }
        self.bytes += packet.bytes.len() as u64;
        self.first_ns = self.first_ns.or(packet.at_ns);
        self.last_ns = packet.at_ns.or(self.last_ns);
        if let Joint::Gap { packets, .. } = packet.joint {
            self.packets_lost += packets.max(1);
        }
        if self.kind == StreamKind::Nmea && !to_device {
            self.sentences.push(&packet.bytes);
            while let Some(line) = self.sentences.next_line() {
                self.malformed += u64::from(sentence(&line).is_none() && !line.trim().is_empty());
            }
        }
        self.read(packet.at_ns, |reader| {
            reader.push(Duration::from_nanos(packet.at_ns.unwrap_or_default()), packet);
        });
    }

    /// Counts what a reader has found after `change`.
    fn read(&mut self, at_ns: Option<u64>, change: impl FnOnce(&mut ScanReader)) {
        let Some(mut reader) = self.reader.take() else { return };
        change(&mut reader);
        while let Some(event) = reader.next_event() {
            match event {
                HostEvent::Scan => self.scan(reader.scan(), at_ns),
                HostEvent::Malformed { .. } => self.malformed += 1,
                HostEvent::Reading(reading) => self.readings.count(&reading),
                _ => {}
            }
        }
        self.reader = Some(reader);
    }

    fn scan(&mut self, scan: &Scan, at_ns: Option<u64>) {
        // One counter for this and for estimates, so that both tell the same.
        let (travel_s, link) = match self.counting.observe(scan) {
            Turn::Line { travel_s, link } => (travel_s, link),
            Turn::Late => return self.intervals.late(scan.scan_time_us),
            Turn::Repeated => return,
        };
        self.intervals.line(scan.scan_time_us, travel_s, link);
        let Some(at_ns) = at_ns else { return };
        if let Some(last_ns) = self.last_scan_ns {
            let gap_ns = at_ns.saturating_sub(last_ns);
            self.longest_gap_ns = self.longest_gap_ns.max(Some(gap_ns));
            self.outages += u64::from(gap_ns > OUTAGE_NS);
        }
        if link == Link::Broken {
            // What the device's clock did meanwhile is not known.
            self.line = StraightLine::default();
        }
        let first_ns = *self.first_scan_ns.get_or_insert(at_ns);
        self.last_scan_ns = Some(at_ns);
        self.line.add(travel_s, at_ns.saturating_sub(first_ns) as f64 * 1e-9);
    }

    fn report(mut self, stream: &StreamInfo, began_ns: Option<u64>) -> StreamReport {
        // Telegrams behind one that claims more bytes than there are.
        self.read(self.last_ns, ScanReader::finish);
        let seconds = |from: Option<u64>, to: Option<u64>| Some(to?.saturating_sub(from?) as f64 * 1e-9);
        let Counting { scans, repeated, late, restarts, untimed, .. } = self.counting;
        let other_scanners =
            self.reader.as_ref().map_or_else(Vec::new, |reader| reader.other_senders().to_vec());
        let reader = self.reader.as_ref().filter(|_| self.kind == StreamKind::Compact);
        let segments = reader.map(ScanReader::segments);
        let rate = |intervals: u64, span_s: f64| (span_s > 0.0).then(|| intervals as f64 / span_s);
        let is_timed = untimed == 0 && self.counting.counts();
        let by_device = is_timed.then(|| rate(self.intervals.count, self.intervals.total_s)).flatten();
        let by_host =
            || rate(scans.saturating_sub(repeated + 1), seconds(self.first_scan_ns, self.last_scan_ns)?);
        let [packets_from_device, packets_to_device] = self.packets;
        StreamReport {
            stream: stream.name.clone(),
            kind: self.kind,
            connections: stream.connections.clone(),
            packets_from_device,
            packets_to_device,
            bytes: self.bytes,
            begins_s: seconds(began_ns, self.first_ns),
            duration_s: seconds(self.first_ns, self.last_ns),
            packets_lost: self.packets_lost,
            scans,
            scans_repeated: repeated,
            scans_lost: self.counting.all_lost(),
            scans_late: late,
            other_scanners,
            segments_lost: segments.map(|segments| segments.lost),
            segments_doubled: segments.map(|segments| segments.doubled()),
            segments_contradicting: segments.map(|segments| segments.contradicted),
            restarts,
            outages: self.outages,
            telegrams_bad: self.reader.map_or(0, |reader| reader.counts().damaged()) + self.malformed,
            imu_readings: self.readings.imu,
            encoder_readings: self.readings.wheel,
            readings_bad: self.readings.unreadable,
            scan_rate_hz: by_device.or_else(by_host),
            scan_rate_device_hz: self.counting.frequency_hz(),
            longest_gap_s: self.longest_gap_ns.map(|ns| ns as f64 * 1e-9),
            clock_drift_ppm: self.line.drift_ppm().filter(|_| is_timed),
        }
    }
}

/// Least squares, fed point by point (Welford 1962): sums of centred products, so that hours of microseconds keep their digits.
#[derive(Clone, Copy, Debug, Default)]
struct StraightLine {
    n: f64,
    mean_x: f64,
    mean_y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl StraightLine {
    /// Adds a point. What jitters is `y`.
    fn add(&mut self, x: f64, y: f64) {
        self.n += 1.0;
        let (dx, dy) = (x - self.mean_x, y - self.mean_y);
        self.mean_x += dx / self.n;
        self.mean_y += dy / self.n;
        self.xx += dx * (x - self.mean_x);
        self.xy += dx * (y - self.mean_y);
        self.yy += dy * (y - self.mean_y);
    }

    /// The slope and its standard error, of deviations that are independent; none of two points, which have no deviation.
    fn slope(&self) -> Option<(f64, f64)> {
        (self.n > 2.0 && self.xx > 0.0).then(|| {
            let slope = self.xy / self.xx;
            let deviations = (self.yy - slope * self.xy).max(0.0);
            (slope, (deviations / (self.n - 2.0) / self.xx).sqrt())
        })
    }

    /// How much faster `x` runs than `y`, parts per million, where it is known to [`MAX_DRIFT_ERROR_PPM`].
    fn drift_ppm(&self) -> Option<f64> {
        let (slope, error) = self.slope()?;
        // Of 1 / slope.
        let error_ppm = error / (slope * slope) * 1e6;
        (slope > 0.0 && 2.0 * error_ppm <= MAX_DRIFT_ERROR_PPM).then(|| (1.0 / slope - 1.0) * 1e6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_restarts_and_outages_are_told_apart_from_losses() {
        let mut account = StreamAccount::new(StreamKind::Cola);
        let mut at_ms = 0;
        let mut hear = |counter: u16, time_us: u32, passed_ms: u64| {
            at_ms += passed_ms;
            let scan = Scan {
                telegram_counter: counter,
                scan_time_us: time_us,
                scan_frequency_hz: 50.0,
                ..Scan::default()
            };
            account.scan(&scan, Some(at_ms * 1_000_000));
        };
        // Every telegram twice, then the device is switched off and on.
        for i in 0..50_u16 {
            hear(5000 + i, u32::from(i) * 20_000, 10);
            hear(5000 + i, u32::from(i) * 20_000, 10);
        }
        for i in 0..50_u16 {
            hear(i, u32::from(i) * 20_000, if i == 0 { 8000 } else { 20 });
        }
        let report = account.report(&StreamInfo::new("scanner", StreamKind::Cola), Some(0));
        assert_eq!((report.scans, report.scans_repeated, report.scans_lost), (150, 50, None));
        assert_eq!((report.restarts, report.outages), (1, 1));
        assert!((report.scan_rate_device_hz.unwrap() - 50.0).abs() < 1e-6);
        assert!(report.clock_drift_ppm.unwrap().abs() < 1e-3, "{report:?}");
    }

    /// Scans of a device whose clock is so much fast, at 15 Hz, behind a host that is up to `jitter_s` late; the first two wait in a queue.
    fn heard(scans: u16, fast_ppm: f64, jitter_s: f64) -> StreamReport {
        let mut account = StreamAccount::new(StreamKind::Compact);
        for i in 0..scans {
            let due_s = f64::from(i) / 15.0;
            let late_s = f64::from(u32::from(i).wrapping_mul(2_654_435_761) >> 16) / 65_536.0 * jitter_s;
            let waits_s = [0.1, 0.03].get(usize::from(i)).copied().unwrap_or(0.0);
            let scan = Scan {
                telegram_counter: i,
                scan_time_us: (due_s * (1.0 + fast_ppm * 1e-6) * 1e6).round() as u32,
                scan_frequency_hz: 15.0,
                ..Scan::default()
            };
            account.scan(&scan, Some(((1.0 + due_s + late_s + waits_s) * 1e9) as u64));
        }
        account.report(&StreamInfo::new("scanner", StreamKind::Compact), Some(0))
    }

    #[test]
    fn the_rate_is_the_devices_however_late_the_host_was() {
        for scans in [3, 40, 120, 2000] {
            let rate = heard(scans, 0.0, 0.003).scan_rate_hz.expect("a rate");
            assert!((rate - 15.0).abs() < 1e-3, "{scans} scans: {rate}");
        }
        assert_eq!(heard(1, 0.0, 0.003).scan_rate_hz, None);
    }

    /// Late ones have come, too: the rate does not depend on the order.
    #[test]
    fn scans_that_come_late_are_among_those_that_came() {
        // Of one layer, and of four that are measured one after the other.
        for layers in [1_u32, 4] {
            for (behind, of) in [(1, 5), (2, 7), (3, 16), (4, 9)] {
                let mut order: Vec<u32> = (0..300).collect();
                // The first one as well.
                (0..order.len() - behind)
                    .step_by(of)
                    .for_each(|from| order[from..=from + behind].rotate_left(1));
                let mut account = StreamAccount::new(StreamKind::Cola);
                for number in order {
                    account.scan(
                        &Scan {
                            telegram_counter: number as u16,
                            scan_counter: (number / layers) as u16,
                            layer_centideg: (number % layers) as i16 * 250,
                            scan_time_us: number * 20_000,
                            scan_frequency_hz: 50.0,
                            ..Scan::default()
                        },
                        None,
                    );
                }
                let report = account.report(&StreamInfo::new("scanner", StreamKind::Cola), None);
                assert!(report.scans_late > 10 && report.scans_lost == Some(0), "{report:?}");
                assert!(
                    (report.scan_rate_hz.unwrap() - 50.0).abs() < 1e-6,
                    "{layers}, {behind} of {of}: {report:?}"
                );
            }
        }
    }

    /// A recording of a replay as fast as it goes: its host time tells nothing of the device's clock.
    #[test]
    fn a_drift_is_not_known_where_host_time_runs_at_another_pace() {
        let drift_ppm = |pace: f64| {
            let mut line = StraightLine::default();
            for scan in 0..2000 {
                let device_s = f64::from(scan) * 0.02;
                // A tenth of a millisecond, one way and the other.
                line.add(device_s, device_s / pace + if scan % 2 == 0 { 1e-4 } else { -1e-4 });
            }
            line.drift_ppm()
        };
        assert!(drift_ppm(1.0).is_some_and(|ppm| ppm.abs() < 50.0));
        assert_eq!(drift_ppm(3e5), None);
    }

    #[test]
    fn sentences_with_wrong_checksums_are_counted() {
        let mut account = StreamAccount::new(StreamKind::Nmea);
        let good = "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n";
        for (number, text) in
            [good, &good.replace("*76", "*77"), &good.replace("GGA", "GGB"), "\r\n"].iter().enumerate()
        {
            // In two pieces: a sentence is whole with its line's end.
            for part in [&text[..1], &text[1..]] {
                let packet = Packet {
                    at_ns: Some(number as u64),
                    from: Some(Side::Device),
                    bytes: part.as_bytes().to_vec(),
                    ..Packet::default()
                };
                account.enter(&packet);
            }
        }
        assert_eq!(account.malformed, 2);
    }

    #[test]
    fn scans_that_were_lost_are_missing_in_the_rate_of_those_that_came() {
        let mut account = StreamAccount::new(StreamKind::Cola);
        for i in (0..200_u16).filter(|i| i % 4 != 1) {
            let (telegram_counter, scan_time_us) = (i, u32::from(i) * 20_000);
            let scan = Scan { telegram_counter, scan_time_us, scan_frequency_hz: 50.0, ..Scan::default() };
            account.scan(&scan, None);
        }
        let report = account.report(&StreamInfo::new("scanner", StreamKind::Cola), None);
        assert!((report.scan_rate_hz.unwrap() - 149.0 / 3.98).abs() < 1e-6, "{report:?}");
        assert!((report.scan_rate_device_hz.unwrap() - 50.0).abs() < 1e-6, "{report:?}");
        assert_eq!(report.segments_lost, None, "scans of CoLa have no parts");
    }

    #[test]
    fn a_drift_is_told_once_it_is_known_and_is_right_then() {
        for fast_ppm in [0.0, 80.0, -400.0] {
            for scans in (3..6000).step_by(97) {
                if let Some(told) = heard(scans, fast_ppm, 0.004).clock_drift_ppm {
                    assert!(
                        (told - fast_ppm).abs() <= MAX_DRIFT_ERROR_PPM,
                        "{scans} scans, {fast_ppm}: {told}"
                    );
                }
            }
            // 8 s of jitter tell nothing, six minutes do.
            assert_eq!(heard(120, fast_ppm, 0.004).clock_drift_ppm, None);
            assert!(heard(5400, fast_ppm, 0.004).clock_drift_ppm.is_some());
        }
    }

    #[test]
    fn a_device_without_a_clock_has_no_drift_and_the_hosts_rate() {
        let mut account = StreamAccount::new(StreamKind::Cola);
        for i in 0..100_u16 {
            let scan = Scan { telegram_counter: i, scan_frequency_hz: 50.0, ..Scan::default() };
            account.scan(&scan, Some(u64::from(i) * 25_000_000));
        }
        let report = account.report(&StreamInfo::new("scanner", StreamKind::Cola), Some(0));
        assert_eq!((report.clock_drift_ppm, report.scan_rate_device_hz), (None, None));
        assert!((report.scan_rate_hz.unwrap() - 40.0).abs() < 1e-9, "{report:?}");
    }

    #[test]
    fn a_clock_a_hundred_ppm_fast_is_found_behind_milliseconds_of_jitter() {
        let mut line = StraightLine::default();
        for i in 0..180_000_u32 {
            let x = f64::from(i) * 0.02;
            let jitter = f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 * 0.004;
            line.add(x * 1.0001, x + jitter);
        }
        let ppm = line.drift_ppm().expect("a drift");
        assert!((ppm - 100.0).abs() < 0.1, "{ppm}");
    }
}
