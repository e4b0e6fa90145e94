//! Every fault of the table against every kind of client, on models of each family: it acts where its family says it does and nowhere else, or
//! is refused with its reason. The table is walked, so a new fault is in it by itself.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use rowscan_bus::nmea::GnssEpochs;
use rowscan_bus::tractor::TractorEcu;
use rowscan_bus::{Bus, BusAddress};
use rowscan_emulator::clock::TimeScale;
use rowscan_emulator::stage::Stage;
use rowscan_emulator::{EmulatorConfig, Rig, SerialConfig, StageRow};
use rowscan_faults::{
    FAULTS, Family, Fault, FaultControl, Form, Language, Layer, Medium, StreamFaults, read,
};
use rowscan_protocol::frame::{Dialect, encode};
use rowscan_protocol::lms2xx;
use rowscan_protocol::model;
use rowscan_protocol::time::SimTime;
use rowscan_recording::Taps;
use rowscan_vehicle::{Encoder, Tractor};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::time::{Instant, sleep_until, timeout_at};

use crate::common::small_scene;

/// How a client is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Client {
    ColaA,
    ColaB,
    /// CoLa B on a serial line, as behind `--pty` and `--rfc2217`.
    ColaLine,
    /// An LMS2xx on its line.
    Lms2xxLine,
}

const CLIENTS: [(Client, [&str; 3]); 4] = [
    (Client::ColaA, ["lms111", "lms511", "tim571"]),
    (Client::ColaB, ["lms111", "lms511", "tim571"]),
    (Client::ColaLine, ["lms111", "lms511", "tim571"]),
    (Client::Lms2xxLine, ["lms200", "lms221", "lms291"]),
];

/// What can be seen to change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Aspect {
    /// What the client reads, and when.
    Wire,
    /// What a second client is answered.
    Answers,
    /// Frames on the bus.
    Bus,
    /// Sentences of the receiver.
    Gnss,
    /// Ticks of the encoder.
    Encoder,
    /// Where the tractor is.
    Motion,
}

/// Everything there is to see of a run.
#[derive(Clone, Debug, Default, PartialEq)]
struct Seen {
    wire: Vec<(u128, Vec<u8>)>,
    answers: Vec<Option<String>>,
    bus: Vec<String>,
    gnss: String,
    encoder: i64,
    motion: String,
}

impl Seen {
    fn differences(&self, other: &Self) -> BTreeSet<Aspect> {
        let all = [
            (Aspect::Wire, self.wire != other.wire),
            (Aspect::Answers, self.answers != other.answers),
            (Aspect::Bus, self.bus != other.bus),
            (Aspect::Gnss, self.gnss != other.gnss),
            (Aspect::Encoder, self.encoder != other.encoder),
            (Aspect::Motion, self.motion != other.motion),
        ];
        all.into_iter().filter(|(_, differs)| *differs).map(|(aspect, _)| aspect).collect()
    }
}

/// What a fault may change; at least the first of it must.
fn may_change(fault: &Fault) -> &'static [Aspect] {
    match (fault.layer, fault.name) {
        (Layer::Part(_), "encoder") => &[Aspect::Encoder],
        (Layer::Part(_), "gnss" | "ntp_jump") => &[Aspect::Gnss, Aspect::Bus],
        (Layer::Part(Family::Device), "login" | "busy" | "eeprom_full" | "fault_code" | "temperature") => {
            &[Aspect::Answers, Aspect::Wire]
        }
        (Layer::Part(Family::Device | Family::Clock), _) => &[Aspect::Wire, Aspect::Answers],
        (Layer::Part(Family::Bus), _) => &[Aspect::Bus],
        (Layer::Part(Family::Vehicle), _) => {
            &[Aspect::Motion, Aspect::Wire, Aspect::Gnss, Aspect::Bus, Aspect::Encoder]
        }
        _ => &[Aspect::Wire, Aspect::Answers],
    }
}

/// Why this client's scanner refuses the fault; none if it acts.
fn refusal(fault: &Fault, client: Client) -> Option<&'static str> {
    match (client, fault.name, fault.layer) {
        (_, _, Layer::Part(Family::Datagrams)) => Some("sends no datagrams"),
        (_, _, Layer::Part(Family::Sprayer)) => Some("nothing here has one"),
        (_, "nonce_stale" | "too_many_requests", _) => Some("no REST interface"),
        (Client::ColaLine | Client::Lms2xxLine, _, Layer::Connection | Layer::Accept) if !fault.on_wires => {
            Some("is a serial wire; leave it out")
        }
        (Client::Lms2xxLine, "encoder", _) => Some("an LMS2xx has none"),
        (Client::Lms2xxLine, "motor" | "laser" | "temperature", _) => Some("is not emulated"),
        (Client::Lms2xxLine, "login" | "busy" | "eeprom_full" | "fault_code", _) => Some("answers no sFA"),
        (Client::Lms2xxLine, "stored", _) => Some("are a CoLa scanner's"),
        (Client::Lms2xxLine, "clock_drift" | "clock_step" | "clock_wrap", _) => Some("carry no time"),
        _ => None,
    }
}

