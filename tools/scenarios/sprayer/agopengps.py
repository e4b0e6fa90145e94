"""The controller of spray.py with sections told as AgOpenGPS tells its modules: by UDP. It hears the tractor over CAN.

usage: agopengps.py SCANNER CAN MODULE [--fault NAME]

MODULE is HOST:PORT of a machine module. Its errors are those of spray.py.
"""

import socket
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import spray  # noqa: E402
from spray import SECTION_DUTY, place  # noqa: E402

PROGRAM, MACHINE = 0x7F, 239


class Bus(spray.Can):
    """The tractor's bus, with sections elsewhere."""

    def __init__(self, host, port, module):
        super().__init__(host, port)
        self.modules = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.modules.connect(module)

    def send(self, group, data):
        if group != SECTION_DUTY:
            return super().send(group, data)
        states = sum(1 << number for number, duty in enumerate(data) if duty == 250)
        # U-turn, speed in 0.1 km/h, lift, tramline, geo-stop, nothing; then sections 1 to 8 and 9 to 16.
        body = bytes([PROGRAM, MACHINE, 8, 0, 0, 0, 0, 0, 0, states & 0xFF, states >> 8])
        self.modules.send(b"\x80\x81" + body + bytes([sum(body) & 0xFF]))


if __name__ == "__main__":
    scanner, can, module, *flags = sys.argv[1:]
    spray.Can = lambda host, port: Bus(host, port, place(module))
    spray.main(scanner, can, *flags)
