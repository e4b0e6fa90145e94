//! What a replayed scanner says of its settings, takes and refuses: as the recording holds it, in either dialect. On a frozen clock.

use crate::common;

use std::time::Duration;

use common::replayed::{Packets, Replayed, connect, played, replay, write};
use common::talk::{Talk, framed, login};
use rowscan_emulator::clock::TimeScale;
use rowscan_protocol::client::{ColaClient, ColaConfig};
use rowscan_protocol::device::{command, writable};
use rowscan_protocol::frame::{Accept, Dialect, FrameDecoder};
use rowscan_protocol::host::{HostEvent, HostSession, SettingNote, Transmit};
use rowscan_protocol::model::{self, Model};
use rowscan_protocol::rig::EchoChoice;
use rowscan_protocol::telegram::Telegram;
use rowscan_recording::Taps;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

const DIALECTS: [Dialect; 2] = [Dialect::A, Dialect::B];

/// Values that no scanner has as delivered, and that its scans are made with.
const SET: [&str; 13] = [
    // A model without encoders takes this one.
    "sWN LMDscandatacfg 01 00 1 1 0 00 00 0 1 0 1 +1",
    "sWN LMDscandatacfg 01 00 1 0 0 01 00 0 1 0 1 +1",
    "sWN LMPoutputRange 1 1388 +0 +900000",
    "sWN FREchoFilter 2",
    "sWN LFPmeanfilter 1 +3 0",
    "sWN LFPmedianfilter 1 3",
    "sWN LFPparticle 1 +400",
    "sWN MSsuppmode 1",
    "sWN DO3And4Fnc 1",
    "sWN LICsrc 1",
    "sWN LICencset 2",
    "sWN LICencres 3F000000",
    "sWN LocationName 5 north",
];

/// Others, which scans made with those do not have.
const OTHERS: [&str; 12] = [
    "sWN LMDscandatacfg 01 00 1 1 0 00 00 0 1 1 1 +1",
    "sWN LMDscandatacfg 01 00 1 1 0 01 00 0 1 1 1 +1",
    "sWN LMPoutputRange 1 1388 +0 +950000",
    "sWN FREchoFilter 0",
    "sWN LFPmeanfilter 1 +4 0",
    "sWN LFPmedianfilter 0 3",
    "sWN LFPparticle 1 +500",
    "sWN MSsuppmode 0",
    "sWN DO3And4Fnc 0",
    "sWN LICsrc 0",
    "sWN LICencset 1",
    "sWN LICencres 3F800000",
];

/// A client of a replayed scanner, logged in.
struct Client {
    stream: DuplexStream,
    dialect: Dialect,
    decoder: FrameDecoder,
}

impl Client {
    async fn of(replayed: &mut Replayed, model: &Model, dialect: Dialect) -> Self {
        let stream = connect(&mut replayed.emulator);
        let mut client =
            Self { stream, dialect, decoder: FrameDecoder::new(Accept::Only(dialect), 64 * 1024) };
        let taken = client.ask(&login(model, dialect)).await;
        assert!(taken.starts_with(b"sAN SetAccessMode"), "{}", taken.escape_ascii());
        client
    }

    async fn ask(&mut self, request: &[u8]) -> Vec<u8> {
        self.stream.write_all(&framed(self.dialect, request)).await.expect("taken");
        let mut chunk = vec![0; 4096];
        loop {
            if let Some(frame) = self.decoder.next_frame() {
                return frame.payload.to_vec();
            }
            let read = self.stream.read(&mut chunk).await.expect("it holds");
            assert_ne!(read, 0, "closed without an answer to {}", request.escape_ascii());
            self.decoder.push(&chunk[..read]);
        }
    }

    /// The code of FREchoFilter that is read, or the refusal's.
    async fn echo(&mut self) -> Result<u8, u16> {
        let reply = self.ask(b"sRN FREchoFilter").await;
        let telegram = Telegram::parse(self.dialect, &reply).expect("a telegram");
        match telegram.refusal() {
            Some(error) => Err(error.code()),
            None => Ok(telegram.args.decode().expect("a code")),
        }
    }

