//! `rowscan models`

use rowscan_protocol::model::{self, Model};
use serde::Serialize;

use super::{Failure, Format, Outcome, output};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How to write the list
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

/// One model, as it is listed.
#[derive(Debug, Serialize)]
struct Row {
    name: &'static str,
    start_angle_deg: f64,
    stop_angle_deg: f64,
    modes: Vec<String>,
    max_range_m: f64,
    echoes: u8,
    emulates: &'static [&'static str],
    not_emulated: &'static [&'static str],
    evidence: &'static [&'static str],
}

impl From<&'static Model> for Row {
    fn from(model: &'static Model) -> Self {
        let mode = |mode: &model::ScanMode| {
            let hertz = f64::from(mode.frequency_centihz) / 100.0;
            let default = if *mode == model.default_mode { " (default)" } else { "" };
            format!("{hertz} Hz / {}°{default}", f64::from(mode.step) / 10_000.0)
        };
        Self {
            name: model.name,
            start_angle_deg: f64::from(model.start_angle) / 10_000.0,
            stop_angle_deg: f64::from(model.stop_angle) / 10_000.0,
            modes: model.modes.iter().map(mode).collect(),
            max_range_m: model.max_range_m,
            echoes: model.echoes,
            emulates: model.emulates,
            not_emulated: model.not_emulated,
            evidence: model.evidence,
        }
    }
}

/// The model called `name`.
pub(super) fn find(name: &str) -> Result<&'static Model, Failure> {
    model::by_name(name).ok_or_else(|| Failure::UnknownModel {
        found: name.to_owned(),
        known: model::MODELS.iter().map(|model| model.name).collect::<Vec<_>>().join(", "),
    })
}

pub(super) fn run(args: Args) -> Result<Outcome, Failure> {
    let rows: Vec<Row> = model::MODELS.iter().copied().map(Row::from).collect();
    if args.format != Format::Table {
        output::print_rows(args.format, &rows)?;
        return Ok(Outcome::Done);
    }
    for row in &rows {
        output::print(&format!(
            "{}  {}°..{}°  {} m  {} echo(es)\n",
            row.name, row.start_angle_deg, row.stop_angle_deg, row.max_range_m, row.echoes
        ))?;
        for (title, lines) in
            [("emulates", row.emulates), ("not emulated", row.not_emulated), ("evidence", row.evidence)]
        {
            output::print(&format!("  {title}\n"))?;
            for line in lines {
                output::print(&format!("    {line}\n"))?;
            }
        }
        output::print(&format!("  scan modes\n    {}\n\n", row.modes.join("\n    ")))?;
    }
    Ok(Outcome::Done)
}
