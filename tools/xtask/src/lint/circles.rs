//! Files that need one another in a circle, so that none of them can be understood, tested or moved alone.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// Edges between files, with the names that make them.
pub type Edges<'a> = BTreeMap<(&'a str, &'a str), BTreeSet<String>>;

/// The circles: each the files that reach one another, sorted.
pub fn circles<'a>(edges: &Edges<'a>) -> Vec<Vec<&'a str>> {
    let mut next: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (from, to) in edges.keys() {
        next.entry(from).or_default().push(to);
    }
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        next.keys().map(|file| (*file, reachable(file, &next))).collect();
    let mut seen: BTreeSet<&str> = BTreeSet::new();
    let mut circles = Vec::new();
    for (file, reach) in &reached {
        if !reach.contains(file) || seen.contains(file) {
            continue;
        }
        let circle = reach.iter().copied();
        let circle = circle.filter(|other| reached.get(other).is_some_and(|back| back.contains(file)));
        let circle: Vec<&str> = circle.collect();
        seen.extend(&circle);
        circles.push(circle);
    }
    circles
}

/// A circle in words: its files and the names that tie them.
pub fn describe(circle: &[&str], edges: &Edges) -> String {
    let mut text = format!("a circle of {} files:", circle.len());
    for ((from, to), names) in edges {
        if circle.contains(from) && circle.contains(to) {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let _ = write!(text, "\n      {from} -> {to}: {}", names.join(", "));
        }
    }
    text
}

fn reachable<'a>(from: &str, next: &BTreeMap<&'a str, Vec<&'a str>>) -> BTreeSet<&'a str> {
    let mut reached = BTreeSet::new();
    let mut open: Vec<&str> = next.get(from).cloned().unwrap_or_default();
    while let Some(file) = open.pop() {
        if reached.insert(file) {
            open.extend(next.get(file).into_iter().flatten());
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_the_files_that_reach_one_another() {
        let edges: Edges =
            [("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("e", "a"), ("f", "g"), ("g", "f")]
                .into_iter()
                .map(|edge| (edge, BTreeSet::from([edge.1.to_uppercase()])))
                .collect();
        let circles = circles(&edges);
        assert_eq!(circles, [vec!["a", "b", "c"], vec!["f", "g"]]);
        assert_eq!(describe(&circles[1], &edges), "a circle of 2 files:\n      f -> g: G\n      g -> f: F");
    }
}
