//! What the counters say: which telegrams came again or late, how many are missing, where the device restarted, and when on the
//! device clock each line was taken.

use crate::scan::Scan;
use crate::time::DeviceClock;
use crate::uptime::Uptime;
use crate::window::{REMEMBERED, Window};

/// How far a gap's length on the clock may be off its length by the counter, either way, and still be a gap.
const GAP_TOLERANCE: f64 = 2.0;
/// The largest output interval (one telegram every n turns) believed before a period has been measured.
const MAX_OUTPUT_INTERVAL: f64 = 32.0;
/// How far the clock may be off the turns between two telegrams, in turns.
const TURNS_TOLERANCE: f64 = 0.5;
/// A pause between two telegrams that follow on each other, in their period, above which measurement had stopped.
const MAX_JITTER: f64 = 4.0;
/// The longest pause of the measurement, seconds, through which the device clock is still believed to time the tractor.
const MAX_PAUSE_S: f64 = 60.0;
/// Pace is that of telegrams that are no farther apart, µs.
const MOST_PACED_US: u32 = 60_000_000;
/// How far the device's clock, the host's and a counter may be apart behind a long gap, as a share of it.
const FAR_TOLERANCE: f64 = 0.005;
/// A counter goes round in so many telegrams, and a clock in so many seconds.
const COUNTER_ROUND: f64 = 65_536.0;
const CLOCK_ROUND_S: f64 = 4_294.967_296;
/// A telegram that others have overtaken comes right behind them: later than so many seconds after the last one it is none, but of a device that began anew.
const MAX_OVERTAKEN_S: f64 = 1.0;
/// Where no clock says so, a telegram that is behind so many others at most is late.
const REORDER: u64 = 4;
/// The most turns between two telegrams that follow on each other, above which the turn counter is not believed.
const MAX_TURNS: u16 = 10_000;
/// A flipped bit takes the turn counter no farther ahead between two turns; farther ahead it is back where it was.
const FARTHEST_AHEAD: u16 = 0x8001;
/// The period assumed where the telegram states no frequency, seconds.
const FALLBACK_PERIOD_S: f64 = 0.02;

/// Counts telegrams and times them on the device clock.
#[derive(Clone, Debug, Default)]
pub struct Counting {
    /// Valid scan telegrams.
    pub scans: u64,
    /// Telegrams that came again.
    pub repeated: u64,
    /// Telegrams that came behind later ones. They are not lost, and no line is made of them: the stream has gone on.
    pub late: u64,
    /// Telegrams missing by the counters.
    pub lost: u64,
    /// Times the device began anew, or another one took its place.
    pub restarts: u64,
    /// Of these, such behind which the telegram counter did not go on.
    counted_anew: u64,
    /// Telegrams that follow on the one before by their counter and their clock, and not by their counter of turns: bits were changed on the way.
    pub contradicting: u64,
    /// Lines of devices that do not count, behind the first: whether telegrams are missing before them is not known.
    uncounted: u64,
    /// The clock has gone on from one telegram to another.
    moved: bool,
    /// Telegrams whose device clock stood still.
    pub untimed: u64,
    /// Those of them for which no frequency is known either: how long they took is unknown.
    pub timeless: u64,
    assumed_hz: f64,
    last: Option<Reading>,
    /// Which telegrams have come since the device last began anew, and what was lost before.
    window: Option<Window>,
    times: Times,
    lost_before: u64,
    uptime: Uptime,
    clock: DeviceClock,
    /// Travel time when `clock` started.
    clock_base_s: f64,
    /// Period a telegram, as the last plausible link had it.
    period_s: Option<f64>,
    /// Periods and their time, summed over links that neither stopped nor restarted.
    periods: u64,
    periods_s: f64,
    turns: Turns,
    /// Telegrams of the newest turn before the last one, and how many a turn has: one a layer where all layers turn together.
    of_turn: u32,
    lines: u32,
}

/// Mirror turns between telegrams that follow on each other.
#[derive(Clone, Copy, Debug, Default)]
struct Turns {
    telegrams: u64,
    turns: u64,
    /// The fewest between two telegrams: the output interval.
    least: Option<u16>,
    /// Those between the last two, where they took as long as so many turns take.
    latest: Option<u16>,
}

#[derive(Clone, Copy, Debug)]
struct Reading {
    counter: u16,
    turn: u16,
    layer_centideg: i16,
    time_us: u32,
    travel_s: f64,
    serial_number: u32,
}

