"""`--decoded ros2`: a recording that is a ROS 2 bag, read by `rosbags`, which nobody here wrote."""

import json
import os

import numpy
import pytest
from mcap.reader import make_reader
from test_tractor import tractor

rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="rosbags needs Python 3.10")
typesys = pytest.importorskip("rosbags.typesys")

#: Where rowscan says what is not there.
MISS = numpy.inf


@pytest.fixture
def bag(rowscan, tmp_path):
    """A recording of a scanner and its tractor's GNSS as a bag, and the same bytes as JSON."""
    path = str(tmp_path / "run.mcap")
    with tractor(rowscan, "spindle", "--model", "lms111", "--nmea", "tcp:127.0.0.1:0") as endpoints:
        scanner, gnss = endpoints["tcp"]["address"], endpoints["nmea"]["address"]
        code, _, told = rowscan.run("record", "scanner=tcp://" + scanner, "--nmea", "tcp:" + gnss, "-o", path,
                                    "--scans", "60", "--decoded", "ros2", limit_s=60)
        assert code == 0, told
    return path


def messages(path):
    """What the bag holds by topic: time and message."""
    store = typesys.get_typestore(typesys.Stores.LATEST)
    with rosbag2.Reader(path) as reader:
        told = {connection.topic: [] for connection in reader.connections}
        for connection, at_ns, data in reader.messages():
            told[connection.topic].append((at_ns, store.deserialize_cdr(data, connection.msgtype)))
    return told


def test_scans_are_those_of_the_telegrams(rowscan, bag, tmp_path):
    told = messages(bag)
    scans = told["/scanner/scan"]
    assert len(scans) >= 60
    plain = str(tmp_path / "plain.mcap")
    code, _, said = rowscan.run("record", bag, "-o", plain, "--decoded", "scans")
    assert code == 0, said
    with open(plain, "rb") as file:
        decoded = [(message.log_time, json.loads(message.data)) for _, channel, message in make_reader(file).iter_messages()
                   if channel.topic == "/scanner/scan"]
    assert len(decoded) == len(scans)
    for (at_ns, scan), (plain_ns, expected) in zip(scans, decoded):
        assert at_ns == plain_ns == scan.header.stamp.sec * 10**9 + scan.header.stamp.nanosec
        assert scan.header.frame_id == "scanner"
        ranges = numpy.array(expected["ranges"], dtype=numpy.float32)
        assert numpy.array_equal(scan.ranges, numpy.where(ranges == 0, MISS, ranges))
        assert numpy.array_equal(scan.intensities, numpy.array(expected["intensities"], dtype=numpy.float32))
        assert scan.angle_min == pytest.approx(expected["start_angle"]) and scan.angle_max == pytest.approx(expected["end_angle"])
        # 541 beams half a degree apart at 50 Hz.
        assert scan.angle_min + scan.angle_increment * (len(ranges) - 1) == pytest.approx(scan.angle_max, abs=1e-4)
        assert scan.scan_time == pytest.approx(0.02) and scan.time_increment == pytest.approx(0.02 * 0.5 / 360)
        assert scan.range_min == 0 and scan.range_max < MISS


def test_positions_and_bytes_are_there_too(rowscan, bag):
    told = messages(bag)
    (fixes,) = (found for topic, found in told.items() if topic.endswith("/fix"))
    assert fixes and all(-90 <= fix.latitude <= 90 and fix.status.status == 0 and fix.position_covariance_type == 0 for _, fix in fixes)
    bytes_sent = b"".join(message.data.tobytes() for _, message in told["/scanner/from_device"])
    assert bytes_sent.count(b"sSN LMDscandata ") >= 60
    # It is a recording all the same.
    code, out, said = rowscan.run("record", "--info", bag, "--format", "json")
    assert code == 0, said
    streams = {stream["stream"]: stream for stream in json.loads(out)["streams"]}
    assert streams["scanner"]["scans"] >= 60
    assert os.path.getsize(bag) > len(bytes_sent)
