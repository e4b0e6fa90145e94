"""Our own driver on every kind of line, and the start-up sequences of public LMS2xx clients, as captured."""

import json
import os
import pty
import subprocess
import threading
import time
import tty

import pytest

serial = pytest.importorskip("serial")

from lms2xx import Lms2xx, crc, frame  # noqa: E402 (pyserial first)
from test_lms2xx_serial import line  # noqa: E402,F401 (the fixture)

SCANS = "8"


def estimate(rowscan, source, *arguments):
    """`rowscan estimate` on a live source; its JSON."""
    code, out, err = rowscan.run("estimate", source, "--rig", "spindle", "--model", "lms291", "--scans", SCANS,
                                 "--format", "json", *arguments, limit_s=80.0)
    assert code == 0, err
    return json.loads(out), err


def check(result, frequency_hz):
    assert result["scans"] == int(SCANS)
    assert result["scans_lost"] == result["scans_repeated"] == result["telegrams_bad"] == 0
    assert result["points_per_scan"] == 361
    assert abs(result["scan_frequency_nominal_hz"] - frequency_hz) < 0.02
    assert result["impacted_total_area_m2"] > 0


@pytest.mark.parametrize("left", [["--rate", "500000"], ["--start", "streaming"], ["--start", "installation"]])
def test_the_driver_finds_the_rate_on_a_pseudo_terminal(rowscan, line, left):  # noqa: F811
    emulator = line("--time-scale", "4", *left)
    result, err = estimate(rowscan, "serial:%s?baud=38400" % emulator.url)
    assert "connected: LMS291;S05 X01.27, 38400 bits a second" in err
    # Every eighth scan, as recorded on a real LMS200.
    check(result, 75 / 16)


def test_the_driver_reads_rfc2217(rowscan, line):  # noqa: F811
    emulator = line(where=("--rfc2217", "127.0.0.1:0"))
    result, err = estimate(rowscan, emulator.url + "?baud=500000")
    assert "500000 bits a second" in err
    check(result, 37.5)


@pytest.fixture
def cable():
    """Two serial ports with a cable between them: what one sends the other receives."""
    ends = [pty.openpty() for _ in range(2)]
    for _, slave in ends:
        tty.setraw(slave)

    def carry(read, write):
        try:
            while True:
                os.write(write, os.read(read, 4096))
        except OSError:
            pass

    for (a, _), (b, _) in (ends, ends[::-1]):
        threading.Thread(target=carry, args=(a, b), daemon=True).start()
    yield [os.ttyname(slave) for _, slave in ends]
    for end in ends:
        for descriptor in end:
            os.close(descriptor)


def test_the_driver_reads_a_real_port(rowscan, line, cable):  # noqa: F811
    emulator = line("--time-scale", "4", where=("--serial", cable[0]))
    assert emulator.endpoint == "serial"
    result, _ = estimate(rowscan, "serial:%s" % cable[1])
    check(result, 75 / 16)


def test_the_driver_goes_on_after_a_reset_by_someone_else(rowscan, line):  # noqa: F811
    """The device restarts at 9600 in the middle of a stream: the driver finds it again."""
    emulator = line("--time-scale", "4")
    command = [rowscan.binary(), "estimate", "serial:" + emulator.url, "--model", "lms291", "--scans", "150",
               "--rig", "spindle", "--format", "json"]
    driver = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(4.5)
    port = os.open(emulator.url, os.O_RDWR | os.O_NOCTTY) if os.geteuid() == 0 else None
    if port is None:
        driver.kill()
        driver.wait()
        pytest.skip("the driver has the port for itself, and only root gets in beside it")
    os.write(port, frame(b"\x10"))
    os.close(port)
    out, err = driver.communicate(timeout=60)
    # It hears the reset's reply, or, if that was lost, the silence after it.
    assert b"has restarted" in err or b"sent nothing" in err, err
    assert err.count(b"connected: LMS291") == 2, err
    told = json.loads(out)
    assert told["scans"] == 150
    # The row that passed by meanwhile is not known, and may be too much of it.
    unseen = any(warning.startswith("too_much_excluded:") for warning in told["warnings"])
    assert unseen == (told["leaf_area_m2"] is None), told["warnings"]
    assert driver.returncode == int(unseen), err


def test_sources_that_are_none_are_refused(rowscan):
    for source, complaint in [
        ("serial:", "the port is missing"),
        ("serial:/dev/no-such-port", "is the port there"),
        ("serial:/dev/ttyS0?baud=115200", "9600, 19200, 38400 or 500000"),
        ("rfc2217://127.0.0.1:1", "is the port there"),
    ]:
        code, out, err = rowscan.run("estimate", source)
        assert (code, out) == (2, ""), (source, err)
        assert complaint in err, err


#: Command bodies in order, with the host's rate after them where it changes, as each client was captured with the device at 9600 and
#: 38400 wanted.
SEQUENCES = {
    "sicktoolbox": ["20 40", 38400, "20 25", "3A", "31", "74", "20 24", "scan", "20 25", "20 42", 9600, "31"],
    "sicktoolbox variant": ["20 25", "3B B4 00 32 00", "20 24", "scan"],
    "mrpt": ["20 25", "31", "20 40", 38400, "31", "20 00 53 49 43 4B 5F 4C 4D 53", "74", "write", "20 25",
             "3B B4 00 32 00", "20 24", "scan"],
    "player": ["20 25", "20 40", 38400, "3A", "20 00 53 49 43 4B 5F 4C 4D 53", "31", "3B B4 00 32 00", "74", "short",
               "20 27 01 00 B5 00", "part"],
}


@pytest.mark.parametrize("client", sorted(SEQUENCES))
def test_public_clients_start_up(line, client):  # noqa: F811
    emulator = line("--time-scale", "4", model="lms200")
    with Lms2xx(emulator.url) as lms:
        block = None
        for step in SEQUENCES[client]:
            if isinstance(step, int):
                time.sleep(0.25)
                lms.port.baudrate = step
            elif step == "scan":
                assert len(lms.scan()) == 361
            elif step == "part":
                body = lms.read_frame()
                assert body[:5] == b"\xb7\x01\x00\xb5\x00" and len(body) == 1 + 4 + 2 + 2 * 181 + 1
            else:
                if step == "write":
                    block = bytes(block[:5]) + b"\x06\x01" + bytes(block[7:])
                    body = b"\x77" + block
                elif step == "short":
                    body = b"\x77" + bytes(block[:7])
                else:
                    body = bytes.fromhex(step)
                lms.port.write(frame(body))
                # MRPT takes nothing else for an answer than this byte, within 65 ms; others look past it.
                while lms.port.read(1) != b"\x06":
                    assert client != "mrpt", step
                reply = lms.read_frame()
                while reply[0] in (0xB0, 0xB7):
                    reply = lms.read_frame()
                assert reply[0] == body[0] | 0x80 and reply[-1] == 0x10, (step, reply.hex())
                if body[0] in (0x20,):
                    assert reply[1] == 0, (step, reply.hex())
                if body[0] in (0x3B, 0x77):
                    assert reply[1] == 1, (step, reply.hex())
                if body[0] == 0x31:
                    assert len(reply) == 154 and crc(b"") == 0
                if body[0] == 0x74:
                    block = bytearray(reply[1:35])
