"""The tractor's other voices, heard by programs nobody here wrote: python-can, cantools, pynmea2."""

import contextlib
import json
import os
import socket
import time

import can
import cantools
import pynmea2
import pytest

REPOSITORY = os.path.join(os.path.dirname(__file__), "..", "..")
#: What 65096, 65097 and 61474 come at.
PERIOD_S = 0.1
SPEEDS = {"WheelBasedSpeed": "WheelSpeed", "GroundBasedSpeed": "GroundSpeed", "MachineSelectedSpeed": "SelectedSpeed"}


@pytest.fixture(scope="module")
def database():
    """The DBC file as it ships, read as J1939 is: whoever has a message's source address may send it."""
    return cantools.database.load_file(os.path.join(REPOSITORY, "docs", "rowscan.dbc"), frame_id_mask=0x1FFFFF00)


@contextlib.contextmanager
def tractor(rowscan, *flags):
    """A virtual tractor with these flags; gives its endpoints by name."""
    emulator = rowscan.Emulator(*flags)
    try:
        yield emulator.endpoints
    finally:
        assert emulator.interrupt() == 0
        emulator.close()


def host_and_port(address):
    host, port = address.rsplit(":", 1)
    return host, int(port)


def open_bus(kind, endpoint):
    if kind == "slcan":
        return can.Bus(interface="slcan", channel=endpoint["path"], bitrate=250000, sleep_after_open=0)
    host, port = host_and_port(endpoint["address"])
    if kind == "socketcand":
        return can.Bus(interface="socketcand", channel="can0", host=host, port=port)
    return can.Bus(interface="udp_multicast", channel=host, port=port)


def listen(bus, database, seconds):
    """Everything heard in so many seconds, decoded: [(message's name, values)]."""
    heard, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        message = bus.recv(0.2)
        if message is not None:
            known = database.get_message_by_frame_id(message.arbitration_id)
            heard.append((known.name, known.decode(message.data, decode_choices=False)))
    return heard


@pytest.mark.parametrize("kind, port", [("slcan", "slcan:{tmp}/can"), ("socketcand", "socketcand:127.0.0.1:0"),
                                        ("udp", "udp:239.74.163.2:43177")])
def test_every_frame_is_decoded_and_a_command_is_obeyed(rowscan, database, tmp_path, kind, port):
    with tractor(rowscan, "--can", port.format(tmp=tmp_path)) as endpoints:
        bus = open_bus(kind, endpoints[kind])
        try:
            names = {name for name, _ in listen(bus, database, 2.0)}
            assert {"PositionRapid", "CourseSpeedRapid", "GnssPosition", *SPEEDS} <= names
            # 1.5 m/s forward, from rest at 0.5 m/s2: there within three seconds.
            command = database.get_message_by_name("MachineSelectedSpeedCommand")
            data = bytes.fromhex("dc05fffffffffffd")
            bus.send(can.Message(arbitration_id=command.frame_id, data=data, is_extended_id=True))
            heard = listen(bus, database, 5.0)
            for name, signal in SPEEDS.items():
                last = [values for told, values in heard if told == name][-1]
                assert last[signal] == pytest.approx(1.5)
            # Distance is what that speed makes of time.
            way = [values["GroundDistance"] for name, values in heard if name == "GroundBasedSpeed"]
            assert way[-1] - way[-11] == pytest.approx(1.5 * 10 * PERIOD_S, abs=0.002)
            # Who is there?
            bus.send(can.Message(arbitration_id=0x18EAFFFE, data=b"\x00\xee\x00", is_extended_id=True))
            claims = [values for name, values in listen(bus, database, 0.5) if name == "AddressClaimed"]
            assert claims[-1]["DeviceClass"] == 1 and claims[-1]["IndustryGroup"] == 2
        finally:
            bus.shutdown()


def candump(path, database, message):
    """The values of every frame of a message in a candump log, decoded."""
    found = []
    with open(path) as log:
        for line in log:
            identifier, data = line.split()[2].split("#")
            known = database.get_message_by_frame_id(int(identifier, 16))
            if known.name == message:
                found.append(known.decode(bytes.fromhex(data), decode_choices=False))
    return found


#: "Not available".
MISSING = 255


def told(frames, signal, scale):
    """The values of a signal that are there."""
    return [frame[signal] for frame in frames if round(frame[signal] / scale) != MISSING]


