//! GGA, RMC, VTG, ZDA, HDT, GST, GSA: a fix in words. Angles, digits and order as NMEA 0183 4.1 has them.

use std::fmt::Write;

use rowscan_protocol::calendar::Date;
use rowscan_protocol::nmea::checksum;
use rowscan_vehicle::gnss::{Fix, FixQuality};

/// A sentence: its name and what it says of a fix, without `$`, talker and checksum.
#[derive(Clone, Copy, Debug)]
pub struct Sentence {
    /// Three letters.
    pub name: &'static str,
    fields: fn(&Fix) -> String,
    /// Bytes it takes on the line at most, `$` to line end.
    pub longest: usize,
    /// Sent once a second, as real receivers do, so that a line of 38400 bit/s still carries ten epochs a second.
    pub once_a_second: bool,
}

/// All sentences, in the order they are sent in.
pub const SENTENCES: &[Sentence] = &[
    Sentence { name: "GGA", fields: gga, longest: 92, once_a_second: false },
    Sentence { name: "RMC", fields: rmc, longest: 84, once_a_second: false },
    Sentence { name: "VTG", fields: vtg, longest: 48, once_a_second: false },
    Sentence { name: "ZDA", fields: zda, longest: 38, once_a_second: false },
    Sentence { name: "HDT", fields: hdt, longest: 20, once_a_second: false },
    Sentence { name: "GST", fields: gst, longest: 64, once_a_second: true },
    Sentence { name: "GSA", fields: gsa, longest: 76, once_a_second: true },
];

impl Sentence {
    /// The whole sentence with its line end, appended.
    pub fn write(&self, fix: &Fix, out: &mut String) {
        let body = format!("GN{},{}", self.name, (self.fields)(fix));
        let _ = write!(out, "${body}*{:02X}\r\n", checksum(&body));
    }
}

/// Digits of a minute of arc: 2·10⁻⁷ minutes are 0.4 mm. As with real receivers of that precision, GGA is then longer than the 82
/// characters of NMEA 0183.
const MINUTE_DIGITS: usize = 7;

fn known(fix: &Fix) -> bool {
    fix.quality != FixQuality::None
}

fn date(fix: &Fix) -> Date {
    Date::of_day(centiseconds(fix).div_euclid(8_640_000))
}

fn centiseconds(fix: &Fix) -> i64 {
    (fix.unix_s * 100.0).round() as i64
}

/// hhmmss.ss
fn time(fix: &Fix) -> String {
    let centi = centiseconds(fix).rem_euclid(8_640_000);
    let (second, centi) = (centi / 100, centi % 100);
    format!("{:02}{:02}{:02}.{centi:02}", second / 3600, second / 60 % 60, second % 60)
}

/// ddmm.mmmmmmm,N — or two empty fields.
fn angle(fix: &Fix, deg: f64, digits: usize, [positive, negative]: [char; 2]) -> String {
    if !known(fix) {
        return ",".to_owned();
    }
    let scale = 10f64.powi(MINUTE_DIGITS as i32);
    // Rounded as one number, so that no minute ever reads 60.
    let minutes = (deg.abs() * 60.0 * scale).round() / scale;
    let (degrees, minutes) = ((minutes / 60.0).floor(), minutes - (minutes / 60.0).floor() * 60.0);
    let width = 3 + MINUTE_DIGITS;
    let side = if deg < 0.0 { negative } else { positive };
    format!("{degrees:0digits$}{minutes:0width$.prec$},{side}", prec = MINUTE_DIGITS)
}

fn latitude(fix: &Fix) -> String {
    angle(fix, fix.latitude_deg, 2, ['N', 'S'])
}

fn longitude(fix: &Fix) -> String {
    angle(fix, fix.longitude_deg, 3, ['E', 'W'])
}

/// A number while there is a fix.
fn number(fix: &Fix, value: f64, digits: usize) -> String {
    if known(fix) { format!("{value:.digits$}") } else { String::new() }
}

