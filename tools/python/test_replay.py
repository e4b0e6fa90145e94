"""Recordings of real scanners, replayed as live devices, satisfy the plain client to the byte."""

import time

import pytest

from cola import Splitter
from emulator import Emulator
from lms_client import SCAN_EVENT, Client
from scandata import decode
from test_recordings import RECORDINGS


@pytest.fixture(params=[("lms111_startup_first88", "lms111"), ("lms511_20210302", "lms511")], ids=lambda pair: pair[1])
def replayed(request, rowscan):
    name, model = request.param
    path = RECORDINGS / (name + ".d2h.bin")
    if not path.exists():
        pytest.skip("recordings not found at %s" % RECORDINGS)
    emulator = Emulator(str(path), command="replay")
    yield emulator, model, path.read_bytes()
    emulator.close()


def recorded_counters(recorded):
    splitter = Splitter("B")
    splitter.push(recorded)
    payloads = [payload for payload in iter(splitter.next_payload, None) if payload.startswith(SCAN_EVENT)]
    return [decode("B", payload[len(SCAN_EVENT):]).telegram_counter for payload in payloads]


@pytest.mark.parametrize("dialect", ["A", "B"])
def test_a_recorded_scanner_answers_and_streams(replayed, dialect):
    emulator, model, recorded = replayed
    with Client(emulator.address, dialect) as client:
        assert model.upper().encode() in client.exchange(b"sRN DItype")
        assert client.login().startswith(b"sAN SetAccessMode ")
        # What the recording cannot honour is refused: every second scan.
        every_second = {"A": b"sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 +2",
                        "B": b"sWN LMDscandatacfg \x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02"}
        assert client.exchange(every_second[dialect]) == {"A": b"sFA 4", "B": b"sFA\x00\x04"}[dialect]
        assert client.subscribe().startswith(b"sEA LMDscandata ")
        scans = client.scans(40)
        if dialect == "B":
            events = [client.receive() for _ in range(20)]
            assert all(event in recorded for event in events)
        # Gaps and repeats are the recorded ones.
        assert [scan.telegram_counter for scan in scans] == recorded_counters(recorded)[:40]
        points = {"lms111": 541, "lms511": 1141}[model]
        assert all(len(scan.channel("DIST1").values) == points for scan in scans)


def test_a_client_that_asks_for_less_gets_it(replayed):
    emulator, _, _ = replayed
    with Client(emulator.address, "A") as client:
        client.login()
        assert client.exchange(b"sWN LMDscandatacfg 01 00 0 0 0 00 00 0 0 0 0 +1") == b"sWA LMDscandatacfg"
        assert client.exchange(b"sWN LMPoutputRange 1 1388 +450000 +900000") == b"sWA LMPoutputRange"
        client.subscribe()
        for scan in client.scans(10):
            assert [channel.name for channel in scan.channels16 + scan.channels8] == ["DIST1"]
            assert scan.channel("DIST1").start == 450000


def test_a_client_that_only_polls_gets_the_recorded_scans(replayed):
    emulator, _, recorded = replayed
    known = set(recorded_counters(recorded))
    with Client(emulator.address, "B") as client:
        # The second request sets the recording going.
        counters, end = set(), time.monotonic() + 10.0
        while len(counters) < 5 and time.monotonic() < end:
            reply = client.exchange(b"sRN LMDscandata")
            if reply.startswith(b"sRA LMDscandata "):
                counters.add(decode("B", reply[len(b"sRA LMDscandata "):]).telegram_counter)
        assert len(counters) >= 5 and counters <= known
