//! What a scenario can expect: one line each.

/// A thing that can be expected.
#[derive(Debug)]
pub struct What {
    /// As `what = "…"` names it.
    pub name: &'static str,
    /// The keys that go with it.
    pub keys: &'static [&'static str],
    /// What it tells, its unit and its source.
    pub tells: &'static str,
    /// Who judges it.
    pub kind: Kind,
}

impl What {
    /// True if it may be counted between two events.
    pub fn takes_events(&self) -> bool {
        matches!(self.kind, Kind::Count(_))
    }

    /// True if it is a count: no value of it lies between two whole numbers.
    pub fn is_whole(&self) -> bool {
        matches!(self.kind, Kind::Count(_) | Kind::FaultActs | Kind::ExitCode | Kind::Sprayer(Sprayed::Edges))
    }

    /// The least and the largest value that it can have; none where it may be any number.
    pub fn reach(&self) -> Option<(f64, f64)> {
        match self.kind {
            // A share of a whole.
            Kind::Sprayer(Sprayed::Recall | Sprayed::Waste | Sprayed::OffTarget) => Some((0.0, 1.0)),
            // What a process may return, or 128 and a signal's number.
            Kind::ExitCode => Some((0.0, 255.0)),
            // The load of a bus is no share: frames may ask for more than a bus has.
            Kind::Count(_)
            | Kind::Unheard
            | Kind::FaultActs
            | Kind::BusLoad
            | Kind::Measure(Measure::ImpactedTotalArea)
            | Kind::Sprayer(Sprayed::Edges | Sprayed::TimeToSafe | Sprayed::Forbidden) => {
                Some((0.0, f64::INFINITY))
            }
            Kind::NextScan
            | Kind::Measure(Measure::LeafAreaError)
            | Kind::Signal
            | Kind::Log
            | Kind::BytesOf
            | Kind::SameBytes
            | Kind::ProcessValue
            | Kind::Sprayer(
                Sprayed::LatencyError | Sprayed::SavedLitres | Sprayed::Valves | Sprayed::RateError,
            ) => None,
        }
    }
}

/// How an expectation is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The time of a stream's next scan.
    NextScan,
    /// A count of one device's delivered bytes.
    Count(Count),
    /// How long nobody took a device's scans.
    Unheard,
    /// A measure of the bench's own estimate of the delivered bytes.
    Measure(Measure),
    /// How often a fault acted.
    FaultActs,
    /// What a signal does.
    Signal,
    /// How much of a bus its frames take.
    BusLoad,
    /// A line of a child's output.
    Log,
    /// A file of the run's folder beside another.
    BytesOf,
    /// A file of the run's folder in several runs.
    SameBytes,
    /// How a child ended.
    ExitCode,
    /// What a sprayer did.
    Sprayer(Sprayed),
    /// A value of a task controller's client.
    ProcessValue,
}

/// What can be expected of a sprayer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sprayed {
    /// How far edges are off.
    LatencyError,
    /// Share of the wanted leaf area.
    Recall,
    /// Share of the litres.
    Waste,
    /// Litres beside a constant rate.
    SavedLitres,
    /// The valves' state.
    Valves,
    /// Edges missed and spurious.
    Edges,
    /// From a fault until nothing flows.
    TimeToSafe,
    /// Share of the litres that met neither leaf, wood nor fruit.
    OffTarget,
    /// How far the flow is off what the speed wants.
    RateError,
    /// What was sprayed while that was forbidden.
    Forbidden,
}

/// What `of` of `rate_error` may be.
pub(crate) const RATE: &[&str] = &["p95", "mean", "settling_s", "overshoot", "reported"];

/// Counts of one device's delivered bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// Telegrams missing by the counters.
    ScansLost,
    /// Telegrams that came again.
    ScansRepeated,
    /// Parts of turns that were lost as datagrams.
    SegmentsLost,
    /// Telegrams that cannot be read.
    TelegramsBad,
    /// Connections after the first.
    Reconnects,
}

/// Measures of the bench's own estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Impacted total area, m².
    ImpactedTotalArea,
    /// (estimate − truth) / truth of the leaf area.
    LeafAreaError,
}

const COUNT: &[&str] = &["on", "equals", "above", "below", "between", "after"];
const MEASURE: &[&str] =
    &["on", "equals", "above", "below", "abs_below", "between", "equals_run_without", "tolerance"];

