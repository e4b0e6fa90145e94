//! Ground speed out of somebody's NMEA: VTG for its amount, HDT against VTG's course for its sign.

use rowscan_protocol::nmea;

/// Keeps what the sentences of one receiver say.
#[derive(Clone, Debug, Default)]
pub struct SpeedReader {
    heading_deg: Option<f64>,
}

impl SpeedReader {
    /// A line without its end. `Some` if it tells the speed: m/s, negative in reverse; `Some(None)` if it tells that there is none.
    ///
    /// Lines with a wrong checksum, other sentences and nonsense are passed over.
    pub fn line(&mut self, line: &str) -> Option<Option<f64>> {
        let mut fields = nmea::sentence(line)?.split(',');
        let name = fields.next()?;
        let number = |field: Option<&str>| field.and_then(|field| field.parse::<f64>().ok());
        match name.get(2..)? {
            "HDT" => {
                self.heading_deg = number(fields.next());
                None
            }
            "VTG" => {
                let course_deg = number(fields.next());
                let speed_m_s = number(fields.nth(5)).filter(|kmh| kmh.is_finite()).map(|kmh| kmh / 3.6);
                let turned =
                    self.heading_deg.zip(course_deg).map(|(heading, course)| (course - heading).abs());
                let reverse = turned.is_some_and(|turned| (90.0..270.0).contains(&turned));
                Some(speed_m_s.map(|speed_m_s| if reverse { -speed_m_s } else { speed_m_s }))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nmea::SENTENCES;
    use rowscan_protocol::time::SimTime;
    use rowscan_vehicle::gnss::{FixQuality, Gnss, Receiver};
    use rowscan_vehicle::trajectory::Trajectory;

    fn heard(gnss: Gnss, speed_m_s: f64) -> Vec<Option<f64>> {
        let motion = Trajectory::straight(0.0, speed_m_s).at(3.0);
        let fix = Receiver::new(gnss, 1).fix(SimTime(3_000_000_000), &motion);
        let mut text = String::new();
        // Twice, as the heading comes behind the course.
        for sentence in SENTENCES.iter().chain(SENTENCES) {
            sentence.write(&fix, &mut text);
        }
        let mut reader = SpeedReader::default();
        text.lines().filter_map(|line| reader.line(line)).collect()
    }

    #[test]
    fn it_hears_what_the_virtual_receiver_says() {
        let last = |gnss, speed| heard(gnss, speed).last().copied().flatten();
        assert!((last(Gnss::default(), 1.25).unwrap() - 1.25).abs() < 2e-4);
        assert!((last(Gnss::default(), -0.5).unwrap() + 0.5).abs() < 2e-4);
        let lost = Gnss { quality: FixQuality::None, ..Gnss::default() };
        assert_eq!(heard(lost, 1.0), [None, None]);
    }

    #[test]
    fn wrong_sums_and_nonsense_are_passed_over() {
        let mut reader = SpeedReader::default();
        for line in ["", "$", "$GNVTG,1*00", "GNVTG", "$GNVTG,0.00,T,,M,3.888,N,7.200,K,R*FF", "$é*00"] {
            assert_eq!(reader.line(line), None, "{line}");
        }
    }
}
