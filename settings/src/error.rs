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
    // One slip of the finger or two: the fewest, and one letter for another before one too many. Else what is most alike.
    let slips = |key: &str| match strsim::osa_distance(found, key) {
        few @ ..=2 => (few, key.len().abs_diff(found.len())),
        _ => (usize::MAX, 0),
    };
    let alike = valid.iter().map(|key| (slips(key), strsim::jaro_winkler(found, key), *key));
    let nearest = alike
        .filter(|(_, likeness, _)| *likeness >= ALIKE)
        .min_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    match nearest {
        Some((.., key)) => format!("; did you mean `{key}`?"),
        None => format!("; valid here: {}", valid.join(", ")),
    }
}

/// Characters of a document that a message repeats of one key or value.
const SHOWN: usize = 200;

/// As much of a text as a message repeats.
pub(crate) fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_with_the_fewest_slips_is_offered() {
        let valid = ["tree", "trees", "tree_spacing_m"];
        for (found, meant) in
            [("treez", "trees"), ("tre", "tree"), ("treees", "trees"), ("tree_spacing", "tree_spacing_m")]
        {
            assert_eq!(suggestion(found, &valid), format!("; did you mean `{meant}`?"));
        }
        assert_eq!(suggestion("split.nosuch", &["split.act", "split"]), "; did you mean `split`?");
        assert_eq!(suggestion("zzz", &valid), "; valid here: tree, trees, tree_spacing_m");
    }

    #[test]
    fn a_message_repeats_no_more_than_can_be_read() {
        assert_eq!(shown("short"), "short");
        assert_eq!(shown(&"ä".repeat(5000)).chars().count(), SHOWN + 1);
    }
}
