//! Progress bars: on standard error, and only on a terminal.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar of `length` steps, labelled; hidden where standard error is no terminal.
pub(super) fn bar(label: &'static str, unit: &str, length: u64) -> ProgressBar {
    let template = format!("{{prefix:>10}} {{bar:40}} {{pos}}/{{len}} {unit} {{msg}} {{eta}}");
    let style = ProgressStyle::with_template(&template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length).with_style(style).with_prefix(label)
}

/// A bar of so much effort in all, in any unit: only the part done and the time left are shown.
pub(super) fn efforts(label: &'static str, total: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:>10} {bar:40} {percent} % about {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(total).with_style(style).with_prefix(label)
}
