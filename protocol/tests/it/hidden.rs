//! Filters that leave no beam: that nothing is sent is said, and only then.

use rowscan_protocol::device::variable::Value;
use rowscan_protocol::device::{Device, EchoOfTurns, Identity, MeasuredLine};
use rowscan_protocol::model::{Model, SEGMENTED};
use rowscan_protocol::time::SimTime;

/// A scanner that streams, with filters as given; none where it lacks one of them or refuses the numbers.
fn filtered(model: &'static Model, filters: &[(&str, &[i64])]) -> Option<Device> {
    let mut device = Device::new(model, Identity::default());
    device.direct("127.0.0.1:2115".parse().unwrap());
    device.enable_streaming();
    for (name, numbers) in filters {
        let value = numbers.iter().copied().map(Value::Number).collect();
        device.set_value(device.variable(name)?, value, SimTime::ZERO).ok()?;
    }
    Some(device)
}

/// Telegrams of a turn.
fn sent(device: &mut Device) -> usize {
    let mirrors = device.mirrors();
    let line = |beams| MeasuredLine { grid: beams, echoes: &[] };
    let lines: Vec<_> = mirrors.iter().map(|mirror| line(mirror.beams)).collect();
    device.measure(SimTime::ZERO, &line(device.mirror().beams)).unwrap();
    let mut datagrams = Vec::new();
    device.segments(SimTime::ZERO, &lines, &mut datagrams);
    datagrams.len()
}

#[test]
fn a_filter_that_leaves_no_telegram_is_named_and_no_other() {
    let angles: &[[i64; 6]] = &[
        [0, 100_000, -100_000, -900_000, 900_000, 1],
        [1, -1_380_000, 1_380_000, -900_000, 900_000, 1],
        [1, -100_000, 100_000, -900_000, 900_000, 20],
        // A start behind its stop, in either angle, and a range between two beams.
        [1, 100_000, -100_000, -900_000, 900_000, 1],
        [1, -100_000, 100_000, 900_000, -900_000, 1],
        [1, 1_000, 1_200, -900_000, 900_000, 1],
        // Elevations that only scanners with layers have; one beam.
        [1, -100_000, 100_000, 100_000, 300_000, 1],
        [1, 0, 0, -900_000, 900_000, 1],
    ];
    let layer = |on: &[usize]| -> Vec<i64> {
        [1].into_iter().chain((0..16).map(|layer| on.contains(&layer).into())).collect()
    };
    let layers = [vec![], layer(&[0, 5]), layer(&[15]), layer(&[])];
    let mut named = std::collections::BTreeMap::new();
    for model in SEGMENTED {
        for angles in angles {
            for layers in &layers {
                let mut filters = vec![("LFPangleRangeFilter", &angles[..])];
                filters.extend((!layers.is_empty()).then_some(("LFPlayerFilter", &layers[..])));
                let Some(mut device) = filtered(model, &filters) else { continue };
                let hidden = device.hidden_by();
                assert_eq!(hidden.is_some(), sent(&mut device) == 0, "{} {filters:?} {hidden:?}", model.name);
                if let Some(filter) = hidden {
                    *named.entry((model.name, filter)).or_insert(0) += 1;
                }
            }
        }
        assert_eq!(filtered(model, &[]).unwrap().hidden_by(), None, "{}: as delivered", model.name);
    }
    let mut played = filtered(SEGMENTED[0], &[("LFPangleRangeFilter", &angles[3])]).unwrap();
    assert!(played.hidden_by().is_some());
    played.play_back_turns(7, played.model().default_mode, 1, EchoOfTurns::Untold);
    assert_eq!(played.hidden_by(), None, "recorded turns are sent as they are");
    let names: Vec<_> = named.into_keys().collect();
    let expected = [
        ("multiscan136", "LFPangleRangeFilter"),
        ("multiscan136", "LFPlayerFilter"),
        ("picoscan150", "LFPangleRangeFilter"),
    ];
    assert_eq!(names, expected);
}
