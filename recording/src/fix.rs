//! Positions out of a GNSS receiver's bytes, in whatever pieces they come.

use rowscan_protocol::nmea::{NmeaLines, sentence};

/// Where the antenna was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// Degrees, north positive.
    pub latitude_deg: f64,
    /// Degrees, east positive.
    pub longitude_deg: f64,
    /// Above the ellipsoid: the height that GGA has over mean sea level and the geoid's own.
    pub altitude_m: f64,
}

/// A GGA sentence with a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gga {
    /// The position.
    pub fix: Fix,
    /// How it was determined, by NMEA 0183: 1 by satellites alone, 2 with corrections, 4 and 5 with carrier phases (fixed, float), 6 estimated.
    pub quality: u8,
    /// Time of day, seconds since midnight UTC.
    pub utc_s: Option<f64>,
}

/// Finds fixes in a receiver's bytes.
#[derive(Debug, Default)]
pub struct FixReader(NmeaLines);

impl FixReader {
    /// Takes the next bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.0.push(bytes);
    }

    /// The next fix; sentences without one, and lines with a wrong checksum, are passed over.
    pub fn next_fix(&mut self) -> Option<Fix> {
        self.next_gga().map(|gga| gga.fix)
    }

    /// The same, with how it was determined.
    pub fn next_gga(&mut self) -> Option<Gga> {
        std::iter::from_fn(|| self.0.next_line()).find_map(|line| gga(&line))
    }
}

/// `$..GGA,time,lat,N,lon,E,quality,satellites,hdop,height,M,geoid,M,age,station*sum`
fn gga(line: &str) -> Option<Gga> {
    let fields: Vec<&str> = sentence(line)?.split(',').collect();
    let field = |at: usize| fields.get(at).copied().unwrap_or_default();
    if field(0).get(2..) != Some("GGA") || matches!(field(6), "" | "0") {
        return None;
    }
    let angle = |at: usize, digits: usize, negative: &str| {
        let text = field(at);
        let degrees: f64 = text.get(..digits)?.parse().ok()?;
        let minutes: f64 = text.get(digits..)?.parse().ok()?;
        let angle = degrees + minutes / 60.0;
        Some(if field(at + 1) == negative { -angle } else { angle })
    };
    let fix = Fix {
        latitude_deg: angle(2, 2, "S")?,
        longitude_deg: angle(4, 3, "W")?,
        altitude_m: field(9).parse::<f64>().ok()? + field(11).parse().unwrap_or(0.0),
    };
    let clock = field(1);
    let part = |range| clock.get(range).and_then(|digits: &str| digits.parse::<f64>().ok());
    let utc_s = part(0..2).zip(part(2..4)).zip(clock.get(4..).and_then(|s| s.parse::<f64>().ok()));
    let utc_s = utc_s.map(|((hours, minutes), seconds)| 3600.0 * hours + 60.0 * minutes + seconds);
    Some(Gga { fix, quality: field(6).parse().ok()?, utc_s })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::nmea::checksum;

    fn sentence(body: &str) -> String {
        format!("${body}*{:02X}\r\n", checksum(body))
    }

    #[test]
    fn gga_is_read_in_any_pieces_and_nothing_else_is() {
        let good =
            sentence("GNGGA,101500.00,4136.0000000,N,00050.4000000,W,4,12,0.6,250.125,M,50.5,M,1.0,0000");
        let text = [
            sentence("GNRMC,101500.00,A,4136.0,N,00050.4,E,1.9,0.0,010126,,,R"),
            good.clone(),
            good.replace("4136", "4137"),
            sentence("GNGGA,101500.00,,,,,0,00,99.9,,M,,M,,"),
            good.clone(),
        ]
        .concat();
        let expected = Fix { latitude_deg: 41.6, longitude_deg: -0.84, altitude_m: 300.625 };
        for piece in [1, 7, 1000] {
            let (mut reader, mut fixes) = (FixReader::default(), Vec::new());
            for bytes in text.as_bytes().chunks(piece) {
                reader.push(bytes);
                fixes.extend(std::iter::from_fn(|| reader.next_fix()));
            }
            assert_eq!(fixes, [expected, expected], "{piece} bytes at a time");
        }
    }
}
