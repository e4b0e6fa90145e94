"""Scenarios from Python: the verdicts of `rowscan check`."""

import pathlib
import signal
import sys
import time

import pytest

import children
import rowscan

#: A controller that reads scans until it is told to end, or only so many of them.
CONTROLLER = """
import signal, socket, sys

signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
host, port = sys.argv[1].split(":")
most = int(sys.argv[2]) if len(sys.argv) > 2 else None
link = socket.create_connection((host, int(port)))
print("connected", flush=True)
link.sendall(b"\\x02sEN LMDscandata 1\\x03")
scans = 0
while most is None or scans < most:
    heard = link.recv(65536)
    if not heard:
        break
    scans += heard.count(b"sSN LMDscandata")
sys.exit(0 if most is None else 3)
"""

SCENARIO = """
version = 1
scene = "spindle"
seed = 7
clock = { mode = "lockstep", ack = { sut = "read" } }
end = { row_m = 0.5 }
[[device]]
id = "left"
model = "lms111"
[[run]]
id = "sut"
command = ["%s", "{scenario}/controller.py", "{left.tcp}"%s]
ready = { line = "connected" }
[[expect]]
what = "scans_lost"
equals = 0
[[expect]]
what = "exit_code"
"""


@pytest.fixture
def scenario(tmp_path):
    def write(more=""):
        (tmp_path / "controller.py").write_text(CONTROLLER)
        path = tmp_path / "row.toml"
        path.write_text(SCENARIO % (sys.executable, more))
        return path

    return write


def test_a_controller_that_does_well_passes(scenario):
    (tried,) = rowscan.check(scenario())
    assert tried["verdict"] == "passed", tried["text"]
    assert tried["seed"] == 7 and tried["name"] == "row"
    assert [case["verdict"] for case in tried["cases"]] == ["passed", "passed"]
    assert tried["simulated_s"] > 0.4 and any("first scan" in str(event) or "first_scan" in str(event) for event in tried["events"])


def test_verdicts_are_the_command_line_s(scenario, command_line):
    path = scenario(', "3"')
    (tried,) = rowscan.check(path)
    # It has crashed: what it left open is not judged, and its exit code has failed.
    assert tried["verdict"] == "failed"
    done = command_line.run("check", path)
    assert done.returncode == 1
    verdicts = [line.split()[:2] for line in done.stdout.splitlines() if line.startswith(("  passed", "  FAILED"))]
    ours = [line.split()[:2] for line in tried["text"].splitlines() if line.startswith(("  passed", "  FAILED"))]
    assert verdicts == ours and any(verdict == "FAILED" for verdict, _ in ours)
    failed = [case for case in tried["cases"] if case["verdict"] == "failed"]
    assert "exit_code" in failed[0]["name"] and failed[0]["rerun"] == "rowscan check %s --seed 7" % path


def test_an_old_roof_of_its_scene_is_warned_of_once(scenario, tmp_path):
    path = scenario()
    scene = "version = 1\n[orchard]\ntrees = 1\n[orchard.tree]\niterations = 5\n[[rig.scanner]]\nroof = 'forward'\n"
    (tmp_path / "old.toml").write_text(scene)
    path.write_text(path.read_text().replace('"spindle"', '"old.toml"').replace("seed = 7", "repeat = { seeds = 2 }"))
    with pytest.warns(UserWarning, match="version 2 calls") as told:
        assert [tried["verdict"] for tried in rowscan.check(path)] == ["passed", "passed"]
    assert len([one for one in told if "version 2 calls" in str(one.message)]) == 1


def test_what_is_not_sound_is_an_error_and_no_verdict(tmp_path):
    broken = tmp_path / "broken.toml"
    broken.write_text("version = 1\nscene = 'spindle'\nclok = {}\n")
    (tried,) = rowscan.check([broken])
    assert tried["verdict"] == "error" and "clok" in tried["text"] and "clock" in tried["text"]


def test_the_fixture_fails_a_test_with_the_verdicts(pytester, scenario):
    good = scenario()
    bad = good.with_name("bad.toml")
    bad.write_text(SCENARIO % (sys.executable, ', "3"'))
    pytester.makepyfile(
        """
        def test_good(rowscan_check):
            assert rowscan_check(%r)[0]["seed"] == 7

        def test_bad(rowscan_check):
            rowscan_check(%r)
        """
        % (str(good), str(bad))
    )
    result = pytester.runpytest_subprocess()
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["  FAILED  2. exit_code *found 3", "*again: rowscan check *bad.toml --seed 7"])


def test_an_interrupt_ends_the_children(scenario, tmp_path):
    path = scenario()
    path.write_text(path.read_text().replace("row_m = 0.5", "s = 600").replace("lockstep", "paced").replace(', ack = { sut = "read" }', ""))
    script = "import rowscan\ntry:\n    rowscan.check(%r, keep=%r)\nexcept KeyboardInterrupt:\n    print('interrupted')\n" % (str(path), str(tmp_path / "runs"))
    child = children.start(script)
    log = lambda: any("connected" in found.read_text() for found in (tmp_path / "runs").rglob("sut.log"))
    until = time.monotonic() + 60
    while not log() and time.monotonic() < until:
        time.sleep(0.05)
    assert log(), "the controller never started"
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=30)[0].strip() == "interrupted"
    own = str(path.with_name("controller.py")).encode()
    until = time.monotonic() + 10
    while any(own in command for command in commands()) and time.monotonic() < until:
        time.sleep(0.05)
    assert not any(own in command for command in commands())


def commands():
    """The command lines of all processes."""
    for entry in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            yield entry.read_bytes()
        except OSError:
            pass
