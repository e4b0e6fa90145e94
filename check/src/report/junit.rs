//! JUnit, for Jenkins, GitLab, GitHub and pytest's readers: one testcase an expectation, its name unique, its message on one line and in the
//! text as well.

use std::time::Duration;

use chrono::{DateTime, Utc};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use super::{clean, details, one_line, tail};
use crate::clock;
use crate::verdict::{Case, Tried, Verdict};

/// All scenarios as one JUnit document.
///
/// # Errors
/// In words: the document could not be written.
pub fn junit(all: &[Tried]) -> Result<String, String> {
    let mut report = Report::new("rowscan check");
    let date = DateTime::<Utc>::from(clock::date());
    report.set_time(all.iter().map(|tried| seconds(tried.wall_s)).sum());
    for tried in all {
        let seed = tried.seed.map_or(String::new(), |seed| format!(" [seed {seed}]"));
        let mut suite = TestSuite::new(one_line(&format!("{}{seed}", tried.name)));
        suite.set_timestamp(date);
        suite.set_time(seconds(tried.wall_s));
        let facts = tried.facts.iter().map(|(key, value)| (key.as_str(), one_line(value)));
        let seed = tried.seed.map(|seed| ("seed", seed.to_string()));
        for (key, value) in facts.chain(seed).chain([("simulated_s", format!("{:.6}", tried.simulated_s))]) {
            suite.add_property((key, value.as_str()));
        }
        for case in &tried.cases {
            suite.add_test_case(testcase(tried, case));
        }
        let notes: String = tried.notes().iter().map(|note| format!("note: {note}\n")).collect();
        suite.set_system_out(clean(&(notes + tail(&tried.output))));
        report.add_test_suite(suite);
    }
    report.to_string().map_err(|error| error.to_string())
}

fn testcase(tried: &Tried, case: &Case) -> TestCase {
    let bad = |kind| {
        let mut status = TestCaseStatus::non_success(kind);
        status.set_message(one_line(&case.message));
        status.set_type(if kind == NonSuccessKind::Error { "error" } else { "failure" });
        let lines = [vec![one_line(&case.message)], details(case)].concat();
        status.set_description(clean(&lines.join("\n")));
        status
    };
    let status = match case.verdict {
        Verdict::Passed => TestCaseStatus::success(),
        Verdict::Skipped => {
            let mut status = TestCaseStatus::skipped();
            status.set_message(one_line(&case.message));
            status
        }
        Verdict::Failed => bad(NonSuccessKind::Failure),
        Verdict::Error => bad(NonSuccessKind::Error),
    };
    let mut testcase = TestCase::new(one_line(&case.name), status);
    testcase.set_classname(one_line(&tried.name));
    testcase.set_time(seconds(tried.wall_s / tried.cases.len().max(1) as f64));
    testcase.extra.insert("file".into(), clean(&tried.scenario.display().to_string()).into());
    testcase
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}