impl Reading {
    /// True if a scanner of another number sent it; 0 is none.
    fn is_of_other_than(&self, serial_number: u32) -> bool {
        serial_number != 0 && self.serial_number != 0 && serial_number != self.serial_number
    }
}

/// When on the device clock the telegrams of a window were taken, µs; a telegram's place is its number, over and over.
#[derive(Clone, Copy, Debug)]
struct Times([u32; REMEMBERED as usize]);

impl Default for Times {
    fn default() -> Self {
        Self([0; REMEMBERED as usize])
    }
}

impl Times {
    fn keep(&mut self, number: u64, time_us: u32) {
        if let Some(place) = self.0.get_mut((number % REMEMBERED) as usize) {
            *place = time_us;
        }
    }

    /// Of a telegram that the window remembers.
    fn of(&self, number: u64) -> Option<u32> {
        self.0.get((number % REMEMBERED) as usize).copied()
    }

    /// True if a telegram that has not come was taken at this time: between its neighbours, and where nothing remembered is older than it, as many periods before
    /// the one behind it as there are telegrams between them.
    fn fits(&self, window: &Window, number: u64, time_us: u32, period_s: f64) -> bool {
        let neighbour = |newer| window.nearest(number, newer).and_then(|near| Some((near, self.of(near)?)));
        let Some((newer, newer_us)) = neighbour(true) else { return false };
        let before_us = newer_us.wrapping_sub(time_us) as i32;
        match neighbour(false) {
            Some((_, older_us)) => before_us >= 0 && time_us.wrapping_sub(older_us) as i32 >= 0,
            None => {
                let periods = f64::from(before_us) * 1e-6 / period_s - (newer - number) as f64;
                libm::fabs(periods) <= TURNS_TOLERANCE
            }
        }
    }
}

/// Where a telegram stands in the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turn {
    /// The same telegram again.
    Repeated,
    /// One that was missing, behind later ones.
    Late,
    /// A new line, `travel_s` after the first one.
    Line {
        /// Since the first telegram, on the device clock, seconds.
        travel_s: f64,
        /// How it follows.
        link: Link,
    },
}

/// How a line follows on the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// It is the first.
    First,
    /// By so many telegrams: 1, or more where some were lost; where all layers turn together, by so many turns, 0 for a line of the same turn.
    Steps(u32),
    /// After a pause or a restart: the number is unknown.
    Broken,
}

impl Link {
    /// How a line follows on one two links before, of which the first link is `self`.
    #[must_use]
    pub fn and(self, next: Self) -> Self {
        match (self, next) {
            (Self::First, _) => Self::First,
            (Self::Steps(a), Self::Steps(b)) => Self::Steps(a.saturating_add(b)),
            _ => Self::Broken,
        }
    }
}

impl Counting {
    /// Counts one valid telegram.
    pub fn observe(&mut self, scan: &Scan) -> Turn {
        self.scans += 1;
        let before_us = self.last.map(|last| last.time_us);
        let turn = self.turn(scan);
        let follows = matches!(turn, Turn::Line { link: Link::Steps(1..), .. });
        let passed_us = before_us.map(|before_us| scan.scan_time_us.wrapping_sub(before_us));
        let timed_us = passed_us.filter(|passed_us| follows && (1..MOST_PACED_US).contains(passed_us));
        self.uptime.take(scan.received, timed_us.map(|timed_us| f64::from(timed_us) * 1e-6));
        turn
    }

