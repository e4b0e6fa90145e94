//! TAP 14, as `prove` reads it.

use super::{details, one_line};
use crate::verdict::{Tried, Verdict};

/// All scenarios as one TAP document.
pub fn tap(all: &[Tried]) -> String {
    let count: usize = all.iter().map(|tried| tried.cases.len()).sum();
    let mut text = format!("TAP version 14\n1..{count}\n");
    let cases = all.iter().flat_map(|tried| tried.cases.iter().map(move |case| (tried, case)));
    for (number, (tried, case)) in cases.enumerate() {
        let word = if case.verdict <= Verdict::Skipped { "ok" } else { "not ok" };
        // A `#` would begin a directive, a `\` escapes.
        let name =
            one_line(&format!("{}: {}", tried.name, case.name)).replace('\\', "\\\\").replace('#', "\\#");
        let skip = match case.verdict {
            Verdict::Skipped => format!(" # SKIP {}", one_line(&case.message)),
            _ => String::new(),
        };
        text += &format!("{word} {} - {name}{skip}\n", number + 1);
        if case.verdict > Verdict::Skipped {
            let kind = if case.verdict == Verdict::Error { "error" } else { "fail" };
            text += &format!("  ---\n  message: {}\n  severity: {kind}\n  details:\n", quoted(&case.message));
            details(case).iter().for_each(|line| text += &format!("    - {}\n", quoted(line)));
            text += "  ...\n";
        }
    }
    text
}

/// A text as YAML has it in double quotes.
fn quoted(text: &str) -> String {
    format!("\"{}\"", one_line(text).replace('\\', "\\\\").replace('"', "\\\""))
}
