//! `rowscan replay`

mod drive;
mod orders;
mod places;
mod recorded_way;
mod seats;
mod watched;

use std::path::PathBuf;
use std::sync::Arc;

use super::client_limits::ClientLimitArgs;
use super::control::{ControlArgs, Controlled};
use super::endpoint::announce_all;
use super::events::{self, End};
use super::faulting::{FaultArgs, Faulting};
use super::interrupt::Interrupt;
use super::output::say;
use super::recorder::RecordArgs;
use super::stream_states::state_of;
use super::web::WebArgs;
use super::{Failure, Format, Outcome, event_format, models};
use drive::drive_began_ns;
use orders::{ReplayTime, SeekRequest};
use places::{Places, Seek};
use rowscan_bench::replay::{ReplayBench, ReplaySpec, ReplayedStream};
use rowscan_canopy::Warning;
use rowscan_control::{Bench, Log, Refused};
use rowscan_emulator::clock::{TimeScale, Timer};
use rowscan_emulator::replay::{Moment, Part, Playback, Played, Playhead, Stamps, Survey, ToldEcho};
use rowscan_emulator::{Player, RefusedSetting};
use rowscan_recording::{StreamKind, Taps};
use rowscan_scenes::files;
use seats::{PlaceArgs, Seat, Sort};
use watched::{Watched, Watching};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A recording: MCAP, pcap, pcapng, raw bytes, hex text, telegrams as text, CARMEN log, CSV of ranges
    file: PathBuf,
    #[command(flatten)]
    places: PlaceArgs,
    /// Scanner model that answers what was not recorded [default: the recorded one]
    #[arg(long, value_name = "NAME", value_parser = models::name(), hide_possible_values = true)]
    model: Option<String>,
    /// Send what was recorded, replies too, to whoever connects, and listen to nobody
    #[arg(long)]
    verbatim: bool,
    /// Recorded seconds a second, or `max`: as fast as the clients take it
    #[arg(long, value_name = "K", default_value = "1")]
    time_scale: TimeScale,
    /// Begin anew at the end
    #[arg(long = "loop")]
    repeat: bool,
    /// Where to begin: `12.5s` from the first event, `scan:100`, `metre:3.2` of the row
    #[arg(long, value_name = "PLACE")]
    from: Option<Seek>,
    /// Where to end; as --from
    #[arg(long, value_name = "PLACE")]
    until: Option<Seek>,
    /// Counters and device times
    #[arg(long, value_enum, default_value_t)]
    stamps: StampsArg,
    /// The rig that `metre:` and the page go by, instead of the recorded one
    #[arg(long, value_name = "RIG")]
    rig: Option<String>,
    #[command(flatten)]
    control: ControlArgs,
    #[command(flatten)]
    clients: ClientLimitArgs,
    /// How to tell where it listens and what happens; jsonl writes one object an event to standard output, json one document at the end
    #[arg(long, default_value = "table", value_parser = event_format::parser())]
    format: Format,
    #[command(flatten)]
    faults: FaultArgs,
    #[command(flatten)]
    record: RecordArgs,
    #[command(flatten)]
    web: WebArgs,
}

/// What becomes of counters and device times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
enum StampsArg {
    /// As recorded
    #[default]
    Keep,
    /// As a scanner would send them now; the calendar stays as recorded
    Now,
}