    /// What a telegram is, beside those before it.
    fn turn(&mut self, scan: &Scan) -> Turn {
        let (counter, time_us) = (scan.telegram_counter, scan.scan_time_us);
        let Some(last) = self.last else {
            self.clock.seconds(time_us);
            return self.line(scan, 0.0, Link::First);
        };
        if scan.begins_anew || last.is_of_other_than(scan.serial_number) {
            return self.restart(scan, last);
        }
        let steps = counter.wrapping_sub(last.counter);
        let clock_us = time_us.wrapping_sub(last.time_us) as i32;
        let frequency_hz = self.nominal_hz(scan);
        let nominal_s = nominal_period_s(frequency_hz);
        let turns = scan.scan_counter.wrapping_sub(last.turn);
        // A turn that was made took its time.
        let had_time = clock_us == 0
            || f64::from(turns) * nominal_s <= f64::from(clock_us) * 1e-6 * GAP_TOLERANCE + nominal_s;
        if had_time {
            self.turns.add(steps, turns);
        } else {
            self.contradicting += u64::from(steps == 1 && clock_us > 0 && turns <= FARTHEST_AHEAD);
        }
        if let Some(turn) = self.behind(scan, last, nominal_s) {
            return turn;
        }
        if let Some((telegrams, passed_s)) = self.far_ahead(scan, last) {
            return self.skip(scan, last.travel_s + passed_s, telegrams, passed_s);
        }
        if steps == 0 || steps > u16::MAX / 2 || clock_us < 0 {
            return self.restart(scan, last);
        }
        if clock_us == 0 && scan.scan_counter == last.turn && scan.layer_centideg != last.layer_centideg {
            self.of_turn += u32::from(steps);
            return self.line(scan, last.travel_s, Link::Steps(0));
        }
        self.moved |= clock_us > 0;
        if clock_us == 0 && scan.uncounted && self.moved {
            // Both were read at once, however far apart they were measured. A clock that has never moved tells nothing.
            return self.line(scan, last.travel_s, Link::Steps(u32::from(steps)));
        }
        if clock_us == 0 {
            self.untimed += 1;
            self.timeless += u64::from(!is_frequency(frequency_hz));
            let travel_s = last.travel_s + f64::from(steps) * nominal_s;
            self.rebase(time_us, travel_s);
            return self.line(scan, travel_s, Link::Steps(u32::from(steps)));
        }
        let passed_s = f64::from(clock_us) * 1e-6;
        // Where a turn has several telegrams, those of the last one have no time of their own.
        let each = u32::from(steps) + self.of_turn;
        let is_paced = self.turns.go_on(steps, turns, passed_s / nominal_s);
        let follows = is_paced || self.follows(steps, each, passed_s, nominal_s);
        if !(follows && steps == 1) && self.uptime.is_too_short(scan.received, passed_s) {
            return self.restart(scan, last);
        }
        let travel_s = self.clock_base_s + self.clock.seconds(time_us);
        if follows {
            if steps == 1 {
                self.lines = each;
            }
            let turns = (each / self.lines.max(1)).max(1);
            self.periods += u64::from(turns);
            self.periods_s += passed_s;
            self.period_s = Some(passed_s / f64::from(each));
            self.of_turn = 0;
            return self.line(scan, travel_s, Link::Steps(turns));
        }
        if passed_s <= MAX_PAUSE_S && steps == 1 {
            return self.line(scan, travel_s, Link::Broken);
        }
        self.restart(scan, last)
    }

    /// Takes this frequency, telegrams a second, where a telegram states none.
    pub fn assume_hz(&mut self, frequency_hz: f64) {
        self.assumed_hz = frequency_hz;
    }

    /// The stated frequency, or the assumed one; 0 if there is neither.
    pub fn nominal_hz(&self, scan: &Scan) -> f64 {
        if is_frequency(scan.scan_frequency_hz) { scan.scan_frequency_hz } else { self.assumed_hz }
    }

    /// True if the device counts, so far as lines have told.
    pub fn counts(&self) -> bool {
        self.uncounted == 0
    }

    /// Telegrams a second on the device clock, lost ones included; none of a device that does not count.
    pub fn frequency_hz(&self) -> Option<f64> {
        (self.periods_s > 0.0 && self.counts()).then(|| self.periods as f64 / self.periods_s)
    }

    /// Telegrams missing by the counters; none where some of it is [`Self::untold`].
    pub fn all_lost(&self) -> Option<u64> {
        (self.untold() == 0).then_some(self.lost)
    }

    /// How often nobody can tell what is missing: a device that does not count gave a line, or one began to count anew, so that what was missing before and behind
    /// that is not known. Where the clock alone jumped, it is.
    pub fn untold(&self) -> u64 {
        self.counted_anew + self.uncounted
    }

    /// Turns of the mirror of which the scanner made no telegram, beyond its output interval. A virtual scanner leaves turns out where its host is too
    /// slow; its telegrams follow on each other all the same.
    pub fn turns_left_out(&self) -> u64 {
        let Turns { telegrams, turns, least, .. } = self.turns;
        least.map_or(0, |least| (turns / u64::from(least)).saturating_sub(telegrams))
    }

