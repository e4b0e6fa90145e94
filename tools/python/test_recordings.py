"""The client's own decoder on what real devices sent: a decoder that passes here may judge the emulator."""

import json
import os
import pathlib

import pytest

from cola import Splitter, encode
from scandata import decode

FACTS = pathlib.Path(os.environ.get("ROWSCAN_FACTS") or pathlib.Path(__file__).resolve().parents[3] / "shared")
RECORDINGS = FACTS / "protocol" / "recordings"

NAMES = ["lms111_startup_first88", "lms511_20210302", "tim781s_20210125", "mrs1104_20210722"]


@pytest.fixture(params=NAMES)
def recording(request):
    """The recording's description and the device's payloads."""
    description = RECORDINGS / (request.param + ".json")
    if not description.exists():
        pytest.skip("recordings not found at %s" % RECORDINGS)
    splitter = Splitter("B")
    splitter.push((RECORDINGS / (request.param + ".d2h.bin")).read_bytes())
    payloads = list(iter(splitter.next_payload, None))
    assert not splitter.buffer
    return json.loads(description.read_text()), payloads


def scans_of(payloads):
    start = b"sSN LMDscandata "
    return [decode("B", payload[len(start):]) for payload in payloads if payload.startswith(start)]


def test_every_scan_decodes_to_its_last_byte(recording):
    description, payloads = recording
    assert len(scans_of(payloads)) == description["scan_telegrams"]


def test_the_first_scan_has_the_values_that_were_published_with_it(recording):
    description, payloads = recording
    scan, first = scans_of(payloads)[0], description["first_scan"]
    assert scan.version == first["version"]
    assert scan.serial_number == first["serial_number"]
    assert scan.device_status == (first["status1"], first["status2"])
    assert scan.telegram_counter == first["telegram_counter"]
    assert scan.scan_counter == first["scan_counter"]
    assert scan.start_time_us == first["time_since_startup_us"]
    assert scan.transmit_time_us == first["time_of_transmission_us"]
    assert scan.layer_angle == first["layer_angle_or_reserved"]
    assert scan.scan_frequency_centihz == first["scan_frequency_1_100Hz"]
    assert scan.measurement_frequency == first["measurement_frequency_100Hz"]
    assert scan.time == tuple(first["time"].values())
    for channels, published in ((scan.channels16, first["channels16"]), (scan.channels8, first["channels8"])):
        assert [channel.name for channel in channels] == [one["content"] for one in published]
        for channel, one in zip(channels, published):
            assert (channel.start, channel.step) == (one["start_angle_1_10000deg"], one["step_1_10000deg"])
            assert (len(channel.values), sum(channel.values)) == (one["count"], one["sum"])
            assert channel.values[:8] == one["first_values"]


def test_frames_encode_to_the_bytes_they_came_from(recording):
    _, payloads = recording
    for payload in payloads:
        splitter = Splitter("B")
        splitter.push(encode("B", payload))
        assert splitter.next_payload() == payload


def test_the_listing_s_worked_frame():
    expected = "02 02 02 02 00 00 00 17 73 4D 4E 20 53 65 74 41 63 63 65 73 73 4D 6F 64 65 20 03 F4 72 47 44 B3"
    assert encode("B", b"sMN SetAccessMode \x03\xf4\x72\x47\x44") == bytes.fromhex(expected)


def test_an_ascii_body_decodes_like_the_listing():
    body = (b"1 1 114097A 1 0 F768 4 74287D59 74288993 0 0 1 0 0 1388 168 0 1 DIST1 3F800000 00000000 FFF92230 1388 3 5D 0 56 "
            b"0 0 0 0 1 7B2 1 1 2 37 22 D90A8 0")
    scan = decode("A", body)
    assert (scan.serial_number, scan.scan_counter, scan.start_time_us) == (18090362, 4, 1948810585)
    distances = scan.channel("DIST1")
    assert (distances.scale, distances.start, distances.step, distances.values) == (1.0, -450000, 5000, [93, 0, 86])
    assert scan.time == (1970, 1, 1, 2, 55, 34, 889000)
    for broken in (body + b" 0", body[:-2], body.replace(b"1388", b"01388")):
        with pytest.raises(ValueError):
            decode("A", broken)
