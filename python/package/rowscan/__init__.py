"""Virtual SICK LMS laser scanners in virtual orchards, for tests of the programs that read one.

>>> import rowscan
>>> with rowscan.Scanner("lms111", "spindle") as scanner:
...     scanner.address  # doctest: +ELLIPSIS
'127.0.0.1:...'

Lengths are metres, areas m², angles degrees, times seconds, unless a name ends in something else. What is not known is None, or NaN in
an array, and never 0. What cannot be done raises `Error` with the command line's own words. Long calls release the interpreter's lock,
and Ctrl-C ends them.
"""

import warnings as _warnings

from rowscan._calls import estimate, study
from rowscan._native import Error, Leaves, Orchard, RowScan, ScanArrays, Scanner, __version__, check, drive, read, scan_row
from rowscan._results import Estimate, StudyReport

__all__ = [
    "Error",
    "Estimate",
    "Leaves",
    "Orchard",
    "RowScan",
    "ScanArrays",
    "Scanner",
    "StudyReport",
    "__version__",
    "check",
    "drive",
    "estimate",
    "read",
    "scan_row",
    "study",
]

#: Names of 0.2, for one release: scan, Scan, Scans and Scanner could not be told apart.
_OLD = {"scan": "scan_row", "Scan": "RowScan", "Scans": "ScanArrays"}


def __getattr__(name):
    new = _OLD.get(name)
    if new is None:
        raise AttributeError("module 'rowscan' has no attribute %r" % name)
    _warnings.warn("rowscan.%s is now rowscan.%s; the old name goes with the next release" % (name, new), DeprecationWarning, stacklevel=2)
    return globals()[new]
