//! When faults begin, last, repeat and end, and what is told of it.

use std::sync::Arc;
use std::time::Duration;

use rowscan_faults::{FaultControl, FaultEvent, HostClock, Language, Medium, Row, What, read};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};

use crate::client::{SCANS, Speech, run};

fn at_ms(event: &FaultEvent) -> u64 {
    (event.at_s * 1e3).round() as u64
}

/// What, when, and of which scan.
fn told(events: &[FaultEvent]) -> Vec<(What, u64, Option<u64>)> {
    events.iter().map(|event| (event.what, at_ms(event), event.scan)).collect()
}

#[tokio::test(start_paused = true)]
async fn begin_act_and_end_tell_time_scan_and_offset() {
    let seen = run(Speech::ColaB, "[[fault]]\nname = \"drop\"\nat = { scan = 5 }\ncount = 2\n", 1).await;
    let expected = [
        (What::Begin, 100, None),
        (What::Act, 100, Some(5)),
        (What::Act, 120, Some(6)),
        (What::End, 120, None),
    ];
    assert_eq!(told(&seen.events), expected);
    let len = Speech::ColaB.scan(1).len() as u64;
    let offsets: Vec<_> =
        seen.events.iter().filter(|event| event.what == What::Act).map(|event| event.offset).collect();
    assert_eq!(offsets, [Some(4 * len), Some(5 * len)]);
    assert_eq!((seen.events[3].acts, seen.events[0].connection), (Some(2), Some(1)));
}

#[tokio::test(start_paused = true)]
async fn each_telegram_of_several_that_are_lost_is_an_act() {
    let text = "[[fault]]\nname = \"drop\"\ntelegrams = 3\nat = { scan = 5 }\n";
    let seen = run(Speech::ColaB, text, 1).await;
    assert_eq!(seen.scans, [1, 2, 3, 4, 8, 9, 10, 11, 12]);
    let expected = [
        (What::Begin, 100, None),
        (What::Act, 100, Some(5)),
        (What::Act, 120, Some(6)),
        (What::Act, 140, Some(7)),
        (What::End, 140, None),
    ];
    assert_eq!(told(&seen.events), expected);
    assert_eq!(seen.events[4].acts, Some(3));
    // `count` limits how often it begins to lose.
    let seen = run(Speech::ColaB, &(text.to_owned() + "count = 2\n"), 1).await;
    assert_eq!(seen.scans, [1, 2, 3, 4, 11, 12]);
    assert_eq!(seen.events.last().map(|event| (event.what, event.acts)), Some((What::End, Some(6))));
}

#[tokio::test(start_paused = true)]
async fn a_fault_begins_by_second_and_repeats_by_period_until_its_count() {
    let text = "[[fault]]\nname = \"drop\"\nat = { s = 0.05 }\nevery = { s = 0.06 }\ncount = 3\n";
    let seen = run(Speech::ColaB, text, 1).await;
    assert_eq!(seen.scans, [1, 2, 4, 5, 7, 8, 10, 11, 12]);
    let begins: Vec<u64> = seen.events.iter().filter(|event| event.what == What::Begin).map(at_ms).collect();
    assert_eq!(begins, [50, 110, 170]);
}

#[tokio::test(start_paused = true)]
async fn a_fault_repeats_by_scans() {
    let text = "[[fault]]\nname = \"drop\"\nat = { scan = 3 }\nevery = { scans = 4 }\n";
    let seen = run(Speech::Lms2xx, text, 1).await;
    assert_eq!(seen.scans, [1, 2, 4, 5, 6, 8, 9, 10, 12]);
}

#[tokio::test(start_paused = true)]
async fn a_fault_follows_another_ones_end() {
    let text = "[[fault]]\nid = \"first\"\nname = \"drop\"\nat = { scan = 2 }\nfor = { scans = 3 }\n\
                [[fault]]\nname = \"drop\"\nat = { after = \"first.end\", plus_s = 0.05 }\n";
    let seen = run(Speech::ColaA, text, 1).await;
    // Scans 2 to 4 go; that ends at 80 ms; the first telegram from 130 ms on is scan 7.
    assert_eq!(seen.scans, [1, 5, 6, 8, 9, 10, 11, 12]);
    assert!(
        seen.events
            .iter()
            .any(|event| event.id == "drop" && event.what == What::Begin && at_ms(event) == 130)
    );
}

#[tokio::test(start_paused = true)]
async fn a_fault_lasts_until_a_scan() {
    let text = "[[fault]]\nname = \"drop\"\nat = { scan = 4 }\nuntil = { scan = 7 }\n";
    let seen = run(Speech::ColaB, text, 1).await;
    assert_eq!(seen.scans, [1, 2, 3, 7, 8, 9, 10, 11, 12]);
}

#[tokio::test(start_paused = true)]
async fn a_probability_hits_its_share_and_each_hit_is_told() {
    let mut hits = 0;
    for seed in 0..100 {
        let seen = run(Speech::ColaB, "[[fault]]\nname = \"drop\"\np = 0.25\n", seed).await;
        let acts = seen.events.iter().filter(|event| event.what == What::Act).count();
        assert_eq!(acts + seen.scans.len(), usize::from(SCANS));
        hits += acts;
    }
    // 1200 draws at 0.25: 300, with a deviation of 15; five of those.
    assert!((225..=375).contains(&hits), "{hits}");
}

