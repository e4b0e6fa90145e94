"""Clients that send junk, half telegrams or nothing, and what the others notice: nothing."""

import random
import socket
import struct

import pytest

from cola import encode
from lms_client import Client


def junk(connection):
    connection.sendall(random.Random(7).randbytes(1 << 16) if hasattr(random.Random, "randbytes") else b"\x02\xff" * 32768)


def huge_length(connection):
    connection.sendall(b"\x02\x02\x02\x02\xff\xff\xff\xff" + b"sRN " * 4096)


def endless_text(connection):
    connection.sendall(b"\x02" + b"A" * (1 << 20))


def half_a_frame(connection):
    connection.sendall(encode("B", b"sRN DeviceIdent")[:9])
    connection.shutdown(socket.SHUT_WR)


def reset(connection):
    connection.sendall(encode("A", b"sEN LMDscandata 1"))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()


def never_reads(connection):
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.sendall(encode("B", b"sEN LMDscandata \x01"))


@pytest.mark.parametrize("attack", [junk, huge_length, endless_text, half_a_frame, reset, never_reads])
def test_a_hostile_client_disturbs_nobody(emulator, connect, attack):
    good = connect("B")
    good.subscribe()
    before = good.scans(10)
    hostile = [socket.create_connection(emulator.address, timeout=5) for _ in range(8)]
    try:
        for connection in hostile:
            try:
                attack(connection)
            except OSError:
                pass  # The scanner may close on a client like this.
        scans = before + good.scans(300)
        counters = [scan.scan_counter for scan in scans]
        assert all((b - a) % 2**16 == 1 for a, b in zip(counters, counters[1:]))
        assert good.exchange(b"sRN ODoprh").startswith(b"sRA ODoprh ")
        with Client(emulator.address, "A") as late:
            assert late.exchange(b"sRN DeviceIdent").startswith(b"sRA DeviceIdent ")
    finally:
        for connection in hostile:
            connection.close()
    assert emulator.interrupt() == 0


def test_a_wrong_checksum_is_not_answered_and_the_next_frame_is(connect):
    client = connect("B")
    frame = bytearray(encode("B", b"sRN DeviceIdent"))
    frame[-1] ^= 1
    client.socket.sendall(bytes(frame) + encode("B", b"sRN ODpwrc"))
    assert client.receive().startswith(b"sRA ODpwrc ")


@pytest.mark.parametrize("dialect", ["A", "B"])
def test_frames_may_come_in_any_pieces_with_stray_bytes_between(connect, dialect):
    client = connect(dialect)
    first, second = encode(dialect, b"sRN ODpwrc"), encode(dialect, b"sRN ODoprh")
    for byte in first + b"\x00":  # MRPT sends a NUL after each telegram.
        client.socket.sendall(bytes([byte]))
    client.socket.sendall(second + b"\x00" + first)
    replies = [client.receive()[:len(b"sRA ODxxxx ")] for _ in range(3)]
    assert replies == [b"sRA ODpwrc ", b"sRA ODoprh ", b"sRA ODpwrc "]
