//! `rowscan score`: how well a run of a sprayer that was kept fits the leaves.

use std::path::{Path, PathBuf};

use rowscan_check::{Intercepted, Relative, SprayerRun};
use rowscan_sprayer::commands::Unheeded;
use rowscan_sprayer::edges::{EdgePair, EdgeSummary, Off};
use rowscan_sprayer::hydraulics::Balance;
use rowscan_sprayer::interception::Sink;
use rowscan_sprayer::overlap::overlaps;
use rowscan_sprayer::safety::{Breach, Rule, Spilt};
use rowscan_sprayer::{Edge, Interception, Rate, Score, map};
use serde::Serialize;

use super::output::{can_be_written, print_json, print_rows, say, write_file};
use super::{Failure, Format, Outcome};
use crate::export::FigureFormat;

/// What no number here knows of.
const NOT_MODELLED: &[&str] = &["air", "drift", "droplets", "run-off", "evaporation"];
/// What more, of a boom without `[hydraulics]` and of one with it.
const PRESSURE: [&str; 2] = ["pressure and hoses", "waves of pressure"];

/// The row of the longest settling time.
const SETTLING_S: &str = "rate_settling_s";

/// Differences of the run beside that are said, at most; JSON has all.
const MOST_DIFFERENCES: usize = 8;

/// Widths of the classes of speed, m/s.
const SPEED_M_S: f64 = 0.5;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A run that `check --keep` kept: its folder, or its sprayer.json
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Another run, beside it
    #[arg(long, value_name = "RUN")]
    beside: Option<PathBuf>,
    /// How to write the scores
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Draw it to this SVG or PNG file: wanted, sprayed, missed and wasted by metre and height, and the valves over time
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// All that is told of a run.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    score: Score,
    /// The best that the boom and its valves can do.
    oracle: Score,
    /// Shares of the oracle's.
    relative: Relative,
    edges: Vec<EdgeRow>,
    /// Litres against rules: of the drive, of the boom, and of switches and tank that faults of the run were about.
    forbidden: Vec<Breach>,
    /// Litres against any of them, each counted once.
    #[serde(skip)]
    against_any: Spilt,
    /// On what the liquid would have fallen if it flew straight; absent where nothing is known of the controller.
    #[serde(skip_serializing_if = "Option::is_none")]
    interception: Option<Intercepted>,
    /// How the rate was kept; absent where the boom has no `[rate]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    rate: Option<Rate>,
    /// Share by which the litres that the controller reported are off the true ones; absent where it reported none.
    #[serde(skip_serializing_if = "Option::is_none")]
    reported_error: Option<f64>,
    /// Where the pump's litres went; absent where the pressure is constant.
    #[serde(skip_serializing_if = "Option::is_none")]
    hydraulics: Option<Balance>,
    /// Commands that open a part which the boom lacks.
    unheeded: Vec<Unheeded>,
    /// Why the run ended before its end; absent where it did not.
    #[serde(skip_serializing_if = "Option::is_none")]
    cut_off: Option<String>,
    not_modelled: Vec<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    beside: Option<Box<Self>>,
    /// In what the run beside differs other than by its controller; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    differences: Option<Vec<String>>,
}

/// Edges of one kind.
#[derive(Debug, Serialize)]
struct EdgeRow {
    edge: &'static str,
    /// Of one section; of all where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    section: Option<String>,
    /// At a speed from here on, up to half a metre a second faster; at any where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    from_m_s: Option<f64>,
    #[serde(flatten)]
    summary: EdgeSummary,
}

/// A line of the table.
#[derive(Debug, Serialize)]
struct Row {
    what: String,
    run: Option<Shown>,
    oracle: Option<f64>,
    share_of_oracle: Option<f64>,
    beside: Option<Shown>,
}

