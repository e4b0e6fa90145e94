"""Listens to a whole tractor: scans in CoLa A, GNSS sentences, CAN frames through slcan; says on the bus that it is there.

usage: listener.py SCANNER NMEA CAN_PATH
"""

import os
import select
import signal
import socket
import sys
import tty


def connect(address):
    host, port = address.rsplit(":", 1)
    return socket.create_connection((host, int(port)))


def main(scanner, nmea, can_path):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    can = os.open(can_path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(can)
    os.write(can, b"C\rS5\rO\r")
    scans, gnss = connect(scanner), connect(nmea)
    scans.sendall(b"\x02sEN LMDscandata 1\x03")
    # Priority 6, group FF10 of address 80: nobody's, and somebody waits for it.
    os.write(can, b"T18FF1080101\r")
    wanted = {b"sSN LMDscandata": "scans", b"$GPGGA": "position", b"$GNGGA": "position", b"FE49": "ground speed"}
    streams = {scans.fileno(): b"", gnss.fileno(): b"", can: b""}
    while True:
        for stream in select.select(list(streams), [], [])[0]:
            try:
                data = os.read(stream, 65536)
            except OSError:  # what a pseudo-terminal says when its other end is gone
                data = b""
            if not data:
                return
            streams[stream] = (streams[stream] + data)[-65536:]
            for mark in [mark for mark in wanted if mark in streams[stream]]:
                print("hears", wanted.pop(mark), flush=True)


main(*sys.argv[1:])
