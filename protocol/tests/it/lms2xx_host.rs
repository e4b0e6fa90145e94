//! The LMS2xx host's session against replies that are written here, time by time: patience, pauses, refusals, foreign blocks.

use std::time::Duration;

use rowscan_protocol::host::{HostEvent, HostSession, Transmit};
use rowscan_protocol::lms2xx::Rate;
use rowscan_protocol::lms2xx::client::{Lms2xxClient, Lms2xxConfig};
use rowscan_protocol::lms2xx::device::{Device, Options};
use rowscan_protocol::lms2xx::frame::encode;
use rowscan_protocol::lms2xx::model;
use rowscan_protocol::time::SimTime;

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

fn device(name: &str, options: Options) -> Device {
    let model = model::MODELS.iter().find(|model| model.name == name).unwrap();
    Device::new(model, options)
}

/// Fills a device's reply into a whole frame, with its acknowledgement.
fn reply(body: &[u8]) -> Vec<u8> {
    let mut frame = vec![0x06];
    encode(0x80, body, &mut frame);
    frame
}

/// What a client has asked so far.
fn asked(client: &mut Lms2xxClient) -> Vec<Vec<u8>> {
    let mut frames = Vec::new();
    while let Some(transmit) = client.poll_transmit() {
        if let Transmit::Frame(frame) = transmit {
            frames.push(frame);
        }
    }
    frames
}

const ON_REQUEST: &str = "02 00 02 00 20 25 35 08";

/// A change of the mode may take 3 s, once the request is acknowledged.
#[test]
fn a_client_waits_three_seconds_for_a_mode_that_was_acknowledged() {
    let mut client = Lms2xxClient::new(Lms2xxConfig { rate: Rate::R9600, ..Lms2xxConfig::default() });
    client.handle_bytes(Duration::ZERO, &[]);
    assert_eq!(asked(&mut client), [bytes(ON_REQUEST)]);
    client.handle_bytes(Duration::from_millis(40), &[0x06]);
    let late = Duration::from_millis(2_900);
    assert!(client.poll_timeout().unwrap() > late);
    client.handle_timeout(late);
    assert_eq!(asked(&mut client), Vec::<Vec<u8>>::new());
    client.handle_bytes(late, &reply(&[0xA0, 0, 0x10])[1..]);
    assert_eq!(asked(&mut client), [bytes("02 00 01 00 3A 1E 12")]);
}

/// The listing wants 30 ms between a NAK and the repetition.
#[test]
fn a_client_pauses_after_a_nak() {
    let mut client = Lms2xxClient::new(Lms2xxConfig { rate: Rate::R9600, ..Lms2xxConfig::default() });
    client.handle_bytes(Duration::ZERO, &[]);
    asked(&mut client);
    client.handle_bytes(Duration::from_millis(40), &[0x15]);
    assert_eq!(asked(&mut client), Vec::<Vec<u8>>::new());
    client.handle_timeout(Duration::from_millis(69));
    assert_eq!(asked(&mut client), Vec::<Vec<u8>>::new());
    client.handle_timeout(Duration::from_millis(70));
    assert_eq!(asked(&mut client), [bytes(ON_REQUEST)]);
}

/// A request ends the telegram that the device is sending: what follows is the reply, and not the rest.
#[test]
fn a_client_expects_telegrams_that_were_cut_off() {
    let mut client = Lms2xxClient::new(Lms2xxConfig { rate: Rate::R9600, ..Lms2xxConfig::default() });
    client.handle_bytes(Duration::ZERO, &[]);
    asked(&mut client);
    let mut scan = vec![0xB0, 0x69, 0x41];
    scan.extend([0x10; 723]);
    let mut heard = reply(&scan)[1..101].to_vec();
    heard.extend(reply(&[0xA0, 0, 0x10]));
    client.handle_bytes(Duration::from_millis(50), &heard);
    let due = client.poll_timeout().unwrap();
    assert!(due <= Duration::from_millis(150), "{due:?}");
    client.handle_timeout(due);
    assert_eq!(asked(&mut client), [bytes("02 00 01 00 3A 1E 12")]);
}

/// A device that refuses to send remission still sends ranges, and says so.
#[test]
fn a_device_without_remission_is_read_without_it() {
    let config = Lms2xxConfig { remission: true, rate: Rate::R9600, ..Lms2xxConfig::default() };
    let mut client = Lms2xxClient::new(config);
    let mut now = Duration::ZERO;
    client.handle_bytes(now, &[]);
    let (mut device, mut asked_for) = (device("lms200", Options::default()), Vec::new());
    for _ in 0..40 {
        now += Duration::from_millis(50);
        for frame in asked(&mut client) {
            let body = &frame[4..frame.len() - 2];
            asked_for.push(body[..2.min(body.len())].to_vec());
            if body[0] == 0x20 && body[1] == 0x2B {
                client.handle_bytes(now, &reply(&[0x92, 0x10]));
                continue;
            }
            let at = SimTime(now.as_nanos() as u64);
            device.handle_bytes(at, Duration::ZERO, &frame);
            while let Some(sent) = device.poll_transmit(at) {
                device.transmitted(at);
                client.handle_bytes(now, &sent);
            }
        }
    }
    assert_eq!(asked_for[asked_for.len() - 2..], [[0x20, 0x2B], [0x20, 0x24]]);
    let mut events = Vec::new();
    while let Some(event) = client.poll_event() {
        events.push(event);
    }
    let refused = |event: &HostEvent| matches!(event, HostEvent::Refused { command, fatal: false, .. } if command.contains("20 2B"));
    assert!(events.iter().any(refused) && matches!(events.last(), Some(HostEvent::Ready(_))), "{events:?}");
}

