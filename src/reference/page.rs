//! The reference page.

use serde_json::Value;

use super::Document;
use super::keys::{Key, Kind, keys};
use super::toml_value::inline;

/// docs/reference-keys.md.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Every key\n\nWritten by `rowscan schema --markdown`; a test holds that it is up to date. Keys, defaults and meanings are those of the types that \
         read the files, ranges those of their validation.\n`rowscan schema NAME` prints the same as JSON Schema (draft 7), by which editors complete and check: \
         with Even Better TOML or Taplo, write `#:schema ./scene.schema.json` at the top of the file.\n\n\
         A default of `[orchard]` is that of the preset `spindle`; another preset has others (`rowscan orchard parameters SCENE`). A key without default that \
         need not be given is left out: then what it describes is not there, or its meaning says what holds.\n",
    );
    for document in Document::ALL {
        page.push_str(&format!("\n## {}\n\n{}\n", title(document), document.about()));
        let schema = document.schema();
        let all: Vec<Key> = keys(&schema).into_iter().filter(|key| !key.of_faults).collect();
        // A scene says of its rig what a rig says.
        let is_here = |key: &&Key| {
            document != Document::Scene || !(key.table == "rig" || key.table.starts_with("rig."))
        };
        let all: Vec<&Key> = all.iter().filter(is_here).collect();
        table(&mut page, "", &all);
        for key in all.iter().filter(|key| key.kind != Kind::Value) {
            let path = key.path();
            let header = if key.kind == Kind::Tables { format!("[[{path}]]") } else { format!("[{path}]") };
            page.push_str(&format!("\n### `{header}`\n\n{}\n", key.meaning));
            match path.as_str() {
                "rig" if document == Document::Scene => {
                    page.push_str("\nIts keys are those of a [rig](#rig).\n")
                }
                "fault" => page.push_str("\nEach fault's own parameters are in [faults.md](faults.md).\n"),
                _ => {}
            }
            table(&mut page, &path, &all);
        }
    }
    page
}

fn title(document: Document) -> &'static str {
    match document {
        Document::Scene => "Scene",
        Document::Rig => "Rig",
        Document::Scenario => "Scenario",
        Document::Boom => "Boom",
        Document::Study => "Study",
        Document::Search => "Search",
        Document::Classes => "Classes",
    }
}

/// The values of a table.
fn table(page: &mut String, path: &str, all: &[&Key]) {
    let values: Vec<&&Key> = all.iter().filter(|key| key.kind == Kind::Value && key.table == path).collect();
    if values.is_empty() {
        return;
    }
    page.push_str(
        "\n| key | takes | unit | default | allowed | example | meaning |\n|---|---|---|---|---|---|---|\n",
    );
    for key in values {
        let code = |value: &Value| format!("`{}`", inline(value));
        let default = match (&key.default, key.required) {
            (Some(default), _) => code(default),
            (None, true) => "must be given".to_owned(),
            (None, false) => "left out".to_owned(),
        };
        let example = key
            .example
            .as_ref()
            .or(key.default.as_ref())
            .map(|value| format!("{} = {}", key.name, inline(value)));
        let cells = [
            format!("`{}`", key.name),
            key.takes.clone(),
            key.unit.clone().unwrap_or_default(),
            default,
            key.allowed.clone().unwrap_or_default(),
            example.map(|example| format!("`{example}`")).unwrap_or_default(),
            meaning(key),
        ];
        page.push_str(&format!("| {} |\n", cells.map(|cell| cell.replace('|', "\\|")).join(" | ")));
    }
}

fn meaning(key: &Key) -> String {
    let told = key.choices.iter().map(|(name, meaning)| match meaning.is_empty() {
        true => format!("`{name}`"),
        false => format!("`{name}`: {}", meaning.trim_end_matches('.')),
    });
    let choices = told.collect::<Vec<_>>().join("; ");
    match (key.meaning.is_empty(), choices.is_empty()) {
        (_, true) => key.meaning.clone(),
        (true, false) => choices,
        (false, false) => format!("{} {choices}", key.meaning),
    }
}
