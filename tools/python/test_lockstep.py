"""The lockstep clock: a controller's log is the same in every run, whatever the host does meanwhile; and a controller that does not answer ends
the run with its name."""

import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request

import pytest
from emulator import binary

HERE = pathlib.Path(__file__).parent
#: Decisions compared.
DECISIONS = 240
#: Seeds tried: a few here, twenty in `cargo xtask full`.
SEEDS = range(1, 1 + int(os.environ.get("ROWSCAN_LOCKSTEP_SEEDS", "3")))


class Bench:
    """Two scanners, GNSS, and a controller on all three."""

    def __init__(self, log, *arguments, seed=1, nice=False, reader=None, real_time=False):
        self.log = log
        if real_time:
            # Time is granted as it passes on the wall: a step every 20 ms.
            arguments += ("--ack", "clock", "--control", "127.0.0.1:0")
        command = [binary(), "emulate", "spindle", "--scanner", "0", "--scanner", "0", "--tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0",
                   "--nmea", "tcp:127.0.0.1:0", "--format", "jsonl", "--seed", str(seed), "--clock", "lockstep", *arguments]
        self.rowscan = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        endpoints = []
        for line in self.rowscan.stdout:
            event = json.loads(line)
            if event["event"] == "ready":
                break
            endpoints.append((event["endpoint"], event.get("address")))
        self.steps = [address for name, address in endpoints if name == "ack"]
        scanners = [address for name, address in endpoints if name == "tcp"]
        buses = [address for name, address in endpoints if name == "socketcand"]
        gnss = [address for name, address in endpoints if name == "nmea"]
        outputs = [address for name, address in endpoints if name == "output"]
        controller = ["nice", "-n", "19"] if nice else []
        streams = ["gnss=" + gnss[0], "lms1=" + scanners[0], "lms2=" + scanners[1]]
        if reader is None:
            controller += [sys.executable, str(HERE / "lockstep_controller.py"), str(log)]
            for address in self.steps:
                controller += ["--steps", address]
            for address in buses:
                controller += ["--can", address]
            controller += streams
        else:
            streams = ["out=" + address for address in outputs] + streams
            controller += [str(reader), str(log)] + [stream.replace("127.0.0.1:", "") for stream in streams]
        self.controller = subprocess.Popen(controller)
        for address in [address for name, address in endpoints if name == "control"]:
            threading.Thread(target=self._grant, args=("http://%s/step" % address,), daemon=True).start()

    @staticmethod
    def _grant(url):
        due = time.monotonic()
        try:
            while True:
                urllib.request.urlopen(url, data=b'{"n": 1}', timeout=60).read()
                due += 0.02
                time.sleep(max(0.0, due - time.monotonic()))
        except OSError:
            pass  # The run is over.

    def decisions(self):
        return self.log.read_text().splitlines()[:DECISIONS] if self.log.exists() else []

    def until(self, decisions, limit_s=60.0):
        end = time.monotonic() + limit_s
        while len(self.decisions()) < decisions:
            assert self.rowscan.poll() is None, self.rowscan.stderr.read()
            assert time.monotonic() < end, "%d decisions" % len(self.decisions())
            time.sleep(0.005)

    def close(self):
        self.controller.kill()
        self.controller.wait()
        self.rowscan.terminate()
        self.rowscan.communicate()


