//! `rowscan scene show`, `rowscan rig show`

use std::path::PathBuf;

use rowscan_protocol::rig::Rig;
use rowscan_scenes::drawing::{Rows, apart_words, draw_rig, mount_words};
use rowscan_scenes::files;
use serde::Serialize;
use serde_json::{Value, json};

use crate::cli::output::{self, say};
use crate::cli::{Failure, Format, Outcome};
use crate::reference::Document;

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A file, or the name of a built-in scene
    #[arg(value_name = "FILE")]
    name: String,
    /// Draw it: plan and elevations of rows, alleys, trees, scanners and beams
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// How to write the values
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// One value in force.
#[derive(Debug, Serialize)]
struct Row {
    key: String,
    value: Value,
    unit: Option<String>,
    /// What it would be unless the file, its preset or its orchard said something else.
    is_default: bool,
}

pub(super) fn run(document: Document, args: &Args) -> Result<Outcome, Failure> {
    let (rig, scene) = match document {
        Document::Rig => files::load_rig(&args.name, say)?,
        _ => {
            let scene = files::load_scene(&args.name, say)?;
            (scene.resolved_rig(), Some(scene))
        }
    };
    let (written, in_force) = match (document, &scene) {
        (Document::Scene, Some(scene)) => (value(scene)?, value(&scene.spelled_out())?),
        _ => (json!({ "rig": value(&rig)? }), json!({ "rig": value(&rig)? })),
    };
    let mut rows = Vec::new();
    let schema = document.schema();
    flat(&schema, &in_force, Some(&written), String::new(), &mut rows);
    if args.format == Format::Table {
        // A table of measures rounds; these are what stands in force.
        for row in rows.iter_mut().filter(|row| row.value.is_number()) {
            row.value = Value::String(row.value.to_string());
        }
    }
    output::print_rows(args.format, &rows)?;
    let layout = scene.as_ref().map(|scene| scene.orchard.layout());
    if args.format == Format::Table {
        output::print(&words(&rig))?;
    }
    if let Some(file) = &args.svg {
        let drive = scene.as_ref().map(|scene| scene.drive.clone()).unwrap_or_default();
        let alley = drive.first_alley(&rig);
        let rows = Rows { count: layout.map_or(0, |layout| layout.rows), alley };
        output::write_file(file, &draw_rig(&rig, rows))?;
        say(format_args!("wrote {}", output::name_of(file)));
    }
    Ok(Outcome::Done)
}

fn value(of: &dyn erased_serde::Serialize) -> Result<Value, Failure> {
    serde_json::to_value(of)
        .map_err(|cause| Failure::Write { what: "the values".to_owned(), cause: cause.into() })
}

/// The scanners and the distances between them, a line each.
fn words(rig: &Rig) -> String {
    let mut text = String::new();
    for (number, mount) in rig.scanners.iter().enumerate() {
        text.push_str(&format!("scanner {number}: {}\n", mount_words(mount)));
    }
    for (number, pair) in rig.scanners.windows(2).enumerate() {
        if let [one, other] = pair {
            let apart = apart_words(&rig.apart(one, other));
            text.push_str(&format!("scanner {} beside scanner {number}: {apart}\n", number + 1));
        }
    }
    text
}

/// Every value, one a row, with the unit that the schema has for it.
fn flat(schema: &Value, in_force: &Value, written: Option<&Value>, path: String, rows: &mut Vec<Row>) {
    match in_force {
        Value::Object(map) if schema.get("properties").is_some() => {
            for (name, value) in map {
                let path = if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
                flat(
                    &schema["properties"][name],
                    value,
                    written.and_then(|written| written.get(name)),
                    path,
                    rows,
                );
            }
        }
        Value::Array(items) if schema["items"].get("properties").is_some() => {
            for (index, value) in items.iter().enumerate() {
                let written = written.and_then(|written| written.get(index));
                flat(&schema["items"], value, written, format!("{path}[{index}]"), rows);
            }
        }
        Value::Null => {}
        value => {
            let is_default = written.is_none_or(Value::is_null) || schema.get("default") == Some(value);
            rows.push(Row {
                key: path,
                value: value.clone(),
                unit: schema["x-unit"].as_str().map(str::to_owned),
                is_default,
            });
        }
    }
}
