"""Programs in a Python of their own."""

import signal
import subprocess
import sys


def start(program):
    """Starts one that heeds SIGINT; what a shell runs in the background ignores it, and hands that on."""
    return subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
