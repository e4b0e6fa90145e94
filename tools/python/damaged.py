"""What is left in a damaged MCAP file, pcapng capture or LMS2xx log: scans, counted by the formats' own rules. Shares no code with rowscan.

Formats: MCAP 0 (https://mcap.dev/spec), pcapng (draft-ietf-opsawg-pcapng), CoLa B and LMS2xx as in SICK's telegram listings.
"""

import struct

from cola import HEADER_B, START_B, checksum
from crc16 import crc

#: A longer payload is no telegram.
LONGEST = 64 * 1024


def cola_b_scans(data):
    """Whole scan telegrams in a stretch of bytes; after a broken one the search goes on one byte further."""
    scans, at = 0, 0
    while True:
        at = data.find(START_B, at)
        if at < 0:
            return scans
        end = at + HEADER_B + int.from_bytes(data[at + 4:at + HEADER_B], "big")
        payload = data[at + HEADER_B:end]
        if end - at <= LONGEST and end < len(data) and data[end] == checksum(payload):
            scans += payload.startswith(b"sSN LMDscandata ")
            at = end + 1
        else:
            at += 1


def lms2xx_scans(data):
    """Whole telegrams of values in a log of what a device sent."""
    scans, at = 0, 0
    while True:
        at = data.find(b"\x02\x80", at)
        if at < 0:
            return scans
        length = int.from_bytes(data[at + 2:at + 4], "little")
        end = at + 4 + length
        if length and end + 2 <= len(data) and crc(data[at:end]) == int.from_bytes(data[end:end + 2], "little"):
            scans += data[at + 4] == 0xB0
            at = end + 2
        else:
            at += 1


class Torn(Exception):
    """A file that breaks off."""


