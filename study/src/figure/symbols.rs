//! Symbols with subscripts in the texts of figures.

/// Symbols with a subscript, as texts have them: `I_T` is set as I with a small T below.
const SYMBOLS: [&str; 4] = ["I_3L", "I_L", "I_T", "L_A"];

/// A text with its symbols in spans: shifts are relative, so what follows a subscript is raised again. A space beside a span is a shift, too,
/// for some programs drop it.
pub(super) fn set(words: &str) -> String {
    let mut out = String::new();
    let mut rest = words;
    let mut raise = "";
    while let Some((at, symbol)) =
        SYMBOLS.iter().filter_map(|symbol| Some((rest.find(symbol)?, *symbol))).min()
    {
        let (before, after) = rest.split_at(at);
        let (letter, below) = symbol.split_once('_').unwrap_or((symbol, ""));
        out.push_str(&span(raise, before));
        let raise_letter = if before.trim().is_empty() { raise } else { "" };
        let away = shift(before.ends_with(' '));
        out.push_str(&format!("<tspan{raise_letter}{away} font-style=\"italic\">{letter}</tspan>"));
        out.push_str(&format!("<tspan dy=\"0.36em\" font-size=\"70%\">{below}</tspan>"));
        rest = after.strip_prefix(symbol).unwrap_or_default();
        raise = " dy=\"-0.25em\"";
    }
    if out.is_empty() {
        return words.to_owned();
    }
    out.push_str(&span(raise, rest));
    out
}

/// Words between two symbols, if there are any.
fn span(raise: &str, words: &str) -> String {
    let (shifted, words) = (shift(words.starts_with(' ')), words.trim());
    if words.is_empty() { String::new() } else { format!("<tspan{raise}{shifted}>{words}</tspan>") }
}

/// The width of a space.
fn shift(there: bool) -> &'static str {
    if there { " dx=\"0.28em\"" } else { "" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_set_with_subscripts_and_nothing_else_is_touched() {
        assert_eq!(set("advance, mm"), "advance, mm");
        let one = set("leaf area L_A, m²");
        assert_eq!(
            one,
            "<tspan>leaf area</tspan><tspan dx=\"0.28em\" font-style=\"italic\">L</tspan><tspan dy=\"0.36em\" font-size=\"70%\">A</tspan><tspan dy=\"-0.25em\">, m²</tspan>"
        );
        assert!(set("I_T of").ends_with("<tspan dy=\"-0.25em\" dx=\"0.28em\">of</tspan>"));
        // Of two symbols side by side the second one is raised again.
        assert!(
            set("I_T I_L").contains("<tspan dy=\"-0.25em\" dx=\"0.28em\" font-style=\"italic\">I</tspan>")
        );
        assert_eq!(set("L_A = 3 I_3L").matches("italic").count(), 2);
        assert!(!set("L_A = 3 I_3L − 1").contains('_'));
    }
}
