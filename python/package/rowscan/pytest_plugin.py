"""Virtual scanners as pytest fixtures. Installed with the package; nothing has to be imported.

Every test gets scanners of its own, on free ports: nothing of one test is left in the next. Orchards never change and take a moment to
grow, so they are kept for the session. When a test fails, its report has a section for each of its scanners: where it was, what it has
done, and what was said on its wire.
"""

import contextlib

import pytest

import rowscan as _rowscan

#: Lines of a scanner's log in the report of a failed test. `Scanner.log` has all that are kept.
_SHOWN = 60

_scanners = pytest.StashKey()


@pytest.fixture(scope="session")
def rowscan_orchard():
    """Orchards by scene, seed and keys, grown once a session: `rowscan_orchard("spindle", seed=7, trees=3)`."""
    grown = {}

    def orchard(scene="spindle", *, seed=None, optics=None, **keys):
        key = (str(scene), seed, optics, repr(sorted(keys.items())))
        if key not in grown:
            grown[key] = _rowscan.Orchard(scene, seed=seed, optics=optics, **keys)
        return grown[key]

    return orchard


@pytest.fixture
def rowscan(request, rowscan_orchard):
    """Starts scanners: `rowscan("spindle", model="lms111", ...)`, with the keywords of `rowscan.Scanner`. They are stopped after the test."""
    with contextlib.ExitStack() as running:

        def start(scene="spindle", model=None, *, seed=None, optics=None, **keywords):
            if not isinstance(scene, _rowscan.Orchard):
                scene = rowscan_orchard(scene, seed=seed, optics=optics)
            scanner = _rowscan.Scanner(model, scene, **keywords)
            request.node.stash.setdefault(_scanners, []).append(scanner)
            scanner.start()
            running.callback(_stop, scanner)
            return scanner

        yield start


@pytest.fixture
def lms111(rowscan):
    """An LMS111 that drives along the scene `spindle` in real time; `lms111.address` is `HOST:PORT`, CoLa A and B."""
    return rowscan("spindle", "lms111")


@pytest.fixture
def lms291_serial(rowscan):
    """An LMS291 on a pseudo-terminal; `lms291_serial.address` is the path that a client opens as its serial port."""
    return rowscan("spindle", "lms291")


@pytest.fixture
def tractor(rowscan, tmp_path):
    """A tractor with an LMS111, CAN and GNSS on one clock: `tractor.addresses` has `scanner0`, `can0` (a Lawicel adapter's port) and `nmea0`."""
    return rowscan("spindle", "lms111", can="slcan:%s" % (tmp_path / "can"), nmea="tcp:127.0.0.1:0")


@pytest.fixture
def rowscan_check(tmp_path):
    """Tries a scenario: `rowscan_check("row.toml")`. Fails the test with its verdicts unless all passed; gives what `rowscan.check` gives."""

    def check(scenario, **keywords):
        keywords.setdefault("keep", tmp_path)
        tried = _rowscan.check(scenario, **keywords)
        bad = [one for one in tried if one["verdict"] not in ("passed", "skipped")]
        if bad:
            pytest.fail("".join(one["text"] + one["output"] for one in bad), pytrace=False)
        if tried and all(one["verdict"] == "skipped" for one in tried):
            pytest.skip("".join(one["text"] for one in tried))
        return tried

    return check


def _stop(scanner):
    # What it has done is asked before it is gone.
    _last_state[id(scanner)] = _state(scanner)
    scanner.stop()


_last_state = {}


def _state(scanner):
    if not scanner.running:
        return "stopped"
    return "%s\n%s" % (scanner.addresses, scanner.state)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Adds the scanners of a failed test to its report."""
    report = yield
    scanners = item.stash.get(_scanners, [])
    if report.failed:
        for number, scanner in enumerate(scanners):
            state = _state(scanner) if scanner.running else _last_state.get(id(scanner), "stopped")
            log = scanner.log
            left_out = ["… %d lines before" % (len(log) - _SHOWN)] if len(log) > _SHOWN else []
            text = "\n".join([repr(scanner), state, *left_out, *log[-_SHOWN:]])
            report.sections.append(("rowscan scanner %d" % number, text))
    if call.when == "teardown":
        for scanner in scanners:
            _last_state.pop(id(scanner), None)
    return report