    /// Turns of the mirror: those that came, of which a scanner with several layers sends several lines, and those that were left out.
    pub fn turns(&self) -> u64 {
        self.scans.div_ceil(u64::from(self.lines.max(1))) + self.turns_left_out()
    }

    /// True if counter and clock tell the same story: `steps` telegrams, `each` of them with those of the turn before, in `passed_s`.
    fn follows(&self, steps: u16, each: u32, passed_s: f64, nominal_s: f64) -> bool {
        let each_s = if steps == 1 { passed_s } else { passed_s / f64::from(each) };
        let nominal_s = if steps == 1 { nominal_s } else { nominal_s / f64::from(self.of_turn + 1) };
        let (low_s, high_s) = match (self.period_s, steps) {
            (Some(period_s), 1) => (0.0, period_s.max(nominal_s) * MAX_JITTER),
            (Some(period_s), _) => (period_s / GAP_TOLERANCE, period_s * GAP_TOLERANCE),
            (None, 1) => (0.0, nominal_s * MAX_OUTPUT_INTERVAL),
            // The output interval is not known yet: one telegram may stand for many turns.
            (None, _) => (nominal_s / GAP_TOLERANCE, nominal_s * MAX_OUTPUT_INTERVAL),
        };
        each_s >= low_s && each_s <= high_s
    }

    /// What a telegram is that is no later than `last` by its counter: the same again, or one that others have overtaken; none where its clock says that
    /// the device began anew.
    fn behind(&mut self, scan: &Scan, last: Reading, nominal_s: f64) -> Option<Turn> {
        let behind = u64::from(last.counter.wrapping_sub(scan.telegram_counter));
        let clock_us = scan.scan_time_us.wrapping_sub(last.time_us) as i32;
        if behind == 0 {
            return (clock_us == 0).then(|| {
                self.repeated += 1;
                Turn::Repeated
            });
        }
        let is_at_once =
            self.uptime.passed_s(scan.received).is_none_or(|passed_s| passed_s <= MAX_OVERTAKEN_S);
        let is_near = behind < if clock_us == 0 { REORDER + 1 } else { REMEMBERED };
        let period_s = self.frequency_hz().map_or(nominal_s, f64::recip);
        let window = self.window.as_mut().filter(|_| is_near && is_at_once)?;
        let number = window.newest().checked_sub(behind)?;
        if window.has_seen(number) {
            // Another time by the device's clock is another telegram: the device counts anew.
            return (self.times.of(number)? == scan.scan_time_us).then(|| {
                self.repeated += 1;
                Turn::Repeated
            });
        }
        if !self.times.fits(window, number, scan.scan_time_us, period_s) {
            return None;
        }
        window.take(number);
        self.times.keep(number, scan.scan_time_us);
        self.lost = self.lost_before + window.missing();
        self.late += 1;
        Some(Turn::Late)
    }

    /// How many telegrams and seconds ahead of `last` one is behind which more are missing than half a turn of the counter tells: by the device's clock, where that
    /// has gone on as the host's has, and the counter stands where so many telegrams bring it. None of one that is no such.
    fn far_ahead(&self, scan: &Scan, last: Reading) -> Option<(u64, f64)> {
        let per_s = self.frequency_hz()? * f64::from(self.lines.max(1));
        let clock_s = f64::from(scan.scan_time_us.wrapping_sub(last.time_us)) * 1e-6;
        let passed_s = match self.uptime.device_s(scan.received) {
            // The clock may have gone round.
            Some(host_s) => {
                let passed_s =
                    clock_s + CLOCK_ROUND_S * libm::round((host_s - clock_s) / CLOCK_ROUND_S).max(0.0);
                Some(passed_s).filter(|passed_s| libm::fabs(passed_s - host_s) <= FAR_TOLERANCE * host_s)?
            }
            None => Some(clock_s).filter(|clock_s| *clock_s < CLOCK_ROUND_S / 2.0)?,
        };
        let expected = passed_s * per_s;
        let steps = f64::from(scan.telegram_counter.wrapping_sub(last.counter));
        let telegrams = steps + COUNTER_ROUND * libm::round((expected - steps) / COUNTER_ROUND);
        let is_far = telegrams > f64::from(u16::MAX / 2);
        (is_far && libm::fabs(telegrams - expected) <= FAR_TOLERANCE * expected)
            .then_some((telegrams as u64, passed_s))
    }

