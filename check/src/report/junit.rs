//! JUnit, for Jenkins, GitLab, GitHub and pytest's readers: one testcase an expectation, its name unique, its message on one line and in the
//! text as well.

use std::fmt::Write;
use std::time::Duration;

use rowscan_protocol::calendar::{Date, SECONDS_PER_DAY};

use super::{clean, details, one_line, tail};
use crate::clock;
use crate::verdict::{Case, Tried, Verdict};

/// All scenarios as one JUnit document.
pub fn junit(all: &[Tried]) -> String {
    let cases: Vec<&Case> = all.iter().flat_map(|tried| &tried.cases).collect();
    let time = seconds(all.iter().map(|tried| tried.wall_s).sum());
    let attributes =
        [&[("name", "rowscan check".to_owned())], &counts(&cases)[..], &[("time", time)]].concat();
    let mut document =
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<{}>\n", tag("testsuites", &attributes));
    let date = timestamp(clock::since_1970());
    all.iter().for_each(|tried| suite(tried, &date, &mut document));
    document + "</testsuites>\n"
}

fn suite(tried: &Tried, date: &str, out: &mut String) {
    let seed = tried.seed.map_or(String::new(), |seed| format!(" [seed {seed}]"));
    let cases: Vec<&Case> = tried.cases.iter().collect();
    let attributes = [
        &[("name", one_line(&format!("{}{seed}", tried.name)))],
        &counts(&cases)[..],
        &[("timestamp", date.to_owned()), ("time", seconds(tried.wall_s))],
    ];
    put(out, format_args!("    <{}>\n        <properties>", tag("testsuite", &attributes.concat())));
    let facts = tried.facts.iter().map(|(key, value)| (key.as_str(), one_line(value)));
    let seed = tried.seed.map(|seed| ("seed", seed.to_string()));
    for (key, value) in facts.chain(seed).chain([("simulated_s", format!("{:.6}", tried.simulated_s))]) {
        let attributes = [("name", key.to_owned()), ("value", value)];
        put(out, format_args!("            <{}/>", tag("property", &attributes)));
    }
    put(out, format_args!("        </properties>"));
    cases.iter().for_each(|case| testcase(tried, case, out));
    let notes: String = tried.notes().iter().map(|note| format!("note: {note}\n")).collect();
    let output = escaped(&clean(&(notes + tail(&tried.output))));
    put(out, format_args!("        <system-out>{output}</system-out>\n    </testsuite>"));
}

fn testcase(tried: &Tried, case: &Case, out: &mut String) {
    let attributes = [
        ("name", one_line(&case.name)),
        ("classname", one_line(&tried.name)),
        ("time", seconds(tried.wall_s / tried.cases.len().max(1) as f64)),
        ("file", one_line(&tried.scenario.display().to_string())),
    ];
    let testcase = tag("testcase", &attributes);
    let message = one_line(&case.message);
    let lines = [vec![message.clone()], details(case)].concat();
    let bad = |kind: &'static str| {
        let start = tag(kind, &[("message", message.clone()), ("type", kind.to_owned())]);
        format!("<{start}>{}</{kind}>", escaped(&clean(&lines.join("\n"))))
    };
    let inside = match case.verdict {
        Verdict::Passed => return put(out, format_args!("        <{testcase}/>")),
        Verdict::Skipped => format!("<{}/>", tag("skipped", &[("message", message.clone())])),
        Verdict::Failed => bad("failure"),
        Verdict::Error => bad("error"),
    };
    // As Jenkins' attachments plugin finds files.
    let attached = case.picture.iter().map(|picture| {
        let name = escaped(&one_line(&picture.display().to_string()));
        format!("\n            <system-out>[[ATTACHMENT|{name}]]</system-out>")
    });
    let attached: String = attached.collect();
    put(out, format_args!("        <{testcase}>\n            {inside}{attached}\n        </testcase>"));
}

/// How many cases there are, and how many of each bad kind.
fn counts(cases: &[&Case]) -> [(&'static str, String); 4] {
    let of = |verdict| cases.iter().filter(|case| case.verdict == verdict).count().to_string();
    [
        ("tests", cases.len().to_string()),
        ("skipped", of(Verdict::Skipped)),
        ("failures", of(Verdict::Failed)),
        ("errors", of(Verdict::Error)),
    ]
}

/// A tag's name with its attributes.
fn tag(name: &str, attributes: &[(&str, String)]) -> String {
    attributes.iter().fold(name.to_owned(), |tag, (key, value)| format!("{tag} {key}=\"{}\"", escaped(value)))
}

fn put(out: &mut String, line: std::fmt::Arguments<'_>) {
    // A string takes whatever is written to it.
    let _ = writeln!(out, "{line}");
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn seconds(seconds: f64) -> String {
    format!("{seconds:.3}")
}

/// A date and time as ISO 8601 has them, to the millisecond.
fn timestamp(since_1970: Duration) -> String {
    let (days, of_day) = (since_1970.as_secs() / SECONDS_PER_DAY, since_1970.as_secs() % SECONDS_PER_DAY);
    let Date { year, month, day } = Date::of_day(i64::try_from(days).unwrap_or_default());
    let (hours, minutes, seconds) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    let millis = since_1970.subsec_millis();
    format!("{year:04}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{seconds:02}.{millis:03}+00:00")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leap_day_has_its_date() {
        let leap_day = Duration::from_millis(1_709_164_799_987 + 1_000);
        assert_eq!(timestamp(leap_day), "2024-02-29T00:00:00.987+00:00");
    }
}