/// A number, or in a table the words in its place.
#[derive(Debug, Serialize)]
#[serde(untagged)]
enum Shown {
    Number(f64),
    Words(&'static str),
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let picture = args.picture.as_deref().map(picture_format).transpose()?;
    if let Some(path) = &args.picture {
        for run in [Some(&args.run), args.beside.as_ref()].into_iter().flatten() {
            rowscan_files::will_be_read(run);
        }
        can_be_written(path)?;
    }
    let own = SprayerRun::load(&args.run)?;
    let beside = args.beside.as_deref().map(SprayerRun::load).transpose()?;
    for (run, path) in
        [Some((&own, &args.run)), beside.as_ref().zip(args.beside.as_ref())].into_iter().flatten()
    {
        // Of the first run it is the reason why there is no result.
        let why = run.unheard().or_else(|| run.cut_off.clone());
        if let Some(why) = why.filter(|_| !std::ptr::eq(run, &own)) {
            say(format_args!("{}: {why}", path.display()));
        }
    }
    let picture = args.picture.as_deref().zip(picture);
    tell(&own, beside.as_ref(), (args.format, picture), &Titled(args.run.display().to_string()))
}

/// What a run is called in its picture.
pub(super) struct Titled(pub(super) String);

/// The format of a picture by its name.
pub(super) fn picture_format(path: &Path) -> Result<FigureFormat, Failure> {
    Ok(FigureFormat::of_picture(path)?.check()?)
}

/// Prints all that is told of a run, beside another, and draws it.
pub(super) fn tell(
    run: &SprayerRun,
    beside: Option<&SprayerRun>,
    (format, picture): (Format, Option<(&Path, FigureFormat)>),
    title: &Titled,
) -> Result<Outcome, Failure> {
    let differences = beside.map(|other| run.differences(other));
    differences.iter().for_each(|all| say_differences(all));
    run.unheeded().iter().chain(&run.in_part()).for_each(say);
    overlaps(run.pass.boom()).iter().for_each(say);
    let report =
        Report { beside: beside.map(|run| Box::new(Report::of(run))), differences, ..Report::of(run) };
    match format {
        Format::Json | Format::Jsonl => print_json(format, &report)?,
        Format::Table | Format::Csv => {
            print_rows(format, &report.rows(format))?;
            say(format_args!("interception is no dose; not modelled: {}", report.not_modelled.join(", ")));
        }
    }
    if let Some((path, format)) = picture {
        write_file(path, &format.convert(drawn(run, title))?)?;
    }
    // What the run does not tell is unknown, and no result.
    let Some(why) = unknown(run) else { return Ok(Outcome::Done) };
    say(format_args!("no result: {why}"));
    Ok(Outcome::Finding)
}

/// Says in what two runs differ besides their controllers.
fn say_differences(all: &[String]) {
    let (shown, more) = all.split_at(all.len().min(MOST_DIFFERENCES));
    for difference in shown {
        say(format_args!("not only the controllers differ: {difference}"));
    }
    if !more.is_empty() {
        say(format_args!("not only the controllers differ: {} more, all in `--format json`", more.len()));
    }
}

/// Why a run has no result, in words; none where it has one.
fn unknown(run: &SprayerRun) -> Option<String> {
    let Score { recall, waste, .. } = run.score;
    let of_scores = || match (recall, waste) {
        (None, None) => {
            Some("recall and waste are unknown: no leaf passed the nozzles, and nothing was sprayed")
        }
        (None, _) => Some("recall is unknown: no leaf passed the nozzles while they were wanted"),
        (_, None) => Some("waste is unknown: nothing was sprayed"),
        _ => None,
    };
    let cut_off = || run.cut_off.as_ref().map(|why| format!("{why}; scores are of what was driven"));
    run.unheard().or_else(cut_off).or_else(|| of_scores().map(str::to_owned))
}

fn drawn(run: &SprayerRun, Titled(title): &Titled) -> String {
    let told = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.3}"));
    let Score { recall, waste, litres, .. } = &run.score;
    let title = format!("{title}: recall {}, waste {}, {litres:.3} l", told(*recall), told(*waste));
    map::svg(&run.pass, &run.flows, &title)
}

impl Report {
    fn of(run: &SprayerRun) -> Self {
        let mut edges = Vec::new();
        // Valves that nobody has told anything say nothing of edges and rules.
        let is_heard = run.unheard().is_none();
        for edge in Edge::ALL.into_iter().filter(|_| is_heard) {
            let row = |section: Option<String>, from_m_s, which: &dyn Fn(&EdgePair) -> bool| EdgeRow {
                edge: edge.name(),
                section,
                from_m_s,
                summary: run.edges.summary(|pair| pair.edge == edge && which(pair)),
            };
            edges.push(row(None, None, &|_| true));
            for (place, section) in run.pass.boom().sections.iter().enumerate() {
                edges.push(row(Some(section.id.clone()), None, &|pair| pair.section == place));
            }
            let class = |pair: &EdgePair| (pair.speed_m_s / SPEED_M_S).floor();
            let mut classes: Vec<f64> = run.edges.all().iter().map(class).collect();
            classes.sort_by(f64::total_cmp);
            classes.dedup();
            for number in classes {
                edges.push(row(None, Some(number * SPEED_M_S), &|pair| class(pair) == number));
            }
        }
        Self {
            score: run.score.clone(),
            oracle: run.oracle.clone(),
            relative: run.relative(),
            edges,
            // Nobody can throw the other switches in a scenario: of them nothing is known.
            against_any: run.forbidden(0.0).spilt(None),
            forbidden: run
                .forbidden(0.0)
                .breaches()
                .into_iter()
                .filter(|_| is_heard)
                // Switches that nobody has thrown say nothing.
                .filter(|breach| {
                    !matches!(breach.rule, Rule::Master | Rule::Override | Rule::TankEmpty)
                        || breach.spilt.forbidden_s > 0.0
                })
                .collect(),
            rate: run.rate.clone(),
            reported_error: run.reported(0.0).map(|reported| reported.error),
            hydraulics: run.node.as_ref().map(|node| node.balance(run.pass.time())),
            not_modelled: NOT_MODELLED
                .iter()
                .copied()
                .chain([PRESSURE[usize::from(run.node.is_some())]])
                .collect(),
            // Of valves that were told nothing it would say nothing of a controller.
            interception: is_heard.then(|| run.interception().clone()),
            unheeded: run.log.unheeded(run.pass.boom()),
            cut_off: run.cut_off.clone(),
            beside: None,
            differences: None,
        }
    }

