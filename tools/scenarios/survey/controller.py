"""A sprayer's controller, as an example: one SICK scanner (CoLa B), the tractor's ground speed on CAN, four nozzle sections above one another.

usage: controller.py SCANNER CAN [--fault NAME]

SCANNER is HOST:PORT of the scanner, CAN that of a socketcand server. A section opens while canopy is in front of it: what the scanner saw there,
NOZZLE_BEHIND_M ago. Time is that of CAN frames and scans, never this computer's: so the same frames and scans give the same answers.

With `--fault`, or SURVEY_FAULT in the environment, the controller has one of the errors below, and the scenarios beside this file must find it.
"""

import math
import os
import select
import signal
import socket
import struct
import sys
import time
from collections import deque

FAULTS = {
    "none": "nothing",
    "no_delay": "opens where the scanner is, not where the nozzle is",
    "delay_twice": "waits twice the distance from scanner to nozzle",
    "reversed": "numbers the sections from the top",
    "no_timeout": "waits for ever on a connection that is silent",
    "never_redials": "does not dial again after a disconnect",
    "sleeps": "waits 20 s before it dials again",
    "no_checksum": "believes damaged telegrams",
    "wheel_speed": "takes wheel speed (FE48) for ground speed (FE49)",
    "speed_unit": "takes 0.001 m/s for 0.001 km/h",
    "distance_unit": "takes millimetres for centimetres",
    "ignores_dirt": "sprays by what a dirty scanner sees",
    "stale_scan": "repeats the last scan where scans are lost",
    "keeps_open": "keeps valves as they are when the scanner is lost",
    "never_closes": "never closes a section that was open",
    "lost_off_by_one": "counts one lost scan too many in each gap",
    "repeats_counted": "counts scans that come again",
    "heartbeat_stops": "stops its heartbeat after 2 s",
    "uneven_pace": "sends every other message 40 ms late",
    "wrong_group": "sends Nozzles in another parameter group",
    "start_angle": "takes every scanner's start angle for -45 degrees",
    "last_echo": "asks for the last echo of each beam",
    "ignores_stop": "keeps nozzles open at standstill",
    "holds_speed": "goes on with the last ground speed when no more comes",
    "leaks": "opens a second connection with each, and never closes it",
    "junk_crash": "takes every byte for the start of a telegram, and crashes on others",
    "slow": "computes 60 ms for each message",
}

# What stands where, metres. Sections are bands of height, the lowest first.
SCANNER_HEIGHT_M = 1.6
NOZZLE_BEHIND_M = 1.0
NEAR_M, FAR_M = 0.5, 2.9  # canopy of this row is so far from the scanner, across the row
BANDS_M = [(0.5, 1.0), (1.0, 1.5), (1.5, 2.0), (2.0, 2.5)]
MIN_BEAMS = 5  # fewer beams in a band are no canopy

PERIOD_S = 0.1  # of Nozzles and Status
SCAN_TIMEOUT_S = 0.5  # without a scan for so long the scanner is lost: 25 scans of an LMS111
SPEED_TIMEOUT_S = 0.5  # ground speed comes every 0.1 s
REDIAL_S = 0.2
LONGEST_GAP_S = 2.0  # a scanner's clock that is farther off has wrapped or was set
FRESH_M = 0.1  # a scan tells of so much of the row behind it: some lost scans do no harm
STANDSTILL_M_S = 0.1

ADDRESS = 0x27  # our address on the bus
NAME = bytes.fromhex("0100E0FF00820020")  # arbitrary: a sprayer's controller
NOZZLES, STATUS, ADDRESS_CLAIMED = 0xFF20, 0xFF21, 0xEEFF
GROUND_SPEED, WHEEL_SPEED = 0xFE49, 0xFE48

STX = b"\x02\x02\x02\x02"
LONGEST = 100_000  # no telegram is longer
LOGIN = b"sMN SetAccessMode \x03\xf4\x72\x47\x44"  # authorized client
SUBSCRIBE = b"sEN LMDscandata \x01"


def checksum(payload):
    value = 0
    for byte in payload:
        value ^= byte
    return value


def framed(payload):
    return STX + struct.pack(">I", len(payload)) + payload + bytes([checksum(payload)])


class Scan:
    """An LMDscandata telegram: who it is, and which sections have canopy in front."""

    HEAD = struct.Struct(">HHIBBHHII")  # version, device, serial, status twice, telegrams, scans, time, sent

    def __init__(self, payload, fault):
        *_, status, self.counter, _, time_us, _ = self.HEAD.unpack_from(payload, 16)
        self.time_s = time_us / 1e6
        self.dirty = status & 6 != 0  # a warning or an error
        at = 16 + self.HEAD.size + 14  # inputs, outputs, reserved, two frequencies
        encoders, = struct.unpack_from(">H", payload, at)
        at += 2 + 6 * encoders
        _, name, scale, offset, start, step, count = struct.unpack_from(">H5sffiHH", payload, at)
        raw = struct.unpack_from(">%dH" % count, payload, at + 23)
        if name != b"DIST1":
            raise ValueError("expected DIST1, found %r" % name)
        unit_m = 0.01 if fault == "distance_unit" else 0.001
        start_deg = -45.0 if fault == "start_angle" else start / 10_000
        beams = [0] * len(BANDS_M)
        for number, value in enumerate(raw):
            range_m = (value * scale + offset) * unit_m
            # Device angle 90 degrees points at the row, 0 at the ground.
            angle = math.radians(start_deg + number * step / 10_000 - 90)
            if value > 8 and NEAR_M < range_m * math.cos(angle) < FAR_M:
                height_m = SCANNER_HEIGHT_M + range_m * math.sin(angle)
                for band, (low, high) in enumerate(BANDS_M):
                    beams[band] += low <= height_m < high
        self.canopy = [count >= MIN_BEAMS for count in beams]
        if fault == "reversed":
            self.canopy.reverse()


