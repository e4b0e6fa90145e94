//! Bags of ROS 2: every topic is a name that ROS 2 takes, every layer of a scanner has its own.

use std::collections::BTreeSet;
use std::io::Cursor;

use rowscan_protocol::device::scan_event;
use rowscan_protocol::frame::Dialect;
use rowscan_protocol::telegram::LmdScandata;
use rowscan_protocol::telegram::lmd_scandata::Channel;
use rowscan_protocol::telegram::wire::FixedText;
use rowscan_recording::foxglove::Language;
use rowscan_recording::{About, Decoded, McapWriter, Recording, Side, StreamKind, account};

fn scan(layer_angle: i16) -> Vec<u8> {
    let (name, values) = (FixedText(*b"DIST1"), vec![1000, 2000, 3000]);
    let channel = Channel { name, scale: 1.0, step: 5000, values, ..Channel::default() };
    let scan = LmdScandata { layer_angle, channels16: vec![channel], ..LmdScandata::default() };
    let mut bytes = Vec::new();
    scan_event(Dialect::B, &scan, &mut bytes);
    bytes
}

fn bag(streams: &[&str], layers: &[i16]) -> Vec<u8> {
    let decoded = Decoded { scans: true, beside: true, language: Language::Ros2, ..Decoded::default() };
    let mut writer = McapWriter::new(Cursor::new(Vec::new()), &About::default(), decoded).unwrap();
    for name in streams {
        let stream = writer.add_stream(name, StreamKind::Cola).unwrap();
        for (at_ns, layer) in (0..).zip(layers) {
            writer.write(stream, Side::Device, at_ns, 0, &scan(*layer)).unwrap();
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// Topics with the number of messages on each.
fn topics(file: &[u8]) -> Vec<(String, usize)> {
    let messages: Vec<String> = mcap::MessageStream::new(file)
        .unwrap()
        .map(|message| message.unwrap().channel.topic.clone())
        .collect();
    let topics: BTreeSet<&String> = messages.iter().collect();
    let count = |topic: &&String| messages.iter().filter(|other| other == topic).count();
    topics.iter().map(|topic| ((*topic).clone(), count(topic))).collect()
}

#[test]
fn every_layer_has_a_topic_of_its_own() {
    let file = bag(&["mrs"], &[250, -500, 0, -250, 250, -500, 0, -250]);
    let found = topics(&file);
    let expected = [
        ("/mrs/from_device", 8),
        ("/mrs/scan", 2),
        ("/mrs/scan_layer_250", 2),
        ("/mrs/scan_layer_minus_250", 2),
        ("/mrs/scan_layer_minus_500", 2),
    ];
    assert_eq!(found, expected.map(|(topic, count)| (topic.to_owned(), count)));
}

/// A bag of somebody else's recorder: scans alone, its messages numbered 0, as rosbag2 may do.
#[test]
fn scans_of_a_foreign_bag_are_a_recording() {
    let ours = bag(&["lms"], &[0; 6]);
    let mut writer = mcap::WriteOptions::new().profile("ros2").create(Cursor::new(Vec::new())).unwrap();
    let schema = writer.add_schema("sensor_msgs/msg/LaserScan", "ros2msg", b"float32[] ranges").unwrap();
    let front = writer.add_channel(schema, "/front/scan", "cdr", &Default::default()).unwrap();
    let camera = writer.add_channel(0, "/camera", "cdr", &Default::default()).unwrap();
    for message in mcap::MessageStream::new(&ours).unwrap().map(Result::unwrap) {
        let channel_id = if message.channel.topic == "/lms/scan" { front } else { camera };
        let (log_time, publish_time) = (message.log_time, message.publish_time);
        let header = mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time };
        writer.write_to_known_channel(&header, &message.data).unwrap();
    }
    writer.finish().unwrap();
    let mut recording = Recording::read(Box::new(Cursor::new(writer.into_inner().into_inner()))).unwrap();
    let [report] = &account(&mut recording).unwrap()[..] else { panic!("one stream") };
    assert_eq!((report.stream.as_str(), report.scans, report.scans_lost), ("front/scan", 6, Some(0)));
    assert_eq!((report.packets_lost, report.telegrams_bad), (0, 0));
}

/// <https://design.ros2.org/articles/topic_and_service_names.html>
fn is_taken_by_ros_2(topic: &str) -> bool {
    let token = |token: &str| {
        !token.is_empty()
            && !token.starts_with(|c: char| c.is_ascii_digit())
            && !token.contains("__")
            && token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    topic.strip_prefix('/').is_some_and(|rest| rest.split('/').all(token))
}

#[test]
fn topics_are_names_of_ros_2_and_the_streams_keep_theirs() {
    let names =
        ["192.168.0.1:2112", "192.168.0.1:2112/2", "192.168.0.1:2112/1.2", "192_168.0.1-2112", "gn ss"];
    let file = bag(&names, &[0]);
    let found = topics(&file);
    assert_eq!(found.len(), 2 * names.len(), "{found:?}");
    assert!(found.iter().all(|(topic, _)| is_taken_by_ros_2(topic)), "{found:?}");
    let mut recording = Recording::read(Box::new(Cursor::new(file))).unwrap();
    while recording.next_packet().unwrap().is_some() {}
    let streams: Vec<&str> = recording.streams().iter().map(|stream| stream.name.as_str()).collect();
    assert_eq!(streams, names);
}
