//! Commands as lines of text, for a controller without a bus: `S 00000101` opens sections, `D 3 62` sets one section's duty.

use crate::commands::Target;

/// What one line says.
#[derive(Clone, Debug, PartialEq)]
pub struct Said(pub Vec<(Target, f64)>);

/// A line that says nothing that is known.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "line {line}: expected `S` with one 0 or 1 a section, the highest number first, or `D SECTION PERCENT`, found `{found}`"
)]
pub struct LineError {
    line: usize,
    found: String,
}

/// The longest line that is taken.
const LONGEST: usize = 80;

/// Puts lines together from bytes that come in any portions.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    rest: Vec<u8>,
    count: usize,
}

impl Lines {
    /// What the lines say that `bytes` complete, in their order.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<Result<Said, LineError>> {
        let mut all = Vec::new();
        for byte in bytes {
            match byte {
                b'\n' => {
                    let line = std::mem::take(&mut self.rest);
                    self.count += 1;
                    let text = String::from_utf8_lossy(&line);
                    let said = say(text.trim_end())
                        .ok_or_else(|| LineError { line: self.count, found: text.trim_end().to_owned() });
                    all.push(said);
                }
                // Of a line without end the beginning is enough to refuse it.
                byte if self.rest.len() <= LONGEST => self.rest.push(*byte),
                _ => {}
            }
        }
        all
    }
}

fn say(line: &str) -> Option<Said> {
    let mut words = line.split_ascii_whitespace();
    let said = match (words.next()?, words.next()?) {
        ("S", bits) if (1..=64).contains(&bits.len()) => {
            let states = (1..).zip(bits.bytes().rev()).map(|(number, bit)| match bit {
                b'0' => Some((Target::Section(number), 0.0)),
                b'1' => Some((Target::Section(number), 1.0)),
                _ => None,
            });
            states.collect::<Option<Vec<_>>>()?
        }
        ("D", number) => {
            let number = number.parse().ok().filter(|number| (1..=64).contains(number))?;
            let percent: f64 =
                words.next()?.parse().ok().filter(|percent| (0.0..=100.0).contains(percent))?;
            vec![(Target::Section(number), percent / 100.0)]
        }
        _ => return None,
    };
    words.next().is_none().then_some(Said(said))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_count_from_the_last_digit_and_portions_do_not_matter() {
        let text = b"S 101\nD 3 62\r\nX 1\nS 2\nD 3 101\nD 0 1\nS 1 1\n\nS 1";
        let whole = Lines::default().take(text);
        let section = |number, duty| (Target::Section(number), duty);
        assert_eq!(whole[0], Ok(Said(vec![section(1, 1.0), section(2, 0.0), section(3, 1.0)])));
        assert_eq!(whole[1], Ok(Said(vec![section(3, 0.62)])));
        assert_eq!(whole.len(), 8, "the last line has no end yet");
        assert!(whole[2..].iter().all(Result::is_err));
        assert!(whole[2].clone().expect_err("no command").to_string().starts_with("line 3: expected `S`"));
        let mut lines = Lines::default();
        let parts: Vec<_> = text.chunks(1).flat_map(|byte| lines.take(byte)).collect();
        assert_eq!(parts, whole);
    }

    #[test]
    fn a_line_without_end_takes_no_room() {
        let mut lines = Lines::default();
        lines.take(&[b'S'; 100_000]);
        assert!(lines.rest.len() < 100);
        assert!(lines.take(b"\n")[0].is_err());
    }
}
