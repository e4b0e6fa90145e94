//! The start-up sequences of public clients, byte for byte, against the emulator under frozen time: every request gets the reply its client
//! waits for, in one write, in time. The sequences are files in `tests/it/transcripts/`; `script.rs` there says how they are written.

mod script;
mod times;

use crate::common;

use std::path::PathBuf;
use std::time::Duration;

use common::small_scene;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{Emulator, EmulatorConfig};
use rowscan_protocol::device::{DialectPolicy, Options};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder, encode};
use rowscan_protocol::model::{self, MODELS, Model};
use rowscan_protocol::telegram::{Kind, LmdScandata, Telegram};
use script::{Exchange, Expected, Script, Step};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

/// Models that a transcript is written for and that are not there yet, with the reason.
const ABSENT: &[(&str, &str)] = &[];

/// Longer than any telegram here.
const MAX_PAYLOAD: usize = 64 * 1024;
/// Scans must come at the slowest scanner's rate at least, with time to start.
const SCAN_LIMIT: Duration = Duration::from_secs(1);

fn scripts() -> Vec<(String, Script)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/it/transcripts");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "txt"))
        .collect();
    paths.sort();
    let name = |path: &PathBuf| path.file_stem().expect("a name").to_string_lossy().into_owned();
    let read = |path: &PathBuf| Script::parse(&std::fs::read_to_string(path).expect("text"));
    paths.iter().map(|path| (name(path), read(path))).collect()
}

/// One client's side of one run.
struct Run<'a> {
    script: &'a Script,
    model: &'static Model,
    emulator: Emulator,
    stream: DuplexStream,
    decoder: FrameDecoder,
    dialect: Dialect,
    within: Duration,
    subscribed: bool,
    /// How long a scan may take.
    scan_limit: Duration,
    began: tokio::time::Instant,
    first_scan: Option<Duration>,
}

/// What went wrong, in words.
type Outcome<T> = Result<T, String>;

fn decoder() -> FrameDecoder {
    FrameDecoder::new(Accept::Either, MAX_PAYLOAD)
}

impl<'a> Run<'a> {
    fn new(
        stage: &Stage,
        script: &'a Script,
        model: &'static Model,
        dialect: Dialect,
        policy: DialectPolicy,
        options: Options,
    ) -> Self {
        let (device, world) = stage.scanner(0, model).expect("it fits");
        let device = device.with_options(options);
        let config = EmulatorConfig { dialects: policy, ..EmulatorConfig::default() };
        let mut emulator = Emulator::start(device, world, config);
        let (stream, there) = tokio::io::duplex(MAX_PAYLOAD);
        emulator.attach(there);
        let within = Duration::from_secs(5);
        Self {
            script,
            model,
            emulator,
            stream,
            decoder: decoder(),
            dialect,
            within,
            subscribed: false,
            scan_limit: SCAN_LIMIT,
            began: tokio::time::Instant::now(),
            first_scan: None,
        }
    }

    /// Hangs up and dials again.
    fn reconnect(&mut self) {
        let (stream, there) = tokio::io::duplex(MAX_PAYLOAD);
        self.stream = stream;
        self.decoder = decoder();
        self.subscribed = false;
        self.emulator.attach(there);
    }

    async fn play(&mut self) -> Outcome<()> {
        let steps = self.script.steps.iter().filter(|(only, _)| only.is_none_or(|only| only == self.dialect));
        for (_, step) in steps.collect::<Vec<_>>() {
            match step {
                Step::Ask(exchange) => self.ask(exchange).await?,
                Step::Until { every, limit, ask } => self.ask_until(ask, *every, *limit).await?,
                Step::Scans { count, channels, poll } => self.scans(*count, channels, *poll).await?,
                Step::Wait(time) => tokio::time::sleep(*time).await,
                Step::Within(time) => self.within = *time,
                Step::Reconnect => self.reconnect(),
                Step::In(dialect) => self.dialect = *dialect,
            }
        }
        Ok(())
    }

