"""CoLa A and CoLa B framing, written from SICK's telegram listing; shares no code with rowscan."""

STX = b"\x02"
ETX = b"\x03"
START_B = STX * 4
HEADER_B = len(START_B) + 4


def checksum(payload):
    """XOR of all payload bytes."""
    value = 0
    for byte in payload:
        value ^= byte
    return value


def encode(dialect, payload):
    """The frame of a payload in dialect "A" (STX text ETX) or "B" (4 STX, big-endian length, payload, XOR)."""
    if dialect == "A":
        return STX + payload + ETX
    return START_B + len(payload).to_bytes(4, "big") + payload + bytes([checksum(payload)])


class FrameError(Exception):
    """The stream holds something that is not a frame."""


class Splitter:
    """Cuts a byte stream into payloads. Strict: a device that sends junk or a wrong checksum fails the test."""

    def __init__(self, dialect):
        self.dialect = dialect
        self.buffer = bytearray()

    def push(self, data):
        self.buffer += data

    def next_payload(self):
        """The next whole payload, or None until more bytes come."""
        return self._next_a() if self.dialect == "A" else self._next_b()

    def _next_a(self):
        if self.buffer and self.buffer[:1] != STX:
            raise FrameError("expected STX, found %r" % bytes(self.buffer[:16]))
        end = self.buffer.find(ETX)
        if end < 0:
            return None
        payload = bytes(self.buffer[1:end])
        if STX in payload:
            raise FrameError("STX inside a CoLa A telegram: %r" % payload[:40])
        del self.buffer[: end + 1]
        return payload

    def _next_b(self):
        start = bytes(self.buffer[: len(START_B)])
        if start != START_B[: len(start)]:
            raise FrameError("expected four STX, found %r" % bytes(self.buffer[:16]))
        if len(self.buffer) < HEADER_B:
            return None
        end = HEADER_B + int.from_bytes(self.buffer[len(START_B):HEADER_B], "big")
        if len(self.buffer) < end + 1:
            return None
        payload = bytes(self.buffer[HEADER_B:end])
        if self.buffer[end] != checksum(payload):
            raise FrameError("checksum of %r is %02x, sent %02x" % (payload[:40], checksum(payload), self.buffer[end]))
        del self.buffer[: end + 1]
        return payload
