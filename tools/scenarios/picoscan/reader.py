"""A controller on the datagrams of a picoScan or multiScan, with plain sockets: it puts the segments of a turn together, of the line nearest to the
level, and decides once a turn whether the nozzles open.

usage: reader.py HOST:PORT [--rest HOST:PORT] [--to ADDRESS] [--deaf]

It binds HOST:PORT (port 0: a free one). With --rest it directs the scanner there itself, as SICK's clients do, or to ADDRESS; without, the scanner must stream already.
"""

import hashlib
import json
import signal
import socket
import struct
import sys
import time
import urllib.request
import zlib

NEAR_MM = 2000  # canopy is what is nearer than this
HEAD = struct.Struct("<4sIQQII")  # a scan telegram, version 4, up to its first module
MODULE = struct.Struct("<QQIIII")  # a module up to its lines: segment, turn, sender, lines, beams, echoes
TAIL = struct.Struct("<fIBBBB")  # and behind them: scale, size of the next module, content


class Scanner:
    """The REST interface."""

    def __init__(self, address):
        self.address = address

    def _ask(self, name, body):
        request = urllib.request.Request("http://%s/api/%s" % (self.address, name), json.dumps(body).encode())
        with urllib.request.urlopen(request, timeout=10) as answer:
            told = json.load(answer)
        if told["header"]["status"]:
            sys.exit("%s: %s" % (name, told["header"]))
        return told

    def post(self, name, **data):
        c = self._ask("getChallenge", {"data": {"user": "Service"}})["challenge"]
        hashed = lambda *parts: hashlib.sha256(b":".join(parts)).hexdigest().encode()  # noqa: E731
        who = hashed(b"Service", c["realm"].encode(), b"servicelevel", bytes(c["salt"]))
        response = hashed(who, c["nonce"].encode(), hashed(b"POST", name.encode())).decode()
        header = {"user": "Service", "realm": c["realm"], "nonce": c["nonce"], "opaque": c["opaque"], "response": response}
        self._ask(name, {"header": header, "data": data})

    def direct(self, host, port):
        place = {"Protocol": 1, "IPAddress": [int(part) for part in host.split(".")], "Port": port}
        self.post("ScanDataEthSettings", ScanDataEthSettings=place)
        self.post("ScanDataFormat", ScanDataFormat=2)
        self.post("ScanDataEnable", ScanDataEnable=True)


def segment(datagram):
    """Number of the turn, of the segment, and the ranges of its first echo; none of other telegrams."""
    if datagram[:8] != b"\2\2\2\2\1\0\0\0":
        return None
    if zlib.crc32(datagram[:-4]) != int.from_bytes(datagram[-4:], "little"):
        sys.exit("a telegram with a wrong checksum")
    at, size, found = HEAD.size, HEAD.unpack_from(datagram)[5], []
    while size:
        number, turn, _, lines, beams, echoes = MODULE.unpack_from(datagram, at)
        angles = at + MODULE.size + 16 * lines
        first = angles + 12 * lines + TAIL.size
        beam = 4 * echoes + 3
        for line, phi in enumerate(struct.unpack_from("<%df" % lines, datagram, angles)):
            places = (first + beam * (lines * number + line) for number in range(beams))
            found.append((abs(phi), [struct.unpack_from("<H", datagram, place)[0] for place in places]))
        at, size = at + size, TAIL.unpack_from(datagram, first - TAIL.size)[1]
    return turn, number, min(found)[1]


def main(address, *flags):
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    value = lambda flag, default=None: flags[flags.index(flag) + 1] if flag in flags else default  # noqa: E731
    host, port = address.rsplit(":", 1)
    taker = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taker.bind((host, int(port)))
    if "--rest" in flags:
        Scanner(value("--rest")).direct(value("--to", host), taker.getsockname()[1])
    print("ready")
    while "--deaf" in flags:
        time.sleep(1)
    turn, seen, near = None, 0, 0
    with open("decisions.jsonl", "w", buffering=1) as log:
        while True:
            found = segment(taker.recv(65536))
            if found is None:
                continue
            if found[0] != turn:
                if turn is not None:
                    log.write(json.dumps({"turn": turn, "segments": seen, "near": near, "open": near > 20}) + "\n")
                turn, seen, near = found[0], 0, 0
            seen += 1
            near += sum(8 < distance < NEAR_MM for distance in found[2])


main(*sys.argv[1:])