const fn sprayer(
    name: &'static str,
    asked: Sprayed,
    keys: &'static [&'static str],
    tells: &'static str,
) -> What {
    What { name, keys, tells, kind: Kind::Sprayer(asked) }
}

/// All of them.
pub const WHATS: &[What] = &[
    What {
        name: "first_scan",
        keys: &["on", "after", "within_s"],
        tells: "the first scan delivered after an event, or after the start of time, comes within so many simulated seconds of the event, or of the start of the drive",
        kind: Kind::NextScan,
    },
    What {
        name: "streaming",
        keys: &["on", "after", "within_s"],
        tells: "the same as `first_scan`: scans are delivered again",
        kind: Kind::NextScan,
    },
    What {
        name: "scans_lost",
        keys: COUNT,
        tells: "scan telegrams missing by their counters, over all connections to the device, from the first that went out to a client to the end of the run: what the device made after the last delivered scan is missing, too; unknown where the device does not count its scans, or began to count anew",
        kind: Kind::Count(Count::ScansLost),
    },
    What {
        name: "scans_repeated",
        keys: COUNT,
        tells: "scan telegrams that came again; a poll that is answered with the scan of the last one counts",
        kind: Kind::Count(Count::ScansRepeated),
    },
    What {
        name: "segments_lost",
        keys: COUNT,
        tells: "segments of delivered turns, and of turns between them, that did not come as datagrams; their beams are unknown",
        kind: Kind::Count(Count::SegmentsLost),
    },
    What {
        name: "telegrams_bad",
        keys: COUNT,
        tells: "broken frames, stretches of bytes between frames that begin none, and scan telegrams in good frames that cannot be read",
        kind: Kind::Count(Count::TelegramsBad),
    },
    What {
        name: "reconnects",
        keys: COUNT,
        tells: "connections to the device over CoLa after the first",
        kind: Kind::Count(Count::Reconnects),
    },
    What {
        name: "unheard_s",
        keys: &["on", "equals", "above", "below", "between"],
        tells: "how long in the drive nobody took the device's scans, simulated seconds: no connection has asked for them, or a request has stopped the device",
        kind: Kind::Unheard,
    },
    What {
        name: "impacted_total_area_m2",
        keys: MEASURE,
        tells: "impacted total area I_T of the delivered scans, m²",
        kind: Kind::Measure(Measure::ImpactedTotalArea),
    },
    What {
        name: "leaf_area_error",
        keys: MEASURE,
        tells: "(estimate − truth) / truth of the leaf area, summed over the row's own trees that were scanned from end to end (no later alley, no second round), times the stretch that they are for the estimate over the one truly driven, less the first 2 % of what they differ; truth by cell",
        kind: Kind::Measure(Measure::LeafAreaError),
    },
    What {
        name: "fault_acts",
        keys: &["of", "equals", "above", "below", "between"],
        tells: "telegrams, connections or values of a sweep that a fault has acted on; of one that acts on bytes or datagrams, refuses connections or changes the device's answers, how often it began, whether anybody asked or not",
        kind: Kind::FaultActs,
    },
    What {
        name: "signal",
        keys: &[
            "signal",
            "pgn",
            "bytes",
            "matches",
            "equals",
            "above",
            "below",
            "abs_below",
            "between",
            "tolerance",
            "changes",
            "silent",
            "never",
            "every_s",
            "for_s",
            "after",
            "within_s",
            "equals_run_without",
        ],
        tells: "what a signal on a bus, in GNSS sentences or in a child's output does; its value holds until the next one is heard",
        kind: Kind::Signal,
    },
    What {
        name: "bus_load",
        keys: &["of", "above", "below", "between"],
        tells: "the largest share of a CAN bus at 250 kbit/s that its frames take in any second, with all stuff bits that can be; more than 1 where frames ask for more than a bus has",
        kind: Kind::BusLoad,
    },
    What {
        name: "log",
        keys: &["of", "matches", "after", "within_s"],
        tells: "a line of the child's output matches a regular expression; its time is that at which the bench read it",
        kind: Kind::Log,
    },
    What {
        name: "bytes_of",
        keys: &["file", "equals", "equals_run_without"],
        tells: "a file of the run's folder has the same bytes as another (relative to the scenario)",
        kind: Kind::BytesOf,
    },
    What {
        name: "same_bytes",
        keys: &["of", "runs"],
        tells: "a file of the run's folder has the same bytes in so many runs of one seed [2]",
        kind: Kind::SameBytes,
    },
    What {
        name: "exit_code",
        keys: &["of", "equals"],
        tells: "the child's exit code [0]; 128 and the signal's number if a signal ended it",
        kind: Kind::ExitCode,
    },
    sprayer(
        "latency_error_m",
        Sprayed::LatencyError,
        &["edge", "p95_below"],
        "how far the tractor drove between a section's edge that was wanted and the one that was delivered, m; a missed one is farther than any number; `unmeetable` and `cut_off` ones are left out",
    ),
    sprayer(
        "edges",
        Sprayed::Edges,
        &["of", "edge", "equals", "above", "below", "between"],
        "edges of sections that were `missed` or `spurious` (`of`); both where it is left out; what the run's end cut off is neither; `missed` is unknown where none was wanted, `spurious` alone where leaves were wanted and no valve was told to open",
    ),
    sprayer(
        "recall",
        Sprayed::Recall,
        &["above", "below", "between"],
        "share of the wanted leaf area that passed before an open nozzle, 0 to 1",
    ),
    sprayer(
        "waste",
        Sprayed::Waste,
        &["above", "below", "between"],
        "litres while the nozzle was not wanted, as a share of all, 0 to 1",
    ),
    sprayer(
        "saved_litres",
        Sprayed::SavedLitres,
        &["above", "below", "between"],
        "litres less than from all nozzles at full flow while the tractor goes ahead in its alleys, by the commands: what a sound machine would spray for them; unknown where leaves were wanted and no valve was told to open",
    ),
    sprayer(
        "valves",
        Sprayed::Valves,
        &["all", "after", "within_s"],
        "all valves are `closed` or `open` at once: at the event, or with `within_s` so many simulated seconds after it at the latest; an *error* where they are so already at it. Not that they stay so: `time_to_safe_s` asks for that",
    ),
    sprayer(
        "time_to_safe_s",
        Sprayed::TimeToSafe,
        &["after", "above", "below", "between"],
        "from an event until the last valve has shut, to stay shut until the event's `.end`, or the end of the run; simulated seconds",
    ),
    sprayer(
        "forbidden_litres",
        Sprayed::Forbidden,
        &["of", "within_s", "equals", "above", "below", "between"],
        "litres while a rule forbade spraying: `master`, `override`, `tank_empty`, `headland`, `reverse`, `standstill` or `no_spray` (`of`), or any of them; from `within_s` seconds [0] after the rule began; against `tank_empty` what open valves would let through at full flow; unknown where leaves were wanted and no valve was told to open",
    ),
    sprayer(
        "off_target_share",
        Sprayed::OffTarget,
        &["above", "below", "between"],
        "interception: share of the litres that meet neither leaf, wood nor fruit on a straight way from the nozzle, 0 to 1; air, drift, droplets, run-off and evaporation are not modelled",
    ),
    sprayer(
        "rate_error",
        Sprayed::RateError,
        &["of", "after", "above", "below", "abs_below", "between"],
        "how far the flow of nozzles with open valves, whether or not there is liquid behind them, is off what `[rate]` of the boom wants at the tractor's speed, by `of`: `p95` [of the error without its sign, as a share], `mean`, `settling_s` after steps of speed and sections, `overshoot` (a share), or `reported`: the controller's litres beside the true ones, as a share, to its last report, and to the run's end where it stopped to report; from an event on with `after`",
    ),
    What {
        name: "ddi",
        keys: &["element", "ddi", "value", "after", "within_s"],
        tells: "ISOBUS: what was told last of a DDI of an element of a task controller's client is `value`, a whole number, or \"as_setpoint\": what was set last by 290 (of 161), 289 (141), 1 (2) or by itself (1, 158, 160, 289, 290); what was told over a connection that was given up since holds no more; \"as_setpoint\" is unknown where each setpoint commanded nothing; so many simulated seconds after an event at the latest [0]",
        kind: Kind::ProcessValue,
    },
];

/// What is called `name`.
pub(crate) fn by_name(name: &str) -> Option<&'static What> {
    WHATS.iter().find(|what| what.name == name)
}

/// The table as Markdown, as docs/bench.md has it.
pub fn markdown() -> String {
    let mut text = "| what | keys | tells |\n|---|---|---|\n".to_owned();
    for what in WHATS {
        let keys: Vec<String> = what.keys.iter().map(|key| format!("`{key}`")).collect();
        text += &format!("| `{}` | {} | {} |\n", what.name, keys.join(", "), what.tells);
    }
    text
}
