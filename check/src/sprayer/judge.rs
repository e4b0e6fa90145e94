//! What is expected of a sprayer, judged.

use rowscan_protocol::time::SimTime;
use rowscan_sprayer::edges::{EdgePair, EdgeSummary, MATCH_M};
use rowscan_sprayer::rate::Settling;
use rowscan_sprayer::safety::{Rule, Spilt, is_already_safe, time_to_safe_s};
use rowscan_sprayer::{Rate, Spans};

use super::edge_words::{due_s, words};
use super::run::{Reported, SprayerRun};
use crate::judged::{Judged, Window};
use crate::runner::RunRecord;
use crate::scenario::{Expect, ValveState};
use crate::verdict::Verdict;
use crate::what::Sprayed;

type Result = std::result::Result<Judged, String>;

/// Judges an expectation of the sprayer.
pub(crate) fn judge(expect: &Expect, asked: Sprayed, run: &RunRecord) -> Result {
    let name = expect.what.name;
    let sprayer = match &run.sprayer {
        None => {
            return Err(format!(
                "`{name}` needs a sprayer: add `sprayer = {{ boom = \"boom.toml\", bus = \"can0\" }}`"
            ));
        }
        Some(Err(why)) => return Err(why.clone()),
        Some(Ok(sprayer)) => sprayer,
    };
    if let Some(why) = sprayer.unheard() {
        return Err(format!("`{name}`: unknown: {why}"));
    }
    let spares = match asked {
        Sprayed::SavedLitres | Sprayed::Forbidden => true,
        Sprayed::Edges => expect.on.as_deref() == Some("spurious"),
        _ => false,
    };
    if let Some(why) = sprayer.idle().filter(|_| spares) {
        return Err(format!("`{name}`: unknown: {why}"));
    }
    let (score, best) = (&sprayer.score, &sprayer.oracle);
    match asked {
        Sprayed::Recall => bounded(expect, score.recall, best.recall, "no leaf passed the nozzles"),
        Sprayed::Waste => bounded(expect, score.waste, best.waste, "nothing was sprayed"),
        Sprayed::SavedLitres => {
            bounded(expect, score.saved_litres, best.saved_litres, "nothing was told to open")
        }
        Sprayed::LatencyError => latency(expect, sprayer),
        Sprayed::Edges => edges(expect, sprayer),
        Sprayed::Valves => valves(expect, sprayer, run),
        Sprayed::TimeToSafe => time_to_safe(expect, sprayer, run),
        Sprayed::OffTarget => {
            let found = sprayer.interception();
            let (own, best) = (found.run.off_target_share, found.oracle.off_target_share);
            bounded(expect, own.filter(|_| score.waste.is_some()), best, "nothing was sprayed")
        }
        Sprayed::RateError => rate_error(expect, sprayer, run),
        Sprayed::Forbidden => forbidden(expect, sprayer),
    }
}

/// A number within its bounds; an error where it is unknown.
fn bounded(expect: &Expect, found: Option<f64>, best: Option<f64>, why: &str) -> Result {
    let name = expect.what.name;
    let found = found.ok_or_else(|| format!("`{name}`: unknown: {why}"))?;
    let best = best.map_or("unknown".to_owned(), |best| format!("{best:.4}"));
    let message = format!("{name}: expected {}, found {found:.4}; the oracle: {best}", expect.bounds.words());
    Ok(Judged::holds(expect.bounds.hold(found), message))
}

