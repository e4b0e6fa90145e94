"""Scenarios as pytest tests: each .toml here is run by `rowscan check`, each of its expectations is a test.

    ROWSCAN_BIN=target/release/rowscan pytest tools/scenarios/pytest --junit-xml verdicts.xml
"""

import json
import os
import subprocess

import pytest


def pytest_collect_file(parent, file_path):
    return Scenario.from_parent(parent, path=file_path) if file_path.suffix == ".toml" else None


class Scenario(pytest.File):
    def collect(self):
        command = [os.environ.get("ROWSCAN_BIN", "rowscan"), "check", str(self.path), "--format", "jsonl"]
        lines = subprocess.run(command, stdout=subprocess.PIPE, check=False).stdout.splitlines()
        for verdict in (line for line in map(json.loads, lines) if line["kind"] == "verdict"):
            yield Expectation.from_parent(self, name=verdict["name"], verdict=verdict)


class Expectation(pytest.Item):
    def __init__(self, verdict, **of):
        super().__init__(**of)
        self.verdict = verdict

    def runtest(self):
        if self.verdict["verdict"] == "skipped":
            pytest.skip(self.verdict["message"])
        last = "\n".join([self.verdict["message"], *self.verdict["last_events"], "again: " + self.verdict["rerun"]])
        assert self.verdict["verdict"] == "passed", last

    def reportinfo(self):
        return self.path, None, self.name
