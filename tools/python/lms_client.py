"""A client of SICK LMS scanners over plain sockets, in either dialect.

Written from the telegram listing alone. It sends what it is told and checks the form of whatever comes back; what a reply
should say is the tests' business.
"""

import collections
import socket
import time

from cola import Splitter, encode
from scandata import decode

SCAN_EVENT = b"sSN LMDscandata "
SCAN_REPLY = b"sRA LMDscandata "

#: Level 3, authorised client; the hash of the password "client".
LOGIN = {
    "A": b"sMN SetAccessMode 03 F4724744",
    "B": b"sMN SetAccessMode \x03\xf4\x72\x47\x44",
}
SUBSCRIBE = {"A": b"sEN LMDscandata 1", "B": b"sEN LMDscandata \x01"}
UNSUBSCRIBE = {"A": b"sEN LMDscandata 0", "B": b"sEN LMDscandata \x00"}


class Client:
    """One connection in one dialect ("A" or "B")."""

    def __init__(self, address, dialect, patience_s=5.0):
        self.socket = socket.create_connection(address, timeout=patience_s)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.patience_s = patience_s
        self.dialect = dialect
        self.splitter = Splitter(dialect)
        self.events = collections.deque()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def switch(self, dialect):
        """Goes on in the other dialect, as after `sWN EIHstCola`."""
        self.dialect = dialect
        self.splitter = Splitter(dialect)

    def send(self, payload):
        self.socket.sendall(encode(self.dialect, payload))

    def receive(self, patience_s=None):
        """The next payload, whatever it is."""
        end = time.monotonic() + (self.patience_s if patience_s is None else patience_s)
        while True:
            payload = self.splitter.next_payload()
            if payload is not None:
                return payload
            left = end - time.monotonic()
            if left <= 0:
                raise socket.timeout("no telegram; %r is left over" % bytes(self.splitter.buffer[:40]))
            self.socket.settimeout(left)
            data = self.socket.recv(65536)
            if not data:
                raise ConnectionError("the scanner closed the connection")
            self.splitter.push(data)

    def exchange(self, payload):
        """Sends a command and returns its reply; events that come between are kept for `scans`."""
        self.send(payload)
        while True:
            reply = self.receive()
            if not reply.startswith(b"sSN "):
                return reply
            self.events.append(reply)

    def login(self):
        return self.exchange(LOGIN[self.dialect])

    def subscribe(self):
        return self.exchange(SUBSCRIBE[self.dialect])

    def unsubscribe(self):
        return self.exchange(UNSUBSCRIBE[self.dialect])

    def wait_for_status(self, status, limit_s=30.0):
        """Asks STlms until it says `status` (7 = measuring); returns the last reply."""
        end = time.monotonic() + limit_s
        while True:
            reply = self.exchange(b"sRN STlms")
            if stlms_status(self.dialect, reply) == status:
                return reply
            if time.monotonic() > end:
                raise TimeoutError("STlms still answers %r" % reply)
            time.sleep(0.05)

    def wait_ready(self, limit_s=30.0):
        """Asks SCdevicestate until it says 1 (ready), as sick_scan_xd does."""
        end = time.monotonic() + limit_s
        ready = {"A": b"sRA SCdevicestate 1", "B": b"sRA SCdevicestate \x01"}[self.dialect]
        while True:
            reply = self.exchange(b"sRN SCdevicestate")
            if reply == ready:
                return
            if time.monotonic() > end:
                raise TimeoutError("SCdevicestate still answers %r" % reply)
            time.sleep(0.05)

    def scans(self, count):
        """The next `count` scans of the subscription, decoded."""
        scans = []
        while len(scans) < count:
            payload = self.events.popleft() if self.events else self.receive()
            if payload.startswith(SCAN_EVENT):
                scans.append(decode(self.dialect, payload[len(SCAN_EVENT):]))
        return scans

    def poll_scan(self):
        """The last scan by `sRN LMDscandata`."""
        reply = self.exchange(b"sRN LMDscandata")
        if not reply.startswith(SCAN_REPLY):
            raise ValueError("not a scan: %r" % reply[:60])
        return decode(self.dialect, reply[len(SCAN_REPLY):])


def stlms_status(dialect, reply):
    """The status number of an STlms reply."""
    start = b"sRA STlms "
    if not reply.startswith(start):
        raise ValueError("not an STlms reply: %r" % reply)
    body = reply[len(start):]
    return int(body.split(b" ")[0], 16) if dialect == "A" else int.from_bytes(body[:2], "big")
