//! Rust source with what the rules do not read blanked out: comments, literals, test modules. Lines stay where they are.

/// A Rust file in the three forms that rules read.
pub struct Source {
    /// Without comments and without literals.
    all: Vec<String>,
    /// As `all`, without `#[cfg(test)]` items.
    product: Vec<String>,
    /// With string literals, without comments and `#[cfg(test)]` items.
    product_with_strings: Vec<String>,
}

impl Source {
    /// Blanks out comments, literals and test modules.
    pub fn new(text: &str) -> Self {
        let text: Vec<char> = text.chars().collect();
        let kinds = classify(&text);
        let tests = test_items(&text, &kinds);
        let form = |keep: &dyn Fn(usize) -> bool| -> Vec<String> {
            let kept = text.iter().enumerate().map(|(i, &c)| if c == '\n' || keep(i) { c } else { ' ' });
            kept.collect::<String>().lines().map(str::to_owned).collect()
        };
        Self {
            all: form(&|i| kinds[i] == Kind::Code),
            product: form(&|i| kinds[i] == Kind::Code && !tests[i]),
            product_with_strings: form(&|i| kinds[i] != Kind::Comment && !tests[i]),
        }
    }

    /// Numbers of the lines whose code holds `word`.
    pub fn all_lines(&self, word: &str) -> Vec<usize> {
        lines_with(&self.all, word)
    }

    /// Numbers of the lines whose code outside tests holds `word`.
    pub fn product_lines(&self, word: &str) -> Vec<usize> {
        lines_with(&self.product, word)
    }

    /// Line `i` (from 0) without comments and test code, literals kept.
    pub fn product_line(&self, i: usize) -> &str {
        self.product_with_strings.get(i).map_or("", String::as_str)
    }
}

/// True if `line` names a path that starts with `folder` and goes on below it.
pub fn names_path(line: &str, folder: &str) -> bool {
    line.match_indices(folder).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        let after = line[at + folder.len()..].chars().next();
        // Part of a URL or of a longer path is not a path of this machine.
        let starts = before
            .is_none_or(|c| !c.is_alphanumeric() && !matches!(c, '/' | '.' | '}' | '~' | '_' | '-' | '$'));
        starts && after.is_some_and(|c| c.is_alphanumeric())
    })
}

fn lines_with(lines: &[String], word: &str) -> Vec<usize> {
    let held = lines.iter().enumerate().filter(|(_, line)| has_word(line, word));
    held.map(|(i, _)| i + 1).collect()
}