pub(super) async fn run(args: Args, mut interrupt: Interrupt) -> Result<Outcome, Failure> {
    let asked = args.model.as_deref().map(models::find).transpose()?;
    let survey = Survey::read_apart(&args.file, &args.places.names())?;
    if let Some(torn) = &survey.torn {
        say(format_args!("{}: {torn}; {} is played", args.file.display(), torn.read_part()));
    }
    if let Some(damage) = survey.soundness.damage() {
        say(format_args!("{}: {damage}", args.file.display()));
    }
    let seats = args.places.seats(&survey)?;
    let parts: Vec<&Part> = seats.iter().map(|seat| seat.part).collect();
    if args.stamps == StampsArg::Now && parts.iter().any(|part| part.kind == StreamKind::Compact) {
        return Err(Failure::Usage(
            "--stamps now: the stamps of Compact telegrams stay as recorded; leave it out".to_owned(),
        ));
    }
    let places = Places::of(args.rig.as_deref(), &survey, &parts, args.verbatim);
    let played = args.played(&places, &parts)?;
    let (from, until) = (played.from, played.until);
    let start_ns = from.at_ns.max(places.begins_ns);
    let round = played.every_ns.map(|every_ns| (start_ns, every_ns));
    let mut spec = ReplaySpec::new(&survey, args.time_scale);
    let clock = spec.clock();
    let playhead = Arc::new(Playhead::new(start_ns));
    let taping = args.record.start(survey.about.clone(), args.time_scale.delivery().is_patient())?;
    let tape = Playback::open(survey.path.clone(), &parts, played)?;
    let (script, log) = (args.faults.read()?, Log::default());
    let watching = args.web.is_given().then(|| Watching::new(&parts, Arc::clone(&clock)));
    spec.streams = seats.iter().map(Seat::spec).collect();
    (spec.model, spec.verbatim) = (asked, args.verbatim);
    if !args.verbatim && parts.iter().any(|part| part.told_echo() == ToldEcho::Nothing) {
        spec.rig = places.rig()?;
    }
    (spec.max_clients, spec.idle_limit) = args.clients.limits();
    spec.taps = watching.as_ref().map_or_else(Taps::default, Watching::taps).and(taping.taps());
    spec.faults = script.is_some() || args.control.is_given() || args.web.is_given();
    let mut bench = ReplayBench::open(spec).await?;
    announce_all(args.format, bench.places(), |part| (seats.len() > 1).then_some(part))?;
    for stream in bench.streams() {
        if let Some(title) = stream.taken_for {
            let name = &stream.name;
            say(format_args!(
                "{name}: by its beams and answers taken for the model {title}; --model says otherwise"
            ));
        }
    }
    if let Some(asked) = asked.filter(|_| !args.verbatim) {
        for part in &parts {
            if let Some(other) = Warning::other_model(&part.told_models(), asked) {
                say(format_args!("{}: {other}", part.name));
            }
        }
    }
    let faulting = bench.faults().cloned().zip(bench.take_fault_events());
    let faulting = faulting.map(|handles| Faulting::tell(handles, (args.format, &log)));
    if let Some(faulting) = &faulting {
        faulting.begin(script)?;
    }
    let (time, mut seeks) = {
        let span_ns = [places.begins_ns, places.ends_ns];
        ReplayTime::new(Arc::clone(&clock), Arc::clone(&playhead), round, span_ns)
    };
    let in_hand = faulting.as_ref().map(|faulting| {
        let streams = bench.streams().iter();
        let streams = streams.filter_map(|stream| Some((stream.name.clone(), stream.counts()?)));
        let states = vec![("streams".to_owned(), state_of(streams))];
        Bench::new(faulting.control().clone(), Arc::new(time), log, states)
    });
    let _controlled = match &in_hand {
        Some(in_hand) => args.control.open(in_hand.clone(), args.format).await?,
        None => Controlled::default(),
    };
    let model = survey.about.model.as_deref();
    let _watched = match watching.zip(in_hand) {
        Some((watching, in_hand)) => {
            let rig = places.rig()?;
            watching.open(&args, model, rig.as_ref(), (&parts, bench.streams()), in_hand).await?
        }
        None => Watched::default(),
    };
    tell_streams(&survey, &parts);
    let waited_ns = drive_began_ns(&survey).zip(parts.iter().filter_map(|part| part.begins_ns).min());
    if let Some((began_ns, first_ns)) = waited_ns.filter(|(began_ns, first_ns)| began_ns > first_ns) {
        let (seconds, are) =
            ((began_ns - first_ns) as f64 * 1e-9, if args.verbatim { "are" } else { "are not" });
        say(format_args!("the {seconds:.2} s in which the tractor stood before its drive {are} played"));
    }
    events::ready(args.format)?;
    let player = bench.play(tape, Arc::clone(&playhead), &Timer::system());
    loop {
        tokio::select! {
            () = player.ended() => break,
            () = interrupt.wait() => break,
            Some(SeekRequest { place, done }) = seeks.recv() => {
                let found = places.find_within(place, from, until);
                let found = found.map(|to| playhead.seek(to.max(start_ns.into()), clock.now()));
                // Whoever asked may have gone.
                let _ = done.send(found.map_err(|error| Refused(error.to_string())));
            }
        }
    }
    if let Some(faulting) = faulting {
        faulting.finish().await?;
    }
    let dropped = tell_end(&player, bench.streams(), args.format)?;
    // A recording ends after all that it records.
    player.stop().await;
    drop(bench);
    Ok(match taping.finish() {
        Outcome::Done if dropped > 0 => Outcome::Finding,
        outcome => outcome,
    })
}

impl Args {
    /// What is played of these streams.
    fn played(&self, places: &Places<'_>, parts: &[&Part]) -> Result<Played, Failure> {
        let from = self.from.map_or(Ok(Moment::default()), |place| places.find(place))?;
        let until = self.until.map_or(Ok(Moment::END), |place| places.find(place))?;
        let start = from.max(places.begins_ns.into());
        let first = if self.until.is_some() { places.first_scan()? } else { start };
        if until <= start.max(first) {
            return Err(Failure::Usage(
                "--until lies at or before --from: there is nothing to play between them".to_owned(),
            ));
        }
        // From the last event to the first of the next round passes as long as between two scans.
        let period_ns = parts.iter().map(|part| part.period_ns()).min().unwrap_or(1);
        let ends_ns = until.at_ns.min(places.ends_ns.saturating_add(period_ns));
        let every_ns = ends_ns.saturating_sub(start.at_ns).max(1);
        Ok(Played {
            // Replies before the first event are part of what is verbatim.
            from: if self.verbatim { from } else { start },
            until,
            every_ns: self.repeat.then_some(every_ns),
            stamps: match self.stamps {
                StampsArg::Keep => Stamps::Keep,
                StampsArg::Now => Stamps::Now,
            },
            verbatim: self.verbatim,
        })
    }
}

