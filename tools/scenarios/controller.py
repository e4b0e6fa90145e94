"""A controller of 44 lines: reads scans in CoLa A and decides on each of them whether the nozzles open.

usage: controller.py HOST:PORT [--quit-after N] [--deaf]
"""

import json
import signal
import socket
import sys

NEAR_MM = 2000  # canopy is what is nearer than this


def telegrams(connection):
    rest = b""
    while chunk := connection.recv(65536):
        *whole, rest = (rest + chunk).split(b"\x03")
        yield from (telegram.lstrip(b"\x02") for telegram in whole)


def distances_mm(telegram):
    fields = telegram.split(b" ")
    start = fields.index(b"DIST1")
    return [int(field, 16) for field in fields[start + 6 : start + 6 + int(fields[start + 5], 16)]]


def main(address, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    last = int(flags[flags.index("--quit-after") + 1]) if "--quit-after" in flags else None
    host, port = address.rsplit(":", 1)
    with socket.create_connection((host, int(port))) as connection, open("decisions.jsonl", "w", buffering=1) as log:
        if "--deaf" not in flags:
            connection.sendall(b"\x02sEN LMDscandata 1\x03")
        print("connected")
        for number, telegram in enumerate(t for t in telegrams(connection) if t.startswith(b"sSN LMDscandata ")):
            near = sum(8 < distance < NEAR_MM for distance in distances_mm(telegram))
            counter = int(telegram.split(b" ")[7], 16)
            log.write(json.dumps({"counter": counter, "near": near, "open": near > 20}) + "\n")
            if number + 1 == last:
                sys.exit("enough: %d scans" % last)
    print("the scanner has gone")


main(*sys.argv[1:])