    async fn send(&mut self, exchange: &Exchange) {
        let mut bytes = Vec::new();
        encode(self.dialect, &exchange.payload(self.dialect), &mut bytes);
        if self.script.trailing_nul {
            bytes.push(0);
        }
        self.stream.write_all(&bytes).await.expect("room for a request");
    }

    /// The next frame's payload. Before events were asked for, one read must give one whole frame: clients take it for the reply.
    async fn receive(&mut self, within: Duration) -> Outcome<Vec<u8>> {
        let deadline = tokio::time::Instant::now() + within;
        loop {
            if let Some(frame) = self.decoder.next_frame() {
                if frame.dialect != self.dialect {
                    return Err(format!("a reply in {}", frame.dialect));
                }
                return Ok(frame.payload.to_vec());
            }
            let mut chunk = vec![0; MAX_PAYLOAD];
            let read = tokio::time::timeout_at(deadline, self.stream.read(&mut chunk)).await;
            let read = read.map_err(|_| format!("nothing within {within:?}"))?.expect("the pipe holds");
            if read == 0 {
                return Err("the scanner hung up".to_owned());
            }
            self.decoder.push(&chunk[..read]);
            if !self.subscribed {
                let mut alone = decoder();
                alone.push(&chunk[..read]);
                let whole = alone.next_frame().is_some_and(|frame| frame.offset == 0 && frame.len == read);
                if !whole {
                    return Err(format!("{read} bytes in one read that are not one frame"));
                }
                if self.script.longest_reply.is_some_and(|longest| read > longest) {
                    return Err(format!("a reply of {read} bytes"));
                }
            }
        }
    }

    /// The next frame that is no event.
    async fn reply(&mut self) -> Outcome<Vec<u8>> {
        loop {
            let payload = self.receive(self.within).await?;
            if !self.subscribed || !payload.starts_with(b"sSN ") {
                return Ok(payload);
            }
        }
    }

    async fn exchange(&mut self, exchange: &Exchange) -> Outcome<Vec<u8>> {
        if exchange.text.starts_with("sEN ") {
            self.subscribed = true;
        }
        self.send(exchange).await;
        let reply = self.reply().await;
        reply.map_err(|error| format!("{}: {error}", exchange.text))
    }

    async fn ask(&mut self, exchange: &Exchange) -> Outcome<()> {
        if let Expected::Silence = exchange.reply {
            self.send(exchange).await;
            return match self.receive(self.within).await {
                Ok(reply) => Err(format!("{}: answered {}", exchange.text, reply.escape_ascii())),
                Err(_) => Ok(()),
            };
        }
        let reply = self.exchange(exchange).await?;
        let fits = exchange.accepts(self.dialect, &reply);
        let wrong =
            || format!("{}: expected {:?}, got {}", exchange.text, exchange.reply, reply.escape_ascii());
        fits.then_some(()).ok_or_else(wrong)
    }

    async fn ask_until(&mut self, exchange: &Exchange, every: Duration, limit: Duration) -> Outcome<()> {
        let end = tokio::time::Instant::now() + limit;
        loop {
            let reply = self.exchange(exchange).await?;
            if exchange.accepts(self.dialect, &reply) {
                return Ok(());
            }
            if tokio::time::Instant::now() >= end {
                return Err(format!("{}: still {} after {limit:?}", exchange.text, reply.escape_ascii()));
            }
            tokio::time::sleep(every).await;
        }
    }

