//! NMEA 0183: sentences held to their checksums, and positions out of a receiver's bytes, in whatever pieces they come.

/// Longer lines are nobody's: a sentence is 82 characters by the standard, some receivers' a little more.
const LONGEST: usize = 256;

/// Where the antenna was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fix {
    /// Degrees, north positive.
    pub(crate) latitude_deg: f64,
    /// Degrees, east positive.
    pub(crate) longitude_deg: f64,
    /// Above the ellipsoid: the height that GGA has over mean sea level and the geoid's own.
    pub(crate) altitude_m: f64,
}

/// Cuts a receiver's bytes into lines.
#[derive(Debug, Default)]
pub struct Lines {
    bytes: Vec<u8>,
}

impl Lines {
    /// Takes the next bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole line with its end; what is no text is passed over.
    pub fn next_line(&mut self) -> Option<String> {
        loop {
            let Some(end) = self.bytes.iter().position(|byte| *byte == b'\n') else {
                if self.bytes.len() > LONGEST {
                    self.bytes.clear();
                }
                return None;
            };
            if let Ok(line) = String::from_utf8(self.bytes.drain(..=end).collect()) {
                return Some(line);
            }
        }
    }
}

/// Finds fixes in a receiver's bytes.
#[derive(Debug, Default)]
pub(crate) struct FixReader(Lines);

impl FixReader {
    /// Takes the next bytes.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.0.push(bytes);
    }

    /// The next fix; sentences without one, and lines with a wrong checksum, are passed over.
    pub(crate) fn next_fix(&mut self) -> Option<Fix> {
        std::iter::from_fn(|| self.0.next_line()).find_map(|line| fix(&line))
    }
}

/// What stands between `$` and `*` of a sentence; none of a line that is no sentence, or whose checksum is wrong.
pub fn sentence(line: &str) -> Option<&str> {
    let (body, sum) = line.trim().strip_prefix('$')?.split_once('*')?;
    (u8::from_str_radix(sum, 16) == Ok(checksum(body))).then_some(body)
}

/// The exclusive or of all its bytes.
pub fn checksum(body: &str) -> u8 {
    body.bytes().fold(0, |sum, byte| sum ^ byte)
}

/// `$..GGA,time,lat,N,lon,E,quality,satellites,hdop,height,M,geoid,M,age,station*sum`
fn fix(line: &str) -> Option<Fix> {
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
    Some(Fix {
        latitude_deg: angle(2, 2, "S")?,
        longitude_deg: angle(4, 3, "W")?,
        altitude_m: field(9).parse::<f64>().ok()? + field(11).parse().unwrap_or(0.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sentence(body: &str) -> String {
        format!("${body}*{:02X}\r\n", checksum(body))
    }

    #[test]
    fn the_checksum_is_that_of_published_sentences() {
        // The examples of the `nmea` crate's and pynmea2's own documentation.
        for line in [
            "$GPGGA,184353.07,1929.045,S,02410.506,E,1,04,2.6,100.00,M,-33.9,M,,0000*6D",
            "$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n",
        ] {
            assert!(super::sentence(line).is_some_and(|body| body.starts_with("GPGGA")), "{line}");
            assert_eq!(super::sentence(&line.replace("GGA", "GGB")), None);
        }
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
        let mut reader = FixReader::default();
        reader.push(&[b'x'; 10_000]);
        assert_eq!((reader.next_fix(), reader.0.bytes.len()), (None, 0));
    }
}
