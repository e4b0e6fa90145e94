"""LMDscandata, every field, in both dialects: one list of fields over two readers of numbers."""

import struct
from dataclasses import dataclass
from typing import Optional


class BinaryReader:
    """Big-endian numbers of a CoLa B body."""

    def __init__(self, body):
        self.body = body
        self.at = 0

    def _take(self, form):
        values = struct.unpack_from(">" + form, self.body, self.at)
        self.at += struct.calcsize(">" + form)
        return values

    def number(self, form):
        return self._take(form)[0]

    def numbers(self, form, count):
        return list(self._take("%d%s" % (count, form)))

    def text(self, length):
        return bytes(self._take("%ds" % length)[0]).decode("latin-1")

    def finish(self):
        if self.at != len(self.body):
            raise ValueError("%d bytes after the last field" % (len(self.body) - self.at))


class AsciiReader:
    """Tokens of a CoLa A body: upper-case hex, one blank apart, signed values in two's complement of their full width."""

    WIDTH = {"B": 8, "b": 8, "H": 16, "h": 16, "I": 32, "i": 32}

    def __init__(self, body):
        self.body = body
        self.at = 0

    def _token(self):
        if self.at > len(self.body):
            raise ValueError("the telegram ends early")
        end = self.body.find(b" ", self.at)
        end = len(self.body) if end < 0 else end
        token = self.body[self.at:end]
        self.at = end + 1
        return token

    def number(self, form):
        token = self._token()
        if token != token.upper() or not token or (len(token) > 1 and token.startswith(b"0") and form != "f"):
            raise ValueError("a device sends upper-case hex without leading zeros, not %r" % token)
        value = int(token, 16)
        if form == "f":
            return struct.unpack(">f", value.to_bytes(4, "big"))[0]
        width = self.WIDTH[form]
        if value >= 1 << width:
            raise ValueError("%r does not fit %d bits" % (token, width))
        if form.islower() and value >= 1 << (width - 1):
            value -= 1 << width
        return value

    def numbers(self, form, count):
        return [self.number(form) for _ in range(count)]

    def text(self, length):
        text = self.body[self.at:self.at + length]
        self.at += length + 1
        if len(text) != length or self.body[self.at - 1:self.at] not in (b" ", b""):
            raise ValueError("a text of %d characters is cut: %r" % (length, text))
        return text.decode("latin-1")

    def finish(self):
        if self.at != len(self.body) + 1:
            raise ValueError("more after the last field: %r" % self.body[self.at:self.at + 40])


@dataclass
class Channel:
    """One output channel: value = raw x scale + offset; beam i at start + i x step (1/10000 degree)."""

    name: str
    scale: float
    offset: float
    start: int
    step: int
    values: list


@dataclass
class ScanData:
    """An LMDscandata telegram, raw units."""

    version: int
    device_number: int
    serial_number: int
    device_status: tuple
    telegram_counter: int
    scan_counter: int
    start_time_us: int
    transmit_time_us: int
    inputs: tuple
    outputs: tuple
    layer_angle: int
    scan_frequency_centihz: int
    measurement_frequency: int
    encoders: list
    channels16: list
    channels8: list
    position: Optional[tuple]
    name: Optional[str]
    comment: Optional[str]
    time: Optional[tuple]
    event: Optional[tuple]

    def channel(self, name):
        for channel in self.channels16 + self.channels8:
            if channel.name == name:
                return channel
        raise KeyError(name)


def decode(dialect, body):
    """Decodes the body that follows `sSN LMDscandata ` or `sRA LMDscandata `."""
    reader = AsciiReader(body) if dialect == "A" else BinaryReader(body)
    n = reader.number

    def channels(form):
        return [_channel(reader, form) for _ in range(n("H"))]

    def flagged(read):
        flag = n("H")
        if flag not in (0, 1):
            raise ValueError("a flag is %d" % flag)
        return read() if flag else None

    scan = ScanData(
        version=n("H"),
        device_number=n("H"),
        serial_number=n("I"),
        device_status=(n("B"), n("B")),
        telegram_counter=n("H"),
        scan_counter=n("H"),
        start_time_us=n("I"),
        transmit_time_us=n("I"),
        inputs=(n("B"), n("B")),
        outputs=(n("B"), n("B")),
        layer_angle=n("h"),
        scan_frequency_centihz=n("I"),
        measurement_frequency=n("I"),
        encoders=[(n("I"), n("H")) for _ in range(n("H"))],
        channels16=channels("H"),
        channels8=channels("B"),
        position=flagged(lambda: (reader.numbers("f", 6), n("B"))),
        name=flagged(lambda: reader.text(n("B"))),
        comment=flagged(lambda: reader.text(n("B"))),
        time=flagged(lambda: (n("H"), n("B"), n("B"), n("B"), n("B"), n("B"), n("I"))),
        event=flagged(lambda: (reader.text(4), n("I"), n("I"), n("i"))),
    )
    reader.finish()
    return scan


def _channel(reader, form):
    name, scale, offset = reader.text(5), reader.number("f"), reader.number("f")
    start, step, count = reader.number("i"), reader.number("H"), reader.number("H")
    return Channel(name, scale, offset, start, step, reader.numbers(form, count))
