//! The device's calendar: µs since 1970 to year, month, day, and back.

use crate::telegram::DateTime;

const US_PER_SECOND: u64 = 1_000_000;
const SECONDS_PER_DAY: u64 = 86_400;
const DAYS_PER_400_YEARS: u64 = 146_097;
/// Days from 0000-03-01 to 1970-01-01.
const EPOCH_DAY: u64 = 719_468;

/// The date and time `us` microseconds after 1970-01-01 00:00.
pub(super) fn date_time(us: u64) -> DateTime {
    let seconds = us / US_PER_SECOND;
    let (year, month, day) = date(seconds / SECONDS_PER_DAY);
    let second = seconds % SECONDS_PER_DAY;
    DateTime {
        year,
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
    let in_range = (1970..=9999).contains(&t.year)
        && (1..=12).contains(&t.month)
        && t.day >= 1
        && t.hour < 24
        && t.minute < 60
        && t.second < 60
        && u64::from(t.microsecond) < US_PER_SECOND;
    if !in_range {
        return None;
    }
    let day = days(t.year, t.month, t.day);
    // The 31st of a month with 30 days comes back as the 1st of the next.
    if date(day) != (t.year, t.month, t.day) {
        return None;
    }
    let second = u64::from(t.hour) * 3600 + u64::from(t.minute) * 60 + u64::from(t.second);
    Some((day * SECONDS_PER_DAY + second) * US_PER_SECOND + u64::from(t.microsecond))
}

/// Year, month and day of a day since 1970 (H. Hinnant, "chrono-compatible low-level date algorithms"): the
/// year begins with March, so that the leap day comes last.
fn date(day: u64) -> (u16, u8, u8) {
    let day = day + EPOCH_DAY;
    let era = day / DAYS_PER_400_YEARS;
    let of_era = day % DAYS_PER_400_YEARS;
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let march_month = (5 * of_year + 2) / 153;
    let day_of_month = of_year - (153 * march_month + 2) / 5 + 1;
    let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    (year as u16, month as u8, day_of_month as u8)
}

/// Days from 1970-01-01; the inverse of [`date`] for dates that exist.
fn days(year: u16, month: u8, day: u8) -> u64 {
    let year = u64::from(year) - u64::from(month <= 2);
    let march_month = (u64::from(month) + 9) % 12;
    let of_year = (153 * march_month + 2) / 5 + u64::from(day) - 1;
    let of_era = year % 400 * 365 + year % 400 / 4 - year % 400 / 100 + of_year;
    year / 400 * DAYS_PER_400_YEARS + of_era - EPOCH_DAY
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