fn latency(expect: &Expect, sprayer: &SprayerRun) -> Result {
    let most_m = expect.p95_below.unwrap_or_default();
    let edge = expect.edge;
    let none = "`latency_error_m`: unknown: no edge was wanted that could be met before the run's end";
    let p95_m = sprayer.edges.p95_with_missed_m(edge).ok_or(none)?;
    let of = sprayer.edges.summary(|pair| edge.is_none_or(|edge| edge == pair.edge));
    let told = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:+.3} m"));
    let p95 = if p95_m.is_finite() { format!("{p95_m:.3} m") } else { "a missed edge".to_owned() };
    let message = format!(
        "latency error{}: expected a 95th percentile below {most_m} m, found {p95}; median {}, {} of {} wanted edges missed, {} spurious{}",
        edge.map_or(String::new(), |edge| format!(" of {}", edge.name())),
        told(of.p50_m),
        of.missed,
        of.wanted,
        of.spurious,
        undecided(&of),
    );
    let is_off = |pair: &EdgePair| {
        pair.wanted_s.is_some()
            && pair.undecided.is_none()
            && edge.is_none_or(|edge| edge == pair.edge)
            && pair.late_m.is_none_or(|late_m| late_m.abs() >= most_m)
    };
    Ok(beside_first(Judged::holds(p95_m < most_m, message), sprayer, is_off))
}

/// How many edges say nothing of the controller, in words; nothing where there are none.
fn undecided(of: &EdgeSummary) -> String {
    let cut_off = format!("cut off: the run's end, or its beginning, is within {MATCH_M} m");
    let counts = [
        (of.unmeetable, "unmeetable: wanted before any command could open the section"),
        (of.cut_off, cut_off.as_str()),
    ];
    let told = counts.iter().filter(|(count, _)| *count > 0).map(|(count, why)| format!(", {count} {why}"));
    told.collect()
}

/// What failed is told with the first of these edges: its section, its time, and where the tractor was.
fn beside_first(judged: Judged, sprayer: &SprayerRun, which: impl Fn(&EdgePair) -> bool) -> Judged {
    let all = sprayer.edges.all().iter().filter(|pair| which(pair));
    let first = all.filter_map(|pair| Some((due_s(pair)?, pair))).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((at_s, pair)) = first.filter(|_| judged.verdict == Verdict::Failed) else { return judged };
    let message = format!("{}; the first: {}", judged.message, words(sprayer, pair, at_s));
    let at = SimTime((at_s * 1e9).round() as u64);
    Judged { message, ..judged }.told_at(at)
}

fn edges(expect: &Expect, sprayer: &SprayerRun) -> Result {
    let edge = expect.edge;
    let of = sprayer.edges.summary(|pair| edge.is_none_or(|edge| edge == pair.edge));
    let (found, what, [is_missed, is_spurious]) = match expect.on.as_deref() {
        None => (of.missed + of.spurious, "missed and spurious edges", [true, true]),
        Some("missed") => (of.missed, "missed edges", [true, false]),
        Some("spurious") => (of.spurious, "spurious edges", [false, true]),
        Some(other) => return Err(format!("`of`: expected \"missed\" or \"spurious\", found \"{other}\"")),
    };
    let none_decided = sprayer.edges.p95_with_missed_m(edge).is_none();
    // Where none was wanted, none can be missed, and one for nothing can be.
    let none_wanted = of.wanted == 0 && is_spurious;
    if is_missed && none_decided && found == 0 && !none_wanted {
        return Err(format!("{what}: unknown: no edge was wanted that could be met{}", undecided(&of)));
    }
    let message = format!(
        "{what}: expected {}, found {found} beside {} wanted ones{}",
        expect.bounds.words(),
        of.wanted,
        undecided(&of)
    );
    let counts = |pair: &EdgePair| {
        let is_one = (is_missed && pair.is_missed()) || (is_spurious && pair.is_spurious());
        is_one && edge.is_none_or(|edge| edge == pair.edge)
    };
    Ok(beside_first(Judged::holds(expect.bounds.hold(found as f64), message), sprayer, counts))
}

