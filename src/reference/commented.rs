//! A file with every key: its unit, its default, what it means.

use super::keys::{Key, Kind, keys};
use super::toml_value::inline;
use super::{Document, defaults};

/// Characters of a line of comment.
const WIDTH: usize = 110;

/// The commented file. As it stands it means the default, and so it does with every `#key = value` made live.
pub fn commented(document: Document) -> String {
    let mut text = String::new();
    let name = document.name();
    comment(
        &mut text,
        &format!(
            "{} Written by `rowscan {name} new`. A line `#key = value` shows the default: take away the `#` to change it. Where a blank follows \
             the `#`, nothing is there unless it is written. `rowscan {name} check FILE` says whether it is right, `rowscan {name} show FILE --svg \
             DRAWING` draws it. Editors complete keys by the schema: `rowscan schema {name} > {name}.schema.json`, and the line `#:schema \
             ./{name}.schema.json` at the top.",
            document.about()
        ),
    );
    if has_scene_version(document) {
        text.push_str(&format!("\n{}", defaults::empty_scene()));
    }
    for key in keys(&document.schema()) {
        if !(has_scene_version(document) && key.path() == "version") {
            write(&mut text, &key);
        }
    }
    text
}

/// True of a file whose version stands at its top: what the words of a rig mean hangs on it.
fn has_scene_version(document: Document) -> bool {
    matches!(document, Document::Scene | Document::Rig)
}

fn write(text: &mut String, key: &Key) {
    if key.kind != Kind::Value {
        text.push('\n');
        comment(text, &key.meaning);
        let header = match key.kind {
            Kind::Tables => format!("[[{}]]", key.path()),
            _ => format!("[{}]", key.path()),
        };
        text.push_str(&format!("{}{header}\n", if key.optional { "# " } else { "" }));
        return;
    }
    comment(text, &about(key));
    let name = &key.name;
    match (&key.default, &key.example) {
        (Some(default), _) if !key.optional => text.push_str(&format!("#{name} = {}\n", inline(default))),
        (Some(value), _) | (None, Some(value)) => text.push_str(&format!("# {name} = {}\n", inline(value))),
        (None, None) => {}
    }
}

/// What it means, its unit, its range.
fn about(key: &Key) -> String {
    let mut facts: Vec<String> = Vec::new();
    facts.extend(key.unit.clone());
    facts.extend(key.allowed.clone());
    if key.choices.is_empty() {
        facts
            .extend(Some(key.takes.clone()).filter(|takes| takes.starts_with("list") || takes.contains(' ')));
    } else {
        facts.push(key.choices.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(" "));
    }
    if key.default.is_none() && !key.required {
        facts.push("left out".to_owned());
    }
    match facts.is_empty() {
        true => key.meaning.clone(),
        false => format!("{} [{}]", key.meaning, facts.join("; ")),
    }
}

/// Lines of comment.
fn comment(text: &mut String, words: &str) {
    let mut line = String::from("#");
    for word in words.split_whitespace() {
        if line.chars().count() + word.chars().count() >= WIDTH {
            text.push_str(&format!("{line}\n"));
            line = String::from("#");
        }
        line.push(' ');
        line.push_str(word);
    }
    text.push_str(&format!("{line}\n"));
}
