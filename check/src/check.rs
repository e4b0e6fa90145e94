//! Scenarios tried one after the other, with each of their seeds.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::sync::watch;

use crate::course;
use crate::ending;
use crate::fault::ScenarioFault;
use crate::judge::{self, Runs};
use crate::judged::{self, Judged};
use crate::onlooker::Onlooker;
use crate::run_file;
use crate::runner::{self, Beside, RunRecord};
use crate::scenario::{Mode, Scenario};
use crate::signal;
use crate::sprayer::SprayerRun;
use crate::verdict::{
    ASLEEP, COMPUTE, Case, ENDED_EARLY, GAP, HELD_BACK, JITTER, Tried, Verdict, WARNING, name_of, rerun,
};
use crate::what::Kind;

/// Events told with a failure.
const LAST_EVENTS: usize = 5;

/// How scenarios are tried.
#[derive(Clone, Default)]
pub struct Options {
    /// Only this seed.
    pub seed: Option<u64>,
    /// Stop after the first expectation that does not hold or cannot be judged.
    pub fail_fast: bool,
    /// Where the runs' folders are made and kept; they go again without it.
    pub keep: Option<PathBuf>,
    /// Scenarios that others try before these: where the folders' numbers go on.
    pub before: usize,
    /// The program behind `{rowscan}`.
    pub program: Option<PathBuf>,
    /// Write the files anew that `bytes_of` compares with.
    pub bless: bool,
    /// The library that puts children on simulated time; it is looked for near the program where left out.
    pub child_clock: Option<PathBuf>,
    /// Who looks at the runs.
    pub onlooker: Option<Arc<dyn Onlooker>>,
}

/// Why nothing could be tried.
#[derive(Debug, thiserror::Error)]
#[error("cannot {what}: {cause}")]
pub struct CheckError {
    what: &'static str,
    cause: std::io::Error,
}

/// Tries scenarios, each seed on its own; `tell` hears of each that is done. Blocks; children die with the calling thread. When `cancelled`
/// turns true it ends, its children with it, and gives what is done, with the scenario that ran and those whose turn had not come as not judged.
///
/// # Errors
/// No runtime, or no folder for the runs.
pub fn check(
    scenarios: &[PathBuf],
    options: &Options,
    mut cancelled: watch::Receiver<bool>,
    tell: &mut dyn FnMut(&Tried),
) -> Result<Vec<Tried>, CheckError> {
    let failed = |what| move |cause| CheckError { what, cause };
    // One thread: nothing that is delivered is counted later than it is acknowledged.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(failed("start the runtime"))?;
    let temporary = tempfile::tempdir().map_err(failed("make a folder"))?;
    let root = options.keep.clone().unwrap_or_else(|| temporary.path().to_owned());
    let root = std::path::absolute(root).map_err(failed("name a folder"))?;
    let mut all = Vec::new();
    // Scenarios whose turn has come.
    let begun = Cell::new(0);
    let is_cancelled = runtime.block_on(async {
        let work = async {
            for (number, path) in scenarios.iter().enumerate() {
                begun.set(number + 1);
                let folder = root.join(format!("{:02}-{}", options.before + number + 1, name_of(path)));
                if !try_seeds(path, options, &folder, &mut all, tell).await {
                    break;
                }
            }
        };
        tokio::select! {
            () = work => false,
            // The sender may go: then nobody cancels.
            () = async { if cancelled.wait_for(|cancelled| *cancelled).await.is_err() { std::future::pending().await } } => true,
        }
    });
    if is_cancelled {
        let (begun, others) = scenarios.split_at(begun.get().min(scenarios.len()));
        let open = begun.last().map(|path| Tried::interrupted(path)).into_iter();
        for tried in open.chain(others.iter().map(|path| Tried::not_begun(path))) {
            tell(&tried);
            all.push(tried);
        }
    }
    Ok(all)
}