class Scanner:
    """The connection to the scanner: bytes in, scans out."""

    def __init__(self, host, port, fault):
        self.address, self.fault = (host, port), fault
        self.socket, self.rest, self.spare = None, b"", []
        self.bad, self.in_step = 0, True

    def dial(self):
        try:
            self.socket = socket.create_connection(self.address, timeout=1)
            if self.fault == "leaks":
                self.spare.append(socket.create_connection(self.address, timeout=1))
        except OSError as error:
            print("no scanner: %s" % error)
            self.close()
            return False
        self.rest, self.in_step = b"", True
        echo = b"\x02" if self.fault == "last_echo" else b"\x00"
        for payload in (LOGIN, b"sWN FREchoFilter " + echo, b"sMN Run", SUBSCRIBE):
            self.socket.sendall(framed(payload))
        return True

    def close(self):
        if self.socket:
            self.socket.close()
        self.socket = None

    def skip(self):
        """What comes next is no telegram: goes on at the next start. However long that takes, it is one bad telegram."""
        self.bad += self.in_step
        self.in_step = False
        start = self.rest.find(STX, 1)
        self.rest = self.rest[start if start > 0 else -len(STX) + 1 :]

    def receive(self):
        """Scans that have come; raises OSError when the connection is gone."""
        chunk = self.socket.recv(65536)
        if not chunk:
            raise OSError("the scanner closed the connection")
        self.rest += chunk
        while len(self.rest) > 8:
            length, = struct.unpack(">I", self.rest[4:8])
            if not self.rest.startswith(STX) or length > LONGEST:
                if self.fault == "junk_crash":
                    raise ValueError("no telegram: %r" % self.rest[:8])
                self.skip()
                continue
            if len(self.rest) < 9 + length:
                return
            payload, check = self.rest[8 : 8 + length], self.rest[8 + length]
            if check != checksum(payload) and self.fault != "no_checksum":
                # Its length may be wrong, too: search from behind its start.
                self.skip()
                continue
            self.in_step = True
            self.rest = self.rest[9 + length :]
            if payload.startswith(b"sSN LMDscandata "):
                yield Scan(payload, self.fault)


class Can:
    """A socketcand client."""

    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port))
        self.rest = b""
        self.socket.sendall(b"< open can0 >< rawmode >")
        while self.rest.count(b"< ok >") < 2:
            self.rest += self.socket.recv(4096)
        self.rest = b""

    def send(self, group, data):
        data = " ".join("%02X" % byte for byte in data)
        self.socket.sendall(b"< send %08X 8 %s >" % (0x18 << 24 | group << 8 | ADDRESS, data.encode()))

    def receive(self):
        """Frames that have come: time, parameter group, data."""
        chunk = self.socket.recv(65536)
        if not chunk:
            sys.exit(0)
        *whole, self.rest = (self.rest + chunk).split(b">")
        for element in whole:
            words = element.split()
            if len(words) == 5 and words[1] == b"frame":
                yield float(words[3]), int(words[2], 16) >> 8 & 0x3FFFF, bytes.fromhex(words[4].decode())


