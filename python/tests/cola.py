"""The smallest client of a scanner: CoLa A over a socket."""

import socket

SUBSCRIBE = b"sEN LMDscandata 1"
LOGIN = b"sMN SetAccessMode 03 F4724744"


class Client:
    def __init__(self, address, patience_s=5.0):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)), timeout=patience_s)
        self.buffer = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def send(self, payload):
        self.socket.sendall(b"\x02" + payload + b"\x03")

    def receive(self):
        while b"\x03" not in self.buffer:
            more = self.socket.recv(65536)
            if not more:
                raise ConnectionError("the scanner has closed the connection")
            self.buffer += more
        telegram, self.buffer = self.buffer.split(b"\x03", 1)
        return telegram.lstrip(b"\x02")

    def ask(self, payload):
        self.send(payload)
        return self.receive()

    def scan(self):
        """The next scan's telegram counter."""
        while True:
            telegram = self.receive()
            if telegram.startswith(b"sSN LMDscandata"):
                return int(telegram.split()[7], 16)
