"""The binary under test: `rowscan` from the environment variable ROWSCAN_BIN."""

import json
import os
import queue
import signal
import subprocess
import threading


def binary():
    """Path of the binary, or None."""
    return os.environ.get("ROWSCAN_BIN")


class Emulator:
    """`rowscan emulate`, or another command that listens, on a free loopback port."""

    def __init__(self, *arguments, command="emulate", start_s=60.0):
        command = [binary(), command, "--tcp", "127.0.0.1:0", "--format", "jsonl", *arguments]
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
        self.lines = queue.Queue()
        threading.Thread(target=self._read, daemon=True).start()
        self.endpoints = {}
        self.address = self._listening(start_s)

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(line)
        self.lines.put(None)

    def _listening(self, start_s):
        while True:
            line = self.lines.get(timeout=start_s)
            assert line is not None, "rowscan emulate ended with %s" % self.process.wait()
            event = json.loads(line)
            if event.get("event") == "listening":
                self.endpoints.setdefault(event.get("endpoint"), event)
            if event.get("event") == "listening" and event.get("endpoint") == "tcp":
                host, port = event["address"].rsplit(":", 1)
                return host, int(port)

    def endpoint(self, name, limit_s=60.0):
        """The event that tells where it listens under this name, once it has come."""
        while name not in self.endpoints:
            line = self.lines.get(timeout=limit_s)
            assert line is not None, "rowscan ended with %s" % self.process.wait()
            event = json.loads(line)
            if event.get("event") == "listening":
                self.endpoints.setdefault(event.get("endpoint"), event)
        return self.endpoints[name]

    def interrupt(self, limit_s=10.0):
        """SIGINT; returns the exit code."""
        self.process.send_signal(signal.SIGINT)
        return self.process.wait(timeout=limit_s)

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()


def run(*arguments, limit_s=30.0):
    """Runs the binary to its end; returns exit code, stdout, stderr."""
    done = subprocess.run([binary(), *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, timeout=limit_s, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()
