//! A drive that does not start because nobody takes a scanner's scans: which one, where it is, and what helps.

use std::collections::BTreeMap;
use std::time::Duration;

/// Kinds of places where scans are to be had, the usual one first.
const KINDS: [&str; 3] = ["tcp", "udp", "path"];

/// Why the drive has not started within `limit`, of these devices, with the places that children were told.
pub(crate) fn none_within(limit: Duration, untaken: &[String], places: &BTreeMap<String, String>) -> String {
    // By the name of its place: a free port is another one in each run, and the same run has the same verdict.
    let place =
        |id: &String| KINDS.iter().map(|kind| format!("{id}.{kind}")).find(|name| places.contains_key(name));
    let told = |id: &String| match place(id) {
        Some(name) => format!("`{id}` at `{{{name}}}`, as a `command` has it"),
        None => format!("`{id}`"),
    };
    let who: Vec<String> = untaken.iter().map(told).collect();
    let of = if who.is_empty() { String::new() } else { format!(" of {}", who.join(", ")) };
    format!(
        "no one took scans within {limit:?} (`startup_wall_s`){of}: the drive has not started; have a child connect there and ask for scans, or receive at that address where it is a `.udp`, give it more \
         `startup_wall_s`, or leave out the scanner"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scanner_its_place_and_the_remedy_are_named_alike_in_every_run() {
        let places =
            [("left.tcp", "127.0.0.1:4001"), ("left.rest", "127.0.0.1:4002"), ("low.path", "/run/low")];
        let places = places.map(|(name, at)| (name.to_owned(), at.to_owned())).into();
        let told = |untaken: &[&str]| {
            let untaken: Vec<String> = untaken.iter().map(|id| (*id).to_owned()).collect();
            none_within(Duration::from_secs(30), &untaken, &places)
        };
        let one = told(&["left"]);
        assert!(
            one.starts_with("no one took scans within 30s (`startup_wall_s`) of `left` at `{left.tcp}`, as a `command` has it: "),
            "{one}"
        );
        assert!(one.contains("have a child connect there"), "{one}");
        let both = told(&["left", "low", "right"]);
        assert!(
            !both.contains("127.0.0.1")
                && both.contains("`low` at `{low.path}`")
                && both.contains(", `right`:"),
            "{both}"
        );
        assert!(
            told(&[]).contains("(`startup_wall_s`): the drive"),
            "nothing is said of those that are taken"
        );
    }
}
