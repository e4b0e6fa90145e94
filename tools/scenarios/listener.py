"""Listens to a whole tractor: scans in CoLa A, GNSS sentences, CAN frames through slcan; says on the bus that it is there, and what it misses.

usage: listener.py SCANNER NMEA CAN_PATH
"""

import os
import select
import signal
import socket
import sys
import time
import tty

SILENCE_S = 0.4  # without a frame for so long the bus is silent: ground speed comes every 0.1 s
FAR_DEG = 1e-4  # some ten metres
LONG_S = 60.0


def connect(address):
    host, port = address.rsplit(":", 1)
    return socket.create_connection((host, int(port)))


class Gnss:
    """What sentences tell, beside what they told before."""

    def __init__(self):
        self.fix = self.latitude = self.utc_s = None

    def sentence(self, words):
        if not words[0].endswith("GGA"):
            return
        fix, before = words[6] != "0", self.fix
        if fix != before:
            print("hears position" if fix else "no fix", flush=True)
        self.fix = fix
        if words[1]:
            utc_s = int(words[1][:2]) * 3600 + int(words[1][2:4]) * 60 + float(words[1][4:])
            if self.utc_s is not None and abs(utc_s - self.utc_s) > LONG_S:
                print("time jumps", flush=True)
            self.utc_s = utc_s
        if fix and words[2]:
            latitude = float(words[2][:2]) + float(words[2][2:]) / 60
            if self.latitude is not None and abs(latitude - self.latitude) > FAR_DEG:
                print("position jumps", flush=True)
            self.latitude = latitude


def main(scanner, nmea, can_path):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    can = os.open(can_path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(can)
    os.write(can, b"C\rS5\rO\r")
    scans, gnss = connect(scanner), connect(nmea)
    scans.sendall(b"\x02sEN LMDscandata 1\x03")
    # Priority 6, group FF10 of address 80: nobody's, and somebody waits for it.
    os.write(can, b"T18FF1080101\r")
    ends = {scans.fileno(): b"\x03", gnss.fileno(): b"\r\n", can: b"\r"}
    rest, heard, told, receiver = dict.fromkeys(ends, b""), {}, set(), Gnss()
    while True:
        for stream in select.select(list(ends), [], [], SILENCE_S / 4)[0]:
            try:
                data = os.read(stream, 65536)
            except OSError:  # what a pseudo-terminal says when its other end is gone
                data = b""
            if not data:
                return
            *whole, rest[stream] = (rest[stream] + data).split(ends[stream])
            for message in whole:
                if stream == can and b"FE49" in message:
                    heard[can] = time.monotonic()
                what = {scans.fileno(): b"LMDscandata", can: b"FE49"}.get(stream)
                if what and what in message and what not in told:
                    told.add(what)
                    print("hears scans" if stream != can else "hears ground speed", flush=True)
                if stream == gnss.fileno():
                    receiver.sentence(message.decode().split(","))
        if can in heard and time.monotonic() - heard[can] > SILENCE_S:
            del heard[can]
            told.discard(b"FE49")
            print("no ground speed", flush=True)


main(*sys.argv[1:])
