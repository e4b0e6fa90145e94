//! Verdicts in the formats that people and programs read.

mod junit;
mod lines;
mod tap;
mod text;

pub use junit::junit;
pub use lines::jsonl;
pub use tap::tap;
pub use text::text;

use crate::verdict::Case;

/// Bytes of output that a report carries.
pub(crate) const OUTPUT_LIMIT: usize = 64 * 1024;

/// A text without characters that XML 1.0 and terminals cannot carry; lines stay lines.
pub(crate) fn clean(text: &str) -> String {
    let is_fine =
        |c: &char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}') || matches!(c, '\n' | '\t');
    text.chars().filter(is_fine).collect()
}

/// A text on one line.
pub(crate) fn one_line(text: &str) -> String {
    clean(text).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The end of a text, as long as a report carries it.
pub(crate) fn tail(text: &str) -> &str {
    let from = text.len().saturating_sub(OUTPUT_LIMIT);
    let from = (from..=text.len()).find(|at| text.is_char_boundary(*at)).unwrap_or(text.len());
    &text[from..]
}

/// Where and when, the last events, and how to run it again: the lines below a message.
pub(crate) fn details(case: &Case) -> Vec<String> {
    let mut lines = Vec::new();
    if let (Some(t_s), Some(row_m)) = (case.t_s, case.row_m) {
        let tree = case.tree.map_or(String::new(), |tree| format!(", tree {tree}"));
        lines.push(format!("at {t_s:.3} s, row {row_m:.2} m{tree}"));
    }
    lines.extend(case.last_events.iter().map(|event| format!("event {}", one_line(event))));
    lines.extend(case.picture.iter().map(|picture| format!("picture {}", picture.display())));
    lines.push(format!("again: {}", case.rerun));
    lines
}

#[cfg(test)]
mod tests;
