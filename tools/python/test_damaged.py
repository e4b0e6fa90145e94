"""200 random cuts and 200 flipped bits of each kind of recording: `record --info` counts what an independent reading of the format finds."""

import json
import random

import pytest

import damaged
from cola import encode
from emulator import Emulator, run
from lms_client import Client

serial = pytest.importorskip("serial")

from test_lms2xx_serial import SerialEmulator  # noqa: E402 (pyserial first)

#: Cuts, and flips, of every file.
ROUNDS = 200
SCANS = 40


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """One whole recording of each kind, with the function that counts its scans."""
    rowscan = __import__("emulator")
    if not rowscan.binary():
        pytest.skip("ROWSCAN_BIN is not set; `cargo xtask ci` sets it")
    folder = tmp_path_factory.mktemp("damaged")
    # At `max` the same bytes in every run.
    emulator = Emulator("--model", "lms111", "--time-scale", "max", "--seed", "5")
    try:
        with Client(emulator.address, "B") as client:
            client.subscribe()
            telegrams = [encode("B", client.receive()) for _ in range(SCANS)]
    finally:
        emulator.close()
    (folder / "raw.bin").write_bytes(b"".join(telegrams))
    code, _, said = run("record", str(folder / "raw.bin"), "-o", str(folder / "whole.mcap"), "--decoded", "none")
    assert code == 0, said
    began_ns = 1700000000 * 10 ** 9
    # Segments that end inside telegrams.
    stream = b"".join(telegrams)
    pieces = [stream[at:at + 900] for at in range(0, len(stream), 900)]
    capture = damaged.pcapng([(began_ns + number * 10 ** 7, piece) for number, piece in enumerate(pieces)])
    line = SerialEmulator(rowscan, "--model", "lms291", "--pty", str(folder / "line"))
    try:
        code, _, said = run("record", "serial:%s?baud=500000" % (folder / "line"), "-o", str(folder / "serial.mcap"), "--scans", str(SCANS),
                            "--decoded", "none")
        assert code == 0, said
    finally:
        line.close()
    return {
        "mcap": ((folder / "whole.mcap").read_bytes(), damaged.mcap_scans),
        "pcapng": (capture, damaged.pcapng_scans),
        "lms2xx": (b"".join(lms2xx_log(folder / "serial.mcap")), damaged.lms2xx_scans),
    }


def lms2xx_log(path):
    """The device's bytes in a recording, as a port monitor keeps them."""
    device = None
    for opcode, content in damaged.records(path.read_bytes(), len(damaged.Mcap.MAGIC)):
        fields = damaged.Fields(content)
        if opcode == 0x0F:
            return
        if opcode == 0x04:
            number = fields.number(2)
            fields.number(2)
            device = number if fields.text().endswith("/from_device") else device
        elif opcode == 0x05 and fields.number(2) == device:
            yield content[22:]


def counted(path):
    """Scans of all streams, by `record --info`; none where it says that there is nothing to count."""
    code, told, said = run("record", "--info", str(path), "--format", "json")
    assert code in (0, 1, 2), said
    if code == 2:
        assert said.startswith("rowscan: ")
        return 0
    return sum(stream["scans"] for stream in json.loads(told)["streams"])


def cut(data, numbers):
    return data[:numbers.randrange(len(data))]


def flipped(data, numbers):
    bit = numbers.randrange(8 * len(data))
    return data[:bit // 8] + bytes([data[bit // 8] ^ 1 << bit % 8]) + data[bit // 8 + 1:]


@pytest.mark.parametrize("damage", [cut, flipped], ids=["cut", "flipped"])
@pytest.mark.parametrize("kind", ["mcap", "pcapng", "lms2xx"])
def test_counts_are_those_of_an_independent_reading(files, kind, damage, tmp_path):
    whole, count = files[kind]
    assert count(whole) >= SCANS - 1
    numbers = random.Random("%s %s" % (kind, damage.__name__))
    path = tmp_path / "damaged"
    lost = 0
    for number in range(ROUNDS):
        data = damage(whole, numbers)
        path.write_bytes(data)
        expected = count(data)
        found = counted(path)
        assert found == expected, "number %d" % number
        lost += expected < count(whole)
    assert lost > ROUNDS // 4, "the damage does something"


def test_damage_costs_what_it_touches(files, tmp_path):
    """Judged by the places of the records in the whole file alone, not by a rule of what is read on behind damage."""
    whole, _ = files["mcap"]
    begin = len(damaged.Mcap.MAGIC)
    all_places = list(damaged.places(whole, begin, len(whole)))
    messages = [(first, end) for opcode, first, end in all_places if opcode == 0x05]
    assert len(messages) == SCANS, "one scan a message"
    # Who loses a channel loses its messages. A chunk of another kind may be a record of that kind with fields that no reader knows. The format says both.
    fatal = [range(first, end if opcode == 0x04 else first + 1) for opcode, first, end in all_places if opcode in (0x04, 0x06)]
    numbers = random.Random("what it touches")
    path = tmp_path / "damaged"
    for number in range(ROUNDS):
        length = numbers.randrange(begin, len(whole))
        path.write_bytes(whole[:length])
        assert counted(path) == sum(end <= length for _, end in messages), "cut at %d" % length
        bit = numbers.randrange(8 * begin, 8 * len(whole))
        if any(bit // 8 in place for place in fatal):
            continue
        at = bit // 8
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << bit % 8]) + whole[at + 1:])
        touched = sum(first <= at < end for first, end in messages)
        assert SCANS - touched <= counted(path) <= SCANS, "bit %d" % bit
