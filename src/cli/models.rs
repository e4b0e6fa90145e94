//! `rowscan models`

use std::ffi::OsStr;

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::{Arg, Command};
use rowscan_protocol::device::{Evidence, REFUSALS, Refusal};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model::{self, AnyModel, Model, Times};
use rowscan_protocol::optics::Optics;
use serde::Serialize;

use super::page_args::PageArgs;
use super::{Failure, Format, Outcome, output};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// These models alone, such as `lms111`; all where none is named
    #[arg(value_name = "MODEL", value_parser = known(), hide_possible_values = true, conflicts_with = "refusals")]
    models: Vec<AnyModel>,
    /// What the scanners refuse instead, and with which code
    #[arg(long)]
    refusals: bool,
    #[command(flatten)]
    page: PageArgs,
}

/// A name that shells complete as one of the models. Whether it is one is asked where it is used, which names the nearest.
#[derive(Clone, Debug)]
struct ModelName;

impl TypedValueParser for ModelName {
    type Value = String;

    fn parse_ref(&self, command: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<String, clap::Error> {
        StringValueParser::new().parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(AnyModel::all().map(|model| PossibleValue::new(model.name()).help(model.title()))))
    }
}

/// Takes the name of a model.
pub(super) fn name() -> impl TypedValueParser<Value = String> {
    ModelName
}

/// Takes the name of a model, and gives the model.
fn known() -> impl TypedValueParser<Value = AnyModel> {
    ModelName.try_map(|name| AnyModel::named(&name))
}

/// One model, as it is listed.
#[derive(Debug, Serialize)]
struct Row {
    name: &'static str,
    title: &'static str,
    firmware: &'static str,
    start_angle_deg: f64,
    stop_angle_deg: f64,
    modes: Vec<String>,
    points: Vec<u16>,
    min_range_m: f64,
    max_range_m: f64,
    echoes: u8,
    encoders: u8,
    fields: u16,
    emulates: Vec<&'static str>,
    not_emulated: Vec<&'static str>,
    evidence: Vec<&'static str>,
    optics: Vec<String>,
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
            title: model.title,
            firmware: model.firmware.trim_end(),
            start_angle_deg: f64::from(model.start_angle) / 10_000.0,
            stop_angle_deg: f64::from(model.stop_angle) / 10_000.0,
            modes: model.modes.iter().map(mode).collect(),
            points: model.modes.iter().map(|&mode| model.beams(mode).count).collect(),
            min_range_m: model.min_range_m,
            max_range_m: model.max_range_m,
            echoes: model.echoes,
            encoders: model.encoders,
            fields: model.fields,
            emulates: [model::ALL_EMULATE, model.emulates].concat(),
            not_emulated: [model::NONE_EMULATE, model.not_emulated].concat(),
            evidence: [model.evidence, model::ALL_EVIDENCE].concat(),
            optics: optics(&model.optics),
        }
    }
}

impl From<&'static lms2xx::model::Model> for Row {
    fn from(model: &'static lms2xx::model::Model) -> Self {
        let beams = model.default_variant.beams();
        let mode = |variant: &lms2xx::Variant| {
            let hertz = f64::from(lms2xx::model::TURNS_PER_SECOND) / f64::from(model.turns(*variant));
            let default = if *variant == model.default_variant { " (default)" } else { "" };
            let step_deg = f64::from(variant.step_centideg) / 100.0;
            format!("{hertz} Hz / {}° / {step_deg}°{default}", variant.angle_deg)
        };
        Self {
            name: model.name,
            title: model.title,
            firmware: model.type_text.trim_end(),
            start_angle_deg: f64::from(beams.start) / 10_000.0,
            stop_angle_deg: beams.angle_deg(beams.len().saturating_sub(1)),
            modes: model.variants.iter().map(mode).collect(),
            points: model.variants.iter().map(|variant| variant.count()).collect(),
            min_range_m: model.min_range_m,
            max_range_m: model.max_range_m,
            echoes: 1,
            encoders: 0,
            fields: 0,
            emulates: model.emulates.to_vec(),
            not_emulated: model.not_emulated.to_vec(),
            evidence: model.evidence.to_vec(),
            optics: optics(&model.optics),
        }
    }
}

/// Every optical number with its evidence.
fn optics(optics: &Optics) -> Vec<String> {
    optics.lines().into_iter().map(|(name, fact)| format!("{name}: {fact}")).collect()
}

impl From<AnyModel> for Row {
    fn from(model: AnyModel) -> Self {
        match model {
            AnyModel::Cola(model) => model.into(),
            AnyModel::Lms2xx(model) => model.into(),
        }
    }
}

/// One refusal, as it is listed.
#[derive(Debug, Serialize)]
struct RefusalRow {
    command: &'static str,
    fault: &'static str,
    answer: String,
    meaning: String,
    evidence: String,
    example: &'static str,
    model: &'static str,
}

