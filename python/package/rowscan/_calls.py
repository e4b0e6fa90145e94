"""Calls of the extension whose documents become results."""

import functools
import os
from typing import Any, Optional, Sequence, Union

from rowscan import _native
from rowscan._results import Estimate, StudyReport

_Path = Union[str, "os.PathLike[str]"]


@functools.wraps(_native.estimate)
def estimate(
    source: Union[_Path, _native.ScanArrays],
    rig: Union[None, _Path, _native.Orchard] = None,
    *,
    scanner: Optional[int] = None,
    model: Optional[str] = None,
    echo: Optional[str] = None,
    calibration: Optional[_Path] = None,
    scans: Optional[int] = None,
    length_m: Optional[float] = None,
    hertz: Optional[float] = None,
    estimators: Union[None, str, Sequence[str]] = None,
    trees: Union[None, str, Sequence[str]] = None,
    profile: Optional[float] = None,
) -> Estimate:
    keywords: Any = dict(scanner=scanner, model=model, echo=echo, calibration=calibration, scans=scans, profile=profile)
    return Estimate(_native.estimate(source, rig, length_m=length_m, hertz=hertz, estimators=estimators, trees=trees, **keywords))


@functools.wraps(_native.study)
def study(path: _Path, *, seed: Optional[int] = None, repeats: Optional[int] = None) -> StudyReport:
    return StudyReport(*_native.study(path, seed=seed, repeats=repeats))