/// What a client of this kind cannot see, though the fault acts: no checksum and no length in CoLa A, so both are skipped there.
fn is_unseen(fault: &Fault, client: Client) -> bool {
    client == Client::ColaA && ["checksum", "length"].contains(&fault.name)
}

/// The keys that a fault needs to be one: of the required ones something in their range.
fn keys(fault: &Fault) -> String {
    let more = match fault.name {
        "encoder" => "slip = 0.2\n",
        "gnss" => "jump_m = 5\n",
        "stored" => "config = true\n",
        "flip" => "offset = 40\n",
        "garble" => "noise_p = 0.1\n",
        "two_tecu" => "speed_ratio = 1.5\n",
        "bandwidth" => "bytes_s = 2000\n",
        "speed_command" => "m_s = 2\n",
        _ => "",
    };
    let needed = fault.parameters.iter().filter(|parameter| parameter.default == "must be given");
    let needed = needed.filter(|parameter| !more.contains(parameter.key)).map(|parameter| {
        let value = match parameter.form {
            Form::Number(low, high) | Form::Strength(low, high) | Form::Pair(low, high) => {
                1.0_f64.clamp(low, high).to_string()
            }
            Form::Whole(low, high) | Form::Wholes(low, high) => 100.clamp(low, high).to_string(),
            Form::Word(words) => format!("\"{}\"", words[0]),
            Form::Flag => "true".to_owned(),
            Form::Hex | Form::Text(_) | Form::Timed(..) => {
                panic!("{}: give `{}` here", fault.name, parameter.key)
            }
        };
        format!("{} = {value}\n", parameter.key)
    });
    needed.chain([more.to_owned()]).collect()
}

fn script(fault: &Fault) -> String {
    let (name, keys) = (fault.name, keys(fault));
    let lasts = if ["rst", "fin", "half_close"].contains(&name) { "" } else { "for = { s = 1 }\n" };
    format!("[[fault]]\nname = \"{name}\"\nat = {{ s = 1 }}\n{keys}{lasts}")
}

/// A rig of one scanner, with its bus and what is on its tractor.
struct Bench<'a> {
    stage: &'a Stage,
    client: Client,
    model: &'static str,
}

const ASKED: [&str; 7] = [
    "sMN SetAccessMode 03 F4724744",
    "sRN SCdevicestate",
    "sRN LCMstate",
    "sRN STlms",
    "sRN LocationName",
    "sRN LMPoutputRange",
    "sMN mEEwriteall",
];

impl Bench<'_> {
    /// Three seconds of simulated time with these faults; or why they are refused.
    async fn run(&self, faults: &str) -> Result<Seen, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("bus.log");
        let began = Instant::now();
        let tractor = self.stage.tractor();
        let mut rig = Rig::new(tractor.clone(), TimeScale::Paced(1.0));
        let row = Arc::new(StageRow::new(tractor.clone(), &self.stage.orchard));
        let (control, _events) = FaultControl::new(1, rig.clock(), Some(row));
        let bus = Bus::open(&[BusAddress::Candump(log.clone())], &mut |_| ()).await.expect("a log");
        rig.bus("can0", TractorEcu::new(tractor.clone(), self.stage.receiver()), bus, None, &Taps::default());
        let (wire, asking, scanner) = self.scanner(&mut rig, &tractor, &control);
        control.add_all(read(faults).expect(faults)).map_err(|refused| refused.to_string())?;
        let running = rig.run();
        let driving = tokio::spawn({
            let control = control.clone();
            async move { control.drive().await }
        });
        let asked = tokio::spawn(ask_all(asking, began));
        let wire = follow(wire, self.client, began).await;
        let answers = asked.await.expect("it ends");
        driving.abort();
        drop((running, scanner));
        let bus = std::fs::read_to_string(&log).expect("written");
        Ok(Seen { wire, answers, bus: in_the_fault(&bus), ..self.of_tractor(&tractor) })
    }

    /// Puts the scanner on the rig: its client's end, a second client's, and what keeps it running.
    fn scanner(
        &self,
        rig: &mut Rig,
        tractor: &Tractor,
        control: &FaultControl,
    ) -> (DuplexStream, Option<DuplexStream>, Box<dyn std::any::Any>) {
        let (here, there) = tokio::io::duplex(256 * 1024);
        let stream = |medium, language| Some(control.stream("scanner0", medium, language));
        if self.client == Client::Lms2xxLine {
            let model = lms2xx::model::MODELS.iter().find(|model| model.name == self.model).expect("known");
            let options = lms2xx::device::Options {
                start: lms2xx::device::Start::Streaming,
                stored_rate: lms2xx::Rate::R38400,
                ..lms2xx::device::Options::default()
            };
            let (device, view) = self.stage.serial_scanner_on(tractor, 0, model, options).expect("it fits");
            let faults = stream(Medium::Wire, Language::Lms2xx);
            let config = SerialConfig { faults, ..SerialConfig::at(TimeScale::Paced(1.0)) };
            return (here, None, Box::new(rig.lms2xx(device, view, Box::new(there), config)));
        }
        let medium = if self.client == Client::ColaLine { Medium::Wire } else { Medium::Tcp };
        let faults: Option<StreamFaults> = stream(medium, Language::Cola);
        let model = model::by_name(self.model).expect("known");
        let (device, view) = self.stage.scanner_on(tractor, 0, model).expect("it fits");
        let mut emulator = rig.scanner(device, view, EmulatorConfig { faults, ..EmulatorConfig::default() });
        emulator.attach(there);
        let (asking, asked) = tokio::io::duplex(256 * 1024);
        emulator.attach(asked);
        (here, Some(asking), Box::new(emulator))
    }

    /// What is true and told of the tractor in the middle of the fault.
    fn of_tractor(&self, tractor: &Tractor) -> Seen {
        let middle = SimTime(1_510_000_000);
        let mut epochs = GnssEpochs::new(tractor.clone(), self.stage.receiver());
        epochs.skip_to(middle);
        Seen {
            gnss: epochs.next_epoch(),
            encoder: tractor.encoder_ticks(&Encoder::default(), middle) as i64,
            motion: format!("{:?}", tractor.motion(middle)),
            ..Seen::default()
        }
    }
}

