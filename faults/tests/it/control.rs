//! The control: it answers at once, and what it removes is healed at once.

use std::sync::Arc;
use std::time::Duration;

use rowscan_faults::{FaultControl, FaultError, FaultEvents, HostClock, Language, Medium, What, read};
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use crate::client::Speech;

fn control() -> (FaultControl, FaultEvents) {
    FaultControl::new(1, Arc::new(HostClock::start()), None)
}

fn refusal(text: &str) -> FaultError {
    let (control, _events) = control();
    control.stream("left", Medium::Tcp, Language::Cola);
    control.stream("line", Medium::Wire, Language::Lms2xx);
    let error = control.add_all(read(text).expect("sound")).expect_err(text);
    assert!(control.list().is_empty(), "nothing of it is added");
    error
}

#[test]
fn what_does_not_fit_the_plan_is_refused_with_the_remedy() {
    for (text, message) in [
        (
            "name = \"flip\"\non = \"lefft\"\n",
            "fault `flip`: there is no stream `lefft`; did you mean `left`?",
        ),
        (
            "name = \"flip\"\nat = { row_m = 3 }\n",
            "fault `flip`: `row_m` and `tree` need a row, and there is none here; use `s`, `scan` or `after`",
        ),
        (
            "name = \"flip\"\nat = { after = \"out\" }\n",
            "fault `flip`: `after` names `out`, and there is no such fault",
        ),
        (
            "name = \"rst\"\non = \"line\"\n",
            "fault `rst`: `rst` is a fault of TCP connections, and line is a serial wire; leave it out",
        ),
        (
            "name = \"flip\"\nid = \"a\"\n[[fault]]\nname = \"drop\"\nid = \"a\"\n",
            "there are two faults `a`; give one of them another `id`",
        ),
    ] {
        assert_eq!(refusal(&format!("[[fault]]\n{text}")).to_string(), message);
    }
}

#[test]
fn a_fault_without_a_stream_acts_on_every_one_it_can() {
    let (control, _events) = control();
    control.stream("left", Medium::Tcp, Language::Cola);
    control.stream("line", Medium::Wire, Language::Lms2xx);
    let faults =
        "[[fault]]\nname = \"flip\"\n[[fault]]\nname = \"flip\"\n[[fault]]\nname = \"rst\"\nat = { s = 9 }\n";
    assert_eq!(control.add_all(read(faults).expect("sound")).expect("fits"), ["flip", "flip-2", "rst"]);
    let listed: Vec<_> =
        control.list().into_iter().map(|status| (status.id, status.on, status.state)).collect();
    let expected = [
        ("flip", "left", "active"),
        ("flip", "line", "active"),
        ("flip-2", "left", "active"),
        ("flip-2", "line", "active"),
        ("rst", "left", "waiting"),
    ];
    assert_eq!(listed, expected.map(|(id, on, state)| (id.to_owned(), on.to_owned(), state)));
}

#[tokio::test(start_paused = true)]
async fn a_reset_while_everything_stalls_answers_at_once_and_lets_all_of_it_go() {
    for heal in [FaultControl::reset as fn(&FaultControl), |control| control.remove("stall").expect("there")]
    {
        let (control, mut events) = control();
        let stream = control.stream("left", Medium::Tcp, Language::Cola);
        control.add_all(read("[[fault]]\nname = \"stall\"\n").expect("sound")).expect("fits");
        let (mut client, device) = tokio::io::duplex(1024 * 1024);
        let (mut reader, mut writer) = tokio::io::split(stream.wrap(device, |_| ()));
        let reading = tokio::spawn(async move { reader.read(&mut [0; 8]).await });
        let sent: Vec<u8> = (0..2000).flat_map(|number| Speech::ColaB.scan(number)).collect();
        let whole = sent.clone();
        // More than is held: the writer must wait, and is let go on.
        let writing = tokio::spawn(async move { writer.write_all(&whole).await.map(|()| writer) });
        tokio::time::sleep(Duration::from_secs(60)).await;
        assert!(!writing.is_finished(), "64 KiB are held, and no more");
        let start = tokio::time::Instant::now();
        heal(&control);
        let mut got = vec![0; sent.len()];
        client.read_exact(&mut got).await.expect("open");
        assert_eq!((got == sent, start.elapsed()), (true, Duration::ZERO));
        let told: Vec<What> = std::iter::from_fn(|| events.take()).map(|event| event.what).collect();
        assert_eq!(told, [What::Begin, What::Healed]);
        assert!(control.list().is_empty());
        reading.abort();
    }
}

#[test]
fn removing_what_is_not_there_names_what_is() {
    let (control, _events) = control();
    control.stream("left", Medium::Tcp, Language::Cola);
    control.add_all(read("[[fault]]\nname = \"stall\"\n").expect("sound")).expect("fits");
    let error = control.remove("stal").expect_err("unknown");
    assert_eq!(error.to_string(), "there is no fault `stal`; did you mean `stall`?");
}

#[tokio::test(start_paused = true)]
async fn a_fault_added_while_bytes_flow_begins_with_the_next_telegram() {
    let (control, _events) = control();
    let stream = control.stream("left", Medium::Tcp, Language::Cola);
    let (mut client, device) = tokio::io::duplex(1024 * 1024);
    let mut device = stream.wrap(device, |_| ());
    let scans = [1, 2, 3].map(|number| Speech::ColaB.scan(number));
    let (head, tail) = scans[0].split_at(11);
    device.write_all(head).await.expect("open");
    control.add_all(read("[[fault]]\nname = \"drop\"\n").expect("sound")).expect("fits");
    for bytes in [tail, &scans[1], &scans[2]] {
        device.write_all(bytes).await.expect("open");
    }
    drop(device);
    let mut got = Vec::new();
    client.read_to_end(&mut got).await.expect("open");
    assert!(got == [scans[0].as_slice(), &scans[2]].concat());
}