/// Says what was sent on each stream, and which settings were refused; how many scans were dropped.
fn tell_end(player: &Player, streams: &[ReplayedStream], format: Format) -> Result<u64, Failure> {
    let (mut all_dropped, mut ends) = (0, Vec::new());
    for (number, stream) in streams.iter().enumerate() {
        let late = |fraction| player.lateness(number, fraction).unwrap_or_default();
        let (name, counts) = (&stream.name, stream.counts().and_then(|reader| reader.counts()));
        let sent = match &counts {
            Some(counts) => events::told(counts),
            None => format!("{} packets sent", player.played(number)),
        };
        say(format_args!("{name}: {sent}; late by {:?} (p50), {:?} (p99)", late(0.5), late(0.99)));
        if let Some(dropped) = counts.and_then(|counts| counts.scans_dropped).filter(|dropped| *dropped > 0) {
            let may_fail = counts.and_then(|counts| counts.scans_kept_by_faults).is_some();
            let who = if may_fail { "these, their line, or faults on it," } else { "these, or their line," };
            say(format_args!(
                "{name}: {dropped} recorded scans did not reach their clients: {who} were too slow; `--time-scale max` waits for them"
            ));
            all_dropped += dropped;
        }
        if let Some(counts) = counts {
            ends.push(End::of((streams.len() > 1).then_some(name.as_str()), counts));
        }
        for refused in stream.refused_settings() {
            let RefusedSetting { client, setting, times } = refused;
            say(format_args!("{name}: refused {setting} to {client}, {times} times"));
        }
    }
    events::tell_ends(format, &ends)?;
    Ok(all_dropped)
}

/// Says what is played, and what is not.
fn tell_streams(survey: &Survey, played: &[&Part]) {
    for part in &survey.parts {
        let is_played = played.iter().any(|playing| playing.stream == part.stream);
        match (is_played, part.is_scanner()) {
            (true, true) => {
                let (answers, polled) = (part.script.len(), if part.polled { " by polls" } else { "" });
                say(format_args!("{}: {} scans{polled}, {answers} recorded answers", part.name, part.scans));
                if part.monitor_scans > 0 {
                    say(format_args!(
                        "{}: {} of its scans are LMDscandatamon: only a client that asks for these (sEN LMDscandatamon 1) gets them; rowscan's own asks for LMDscandata",
                        part.name, part.monitor_scans
                    ));
                }
                let changed: Vec<&str> =
                    part.settings_changed().iter().map(|(_, setting)| setting.name).collect();
                if !changed.is_empty() {
                    say(format_args!(
                        "{}: its client changed {} between scans; whoever asks is told what held at the first one, and `rowscan estimate FILE` tells how many scans are changed",
                        part.name,
                        changed.join(", ")
                    ));
                }
                if let Some(hertz) = part.assumed_hz {
                    say(format_args!(
                        "{}: nothing in the file tells when its scans were made; they are played at the rate of their mode, {hertz:.2} scans a second{}",
                        part.name,
                        if part.kind == StreamKind::Lms2xx {
                            ", or as fast as the line carries them"
                        } else {
                            ""
                        }
                    ));
                }
                if let [first, .., last] = part.connections.as_slice() {
                    say(format_args!(
                        "{}: {} connections one after the other; --stream plays one of {first} to {last}",
                        part.name,
                        part.connections.len()
                    ));
                }
            }
            (true, false) if part.kind == StreamKind::Compact => {
                say(format_args!("{}: {} scans as datagrams", part.name, part.scans));
            }
            (true, false) => say(format_args!("{}: {}, in step", part.name, part.kind)),
            (false, _) if part.begins_ns.is_some() => {
                let flag = Sort::flag_for(part.kind);
                say(format_args!("{} ({}) is not played; {flag} plays it", part.name, part.kind));
            }
            (false, _) => {}
        }
    }
    let recorded = survey.about.rig.as_deref().and_then(|text| files::rig_from_text(text, |_| ()).ok());
    if let Some(beams) = recorded.and_then(|rig| rig.optics) {
        let beams = beams.name();
        say(format_args!("its rig says `optics = \"{beams}\"`: estimate the replay with --optics {beams}"));
    }
    match played.iter().any(|part| part.kind.is_scanner()) {
        true => say("it begins with the first taker of every scanner"),
        false => say("it begins at once"),
    }
}