class Fields:
    """The fields of an MCAP record."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        if self.at + count > len(self.data):
            raise Torn("a field is longer than its record")
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, size):
        return int.from_bytes(self.take(size), "little")

    def text(self):
        try:
            return self.take(self.number(4)).decode()
        except UnicodeDecodeError as cause:
            raise Torn(str(cause)) from cause

    def map(self):
        inner, found = Fields(self.take(self.number(4))), {}
        while inner.at < len(inner.data):
            key = inner.text()
            found[key] = inner.text()
        return found


def records(data, at=0):
    """Opcode and content of every record of a whole file or chunk."""
    while at < len(data):
        length = int.from_bytes(data[at + 1:at + 9], "little")
        yield data[at], data[at + 9:at + 9 + length]
        at += 9 + length


def places(data, begin, end):
    """Opcode, first byte and end of each record of a whole file without compression between two places; of a chunk its head, and the records within."""
    at = begin
    while at < end:
        opcode, following = data[at], at + 9 + int.from_bytes(data[at + 1:at + 9], "little")
        if opcode == 0x06:
            fields = Fields(data[at + 9:following])
            fields.take(8 + 8 + 8 + 4), fields.text(), fields.take(8)
            yield opcode, at, at + 9 + fields.at
            yield from places(data, at + 9 + fields.at, following)
        else:
            yield opcode, at, following
        if opcode == 0x0F:
            return
        at = following


class Mcap:
    """The device's bytes in a recording of one scanner, in stretches without a gap.

    What is a record goes by the MCAP specification, version 0 (https://mcap.dev/spec): "Records" (opcode 1 byte, length 8 bytes, little-endian, content;
    opcode 0 is not valid, opcodes that a reader does not know are passed over by their length), the fields of each kind ("Header" to "Data End"), a schema's number
    is not 0, a message's channel stands before it, the data section ends with "Data End". Gaps in a stretch go by a message's `sequence`.

    The specification says nothing of what a reader does behind damage. One rule is therefore of this project (docs/bad-input.md) and written down here a second time:
    a record is taken where a record follows it, and behind damage the file is read on from where three records follow each other, or two up to the file's end, messages behind the record of their channel.
    `test_damage_costs_what_it_touches` judges without it. A chunk's head counts as a record, its records as records of the file: the test writes without compression."""

    MAGIC = b"\x89MCAP0\r\n"

    def __init__(self, data):
        self.data, self.sides, self.channels, self.next, self.stretches = data, {}, set(), {}, [b""]
        at = len(self.MAGIC)
        while at is not None:
            if at >= len(data):
                break
            size = self.size(at)
            if size is None or size == "end":
                at = self.found(at + 1, len(data))
                continue
            if self.size(at + size) is None and self.found(at + 1, at + size) is not None:
                at = self.found(at + 1, at + size)
                continue
            if data[at] == 0x0F:
                break
            if data[at] != 0x06:
                self.record(data[at], data[at + 9:at + size])
            at += size

    def size(self, at):
        """Of the record there; None for none, "end" where the file ends before it does."""
        if at + 9 > len(self.data):
            return "end"
        opcode, length = self.data[at], int.from_bytes(self.data[at + 1:at + 9], "little")
        content = self.data[at + 9:at + 9 + length] if length < 2 ** 31 else b""
        if opcode == 0 or (length > 64 * 2 ** 20 and opcode != 0x06):
            return None
        try:
            fields = Fields(content)
            if opcode == 0x06:
                fields.take(8 + 8 + 8 + 4)
                return None if fields.text() or fields.number(8) > length - 40 else 9 + 40
            if len(content) < length:
                return "end"
            self.parse(opcode, fields)
        except Torn:
            return None
        return 9 + length

    def parse(self, opcode, fields):
        """Refuses what is no record of its kind."""
        if opcode == 0x01:
            fields.text(), fields.text()
        elif opcode == 0x02:
            fields.take(20)
        elif opcode == 0x03:
            if fields.number(2) == 0:
                raise Torn("a schema without a number")
            fields.text(), fields.text(), fields.take(fields.number(4))
        elif opcode == 0x04:
            fields.take(4), fields.text(), fields.text(), fields.map()
        elif opcode == 0x05:
            if fields.number(2) not in self.channels:
                raise Torn("a message of a channel that is not known")
            fields.take(20)
        elif opcode == 0x07:
            fields.take(2), fields.take(fields.number(4))
        elif opcode == 0x0C:
            fields.text(), fields.map()
        elif opcode == 0x0F:
            fields.take(4)

    def found(self, begin, end):
        """Where a chain of records begins, between two places. Its messages may be of a channel that a record of the chain describes."""
        known = set(self.channels)
        for at in range(begin, min(end, len(self.data))):
            here, whole = at, 0
            self.channels = set(known)
            while whole < 3 and here < len(self.data) and 1 <= self.data[here] <= 15:
                size = self.size(here)
                if size is None or size == "end" or self.data[here] == 0x02:
                    whole = 3 if whole > 1 and size == "end" or whole and self.data[here] == 0x02 else -9
                    break
                if self.data[here] == 0x04:
                    self.channels.add(int.from_bytes(self.data[here + 9:here + 11], "little"))
                here, whole = here + size, whole + 1
            self.channels = known
            if whole == 3 or (whole == 2 and here >= len(self.data)):
                return at
        return None

    def record(self, opcode, content):
        fields = Fields(content)
        if opcode == 0x04:
            number = fields.number(2)
            fields.number(2)
            fields.text()
            encoding, about = fields.text(), fields.map()
            self.channels.add(number)
            if encoding == "bytes" and about.get("kind") == "cola" and "stream" in about:
                self.sides.setdefault(number, about.get("from"))
        elif opcode == 0x05:
            number, sequence = fields.number(2), fields.number(4)
            fields.take(16)
            if self.sides.get(number) == "device":
                if self.next.get(number, 0) != sequence:
                    self.stretches.append(b"")
                self.next[number] = (sequence + 1) % 2 ** 32
                self.stretches[-1] += fields.data[fields.at:]

    def scans(self):
        return sum(cola_b_scans(stretch) for stretch in self.stretches)