    /// A number of this run. Where it is none, a table says in words why, if there is a word for it.
    fn shown(&self, what: &str, all: &[(String, Option<f64>)], format: Format) -> Option<Shown> {
        let find = |what: &str| all.iter().find(|(name, _)| name == what).and_then(|(_, value)| *value);
        let number = find(what);
        // Those of one side only are of edges that came.
        let is_missed = |edge: &Edge| {
            let of_edge = what.strip_prefix(edge.name()).unwrap_or_default();
            let is_quantile = of_edge.starts_with("_p95_") || of_edge.starts_with("_worst_");
            is_quantile && find(&format!("{}_missed", edge.name())) > Some(0.0)
        };
        let words = || match Edge::ALL.iter().any(is_missed) {
            true => Some("missed"),
            false => self.rate.as_ref().filter(|_| what == SETTLING_S).map(|rate| rate.settling.words()),
        };
        let words = || words().filter(|_| matches!(format, Format::Table)).map(Shown::Words);
        number.map(Shown::Number).or_else(words)
    }

    /// Its scores, and its edges over all sections and speeds.
    fn rows(&self, format: Format) -> Vec<Row> {
        let mine = self.numbers();
        let mut oracle = scores(&self.oracle);
        oracle.extend(self.interception.iter().flat_map(|found| intercepted(&found.oracle)));
        let Relative { recall, litres, score } = self.relative;
        let relative = [("recall", recall), ("litres", litres), ("score", score)]
            .map(|(name, value)| (name.to_owned(), value));
        let beside = self.beside.as_ref().map(|other| other.numbers()).unwrap_or_default();
        let find = |all: &[(String, Option<f64>)], what: &str| {
            all.iter().find(|(name, _)| name == what).and_then(|(_, value)| *value)
        };
        let only_beside = beside.iter().filter(|(what, _)| mine.iter().all(|(own, _)| own != what));
        let all = mine.iter().chain(only_beside).map(|(what, _)| what);
        all.map(|what| Row {
            what: what.clone(),
            run: self.shown(what, &mine, format),
            oracle: find(&oracle, what),
            // Of others a share says nothing: of the best waste, 0, for example.
            share_of_oracle: find(&relative, what),
            beside: self.beside.as_ref().and_then(|other| other.shown(what, &beside, format)),
        })
        .collect()
    }

