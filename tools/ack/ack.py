"""Acknowledges the steps of `rowscan emulate --clock lockstep --ack reply:HOST:PORT`.

    steps = Steps("127.0.0.1:4000")
    for number, time_ns in steps:      # step `number` is out; simulated time is `time_ns`
        work_in_what_has_arrived()     # read what is there on every stream
        steps.acknowledge(number)      # the next step comes only after that
"""

import socket


class Steps:
    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self._socket = socket.create_connection((host, int(port)))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._lines = self._socket.makefile("r", encoding="ascii", newline="\n")

    def fileno(self):
        """For select()."""
        return self._socket.fileno()

    def __iter__(self):
        for line in self._lines:
            _, number, time_ns = line.split()
            yield int(number), int(time_ns)

    def acknowledge(self, number):
        self._socket.sendall(b"ACK %d\n" % number)
