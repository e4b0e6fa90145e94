//! What stands at the end of every command's help: two examples, and the page of the documentation.

use clap::Command;

/// One command's end of its help.
pub struct Examples {
    /// The command by its words, without `rowscan`.
    pub words: &'static str,
    /// Command lines that work as they stand, but for addresses and files of one's own.
    pub lines: [&'static str; 2],
    /// The page in docs/ that tells more.
    pub page: &'static str,
}

const fn of(words: &'static str, page: &'static str, lines: [&'static str; 2]) -> Examples {
    Examples { words, lines, page }
}

/// Every command that does something, in the order of the help.
pub const EXAMPLES: &[Examples] = &[
    of("demo", "start", ["rowscan demo", "rowscan demo mature --seed 7 --picture row.png"]),
    of(
        "emulate",
        "device",
        [
            "rowscan emulate spindle --tcp 127.0.0.1:2111",
            "rowscan emulate mature --model tim561 --time-scale max --web 127.0.0.1:8080",
        ],
    ),
    of(
        "check",
        "bench",
        ["rowscan check tools/scenarios/steady.toml", "rowscan check *.toml --jobs 4 --junit verdicts.xml"],
    ),
    of(
        "score",
        "sprayer",
        [
            "rowscan score kept/01-row/seed-7-run-1 --picture row.svg",
            "rowscan score kept/01-row --beside before/01-row --format json",
        ],
    ),
    of(
        "spray",
        "sprayer",
        [
            "rowscan spray tcp://192.168.0.1:2112 --can socketcan:can0 --boom boom.toml --rig rig.toml",
            "rowscan spray tcp://127.0.0.1:2112 --can socketcand-client:127.0.0.1:29536/can0 --boom boom.toml",
        ],
    ),
    of(
        "estimate",
        "estimators",
        [
            "rowscan estimate tcp://127.0.0.1:2111 --rig spindle --scans 100",
            "rowscan estimate run.mcap --rig rig.toml --profile 0.25 --format csv --by band",
        ],
    ),
    of(
        "watch",
        "watch",
        ["rowscan watch tcp://192.168.0.1:2112 --rig rig.toml", "rowscan watch run.mcap --rig spindle"],
    ),
    of(
        "orchard grow",
        "orchards",
        ["rowscan orchard grow spindle --seed 7", "rowscan orchard grow paper --output paper"],
    ),
    of(
        "orchard truth",
        "orchards",
        ["rowscan orchard truth spindle", "rowscan orchard truth spindle --cells --format csv"],
    ),
    of(
        "orchard import",
        "orchards",
        [
            "rowscan orchard import --mesh tree.obj --leaf-material foliage",
            "rowscan orchard import --branches b.txt --leaves l.txt --output tree --write obj",
        ],
    ),
    of(
        "orchard export",
        "orchards",
        [
            "rowscan orchard export spindle --output row --write obj",
            "rowscan orchard export spindle --svg row.svg --scan lateral",
        ],
    ),
    of(
        "orchard render",
        "pictures",
        [
            "rowscan orchard render spindle --output row.png",
            "rowscan orchard render spindle --season bloom --trees 3 -o bloom.png",
        ],
    ),
    of(
        "orchard statistics",
        "orchards",
        ["rowscan orchard statistics spindle mature", "rowscan orchard statistics --seeds 1..5 --format csv"],
    ),
    of(
        "orchard parameters",
        "orchard-parameters",
        ["rowscan orchard parameters spindle", "rowscan orchard parameters my-row.toml --format json"],
    ),
    of(
        "scan",
        "paper",
        [
            "rowscan scan spindle --type lateral",
            "rowscan scan paper --type zenith --output scan --write matrix,csv",
        ],
    ),
    of(
        "study areas",
        "paper",
        [
            "rowscan study areas --iterations 7,8 --shady 60,101",
            "rowscan study areas --seeds 1..3 --format json",
        ],
    ),
    of(
        "study resolution",
        "studies",
        [
            "rowscan study resolution --orchards 2",
            "rowscan study resolution --advances-mm 10,100 --format csv",
        ],
    ),
    of(
        "study run",
        "studies",
        [
            "rowscan study run docs/examples/quick-study.toml",
            "rowscan study run docs/examples/quick-study.toml --shard 1/4 --output part1.json",
        ],
    ),
    of(
        "study search",
        "studies",
        [
            "rowscan study search docs/examples/paper-knobs.toml",
            "rowscan study search knobs.toml --confirm 101..110 --points 3,7",
        ],
    ),
    of(
        "study merge",
        "studies",
        ["rowscan study merge part1.json part2.json", "rowscan study merge part*.json --format csv"],
    ),
    of(
        "study calibration",
        "accuracy",
        [
            "rowscan study calibration my-row.toml --output my-row-calibration.toml",
            "rowscan study calibration spindle --seeds 101..120 --lai 1..3",
        ],
    ),
    of(
        "study accuracy",
        "accuracy",
        [
            "rowscan study accuracy spindle --seeds 1..5",
            "rowscan study accuracy my-row.toml --calibration mine.toml",
        ],
    ),
    of(
        "study budget",
        "accuracy",
        ["rowscan study budget spindle --seeds 1..3", "rowscan study budget spindle --format csv"],
    ),
    of(
        "study transfer",
        "accuracy",
        [
            "rowscan study transfer --rows 6",
            "rowscan study transfer --classes study/classes.toml --format json",
        ],
    ),
    of(
        "study coverage",
        "accuracy",
        [
            "rowscan study coverage --rows 20",
            "rowscan study coverage --classes study/classes.toml --format csv",
        ],
    ),
    of(
        "study estimators",
        "estimators",
        [
            "rowscan study estimators spindle --seeds 1..5",
            "rowscan study estimators mature --model tim561 --format csv",
        ],
    ),
    of(
        "study eye",
        "optics",
        [
            "rowscan study eye spindle --seeds 401..402 --model lms111",
            "rowscan study eye --distance 2 --format csv",
        ],
    ),
    of(
        "study field",
        "validation",
        [
            "rowscan study field --plan --rig spindle",
            "rowscan study field field.csv --rig rig.toml -o field.toml",
        ],
    ),
    of(
        "study pieces",
        "accuracy",
        [
            "rowscan study pieces spindle --seeds 1201..1202 --model lms111 --distance 2",
            "rowscan study pieces --distance 2 --format csv",
        ],
    ),
    of(
        "study clumping",
        "optics",
        [
            "rowscan study clumping spindle vase --lai 1,1.5,2 --distance 2,3",
            "rowscan study clumping --model lms511,tim561 --format csv",
        ],
    ),
    of(
        "study sides",
        "accuracy",
        [
            "rowscan study sides spindle --seeds 1301..1302 --model lms111",
            "rowscan study sides mature --distance 2.5 --format csv",
        ],
    ),
    of(
        "study physics",
        "optics",
        [
            "rowscan study physics spindle --model lms111 --distance 2",
            "rowscan study physics --figure physics.svg",
        ],
    ),
    of(
        "study recording",
        "optics",
        [
            "rowscan study recording still.mcap --model lms111",
            "rowscan study recording still.pcap --model lms511 --format csv",
        ],
    ),
    of(
        "record",
        "record",
        ["rowscan record tcp://192.168.0.1:2112 -o run.mcap", "rowscan record --info run.mcap"],
    ),
    of(
        "replay",
        "record",
        [
            "rowscan replay run.mcap --tcp 127.0.0.1:2111",
            "rowscan replay run.pcap --model lms511 --loop --from 12.5s",
        ],
    ),
    of(
        "export",
        "record",
        [
            "rowscan export run.mcap --to csv -o scans.csv",
            "rowscan export run.mcap --to ply -o points.ply --rig spindle",
        ],
    ),
    of(
        "decode",
        "decode",
        ["rowscan decode run.mcap --only DeviceIdent", "rowscan decode capture.pcap --format jsonl"],
    ),
    of("bus dbc", "can", ["rowscan bus dbc", "rowscan bus dbc > rowscan.dbc"]),
    of("bus markdown", "can", ["rowscan bus markdown", "rowscan bus markdown > messages.md"]),
    of(
        "bus decode",
        "can",
        ["rowscan bus decode candump.log", "rowscan bus decode candump.log --format csv"],
    ),
    of(
        "proxy",
        "faults",
        [
            "rowscan proxy tcp://192.168.0.1:2112 --tcp 127.0.0.1:2111 --faults lost.toml",
            "rowscan proxy serial:/dev/ttyUSB0 --pty ./scanner --record run.mcap",
        ],
    ),
    of("faults", "faults", ["rowscan faults", "rowscan faults --format json"]),
    of("scene new", "rigs", ["rowscan scene new my-row.toml", "rowscan scene new"]),
    of("scene check", "rigs", ["rowscan scene check my-row.toml", "rowscan scene check rows/*.toml"]),
    of(
        "scene show",
        "rigs",
        ["rowscan scene show spindle", "rowscan scene show my-row.toml --svg my-row.svg"],
    ),
    of("rig new", "rigs", ["rowscan rig new rig.toml", "rowscan rig new"]),
    of("rig check", "rigs", ["rowscan rig check rig.toml", "rowscan rig check rigs/*.toml"]),
    of("rig show", "rigs", ["rowscan rig show rig.toml", "rowscan rig show spindle --svg rig.svg"]),
    of("schema", "reference-keys", ["rowscan schema scene", "rowscan schema rig > rig.schema.json"]),
    of("completions", "install", ["rowscan completions bash", "rowscan completions zsh > ~/.zfunc/_rowscan"]),
    of("man", "install", ["rowscan man man1", "rowscan man /usr/local/share/man/man1"]),
    of("models", "models", ["rowscan models lms111", "rowscan models --format csv"]),
];

/// A command line with the end of every command's help.
pub(super) fn ended(command: Command) -> Command {
    with_end(command, "")
}

fn with_end(mut command: Command, words: &str) -> Command {
    let inner: Vec<String> = command.get_subcommands().map(|inner| inner.get_name().to_owned()).collect();
    for name in inner {
        let words = format!("{words} {name}");
        command = command.mut_subcommand(name, |inner| with_end(inner, words.trim()));
    }
    let end = end_of(words);
    // A command whose help ends in a list of its own keeps it, before the examples.
    let long = command.get_after_long_help().map(|list| format!("{list}\n\n{end}"));
    let command = command.after_help(end);
    match long {
        Some(long) => command.after_long_help(long),
        None => command,
    }
}

/// Two examples and a page; of a command that only has others below it, the first of two of them.
fn end_of(words: &str) -> String {
    let mut below = EXAMPLES.iter().filter(|examples| is_below(examples.words, words));
    let (lines, page) = match EXAMPLES.iter().find(|examples| examples.words == words) {
        Some(Examples { lines, page, .. }) => (lines.to_vec(), *page),
        None => {
            let two: Vec<&Examples> = below.by_ref().take(2).collect();
            let page = two.first().map_or("start", |examples| examples.page);
            (two.iter().filter_map(|examples| examples.lines.first().copied()).collect(), page)
        }
    };
    let lines: String = lines.iter().map(|line| format!("  {line}\n")).collect();
    format!("Examples:\n{lines}\nMore: docs/{page}.md")
}

fn is_below(words: &str, above: &str) -> bool {
    above.is_empty() || words.strip_prefix(above).is_some_and(|rest| rest.starts_with(' '))
}
