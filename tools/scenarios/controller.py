"""A controller of 70 lines: reads scans in CoLa A and decides on each of them whether the nozzles open. It dials again when the scanner is lost.

usage: controller.py HOST:PORT [--quit-after N] [--deaf] [--pause S] [--patient]
"""

import itertools
import json
import signal
import socket
import sys
import time

NEAR_MM = 2000  # canopy is what is nearer than this
SILENCE_S = 1.0  # without a byte for so long the scanner is lost
PAUSE_S = 0.2  # from one attempt to the next; --pause says another


def telegrams(connection):
    rest = b""
    while chunk := connection.recv(65536):
        *whole, rest = (rest + chunk).split(b"\x03")
        yield from (telegram.lstrip(b"\x02") for telegram in whole)


def distances_mm(telegram):
    fields = telegram.split(b" ")
    start = fields.index(b"DIST1")
    return [int(field, 16) for field in fields[start + 6 : start + 6 + int(fields[start + 5], 16)]]


def scans(host, port, deaf, silence_s, pause_s):
    """Scans over one connection after another."""
    for attempt in itertools.count():
        try:
            with socket.create_connection((host, port), timeout=SILENCE_S) as connection:
                # Before the first scan there may be nothing for long: the drive has not started.
                connection.settimeout(silence_s if attempt else None)
                if not deaf:
                    connection.sendall(b"\x02sEN LMDscandata 1\x03")
                print("connected")
                for telegram in telegrams(connection):
                    connection.settimeout(silence_s)
                    if telegram.startswith(b"sSN LMDscandata "):
                        yield telegram
            print("lost: the scanner closed the connection")
        except OSError as error:
            print("lost: %s" % error)
        time.sleep(pause_s)


def main(address, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    last = int(flags[flags.index("--quit-after") + 1]) if "--quit-after" in flags else None
    pause_s = float(flags[flags.index("--pause") + 1]) if "--pause" in flags else PAUSE_S
    silence_s = None if "--patient" in flags else SILENCE_S
    host, port = address.rsplit(":", 1)
    with open("decisions.jsonl", "w", buffering=1) as log:
        for number, telegram in enumerate(scans(host, int(port), "--deaf" in flags, silence_s, pause_s)):
            try:
                near = sum(8 < distance < NEAR_MM for distance in distances_mm(telegram))
                counter = int(telegram.split(b" ")[7], 16)
            except (ValueError, IndexError):
                print("a telegram that cannot be read")
                continue
            log.write(json.dumps({"counter": counter, "near": near, "open": near > 20}) + "\n")
            if number + 1 == last:
                sys.exit("enough: %d scans" % last)


main(*sys.argv[1:])
