//! `field.csv`: what was measured by hand, a piece a line.

use serde::Deserialize;

/// A piece of row whose leaf area was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredPiece {
    /// The line of the sheet, from 1.
    pub line: u64,
    /// The file of its scans, from the sheet's folder; `#STREAM` behind it where it holds several.
    pub recording: String,
    /// Its beginning along the row, as the estimate counts, metres.
    pub from_m: f64,
    /// Its end, metres.
    pub to_m: f64,
    /// Its one-sided leaf area, m².
    pub leaf_area_m2: f64,
}

#[derive(Deserialize)]
struct Line {
    recording: String,
    from_m: f64,
    to_m: f64,
    leaf_area_m2: f64,
}

/// Why a text is no sheet.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SheetError {
    /// A line is not what it should be.
    #[error(
        "line {line}: {why}; expected the columns recording, from_m, to_m, leaf_area_m2 (others are passed over)"
    )]
    Line {
        /// Which, from 1.
        line: u64,
        /// What is wrong.
        why: String,
    },
    /// A number that no piece has.
    #[error("line {line}: `{key}`: expected {expected}, found {found}")]
    Value {
        /// Which line, from 1.
        line: u64,
        /// The column.
        key: &'static str,
        /// The values allowed.
        expected: &'static str,
        /// The value found.
        found: f64,
    },
    /// Two pieces have row in common.
    #[error("lines {first} and {second} measure some of the same row; leave one out")]
    Overlap {
        /// The first.
        first: u64,
        /// The second.
        second: u64,
    },
    /// There is none.
    #[error("expected a piece a line below recording,from_m,to_m,leaf_area_m2; found none")]
    Empty,
}

/// Reads a sheet: CSV with the columns `recording`, `from_m`, `to_m`, `leaf_area_m2`; lines that begin with `#` are comments.
///
/// # Errors
/// The first line that is wrong.
pub fn read(text: &str) -> Result<Vec<MeasuredPiece>, SheetError> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    // The reader's own numbers of lines leave comments out.
    let rows = (1..).zip(text.lines()).filter(|(_, row)| !row.trim().is_empty() && !row.starts_with('#'));
    let mut numbers = rows.map(|(number, _)| number).skip(1);
    let mut pieces: Vec<MeasuredPiece> = Vec::new();
    let mut record = csv::StringRecord::new();
    let headers = reader.headers().map_err(|error| wrong(1, &error))?.clone();
    loop {
        let line = numbers.next().unwrap_or_default();
        if !reader.read_record(&mut record).map_err(|error| wrong(line, &error))? {
            break;
        }
        let row: Line = record.deserialize(Some(&headers)).map_err(|error| wrong(line, &error))?;
        let values = [
            ("from_m", row.from_m, -1e5..1e5, "-100000 to 100000 m"),
            ("to_m", row.to_m, row.from_m + 0.01..1e5, "a place behind `from_m`, m"),
            ("leaf_area_m2", row.leaf_area_m2, 1e-6..1e6, "an area above 0 m²"),
        ];
        for (key, found, allowed, expected) in values {
            if !allowed.contains(&found) {
                return Err(SheetError::Value { line, key, expected, found });
            }
        }
        let piece = MeasuredPiece {
            line,
            recording: row.recording,
            from_m: row.from_m,
            to_m: row.to_m,
            leaf_area_m2: row.leaf_area_m2,
        };
        let overlaps = |other: &&MeasuredPiece| {
            other.recording == piece.recording && other.from_m < piece.to_m && piece.from_m < other.to_m
        };
        if let Some(other) = pieces.iter().find(overlaps) {
            return Err(SheetError::Overlap { first: other.line, second: line });
        }
        pieces.push(piece);
    }
    if pieces.is_empty() { Err(SheetError::Empty) } else { Ok(pieces) }
}

fn wrong(line: u64, error: &csv::Error) -> SheetError {
    let why = match error.kind() {
        csv::ErrorKind::Deserialize { err, .. } => match err.field() {
            Some(field) => format!("field {}: {}", field + 1, err.kind()),
            None => err.kind().to_string(),
        },
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("expected {expected_len} fields, found {len}")
        }
        _ => error.to_string(),
    };
    SheetError::Line { line, why }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_in_any_order_with_others_and_comments_between() {
        let text = "# stripped on 3 June\nfrom_m, to_m, who, leaf_area_m2, recording\n2,3,ann,5.5,a.sopas\n# rain\n3, 4.5, bob, 7, a.sopas\n";
        let found = read(text).expect("a sheet");
        assert_eq!(found.len(), 2);
        assert_eq!(
            found[1],
            MeasuredPiece {
                line: 5,
                recording: "a.sopas".to_owned(),
                from_m: 3.0,
                to_m: 4.5,
                leaf_area_m2: 7.0
            }
        );
    }

    #[test]
    fn what_is_wrong_is_told_by_line() {
        let of = |lines: &str| {
            read(&format!("recording,from_m,to_m,leaf_area_m2\n{lines}")).expect_err(lines).to_string()
        };
        assert!(of("").contains("found none"));
        assert!(of("a,1,x,5\n").starts_with("line 2: field 3: "), "{}", of("a,1,x,5\n"));
        assert!(of("a,1,2\n").contains("expected 4 fields, found 3"));
        assert_eq!(of("a,1,2,5\na,2,2,5\n"), "line 3: `to_m`: expected a place behind `from_m`, m, found 2");
        assert!(of("a,1,2,0\n").contains("an area above 0 m²") && of("a,1,2,nan\n").contains("found NaN"));
        assert_eq!(
            of("a,1,3,5\nb,1,3,5\na,2,4,5\n"),
            "lines 2 and 4 measure some of the same row; leave one out"
        );
        let none = read("recording,from,to,leaf_area_m2\na,1,2,3\n").expect_err("columns").to_string();
        assert!(none.contains("from_m"), "{none}");
    }
}
