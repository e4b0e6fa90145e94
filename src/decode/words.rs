//! From the structure of a telegram, as `Debug` prints it, to what a person reads.

/// A telegram's fields for a person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Words {
    pub(super) text: String,
    /// A part of it is told by its length only.
    pub(super) opaque: bool,
}

/// A body that is not taken apart.
pub(super) fn opaque(bytes: usize) -> String {
    format!("opaque, {bytes} bytes")
}

/// Lists up to this long are written out.
const SHORT_LIST: usize = 16;

/// Field names and values without the names of types. Longer lists are told by length and extremes, unless `values` are wanted.
pub(super) fn plain(debug: &str, values: bool) -> Words {
    let mut opaque_part = false;
    let mut out = String::with_capacity(debug.len().min(1024));
    let mut closers = Vec::new();
    let mut rest = debug;
    while let Some(first) = rest.chars().next() {
        match first {
            '"' => rest = copy(quoted(rest), rest, &mut out),
            '[' => rest = list(rest, values, &mut out),
            'A'..='Z' if !out.ends_with(|c: char| c.is_alphanumeric() || c == '_') => {
                let len = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
                let (word, after) = rest.split_at(len);
                rest = after;
                if let Some(inside) = after.strip_prefix('(') {
                    rest = inside;
                    closers.push(false);
                    if let Some(body) = (word == "Opaque").then(|| inside.find(']')).flatten() {
                        let (bytes, after) = inside.split_at(body + 1);
                        out.push_str(&opaque(elements(bytes).count()));
                        opaque_part = true;
                        rest = after;
                    }
                } else if let Some(inside) = after.strip_prefix(' ').filter(|inside| inside.starts_with('{'))
                {
                    rest = inside;
                } else {
                    out.push_str(if word == "None" { "none" } else { word });
                }
            }
            '(' => {
                closers.push(true);
                rest = copy(1, rest, &mut out);
            }
            ')' => {
                let keep = closers.pop().unwrap_or(true);
                rest = if keep { copy(1, rest, &mut out) } else { rest.get(1..).unwrap_or_default() };
            }
            other => rest = copy(other.len_utf8(), rest, &mut out),
        }
    }
    let bare = out.strip_prefix("{ ").and_then(|inside| inside.strip_suffix(" }"));
    Words { text: bare.map(str::to_owned).unwrap_or(out), opaque: opaque_part }
}

fn copy<'a>(len: usize, rest: &'a str, out: &mut String) -> &'a str {
    let (copied, rest) = rest.split_at_checked(len).unwrap_or((rest, ""));
    out.push_str(copied);
    rest
}

/// Bytes of the quoted text `rest` begins with, quotes included.
fn quoted(rest: &str) -> usize {
    let mut escaped = false;
    let end = rest.char_indices().skip(1).find(|(_, c)| {
        let ends = *c == '"' && !escaped;
        escaped = *c == '\\' && !escaped;
        ends
    });
    end.map_or(rest.len(), |(at, _)| at + 1)
}

/// Writes a list, or what there is to say about a long one of numbers.
fn list<'a>(rest: &'a str, values: bool, out: &mut String) -> &'a str {
    let inner = rest.find(|c: char| !c.is_ascii_digit() && !"[]-., ".contains(c)).unwrap_or(rest.len());
    match rest.find(']').filter(|end| *end < inner) {
        Some(end) if !values => {
            let (text, after) = rest.split_at(end + 1);
            let count = elements(text).count();
            if count <= SHORT_LIST {
                out.push_str(text);
            } else {
                let numbers = || elements(text).filter_map(|element| element.parse::<i64>().ok());
                let (least, most) = (numbers().min().unwrap_or(0), numbers().max().unwrap_or(0));
                out.push_str(&format!("[{count} values, {least} to {most}]"));
            }
            after
        }
        _ => copy(1, rest, out),
    }
}

/// The elements of `[a, b, c]`.
fn elements(list: &str) -> impl Iterator<Item = &str> {
    list.trim_matches(['[', ']']).split(", ").filter(|element| !element.is_empty())
}

#[cfg(test)]
mod tests {
    fn plain(debug: &str, values: bool) -> String {
        super::plain(debug, values).text
    }

    #[test]
    fn names_of_types_go_and_names_of_fields_stay() {
        let debug = r#"Status { state: 7, time: FlexString("0:00 {A} (B)"), lamps: [0, 0, 0], at: None, on: Some(Point { x: 1 }) }"#;
        let words = r#"state: 7, time: "0:00 {A} (B)", lamps: [0, 0, 0], at: none, on: { x: 1 }"#;
        assert_eq!(plain(debug, false), words);
        assert_eq!(plain("true", false), "true");
        assert_eq!(plain("()", false), "()");
    }

    #[test]
    fn long_lists_are_told_by_length_and_extremes() {
        let values: Vec<i32> = (-5..15).collect();
        assert_eq!(plain(&format!("{values:?}"), false), "[20 values, -5 to 14]");
        assert_eq!(plain(&format!("{values:?}"), true), format!("{values:?}"));
    }

    #[test]
    fn a_body_that_is_not_taken_apart_is_told_by_its_length() {
        assert_eq!(plain("Field { body: Opaque([1, 2, 3]) }", false), "body: opaque, 3 bytes");
        assert_eq!(plain("Field { body: Opaque([]), a: B(1) }", false), "body: opaque, 0 bytes, a: 1");
        assert!(super::plain("Opaque([1])", true).opaque);
        assert!(!super::plain("Name { text: \"opaque, Opaque([1])\" }", true).opaque);
    }
}
