"""`record` is killed (SIGKILL) fifty times in the middle of its work: what it had been sent a quarter of a second before is in the file, and
the file can be repaired."""

import json
import random
import signal
import socket
import subprocess
import threading
import time

import damaged
from emulator import Emulator, run

#: Times it is killed.
KILLS = 50
#: The most that may be lost.
LOST_S = 0.25


class Relay:
    """A server between the recorder and the scanner, which notes when it sent what."""

    def __init__(self, scanner):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        self.scanner, self.sent, self.total = scanner, [], 0
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        client, _ = self.listener.accept()
        device = socket.create_connection(self.scanner)
        threading.Thread(target=self._copy, args=(client, device), daemon=True).start()
        try:
            while True:
                data = device.recv(65536)
                if not data:
                    return
                client.sendall(data)
                self.total += len(data)
                self.sent.append((time.monotonic(), self.total, data))
        except OSError:
            pass
        finally:
            client.close()
            device.close()

    @staticmethod
    def _copy(client, device):
        try:
            while data := client.recv(65536):
                device.sendall(data)
        except OSError:
            pass

    def sent_by(self, instant):
        """Bytes that were out at an instant."""
        return max((total for at, total, _ in self.sent if at <= instant), default=0)


class Host:
    """How late this machine wakes a thread that sleeps: what it keeps a recorder waiting, it does not lose by a fault of its own."""

    def __init__(self):
        self.worst_s, self.watching = 0.0, True
        threading.Thread(target=self._watch, daemon=True).start()

    def _watch(self):
        while self.watching:
            begun = time.monotonic()
            time.sleep(0.01)
            self.worst_s = max(self.worst_s, time.monotonic() - begun - 0.01)


def from_device(data):
    """The device's bytes in a recording, as far as it goes."""
    found = damaged.Mcap(data)
    assert len(found.stretches) == 1, "no packet is missing inside"
    return found.stretches[0]


def info(path):
    code, told, said = run("record", "--info", str(path), "--format", "json")
    return code, json.loads(told), said


def kill_one(rowscan, scanner, path, after_s):
    """Kills a recorder so long after its scans began; what it had been sent in time, and what is in its file."""
    relay, host = Relay(scanner), Host()
    command = [rowscan.binary(), "record", "tcp://" + relay.address, "-o", str(path), "--decoded", "none"]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        # The answers to its start take a few kilobytes.
        while relay.total < 20000:
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(after_s)
        # Its writer wakes to take the bytes, and again to write them.
        due = relay.sent_by(time.monotonic() - LOST_S - 2 * host.worst_s)
        process.send_signal(signal.SIGKILL)
        assert process.wait(10) == -signal.SIGKILL
    finally:
        host.watching = False
        if process.poll() is None:
            process.kill()
        relay.listener.close()
    return due, b"".join(data for _, _, data in relay.sent)


def test_what_was_sent_a_quarter_of_a_second_before_a_kill_is_kept_and_can_be_repaired(rowscan, tmp_path):
    numbers = random.Random(14)
    emulator = Emulator("--model", "lms111", "--time-scale", "10")
    torn = 0
    try:
        for number in range(KILLS):
            path = tmp_path / ("run%d.mcap" % number)
            due, sent = kill_one(rowscan, emulator.address, path, 0.3 + 0.4 * numbers.random())
            before = path.read_bytes()
            kept = from_device(before)
            assert len(kept) >= due > 0, "number %d" % number
            assert sent.startswith(kept)
            code, told, _ = info(path)
            assert code == 1 and told["torn"]
            scans = told["streams"][0]["scans"]
            assert scans == damaged.cola_b_scans(kept) > 0
            code, _, said = run("record", "--repair", str(path))
            assert code == 0, said
            assert (tmp_path / ("run%d.mcap.orig" % number)).read_bytes() == before
            code, told, _ = info(path)
            assert (code, told["torn"], told["streams"][0]["scans"]) == (0, None, scans)
            assert from_device(path.read_bytes()) == kept
            torn += 1
    finally:
        emulator.close()
    assert torn == KILLS
