//! Links between documents: the file is there, and so is the heading; the book's table of contents names every page.

use std::collections::{BTreeMap, BTreeSet};

/// The book's table of contents.
const SUMMARY: &str = "docs/SUMMARY.md";

/// Everything wrong with the links of these documents. `all` are the paths of all files, texts or not.
pub fn check(all: &BTreeSet<String>, documents: &[(String, String)]) -> Vec<String> {
    let documents: Vec<&(String, String)> =
        documents.iter().filter(|(path, _)| path.ends_with(".md")).collect();
    let headings: BTreeMap<&str, BTreeSet<String>> =
        documents.iter().map(|(path, text)| (path.as_str(), anchors(text))).collect();
    let mut wrong = Vec::new();
    for (path, text) in &documents {
        for (line, target) in links(text) {
            let (file, anchor) =
                target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
            let to = if file.is_empty() { path.clone() } else { resolved(path, file) };
            let is_folder =
                || all.iter().any(|known| known.starts_with(&format!("{}/", to.trim_end_matches('/'))));
            if !all.contains(&to) && !is_folder() {
                wrong.push(format!("{path}:{line}: the link `{target}` leads to no file"));
            } else if let Some((anchor, there)) = anchor.zip(headings.get(to.as_str()))
                && !there.contains(anchor)
            {
                wrong.push(format!("{path}:{line}: the link `{target}`: {to} has no such heading"));
            }
        }
    }
    if let Some((_, summary)) = documents.iter().find(|(path, _)| path == SUMMARY) {
        let named: BTreeSet<String> = links(summary).map(|(_, target)| resolved(SUMMARY, target)).collect();
        let is_page =
            |path: &&str| path.starts_with("docs/") && path.matches('/').count() == 1 && *path != SUMMARY;
        for page in headings.keys().copied().filter(is_page).filter(|page| !named.contains(*page)) {
            wrong.push(format!("{page} is not in {SUMMARY}"));
        }
    }
    wrong
}

/// Targets of links to files, with their line numbers; not those in code.
fn links(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut in_code = false;
    let prose = text.lines().enumerate().filter(move |(_, line)| {
        let fence = line.trim_start().starts_with("```");
        in_code ^= fence;
        !in_code && !fence
    });
    prose.flat_map(|(index, line)| {
        // What stands between backticks is code, unless a link's own words do.
        let targets = line.match_indices("](").filter_map(move |(at, _)| {
            let is_in_code = line[..at].matches('`').count() % 2 == 1;
            let target = line[at + 2..].split_once(')')?.0;
            let is_file = !target.contains("://") && !target.starts_with("mailto:") && !target.contains(' ');
            (is_file && !is_in_code).then_some(target)
        });
        targets.map(move |target| (index + 1, target))
    })
}

/// A target from a document's folder on, without `..`.
fn resolved(document: &str, target: &str) -> String {
    let mut parts: Vec<&str> = document.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// The anchors of a document's headings, as GitHub and mdBook make them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut in_code = false;
    let mut anchors = BTreeSet::new();
    for line in text.lines() {
        in_code ^= line.trim_start().starts_with("```");
        let title = line.trim_start_matches('#');
        if in_code || title.len() == line.len() || !title.starts_with(' ') {
            continue;
        }
        let kept = title.trim().to_lowercase();
        let kept: String =
            kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_')).collect();
        let anchor = kept.replace(' ', "-");
        // The second of one name is numbered.
        let numbered = (1..).map(|number| format!("{anchor}-{number}"));
        let free = std::iter::once(anchor.clone()).chain(numbered).find(|anchor| !anchors.contains(anchor));
        anchors.extend(free);
    }
    anchors
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(text: &str) -> Vec<String> {
        let documents = [
            ("docs/a.md".to_owned(), text.to_owned()),
            (
                "docs/b.md".to_owned(),
                "# The `B` page\n## Times\n## Times\n```sh\n# no heading\n```\n".to_owned(),
            ),
        ];
        let all = ["docs/a.md", "docs/b.md", "docs/figures/x.png", "README.md"].map(str::to_owned);
        check(&BTreeSet::from(all), &documents)
    }

    #[test]
    fn files_and_headings_must_be_there() {
        let good = "[b](b.md) [c](b.md#the-b-page) [d](b.md#times-1) ![x](figures/x.png) [r](../README.md) [w](https://x.y/z) [f](figures) [h](#here)\n# Here\n";
        assert_eq!(checked(good), Vec::<String>::new());
        for bad in ["[b](c.md)", "[b](b.md#no-heading)", "![x](x.png)", "[r](README.md)", "[h](#there)"] {
            assert_eq!(checked(bad).len(), 1, "{bad}");
        }
        assert_eq!(checked("`[b](c.md)`\n```text\n[b](c.md)\n```\n"), Vec::<String>::new());
    }

    #[test]
    fn the_table_of_contents_names_every_page() {
        let page = |path: &str, text: &str| (path.to_owned(), text.to_owned());
        let all = BTreeSet::from(["docs/a.md".to_owned(), "docs/b.md".to_owned(), SUMMARY.to_owned()]);
        let documents = [page("docs/a.md", ""), page("docs/b.md", ""), page(SUMMARY, "- [A](a.md)\n")];
        assert_eq!(check(&all, &documents), ["docs/b.md is not in docs/SUMMARY.md"]);
    }
}