def estimated(rowscan, scene, log, scans):
    """The estimate of a drive past a scene, and its exit code, with the canopy sensor's frames in a log."""
    emulator = rowscan.Emulator(scene, "--time-scale", "max", "--seed", "1")
    try:
        code, out, err = rowscan.run(
            "estimate", "tcp://%s:%d" % emulator.address, "--rig", scene, "--can", "candump:%s" % log,
            "--scans", str(scans), "--format", "json", limit_s=120)
        emulator.interrupt()
    finally:
        emulator.close()
    assert out, err
    return json.loads(out[out.index("\n{\n"):] if out.startswith('{"event"') else out), code


def test_the_leaf_area_on_the_bus_is_the_file_s(rowscan, database, tmp_path):
    log = tmp_path / "bus.log"
    found, code = estimated(rowscan, "spindle", log, 880)
    assert code == 0
    frames = candump(log, database, "CanopySummary")
    areas, indices = told(frames, "LeafArea", 0.1), told(frames, "LeafAreaIndex", 0.04)
    assert len(areas) == len(indices) > 160
    per_metre = found["leaf_area_m2"] / found["scanned_m"]
    assert abs(sum(areas) / len(areas) / per_metre - 1) < 0.01
    assert abs(sum(indices) / len(indices) / found["lai"] - 1) < 0.01
    assert {frame["LeafAreaWithheld"] for frame in candump(log, database, "CanopyLeafStatus")} == {0}


def test_a_wall_has_no_leaf_area_in_the_file_nor_on_the_bus(rowscan, database, tmp_path):
    log = tmp_path / "bus.log"
    found, code = estimated(rowscan, "wall", log, 200)
    assert (code, found["leaf_area_m2"], found["leaf_area_withheld"]) == (1, None, "no_foliage")
    frames = candump(log, database, "CanopySummary")
    assert frames and not told(frames, "LeafArea", 0.1) and not told(frames, "LeafAreaIndex", 0.04)
    assert told(frames, "ImpactedArea", 0.02), "the wall itself is told"
    reasons = {frame["LeafAreaWithheld"] for frame in candump(log, database, "CanopyLeafStatus")}
    choices = database.get_message_by_name("CanopyLeafStatus").get_signal_by_name("LeafAreaWithheld").choices
    assert {str(choices[reason]) for reason in reasons} == {"NoFoliage"}


def test_clients_of_one_port_hear_each_other(rowscan):
    with tractor(rowscan, "--can", "socketcand:127.0.0.1:0") as endpoints:
        first, second = (open_bus("socketcand", endpoints["socketcand"]) for _ in range(2))
        mine = can.Message(arbitration_id=0x18FF4299, data=b"\x01\x02", is_extended_id=True)
        first.send(mine)
        heard = {}
        end = time.monotonic() + 10
        while 0x18FF4299 not in heard and time.monotonic() < end:
            message = second.recv(0.2)
            if message is not None:
                heard[message.arbitration_id] = bytes(message.data)
        assert heard.get(0x18FF4299) == b"\x01\x02"
        end, own = time.monotonic() + 0.5, []
        while time.monotonic() < end:
            message = first.recv(0.1)
            own += [message] if message is not None and message.arbitration_id == 0x18FF4299 else []
        assert not own, "a node does not hear its own frame"
        first.shutdown()
        second.shutdown()


def test_a_host_of_the_slcan_adapter_hears_what_its_filter_lets_through(rowscan, database, tmp_path):
    with tractor(rowscan, "--can", "slcan:%s/can" % tmp_path) as endpoints:
        bus = open_bus("slcan", endpoints["slcan"])
        try:
            bus.close()
            while bus.recv(0.2) is not None:
                pass
            # One long filter on 0CFE48F0, which stands at the upper end of the four registers; the mask leaves out RTR and two bits of nothing.
            for command in ("M%08X" % (0x0CFE48F0 << 3), "m00000007", "W1"):
                bus._write(command)
            bus.open()
            heard = [name for name, _ in listen(bus, database, 2.0)]
            assert len(heard) > 5 and set(heard) == {"WheelBasedSpeed"}
        finally:
            bus.shutdown()


def test_a_better_name_silences_the_tractor(rowscan):
    with tractor(rowscan, "--can", "socketcand:127.0.0.1:0") as endpoints:
        bus = open_bus("socketcand", endpoints["socketcand"])
        try:
            def senders(seconds):
                end, heard = time.monotonic() + seconds, []
                while time.monotonic() < end:
                    message = bus.recv(0.1)
                    heard += [] if message is None else [message.arbitration_id]
                return heard

            assert any(sender & 0xFF == 0xF0 for sender in senders(2.0))
            # The smallest NAME there is claims the tractor's address.
            bus.send(can.Message(arbitration_id=0x18EEFFF0, data=b"\x01" + bytes(7), is_extended_id=True))
            assert 0x18EEFFFE in senders(1.0), "it says that it cannot claim"
            assert senders(1.0) == []
        finally:
            bus.shutdown()


