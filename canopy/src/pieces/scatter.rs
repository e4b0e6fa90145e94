//! How far single pieces of a row are off, and how unlike they are: the pieces study's table.

use std::sync::LazyLock;

/// One line a count, width of the beams, model and distance. The first lines say by which command, and when.
static TABLE: &str = include_str!("../../pieces.csv");

/// Shortest and longest piece that the power law of a length is used for, metres.
const LENGTHS_M: [f64; 2] = [0.25, 8.0];

/// A standard deviation, in units of the row's mean leaf area a metre, of pieces of any length: `at_1m` · length ^ −`exponent`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ByLength {
    /// Of pieces of 1 m.
    pub at_1m: f64,
    /// By how much longer pieces scatter less: 0.5 where metres are independent of each other.
    pub exponent: f64,
}

impl ByLength {
    /// Of pieces of this length, metres.
    pub fn of(&self, length_m: f64) -> f64 {
        let [shortest_m, longest_m] = LENGTHS_M;
        self.at_1m * length_m.clamp(shortest_m, longest_m).powf(-self.exponent)
    }
}

/// What the study saw of pieces that were measured one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PieceScatter {
    /// What a hit counts: `contact` or `share`.
    pub count: &'static str,
    /// `rays`, or `eye` for beams with a width.
    pub beams: &'static str,
    /// The scanner's model.
    pub model: &'static str,
    /// From the mirror to the row plane, metres.
    pub distance_m: f64,
    /// Of estimates about the truth, both over their row's mean.
    pub error: ByLength,
    /// Of the truth about its row's mean.
    pub truth: ByLength,
}

impl PieceScatter {
    /// The whole table.
    pub fn table() -> &'static [Self] {
        static LINES: LazyLock<Vec<PieceScatter>> =
            LazyLock::new(|| TABLE.lines().filter_map(read).collect());
        &LINES
    }

    /// The line for pieces measured like this: of the model, or, where the table does not have it, of the model whose pieces are farthest off; of the nearest distance.
    /// `None` where nothing was measured that way.
    pub fn find(count: &str, beams: &str, model: &str, distance_m: f64) -> Option<&'static Self> {
        let alike = || Self::table().iter().filter(|line| line.count == count && line.beams == beams);
        let apart = |line: &Self| (line.distance_m / distance_m).ln().abs();
        let nearest = |lines: &mut dyn Iterator<Item = &'static Self>| {
            lines.min_by(|a, b| apart(a).total_cmp(&apart(b)).then(b.error.at_1m.total_cmp(&a.error.at_1m)))
        };
        nearest(&mut alike().filter(|line| line.model.eq_ignore_ascii_case(model)))
            .or_else(|| nearest(&mut alike()))
    }
}

fn read(line: &'static str) -> Option<PieceScatter> {
    let mut fields = line.split(',');
    let (count, beams, model) = (fields.next()?, fields.next()?, fields.next()?);
    let mut number = || fields.next()?.parse::<f64>().ok().filter(|value| value.is_finite());
    Some(PieceScatter {
        count,
        beams,
        model,
        distance_m: number()?,
        error: ByLength { at_1m: number()?, exponent: number()? },
        truth: ByLength { at_1m: number()?, exponent: number()? },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_table_is_read_and_the_first_say_where_it_comes_from() {
        let lines = || TABLE.lines().filter(|line| !line.starts_with('#') && !line.starts_with("count"));
        assert!(lines().count() > 0);
        for line in lines() {
            let read = read(line).unwrap_or_else(|| panic!("cannot read {line}"));
            assert!(
                ["contact", "share"].contains(&read.count) && ["rays", "eye"].contains(&read.beams),
                "{line}"
            );
            let sds = [read.error.at_1m, read.truth.at_1m, read.error.exponent, read.truth.exponent];
            assert!(read.distance_m > 0.0 && sds.iter().all(|sd| (0.0..1.0).contains(sd)), "{line}");
        }
        assert!(TABLE.lines().any(|line| line.starts_with("# rowscan study pieces")));
    }

    #[test]
    fn a_model_that_was_not_studied_gets_the_line_of_the_worst_at_the_nearest_distance() {
        let found = PieceScatter::find("contact", "eye", "lms111", 2.1).unwrap();
        assert_eq!((found.model, found.distance_m), ("lms111", 2.0));
        let other = PieceScatter::find("contact", "eye", "no such model", 2.1).unwrap();
        assert!(other.distance_m == 2.0 && other.error.at_1m >= found.error.at_1m);
        assert_eq!(PieceScatter::find("gap", "eye", "lms111", 2.0), None);
    }

    #[test]
    fn longer_pieces_scatter_less() {
        let law = ByLength { at_1m: 0.2, exponent: 0.5 };
        assert!((law.of(4.0) - 0.1).abs() < 1e-12);
        assert_eq!(law.of(0.0), law.of(0.25), "never without bound");
    }
}
