//! What a listener makes of an LMS2xx's parts and means of scans: where its beams point only the scan's angle and resolution tell, and what was taken is told.

use std::time::Duration;

use rowscan_protocol::host::{HostEvent, HostSession};
use rowscan_protocol::lms2xx::Variant;
use rowscan_protocol::lms2xx::client::Lms2xxClient;
use rowscan_protocol::lms2xx::frame::encode;
use rowscan_protocol::lms2xx::model::MODELS;
use rowscan_protocol::lms2xx::values::{CountWord, Output, Span, Unit, Values};
use rowscan_protocol::validity::ScanFault;

/// What a log holds: the answer to 3B, if it was heard, and one telegram of values.
fn heard(variant: Option<Variant>, output: Output, count: u16) -> (Lms2xxClient, HostEvent) {
    let mut client = Lms2xxClient::listen();
    if let Some(Variant { angle_deg, step_centideg }) = variant {
        let [angle, step] = [angle_deg.to_le_bytes(), step_centideg.to_le_bytes()];
        let body = [0xBB, 1, angle[0], angle[1], step[0], step[1], 0x10];
        let mut frame = Vec::new();
        encode(0x80, &body, &mut frame);
        client.handle_bytes(Duration::ZERO, &frame);
        while client.poll_event().is_some() {}
    }
    let word = CountWord { count, partial: None, unit: Some(Unit::Mm) };
    let values = Values { output, word, values: vec![1600; count.into()], status: 0x10, ..Values::default() };
    let (mut body, mut frame) = (Vec::new(), Vec::new());
    values.encode(&mut body);
    encode(0x80, &body, &mut frame);
    client.handle_bytes(Duration::from_millis(30), &frame);
    let event = client.poll_event().expect("a whole telegram");
    (client, event)
}

fn taken(client: &Lms2xxClient) -> Vec<&'static str> {
    client.scan().leftovers.iter().map(|(_, setting)| setting.name).collect()
}

#[test]
fn parts_point_where_their_scan_has_them_or_nobody_knows() {
    for model in MODELS {
        for variant in model.variants.iter().copied() {
            let count = variant.count();
            for span in [(1, count), (1, count / 2 + 1), (count / 3, count / 2), (count / 2, count)] {
                let span = Span { first: span.0, last: span.1 };
                let values = span.last - span.first + 1;
                for (output, mean) in
                    [(Output::Range(span), false), (Output::MeanRange { scans: 3, span }, true)]
                {
                    let what = format!("{}, {variant:?}, {output:?}", model.name);
                    let (client, event) = heard(Some(variant), output, values);
                    assert_eq!(event, HostEvent::Scan, "{what}");
                    let first_deg = variant.beams().angle_deg(usize::from(span.first - 1));
                    let beams = client.scan().beams;
                    assert!((beams.angle_deg(0) - first_deg).abs() < 1e-3, "{what}: {beams:?}");
                    let expected = [mean.then_some("mean"), (values < count).then_some("part")];
                    assert_eq!(taken(&client), expected.into_iter().flatten().collect::<Vec<_>>(), "{what}");
                    // The wrong twin: a log that begins behind the answer.
                    let (_, event) = heard(None, output, values);
                    assert_eq!(event, HostEvent::Malformed { fault: ScanFault::PartOfUnknownScan }, "{what}");
                }
            }
            for (output, mean) in [(Output::All, false), (Output::Mean { scans: 2 }, true)] {
                let (client, event) = heard(Some(variant), output, count);
                assert_eq!(event, HostEvent::Scan);
                assert_eq!(taken(&client), if mean { vec!["mean"] } else { vec![] }, "{output:?}");
            }
        }
    }
}
