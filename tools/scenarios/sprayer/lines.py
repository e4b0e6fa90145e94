"""The controller of spray.py without CAN: it hears the tractor and tells the sections by lines of text.

usage: lines.py SCANNER LINES [--fault NAME]

LINES is HOST:PORT of a server of lines (docs/sprayer.md), as a microcontroller on a serial line has them. Lines have no times: between scans a line
of the tractor's speed stands for the tenth of a second in which it comes. Its errors are those of spray.py.
"""

import socket
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import spray  # noqa: E402
from spray import FLOW_METER, GROUND_SPEED, SECTION_DUTY  # noqa: E402

SPEED_PERIOD_S = 0.1


class Lines:
    """A line port as spray.py knows a bus."""

    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port))
        self.rest, self.now_s = b"", 0.0

    def send(self, group, data):
        if group == SECTION_DUTY:
            states = "".join({0: "0", 250: "1"}.get(duty, "-") for duty in data).rstrip("-")
            self.socket.sendall(b"S %s\n" % states.encode())
        elif group == spray.SPRAYER_CONTROL:
            self.socket.sendall(b"L %.3f\n" % (int.from_bytes(data[4:], "little") / 1000))

    def receive(self):
        chunk = self.socket.recv(65536)
        if not chunk:
            sys.exit(0)
        *whole, self.rest = (self.rest + chunk).split(b"\n")
        for line in whole:
            name, *signals = line.decode().split()
            if name == "?":
                sys.exit("refused: " + line.decode())
            values = {key: float(value) for key, value in (signal.split("=") for signal in signals)}
            if name == "GroundBasedSpeed":
                self.now_s += SPEED_PERIOD_S
                speed = round(values["GroundSpeed"] * 1000) if "GroundSpeed" in values else 0xFFFF
                yield self.now_s, GROUND_SPEED, speed.to_bytes(2, "little")
            elif name == "FlowMeter":
                yield self.now_s, FLOW_METER, int(values["Pulses"]).to_bytes(4, "little")


if __name__ == "__main__":
    spray.Can = Lines
    spray.main(*sys.argv[1:])