impl From<&'static Refusal> for RefusalRow {
    fn from(line: &'static Refusal) -> Self {
        let evidence = match line.evidence {
            Evidence::Recorded(what) => format!("recorded: {what}"),
            Evidence::Documented(what) => format!("documented: {what}"),
            Evidence::Assumed => "assumed from the code's meaning".to_owned(),
        };
        Self {
            command: line.command,
            fault: line.what,
            answer: format!("sFA {:X}", line.error.code()),
            meaning: line.error.to_string(),
            evidence,
            example: line.example,
            model: line.model,
        }
    }
}

/// The model called `name`.
pub(super) fn find(name: &str) -> Result<AnyModel, Failure> {
    Ok(AnyModel::named(name)?)
}

pub(super) fn run(args: Args) -> Result<Outcome, Failure> {
    let is_asked = |model: &AnyModel| {
        args.models.is_empty() || args.models.iter().any(|asked| asked.name() == model.name())
    };
    let models = || AnyModel::all().filter(is_asked).map(Row::from).collect::<Vec<_>>();
    let refusals = || REFUSALS.iter().map(RefusalRow::from).collect::<Vec<_>>();
    match (args.refusals, args.page.markdown) {
        (false, true) => output::print(&models_page(&models()))?,
        (true, true) => output::print(&refusals_page(&refusals()))?,
        (true, false) => output::print_rows(args.page.format, &refusals())?,
        (false, false) if args.page.format == Format::Table => {
            output::print(&listing(&models()))?;
            if args.models.is_empty() {
                output::print(&not_modelled())?;
            }
        }
        (false, false) => output::print_rows(args.page.format, &models())?,
    }
    Ok(Outcome::Done)
}

/// The three lists of a model with their titles.
fn lists(row: &Row) -> [(&'static str, &[&'static str]); 3] {
    [("emulates", &row.emulates), ("not emulated", &row.not_emulated), ("evidence", &row.evidence)]
}

fn listing(rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        text += &format!(
            "{}  {}°..{}°  {} m  {} echo(es)\n",
            row.name, row.start_angle_deg, row.stop_angle_deg, row.max_range_m, row.echoes
        );
        for (title, lines) in lists(row) {
            text += &format!("  {title}\n");
            lines.iter().for_each(|line| text += &format!("    {line}\n"));
        }
        text += "  optics\n";
        row.optics.iter().for_each(|line| text += &format!("    {line}\n"));
        text += &format!("  scan modes\n    {}\n\n", row.modes.join("\n    "));
    }
    text
}

fn not_modelled() -> String {
    let mut text = "not modelled\n".to_owned();
    for (name, why) in model::NOT_MODELLED {
        text += &format!("  {name}: {why}\n");
    }
    text
}

fn models_page(rows: &[Row]) -> String {
    let mut page = String::from(
        "# Scanner models\n\nWritten by `rowscan models --markdown`; a test holds that it is up to date.\n\n\
         | model | angles | scan modes | points | range | echoes | encoders | fields | firmware |\n|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let points: Vec<String> = row.points.iter().map(u16::to_string).collect();
        page += &format!(
            "| `{}` {} | {}°..{}° | {} | {} | {} to {} m | {} | {} | {} | {} |\n",
            row.name,
            row.title,
            row.start_angle_deg,
            row.stop_angle_deg,
            row.modes.join(", "),
            points.join(", "),
            row.min_range_m,
            row.max_range_m,
            row.echoes,
            row.encoders,
            row.fields,
            row.firmware
        );
    }
    let mut section = |title: &str, lines: &[&str]| {
        page += &format!("\n## {title}\n");
        lines.iter().for_each(|line| page += &format!("- {line}\n"));
    };
    section("Every CoLa model emulates", model::ALL_EMULATE);
    section("No CoLa model emulates", model::NONE_EMULATE);
    section("Not certain of any CoLa model", model::ALL_EVIDENCE);
    for model in model::all() {
        page += &format!("\n## {}\n", model.title);
        for (title, lines) in
            [("emulates", model.emulates), ("not emulated", model.not_emulated), ("evidence", model.evidence)]
        {
            page += &format!("\n{title}\n");
            lines.iter().for_each(|line| page += &format!("- {line}\n"));
        }
    }
    for model in lms2xx::model::MODELS {
        page += &format!("\n## {}\n", model.title);
        for (title, lines) in
            [("emulates", model.emulates), ("not emulated", model.not_emulated), ("evidence", model.evidence)]
        {
            page += &format!("\n{title}\n");
            lines.iter().for_each(|line| page += &format!("- {line}\n"));
        }
    }
    page += &optics_table();
    page += &times();
    page += &scatter_table();
    page += &listing_table();
    page += "\n## Not modelled\n";
    for (name, why) in model::NOT_MODELLED {
        page += &format!("- {name}: {why}\n");
    }
    page
}

/// What light does in each model, a column a number.
fn optics_table() -> String {
    let mut page = String::from(
        "\n## Optics\n\nWhat `--optics device` sees by; docs/optics.md says how, and lists the documents. [REC] recorded, [MEM] from memory, [DER] derived, [ASM] assumed.\n",
    );
    let mut told: Vec<(&Optics, Vec<&str>)> = Vec::new();
    for model in AnyModel::all() {
        match told.iter_mut().find(|(optics, _)| *optics == model.optics()) {
            Some((_, names)) => names.push(model.name()),
            None => told.push((model.optics(), vec![model.name()])),
        }
    }
    for (optics, names) in told {
        page += &format!("\n### {}\n\n| | |\n|---|---|\n", names.join(", "));
        optics.lines().iter().for_each(|(name, fact)| page += &format!("| {name} | {fact} |\n"));
    }
    page
}

