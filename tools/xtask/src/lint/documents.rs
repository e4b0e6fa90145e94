//! Documents that send the reader to a file: the file must be there.

use std::collections::BTreeSet;

/// Endings of the files that documents name.
const ENDINGS: &[&str] = &[".rs", ".toml", ".py", ".md", ".sh"];

/// The paths that Markdown `text` names in backticks and that are not among `files`, with their line numbers.
///
/// A path has a slash, a known ending and no placeholder (`<name>`, `*`). Paths count from the repository's root or from the
/// folder of the document.
pub fn dead_paths<'a>(document: &str, text: &'a str, files: &BTreeSet<&str>) -> Vec<(usize, &'a str)> {
    let folder = document.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
    let mut dead = Vec::new();
    // A recipe may name a file that is yet to be written, if it says so.
    for (i, line) in text.lines().enumerate().filter(|(_, line)| !line.contains("for example")) {
        for quoted in line.split('`').skip(1).step_by(2) {
            let is_path = quoted.contains('/')
                && ENDINGS.iter().any(|ending| quoted.ends_with(ending))
                && quoted.chars().all(|c| c.is_alphanumeric() || matches!(c, '/' | '_' | '-' | '.'))
                && !quoted.starts_with(['/', '.']);
            if is_path && !files.contains(quoted) && !files.contains(format!("{folder}{quoted}").as_str()) {
                dead.push((i + 1, quoted));
            }
        }
    }
    dead
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_whole_paths_that_are_missing_are_dead() {
        let files = BTreeSet::from(["src/main.rs"]);
        let text = "see `src/main.rs`, `src/cli/<name>.rs`, `main.rs` and\n`src/gone.rs`, `rowscan replay a/b`, a/b.rs, `../x/y.toml`";
        assert_eq!(dead_paths("README.md", text, &files), [(2, "src/gone.rs")]);
    }

    #[test]
    fn a_recipe_s_example_need_not_exist() {
        assert!(dead_paths("README.md", "a file, for example `src/x.rs`", &BTreeSet::new()).is_empty());
    }

    #[test]
    fn a_crate_s_document_may_count_from_its_own_folder() {
        let files = BTreeSet::from(["protocol/src/lib.rs"]);
        assert!(dead_paths("protocol/README.md", "`src/lib.rs`, `protocol/src/lib.rs`", &files).is_empty());
        assert_eq!(dead_paths("driver/README.md", "`src/lib.rs`", &files).len(), 1);
    }
}