    /// Writes FREchoFilter; the refusal's code, if it is refused.
    async fn set_echo(&mut self, code: u8) -> Result<(), u16> {
        let value = if self.dialect == Dialect::A { b'0' + code } else { code };
        let reply = self.ask(&[b"sWN FREchoFilter ", &[value][..]].concat()).await;
        let telegram = Telegram::parse(self.dialect, &reply).expect("a telegram");
        telegram.refusal().map_or(Ok(()), |error| Err(error.code()))
    }
}

fn folder() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    (folder, path)
}

fn start(path: &std::path::Path, packets: &Packets, model: &Model) -> Replayed {
    write(path, packets);
    replay(path, Some(model.name), TimeScale::Paced(1.0), played(), Taps::default())
}

fn models(names: &[&str]) -> Vec<&'static Model> {
    names.iter().map(|name| model::by_name(name).expect("known")).collect()
}

#[tokio::test(start_paused = true)]
async fn what_the_recorded_client_set_is_taken_in_both_dialects_and_another_value_in_neither() {
    for model in models(&["lms111", "lms511", "mrs1000"]) {
        let knows = |name: &str| {
            let reply = Talk::with(model, Dialect::A).ask(format!("sRN {name}").as_bytes());
            reply.starts_with(b"sRA")
        };
        let names: Vec<&str> = writable().filter(|name| knows(name)).collect();
        let mut set = Talk::with(model, Dialect::A);
        let least = if model.name == "mrs1000" { 4 } else { 9 };
        assert!(set.set(&SET) >= least, "{}", model.name);
        if model.layers.len() > 1 {
            assert_eq!(set.set(&["sWN ScanLayerFilter 4 0 1 1 0"]), 1);
        }
        let mut other = Talk::to(set.device.clone(), Dialect::A);
        other.set(&OTHERS);
        for (recorded, spoken) in DIALECTS.iter().flat_map(|one| DIALECTS.map(|two| (*one, two))) {
            let case = format!("{}, recorded in {recorded:?}, spoken {spoken:?}", model.name);
            let mut talk = Talk::with(model, recorded);
            for name in &names {
                let taken = talk.ask(&set.as_write(name, recorded));
                assert!(taken.starts_with(b"sWA "), "{case}: {name}: {}", taken.escape_ascii());
            }
            let (_folder, path) = folder();
            let mut replayed = start(&path, &talk.recorded(3), model);
            let mut client = Client::of(&mut replayed, model, spoken).await;
            for name in &names {
                let write = set.as_write(name, spoken);
                let taken = client.ask(&write).await;
                assert!(taken.starts_with(b"sWA "), "{case}: {name}: {}", taken.escape_ascii());
                let read = client.ask(format!("sRN {name}").as_bytes()).await;
                assert_eq!(
                    read[4..].escape_ascii().to_string(),
                    write[4..].escape_ascii().to_string(),
                    "{case}"
                );
            }
            let mut refused = 0;
            for write in OTHERS {
                let name = write.split(' ').nth(1).expect("a name");
                // A model that refuses the value of its own, or has no such variable, has nothing else to be asked for.
                if !names.contains(&name) || set.as_write(name, spoken) == other.as_write(name, spoken) {
                    continue;
                }
                let reply = client.ask(&other.as_write(name, spoken)).await;
                assert!(reply.starts_with(b"sFA"), "{case}: {write}: {}", reply.escape_ascii());
                refused += 1;
            }
            assert!(refused + 2 >= least, "{case}: {refused} were tried");
        }
        let is_saved = |name: &&str| command::by_name(name).is_some_and(|command| command.is_saved);
        let written = |name: &str| SET.iter().any(|write| write.split(' ').nth(1) == Some(name));
        let left: Vec<&str> = names.iter().copied().filter(is_saved).filter(|name| !written(name)).collect();
        let known = ["EIHstCola", "ScanLayerFilter", "SetActiveApplications"];
        assert!(
            left.iter().all(|name| known.contains(name)),
            "{}: {left:?} are set to nothing new",
            model.name
        );
    }
}

