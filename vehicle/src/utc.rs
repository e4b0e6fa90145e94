//! Instants of UTC as GPX files and scene files write them.

use rowscan_protocol::calendar::Date;

/// Seconds since 1970 of `2026-05-01T06:00:00.5Z`, UTC.
pub(crate) fn utc_seconds(text: &str) -> Option<f64> {
    let (date, time) = text.strip_suffix('Z')?.split_once('T')?;
    let mut date = date.splitn(3, '-');
    let (year, month, day): (i64, u8, u8) =
        (date.next()?.parse().ok()?, date.next()?.parse().ok()?, date.next()?.parse().ok()?);
    let mut time = time.splitn(3, ':');
    let (hour, minute): (i64, i64) = (time.next()?.parse().ok()?, time.next()?.parse().ok()?);
    let second: f64 = time.next()?.parse().ok()?;
    let date = Date { year, month, day };
    let sound = (1970..10_000).contains(&year)
        && date.exists()
        && (0..24).contains(&hour)
        && (0..60).contains(&minute)
        && (0.0..60.0).contains(&second);
    sound.then(|| (date.days() * 86_400 + hour * 3600 + minute * 60) as f64 + second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calendar_days_are_counted_right() {
        assert_eq!(utc_seconds("1970-01-01T00:00:00Z"), Some(0.0));
        assert_eq!(utc_seconds("2024-02-29T12:00:00Z"), Some(1_709_208_000.0));
        for none in
            ["2024-13-01T00:00:00Z", "2026-02-30T00:00:00Z", "2025-02-29T12:00:00Z", "2026-04-31T06:00:00Z"]
        {
            assert_eq!(utc_seconds(none), None, "{none}");
        }
        // A leap second would be the first of the next day.
        assert_eq!(utc_seconds("2016-12-31T23:59:60Z"), None);
    }
}
