"""A client of the classic LMS2xx on pyserial, written from the telegram listing alone."""

import struct
import time

import serial

from crc16 import crc

ACK = b"\x06"
#: Operating mode that switches to a rate.
RATES = {9600: 0x42, 19200: 0x41, 38400: 0x40, 500000: 0x48}


def frame(body):
    """A host's frame around `body`."""
    head = struct.pack("<BBH", 2, 0, len(body)) + body
    return head + struct.pack("<H", crc(head))


class Lms2xx:
    """One open line."""

    def __init__(self, url, rate=9600, **options):
        self.port = serial.serial_for_url(url, baudrate=rate, timeout=5, **options)
        self.port.reset_input_buffer()
        self.received = bytearray()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.port.close()

    def read_frame(self):
        """The next whole frame's body; None when nothing comes. A request cuts off what the device is sending: a frame without its end,
        or with a reply in its middle, is no frame."""
        while True:
            start = self.received.find(b"\x02\x80")
            del self.received[:max(start, 0) if start >= 0 else max(len(self.received) - 1, 0)]
            whole = len(self.received) >= 4 and struct.unpack_from("<H", self.received, 2)[0] + 6
            if start >= 0 and whole and len(self.received) >= whole:
                found = bytes(self.received[:whole])
                if crc(found[:-2]) == struct.unpack("<H", found[-2:])[0]:
                    del self.received[:whole]
                    return found[4:-2]
                del self.received[:2]
                continue
            bytes_read = self.port.read(max(1, self.port.in_waiting))
            if not bytes_read:
                if start < 0:
                    return None
                # No more of it comes: it was cut off.
                del self.received[:2]
            self.received += bytes_read

    def ask(self, body, reply=None):
        """Sends a command, wants its ACK, and gives its reply's body; scans on the way are left out."""
        self.port.write(frame(body))
        reply = (body[0] | 0x80 if body[0] != 0x10 else 0x91) if reply is None else reply
        while True:
            found = self.read_frame()
            if found is None or found[0] == reply:
                return found

    def rate(self, rate):
        """Switches the device, then the port."""
        assert self.ask(bytes([0x20, RATES[rate]])) == b"\xa0\x00\x10"
        time.sleep(0.1)
        self.port.baudrate = rate

    def millimetres(self):
        """Writes unit and measuring mode: 32 m, millimetres."""
        assert self.ask(b"\x20\x00SICK_LMS") == b"\xa0\x00\x10"
        block = bytearray(self.ask(b"\x74")[1:-1])
        assert len(block) == 34
        block[5:7] = 6, 1
        assert self.ask(b"\x77" + bytes(block))[1] == 1
        assert self.ask(b"\x20\x25") == b"\xa0\x00\x10"

    def scan(self):
        """The next scan: its values."""
        while True:
            body = self.read_frame()
            assert body is not None, "no scan came"
            if body[0] == 0xB0:
                word = struct.unpack_from("<H", body, 1)[0]
                count = word & 0x3FF
                return list(struct.unpack_from("<%dH" % count, body, 3))
