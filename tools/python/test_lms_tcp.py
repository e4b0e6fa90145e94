"""The emulated LMS111 as its clients see it: start-up sequences, then scans."""

import math
import socket
import time

import pytest

import sequences
from lms_client import SCAN_EVENT, SUBSCRIBE

#: The built-in scene: a scanner 1.6 m above flat ground; a side mount's device angle 0 looks straight down.
SENSOR_HEIGHT_MM = 1600


def check_scans(scans, points=541, step=5000, period_us=20000, consecutive=True):
    """What holds for every run of scans of the built-in scene."""
    for scan in scans:
        distances = scan.channel("DIST1")
        assert (distances.scale, distances.offset) == (1.0, 0.0)
        assert (distances.start, distances.step, len(distances.values)) == (-450000, step, points)
        # No leaf hangs within half a metre of the sensor's foot: there the ground's distance is height / cos(angle).
        for angle in range(-150_000, 150_001, step):
            ground_mm = SENSOR_HEIGHT_MM / math.cos(math.radians(angle / 10_000))
            assert abs(distances.values[(angle - distances.start) // step] - ground_mm) <= 1, "beam at %d" % angle
        assert scan.version == 1
        assert scan.scan_frequency_centihz == 100_000_000 // period_us
        assert scan.measurement_frequency == round(scan.scan_frequency_centihz / 100 * 3_600_000 / step / 100)
        assert scan.encoders == [] and scan.layer_angle == 0
        assert 0 < (scan.transmit_time_us - scan.start_time_us) % 2**32 < period_us
    for before, after in zip(scans, scans[1:]):
        turns = (after.scan_counter - before.scan_counter) % 2**16
        if consecutive:
            assert turns == 1
            assert (after.telegram_counter - before.telegram_counter) % 2**16 == 1
        assert abs((after.start_time_us - before.start_time_us) % 2**32 - turns * period_us) <= 1


def test_liblms1xx(connect):
    client = connect("A")
    sequences.play(client, sequences.LIBLMS1XX)
    client.wait_for_status(7)
    assert client.subscribe() == b"sEA LMDscandata 1"
    scans = client.scans(50)
    check_scans(scans)
    for scan in scans:
        assert [channel.name for channel in scan.channels16] == ["DIST1", "RSSI1"] and scan.channels8 == []
        assert scan.time is None
    assert client.unsubscribe() == b"sEA LMDscandata 0"
    assert client.exchange(b"sMN LMCstopmeas") == b"sAN LMCstopmeas 0"
    client.events.clear()
    with pytest.raises(socket.timeout):
        client.receive(patience_s=0.5)


@pytest.mark.parametrize("dialect", ["A", "B"])
def test_sick_scan_xd(connect, dialect):
    client = connect(dialect)
    sequences.play(client, {"A": sequences.SICK_SCAN_XD_A, "B": sequences.SICK_SCAN_XD_B}[dialect])
    client.wait_ready()
    assert client.subscribe() == {"A": b"sEA LMDscandata 1", "B": b"sEA LMDscandata \x01"}[dialect]
    scans = client.scans(50)
    check_scans(scans)
    for scan in scans:
        assert [channel.name for channel in scan.channels16] == ["DIST1"] and scan.channels8 == []
        assert scan.time is not None
    assert client.unsubscribe() == {"A": b"sEA LMDscandata 0", "B": b"sEA LMDscandata \x00"}[dialect]


def test_a_binary_scan_has_the_recorded_devices_size(connect):
    client = connect("B")
    sequences.play(client, sequences.SICK_SCAN_XD_B)
    client.subscribe()
    while True:
        payload = client.receive()
        if payload.startswith(SCAN_EVENT):
            break
    # 1191 bytes on the wire: 8 of header, 1 of checksum.
    assert len(payload) == 1191 - 9


def poll(client, count):
    """Polls as MRPT does, at the mirror's pace."""
    scans = []
    for _ in range(count):
        scans.append(client.poll_scan())
        time.sleep(0.004)
    return scans


def test_mrpt(connect):
    client = connect("A")
    sequences.play(client, sequences.MRPT)
    reply = client.wait_for_status(7)
    assert (b"\x02" + reply)[11:12] == b"7", "MRPT reads the status at this place"
    # A poll returns the last scan, which may still be one from before the change, or from before the start, which counts anew.
    time.sleep(0.2)
    scans = poll(client, 20)
    while scans and scans[0].channel("DIST1").step != 2500:
        del scans[0]
    scans += poll(client, 50)
    check_scans(scans, points=1081, step=2500, period_us=40000, consecutive=False)
    assert scans[-1].scan_counter != scans[0].scan_counter


def test_one_scanner_serves_both_dialects_the_same_scans(connect):
    clients = [connect("A"), connect("B")]
    sequences.play(clients[1], sequences.SICK_SCAN_XD_B)
    for client in clients:
        client.subscribe()
    text, binary = ({scan.telegram_counter: scan for scan in client.scans(100)} for client in clients)
    both = text.keys() & binary.keys()
    assert len(both) >= 20
    assert all(text[counter] == binary[counter] for counter in both)


def test_eihstcola_switches_after_its_reply(connect):
    client = connect("A")
    assert client.login() == b"sAN SetAccessMode 1"
    assert client.exchange(b"sWN EIHstCola 1") == b"sWA EIHstCola"
    client.switch("B")
    assert client.exchange(b"sRN ODoprh").startswith(b"sRA ODoprh ")
    assert client.subscribe() == b"sEA LMDscandata \x01"
    assert len(client.scans(3)) == 3


def test_the_output_range_cuts_the_scan(connect):
    client = connect("B")
    client.login()
    half = bytes.fromhex("0001 00001388 00000000 001B7740")
    assert client.exchange(b"sWN LMPoutputRange " + half) == b"sWA LMPoutputRange "
    client.exchange(b"sMN LMCstartmeas")
    client.exchange(b"sMN Run")
    client.wait_ready()
    client.subscribe()
    for scan in client.scans(10):
        distances = scan.channel("DIST1")
        assert (distances.start, distances.step, len(distances.values)) == (0, 5000, 361)
        assert abs(distances.values[0] - SENSOR_HEIGHT_MM) <= 1


def test_writing_needs_a_login(connect):
    text, binary = connect("A"), connect("B")
    config = b"01 00 1 1 0 00 00 0 0 0 0 +1"
    assert text.exchange(b"sWN LMDscandatacfg " + config) == b"sFA A"
    assert text.exchange(b"sMN mLMPsetscancfg +2500 +1 +2500 -450000 +2250000") == b"sFA 1"
    assert text.exchange(b"sMN SetAccessMode 03 12345678") == b"sAN SetAccessMode 0"
    assert text.exchange(b"sWN LMDscandatacfg " + config) == b"sFA A"
    assert binary.exchange(b"sWN LMDscandatacfg " + bytes([1, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 1])) == b"sFA\x00\x0a"


def test_unknown_names_have_their_codes(connect):
    text, binary = connect("A"), connect("B")
    assert text.exchange(b"sRN NoSuchVariable") == b"sFA 3"
    assert text.exchange(b"sMN NoSuchMethod") == b"sFA 2"
    assert text.exchange(b"sEN NoSuchEvent 1") == b"sFA F"
    assert binary.exchange(b"sRN NoSuchVariable") == b"sFA\x00\x03"


def test_an_illegal_scan_frequency_is_refused_and_changes_nothing(connect):
    client = connect("A")
    client.login()
    reply = client.exchange(b"sMN mLMPsetscancfg +1234 +1 +5000 -450000 +2250000")
    assert reply == b"sAN mLMPsetscancfg 1 1388 1 1388 FFF92230 225510"
    assert client.exchange(b"sRN LMPscancfg") == b"sRA LMPscancfg 1388 1 1388 FFF92230 225510"


def test_device_ident_names_an_lms1xx(connect):
    text, binary = connect("A"), connect("B")
    body = text.exchange(b"sRN DeviceIdent")[len(b"sRA DeviceIdent "):]
    length, rest = body.split(b" ", 1)
    name = rest[:int(length, 16)]
    assert name.startswith(b"LMS1")
    version = rest[len(name) + 1:].split(b" ", 1)
    assert len(version[1]) == int(version[0], 16)
    texts = b"".join(len(one).to_bytes(2, "big") + one for one in (name, version[1]))
    assert binary.exchange(b"sRN DeviceIdent") == b"sRA DeviceIdent " + texts
    assert binary.exchange(b"sRI 0") == b"sRA 0 " + texts


def test_interrupt_ends_it_in_order(emulator, connect):
    client = connect("B")
    client.send(SUBSCRIBE["B"])
    client.scans(5)
    assert emulator.interrupt() == 0
    with pytest.raises((ConnectionError, socket.timeout)):
        while True:
            client.receive(patience_s=2)
