"""A sprayer's firmware as client of an ISOBUS task controller: it describes its four sections, is told by DDI 290, and drives its valves.

usage: client.py SCANNER CAN [--fault NAME]

It claims an address, waits for a task controller, sends its object pool by the transport protocol, has it activated, obeys DDI 290, 160 and 1, tells what its
sections do by DDI 161, and its status each 2 s. Its valves are told by `SectionDuty` (PGN 65300), as the virtual boom hears them. Without a status of the task
controller for 6 s all are shut. Time is that of CAN frames. It takes the scanner's scans and makes nothing of them: a drive starts when somebody takes them.

With `--fault`, or SPRAY_FAULT in the environment, it has one of the errors below; served.toml must find it.
"""

import os
import select
import struct
import sys

from isobus import (
    ACTUAL, AUTOMATIC, BOOM, CLAIMED, CONTROL, DATA, EVERYONE, LOST_S, PROCESS_DATA, RATE, SECTIONS, STATUS_S, TANK, Bus, Scanner, place, signal,
)

FAULTS = {
    "none": "nothing",
    "sections_reversed": "has section 1 in the place of the last one",
    "holds": "keeps its valves as they are without a task controller",
    "bad_pool": "describes a section whose parent is not in its pool",
}

ADDRESS, NAME = 0x81, bytes.fromhex("0200E0FF008100A0")  # arbitrary: a sprayer
MASTER, REFUSED, SECTION_DUTY = 0xFE0D, 0xE800, 0xFF14
COUNT = 4
ON_CHANGE, SETTABLE, DEFAULT = 0x08, 0x02, 0x01
NO_OBJECT = 0xFFFF


def text(words):
    return bytes([len(words)]) + words.encode()


def element(number, kind, words, parent, children=()):
    head = b"DET" + struct.pack("<HB", number + 1, kind) + text(words)
    return head + struct.pack("<HHH", number, parent, len(children)) + struct.pack("<%dH" % len(children), *children)


def value(object_id, ddi, properties, words):
    return b"DPD" + struct.pack("<HHBB", object_id, ddi, properties, ON_CHANGE) + text(words) + struct.pack("<H", NO_OBJECT)


def pool(fault):
    """Device, boom with its values, tank with its rate, sections."""
    device = b"DVC" + struct.pack("<H", 0) + text("sprayer") + text("1.0") + NAME + text("7") + b"ROWSCAN" + b"en\x50\0\0\0\xff" + b"\0"
    parts = [device, element(0, 1, "sprayer", 0), element(BOOM, 2, "boom", 1, (100, 101, 102)), element(TANK, 3, "tank", BOOM + 1, (103,))]
    parts.append(value(100, ACTUAL, DEFAULT, "sections") + value(101, SECTIONS, SETTABLE, "wanted"))
    parts.append(value(102, AUTOMATIC, SETTABLE, "automatic") + value(103, RATE, SETTABLE, "rate"))
    parent = 777 if fault == "bad_pool" else BOOM + 1
    parts += [element(4 + number, 4, "section %d" % (number + 1), parent) for number in range(COUNT)]
    return b"".join(parts)


