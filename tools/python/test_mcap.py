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


@pytest.fixture
def tractor(rowscan, tmp_path):
    """A recording of a tractor's GNSS and CAN, and the bus as the emulator logged it."""
    path, log = tmp_path / "tractor.mcap", tmp_path / "bus.log"
    emulator = Emulator("--time-scale", "10", "--nmea", "tcp:127.0.0.1:0", "--can", "candump:%s" % log, "--record", str(path))
    try:
        with Client(emulator.address, "B") as client:
            client.subscribe()
            client.scans(100)
    finally:
        assert emulator.interrupt() == 0
        emulator.close()
    return path, log


def of_schema(path, name):
    """Channel, schema and decoded messages of a schema."""
    found = [(channel, schema, message) for schema, channel, message in messages(path) if schema and schema.name == name]
    assert found and all(schema.encoding == "jsonschema" and channel.message_encoding == "json" for channel, schema, _ in found)
    return found[0][0], json.loads(found[0][1].data), [(message.log_time, json.loads(message.data)) for _, _, message in found]


def shape(schema, value):
    """True if a value has the properties of a JSON schema, and no others."""
    types = {"object": dict, "array": list, "number": (int, float), "integer": int, "string": str, "boolean": bool}
    if "oneOf" in schema:
        return value in [one["const"] for one in schema["oneOf"]]
    if not isinstance(value, types[schema["type"]]):
        return False
    if schema["type"] == "object":
        return value.keys() == schema["properties"].keys() and all(shape(schema["properties"][key], value[key]) for key in value)
    if schema["type"] == "array":
        return schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 1 << 30) and all(shape(schema["items"], one) for one in value)
    return True


def test_positions_are_those_of_the_sentences(tractor):
    path, _ = tractor
    pynmea2 = pytest.importorskip("pynmea2")
    channel, schema, fixes = of_schema(path, "foxglove.LocationFix")
    assert channel.topic == "/gnss/fix" and all(shape(schema, fix) for _, fix in fixes)
    text = b"".join(m.data for _, channel, m in messages(path) if channel.topic == "/gnss/from_device").decode()
    sentences = [pynmea2.parse(line, check=True) for line in text.splitlines()]
    told = [sentence for sentence in sentences if sentence.sentence_type == "GGA"]
    assert len(told) == len(fixes) >= 10
    for sentence, (log_time, fix) in zip(told, fixes):
        assert (fix["latitude"], fix["longitude"]) == pytest.approx((sentence.latitude, sentence.longitude), abs=1e-12)
        assert fix["altitude"] == pytest.approx(sentence.altitude + float(sentence.geo_sep), abs=1e-9)
        assert fix["timestamp"] == {"sec": log_time // 10**9, "nsec": log_time % 10**9}


def test_can_frames_are_those_of_the_bus(tractor):
    path, log = tractor
    channel, schema, frames = of_schema(path, "rowscan.CanFrame")
    assert channel.topic == "/can/frame" and all(shape(schema, frame) for _, frame in frames)
    told = ["%0*X#%s" % (8 if frame["extended"] else 3, frame["id"], bytes(frame["data"]).hex().upper()) for _, frame in frames]
    assert told == [m.data.decode() for _, channel, m in messages(path) if channel.topic == "/can/from_device"]
    logged = [line.split()[2] for line in log.read_text().splitlines()]
    assert len(logged) >= 50 and told[:len(logged)] == logged


def test_a_file_with_our_streams_in_compressed_chunks_reads_the_same(recorded, tmp_path):
    writers = pytest.importorskip("mcap.writer")
    expected = info(recorded)
    for compression in ("LZ4", "ZSTD", "NONE"):
        path = tmp_path / (compression + ".mcap")
        rewrite(recorded, path, writers.Writer, compression=getattr(writers.CompressionType, compression))
        assert info(path) == expected
        assert path.stat().st_size < recorded.stat().st_size or compression == "NONE"


def test_somebody_elses_compressed_file_names_its_channels(rowscan, tmp_path):
    writers = pytest.importorskip("mcap.writer")
    path = tmp_path / "bag.mcap"
    with open(path, "wb") as stream:
        # As rosbag2 writes it.
        writer = writers.Writer(stream)
        writer.start(profile="ros2", library="rosbag2")
        schema = writer.register_schema("sensor_msgs/msg/Image", "ros2msg", b"uint8[] data")
        channel = writer.register_channel("/camera", "cdr", schema)
        for number in range(1000):
            writer.add_message(channel, number, b"\0" * 100, number)
        writer.finish()
    for command in ("estimate", "replay", "decode"):
        code, _, said = run(command, str(path))
        assert code == 2 and "without a recorded stream" in said and "/camera" in said, said


def info(path):
    """What --info says of the streams."""
    code, told, said = run("record", "--info", str(path), "--format", "json")
    assert code == 0, said
    return json.loads(told)["streams"]


def rewrite(path, to, writer_type, **options):
    """The same records by another writer."""
    with open(path, "rb") as stream, open(to, "wb") as out:
        writer = writer_type(out, **options)
        writer.start()
        source = reader.make_reader(stream)
        schemas, channels = {}, {}
        for record in source.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        for schema, channel, message in source.iter_messages(log_time_order=False):
            if schema and schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding,
                                                               schemas[schema.id] if schema else 0, channel.metadata)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time, message.sequence)
        writer.finish()


def test_metadata_says_what_it_is_of(recorded):
    with open(recorded, "rb") as stream:
        found = {record.name: record.metadata for record in reader.make_reader(stream).iter_metadata()}
    assert found["rowscan"]["program"].startswith("rowscan ")
    assert "speed_m_s" in found["rowscan"]["rig"]