/// Lines of a candump log from 1 to 2 s.
fn in_the_fault(log: &str) -> Vec<String> {
    log.lines().filter(|line| line.starts_with("(0000000001.")).map(str::to_owned).collect()
}

/// What a client reads for three seconds that has scans sent.
async fn follow(mut wire: DuplexStream, client: Client, began: Instant) -> Vec<(u128, Vec<u8>)> {
    let dialect = if client == Client::ColaA { Dialect::A } else { Dialect::B };
    if client != Client::Lms2xxLine {
        let request: &[u8] =
            if dialect == Dialect::A { b"sEN LMDscandata 1" } else { b"sEN LMDscandata \x01" };
        let mut bytes = Vec::new();
        encode(dialect, request, &mut bytes);
        wire.write_all(&bytes).await.expect("it listens");
    }
    let (mut seen, mut chunk) = (Vec::new(), vec![0; 64 * 1024]);
    while let Ok(Ok(read @ 1..)) = timeout_at(began + Duration::from_secs(3), wire.read(&mut chunk)).await {
        seen.push((began.elapsed().as_millis(), chunk[..read].to_vec()));
    }
    sleep_until(began + Duration::from_secs(3)).await;
    seen
}

/// What a second client is answered in the middle of the fault; its scans are another's.
async fn ask_all(asking: Option<DuplexStream>, began: Instant) -> Vec<Option<String>> {
    let Some(mut asking) = asking else { return Vec::new() };
    let mut answers = Vec::new();
    for (number, command) in (0_u32..).zip(ASKED) {
        let at = began + Duration::from_millis(1105) + number * Duration::from_millis(40);
        sleep_until(at).await;
        let mut chunk = vec![0; 4096];
        if asking.write_all(format!("\x02{command}\x03").as_bytes()).await.is_err() {
            answers.push(None);
            continue;
        }
        let read = timeout_at(at + Duration::from_millis(30), asking.read(&mut chunk)).await;
        let read = read.ok().and_then(Result::ok).unwrap_or(0);
        answers.push((read > 0).then(|| String::from_utf8_lossy(&chunk[..read]).into_owned()));
    }
    answers
}

#[tokio::test(start_paused = true)]
async fn every_fault_acts_where_it_says_or_is_refused_with_its_reason() {
    let stage = Stage::grow(small_scene(), &|_, _| {}).expect("it grows");
    let mut wrong = Vec::new();
    for (client, models) in CLIENTS {
        for model in models {
            let bench = Bench { stage: &stage, client, model };
            let plain = bench.run("").await.expect("nothing to refuse");
            assert!(plain.wire.len() > 10 && !plain.bus.is_empty(), "{client:?} {model}: {plain:?}");
            // Nothing of this is seen by a listener's absence here: `faults/tests/it/connections.rs` has those.
            for fault in FAULTS.iter().filter(|fault| fault.layer != Layer::Accept) {
                let seen = bench.run(&script(fault)).await;
                let expected = refusal(fault, client);
                let verdict = match (&seen, expected) {
                    (Err(refused), Some(why)) if refused.contains(why) => continue,
                    (Err(refused), _) => format!("is refused: {refused}"),
                    (Ok(_), Some(why)) => format!("is not refused: {why}"),
                    (Ok(seen), None) => {
                        let changed = plain.differences(seen);
                        let may = may_change(fault);
                        // An LMS2xx cannot be asked beside its stream.
                        let must = may
                            .first()
                            .filter(|must| client != Client::Lms2xxLine || **must != Aspect::Answers);
                        let acts = is_unseen(fault, client) || must.is_none_or(|must| changed.contains(must));
                        match changed.iter().find(|aspect| !may.contains(aspect)) {
                            Some(beyond) => format!("changes {beyond:?} too"),
                            None if !acts => format!("changes only {changed:?}"),
                            None => continue,
                        }
                    }
                };
                wrong.push(format!("{} for {client:?} of {model} {verdict}", fault.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{} of the table:\n{}", wrong.len(), wrong.join("\n"));
}
