"""The emulator for every test."""

import contextlib
import os

import pytest

import emulator as emulator_module
from lms_client import Client


@pytest.fixture
def rowscan():
    """The binary's runner; skips where no binary was given."""
    path = emulator_module.binary()
    if not path:
        pytest.skip("ROWSCAN_BIN is not set; `cargo xtask ci` sets it")
    assert os.access(path, os.X_OK), "ROWSCAN_BIN=%s is no program" % path
    return emulator_module


@pytest.fixture
def emulator(rowscan):
    """An LMS111 on the built-in scene, ten times as fast as the real one."""
    started = rowscan.Emulator("--model", "lms111", "--time-scale", "10")
    yield started
    started.close()


@pytest.fixture
def connect(emulator):
    """Opens connections to the emulator and closes them at the end."""
    with contextlib.ExitStack() as stack:
        yield lambda dialect: stack.enter_context(Client(emulator.address, dialect))