class Controller:
    def __init__(self, scanner, can, fault):
        self.scanner, self.can, self.fault = scanner, can, fault
        self.now_s = self.due_s = 0.0
        self.way_m = self.speed_m_s = 0.0
        self.speed_at_s = self.scan_at_s = self.redial_at_s = None
        self.clock_s = None  # our time minus the scanner's
        self.seen = deque()  # (where, sections with canopy)
        self.sections, self.dirty, self.counter = [False] * len(BANDS_M), False, None
        self.taken = self.lost = self.messages = 0
        factor = {"no_delay": 0, "delay_twice": 2}.get(fault, 1)
        self.behind_m = NOZZLE_BEHIND_M * factor

    def on_frame(self, at_s, group, data):
        if group == (WHEEL_SPEED if self.fault == "wheel_speed" else GROUND_SPEED):
            raw = data[0] | data[1] << 8
            self.speed_m_s = raw / (3600 if self.fault == "speed_unit" else 1000) if raw <= 64255 else 0.0
            self.speed_at_s = at_s
        self.advance(at_s)

    def on_scan(self, scan):
        # The scanner's microseconds wrap each 71 minutes.
        if self.clock_s is None or abs(scan.time_s + self.clock_s - self.now_s) > LONGEST_GAP_S:
            self.clock_s = self.now_s - scan.time_s
        self.advance(scan.time_s + self.clock_s)
        self.scan_at_s, self.dirty = self.now_s, scan.dirty
        step = 1 if self.counter is None else (scan.counter - self.counter) % 0x10000
        if 0 < step < 0x8000:
            self.lost += step - (step == 1 or self.fault != "lost_off_by_one")
            self.seen.append((self.way_m, scan.canopy))
            self.counter = scan.counter
        self.taken += 0 < step < 0x8000 or self.fault == "repeats_counted"

    def on_lost(self, why):
        print("scanner lost at %.3f s: %s" % (self.now_s, why))
        self.scanner.close()
        self.clock_s = self.scan_at_s = self.counter = None
        pause_s = {"sleeps": 20.0, "never_redials": math.inf}.get(self.fault, REDIAL_S)
        self.redial_at_s = self.now_s + pause_s

    def advance(self, to_s):
        """Time goes on; what is due is done."""
        if to_s <= self.now_s:
            return
        self.way_m += self.speed_m_s * (to_s - self.now_s)
        self.now_s = to_s
        silent = self.scan_at_s is not None and self.now_s - self.scan_at_s > SCAN_TIMEOUT_S
        if self.scanner.socket and silent and self.fault != "no_timeout":
            self.on_lost("silent")
        if not self.scanner.socket and self.now_s >= self.redial_at_s:
            self.redial_at_s = self.now_s + REDIAL_S
            if self.scanner.dial():
                print("dialled at %.3f s" % self.now_s)
                self.scan_at_s = self.now_s
        late_s = 0.04 if self.fault == "uneven_pace" and self.messages % 2 else 0.0
        # A tenth of a millisecond is lost in the clocks' digits.
        if self.now_s >= self.due_s + late_s - 1e-4:
            self.due_s = max(self.due_s + PERIOD_S, self.now_s - late_s)
            self.tell()

    def wanted(self):
        """The sections that must be open now."""
        speed_old = self.speed_at_s is None or self.now_s - self.speed_at_s > SPEED_TIMEOUT_S
        if speed_old and self.fault != "holds_speed":
            self.speed_m_s = 0.0
        stands = self.speed_m_s < STANDSTILL_M_S and self.fault != "ignores_stop"
        if not self.scanner.socket and self.fault == "keeps_open":
            return self.sections
        if stands or not self.scanner.socket or (self.dirty and self.fault != "ignores_dirt"):
            return [False] * len(BANDS_M)
        nozzle_m = self.way_m - self.behind_m
        while len(self.seen) > 1 and self.seen[1][0] <= nozzle_m:
            self.seen.popleft()
        if not self.seen or self.seen[0][0] > nozzle_m:
            return [False] * len(BANDS_M)
        place_m, sections = self.seen[0]
        is_fresh = nozzle_m - place_m < FRESH_M or self.fault == "stale_scan"
        return sections if is_fresh else [False] * len(BANDS_M)

    def tell(self):
        if self.fault == "slow":
            busy = time.process_time()
            while time.process_time() - busy < 0.06:
                pass
        wanted = self.wanted()
        if self.fault == "never_closes":
            wanted = [old or new for old, new in zip(self.sections, wanted)]
        self.sections = wanted
        self.messages += 1
        states = sum(is_open << 2 * number for number, is_open in enumerate(wanted))
        self.can.send(NOZZLES + (2 if self.fault == "wrong_group" else 0), bytes([states] + [0xFF] * 7))
        beat = min(self.messages, 20) if self.fault == "heartbeat_stops" else self.messages
        flags = self.dirty | (self.scanner.socket is not None) << 2
        counts = struct.pack("<BHHBB", beat % 251, self.taken, self.lost, min(self.scanner.bad, 250), flags | 0xF0)
        self.can.send(STATUS, counts + b"\xff")

    def run(self):
        while True:
            streams = [stream for stream in (self.can.socket, self.scanner.socket) if stream]
            for stream in select.select(streams, [], [])[0]:
                if stream is self.can.socket:
                    for frame in self.can.receive():
                        self.on_frame(*frame)
                elif stream is self.scanner.socket:
                    try:
                        for scan in self.scanner.receive():
                            self.on_scan(scan)
                    except OSError as error:
                        self.on_lost(error)


def place(address):
    host, port = address.rsplit(":", 1)
    return host, int(port)


def main(scanner, can, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    fault = flags[1] if flags[:1] == ("--fault",) else os.environ.get("SURVEY_FAULT", "none")
    if fault not in FAULTS:
        sys.exit("no fault is called %s; known are %s" % (fault, ", ".join(FAULTS)))
    can, scanner = Can(*place(can)), Scanner(*place(scanner), fault)
    can.send(ADDRESS_CLAIMED, NAME)
    if not scanner.dial():
        sys.exit(1)
    print("ready")
    Controller(scanner, can, fault).run()


if __name__ == "__main__":
    main(*sys.argv[1:])
