"""Foxglove's WebSocket protocol, spoken by a client that nobody here wrote the transport of: `websockets`."""

import base64
import contextlib
import json
import math
import struct

import pytest
from lms_client import Client
from websockets.sync.client import connect

#: The subprotocol of https://github.com/foxglove/foxglove-sdk.
SUBPROTOCOL = "foxglove.sdk.v1"
#: What begins a binary message of the server.
MESSAGE_DATA = 1
LIMIT_S = 20.0


class Viewer:
    """A client that has read what there is to subscribe to."""

    def __init__(self, address):
        self.socket = connect("ws://" + address, subprotocols=[SUBPROTOCOL], max_size=1 << 22)
        assert self.socket.subprotocol == SUBPROTOCOL
        self.info = json.loads(self.socket.recv(timeout=LIMIT_S))
        self.channels = {}
        self.topics = {}

    def until(self, topics):
        """Reads on until all these are told of."""
        while not set(topics) <= set(self.channels):
            message = self.socket.recv(timeout=LIMIT_S)
            if isinstance(message, str) and json.loads(message)["op"] == "advertise":
                self.channels.update({channel["topic"]: channel for channel in json.loads(message)["channels"]})

    def subscribe(self, *topics):
        self.until(topics)
        self.topics = dict(enumerate(topics))
        subscriptions = [{"id": number, "channelId": self.channels[topic]["id"]} for number, topic in self.topics.items()]
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def messages(self):
        """Topic, nanoseconds and contents of what comes."""
        while True:
            message = self.socket.recv(timeout=LIMIT_S)
            if isinstance(message, bytes) and message[0] == MESSAGE_DATA:
                number, at_ns = struct.unpack_from("<IQ", message, 1)
                yield self.topics[number], at_ns, json.loads(message[13:])


@contextlib.contextmanager
def emulated(rowscan, *flags):
    emulator = rowscan.Emulator("spindle", "--foxglove", "127.0.0.1:0", *flags)
    viewer = Viewer(emulator.endpoint("foxglove")["address"])
    try:
        yield emulator, viewer
        viewer.socket.close()
        assert emulator.interrupt() == 0
    finally:
        emulator.close()


def test_it_tells_what_there_is_with_a_schema_each(rowscan):
    with emulated(rowscan) as (_, viewer):
        assert viewer.info["op"] == "serverInfo" and viewer.info["name"] == "rowscan emulate spindle"
        schemas = {
            "/scanner0/scan": "foxglove.LaserScan",
            "/scanner0/points": "foxglove.PointCloud",
            "/scanner0/canopy": "rowscan.Canopy",
            "/tf": "foxglove.FrameTransform",
            "/tractor": "rowscan.Tractor",
            "/fix": "foxglove.LocationFix",
        }
        viewer.until(schemas)
        assert {topic: channel["schemaName"] for topic, channel in viewer.channels.items()} == schemas
        for channel in viewer.channels.values():
            assert (channel["encoding"], channel["schemaEncoding"]) == ("json", "jsonschema")
            assert json.loads(channel["schema"])["title"] == channel["schemaName"]


def test_scans_and_points_are_those_of_the_telegrams(rowscan):
    with emulated(rowscan, "--model", "lms111") as (emulator, viewer):
        viewer.subscribe("/scanner0/scan", "/scanner0/points")
        with Client(emulator.address, "B") as client:
            client.subscribe()
            read = {tuple(scan.channel("DIST1").values) for scan in client.scans(60)}
        scans, clouds = {}, {}
        for topic, at_ns, message in viewer.messages():
            told = message["timestamp"]
            assert told["sec"] * 10**9 + told["nsec"] == at_ns
            (scans if topic == "/scanner0/scan" else clouds)[at_ns] = message
            if len(scans) >= 100 and len(clouds) >= 100:
                break
        millimetres = [tuple(round(1000 * metres) for metres in scan["ranges"]) for scan in scans.values()]
        assert len(read) >= 50 and sum(ranges in read for ranges in millimetres) >= len(read) - 5
        for at_ns, scan in scans.items():
            if at_ns in clouds:
                points = base64.b64decode(clouds[at_ns]["data"])
                assert len(points) == 16 * sum(1 for metres in scan["ranges"] if metres > 0)
                assert scan["start_angle"] == pytest.approx(math.radians(-45))
                assert scan["end_angle"] == pytest.approx(math.radians(225))


def test_the_tractor_drives_past_the_row(rowscan):
    with emulated(rowscan, "--start-when", "now") as (_, viewer):
        viewer.subscribe("/tf", "/tractor", "/fix", "/scanner0/canopy")
        frames, tractor, fixes, canopy = {"tractor": [], "scanner0": []}, [], [], []
        for topic, _, message in viewer.messages():
            if topic == "/tf":
                assert message["parent_frame_id"] == "scene"
                assert sum(part**2 for part in message["rotation"].values()) == pytest.approx(1)
                frames[message["child_frame_id"]].append(message["translation"])
            else:
                {"/tractor": tractor, "/fix": fixes, "/scanner0/canopy": canopy}[topic].append(message)
            if len(tractor) > 25 and canopy:
                break
        way_m = tractor[-1]["way_m"] - tractor[0]["way_m"]
        assert way_m > 1.0
        driven_m = frames["tractor"][-1]["y"] - frames["tractor"][0]["y"]
        assert driven_m == pytest.approx(way_m, abs=0.01)
        # The scanner is above the ground, beside the row and not in it.
        assert all(place["z"] > 0.5 and abs(place["x"]) > 0.5 for place in frames["scanner0"])
        # A minute of arc is a nautical mile: 1852 m.
        north_m = (fixes[-1]["latitude"] - fixes[0]["latitude"]) * 60 * 1852
        east_m = (fixes[-1]["longitude"] - fixes[0]["longitude"]) * 60 * 1852 * math.cos(math.radians(fixes[0]["latitude"]))
        assert math.hypot(north_m, east_m) == pytest.approx(way_m, rel=0.2, abs=0.5)
        assert tractor[-1]["ground_m_s"] > 0.5
        assert canopy[-1]["impacted_m2"] >= 0 and canopy[-1]["scanned_m"] > 0


def test_only_this_machine_may_look(rowscan):
    code, _, told = rowscan.run("emulate", "spindle", "--tcp", "127.0.0.1:0", "--foxglove", "0.0.0.0:0")
    assert code == 2 and "expected a loopback address" in told and "0.0.0.0:0" in told
