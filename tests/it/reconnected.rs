//! A scanner whose client came again: a recording has a stream for each conversation, and an estimate reads on where the first one ends.

use crate::common;

use std::io::Cursor;
use std::path::Path;

use common::replayed::Packets;
use common::talk::Talk;
use rowscan_driver::{DriverConfig, Scanner, Source};
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::model;
use rowscan_recording::{About, Decoded, McapWriter, StreamKind};

/// Writes packets, each with the number of its stream.
fn keep(path: &Path, names: &[&str], packets: &[(usize, &Packets)]) {
    let mut writer =
        McapWriter::new(Cursor::new(Vec::new()), &About::default(), Decoded::default()).expect("begun");
    let streams: Vec<_> =
        names.iter().map(|name| writer.add_stream(name, StreamKind::Cola).expect("added")).collect();
    let mut at_ns = 1_700_000_000_000_000_000;
    for (stream, packets) in packets {
        for (_, from, bytes) in *packets {
            at_ns += 20_000_000;
            writer.write(streams[*stream], *from, at_ns, 0, bytes).expect("written");
        }
    }
    writer.finish().expect("finished");
    std::fs::write(path, writer.into_inner().into_inner()).expect("kept");
}

/// The counters of the scans that are read, and the streams that are left out.
async fn read(source: &str) -> (Vec<u16>, Vec<String>) {
    let source: Source = source.parse().expect("a file");
    let mut scanner = Scanner::open(&source, DriverConfig::default()).await.expect("it opens");
    let mut counters = Vec::new();
    while let Some(record) = scanner.next().await.expect("it reads") {
        counters.push(record.scan.telegram_counter);
    }
    (counters, scanner.streams_left_out().map(|told| told.left_out).unwrap_or_default())
}

#[tokio::test]
async fn scans_of_a_client_that_came_again_follow_on_those_from_before() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let file = path.to_str().expect("text");
    let said = Talk::with(model::by_name("lms111").expect("known"), Dialect::B).recorded(176);
    let begun = said.len() - 176;
    // Six scans nobody took.
    let (first, second, third) =
        (said[..begun + 50].to_vec(), said[begun + 56..begun + 136].to_vec(), said[begun + 136..].to_vec());
    let names = ["left", "left-2", "left-3"];
    keep(&path, &names, &[(0, &first), (1, &second), (2, &third)]);
    let (counters, left_out) = read(file).await;
    assert_eq!((counters.len(), left_out), (170, Vec::<String>::new()));
    assert!(counters.windows(2).all(|pair| pair[1] - pair[0] == 1 || pair[1] - pair[0] == 7), "{counters:?}");
    // Conversations of few scans, in the middle and at the end.
    let (short, last) = (said[begun + 52..begun + 55].to_vec(), third[3..8].to_vec());
    let names = ["left", "left-2", "left-3", "left-4"];
    keep(&path, &names, &[(0, &first), (1, &short), (2, &second), (3, &last)]);
    let (counters, left_out) = read(file).await;
    assert_eq!((counters.len(), left_out), (50 + 3 + 80 + 5, Vec::<String>::new()));
    // A client that looked in while another one read has the same scans.
    let (early, looked) = (second[..40].to_vec(), second[20..23].to_vec());
    let rest = second[40..].to_vec();
    keep(&path, &names, &[(0, &early), (1, &looked), (0, &rest), (2, &last)]);
    let (counters, left_out) = read(file).await;
    assert_eq!((counters.len(), left_out), (80 + 5, vec!["left-2".to_owned()]));
    keep(&path, &["left", "left-2", "left-3"], &[(0, &first), (1, &second), (2, &third)]);
    // Whoever names a stream has that one.
    let (counters, _) = read(&format!("{file}#left-2")).await;
    assert_eq!(counters.len(), 80);
    // Two clients at once have the same scans: one of them is read, to its end.
    let in_turns: Vec<Packets> = second.iter().map(|packet| vec![packet.clone()]).collect();
    let both: Vec<(usize, &Packets)> =
        in_turns.iter().flat_map(|packet| [(0, packet), (1, packet)]).collect();
    keep(&path, &["left", "left-2"], &both);
    let (counters, left_out) = read(file).await;
    assert_eq!((counters.len(), left_out), (80, vec!["left-2".to_owned()]));
    // One of them leaves, and what the other one is given then follows on: no scan comes twice.
    let later: Packets = said[begun + 136..].to_vec();
    let then: Vec<(usize, &Packets)> = both.iter().copied().chain([(1, &later)]).collect();
    keep(&path, &["left", "left-2"], &then);
    let (counters, _) = read(file).await;
    assert!(counters.windows(2).all(|pair| pair[1] - pair[0] == 1), "{counters:?}");
    assert_eq!(counters.len(), 120);
    // A scanner that counts anew meanwhile has other scans.
    let anew = Talk::with(model::by_name("lms111").expect("known"), Dialect::B).recorded(40);
    keep(&path, &["left", "left-2"], &[(0, &first), (1, &anew)]);
    assert_eq!(read(file).await.0.len(), 90);
    // Another scanner's scans are none of this one's.
    keep(&path, &["left", "right"], &[(0, &first), (1, &second)]);
    let (counters, left_out) = read(file).await;
    assert_eq!((counters.len(), left_out), (50, vec!["right".to_owned()]));
}