fn has_word(line: &str, word: &str) -> bool {
    let is_part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    line.match_indices(word).any(|(at, _)| {
        let (before, after) = (line[..at].chars().next_back(), line[at + word.len()..].chars().next());
        let (first, last) = (word.chars().next(), word.chars().next_back());
        let runs_on = is_part(first) && is_part(before) || is_part(last) && is_part(after);
        !runs_on
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Code,
    Comment,
    Literal,
}

/// What each character belongs to.
fn classify(text: &[char]) -> Vec<Kind> {
    let mut kinds = vec![Kind::Code; text.len()];
    let mut i = 0;
    while i < text.len() {
        let (end, kind) = token(text, i);
        kinds[i..end].fill(kind);
        i = end;
    }
    kinds
}

/// The end and kind of the comment, literal or single character at `i`.
fn token(text: &[char], i: usize) -> (usize, Kind) {
    let (end, kind) = token_unbounded(text, i);
    (end.min(text.len()), kind)
}

/// As [`token`], where what an end of file cuts short ends past it.
fn token_unbounded(text: &[char], i: usize) -> (usize, Kind) {
    let at = |k: usize| text.get(i + k).copied();
    match (text[i], at(1)) {
        ('/', Some('/')) => (find(text, i, |k| text[k] == '\n'), Kind::Comment),
        ('/', Some('*')) => (block_comment_end(text, i), Kind::Comment),
        ('"', _) => (string_end(text, i), Kind::Literal),
        ('r', Some('"' | '#')) if !follows_word(text, i) => match raw_string_end(text, i) {
            Some(end) => (end, Kind::Literal),
            None => (i + 1, Kind::Code),
        },
        ('\'', Some('\\')) => (find(text, i + 3, |k| text[k] == '\'') + 1, Kind::Literal),
        ('\'', Some(_)) if at(2) == Some('\'') => (i + 3, Kind::Literal),
        _ => (i + 1, Kind::Code),
    }
}

/// True if the character before `i` makes `r` the end of a longer word; `b` and `c` only prefix a raw literal.
fn follows_word(text: &[char], i: usize) -> bool {
    let before = i.checked_sub(1).map(|k| text[k]);
    before.is_some_and(|c| (c.is_alphanumeric() || c == '_') && !matches!(c, 'b' | 'c'))
}

fn find(text: &[char], from: usize, is: impl Fn(usize) -> bool) -> usize {
    (from..text.len()).find(|&k| is(k)).unwrap_or(text.len())
}

fn block_comment_end(text: &[char], start: usize) -> usize {
    let (mut depth, mut i) = (0, start);
    while i + 1 < text.len() {
        match (text[i], text[i + 1]) {
            ('/', '*') => depth += 1,
            ('*', '/') => depth -= 1,
            _ => {
                i += 1;
                continue;
            }
        }
        i += 2;
        if depth == 0 {
            return i;
        }
    }
    text.len()
}

fn string_end(text: &[char], start: usize) -> usize {
    let mut i = start + 1;
    while i < text.len() && text[i] != '"' {
        i += if text[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn raw_string_end(text: &[char], start: usize) -> Option<usize> {
    let hashes = text[start + 1..].iter().take_while(|&&c| c == '#').count();
    let open = start + 1 + hashes;
    if text.get(open) != Some(&'"') {
        return None;
    }
    let closes =
        |k: usize| text[k] == '"' && text[k + 1..].iter().take_while(|&&c| c == '#').count() >= hashes;
    Some(find(text, open + 1, closes) + 1 + hashes)
}

/// Which characters belong to items under `#[cfg(test)]`: up to the matching brace, or to the semicolon of a `mod tests;`.
fn test_items(text: &[char], kinds: &[Kind]) -> Vec<bool> {
    let marker: Vec<char> = "#[cfg(test)]".chars().collect();
    let mut tests = vec![false; text.len()];
    let mut i = 0;
    while i + marker.len() <= text.len() {
        if kinds[i] != Kind::Code || text[i..i + marker.len()] != marker[..] {
            i += 1;
            continue;
        }
        let is = |k: usize, c: char| kinds[k] == Kind::Code && text[k] == c;
        let mut end = find(text, i, |k| is(k, '{') || is(k, ';'));
        let mut depth = 0;
        while end < text.len() {
            depth += i32::from(is(end, '{')) - i32::from(is(end, '}'));
            end += 1;
            if depth == 0 {
                break;
            }
        }
        tests[i..end].fill(true);
        i = end;
    }
    tests
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_not_code() {
        let text = "a(); // sleep\n/* sleep /* sleep */ sleep */ b(\"sleep \\\" sleep\", r#\"sleep \" sleep\"#, b\"sleep\", '\"', '\\'');\nsleep();\n";
        assert_eq!(Source::new(text).all_lines("sleep"), [3]);
    }

    #[test]
    fn lifetimes_do_not_open_a_literal() {
        assert_eq!(Source::new("fn f<'a>(x: &'a str) { sleep('x') }").all_lines("sleep"), [1]);
    }

    #[test]
    fn test_modules_end_where_their_brace_closes() {
        let text = "#[cfg(test)]\nmod tests {\n  fn f() { g(\"}\"); sleep() }\n}\nsleep();\n#[cfg(test)]\nmod more;\nsleep();\n";
        let source = Source::new(text);
        assert_eq!(source.product_lines("sleep"), [5, 8]);
        assert_eq!(source.all_lines("sleep"), [3, 5, 8]);
    }

    #[test]
    fn words_are_whole() {
        let source = Source::new("sleepy(); asleep; sleep_until(); #![forbid(unsafe_code)]");
        assert!(source.all_lines("sleep").is_empty() && source.all_lines("unsafe").is_empty());
        assert_eq!(source.all_lines("sleep_until"), [1]);
    }
}