/// Tries a scenario with its seeds; false if nothing else shall be tried.
async fn try_seeds(
    path: &Path,
    options: &Options,
    folder: &Path,
    all: &mut Vec<Tried>,
    tell: &mut dyn FnMut(&Tried),
) -> bool {
    let goes_on = |tried: &Tried| !options.fail_fast || tried.is_fine();
    let scenario = match Scenario::load(path) {
        Ok(scenario) => scenario,
        Err(error) => {
            let tried = Tried::unjudged(path, &error.to_string());
            tell(&tried);
            let goes_on = goes_on(&tried);
            all.push(tried);
            return goes_on;
        }
    };
    let seeds: Vec<Option<u64>> = match (options.seed, scenario.seed) {
        (Some(seed), _) => vec![Some(seed)],
        (None, Some(first)) => (0..scenario.seeds).map(|n| Some(first.wrapping_add(n.into()))).collect(),
        (None, None) if scenario.seeds == 1 => vec![None],
        (None, None) => (1..=scenario.seeds).map(|n| Some(n.into())).collect(),
    };
    if options.bless && seeds.len() > 1 {
        let tried = Tried::unjudged(path, "a golden file is that of one seed: add `--seed N` to `--bless`");
        tell(&tried);
        let goes_on = goes_on(&tried);
        all.push(tried);
        return goes_on;
    }
    for seed in seeds {
        let tried = try_one(&scenario, seed, folder, options).await;
        tell(&tried);
        let goes_on = goes_on(&tried);
        all.push(tried);
        if !goes_on {
            return false;
        }
    }
    true
}

async fn try_one(scenario: &Scenario, seed: Option<u64>, folder: &Path, options: &Options) -> Tried {
    if let Some(why) = &scenario.refusal {
        return Tried { facts: facts(scenario), seed, ..Tried::unjudged(&scenario.path, why) };
    }
    let agreeing = scenario.expects.iter().filter(|expect| expect.what.kind == Kind::SameBytes);
    let runs_wanted = agreeing.map(|expect| expect.runs).max().unwrap_or(1);
    let seed_name = seed.map_or("own".to_owned(), |seed| seed.to_string());
    let folder_of = |run: &str| folder.join(format!("seed-{seed_name}-{run}"));
    let compares = !scenario.faults.is_empty()
        && scenario.expects.iter().any(|expect| expect.equals_run_without.is_some());
    let mut runs = Runs { all: Vec::new(), without_faults: None, bless: options.bless };
    for number in 1..=runs_wanted {
        match run_in((scenario, options), seed, folder_of(&format!("run-{number}")), &scenario.faults).await {
            Ok(run) => runs.all.push(run),
            Err(why) => return Tried::unjudged(&scenario.path, &why),
        }
        // What could not be run once is not run again.
        if runs.all.iter().any(|run| run.error.is_some()) {
            break;
        }
    }
    if compares && runs.all.iter().all(|run| run.error.is_none()) {
        match run_in((scenario, options), seed, folder_of("without-faults"), &[]).await {
            Ok(run) => runs.without_faults = Some(run),
            Err(why) => return Tried::unjudged(&scenario.path, &why),
        }
    }
    let Some(run) = runs.all.first() else { return Tried::unjudged(&scenario.path, "it was not run") };
    let expects = scenario.expects.iter().enumerate();
    let expected = expects.map(|(number, expect)| {
        let judged = judge::judge(scenario, number, expect, &runs);
        // The folder is gone with the run unless it is kept.
        let is_shown = judged.verdict == Verdict::Failed && options.keep.is_some();
        let picture = is_shown.then(|| signal::picture(number, expect, &judged, run)).flatten();
        let case = case(scenario, format!("{}. {}", number + 1, expect.title()), judged, run);
        Case { picture, ..case }
    });
    let short = course::shortfalls(scenario, &runs).into_iter();
    let short = short.map(|shortfall| case(scenario, shortfall.name, shortfall.judged, run));
    let cases = expected.chain(short).collect();
    let tails = run.children.iter().map(|(id, child)| format!("[{id}]\n{}", child.tail));
    let facts = [facts(scenario), facts_of(scenario, run)].concat();
    Tried {
        scenario: scenario.path.clone(),
        name: name_of(&scenario.path),
        seed: Some(run.seed),
        facts,
        cases,
        events: run.events.clone(),
        output: tails.collect(),
        simulated_s: run.ended.as_secs_f64(),
        wall_s: runs.all.iter().chain(&runs.without_faults).map(|run| run.wall_s).sum(),
    }
}

/// Runs a scenario in a folder that is made for it.
async fn run_in(
    (scenario, options): (&Scenario, &Options),
    seed: Option<u64>,
    folder: PathBuf,
    faults: &[ScenarioFault],
) -> Result<RunRecord, String> {
    fresh(&folder).map_err(|cause| format!("cannot make {}: {cause}", folder.display()))?;
    let beside = Beside {
        program: options.program.as_deref(),
        child_clock: options.child_clock.as_deref(),
        onlooker: options.onlooker.as_deref(),
        is_kept: options.keep.is_some(),
    };
    Ok(runner::run(scenario, seed, &folder, (faults, beside)).await)
}

