"""The lockstep clock: a controller's log is the same in every run, whatever the host does meanwhile; and a controller that does not answer ends
the run with its name."""

import json
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import pytest
from emulator import binary

HERE = pathlib.Path(__file__).parent
#: Decisions compared.
DECISIONS = 240


class Bench:
    """Two scanners, GNSS, and a controller on all three."""

    def __init__(self, log, *arguments, seed=1, nice=False):
        self.log = log
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
        controller = ["nice", "-n", "19"] if nice else []
        controller += [sys.executable, str(HERE / "lockstep_controller.py"), str(log)]
        for address in self.steps:
            controller += ["--steps", address]
        for address in buses:
            controller += ["--can", address]
        controller += ["gnss=" + gnss[0], "lms1=" + scanners[0], "lms2=" + scanners[1]]
        self.controller = subprocess.Popen(controller)

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


@pytest.mark.parametrize("ack", ["idle", "reply:127.0.0.1:0"])
def test_a_controller_decides_the_same_whatever_the_host_does(tmp_path, busy, ack):
    seen = set()
    for seed in range(1, 11):
        plain = run(tmp_path / "plain", "--ack", ack, seed=seed)
        # Every third is stopped in the middle; the others have to share the processor.
        stop_s = 1.0 if seed % 3 == 0 else None
        disturbed = run(tmp_path / "disturbed", "--ack", ack, seed=seed, stop_s=stop_s, nice=True)
        assert plain == disturbed, "seed %d" % seed
        seen.add(tuple(plain))
    assert len(seen) == 10, "seeds differ"


def said_on_the_bus(folder, ack):
    """What the controller said on the bus, with the simulated times at which it was heard."""
    log = folder / "bus.log"
    log.unlink(missing_ok=True)
    run(folder / "log", "--ack", ack, "--can", "socketcand:127.0.0.1:0", "--can", "candump:%s" % log)
    heard = [line for line in log.read_text().splitlines() if " 123#" in line]
    assert len(heard) > 50
    return heard[:50]


def test_the_loop_is_closed_at_the_same_simulated_times(tmp_path, busy):
    first = said_on_the_bus(tmp_path, "idle")
    for _ in range(5):
        assert said_on_the_bus(tmp_path, "idle") == first


def test_having_read_is_not_having_worked(tmp_path, busy):
    """Level `read` goes on while the controller works: its answers come at other times in each run."""
    first = said_on_the_bus(tmp_path, "read")
    assert any(said_on_the_bus(tmp_path, "read") != first for _ in range(30))


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
    import socket
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