def test_nmea_is_read_by_pynmea2(rowscan):
    with tractor(rowscan, "--nmea", "tcp:127.0.0.1:0") as endpoints:
        with socket.create_connection(host_and_port(endpoints["nmea"]["address"]), timeout=10) as stream:
            lines = stream.makefile()
            sentences = [pynmea2.parse(lines.readline(), check=True) for _ in range(25)]
        kinds = [sentence.sentence_type for sentence in sentences]
        start = kinds.index("GGA")
        assert kinds[start:start + 5] == ["GGA", "RMC", "VTG", "ZDA", "HDT"]
        fix = sentences[start]
        assert fix.gps_qual == 4 and fix.latitude == pytest.approx(41.6, abs=1e-4)


def test_gnss_and_can_ride_beside_an_lms2xx(rowscan, tmp_path):
    log = tmp_path / "bus.log"
    emulator = rowscan.Emulator("--model", "lms200", "--nmea", "tcp:127.0.0.1:0", "--can", "candump:%s" % log)
    try:
        while "nmea" not in emulator.endpoints:
            event = json.loads(emulator.lines.get(timeout=20))
            emulator.endpoints[event["endpoint"]] = event
        with socket.create_connection(host_and_port(emulator.endpoints["nmea"]["address"]), timeout=10) as stream:
            sentences = [pynmea2.parse(line, check=True) for line, _ in zip(stream.makefile(), range(12))]
        found = {sentence.sentence_type for sentence in sentences}
        assert found == {"GGA", "RMC", "VTG", "ZDA", "HDT", "GST", "GSA"} or found == {"GGA", "RMC", "VTG", "ZDA", "HDT"}
        assert emulator.interrupt() == 0
    finally:
        emulator.close()
    assert "18EEFFF0#" in log.read_text()


@pytest.mark.parametrize("flags, remedy", [
    (["--can", "socketcan:nocan7"], "--can udp:"),
    (["--can", "can0"], "slcan:LINK"),
    (["--nmea", "pty:/tmp/rowscan-never@4800"], "bit/s or more"),
])
def test_bad_ports_are_refused_with_a_remedy(rowscan, flags, remedy):
    code, _, stderr = rowscan.run("emulate", "--tcp", "127.0.0.1:0", *flags)
    assert code == 2 and remedy in stderr, stderr


def test_a_track_that_runs_backwards_is_refused(rowscan, tmp_path):
    (tmp_path / "drive.csv").write_text("t_s,speed_m_s\n0,1\n2,1\n1,1\n")
    (tmp_path / "scene.toml").write_text("version = 1\n[drive]\ntrack = 'drive.csv'\n")
    code, _, stderr = rowscan.run("emulate", str(tmp_path / "scene.toml"), "--tcp", "127.0.0.1:0")
    assert code == 2 and "line 4: time runs backwards" in stderr, stderr


def test_the_canopy_sensor_speaks_on_the_bus(rowscan, database, tmp_path):
    log = tmp_path / "canopy.log"
    emulator = rowscan.Emulator("--time-scale", "max")
    try:
        source = "tcp://%s:%d" % emulator.address
        code, stdout, stderr = rowscan.run("estimate", source, "--rig", "spindle", "--scans", "400", "--format", "json",
                                           "--can", "candump:%s" % log, limit_s=80)
    finally:
        emulator.close()
    assert code == 0, stderr
    document = json.loads(stdout[stdout.index("{\n"):])
    assert document["advance_source"] == "encoder"
    heard = []
    for line in log.read_text().splitlines():
        at, _, frame = line.split()
        identifier, data = frame.split("#")
        known = database.get_message_by_frame_id(int(identifier, 16))
        heard.append((known.name, at, known.decode(bytes.fromhex(data), decode_choices=False)))
    summaries = [values for name, _, values in heard if name == "CanopySummary"]
    # Ten a second of 8 s, less the quarter second of the address claim.
    assert 70 <= len(summaries) <= 80
    assert summaries[-1]["AdvanceSource"] == 1 and 0.9 < summaries[-1]["GroundSpeed"] < 1.1
    # The bands come twice as often: only those of the summary's own instant are of the same window. Eight roundings to 0.005, one to the summary's.
    bands = {at: sum(values.values()) for name, at, values in heard if name == "CanopyImpactedBands"}
    pairs = [(bands[at], values["ImpactedArea"]) for name, at, values in heard if name == "CanopySummary" and at in bands]
    assert len(pairs) == len(summaries)
    assert max(impacted for _, impacted in pairs) > 0.5
    for of_bands, impacted in pairs:
        assert of_bands == pytest.approx(impacted, abs=0.025)