/// A configuration block that cannot be read: the status says what the bits of a value mean, and the telegram its unit.
#[test]
fn values_are_read_in_the_mode_of_the_status_where_the_block_is_foreign() {
    let mut client = Lms2xxClient::new(Lms2xxConfig { rate: Rate::R9600, ..Lms2xxConfig::default() });
    let mut now = Duration::ZERO;
    client.handle_bytes(now, &[]);
    let mut status = vec![0; 154];
    status[0] = 0xB1;
    status[102] = 4;
    (status[107], status[109]) = (180, 100);
    let mut scan = vec![0xB0, 181, 0x40];
    // 10 m, and the flags of both fields.
    scan.extend((0..181).flat_map(|_| (0xC000_u16 | 10_000).to_le_bytes()));
    scan.push(0x10);
    let mut wrote = false;
    for _ in 0..20 {
        now += Duration::from_millis(50);
        for frame in asked(&mut client) {
            wrote |= frame[4] == 0x77;
            client.handle_bytes(
                now,
                &reply(&match frame[4] {
                    0x31 => status.clone(),
                    0x3A => b"\xBALMS200;30106;V01.00 \x10".to_vec(),
                    // No device known here has 30 bytes.
                    0x74 => [&[0xF4][..], &[0; 30], &[0x10]].concat(),
                    _ => vec![0xA0, 0, 0x10],
                }),
            );
        }
    }
    client.handle_bytes(now, &reply(&scan)[1..]);
    let mut limited = 0;
    while let Some(event) = client.poll_event() {
        limited +=
            usize::from(matches!(event, HostEvent::Limited { what } if what.contains("unknown length")));
    }
    assert!(!wrote && limited == 1);
    assert_eq!(client.scan().echoes[0].range_m, vec![10.0; 181]);
}

/// SICK's Quick Manual prints an F7 with the result 0 and the block as it was written.
#[test]
fn a_write_that_says_no_and_took_the_block_is_done() {
    let mut client = Lms2xxClient::new(Lms2xxConfig { rate: Rate::R9600, ..Lms2xxConfig::default() });
    let mut now = Duration::ZERO;
    client.handle_bytes(now, &[]);
    let mut device = device("lms200", Options::default());
    for _ in 0..40 {
        now += Duration::from_millis(50);
        for frame in asked(&mut client) {
            let at = SimTime(now.as_nanos() as u64);
            device.handle_bytes(at, Duration::ZERO, &frame);
            while let Some(sent) = device.poll_transmit(at) {
                device.transmitted(at);
                let mut body = sent.get(4..sent.len().max(6) - 2).unwrap_or_default().to_vec();
                match body.first() {
                    Some(0xF7) => {
                        body[1] = 0;
                        client.handle_bytes(now, &reply(&body)[1..]);
                    }
                    _ => client.handle_bytes(now, &sent),
                }
            }
        }
    }
    let mut events = Vec::new();
    while let Some(event) = client.poll_event() {
        events.push(event);
    }
    assert!(matches!(events.as_slice(), [HostEvent::Ready(_)]), "{events:?}");
}

/// What another client has left that takes values away is told, whatever the model: a narrower angle than its own, and a threshold for single values.
#[test]
fn an_angle_and_a_threshold_that_were_left_are_told() {
    for model in model::MODELS.iter().filter(|model| model.takes_variants) {
        for variant in model.variants {
            for fades_out in [false, true] {
                let mut device = Device::new(model, Options::default());
                let mut block = vec![0; 34];
                block.copy_from_slice(model.configuration.bytes());
                block[29] = fades_out.into();
                let password = [&[0x20, 0x00][..], b"SICK_LMS"].concat();
                let write = [&[0x77][..], &block].concat();
                let [angle, step] = [variant.angle_deg, variant.step_centideg].map(u16::to_le_bytes);
                let left = [password, write, [&[0x3B][..], &angle, &step].concat(), vec![0x20, 0x25]];
                let mut now = Duration::ZERO;
                let mut say = |device: &mut Device, frame: &[u8]| {
                    now += Duration::from_secs(1);
                    let at = SimTime(now.as_nanos() as u64);
                    device.handle_bytes(at, Duration::ZERO, frame);
                    let mut heard = Vec::new();
                    while let Some(sent) = device.poll_transmit(at) {
                        device.transmitted(at);
                        heard.extend(sent);
                    }
                    (now, heard)
                };
                for body in left {
                    let mut frame = Vec::new();
                    encode(0, &body, &mut frame);
                    say(&mut device, &frame);
                }
                assert_eq!(device.variant(), *variant, "{}", model.name);
                let config = Lms2xxConfig { rate: Rate::R9600, ..Lms2xxConfig::default() };
                let mut client = Lms2xxClient::new(config);
                client.handle_bytes(Duration::ZERO, &[]);
                for _ in 0..12 {
                    for frame in asked(&mut client) {
                        let (now, heard) = say(&mut device, &frame);
                        client.handle_bytes(now, &heard);
                    }
                }
                let events: Vec<_> = std::iter::from_fn(|| client.poll_event()).collect();
                assert!(matches!(events.last(), Some(HostEvent::Ready(_) | HostEvent::Scan)), "{events:?}");
                let told = |words: &str| {
                    events
                        .iter()
                        .any(|event| matches!(event, HostEvent::Limited { what } if what.contains(words)))
                };
                let alike =
                    model.variants.iter().filter(|other| other.step_centideg == variant.step_centideg);
                let is_narrow = alike.map(|other| other.angle_deg).max() > Some(variant.angle_deg);
                let found = (told("3B"), told("A2"));
                assert_eq!(found, (is_narrow, fades_out), "{} {variant:?}: {events:?}", model.name);
            }
        }
    }
}
