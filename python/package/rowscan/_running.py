"""Scanners that run: they are stopped before the interpreter goes, so that no link to a terminal stays behind."""

import atexit
import weakref

_running = weakref.WeakSet()


def keep(scanner):
    """Stops `scanner` at the end, if it still runs then."""
    _running.add(scanner)


@atexit.register
def _stop_all():
    for scanner in list(_running):
        scanner.stop()
