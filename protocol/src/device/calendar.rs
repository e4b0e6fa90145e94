//! The device's calendar: µs since 1970 to year, month, day, and back.

use crate::calendar::{Date, SECONDS_PER_DAY};
use crate::telegram::DateTime;

const US_PER_SECOND: u64 = 1_000_000;

/// The date and time `us` microseconds after 1970-01-01 00:00.
pub(super) fn date_time(us: u64) -> DateTime {
    let seconds = us / US_PER_SECOND;
    let Date { year, month, day } = Date::of_day((seconds / SECONDS_PER_DAY) as i64);
    let second = seconds % SECONDS_PER_DAY;
    DateTime {
        year: year as u16,
        month,
        day,
        hour: (second / 3600) as u8,
        minute: (second / 60 % 60) as u8,
        second: (second % 60) as u8,
        // Recorded devices tell whole milliseconds.
        microsecond: (us % US_PER_SECOND / 1000 * 1000) as u32,
    }
}

/// µs since 1970-01-01 00:00; none for a date that does not exist or lies before.
pub(super) fn microseconds(t: &DateTime) -> Option<u64> {
    let date = Date { year: i64::from(t.year), month: t.month, day: t.day };
    let in_range = (1970..=9999).contains(&t.year)
        && date.exists()
        && t.hour < 24
        && t.minute < 60
        && t.second < 60
        && u64::from(t.microsecond) < US_PER_SECOND;
    if !in_range {
        return None;
    }
    let day = u64::try_from(date.days()).ok()?;
    let second = u64::from(t.hour) * 3600 + u64::from(t.minute) * 60 + u64::from(t.second);
    Some((day * SECONDS_PER_DAY + second) * US_PER_SECOND + u64::from(t.microsecond))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(year: u16, month: u8, day: u8) -> DateTime {
        DateTime { year, month, day, ..DateTime::default() }
    }

    #[test]
    fn known_dates() {
        for (seconds, expected) in [
            (0, at(1970, 1, 1)),
            (951_782_400, at(2000, 2, 29)),
            (1_709_164_800, at(2024, 2, 29)),
            (1_709_251_200, at(2024, 3, 1)),
            (4_107_542_400, at(2100, 3, 1)),
        ] {
            assert_eq!(date_time(seconds * US_PER_SECOND), expected);
            assert_eq!(microseconds(&expected), Some(seconds * US_PER_SECOND));
        }
    }

    #[test]
    fn dates_that_do_not_exist_are_refused() {
        for date in [
            at(2023, 2, 29),
            at(2100, 2, 29),
            at(2024, 4, 31),
            at(2024, 13, 1),
            at(2024, 0, 1),
            at(1969, 1, 1),
        ] {
            assert_eq!(microseconds(&date), None, "{date:?}");
        }
    }
}
