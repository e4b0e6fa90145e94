"""The controller of spray.py as an ISOBUS task controller: the sprayer is its client, and its sections are set by DDI 290 in the place of a message of their own.

usage: isobus.py SCANNER CAN [--fault NAME]

It claims an address, tells its status each 2 s, takes the client's object pool by the transport protocol (TP or ETP, 64 packets at a time), activates it, sets section control to
automatic (DDI 160), the rate (DDI 1) and the sections (DDI 290), and hears what they do (DDI 161). A client whose status does not come for 6 s is lost.
Time is that of CAN frames and scans. It knows the object pool's labels and length, and nothing else of it: the sections are those of boom.toml.

With `--fault`, or SPRAY_FAULT in the environment, it has one of the errors below, or one of spray.py.
"""

import os
import signal
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import spray  # noqa: E402
from spray import BANDS_M, Can, Scanner, place  # noqa: E402

FAULTS = {
    "never_activates": "takes the client's pool and never answers that it is to be used",
    "sections_reversed": "has section 1 in the place of the last one",
    "never_automatic": "opens sections and never sets section control",
    "wrong_element": "opens sections of an element that has none",
    "deaf": "does not notice that its client is silent",
}

ADDRESS, NAME = 0xF7, bytes.fromhex("010060FF008200A0")  # arbitrary: a task controller
CLAIMED, REQUEST, LANGUAGE, PROCESS_DATA = 0xEE00, 0xEA00, 0xFE0F, 0xCB00
CONTROL, DATA, LONG_CONTROL, LONG_DATA = 0xEC00, 0xEB00, 0xC800, 0xC700
EVERYONE = 0xFF
AT_ONCE = 64  # packets of a message that may come before more is asked for
STATUS_S, LOST_S = 2.0, 6.0
DEVICE, BOOM, TANK = 0, 2, 3  # elements of the client's pool
RATE, ACTUAL, AUTOMATIC, SECTIONS = 1, 161, 160, 290
RATE_L_HA = 300


class Bus(Can):
    """Frames with their whole identifiers."""

    def __init__(self, host, port, address):
        super().__init__(host, port)
        self.address = address

    def say(self, group, destination, data, priority=3):
        group = group | destination if group < 0xF000 else group
        data = " ".join("%02X" % byte for byte in bytes(data).ljust(8, b"\xff"))
        self.socket.sendall(b"< send %08X 8 %s >" % (priority << 26 | group << 8 | self.address, data.encode()))

    def receive(self):
        chunk = self.socket.recv(65536)
        if not chunk:
            sys.exit(0)
        *whole, self.rest = (self.rest + chunk).split(b">")
        for element in whole:
            words = element.split()
            if len(words) == 5 and words[1] == b"frame":
                yield float(words[3]), int(words[2], 16), bytes.fromhex(words[4].decode())


