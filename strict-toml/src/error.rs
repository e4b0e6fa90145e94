//! What is wrong with a document, and the nearest valid key.

/// A document that is refused, with the line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TomlError {
    /// Line of the offending key or value, from 1; 0 if it concerns the whole document.
    pub line: usize,
    /// What is wrong, with the remedy.
    pub message: String,
}

impl std::fmt::Display for TomlError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            0 => f.write_str(&self.message),
            line => write!(f, "line {line}: {}", self.message),
        }
    }
}

impl std::error::Error for TomlError {}

/// How alike two keys must be (Jaro-Winkler) for one to be offered for the other.
const ALIKE: f64 = 0.7;

/// `; did you mean X?` where one of the valid keys resembles this one, else the list of them.
pub fn suggestion(found: &str, valid: &[&str]) -> String {
    let nearest = valid
        .iter()
        .map(|key| (strsim::jaro_winkler(found, key), *key))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(likeness, _)| *likeness >= ALIKE);
    match nearest {
        Some((_, key)) => format!("; did you mean `{key}`?"),
        None => format!("; valid here: {}", valid.join(", ")),
    }
}
