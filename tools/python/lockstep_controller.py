"""A controller as its author would write it: event-driven, one decision a telegram, in the order it hears them.

    lockstep_controller.py LOG [--steps HOST:PORT] [--can HOST:PORT] NAME=HOST:PORT …

Names that begin with `lms` are CoLa A scanners; anything else sends lines. With a bus (socketcand) a second thread works on
each scan and says there what came of it.
"""

import pathlib
import queue
import select
import socket
import sys
import threading
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "ack"))
from ack import Steps  # noqa: E402


class Stream:
    def __init__(self, name, address):
        host, port = address.rsplit(":", 1)
        self.name, self.buffer = name, b""
        self.socket = socket.create_connection((host, int(port)))
        self.end = b"\x03" if name.startswith("lms") else b"\n"

    def fileno(self):
        return self.socket.fileno()

    def messages(self, flags=0):
        """What one read gives; None at the end."""
        data = self.socket.recv(65536, flags)
        if not data:
            return None
        *whole, self.buffer = (self.buffer + data).split(self.end)
        return whole


class Bus:
    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for request in (b"< open can0 >", b"< rawmode >"):
            self.socket.recv(64)
            self.socket.sendall(request)
        self.socket.recv(64)
        self.work = queue.SimpleQueue()
        threading.Thread(target=self._work, daemon=True).start()

    def fileno(self):
        return self.socket.fileno()

    def messages(self):
        """What others say there is of no interest here, and has to be read."""
        return [] if self.socket.recv(65536) else None

    def say(self, message):
        self.work.put(message)

    def _work(self):
        while True:
            message = self.work.get()
            # It takes its time.
            sum(zlib.crc32(message) for _ in range(2000))
            self._tell(message)

    def _tell(self, message):
        self.socket.sendall(b"< send 123 4 %s >" % b" ".join(b"%02x" % byte for byte in zlib.crc32(message).to_bytes(4, "big")))


def decide(log, stream, messages, bus=None):
    for message in messages:
        words = message.strip(b"\x02\r").split(b" ")
        if stream.end == b"\x03" and (len(words) < 2 or words[1] != b"LMDscandata" or len(words) < 30):
            continue
        log.write("%s %d %08x\n" % (stream.name, len(words), zlib.crc32(message)))
        if bus is not None and stream.name == "lms1":
            bus.say(message)


def by_event(log, streams, bus=None):
    while True:
        for stream in select.select(streams + [bus] * (bus is not None), [], [])[0]:
            messages = stream.messages()
            if messages is None:
                return
            if stream is not bus:
                decide(log, stream, messages, bus)


def by_step(log, streams, steps):
    for number, _ in steps:
        for stream in streams:
            try:
                decide(log, stream, stream.messages(socket.MSG_DONTWAIT) or [])
            except BlockingIOError:
                pass
        steps.acknowledge(number)


def main(log, *arguments):
    steps = None
    if arguments[0] == "--steps":
        steps, arguments = Steps(arguments[1]), arguments[2:]
    bus = None
    if arguments[0] == "--can":
        bus, arguments = Bus(arguments[1]), arguments[2:]
    streams = [Stream(*argument.split("=")) for argument in arguments]
    for stream in streams:
        if stream.end == b"\x03":
            stream.socket.sendall(b"\x02sEN LMDscandata 1\x03")
    with open(log, "w", buffering=1) as file:
        by_step(file, streams, steps) if steps else by_event(file, streams, bus)


if __name__ == "__main__":
    main(*sys.argv[1:])