fn valves(expect: &Expect, sprayer: &SprayerRun, run: &RunRecord) -> Result {
    let wanted = expect.all.ok_or("`valves` expects nothing yet; add `all`")?;
    let window = Window::of(expect.after.as_ref(), run)?;
    let (from, due) = (window.from, window.due(expect.within_s.unwrap_or_default()));
    if due > run.ended {
        return Err(run.end().before("`within_s` was over"));
    }
    let (from_s, due_s) = (from.as_secs_f64(), due.as_secs_f64());
    // The first instant at which all are so.
    let open: Vec<&Spans> = sprayer.flows.iter().map(|flow| &flow.valve).collect();
    let is_so = |at: f64| match wanted {
        ValveState::Closed => open.iter().all(|open| !open.has(at)),
        ValveState::Open => open.iter().all(|open| open.has(at)),
    };
    let changes = open.iter().flat_map(|open| open.iter().flat_map(|span| [span.from, span.to]));
    let later = changes.filter(|at| *at > from_s && *at <= due_s && is_so(*at)).fold(f64::INFINITY, f64::min);
    let name = wanted.name();
    // At an instant its state is asked for; within a time it has to become so.
    if is_so(from_s) && expect.within_s.is_none() {
        return Ok(Judged::holds(true, format!("all valves were {name}")).at(from).due(due, from));
    }
    if is_so(from_s) {
        let event = expect.after.as_ref().map_or("the run began".to_owned(), |after| format!("{after} came"));
        return Err(format!(
            "`valves`: unknown: all valves were {name} already when {event}, so `within_s` says nothing; have that happen while they are not, or leave `within_s` out to ask for that instant"
        ));
    }
    Ok(if later.is_finite() {
        let at = SimTime((later * 1e9).round() as u64);
        let others = open.iter().flat_map(|open| open.iter().flat_map(|span| [span.from, span.to]));
        let again = others.filter(|other| *other > later && !is_so(*other)).fold(f64::INFINITY, f64::min);
        let again = match again.is_finite() {
            true => format!("; {:.3} s later not all were", again - later),
            false => String::new(),
        };
        Judged::holds(true, format!("all valves were {name} after {:.3} s{again}", later - from_s))
            .at(at)
            .due(due, at)
    } else {
        Judged::holds(
            false,
            format!("expected all valves {name} within {:.3} s, found others until then", due_s - from_s),
        )
        .at(due)
    })
}

fn time_to_safe(expect: &Expect, sprayer: &SprayerRun, run: &RunRecord) -> Result {
    let after = expect.after.as_ref().ok_or("`time_to_safe_s` counts from an event; add `after`")?;
    let from = Window::of(Some(after), run)?.from;
    let over = format!("{after}.end");
    let end =
        run.events.iter().find(|event| event.event == over).map_or(run.ended, crate::journal::Event::at);
    if end <= from {
        return Err(format!(
            "`time_to_safe_s`: unknown: no simulated time passed from {after} to its end (in lockstep, time waits for a paused host); count from an event that lasts"
        ));
    }
    let (from_s, end_s) = (from.as_secs_f64(), end.as_secs_f64());
    if is_already_safe(&sprayer.flows, from_s, end_s) {
        return Err(format!(
            "`time_to_safe_s`: unknown: all valves were shut already when {after} came, and stayed so; let it come while the boom sprays"
        ));
    }
    let bounds = expect.bounds.words();
    Ok(match time_to_safe_s(&sprayer.flows, from_s, end_s) {
        Some(found) => Judged::holds(
            expect.bounds.hold(found),
            format!("time to safe after {after}: expected {bounds}, found {found:.3} s"),
        ),
        None => Judged::holds(
            false,
            format!(
                "time to safe after {after}: expected {bounds}, found a valve that was still open {:.3} s later, at its end",
                end_s - from_s
            ),
        ),
    })
}

