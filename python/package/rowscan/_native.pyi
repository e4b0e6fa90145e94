"""Types, shapes and units of the extension."""

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

_Path = Union[str, "os.PathLike[str]"]

__version__: str

class Error(ValueError):
    """What rowscan could not do, in the command line's words."""

class Orchard:
    """A grown orchard, and what is really there. It never changes.

    Places, rows and trees count from 0. Frame: X across the row (the first row's axis is 0), Y along the row, Z up; metres.
    """

    def __new__(cls, scene: _Path = "spindle", *, seed: Optional[int] = None, optics: Optional[str] = None, **keys: Any) -> Orchard:
        """Grows a built-in scene by its name, or a scene file; `seed` and `optics` instead of the scene's own.

        Further keywords are keys of `[orchard]`, as in a scene file and checked as strictly: `trees=20, target_lai=1.2`. Keys of other tables have their
        dots: `**{"orchard.tree.iterations": 8, "rig.speed_m_s": 0.5}`.
        """

    @property
    def scene(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def rows(self) -> int: ...
    @property
    def trees_per_row(self) -> int: ...
    @property
    def length_m(self) -> float: ...
    @property
    def row_spacing_m(self) -> Optional[float]: ...
    @property
    def tree_spacing_m(self) -> Optional[float]: ...
    @property
    def leaf_area_m2(self) -> float:
        """One-sided leaf area of the first row, m²."""

    @property
    def wood_area_m2(self) -> float:
        """Lateral surface of the first row's wood, m²."""

    @property
    def lai(self) -> Optional[float]:
        """Leaf area over ground of the first row."""

    @property
    def remarks(self) -> List[str]:
        """What was done to the input that nobody asked for word by word."""

    @property
    def truth(self) -> Dict[str, Any]:
        """What `rowscan orchard truth --format json` writes: areas of the first row, by tree, slab and height band."""

    @property
    def trees(self) -> List[Dict[str, Any]]:
        """The trees of the first row: `truth["trees"]`."""

    def cells(self, cell_m: float = 0.1, band_m: float = 0.5) -> Dict[str, NDArray[Any]]:
        """Exact areas by row, tree, cell along the row and height band, of all rows.

        Columns of one length: `row`, `tree` (uint32); `y_from_m`, `y_to_m`, `z_from_m`, `z_to_m`, `leaf_area_m2`, `wood_area_m2`,
        `fruit_area_m2` (float64). As `rowscan orchard truth --cells`.
        """

    def leaves(self) -> Leaves:
        """Every leaf of every row."""

    def svg(self, *, trees: Optional[int] = None, outlines: bool = False) -> str:
        """Front, side and top view as SVG, as `rowscan orchard export --svg`; a notebook shows it. trees: only so many, from the first place."""

    def png(self, view: str = "three-quarter", *, size: Tuple[int, int] = (1600, 900), trees: Optional[int] = None) -> bytes:
        """A shaded picture, as `rowscan orchard render`. view: "three-quarter", "side", "alley" or "top"."""

class Leaves:
    """Leaves as arrays, an entry a leaf."""

    row: NDArray[np.uint32]
    """(leaves,)"""
    tree: NDArray[np.uint32]
    """Place in the row, (leaves,)"""
    area_m2: NDArray[np.float64]
    """One-sided, (leaves,)"""
    normal: NDArray[np.float64]
    """Unit vectors, (leaves, 3)"""
    centre_m: NDArray[np.float64]
    """Centroids, (leaves, 3)"""
    vertices_m: NDArray[np.float64]
    """Outlines, leaf after leaf, (vertices, 3)"""
    first: NDArray[np.uint64]
    """Leaf i has the vertices `vertices_m[first[i]:first[i + 1]]`; (leaves + 1,)"""
    def __len__(self) -> int: ...

class ScanArrays:
    """The scans of one scanner as arrays."""

    @property
    def time_s(self) -> NDArray[np.float64]:
        """On the device's clock since the first scan, (scans,)."""

    @property
    def received_s(self) -> Optional[NDArray[np.float64]]:
        """When each was received, since the recording began, (scans,); zeros where a recording has no times. None of a drive."""

    @property
    def ranges_m(self) -> NDArray[np.float64]:
        """(scans, beams); NaN where a beam met nothing."""

    @property
    def remission(self) -> Optional[NDArray[np.uint16]]:
        """The device's digits, (scans, beams); None where not every scan has it."""

    @property
    def angles_deg(self) -> NDArray[np.float64]:
        """Where the beams point on the device's own scale, (beams,)."""

    @property
    def encoder_ticks(self) -> Optional[NDArray[np.uint32]]:
        """First encoder, wraps, (scans,); None where not every scan has it."""

    @property
    def telegram_counter(self) -> NDArray[np.uint16]:
        """Wraps, (scans,)."""

    @property
    def scan_counter(self) -> NDArray[np.uint16]:
        """Wraps, (scans,)."""

    @property
    def row_m(self) -> Optional[NDArray[np.float64]]:
        """Where the tractor is along its row, metres, (scans,). Of a drive; None of a recording, which does not know."""

    @property
    def speed_m_s(self) -> Optional[NDArray[np.float64]]:
        """How fast it drives, (scans,). Of a drive."""

    @property
    def imu(self) -> Optional[Dict[str, NDArray[Any]]]:
        """Readings of the scanner's inertial measurement unit, of a recording that holds some: `received_s`, `time_us` (readings,), `acceleration_m_s2` and
        `rate_rad_s` (readings, 3), `orientation_wxyz` (readings, 4)."""

    @property
    def wheel(self) -> Optional[Dict[str, NDArray[Any]]]:
        """Readings of its encoder, where that has telegrams of its own (picoScan150): `received_s`, `time_us`, `tick`, `speed` (readings,)."""

    def points(self, rig: Optional[_Path] = None, *, scanner: int = 0) -> Dict[str, NDArray[Any]]:
        """Every return as a point: `points_m` (returns, 3) float64, `scan` and `beam` (returns,) uint32.

        In the scene's frame where a rig is known: of a drive its own, of a recording `rig`. Else x along device angle 0°, y along 90°.
        """

    def to_pandas(self) -> Any:
        """A data frame with a row a beam of a scan, misses too: scan, time_s, beam, angle_deg, range_m, and remission, encoder_ticks,
        row_m and speed_m_s where they are known. Needs pandas."""

    def __len__(self) -> int: ...

class RowScan:
    """One of the paper's scans of a row."""

    areas: Dict[str, Any]
    """What `rowscan scan --format json` writes: `I_L`, `I_T`, `I_3L` (m²), hits by class, the layout"""
    ranges_m: NDArray[np.float64]
    """Matrix L: (lines, beams); NaN where a beam escapes"""
    swept: NDArray[np.float64]
    """Degrees of an angular scan, metres of an orthogonal one, (beams,)"""
    y_m: NDArray[np.float64]
    """Where each line is along the row, (lines,)"""
    points: Optional[Dict[str, NDArray[Any]]]
    """Every return with its truth: `points_m` (returns, 3); `class` (uint8: ground, leaf, wood, fruit, post, wire, grass), `tree`, `organ` (-1: none),
    `order` (from 1; the leaves behind a first leaf count on), `range_m`, `beam`, `line`, `cos_incidence` (returns,). None unless asked for."""

class Scanner:
    """A virtual scanner, or the scanners of one tractor, in this process.

    In a `with` block, or between `start()` and `stop()`, it listens. It answers any SICK client as `rowscan emulate` does.
    """

    def __new__(
        cls,
        model: Union[None, str, Sequence[str]] = None,
        scene: Union[_Path, Orchard] = "spindle",
        *,
        seed: Optional[int] = None,
        optics: Optional[str] = None,
        time_scale: Union[float, str] = 1.0,
        start_when: Optional[str] = None,
        tcp: Union[None, str, Sequence[str]] = None,
        pty: Optional[_Path] = None,
        can: Union[None, str, Sequence[str]] = None,
        nmea: Union[None, str, Sequence[str]] = None,
        faults: Union[None, _Path, Sequence[Mapping[str, Any]]] = None,
        rest: Union[None, str, Sequence[str]] = None,
        udp: Union[None, str, Sequence[str]] = None,
        allow_destination: Union[None, str, Sequence[str]] = None,
    ) -> Scanner:
        """
        model: the scanner's, instead of the rig's own; a list of them is the rig's first scanners on one tractor; an empty list the tractor alone.
        scene: a built-in scene's name, a scene file, or an `Orchard`.
        time_scale: simulated seconds a host second, or "max": as fast as clients take scans.
        start_when: "first", "all" or "now" (docs/tractor.md).
        tcp: where to listen, free ports of this machine unless told otherwise; of several scanners an address each.
        pty: the link by which an LMS2xx is found, a name of its own in the folder for temporary files unless told otherwise.
        can, nmea: as the command line's --can and --nmea, such as "slcan:./can" and "tcp:127.0.0.1:0".
        faults: a file of docs/faults.md, or dicts with the same keys.
        rest, udp: of scanners with Compact output (picoScan, multiScan), in their order: where REST is, a free port unless told otherwise, and where the
            datagrams go, such as "127.0.0.1:2115"; port 0 takes a free one, which `addresses` has.
        allow_destination: addresses besides those of this machine that clients may direct datagrams to.
        """

    def start(self) -> Scanner:
        """Grows the orchard (the first time) and listens. Does nothing if it runs."""

    def stop(self) -> None:
        """Ends it; its ports are closed when this returns. Does nothing if it does not run."""

    def __enter__(self) -> Scanner: ...
    def __exit__(self, *error: Any) -> None: ...
    @property
    def running(self) -> bool: ...
    @property
    def address(self) -> str:
        """Where the first scanner is: "127.0.0.1:41233", or a serial port's path."""

    @property
    def addresses(self) -> Dict[str, str]:
        """Where everything is: `scanner0`, `scanner1`, `can0`, `nmea0`, …; `scanner0:1` is the second address of one that listens at several."""

    @property
    def source(self) -> str:
        """What `estimate` reads the first scanner by: "tcp://127.0.0.1:41233"."""

    @property
    def model(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def state(self) -> Dict[str, Any]:
        """`time_s`, `time_scale`, `paused`, `steps`, `steps_granted`, `began_s`, `row_m`, `tree` (the last whose trunk was reached, from 1), and
        a dict for each scanner: `model`, `clients`, `scans_sent`, `scans_dropped`, `scans_missed`, or `bytes_lost` of an LMS2xx."""

    @property
    def time_s(self) -> float:
        """Simulated time since the start, seconds."""

    @property
    def row_m(self) -> Optional[float]:
        """Where the tractor is along its row, metres; None before the drive has started."""

    time_scale: Optional[float]
    """Simulated seconds a host second, can be set; None at "max"."""
    def pause(self) -> None:
        """Stops time. Clients are answered meanwhile."""

    def resume(self) -> None:
        """Lets time run on."""

    def step(self, count: int = 1, *, timeout: Optional[float] = 30.0) -> None:
        """Lets time take so many steps, a turn of a mirror each, and stops it then. `timeout`: seconds of the host; None waits for ever."""

    def until(
        self,
        *,
        tree: Optional[int] = None,
        row_m: Optional[float] = None,
        driven_s: Optional[float] = None,
        timeout: Optional[float] = 30.0,
    ) -> None:
        """Lets time run until the tractor has reached the trunk of this tree (from 1, as in faults) or this metre of the row, or has driven for so
        long, and stops it then."""

    def fault(self, name: str, **keys: Any) -> str:
        """Begins a fault of docs/faults.md, or has it wait for its time: `fault("drop", at={"scan": 20})`. `for_` stands for the key `for`.
        Its id."""

    def clear(self, id: Optional[str] = None) -> None:
        """Ends a fault by its id, or all."""

    @property
    def faults(self) -> List[Dict[str, Any]]:
        """Every fault on every stream: `id`, `name`, `on`, `state` ("waiting", "active", "done"), `acts`."""

    @property
    def log(self) -> List[str]:
        """What has happened lately, the last 1000 lines: telegrams both ways, and what faults did. Kept after the stop."""

def drive(
    orchard: Union[_Path, Orchard] = "spindle",
    model: Optional[str] = None,
    *,
    remission: bool = True,
    seed: Optional[int] = None,
    optics: Optional[str] = None,
) -> ScanArrays:
    """Drives the rig's first scanner once past the first row, in memory, as fast as it goes: the scans that a client of the same `Scanner` receives,
    bit for bit. remission: ask for it, of a scanner that speaks CoLa."""

def scan_row(
    orchard: Union[_Path, Orchard],
    kind: str = "lateral",
    *,
    row: int = 0,
    dy_m: Optional[float] = None,
    dtheta_deg: Optional[float] = None,
    pitch_m: Optional[float] = None,
    sampling: Optional[str] = None,
    distance_m: Optional[float] = None,
    height_m: Optional[float] = None,
    overhead_m: Optional[float] = None,
    range: Optional[Tuple[float, float]] = None,
    points: bool = False,
) -> RowScan:
    """Scans a row in one of the paper's six ways, with exact ranges and no device: "lateral", "opposite", "zenith", and each with "-orthogonal".
    Keywords as the flags of `rowscan scan`; what is left out is the command's own."""

def read(path: _Path, *, echo: int = 0, scans: Optional[int] = None) -> ScanArrays:
    """The scans of a recording: MCAP, pcap, pcapng, raw bytes, hex text, ranges as CSV; `FILE#STREAM` where it holds several.

    echo: which echo of each beam, from 0. scans: at most so many.
    """

def estimate(
    source: Union[_Path, ScanArrays],
    rig: Union[None, _Path, Orchard] = None,
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
) -> Dict[str, Any]:
    """What `rowscan estimate SOURCE --rig RIG --format json` writes: leaf area, impacted area, height, by row, tree and metre.

    source: tcp://HOST:PORT, serial:/dev/ttyUSB0, rfc2217://HOST:PORT, a recording, or the scans of `drive` or `read`. rig: a rig file, a scene, or an
    orchard; without it the one that a drive has, or a recording keeps, else areas are None. scanner: the rig's scanner this is, from 0; by default the one that a recording says, else 0. echo: "first" or "last". estimators: names, or "all"; then `side_by_side` has the row's
    numbers by each, beside the truth where `rig` is a scene or an orchard. trees: "trunk", "valley" or both, the ways to find trees in the data.
    profile: height of a band, 0.1 to 0.5 m; then `profile` has the canopy by height, of the row and of each tree.
    A live scanner ends with `scans` or `length_m`, or with Ctrl-C; where telegrams come for 10 s without a valid scan, with a warning.
    """

def study(path: _Path, *, seed: Optional[int] = None, repeats: Optional[int] = None) -> Tuple[Dict[str, Any], str]:
    """Runs a study (docs/studies.md) as `rowscan study run` does, on all cores: its report, and its figure as SVG.

    seed, repeats: instead of the file's.
    """

def check(
    scenarios: Union[_Path, Sequence[_Path]],
    *,
    seed: Optional[int] = None,
    fail_fast: bool = False,
    keep: Optional[_Path] = None,
    program: Optional[_Path] = None,
) -> List[Dict[str, Any]]:
    """Tries scenarios (docs/bench.md) as `rowscan check` does: a dict for each scenario and seed.

    `verdict` ("passed", "skipped", "failed", "error": the worst of its cases), `text` (what the command line writes of it), `scenario`,
    `name`, `seed`, `cases` (dicts with `name`, `verdict`, `message`, `t_s`, `row_m`, `last_events`, `rerun`), `events`, `output` (the end of what its children wrote), `facts`, `simulated_s`, `wall_s`.

    seed: only this one. keep: a folder for the runs' own folders, which go again without it. program: what stands for `{rowscan}` in a scenario.
    A scenario that is not sound does not raise: its verdict is "error".
    """
