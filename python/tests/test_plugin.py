"""The pytest plugin, as a test author meets it."""

import time

import pytest

from cola import Client


def test_fixtures_are_there_without_an_import(lms111, lms291_serial):
    assert lms111.model == "lms111" and lms291_serial.model == "lms291"
    with Client(lms111.address) as client:
        assert b"LMS10x_FieldEval" in client.ask(b"sRN DeviceIdent")


def test_start_and_stop_take_little_of_a_test(rowscan, orchard):
    """Wanted under 100 ms; the orchard is the session's."""
    scanner = rowscan(orchard, "lms111")
    took = []
    for _ in range(20):
        scanner.stop()
        began = time.perf_counter()
        scanner.start()
        scanner.stop()
        took.append(time.perf_counter() - began)
    print("start and stop: median %.2f ms, longest %.2f ms" % (1e3 * sorted(took)[10], 1e3 * max(took)))
    assert sorted(took)[10] < 0.1


def test_every_test_has_a_scanner_of_its_own(pytester):
    pytester.makepyfile(
        """
        addresses = []

        def test_one(lms111):
            lms111.fault("stall")
            addresses.append(lms111)

        def test_other(lms111):
            assert lms111.faults == []
            assert lms111 is not addresses[0] and not addresses[0].running
        """
    )
    pytester.runpytest_subprocess().assert_outcomes(passed=2)


def test_a_failure_shows_what_was_said(pytester):
    pytester.makepyfile(
        """
        import socket

        def test_controller(rowscan):
            scanner = rowscan("spindle", model="lms111", seed=3)
            host, port = scanner.address.split(":")
            with socket.create_connection((host, int(port))) as link:
                link.sendall(b"\\x02sRN DeviceIdent\\x03")
                assert link.recv(100) == b"something else"
        """
    )
    result = pytester.runpytest_subprocess()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        ["*- rowscan scanner 0 -*", "<rowscan.Scanner on spindle: *", "*'scanner0'*", "*< .sRN DeviceIdent.", "*> .sRA DeviceIdent*LMS10x_FieldEval*"]
    )


def test_a_test_that_passes_shows_nothing(pytester):
    pytester.makepyfile("def test_it(lms111): assert lms111.running")
    result = pytester.runpytest_subprocess("-rA")
    result.assert_outcomes(passed=1)
    result.stdout.no_fnmatch_line("*rowscan scanner 0*")


@pytest.mark.parametrize("word", ["lms112"])
def test_a_fixture_s_nonsense_is_told(rowscan, word):
    with pytest.raises(ValueError, match="unknown scanner model `lms112`; known are lms"):
        rowscan("spindle", word)
