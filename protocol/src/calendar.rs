//! Days and dates: the civil (Gregorian) calendar from 1970 on.
//!
//! The algorithms are H. Hinnant's ("chrono-compatible low-level date algorithms"): the year begins with March, so that the leap day comes
//! last.

const DAYS_PER_400_YEARS: i64 = 146_097;
/// Days from 0000-03-01 to 1970-01-01.
const EPOCH_DAY: i64 = 719_468;
/// Seconds of a day without leap second.
pub const SECONDS_PER_DAY: u64 = 86_400;

/// A day of the calendar.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Date {
    /// Year.
    pub year: i64,
    /// 1..=12.
    pub month: u8,
    /// 1..=31.
    pub day: u8,
}

impl Date {
    /// The date `days` days after 1970-01-01.
    ///
    /// ```
    /// use rowscan_protocol::calendar::Date;
    /// assert_eq!(Date::of_day(19_782), Date { year: 2024, month: 2, day: 29 });
    /// ```
    pub fn of_day(days: i64) -> Self {
        let day = days + EPOCH_DAY;
        let era = day.div_euclid(DAYS_PER_400_YEARS);
        let of_era = day.rem_euclid(DAYS_PER_400_YEARS);
        let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
        let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
        let march_month = (5 * of_year + 2) / 153;
        let day_of_month = of_year - (153 * march_month + 2) / 5 + 1;
        let month = if march_month < 10 { march_month + 3 } else { march_month - 9 };
        let year = era * 400 + year_of_era + i64::from(month <= 2);
        Self { year, month: month as u8, day: day_of_month as u8 }
    }

    /// Days since 1970-01-01: the inverse of [`Date::of_day`]. A day that its month does not have counts on into the next: 31 April is 1 May.
    pub fn days(self) -> i64 {
        let year = self.year - i64::from(self.month <= 2);
        let march_month = (i64::from(self.month) + 9) % 12;
        let of_year = (153 * march_month + 2) / 5 + i64::from(self.day) - 1;
        let of_era = year.rem_euclid(400);
        let of_era = of_era * 365 + of_era / 4 - of_era / 100 + of_year;
        year.div_euclid(400) * DAYS_PER_400_YEARS + of_era - EPOCH_DAY
    }

    /// False for 31 April, 29 February 2023 and the like.
    pub fn exists(self) -> bool {
        (1..=12).contains(&self.month) && self.day >= 1 && Self::of_day(self.days()) == self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_of_eight_centuries_follows_the_one_before() {
        let mut before = Date::of_day(-1);
        assert_eq!(before, Date { year: 1969, month: 12, day: 31 });
        for day in 0..8 * 36_525 {
            let date = Date::of_day(day);
            assert!(date > before && date.exists(), "{date:?} after {before:?}");
            assert_eq!(date.days(), day);
            before = date;
        }
    }

    #[test]
    fn days_that_do_not_exist_are_told_apart() {
        for (year, month, day) in
            [(2023, 2, 29), (2100, 2, 29), (2024, 4, 31), (2024, 13, 1), (2024, 0, 1), (2024, 1, 0)]
        {
            assert!(!Date { year, month, day }.exists(), "{year}-{month}-{day}");
        }
        assert!(Date { year: 2000, month: 2, day: 29 }.exists());
    }
}