/// What is answered and taken, by what the conversation says before the scans; of models with several echoes, in both dialects.
#[tokio::test(start_paused = true)]
async fn the_echo_of_a_recording_is_answered_and_no_other_is_taken() {
    for model in models(&["lms111", "lms511", "mrs1000"]) {
        let factory = (model.name != "lms511").then_some(1);
        for (said, holds) in [
            (&[][..], factory),
            (&["sWN FREchoFilter 0"][..], Some(0)),
            (&["sWN FREchoFilter 1"], Some(1)),
            (&["sWN FREchoFilter 2"], Some(2)),
            // The last one counts, and what was read before it does not.
            (&["sRN FREchoFilter", "sWN FREchoFilter 2"], Some(2)),
            (&["sWN FREchoFilter 2", "sRN FREchoFilter", "sWN FREchoFilter 0"], Some(0)),
            // Refused.
            (&["sWN FREchoFilter 2", "sWN FREchoFilter 7"], Some(2)),
        ] {
            for (recorded, spoken) in DIALECTS.iter().flat_map(|one| DIALECTS.map(|two| (*one, two))) {
                let case = format!("{}: {said:?}, recorded in {recorded:?}, spoken {spoken:?}", model.name);
                let mut talk = Talk::with(model, recorded);
                for request in said {
                    let mut request = request.as_bytes().to_vec();
                    if let (Dialect::B, Some(code @ b'0'..=b'9')) = (recorded, request.last_mut()) {
                        *code -= b'0';
                    }
                    talk.ask(&request);
                }
                let (_folder, path) = folder();
                let mut replayed = start(&path, &talk.recorded(3), model);
                let mut client = Client::of(&mut replayed, model, spoken).await;
                for _ in 0..3 {
                    assert_eq!(client.echo().await, holds.ok_or(4), "{case}");
                }
                for code in [2, 1, 0] {
                    // The first echo is one of all.
                    let has = holds == Some(code) || (holds, code) == (Some(1), 0);
                    let taken = client.set_echo(code).await;
                    assert_eq!(taken, if has { Ok(()) } else { Err(4) }, "{case}: {code}");
                }
            }
        }
    }
}

/// Our own client of a replayed scanner: the echo that its scans are known to hold, and whether it was told that its wish was refused.
async fn estimated(replayed: &mut Replayed, dialect: Dialect) -> (Option<EchoChoice>, bool) {
    let mut stream = connect(&mut replayed.emulator);
    let mut session = ColaClient::new(ColaConfig::default(), dialect);
    let (mut refused, mut chunk) = (false, vec![0; 64 * 1024]);
    loop {
        while let Some(Transmit::Frame(frame)) = session.poll_transmit() {
            stream.write_all(&frame).await.expect("taken");
        }
        while let Some(event) = session.poll_event() {
            refused |= SettingNote::of(&event).is_some_and(|note| note.refuses_echo());
            if event == HostEvent::Scan {
                return (session.scan().echo, refused);
            }
        }
        if let Some(Transmit::Frame(frame)) = session.poll_transmit() {
            stream.write_all(&frame).await.expect("taken");
        }
        let read = stream.read(&mut chunk).await.expect("it holds");
        assert_ne!(read, 0, "closed");
        session.handle_bytes(Duration::ZERO, &chunk[..read]);
    }
}

#[tokio::test(start_paused = true)]
async fn our_own_client_never_takes_the_last_or_an_unknown_echo_for_the_first() {
    let (first, last) = (Some(EchoChoice::First), Some(EchoChoice::Last));
    for model in models(&["lms111", "lms511", "mrs1000"]) {
        for (said, expected) in [
            (None, if model.name == "lms511" { (None, true) } else { (first, false) }),
            (Some("sWN FREchoFilter 0"), (first, false)),
            (Some("sWN FREchoFilter 1"), (first, false)),
            (Some("sWN FREchoFilter 2"), (last, true)),
        ] {
            for dialect in DIALECTS {
                let mut talk = Talk::with(model, Dialect::A);
                if let Some(said) = said {
                    talk.ask(said.as_bytes());
                }
                let (_folder, path) = folder();
                let mut replayed = start(&path, &talk.recorded(30), model);
                let found = estimated(&mut replayed, dialect).await;
                assert_eq!(found, expected, "{}: {said:?} in {dialect:?}", model.name);
            }
        }
    }
}