    /// Takes a line that many telegrams are missing before.
    fn skip(&mut self, scan: &Scan, travel_s: f64, telegrams: u64, passed_s: f64) -> Turn {
        let turns = telegrams / u64::from(self.lines.max(1));
        self.periods += turns;
        self.periods_s += passed_s;
        self.of_turn = 0;
        self.rebase(scan.scan_time_us, travel_s);
        let link = Link::Steps(u32::try_from(turns).unwrap_or(u32::MAX));
        self.line_behind(scan, travel_s, link, telegrams)
    }

    /// The device began anew behind `last`. How long that took the host's clock tells, in whole periods of the device and up to the longest pause; where nobody
    /// has read one, a period stands for it.
    fn restart(&mut self, scan: &Scan, last: Reading) -> Turn {
        let nominal_s = nominal_period_s(self.nominal_hz(scan));
        let period_s = self.period_s.unwrap_or(nominal_s);
        let away_s = self.uptime.device_s(scan.received).unwrap_or(0.0).min(MAX_PAUSE_S);
        let travel_s = last.travel_s + period_s * libm::round(away_s / period_s).max(1.0);
        self.restarts += 1;
        self.counted_anew += u64::from(scan.telegram_counter.wrapping_sub(last.counter) != 1);
        self.period_s = None;
        self.of_turn = 0;
        self.window = None;
        self.lost_before = self.lost;
        self.rebase(scan.scan_time_us, travel_s);
        self.line(scan, travel_s, Link::Broken)
    }

    /// Restarts the clock: `time_us` is `travel_s`.
    fn rebase(&mut self, time_us: u32, travel_s: f64) {
        self.clock = DeviceClock::default();
        self.clock.seconds(time_us);
        self.clock_base_s = travel_s;
    }

    fn line(&mut self, scan: &Scan, travel_s: f64, link: Link) -> Turn {
        let steps = self.last.map_or(0, |last| u64::from(scan.telegram_counter.wrapping_sub(last.counter)));
        self.line_behind(scan, travel_s, link, steps)
    }

    /// A line so many telegrams behind the one before.
    fn line_behind(&mut self, scan: &Scan, travel_s: f64, link: Link, steps: u64) -> Turn {
        let (counter, time_us) = (scan.telegram_counter, scan.scan_time_us);
        self.uncounted += u64::from(scan.uncounted && link != Link::First);
        // Counters of a window do not wrap, and there is room below the first one.
        let first = 1 << 16;
        let window = self.window.get_or_insert_with(|| Window::new(first));
        let number = if window.is_empty() { first } else { window.newest() + steps };
        window.take(number);
        self.times.keep(number, time_us);
        self.lost = self.lost_before + window.missing();
        let (turn, layer_centideg) = (scan.scan_counter, scan.layer_centideg);
        let serial_number = scan.serial_number;
        self.last = Some(Reading { counter, turn, layer_centideg, time_us, travel_s, serial_number });
        Turn::Line { travel_s, link }
    }
}

impl Turns {
    /// True if this telegram and the one before it each came after the same number of turns, in the time that so many turns take: a client has set another output
    /// interval, or a mean filter. Two pauses in a row are hardly equally long.
    fn go_on(&mut self, telegrams: u16, turns: u16, passed_turns: f64) -> bool {
        let is_counted = telegrams == 1
            && f64::from(turns) <= MAX_OUTPUT_INTERVAL
            && libm::fabs(passed_turns - f64::from(turns)) <= TURNS_TOLERANCE;
        let before = core::mem::replace(&mut self.latest, is_counted.then_some(turns));
        is_counted && before == Some(turns)
    }

    /// So many telegrams and so many turns later.
    fn add(&mut self, telegrams: u16, turns: u16) {
        // Where telegrams are missing, nobody knows which turns they stood for; a counter that stands counts nothing.
        if telegrams == 1 && (1..=MAX_TURNS).contains(&turns) {
            self.telegrams += 1;
            self.turns += u64::from(turns);
            self.least = Some(self.least.map_or(turns, |least| least.min(turns)));
        }
    }
}

/// True for what a scanner's frequency can be.
fn is_frequency(frequency_hz: f64) -> bool {
    (0.01..=10_000.0).contains(&frequency_hz)
}

/// The period a stated frequency stands for, seconds.
pub fn nominal_period_s(frequency_hz: f64) -> f64 {
    if is_frequency(frequency_hz) { 1.0 / frequency_hz } else { FALLBACK_PERIOD_S }
}

#[cfg(test)]
mod tests;