fn forbidden(expect: &Expect, sprayer: &SprayerRun) -> Result {
    let rule =
        expect.on.as_deref().map(|name| Rule::named(name).ok_or(format!("`of`: there is no rule {name}")));
    let rule = rule.transpose()?;
    let grace_s = expect.within_s.unwrap_or_default();
    let spilt = sprayer.forbidden(grace_s).spilt(rule);
    let Spilt { forbidden_s, litres } = spilt;
    let name = rule.map_or("any rule", Rule::name);
    if !spilt.is_known() {
        let why = match sprayer.forbidden(0.0).spilt(rule).forbidden_s {
            held_s if held_s > 0.0 => {
                format!("it forbade spraying for {held_s:.3} s, and `within_s` is {grace_s} s; lower it")
            }
            _ => "it never forbade spraying in this run".to_owned(),
        };
        return Err(format!("`forbidden_litres` of `{name}`: unknown: {why}"));
    }
    let message = format!(
        "litres against {name}: expected {}, found {litres:.4} in {forbidden_s:.3} s",
        expect.bounds.words()
    );
    Ok(Judged::holds(expect.bounds.hold(litres), message))
}

fn rate_error(expect: &Expect, sprayer: &SprayerRun, run: &RunRecord) -> Result {
    let from_s = Window::of(expect.after.as_ref(), run)?.opens.as_secs_f64();
    let asked = expect.on.as_deref().unwrap_or("p95");
    let unknown = |why: &str| format!("`rate_error` of `{asked}`: unknown: {why}");
    let rate = || {
        let keys = sprayer.pass.boom().rate.ok_or_else(|| unknown("the boom has no `[rate]`; add it"))?;
        Ok::<_, String>(Rate::of(&sprayer.pass, &keys, &sprayer.flows, from_s))
    };
    let none_open = "no nozzle was open for a whole window while the tractor drove";
    let (found, also) = match asked {
        "reported" if sprayer.reports.is_empty() => {
            return Err(unknown(
                "the controller reports no litres; name the signal by `sprayer.reported_litres`",
            ));
        }
        "reported" => {
            let why = "it takes two reports, and litres between them";
            let Reported { error, silent_s } = sprayer.reported(from_s).ok_or_else(|| unknown(why))?;
            let told = |silent_s| {
                format!(
                    "; its last report came {silent_s:.3} s before the run's end, and what was sprayed since counts"
                )
            };
            (error, silent_s.map_or(String::new(), told))
        }
        "mean" => (rate()?.mean.ok_or_else(|| unknown(none_open))?, String::new()),
        "overshoot" => {
            let rate = rate()?;
            (rate.overshoot.ok_or_else(|| unknown("no step can be judged"))?, told(&rate))
        }
        "settling_s" => {
            let rate = rate()?;
            let at_least_s = rate.at_least_s.ok_or_else(|| unknown("no step can be judged"))?;
            let settled = match rate.settling {
                // Longer than any number.
                Settling::NotSettled => f64::INFINITY,
                // It may have taken any longer time: unknown where that matters.
                Settling::RunEnded if expect.bounds.hold(at_least_s) != expect.bounds.hold(f64::INFINITY) => {
                    return Err(unknown(&run.end().before("the rate had settled")));
                }
                _ => at_least_s,
            };
            (settled, told(&rate))
        }
        _ => (rate()?.p95.ok_or_else(|| unknown(none_open))?, String::new()),
    };
    let shown = match found.is_finite() {
        true => format!("{found:.4}"),
        false => Settling::NotSettled.words().to_owned(),
    };
    let message = format!("rate error, {asked}: expected {}, found {shown}{also}", expect.bounds.words());
    Ok(Judged::holds(expect.bounds.hold(found), message))
}

fn told(rate: &Rate) -> String {
    let Rate { steps, unsettled, unsettled_at_end, unjudged, .. } = rate;
    let counts = [
        (*unsettled, "not settled when the next one came"),
        (*unsettled_at_end, "not settled when the run ended"),
        (*unjudged, "more that say nothing: no flow behind them, or the next one or the end within 0.5 s"),
    ];
    let of = counts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!(", {count} {what}"));
    format!("; {steps} steps{}", of.collect::<String>())
}
