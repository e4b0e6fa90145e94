"""Virtual SICK LMS laser scanners in virtual orchards, for tests of the programs that read one.

>>> import rowscan
>>> with rowscan.Scanner("lms111", "spindle") as scanner:
...     scanner.address  # doctest: +ELLIPSIS
'127.0.0.1:...'

Lengths are metres, areas m², angles degrees, times seconds, unless a name ends in something else. What is not known is None, or NaN in
an array, and never 0. What cannot be done raises `Error` with the command line's own words. Long calls release the interpreter's lock,
and Ctrl-C ends them.
"""

from rowscan._native import Error, Leaves, Orchard, Scan, Scanner, Scans, __version__, check, drive, estimate, read, scan

__all__ = ["Error", "Leaves", "Orchard", "Scan", "Scanner", "Scans", "__version__", "check", "drive", "estimate", "read", "scan"]
