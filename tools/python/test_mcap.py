"""Recordings open with the mcap package, which nobody here wrote, and hold what was sent."""

import base64
import json
import struct

import pytest

from cola import Splitter
from emulator import Emulator, run
from lms_client import Client
from scandata import decode

reader = pytest.importorskip("mcap.reader")

#: Scans a recording must hold.
SCANS = 30


@pytest.fixture
def recorded(rowscan, tmp_path):
    """A recording of an LMS111 at work."""
    path = tmp_path / "run.mcap"
    emulator = Emulator("--model", "lms111", "--time-scale", "10")
    try:
        code, _, said = run("record", "tcp://%s:%d" % emulator.address, "-o", str(path), "--scans", str(SCANS), "--decoded", "all",
                            "--rig", "spindle")
        assert code == 0, said
    finally:
        emulator.close()
    return path


def messages(path):
    with open(path, "rb") as stream:
        for schema, channel, message in reader.make_reader(stream).iter_messages(log_time_order=False):
            yield schema, channel, message


def test_raw_bytes_are_telegrams_and_scans_say_the_same(recorded):
    splitter = Splitter("B")
    scans = []
    topics = set()
    for schema, channel, message in messages(recorded):
        topic = channel.topic.rsplit("/", 1)[-1]
        topics.add(topic)
        if topic == "from_device":
            assert channel.message_encoding == "bytes" and schema is None
            splitter.push(message.data)
        elif topic == "scan":
            assert (schema.name, schema.encoding) == ("foxglove.LaserScan", "jsonschema")
            json.loads(schema.data)
            scans.append(json.loads(message.data))
    assert topics == {"from_device", "to_device", "scan", "points"}
    start = b"sSN LMDscandata "
    sent = [decode("B", payload[len(start):]) for payload in iter(splitter.next_payload, None) if payload.startswith(start)]
    assert len(sent) == len(scans) >= SCANS
    for telegram, scan in zip(sent, scans):
        values = telegram.channel("DIST1").values
        assert scan["ranges"] == [value / 1000 if value > 15 else 0 for value in values]


def test_clouds_hold_every_return(recorded):
    clouds = [json.loads(m.data) for _, channel, m in messages(recorded) if channel.topic.endswith("/points")]
    scans = [json.loads(m.data) for _, channel, m in messages(recorded) if channel.topic.endswith("/scan")]
    for cloud, scan in zip(clouds, scans):
        data = base64.b64decode(cloud["data"])
        assert len(data) == 16 * sum(1 for value in scan["ranges"] if value > 0)
        x, y, z, _ = struct.unpack_from("<4f", data)
        first = next(value for value in scan["ranges"] if value > 0)
        assert abs((x * x + y * y + z * z) ** 0.5 - first) < 1e-4


def test_metadata_says_what_it_is_of(recorded):
    with open(recorded, "rb") as stream:
        found = {record.name: record.metadata for record in reader.make_reader(stream).iter_metadata()}
    assert found["rowscan"]["program"].startswith("rowscan ")
    assert "speed_m_s" in found["rowscan"]["rig"]