/// Degrees in [0, 360), also after rounding.
fn degrees(fix: &Fix, deg: f64) -> String {
    number(fix, (deg * 100.0).round().rem_euclid(36_000.0) / 100.0, 2)
}

fn gga(fix: &Fix) -> String {
    let corrected =
        matches!(fix.quality, FixQuality::Differential | FixQuality::RtkFixed | FixQuality::RtkFloat);
    format!(
        "{},{},{},{},{:02},{:.1},{},M,{},M,{},{}",
        time(fix),
        latitude(fix),
        longitude(fix),
        fix.quality.code(),
        fix.satellites,
        fix.hdop,
        number(fix, fix.altitude_m, 3),
        number(fix, fix.geoid_m, 1),
        if corrected { "1.0" } else { "" },
        if corrected { "0000" } else { "" },
    )
}

/// Positioning system mode indicator.
fn mode(fix: &Fix) -> char {
    match fix.quality {
        FixQuality::None => 'N',
        FixQuality::Gps => 'A',
        FixQuality::Differential => 'D',
        FixQuality::RtkFixed => 'R',
        FixQuality::RtkFloat => 'F',
    }
}

/// Knots a metre a second: a nautical mile is 1852 m.
const KNOTS: f64 = 3600.0 / 1852.0;

fn rmc(fix: &Fix) -> String {
    let Date { year, month, day } = date(fix);
    format!(
        "{},{},{},{},{},{},{day:02}{month:02}{:02},,,{}",
        time(fix),
        if known(fix) { 'A' } else { 'V' },
        latitude(fix),
        longitude(fix),
        number(fix, fix.speed_m_s * KNOTS, 3),
        degrees(fix, fix.course_deg),
        year % 100,
        mode(fix)
    )
}

fn vtg(fix: &Fix) -> String {
    format!(
        "{},T,,M,{},N,{},K,{}",
        degrees(fix, fix.course_deg),
        number(fix, fix.speed_m_s * KNOTS, 3),
        number(fix, fix.speed_m_s * 3.6, 3),
        mode(fix)
    )
}

fn zda(fix: &Fix) -> String {
    let Date { year, month, day } = date(fix);
    format!("{},{day:02},{month:02},{year:04},00,00", time(fix))
}

fn hdt(fix: &Fix) -> String {
    format!("{},T", degrees(fix, fix.heading_deg))
}

/// Standard deviations of the position that a receiver claims at a quality: along the ground in one direction, and in height, metres.
/// What receivers of the field typically claim (assumed); the noise of the scene is not told.
fn deviation_m(fix: &Fix) -> (f64, f64) {
    let ground_m = match fix.quality {
        FixQuality::None | FixQuality::Gps => 1.5,
        FixQuality::Differential => 0.5,
        FixQuality::RtkFloat => 0.2,
        FixQuality::RtkFixed => 0.01,
    };
    (ground_m, 2.0 * ground_m)
}

/// Error statistics: the ellipse of the position is a circle. Without it some programs make up an error from the dilution alone.
fn gst(fix: &Fix) -> String {
    let (ground_m, height_m) = deviation_m(fix);
    let ground = number(fix, ground_m, 3);
    let angle = if known(fix) { "0.0" } else { "" };
    format!("{},{ground},{ground},{ground},{angle},{ground},{ground},{}", time(fix), number(fix, height_m, 3))
}

/// Satellites that one sentence has room for.
const GSA_SATELLITES: u8 = 12;
/// Vertical dilution over the horizontal one: typical, as the height noise is over the ground noise.
const VERTICAL_DILUTION: f64 = 2.0;