    /// Scans come one after the other, with the channels that were asked for and a value a beam.
    async fn scans(&mut self, count: usize, channels: &[String], poll: bool) -> Outcome<()> {
        let mut last: Option<LmdScandata> = None;
        let mut seen = 0;
        // A poll may find the same scan again, and one from before the first turn none at all.
        let mut patience = 1000;
        while seen < count {
            if poll {
                let request =
                    Exchange { text: "sRN LMDscandata".to_owned(), hex: String::new(), reply: Expected::Any };
                self.send(&request).await;
            }
            let limit = self.scan_limit.min(self.within);
            let payload = self.receive(limit).await.map_err(|error| format!("scan {seen}: {error}"))?;
            let telegram = Telegram::parse(self.dialect, &payload).map_err(|error| error.to_string())?;
            let wanted = if poll { Kind::Ra } else { Kind::Sn };
            patience -= 1;
            if patience == 0 {
                return Err(format!("{seen} scans only, and then {} for ever", payload.escape_ascii()));
            }
            if telegram.kind != wanted || telegram.name != "LMDscandata" {
                if poll {
                    tokio::time::sleep(Duration::from_millis(10)).await;
                }
                continue;
            }
            let scan: LmdScandata =
                telegram.args.decode().map_err(|error| format!("scan {seen}: {error}"))?;
            self.check(&scan, channels)?;
            self.first_scan.get_or_insert(self.began.elapsed());
            if let Some(last) = &last {
                let step = scan.scan_counter.wrapping_sub(last.scan_counter);
                if poll && step == 0 {
                    tokio::time::sleep(Duration::from_millis(10)).await;
                    continue;
                }
                if !poll && step == 0 {
                    return Err(format!("scan counter {} twice", scan.scan_counter));
                }
            }
            last = Some(scan);
            seen += 1;
        }
        Ok(())
    }

    fn check(&self, scan: &LmdScandata, channels: &[String]) -> Outcome<()> {
        let mut found: Vec<String> = scan.channels16.iter().map(|channel| channel.name.to_string()).collect();
        found.extend(scan.channels8.iter().map(|channel| format!("{}:8", channel.name)));
        found.extend(scan.encoders.iter().map(|_| "ENC".to_owned()));
        if !channels.is_empty() && found != channels {
            return Err(format!("expected the channels {channels:?}, found {found:?}"));
        }
        let lengths = scan.channels16.iter().map(|c| c.values.len());
        let lengths: Vec<usize> = lengths.chain(scan.channels8.iter().map(|c| c.values.len())).collect();
        match lengths.split_first() {
            Some((first, rest)) if *first > 100 && rest.iter().all(|other| other == first) => Ok(()),
            _ => Err(format!("values a channel: {lengths:?} ({})", self.model.title)),
        }
    }
}

#[tokio::test(start_paused = true)]
async fn every_client_gets_the_replies_it_waits_for() {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let mut failures = Vec::new();
    let mut runs = 0;
    for (file, script) in &scripts() {
        for model in script.models.iter().filter_map(|name| model::by_name(name)) {
            for &dialect in &script.dialects {
                let policies = match script.device {
                    Some(device) => vec![DialectPolicy::Strict(device)],
                    None => vec![DialectPolicy::Auto, DialectPolicy::Strict(dialect)],
                };
                for policy in policies {
                    runs += 1;
                    let mut run = Run::new(&stage, script, model, dialect, policy, Options::default());
                    if let Err(error) = run.play().await {
                        let title = model.title;
                        failures.push(format!("{file} ({title}, {dialect}, {policy:?}): {error}"));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{} of {runs} runs failed:\n{}", failures.len(), failures.join("\n"));
    assert!(runs >= 40, "only {runs} runs");
}

#[test]
fn every_model_has_a_transcript_and_every_transcript_its_models() {
    let scripts = scripts();
    let written_for = |name: &str| scripts.iter().any(|(_, script)| script.models.iter().any(|m| m == name));
    for model in MODELS {
        assert!(written_for(model.name), "no transcript for {}", model.name);
    }
    for (file, script) in &scripts {
        for name in &script.models {
            let there = model::by_name(name).is_some();
            let listed = ABSENT.iter().any(|(absent, _)| absent == name);
            assert!(
                there != listed,
                "{file}: {name} is {}",
                if there { "there and listed as absent" } else { "missing" }
            );
        }
    }
}

#[test]
fn transcripts_that_cannot_be_played_are_told() {
    for (model, why) in ABSENT {
        eprintln!("SKIPPED: transcripts for {model}: {why}");
    }
}