class Transfer:
    """A message of more than eight bytes on its way to us."""

    def __init__(self, source, length, at_once, extended):
        self.source, self.length, self.at_once, self.extended = source, length, at_once, extended
        self.packets = -(-length // 7)
        self.here = 0  # packets that have come, in their order
        self.asked = 0  # the last packet that may come
        self.before = 0  # packets before the numbers that count now

    def done(self):
        return self.here == self.packets

    def add(self, number):
        """True if no other packet comes before more is asked for."""
        number += self.before
        if number == self.here + 1:
            self.here = number
        return number == self.asked


class TaskController(spray.Controller):
    def __init__(self, scanner, can, fault):
        super().__init__(scanner, can, fault)
        self.status_due_s = 0.0
        self.client = self.heard_s = self.transfer = None
        self.active, self.said, self.actual = False, None, None

    def on_frame(self, at_s, identifier, data):
        group, source = identifier >> 8 & 0x3FFFF, identifier & 0xFF
        destination = EVERYONE
        if group < 0xF000:
            destination, group = group & 0xFF, group & 0x3FF00
        if at_s >= self.status_due_s:
            self.status_due_s = at_s + STATUS_S
            self.can.say(PROCESS_DATA, EVERYONE, [0xFE, 0xFF, 0xFF, 0xFF, 1, 0, 0, 0xFF])
        if self.client is not None and at_s > self.heard_s + LOST_S and self.fault != "deaf":
            print("client lost at %.3f s" % at_s)
            self.command([False] * len(BANDS_M))
            self.client, self.active = None, False
        if destination == ADDRESS:
            self.on_message(at_s, group, source, data)
        elif destination == EVERYONE and source != self.client:
            super().on_frame(at_s, group, data)

    def on_message(self, at_s, group, source, data):
        if group == REQUEST and data[0] | data[1] << 8 | data[2] << 16 == LANGUAGE:
            self.can.say(LANGUAGE, EVERYONE, b"en\x50\x00\x00\x00\xff\xff", 6)
        elif group in (CONTROL, LONG_CONTROL):
            self.on_control(group, source, data)
        elif group in (DATA, LONG_DATA) and self.transfer and self.transfer.source == source:
            if self.transfer.add(data[0]):
                if self.transfer.done():
                    self.on_pool(source)
                else:
                    self.clear()
        elif group == PROCESS_DATA:
            self.on_process_data(at_s, source, data)

    def on_control(self, group, source, data):
        word = int.from_bytes(data[1:5], "little")
        is_ours = self.transfer and self.transfer.source == source
        if data[0] in (16, 20):
            if data[5] | data[6] << 8 | data[7] << 16 != PROCESS_DATA:
                self.refuse(group, source, data, "its group is not that of a pool")
            elif self.transfer and not is_ours:
                self.refuse(group, source, data, "another one is on its way", 1)
            else:
                extended = data[0] == 20
                length, at_once = (word, AT_ONCE) if extended else (word & 0xFFFF, data[4])
                self.transfer = Transfer(source, length, min(AT_ONCE, at_once), extended)
                self.clear()
        elif data[0] == 22 and is_ours:
            self.transfer.before = word >> 8
        elif data[0] == 255 and is_ours:
            print("the client gave its pool up, reason %d" % data[1])
            self.transfer = None

    def refuse(self, group, source, data, why, reason=250):
        print("message from address %d refused: %s" % (source, why))
        self.can.say(group, source, [255, reason, 0xFF, 0xFF, 0xFF, *data[5:8]], 7)

    def clear(self):
        """The next packets, from the first that is missing on."""
        transfer = self.transfer
        count = min(transfer.at_once, transfer.packets - transfer.here)
        first, transfer.asked = transfer.here + 1, transfer.here + count
        group, code, rest = (LONG_CONTROL, 21, first >> 8) if transfer.extended else (CONTROL, 17, 0xFFFF)
        data = [code, count, first & 0xFF, rest & 0xFF, rest >> 8]
        self.can.say(group, transfer.source, data + [0, PROCESS_DATA >> 8, 0], 7)

    def on_pool(self, source):
        transfer, self.transfer = self.transfer, None
        length = list(transfer.length.to_bytes(4, "little"))
        if transfer.extended:
            self.can.say(LONG_CONTROL, source, [23] + length + [0, PROCESS_DATA >> 8, 0], 7)
        else:
            self.can.say(CONTROL, source, [19] + length[:2] + [transfer.packets, 0xFF, 0, PROCESS_DATA >> 8, 0], 7)
        print("object pool of %d bytes" % (transfer.length - 1))
        self.can.say(PROCESS_DATA, source, [0x71, 0x00])

    def on_process_data(self, at_s, source, data):
        what, about = data[0] & 0xF, data[0] >> 4
        if what == 0xF:
            self.client, self.heard_s = source, at_s
        elif what == 0 and about == 0:
            self.can.say(PROCESS_DATA, source, [0x10, 4, 0xFF, 0x11, 0x00, 1, 16, 0])
        elif what == 1 and about in (0, 2):  # we have kept no pool
            self.can.say(PROCESS_DATA, source, [about + 1 << 4 | 1])
        elif what == 1 and about == 4:
            self.can.say(PROCESS_DATA, source, [0x51, 0x00])
        elif what == 1 and about == 8 and self.fault != "never_activates":
            self.can.say(PROCESS_DATA, source, [0x91, 0x00, 0xFF, 0xFF, 0xFF, 0xFF, 0x00, 0xFF])
            print("client active at %.3f s" % at_s)
            self.active, self.said = True, None
            if self.fault != "never_automatic":
                self.set(BOOM, AUTOMATIC, 1)
            self.set(TANK, RATE, RATE_L_HA * 10_000)
            self.can.say(PROCESS_DATA, source, [2 | TANK << 4, 0, RATE, 0])  # what is it now?
        elif what == 3:
            element = data[0] >> 4 | data[1] << 4
            if (element, data[2] | data[3] << 8) == (BOOM, ACTUAL):
                self.actual = int.from_bytes(data[4:8], "little")

    def set(self, element, ddi, value):
        head = [3 | (element & 0xF) << 4, element >> 4, ddi & 0xFF, ddi >> 8]
        self.can.say(PROCESS_DATA, self.client, bytes(head) + value.to_bytes(4, "little"))

    def command(self, wanted):
        if self.fault == "sections_reversed":
            wanted = wanted[::-1]
        states = sum(is_open << 2 * number for number, is_open in enumerate(wanted))
        # Two bits each: those of sections that are not there are 3.
        states |= 0xFFFFFFFF << 2 * len(wanted) & 0xFFFFFFFF
        if self.active and states != self.said:
            self.said = states
            self.set(DEVICE if self.fault == "wrong_element" else BOOM, SECTIONS, states)

    def decide(self):
        self.sections = self.wanted()
        self.command(self.sections)


def main(scanner, can, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    fault = flags[1] if flags[:1] == ("--fault",) else os.environ.get("SPRAY_FAULT", "none")
    known = {**spray.FAULTS, **FAULTS}
    if fault not in known:
        sys.exit("no fault is called %s; known are %s" % (fault, ", ".join(known)))
    can, scanner = Bus(*place(can), ADDRESS), Scanner(*place(scanner), "none")
    can.say(CLAIMED, EVERYONE, NAME, 6)
    if not scanner.dial():
        sys.exit(1)
    print("ready")
    TaskController(scanner, can, fault).run()


if __name__ == "__main__":
    main(*sys.argv[1:])