/// What is known of a run once it is over.
fn facts_of(scenario: &Scenario, run: &RunRecord) -> Vec<(String, String)> {
    let mut facts = vec![("scans_missed".to_owned(), run.scans_missed.to_string())];
    if run.fault_events_lost > 0 {
        facts.push(("fault_events_lost".to_owned(), run.fault_events_lost.to_string()));
    }
    facts.extend(run.warnings.iter().map(|what| (WARNING.to_owned(), what.clone())));
    facts.extend(ending::driven_on(scenario, run).map(|what| (WARNING.to_owned(), what)));
    facts.extend(run.early(scenario).map(|early| (ENDED_EARLY.to_owned(), early)));
    facts.extend(run.jitter.map(|jitter| (JITTER.to_owned(), jitter.to_string())));
    let sprayed = run.sprayer.iter().flatten().map(SprayerRun::words);
    facts.extend(sprayed.map(|words| ("sprayer".to_owned(), words)));
    let longest = run.longest_compute.map(|longest| format!("{:.1} ms", longest.as_secs_f64() * 1e3));
    facts.extend(longest.map(|longest| (COMPUTE.to_owned(), longest)));
    facts.extend(gaps(run).map(|gap| (GAP.to_owned(), gap)));
    facts.extend(run.sleeps.iter().map(|sleep| (ASLEEP.to_owned(), judged::asleep(run, sleep))));
    let mut held: Vec<&str> = scenario.faults.iter().filter_map(ScenarioFault::holds_back).collect();
    held.dedup();
    if scenario.clock.mode == Mode::Lockstep && !held.is_empty() {
        facts.push((HELD_BACK.to_owned(), held.join(", ")));
    }
    facts
}

/// The gaps of a run in words.
fn gaps(run: &RunRecord) -> impl Iterator<Item = String> {
    let long = run.gaps.iter().filter(|gap| gap.to.unwrap_or(run.ended) > gap.from);
    long.map(|gap| {
        let (from_s, to_s) = (gap.from.as_secs_f64(), gap.to.unwrap_or(run.ended).as_secs_f64());
        format!(
            "nobody took scans from {from_s:.3} s to {to_s:.3} s: time went on at this machine's pace, and the run does not repeat to the byte"
        )
    })
}

/// An empty folder: what an earlier check left in it would be taken for this one's. What is no earlier run is left alone.
fn fresh(folder: &Path) -> std::io::Result<()> {
    let holds = std::fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
    if holds && !folder.join(run_file::NAME).exists() {
        let why = format!(
            "it holds files and no {} of an earlier run; name another folder for --keep, or empty this one",
            run_file::NAME
        );
        return Err(std::io::Error::new(std::io::ErrorKind::AlreadyExists, why));
    }
    match std::fs::remove_dir_all(folder) {
        Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => return Err(cause),
        _ => {}
    }
    std::fs::create_dir_all(folder)
}

fn facts(scenario: &Scenario) -> Vec<(String, String)> {
    let mode = match scenario.clock.mode {
        Mode::Paced => "paced",
        Mode::Lockstep => "lockstep",
    };
    vec![("scene".to_owned(), scenario.scene.clone()), ("clock".to_owned(), mode.to_owned())]
}

fn case(scenario: &Scenario, name: String, judged: Judged, run: &RunRecord) -> Case {
    let at = judged.at.unwrap_or(run.ended);
    let row_m = run.journal.as_ref().map(|journal| journal.row_m(at));
    let until = run.events.iter().filter(|event| event.t_s <= at.as_secs_f64());
    let words: Vec<String> = until.map(crate::journal::Event::words).collect();
    let is_bad = judged.verdict > Verdict::Skipped;
    let last = words.len().saturating_sub(LAST_EVENTS);
    Case {
        name: format!("{name} [seed {}]", run.seed),
        verdict: judged.verdict,
        message: judged.message,
        t_s: run.journal.as_ref().map(|_| at.as_secs_f64()),
        row_m,
        tree: row_m.and_then(|row_m| run.truths.values().next()?.beside(row_m)),
        last_events: if is_bad { words[last..].to_vec() } else { Vec::new() },
        rerun: rerun(&scenario.path, Some(run.seed)),
        picture: None,
    }
}