/// Dilution, and numbers of satellites: those of GPS, from 1 on, as many as there is room for.
fn gsa(fix: &Fix) -> String {
    let used = fix.satellites.min(GSA_SATELLITES);
    let numbers: String = (1..=GSA_SATELLITES)
        .map(|number| if number <= used { format!("{number:02},") } else { ",".to_owned() })
        .collect();
    let vdop = (fix.hdop * VERTICAL_DILUTION).min(99.9);
    let pdop = (fix.hdop.hypot(vdop)).min(99.9);
    let mode = if known(fix) { 3 } else { 1 };
    // System 1 is GPS.
    format!("A,{mode},{numbers}{pdop:.1},{:.1},{vdop:.1},1", fix.hdop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rowscan_protocol::time::SimTime;
    use rowscan_vehicle::gnss::{Gnss, Receiver};
    use rowscan_vehicle::trajectory::Trajectory;

    fn fix(gnss: Gnss) -> Fix {
        Receiver::new(gnss, 1).fix(SimTime(1_500_000_000), &Trajectory::straight(0.0, 2.0).at(1.5))
    }

    fn told(name: &str, fix: &Fix) -> String {
        let mut text = String::new();
        SENTENCES.iter().find(|sentence| sentence.name == name).unwrap().write(fix, &mut text);
        text
    }

    #[test]
    fn sentences_say_the_fix() {
        let fix = Fix { latitude_deg: -41.5, longitude_deg: 0.8765, ..fix(Gnss::default()) };
        assert_eq!(
            told("GGA", &fix),
            "$GNGGA,060001.50,4130.0000000,S,00052.5900000,E,4,14,0.7,202.500,M,50.0,M,1.0,0000*48\r\n"
        );
        assert!(
            told("RMC", &fix)
                .starts_with("$GNRMC,060001.50,A,4130.0000000,S,00052.5900000,E,3.888,0.00,010526,,,R*")
        );
        assert!(told("VTG", &fix).starts_with("$GNVTG,0.00,T,,M,3.888,N,7.200,K,R*"));
        assert!(told("ZDA", &fix).starts_with("$GNZDA,060001.50,01,05,2026,00,00*"));
        assert!(told("HDT", &fix).starts_with("$GNHDT,0.00,T*"));
        assert!(told("GST", &fix).starts_with("$GNGST,060001.50,0.010,0.010,0.010,0.0,0.010,0.010,0.020*"));
        let gsa = "$GNGSA,A,3,01,02,03,04,05,06,07,08,09,10,11,12,1.6,0.7,1.4,1*";
        assert!(told("GSA", &fix).starts_with(gsa), "{}", told("GSA", &fix));
    }

    #[test]
    fn without_a_fix_fields_are_empty() {
        let fix = fix(Gnss { quality: FixQuality::None, ..Gnss::default() });
        assert!(told("GGA", &fix).starts_with("$GNGGA,060001.50,,,,,0,00,99.9,,M,,M,,*"));
        assert!(told("RMC", &fix).contains(",V,,,,,,,010526,,,N*"));
        assert!(told("GST", &fix).starts_with("$GNGST,060001.50,,,,,,,*"));
        assert!(told("GSA", &fix).starts_with("$GNGSA,A,1,,,,,,,,,,,,,99.9,99.9,99.9,1*"));
    }

    #[test]
    fn no_sentence_is_longer_than_its_line() {
        let gnss = Gnss {
            latitude_deg: -79.99,
            longitude_deg: -179.99,
            altitude_m: 8999.0,
            geoid_m: -149.0,
            ..Gnss::default()
        };
        let fix = Fix { speed_m_s: 19.9, course_deg: 359.99, heading_deg: 359.99, ..fix(gnss) };
        for sentence in SENTENCES {
            let mut text = String::new();
            sentence.write(&fix, &mut text);
            assert!(text.len() <= sentence.longest, "{} has {} bytes", sentence.name, text.len());
        }
    }

    #[test]
    fn minutes_and_degrees_never_read_their_end() {
        let fix = Fix { latitude_deg: 41.999_999_999_999, heading_deg: 359.999, ..fix(Gnss::default()) };
        assert!(told("GGA", &fix).contains(",4200.0000000,N,"));
        assert!(told("HDT", &fix).contains(",0.00,T"));
    }
}