/// A tractor at 1 m/s that starts at 1 s; a tree each half metre.
#[derive(Debug)]
struct Drive;

impl Row for Drive {
    fn row_m(&self, at: Duration) -> Option<f64> {
        Some(at.checked_sub(Duration::from_secs(1))?.as_secs_f64())
    }

    fn tree(&self, at: Duration) -> Option<u32> {
        self.row_m(at).map(|row_m| (row_m / 0.5) as u32)
    }
}

/// A device's end that has faults, its client's end, and the control.
fn pair(
    text: &str,
) -> (FaultControl, rowscan_faults::FaultEvents, rowscan_faults::FaultyStream<DuplexStream>, DuplexStream) {
    let (control, events) = FaultControl::new(1, Arc::new(HostClock::start()), Some(Arc::new(Drive)));
    let stream = control.stream("left", Medium::Tcp, Language::Cola);
    control.add_all(read(text).expect(text)).expect(text);
    let (client, device) = tokio::io::duplex(64 * 1024);
    (control, events, stream.wrap(device, |_| ()), client)
}

#[tokio::test(start_paused = true)]
async fn a_place_along_the_row_begins_a_fault_also_while_nothing_passes() {
    let text = "[[fault]]\nid = \"metre\"\nname = \"stall\"\nat = { row_m = 2.0 }\nfor = { s = 1 }\n\
                [[fault]]\nid = \"tree\"\nname = \"stall\"\nat = { tree = 10 }\nuntil = { tree = 12 }\n";
    let (control, mut events, _stream, _client) = pair(text);
    let driving = control.clone();
    let driver = tokio::spawn(async move { driving.drive().await });
    tokio::time::sleep(Duration::from_secs(10)).await;
    driver.abort();
    let told: Vec<_> = std::iter::from_fn(|| events.take())
        .map(|event| (event.id.clone(), event.what, event.at_s, event.row_m.expect("a row")))
        .collect();
    let near = |event: &(String, What, f64, f64), id: &str, what, at_s: f64| {
        event.0 == id
            && event.1 == what
            && (0.0..0.02).contains(&(event.2 - at_s))
            && (event.3 - (event.2 - 1.0)).abs() < 1e-9
    };
    let [begin, end, tree, last] = told.as_slice() else { panic!("{told:?}") };
    assert!(near(begin, "metre", What::Begin, 3.0) && near(end, "metre", What::End, 4.0), "{told:?}");
    assert!(near(tree, "tree", What::Begin, 6.0) && near(last, "tree", What::End, 7.0), "{told:?}");
}

#[tokio::test(start_paused = true)]
async fn the_bytes_of_requests_are_faulted_on_their_way_to_the_device() {
    let text = "[[fault]]\nname = \"flip\"\noffset = 4\ndirection = \"to_device\"\n[[fault]]\nname = \"delay\"\nms = 300\nat = { s = 5 }\n";
    let (_control, _events, mut device, mut client) = pair(text);
    let request = Speech::ColaA.request();
    for (number, expected_ms) in [(0, 0), (1, 300)] {
        let start = tokio::time::Instant::now();
        client.write_all(&request).await.expect("open");
        let mut got = vec![0; request.len()];
        device.read_exact(&mut got).await.expect("open");
        assert_eq!(start.elapsed().as_millis() as u64 / 10 * 10, expected_ms);
        let differing = got.iter().zip(&request).filter(|(a, b)| a != b).count();
        assert_eq!(differing, usize::from(number == 0), "only the first request is hit");
        tokio::time::sleep(Duration::from_secs(6)).await;
    }
}

#[tokio::test(start_paused = true)]
async fn a_cut_at_any_byte_of_a_request_changes_nothing_for_the_device() {
    for speech in Speech::ALL {
        let request = speech.request();
        for offset in 1..request.len() {
            let text = format!("[[fault]]\nname = \"split\"\ndirection = \"to_device\"\noffset = {offset}\n");
            let (control, _events) = FaultControl::new(1, Arc::new(HostClock::start()), None);
            let stream = control.stream("left", Medium::Tcp, speech.language());
            control.add_all(read(&text).expect("sound")).expect("fits");
            let (mut client, device) = tokio::io::duplex(1024);
            let mut device = stream.wrap(device, |_| ());
            client.write_all(&request).await.expect("open");
            let mut got = vec![0; 1024];
            let first = device.read(&mut got).await.expect("open");
            let rest = device.read(got.get_mut(first..).expect("room")).await.expect("open");
            assert_eq!((first, got.get(..first + rest)), (offset, Some(request.as_slice())), "{speech:?}");
        }
    }
}

#[tokio::test(start_paused = true)]
async fn what_is_no_telegram_is_let_go_as_it_is() {
    let (_control, _events, mut device, mut client) = pair("[[fault]]\nname = \"drop\"\nfor = { s = 60 }\n");
    let junk = b"\x02\x02\x02\x02\0\0\x10\0sRN never finished";
    device.write_all(junk).await.expect("open");
    let reading = tokio::spawn(async move {
        let mut chunk = [0; 64];
        let _ = device.read(&mut chunk).await;
    });
    let start = tokio::time::Instant::now();
    let mut got = vec![0; junk.len()];
    client.read_exact(&mut got).await.expect("open");
    assert_eq!((got.as_slice(), start.elapsed().as_millis()), (&junk[..], 500));
    reading.abort();
}
