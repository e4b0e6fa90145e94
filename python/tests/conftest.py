"""What the tests of the package share: the command line to compare with."""

import json
import os
import subprocess

import pytest

pytest_plugins = ["pytester"]

#: Seconds a command may take.
LIMIT_S = 90


class CommandLine:
    """The program of the same version, for numbers and words that must be the same."""

    def __init__(self, path):
        self.path = path

    def run(self, *arguments):
        return subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True, timeout=LIMIT_S)

    def json(self, *arguments):
        done = self.run(*arguments, "--format", "json")
        assert done.returncode in (0, 1), done.stderr
        return json.loads(done.stdout)

    def complaint(self, *arguments):
        """What it says when it cannot."""
        done = self.run(*arguments)
        assert done.returncode == 2, done
        return done.stderr.strip().splitlines()[-1].removeprefix("rowscan: ")


@pytest.fixture(scope="session")
def command_line():
    """Skips where no binary was given; `cargo xtask ci` gives it."""
    path = os.environ.get("ROWSCAN_BIN")
    if not path:
        pytest.skip("ROWSCAN_BIN is not set; `cargo xtask ci` sets it")
    return CommandLine(path)


@pytest.fixture(scope="session")
def orchard(rowscan_orchard):
    return rowscan_orchard("spindle", seed=7)