def run(log, *arguments, stop_s=None, **options):
    """What the controller decided."""
    log.unlink(missing_ok=True)
    bench = Bench(log, *arguments, **options)
    try:
        if stop_s is not None:
            bench.until(DECISIONS // 3)
            bench.controller.send_signal(signal.SIGSTOP)
            time.sleep(stop_s)
            bench.controller.send_signal(signal.SIGCONT)
        bench.until(DECISIONS)
        return bench.decisions()
    finally:
        bench.close()


@pytest.fixture(name="busy")
def _busy():
    """A program that takes all the processor it gets, as nicely as it can."""
    busy = subprocess.Popen(["nice", "-n", "19", sys.executable, "-c", "while True: pass"])
    yield
    busy.kill()
    busy.wait()


@pytest.fixture(name="reader", scope="module")
def _reader(tmp_path_factory):
    """The compiled reader."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    program = tmp_path_factory.mktemp("reader") / "reader"
    subprocess.run([compiler, "-O2", "-Wall", "-Werror", "-o", program, HERE / "lockstep_reader.c"], check=True)
    return program


def decides_the_same(folder, *arguments, seed, **options):
    """Three runs: undisturbed, stopped for 3 s in the middle (nicely, beside a program that takes what it gets), and at the pace of the wall."""
    plain = run(folder / "plain", *arguments, seed=seed, **options)
    assert run(folder / "stopped", *arguments, seed=seed, stop_s=3.0, nice=True, **options) == plain
    assert run(folder / "paced", *arguments, seed=seed, real_time=True, **options) == plain


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("ack", ["idle", "reply:127.0.0.1:0"])
def test_a_controller_decides_the_same_whatever_the_host_does(tmp_path, busy, ack, seed):
    decides_the_same(tmp_path, "--ack", ack, seed=seed)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_compiled_reader_decides_the_same_whatever_the_host_does(tmp_path, busy, reader, seed):
    decides_the_same(tmp_path, "--ack", "idle", seed=seed, reader=reader)


def test_outputs_acknowledge(tmp_path, busy, reader):
    """A line a scan: with `idle` beside it, for the other streams."""
    decides_the_same(tmp_path, "--ack", "idle", "--ack", "output:tcp:127.0.0.1:0", seed=1, reader=reader)


@pytest.mark.parametrize("ack, first", [("reply:127.0.0.1:0", b"STEP 1 "), ("output:tcp:127.0.0.1:0", b"")])
def test_a_participant_that_comes_last_sets_time_going(ack, first):
    rowscan = subprocess.Popen([binary(), "emulate", "spindle", "--tcp", "127.0.0.1:0", "--clock", "lockstep", "--ack", ack, "--format", "jsonl"],
                               stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        events = [json.loads(rowscan.stdout.readline()) for _ in range(3)]
        addresses = {event["endpoint"]: event["address"].rsplit(":", 1) for event in events if event["event"] == "listening"}
        scanner = addresses.pop("tcp")
        (participant,) = addresses.values()
        with socket.create_connection(scanner) as client:
            client.settimeout(20)
            client.sendall(b"\x02sEN LMDscandata 1\x03")
            received = client.recv(4096)
            # Time stands by now, and nothing but the participant is waited for.
            time.sleep(0.3)
            with socket.create_connection(participant) as steps:
                steps.settimeout(20)
                assert steps.recv(100).startswith(first) if first else True
                while b"sSN LMDscandata" not in received:
                    received += client.recv(4096)
    finally:
        rowscan.terminate()
        rowscan.wait()


def queues(port):
    """Bytes that wait to be sent from this port, and bytes sent there that its peers have not read."""
    rows = [line.split() for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:]]
    ends = [(row[1].rsplit(":", 1)[1], row[2].rsplit(":", 1)[1], row[4].split(":")) for row in rows if row[3] == "01"]
    sending = sum(int(queue[0], 16) for here, _, queue in ends if int(here, 16) == port)
    unread = sum(int(queue[1], 16) for _, there, queue in ends if int(there, 16) == port)
    return sending, unread


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc/net/tcp")
def test_time_without_a_pace_runs_ahead_by_64_kib_two_telegrams_and_what_the_client_buffers():
    rowscan = subprocess.Popen([binary(), "emulate", "spindle", "--tcp", "127.0.0.1:0", "--time-scale", "max", "--control", "127.0.0.1:0",
                                "--format", "jsonl"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        events = [json.loads(rowscan.stdout.readline()) for _ in range(3)]
        port = int(events[0]["address"].rsplit(":", 1)[1])

        def scans():
            with urllib.request.urlopen("http://%s/state" % events[1]["address"], timeout=60) as answer:
                return json.load(answer)["streams"]["scanner0"]["scans_sent"]

        with socket.create_connection(("127.0.0.1", port)) as client:
            client.sendall(b"\x02sEN LMDscandata 1\x03")
            buffer = b""
            while buffer.count(b"\x03") < 4:
                buffer += client.recv(65536)
            # From here on it reads nothing. Time stands once nothing more can be handed over.
            before = -1
            while scans() != before:
                before = scans()
                time.sleep(0.3)
            sending, unread = queues(port)
            assert 0 < sending <= 64 * 1024, sending
            # Handed over, and neither read nor in a buffer of the system: two in the queue, one that is being written.
            order = urllib.request.Request("http://%s/clock" % events[1]["address"], data=b'{"paused": true}')
            urllib.request.urlopen(order, timeout=60).read()
            received = buffer
            while received.count(b"\x03") < before + 1:
                received += client.recv(65536)
            telegrams = [len(telegram) + 1 for telegram in received.split(b"\x03")[:before + 1]]
            waiting = sum(telegrams) - len(buffer) - sending - unread
            assert waiting <= 3 * max(telegrams), (waiting, max(telegrams), before)
    finally:
        rowscan.terminate()
        rowscan.wait()


def test_seeds_differ(tmp_path, reader):
    assert run(tmp_path / "one", seed=1, reader=reader) != run(tmp_path / "two", seed=2, reader=reader)


def test_an_output_that_does_not_come_ends_the_run(tmp_path, reader):
    """Two a step are expected, and one comes."""
    bench = Bench(tmp_path / "log", "--ack", "output:tcp:127.0.0.1:0,count=2", "--deadline-wall-s", "0.5", reader=reader)
    told = bench.rowscan.communicate(timeout=60)[1]
    bench.close()
    assert bench.rowscan.returncode == 2
    assert "expected 2 lines at" in told and ", 1 came" in told, told


def test_a_bus_acknowledges(tmp_path):
    """A frame a scan of one scanner acknowledges; of an identifier that nobody sends, the run ends with the first step."""
    can = ["--can", "socketcand:127.0.0.1:0"]
    assert run(tmp_path / "log", "--ack", "output:can0,id=123", *can)
    bench = Bench(tmp_path / "log", "--ack", "output:can0,id=124", "--deadline-wall-s", "0.5", *can)
    told = bench.rowscan.communicate(timeout=60)[1]
    bench.close()
    assert bench.rowscan.returncode == 2 and "expected 1 frames 0x124 on can0, 0 came" in told, told


def said_on_the_bus(folder, ack, at_least=50):
    """What the controller said on the bus, with the simulated times at which it was heard."""
    log = folder / "bus.log"
    log.unlink(missing_ok=True)
    run(folder / "log", "--ack", ack, "--can", "socketcand:127.0.0.1:0", "--can", "candump:%s" % log)
    heard = [line for line in log.read_text().splitlines() if " 123#" in line]
    assert len(heard) > at_least
    return heard[:50]


def test_the_loop_is_closed_at_the_same_simulated_times(tmp_path, busy):
    first = said_on_the_bus(tmp_path, "idle")
    for _ in range(5):
        assert said_on_the_bus(tmp_path, "idle") == first


def test_having_read_is_not_having_worked(tmp_path, busy):
    """Level `read` goes on while the controller works: its answers come at other times in each run, and some after the end."""
    first = said_on_the_bus(tmp_path, "read", at_least=1)
    assert any(said_on_the_bus(tmp_path, "read", at_least=1) != first for _ in range(30))


def test_a_stopped_controller_ends_the_run_with_its_name(tmp_path):
    bench = Bench(tmp_path / "log", "--deadline-wall-s", "0.5")
    bench.until(20)
    bench.controller.send_signal(signal.SIGSTOP)
    told = bench.rowscan.communicate(timeout=60)[1]
    bench.close()
    assert bench.rowscan.returncode == 2
    assert "was not acknowledged within 500ms" in told and "process %d" % bench.controller.pid in told, told


def test_a_wrong_acknowledgement_ends_the_run(tmp_path):
    bench = Bench(tmp_path / "log", "--ack", "reply:127.0.0.1:0", "--deadline-wall-s", "0.5")
    bench.until(20)
    host, port = bench.steps[0].rsplit(":", 1)
    with socket.create_connection((host, int(port))) as other:
        other.sendall(b"ACK 999999999\n")
        told = bench.rowscan.communicate(timeout=60)[1]
    bench.close()
    assert bench.rowscan.returncode == 2
    assert "said `ACK 999999999`" in told, told


def test_the_client_in_c_acknowledges(tmp_path):
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    main = tmp_path / "main.c"
    main.write_text("""
        #include <stdio.h>
        #include <stdlib.h>
        int ack_connect(unsigned short), ack_wait(int, unsigned long long *, unsigned long long *), ack_send(int, unsigned long long);
        int main(int n, char **words) {
            unsigned long long number, time_ns;
            int steps = ack_connect((unsigned short)atoi(words[n - 1]));
            while (ack_wait(steps, &number, &time_ns) == 0) {
                printf("%llu %llu\\n", number, time_ns);
                fflush(stdout);
                if (ack_send(steps, number)) return 1;
            }
        }""")
    program = tmp_path / "steps"
    subprocess.run([compiler, "-Wall", "-Werror", "-o", program, main, HERE.parent / "ack" / "ack.c"], check=True)
    bench = Bench(tmp_path / "log", "--ack", "reply:127.0.0.1:0")
    # The other participant's steps go on, whichever acknowledges first.
    port = bench.steps[0].rsplit(":", 1)[1]
    steps = subprocess.Popen([program, port], stdout=subprocess.PIPE, text=True)
    heard = [tuple(map(int, steps.stdout.readline().split())) for _ in range(50)]
    bench.until(DECISIONS)
    steps.kill()
    steps.wait()
    bench.close()
    numbers = [number for number, _ in heard]
    assert numbers == list(range(numbers[0], numbers[0] + 50))
    assert {later - earlier for (_, earlier), (_, later) in zip(heard, heard[1:])} == {20_000_000}