def mcap_scans(data):
    """Scans in an MCAP file. Without its first bytes it is a log of whatever bytes it holds."""
    return Mcap(data).scans() if data.startswith(b"\x89MCAP") else cola_b_scans(data)


def pcapng(segments):
    """A capture of what a scanner at 10.0.0.2:2112 sent to one client, a list of (ns since 1970, bytes)."""

    def block(kind, body):
        body += bytes(-len(body) % 4)
        return struct.pack("<II", kind, len(body) + 12) + body + struct.pack("<I", len(body) + 12)

    file = block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1))
    # Raw IP, nanoseconds.
    file += block(1, struct.pack("<HHI", 101, 0, 0) + struct.pack("<HHB3xHH", 9, 1, 9, 0, 0))
    sequence = 7000
    for at_ns, data in segments:
        packet = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 40 + len(data), 0, 0x4000, 64, 6, 0, bytes((10, 0, 0, 2)), bytes((10, 0, 0, 1)))
        packet += struct.pack(">HHIIBBHHH", 2112, 50000, sequence % 2 ** 32, 0, 0x50, 0x18, 0, 0, 0) + data
        sequence += len(data)
        file += block(6, struct.pack("<IIIII", 0, at_ns >> 32, at_ns % 2 ** 32, len(packet), len(packet)) + packet)
    return file


def blocks(data):
    """Type and body of every whole block; one whose two lengths differ is damaged, and skipped."""
    at = 0
    while at + 12 <= len(data):
        kind, length = struct.unpack_from("<II", data, at)
        if length < 12 or length % 4 or at + length > len(data):
            return
        if struct.unpack_from("<I", data, at + length - 4)[0] == length:
            yield kind, data[at + 8:at + length - 4]
        at += length


def tcp(packet):
    """Ends, sequence number and data of a TCP segment over IPv4, or None. A checksum may be the network card's work: it is not looked at."""
    if len(packet) < 20 or packet[0] >> 4 != 4 or packet[9] != 6:
        return None
    header, total = packet[0] % 16 * 4, int.from_bytes(packet[2:4], "big")
    if header < 20 or struct.unpack_from(">H", packet, 6)[0] & 0x3FFF:
        return None
    segment = packet[header:total if header <= total <= len(packet) else len(packet)]
    offset = segment[12] // 16 * 4 if len(segment) >= 20 else 0
    if offset < 20 or offset > len(segment):
        return None
    ends = (packet[12:16], segment[0:2], packet[16:20], segment[2:4])
    return ends, int.from_bytes(segment[4:8], "big"), segment[13], segment[offset:]


def stretches(segments):
    """Bytes without a gap, of (sequence number, bytes) in the order they came; of bytes sent twice the first count."""
    first, latest, placed = None, 0, []
    for sequence, data in segments:
        first = sequence if first is None else first
        here = (sequence - first - latest + 2 ** 31) % 2 ** 32 - 2 ** 31 + latest
        latest = max(latest, here)
        placed.append((here, data))
    end, found = None, []
    for here, data in sorted(placed, key=lambda one: one[0]):
        if end is None or here > end:
            found.append(b"")
            end = here
        new = data[end - here:]
        found[-1] += new
        end += len(new)
    return found


def pcapng_scans(data):
    """Scans in a capture, over all connections."""
    if not data.startswith(b"\n\r\r\n"):
        return cola_b_scans(data)
    flows, links = {}, []
    for kind, body in blocks(data):
        if kind == 1 and len(body) >= 8:
            links.append(struct.unpack_from("<H", body)[0])
        elif kind == 6 and len(body) >= 20:
            interface, _, _, captured, _ = struct.unpack_from("<IIIII", body)
            if interface < len(links) and links[interface] == 101 and captured <= len(body) - 20:
                segment = tcp(body[20:20 + captured])
                if segment and segment[3]:
                    ends, sequence, flags, content = segment
                    flows.setdefault(ends, []).append((sequence + (flags >> 1 & 1), content))
    return sum(cola_b_scans(stretch) for segments in flows.values() for stretch in stretches(segments))
