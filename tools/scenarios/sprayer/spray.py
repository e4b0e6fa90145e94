"""A sprayer's controller, as an example: section decisions by distance from scans, with look-ahead for valves and computing.

usage: spray.py SCANNER CAN [--fault NAME]

SCANNER is HOST:PORT of the scanner (CoLa B), CAN that of a socketcand server. Each scan is kept with the way driven when it was made. A section is told to open
when the nozzle will be at leaves by the time its flow begins, and to close likewise. It says `SectionDuty` (PGN 65300) at each change and each 50 ms, and the litres that a flow meter counts, where it hears one. How bytes become scans and
frames is that of the survey's controller beside this folder. Time is that of CAN frames and scans, never this computer's.

With `--fault`, or SPRAY_FAULT in the environment, the controller has one of the errors below; the scenarios beside this file must find it.
"""

import os
import select
import signal
import sys
from collections import deque
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "survey"))
from controller import (  # noqa: E402
    ADDRESS_CLAIMED, BANDS_M, GROUND_SPEED, LONGEST_GAP_S, NAME, NOZZLE_BEHIND_M, Can, Scanner, place,
)

FAULTS = {
    "none": "nothing",
    "no_compensation": "tells valves to open where the leaves are, not before",
    "reversed": "numbers the sections from the top",
    "dead": "keeps all shut",
    "all_open": "keeps all open",
    "keeps_open": "keeps valves as they are when the scanner is lost",
}

SECTION_DUTY, SPRAYER_CONTROL, FLOW_METER = 0xFF14, 0xFF16, 0xFF1A
PULSES_PER_L = 300  # of the flow meter, as boom.toml has it
PERIOD_S = 0.05
SILENT_S = 0.3  # without a scan or a speed for so long all is shut
STANDSTILL_M_S = 0.1
KEPT_M = 8.0  # of scans behind the scanner

# From what the scanner sees to what the valves do, seconds: boom.toml has the dead times, base.toml the time for computing. A scan comes
# a turn after it was begun, and looks at the row in its middle.
COMPUTE_S, TURN_S = 0.02, 0.02
VALVE_ON_S, VALVE_OFF_S = 0.15, 0.10


class Controller:
    def __init__(self, scanner, can, fault):
        self.scanner, self.can, self.fault = scanner, can, fault
        self.now_s = self.way_m = self.speed_m_s = self.told_s = 0.0
        self.speed_at_s = self.scan_at_s = self.clock_s = None
        self.seen = deque()  # (where, sections with canopy), the newest last
        self.sections = [False] * len(BANDS_M)
        leads = (0.0, 0.0) if fault == "no_compensation" else (COMPUTE_S + VALVE_ON_S, COMPUTE_S + VALVE_OFF_S)
        self.on_s, self.off_s = leads

    def on_frame(self, at_s, group, data):
        self.advance(at_s)
        if group == GROUND_SPEED:
            raw = data[0] | data[1] << 8
            self.speed_m_s, self.speed_at_s = (raw / 1000 if raw <= 64255 else 0.0), self.now_s
        if group == FLOW_METER:
            self.report(int.from_bytes(data[:4], "little") / PULSES_PER_L)
        self.decide()

    def on_scan(self, scan):
        if self.clock_s is None or abs(scan.time_s + self.clock_s - self.now_s) > LONGEST_GAP_S:
            self.clock_s = self.now_s - scan.time_s
        self.advance(scan.time_s + self.clock_s + TURN_S)
        self.scan_at_s = self.now_s
        canopy = scan.canopy[::-1] if self.fault == "reversed" else scan.canopy
        self.seen.append((self.way_m - self.speed_m_s * TURN_S / 2, canopy))
        while self.seen[0][0] < self.way_m - KEPT_M:
            self.seen.popleft()
        self.decide()

    def report(self, litres):
        self.can.send(SPRAYER_CONTROL, b"\xff" * 4 + round(litres * 1000).to_bytes(4, "little"))

    def advance(self, to_s):
        if to_s > self.now_s:
            self.way_m += self.speed_m_s * (to_s - self.now_s)
            self.now_s = to_s

    def is_old(self, at_s):
        return at_s is None or self.now_s - at_s > SILENT_S

    def canopy_between(self, low_m, high_m):
        """What scans between two places have seen, by section."""
        # A scan stands for the way of a turn.
        half_m = self.speed_m_s * TURN_S / 2
        between = [canopy for where, canopy in self.seen if low_m - half_m <= where <= high_m + half_m]
        return [any(column) for column in zip(*between)] if between else [False] * len(BANDS_M)

    def wanted(self):
        if self.fault == "all_open":
            return [True] * len(BANDS_M)
        if self.is_old(self.scan_at_s) or self.is_old(self.speed_at_s):
            return self.sections if self.fault == "keeps_open" else [False] * len(BANDS_M)
        if self.fault == "dead" or self.speed_m_s < STANDSTILL_M_S:
            return [False] * len(BANDS_M)
        nozzle_m = self.way_m - NOZZLE_BEHIND_M
        # Open from when the nozzle will reach leaves until it will have left them: the valve is slower to open than to close.
        return self.canopy_between(nozzle_m + self.speed_m_s * self.off_s, nozzle_m + self.speed_m_s * self.on_s)

    def decide(self):
        wanted = self.wanted()
        # A tenth of a millisecond is lost in the clocks' digits.
        if wanted != self.sections or self.now_s >= self.told_s + PERIOD_S - 1e-4:
            self.sections, self.told_s = wanted, self.now_s
            duties = [250 if is_open else 0 for is_open in wanted]
            self.can.send(SECTION_DUTY, bytes(duties + [0xFF] * (8 - len(duties))))

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
                        print("scanner lost at %.3f s: %s" % (self.now_s, error))
                        self.scanner.close()


def main(scanner, can, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    fault = flags[1] if flags[:1] == ("--fault",) else os.environ.get("SPRAY_FAULT", "none")
    if fault not in FAULTS:
        sys.exit("no fault is called %s; known are %s" % (fault, ", ".join(FAULTS)))
    can, scanner = Can(*place(can)), Scanner(*place(scanner), "none")
    can.send(ADDRESS_CLAIMED, NAME)
    if not scanner.dial():
        sys.exit(1)
    print("ready")
    Controller(scanner, can, fault).run()


if __name__ == "__main__":
    main(*sys.argv[1:])