/// How long things take with `--profile field`.
fn times() -> String {
    let mut page = String::from(
        "\n## Times\n\nSeconds with `--profile field`; with `bench` everything happens at once. Boot, initialisation, spin-up and save times are not verified; `--boot-s` \
         and `--save-s` set them. Cold is from power-up to the first scan, warm from LMCstartmeas (LMS2xx: from the stream's beginning, \
         one scan's own time).\n\n\
         | model | boots | initialises | spins up | saves | first scan, warm | first scan, cold |\n|---|---|---|---|---|---|---|\n",
    );
    for model in model::all() {
        let Times { boot, initialisation, spin_up, first_scan, save_reply, .. } = model.times;
        let cold = boot + initialisation + spin_up + first_scan;
        let seconds = [boot, initialisation, spin_up, save_reply, first_scan, cold]
            .map(|time| time.as_secs_f64().to_string());
        page += &format!("| `{}` | {} |\n", model.name, seconds.join(" | "));
    }
    for model in lms2xx::model::MODELS {
        let lms2xx::model::Times { boot, save, new_unit } = model.times;
        let scan = f64::from(model.turns(model.default_variant)) / f64::from(lms2xx::model::TURNS_PER_SECOND);
        page += &format!(
            "| `{}` | {} | – | – | {}, where the unit changes {} | {scan:.3} | {:.3} |\n",
            model.name,
            boot.as_secs_f64(),
            save.as_secs_f64(),
            new_unit.as_secs_f64(),
            boot.as_secs_f64() + scan
        );
    }
    page
}

/// How periods and time stamps scatter with `--profile field`.
fn scatter_table() -> String {
    let mut page = String::from(
        "\n## Periods and time stamps\n\nMicroseconds on the device's clock with `--profile field`; with `bench` periods are nominal and the transmission comes after the constant in \
         the last column. The period is that of the default scan mode; in the others its scatter is assumed to be the same. Lag 1 and lag 2 are the correlations of a \
         period with the one before it and the one before that; no period is farther off the mean than `within`. The transmission is drawn from the recorded distribution; \
         that it follows no order is assumed. A picoScan's stand at the model.\n\n\
         | model | mean period | standard deviation | lag 1 | lag 2 | within | transmission after, mean | standard deviation | from | to | `bench` |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for model in model::MODELS {
        let scatter = &model.scatter;
        let nominal_us = 1e8 / f64::from(model.default_mode.frequency_centihz);
        let (mean, sd) = scatter.delay_mean_sd_us();
        let (from, to) = (scatter.delay_us.first(), scatter.delay_us.last());
        // What was not recorded is all another model's.
        let tag = scatter.period_sd_us.tag;
        page += &format!(
            "| `{}` | {:.0} {tag} | {} | {} | {} | {:.0} [DER] | {mean:.0} {tag} | {sd:.0} {tag} | {} {tag} | {} {tag} | {} |\n",
            model.name,
            nominal_us * (1.0 + f64::from(model.period_ppm) * 1e-6),
            scatter.period_sd_us,
            scatter.lag_1,
            scatter.lag_2,
            scatter.period_within_us(),
            from.copied().unwrap_or_default(),
            to.copied().unwrap_or_default(),
            model.transmit_delay_us
        );
    }
    page
}

fn listing_table() -> String {
    let mut page = String::from(
        "\n## LMS2xx: the listing's commands\n\nSICK's telegram listing 8007954, command by command; a test sends every example.\n\n\
         | command | listing says | we do | example | reply begins |\n|---|---|---|---|---|\n",
    );
    let hex = |bytes: &[u8]| {
        let shown: Vec<String> = bytes.iter().take(10).map(|byte| format!("{byte:02X}")).collect();
        shown.join(" ") + if bytes.len() > 10 { " …" } else { "" }
    };
    for line in lms2xx::listing::LISTING {
        page += &format!(
            "| {} | {} | {} | `{}` | `{}` |\n",
            line.command,
            line.listed,
            line.ours,
            hex(line.example),
            hex(line.reply)
        );
    }
    page
}

fn refusals_page(rows: &[RefusalRow]) -> String {
    let mut page = String::from(
        "# What a scanner refuses, and how\n\nWritten by `rowscan models --refusals --markdown`; a test holds that it is up to date, \
         another sends every example.\n\n| command | fault | answer | meaning | evidence | example |\n|---|---|---|---|---|---|\n",
    );
    for row in rows {
        page += &format!(
            "| {} | {} | `{}` | {} | {} | `{}` |\n",
            row.command, row.fault, row.answer, row.meaning, row.evidence, row.example
        );
    }
    page += "\nTwo refusals are no `sFA`: `sAN SetAccessMode 0` for a wrong password, and the codes 1 to 5 of `sAN mLMPsetscancfg`.\n";
    page
}
