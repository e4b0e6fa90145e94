"""`rowscan check` as other programs read it: JUnit by junitparser and by a schema, and scenarios as pytest tests."""

import os
import pathlib
import shutil
import subprocess
import sys

import junitparser
import pytest
import xmlschema

HERE = pathlib.Path(__file__).parent
SCENARIOS = HERE.parent / "scenarios"


def check(rowscan, folder, *names):
    """JUnit's path and the exit code."""
    junit = folder / "verdicts.xml"
    scenarios = [str(SCENARIOS / name) for name in names]
    code, out, err = rowscan.run("check", *scenarios, "--junit", str(junit), limit_s=80.0)
    assert junit.exists(), out + err
    return junit, code


def test_junitparser_reads_what_passed_failed_and_could_not_be_judged(rowscan, tmp_path):
    junit, code = check(rowscan, tmp_path, "damaged.toml", "quits.toml", "base.toml")
    suites = junitparser.JUnitXml.fromfile(str(junit))
    assert code == 1
    assert [suite.name for suite in suites] == ["damaged [seed 7]", "quits [seed 7]", "base"]
    counts = [(suite.tests, suite.failures, suite.errors, suite.skipped) for suite in suites]
    # What the controller left open when it crashed is not judged.
    assert counts == [(6, 0, 0, 0), (3, 1, 1, 0), (1, 0, 1, 0)]
    assert (suites.tests, suites.failures, suites.errors) == (10, 1, 2)
    properties = {each.name: each.value for each in list(suites)[0].properties()}
    assert properties["seed"] == "7" and properties["clock"] == "lockstep", properties
    failed = [case for suite in suites for case in suite if case.result]
    first = failed[0].result[0]
    assert isinstance(first, junitparser.Failure)
    assert first.message == "exit code of sut: expected 0, found 1" == first.text.splitlines()[0]
    assert isinstance(failed[-1].result[0], junitparser.Error)
    assert all(case.classname in ("damaged", "quits", "base") for suite in suites for case in suite)


def test_junit_keeps_to_the_schema(rowscan, tmp_path):
    schema = xmlschema.XMLSchema(str(HERE / "junit.xsd"))
    junit, _ = check(rowscan, tmp_path, "steady.toml", "quits.toml", "base.toml")
    schema.validate(str(junit))
    # The schema can say no.
    text = junit.read_text()
    for wrong in (text.replace('tests="', 'test="', 1), text.replace("<testcase name=", "<testcase title=", 1),
                  text.replace("2. scans_lost", "1. first_scan within 0.1 s", 1).replace(": 0 [seed 7]", " [seed 7]", 1)):
        assert wrong != text and not schema.is_valid(wrong)


@pytest.mark.parametrize("expected", [0, 1])
def test_scenarios_are_pytest_tests(rowscan, tmp_path, expected):
    folder = tmp_path / "scenarios"
    shutil.copytree(SCENARIOS, folder)
    if expected:
        scenario = folder / "pytest" / "lost.toml"
        scenario.write_text(scenario.read_text().replace('what = "scans_lost", equals = 2', 'what = "scans_lost", equals = 0'))
    junit = tmp_path / "pytest.xml"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--junit-xml", str(junit), str(folder / "pytest")]
    done = subprocess.run(command, stdout=subprocess.PIPE, env=dict(os.environ, PYTHONDONTWRITEBYTECODE="1"), check=False)
    assert done.returncode == expected, done.stdout.decode()
    (suite,) = junitparser.JUnitXml.fromfile(str(junit))
    assert (suite.tests, suite.failures, suite.errors) == (3, expected, 0)
    if expected:
        assert b"scans_lost of left: expected 0, found 2" in done.stdout
