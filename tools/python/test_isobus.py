"""The sprayer's address claim and its object pool on ISOBUS, read by can-j1939, which nobody here wrote."""

import glob
import os
import struct

import pytest

j1939 = pytest.importorskip("j1939")

SCENARIO = os.path.join(os.path.dirname(__file__), "..", "scenarios", "sprayer", "isobus.toml")
CLIENT, SERVER, EVERYONE = 0x91, 0xF7, 0xFF
PROCESS_DATA = 0xCB00


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """Every frame of a run: identifier and data."""
    import emulator

    if not emulator.binary():
        pytest.skip("ROWSCAN_BIN is not set; `cargo xtask ci` sets it")
    folder = tmp_path_factory.mktemp("kept")
    code, out, err = emulator.run("check", SCENARIO, "--keep", str(folder), limit_s=240)
    assert code == 0, out + err
    log, = glob.glob(str(folder / "**" / "can0.candump"), recursive=True)
    with open(log) as lines:
        words = [line.split()[2].split("#") for line in lines]
    return [(int(identifier, 16), bytearray.fromhex(data)) for identifier, data in words if len(identifier) == 8]


@pytest.fixture(scope="module")
def heard(frames):
    """What can-j1939 makes of them at the task controller's address: group, source, destination, data; and what it would have answered."""
    messages, answers = [], []
    unit = j1939.ElectronicControlUnit(
        max_cmdt_packets=255, send_message=lambda can_id, extended, data, fd_format=False: answers.append((can_id, bytes(data))))
    try:
        unit.subscribe(lambda priority, pgn, source, timestamp, data: messages.append((pgn, source, bytes(data))), SERVER)
        for can_id, data in frames:
            unit.notify(can_id, data, 0.0)
    finally:
        unit.stop()
    return messages, answers


def test_its_address_claim_is_that_of_a_sprayer(frames):
    claims = {bytes(data) for can_id, data in frames if can_id & 0x3FFFFFF == 0xEEFF00 | CLIENT}
    claim, = claims
    name = j1939.Name(bytes=list(claim))
    assert name.arbitrary_address_capable == 1
    assert (name.industry_group, name.vehicle_system, name.function) == (2, 6, 129)
    assert j1939.MessageId(can_id=0x18EEFF00 | CLIENT).source_address == CLIENT


def objects(pool):
    """The objects of a pool, by their tables: number and what stands behind it."""
    at = 0

    def take(form):
        nonlocal at
        values = struct.unpack_from("<" + form, pool, at)
        at += struct.calcsize("<" + form)
        return values if len(values) > 1 else values[0]

    def text():
        nonlocal at
        length = take("B")
        at += length
        return pool[at - length : at].decode()

    while at < len(pool):
        table, number = take("3sH")
        if table == b"DVC":
            yield table, number, (text(), text(), take("8s"), text(), take("7s"), take("7s"), pool[at + 1 : (at := at + 1 + pool[at])])
        elif table == b"DET":
            kind = take("B")
            yield table, number, (kind, text(), take("H"), take("H"), [take("H") for _ in range(take("H"))])
        elif table == b"DPD":
            head = take("HBB")
            yield table, number, (*head, text(), take("H"))
        elif table == b"DPT":
            head = take("Hi")
            yield table, number, (*head, text(), take("H"))
        elif table == b"DVP":
            head = take("ifB")
            yield table, number, (*head, text())
        else:
            raise AssertionError("no table at byte %d: %r" % (at, table))


def test_its_object_pool_is_carried_whole_and_describes_four_sections(heard, frames):
    messages, answers = heard
    long = [data for pgn, source, data in messages if pgn == PROCESS_DATA and source == CLIENT and len(data) > 8]
    whole, = long
    announced, = {data[1:5] for pgn, source, data in messages if pgn == PROCESS_DATA and data[0] == 0x41}
    assert whole[0] == 0x61 and len(whole) - 1 == struct.unpack("<I", announced)[0]
    found = list(objects(whole[1:]))
    assert len({number for _, number, _ in found}) == len(found)
    device, = [values for table, _, values in found if table == b"DVC"]
    claim = next(bytes(data) for can_id, data in frames if can_id & 0x3FFFFFF == 0xEEFF00 | CLIENT)
    assert device[2] == claim, "the pool names another control function"
    sections = [values for table, _, values in found if table == b"DET" and values[0] == 4]
    assert len(sections) == 4
    ddis = {values[0] for table, _, values in found if table == b"DPD"}
    assert {1, 2, 72, 160, 161, 205, 206, 290} <= ddis
    # It acknowledged the whole message: end of message, the length, the packets.
    size = len(whole)
    end = bytes([19, size & 255, size >> 8, -(-size // 7), 255, 0, PROCESS_DATA >> 8, 0])
    assert end in [data for _, data in answers]


def test_sections_are_told_as_they_were_set(heard, frames):
    """Each word of setpoints (290) is followed by the same word of actual states (161)."""
    messages, _ = heard
    told = [data[4:] for pgn, source, data in messages if pgn == PROCESS_DATA and data[:4] == bytes([0x23, 0, 161, 0])]
    wanted = [bytes(data[4:]) for can_id, data in frames if can_id & 0x3FFFFFF == 0xCB00F7 | CLIENT << 8 and data[:4] == bytes([0x23, 0, 34, 1])]
    assert len(wanted) > 4
    rest = iter(told)
    assert all(word in rest for word in wanted[:-1]), "a state was never told, or out of its order"
