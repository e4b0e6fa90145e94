//! `rowscan orchard parameters`

use rowscan_scenes::Scene;
use rowscan_scenes::files;
use rowscan_scenes::parameters::ParameterDoc;
use serde::Serialize;

use crate::cli::output::{self, say};
use crate::cli::{Failure, Format, Outcome};

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// A scene file, or the name of a built-in scene: whose values are listed
    #[arg(value_name = "SCENE", default_value = "paper")]
    scene: String,
    /// Write the tables as Markdown, as docs/orchard-parameters.md has them
    #[arg(long)]
    markdown: bool,
    /// How to write the tables
    #[arg(long, value_enum, default_value_t, conflicts_with = "markdown")]
    format: Format,
}

#[derive(Serialize)]
struct Row {
    key: String,
    value: String,
    unit: &'static str,
    meaning: &'static str,
    reason: &'static str,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let scene = files::load_scene(&args.scene, say)?;
    let tables = tables(&scene);
    if args.markdown {
        output::print(&markdown(&args.scene, &tables))?;
        return Ok(Outcome::Done);
    }
    let rows: Vec<Row> = tables
        .into_iter()
        .flat_map(|(table, rows)| {
            rows.into_iter().map(move |row| Row {
                key: format!("{table}.{}", row.key),
                value: row.value,
                unit: row.unit,
                meaning: row.meaning,
                reason: row.reason,
            })
        })
        .collect();
    output::print_rows(args.format, &rows)?;
    Ok(Outcome::Done)
}

/// The tables of an orchard with the values in force.
fn tables(scene: &Scene) -> Vec<(&'static str, Vec<ParameterDoc>)> {
    let orchard = &scene.orchard;
    vec![
        ("orchard", orchard.layout().table()),
        ("orchard.tree", orchard.tree_parameters().table()),
        ("orchard.training", orchard.training_parameters().table()),
        ("orchard.lsystem", orchard.lsystem_parameters().table()),
        ("orchard.analytic", orchard.analytic_parameters().table()),
        ("orchard.trellis", orchard.trellis_parameters().table()),
        ("orchard.ground", orchard.ground_parameters().table()),
    ]
}

fn markdown(scene: &str, tables: &[(&'static str, Vec<ParameterDoc>)]) -> String {
    let mut text = format!(
        "# Parameters of an orchard\n\nWritten by `rowscan orchard parameters {scene} --markdown`; a test holds that it is up to date. Values are those of \
         the scene `{scene}`.\nWhat the generators and training systems are: [orchards.md](orchards.md).\n"
    );
    let plain = |cell: &str| cell.replace('|', "\\|");
    for (table, rows) in tables {
        text.push_str(&format!(
            "\n## `[{table}]`\n\n| key | value | unit | what | why |\n|---|---|---|---|---|\n"
        ));
        for row in rows {
            text.push_str(&format!(
                "| `{}` | {} | {} | {} | {} |\n",
                row.key,
                plain(&row.value),
                plain(row.unit),
                plain(row.meaning),
                plain(row.reason)
            ));
        }
    }
    text
}