class Client:
    def __init__(self, can, fault):
        self.can, self.fault = can, fault
        self.server = self.heard_s = self.status_due_s = None
        self.state, self.pool = "alone", b"\x61" + pool(fault)
        self.sections, self.is_automatic, self.rate_l_ha = [False] * COUNT, False, None

    def say(self, data):
        self.can.say(PROCESS_DATA, self.server, data)

    def on_frame(self, at_s, identifier, data):
        group, source = identifier >> 8 & 0x3FFFF, identifier & 0xFF
        destination = EVERYONE
        if group < 0xF000:
            destination, group = group & 0xFF, group & 0x3FF00
        if destination not in (ADDRESS, EVERYONE) or source == ADDRESS:
            return
        if group == PROCESS_DATA and data[0] & 0xF == 0xE and self.server in (None, source):
            self.heard_s = at_s
            if self.state == "alone":
                self.server, self.state, self.status_due_s = source, "asked", at_s
                self.can.say(MASTER, EVERYONE, [1])
                self.say([0x00])
        elif group == PROCESS_DATA and source == self.server and self.state != "alone":
            self.on_process_data(data)
        elif group == CONTROL and source == self.server:
            self.on_control(data)
        self.on_time(at_s)

    def on_time(self, at_s):
        if self.state == "alone":
            return
        if at_s > self.heard_s + LOST_S:
            print("task controller lost at %.3f s" % at_s)
            self.server, self.state = None, "alone"
            if self.fault != "holds":
                self.drive([False] * COUNT)
        elif at_s >= self.status_due_s:
            self.status_due_s += STATUS_S
            self.say([0xFF, 0xFF, 0xFF, 0xFF, 1, 0, 0, 0])

    def on_control(self, data):
        """Our pool goes out, as far as it was asked for."""
        if data[0] == 17:
            for number in range(data[2], data[2] + data[1]):
                packet = self.pool[7 * (number - 1) : 7 * number]
                self.can.say(DATA, self.server, bytes([number]) + packet, 7)
        elif data[0] == 255:
            print("the transfer was aborted: %d" % data[1])

    def on_process_data(self, data):
        what, about = data[0] & 0xF, data[0] >> 4
        if (what, about) == (0, 0):
            self.say([0x10, 4, 0xFF, 0x11, 0, 1, COUNT, 0])
        elif (what, about) == (0, 1) and self.state == "asked":
            self.state = "labels"
            self.say([0x01])
        elif (what, about) == (1, 1):
            self.say([0x41] + list(struct.pack("<I", len(self.pool) - 1)))
        elif (what, about) == (1, 5) and data[1] == 0:
            packets = -(-len(self.pool) // 7)
            size = list(struct.pack("<H", len(self.pool)))
            self.can.say(CONTROL, self.server, [16] + size + [packets, 0xFF, 0, PROCESS_DATA >> 8, 0], 7)
        elif (what, about) == (1, 7) and data[1] == 0:
            self.say([0x81])
        elif (what, about) == (1, 9):
            self.state = "active" if data[1] == 0 else "refused"
            print("object pool %s: %s" % (self.state, data[1:7].hex()))
        elif what in (3, 10) and self.state == "active":
            self.obey(data[0] >> 4 | data[1] << 4, *struct.unpack("<Hi", data[2:8]))
        elif what == 2 and self.state == "active":
            self.tell()

    def obey(self, number, ddi, found):
        if (number, ddi) == (BOOM, SECTIONS) and self.is_automatic:
            states = [found >> 2 * place & 3 for place in range(COUNT)]
            if self.fault == "sections_reversed":
                states.reverse()
            self.drive([self.sections[place] if state > 1 else state == 1 for place, state in enumerate(states)])
        elif (number, ddi) == (BOOM, AUTOMATIC):
            self.is_automatic = found == 1
        elif (number, ddi) == (TANK, RATE):
            self.rate_l_ha = found / 10_000
            print("rate %g l/ha" % self.rate_l_ha)

    def drive(self, sections):
        self.sections = sections
        self.can.say(SECTION_DUTY, EVERYONE, [250 if is_open else 0 for is_open in sections], 6)
        if self.server is not None:
            self.tell()

    def tell(self):
        states = sum(is_open << 2 * number for number, is_open in enumerate(self.sections))
        states |= 0xFFFFFFFF << 2 * COUNT & 0xFFFFFFFF
        self.say(bytes([3 | BOOM << 4, 0]) + struct.pack("<HI", ACTUAL, states))


def main(scanner, can, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    fault = flags[1] if flags[:1] == ("--fault",) else os.environ.get("SPRAY_FAULT", "none")
    if fault not in FAULTS:
        sys.exit("no fault is called %s; known are %s" % (fault, ", ".join(FAULTS)))
    can, scanner = Bus(*place(can), ADDRESS), Scanner(*place(scanner), "none")
    can.say(CLAIMED, EVERYONE, NAME, 6)
    if not scanner.dial():
        sys.exit(1)
    print("ready", flush=True)
    client = Client(can, fault)
    while True:
        ready, _, _ = select.select([can.socket, scanner.socket], [], [])
        if scanner.socket in ready:
            for _ in scanner.receive():
                pass
        if can.socket in ready:
            for frame in can.receive():
                client.on_frame(*frame)


if __name__ == "__main__":
    main(*sys.argv[1:])