    fn numbers(&self) -> Vec<(String, Option<f64>)> {
        let mut all = scores(&self.score);
        for EdgeRow { edge, summary, .. } in
            self.edges.iter().filter(|row| row.section.is_none() && row.from_m_s.is_none())
        {
            let EdgeSummary {
                wanted,
                missed,
                unmeetable,
                cut_off,
                spurious,
                p50_s,
                p95_s,
                worst_s,
                p50_m,
                p95_m,
                worst_m,
                ..
            } = summary;
            let counts = [
                ("wanted", wanted),
                ("missed", missed),
                ("unmeetable", unmeetable),
                ("cut_off", cut_off),
                ("spurious", spurious),
            ];
            all.extend(counts.map(|(name, count)| (format!("{edge}_{name}"), Some(*count as f64))));
            let ms = |value: &Option<f64>| value.map(|s| s * 1e3);
            all.extend(
                [("p50_ms", p50_s), ("p95_ms", p95_s), ("worst_ms", worst_s)]
                    .map(|(name, value)| (format!("{edge}_{name}"), ms(value))),
            );
            all.extend(
                [("p50_m", p50_m), ("p95_m", p95_m), ("worst_m", worst_m)]
                    .map(|(name, value)| (format!("{edge}_{name}"), *value)),
            );
            all.extend([("lead", summary.lead), ("lag", summary.lag)].into_iter().flat_map(|(way, off)| {
                let Off { edges, p50_s, p95_s, worst_s, p50_m, p95_m, worst_m } = off;
                let milli = |value: Option<f64>| value.map(|value| value * 1e3);
                [
                    ("edges", Some(edges as f64)),
                    ("p50_ms", milli(p50_s)),
                    ("p95_ms", milli(p95_s)),
                    ("worst_ms", milli(worst_s)),
                    ("p50_mm", milli(p50_m)),
                    ("p95_mm", milli(p95_m)),
                    ("worst_mm", milli(worst_m)),
                ]
                .map(|(name, value)| (format!("{edge}_{way}_{name}"), value))
            }));
        }
        let unheeded: usize = self.unheeded.iter().map(|unheeded| unheeded.commands).sum();
        all.push(("unheeded_commands".to_owned(), Some(unheeded as f64)));
        // As in a scenario, unknown where no rule held; and, as interception, where nothing was heard.
        let is_known = self.interception.is_some() && self.against_any.is_known();
        all.push(("forbidden_litres".to_owned(), is_known.then_some(self.against_any.litres)));
        if let Some(found) = &self.interception {
            all.extend(intercepted(&found.run));
            let constant = found.constant.off_target_share;
            all.push(("interception_off_target_share_of_constant_rate".to_owned(), constant));
        }
        if let Some(rate) = &self.rate {
            let count = |count: usize| Some(count as f64);
            let rows = [
                ("rate_mean_error", rate.mean),
                ("rate_p95_error", rate.p95),
                (SETTLING_S, rate.settling_s),
                ("rate_settling_at_least_s", rate.at_least_s),
                ("rate_steps", count(rate.steps)),
                ("rate_steps_unsettled", count(rate.unsettled)),
                ("rate_steps_unsettled_at_end", count(rate.unsettled_at_end)),
                ("rate_steps_unjudged", count(rate.unjudged)),
                ("rate_overshoot", rate.overshoot),
            ];
            all.extend(rows.map(|(name, value)| (name.to_owned(), value)));
        }
        all.extend(self.reported_error.map(|error| ("reported_error".to_owned(), Some(error))));
        if let Some(Balance { pump_l, returned_l, hoses_l, .. }) = self.hydraulics {
            let rows = [("pump_litres", pump_l), ("returned_litres", returned_l), ("hoses_litres", hoses_l)];
            all.extend(rows.map(|(name, litres)| (name.to_owned(), Some(litres))));
        }
        all
    }
}

/// Where the litres went, as shares, and what leaves got.
fn intercepted(found: &Interception) -> Vec<(String, Option<f64>)> {
    let share = |sink: Sink| (found.litres > 0.0).then(|| found.sinks.litres(sink) / found.litres);
    let sinks = Sink::ALL.map(|sink| (format!("interception_{}_share", sink.name()), share(sink)));
    let leaves = found.on_leaves.as_ref();
    let of_leaves = [
        ("ml_m2", leaves.map(|leaves| leaves.mean_ml_m2)),
        ("cv", leaves.and_then(|leaves| leaves.cv)),
        ("p5_ml_m2", leaves.map(|leaves| leaves.p5_ml_m2)),
        ("p95_ml_m2", leaves.map(|leaves| leaves.p95_ml_m2)),
    ];
    let of_leaves = of_leaves.map(|(name, value)| (format!("interception_{name}"), value));
    let cells = leaves.iter().flat_map(|leaves| {
        let ends = [("lowest_cell", leaves.lowest.ml_m2), ("highest_cell", leaves.highest.ml_m2)];
        let ends = ends.into_iter().map(|(name, value)| (format!("interception_{name}_ml_m2"), Some(value)));
        let parts = leaves.by_depth.iter().chain(&leaves.by_band);
        let parts =
            parts.map(|of| (format!("interception_{}_ml_m2", of.part.replace(' ', "_")), Some(of.ml_m2)));
        ends.chain(parts).collect::<Vec<_>>()
    });
    let off = ("off_target_share".to_owned(), found.off_target_share);
    [off].into_iter().chain(sinks).chain(of_leaves).chain(cells).collect()
}

fn scores(score: &Score) -> Vec<(String, Option<f64>)> {
    let all = [
        ("recall", score.recall),
        ("waste", score.waste),
        ("score", score.score),
        ("litres", Some(score.litres)),
        ("wasted_litres", Some(score.wasted_litres)),
        ("saved_litres", score.saved_litres),
        ("constant_litres", Some(score.constant_litres)),
        ("wanted_area_m2", Some(score.wanted_area_m2)),
        ("missed_area_m2", Some(score.missed_area_m2)),
        ("row_area_m2", Some(score.row_area_m2)),
        ("row_missed_area_m2", Some(score.row_missed_area_m2)),
        ("row_recall", score.row_recall),
    ];
    all.map(|(name, value)| (name.to_owned(), value)).to_vec()
}
