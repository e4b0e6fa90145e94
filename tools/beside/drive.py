"""The drive that is measured: its rays, and the row as triangles."""

import math
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

import numpy as np

#: An LMS111 sees 270 degrees in steps of half a degree. 0 looks at the row, 90 up.
BEAMS = 541
FIRST_DEG = -135.0
STEP_DEG = 0.5

#: Lines of a drive, how far they are apart, and where the mirror is: metres. X is across the row, Y along it, Z up.
LINES = 900
LINE_M = 0.02
MIRROR_X_M = -1.9
MIRROR_Z_M = 1.6

#: Length of the row, metres: beyond it the row begins again.
PERIOD_M = LINES * LINE_M

#: How far a copy of the row reaches into this one at its ends, metres.
OVERHANG_M = 1.0

#: Half of the ground across the row, metres: the flattest beam meets it 183 m away.
GROUND_M = 200.0

Files = Dict[str, Path]


class Triangles(NamedTuple):
    """A mesh: vertices (n, 3) float32, metres; faces (m, 3) int32."""

    vertices: np.ndarray
    faces: np.ndarray


def angles_rad() -> np.ndarray:
    """Angle of every beam of a line, (541,)."""
    return np.radians(FIRST_DEG + STEP_DEG * np.arange(BEAMS))


def rays(lines: int = LINES) -> Tuple[np.ndarray, np.ndarray]:
    """Origins and unit directions of so many lines, spread over the drive: two arrays (lines * 541, 3), line by line."""
    angles = angles_rad()
    fan = np.stack([np.cos(angles), np.zeros(BEAMS), np.sin(angles)], axis=1)
    along = line_numbers(lines) * LINE_M
    stations = np.stack([np.full(lines, MIRROR_X_M), along, np.full(lines, MIRROR_Z_M)], axis=1)
    return np.repeat(stations, BEAMS, axis=0), np.tile(fan, (lines, 1))


def line_numbers(lines: int) -> np.ndarray:
    """Which lines of the drive those are, the first one among them."""
    return np.arange(lines) * (LINES // lines)


def read_polygons(path: Path) -> List[np.ndarray]:
    """The faces of a PLY that rowscan has written, each (corners, 3) float32."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    counts = {words[1]: int(words[2]) for words in map(bytes.split, header.splitlines()) if words[0] == b"element"}
    vertices = np.frombuffer(body, "<f4", counts[b"vertex"] * 3).reshape(-1, 3)
    found, at = [], vertices.nbytes
    for _ in range(counts[b"face"]):
        corners = int.from_bytes(body[at : at + 2], "little")
        found.append(vertices[np.frombuffer(body, "<u4", corners, at + 2)])
        # A count of 16 bits, the corners, the material and the tree.
        at += 2 + 4 * corners + 5
    return found


def with_neighbours(polygons: List[np.ndarray]) -> List[np.ndarray]:
    """The faces, and those of the row before and the row behind that reach into this one."""
    shifted = [polygon + np.float32([0, shift, 0]) for shift in (-PERIOD_M, PERIOD_M) for polygon in polygons]
    reach = [p for p in shifted if p[:, 1].max() >= -OVERHANG_M and p[:, 1].min() <= PERIOD_M + OVERHANG_M]
    return polygons + reach


def ground() -> np.ndarray:
    """The ground as one face at Z = 0, which all beams of the drive that look down meet."""
    ends = (-OVERHANG_M, PERIOD_M + OVERHANG_M)
    corners = [(-GROUND_M, ends[0]), (GROUND_M, ends[0]), (GROUND_M, ends[1]), (-GROUND_M, ends[1])]
    return np.float32([(x, y, 0.0) for x, y in corners])


def triangles(polygons: List[np.ndarray]) -> Triangles:
    """The faces, which are convex, as fans of triangles about their first corners."""
    starts = np.cumsum([0] + [len(polygon) for polygon in polygons])
    fans = [
        (start, start + corner, start + corner + 1)
        for start, polygon in zip(starts, polygons)
        for corner in range(1, len(polygon) - 1)
    ]
    return Triangles(np.concatenate(polygons), np.array(fans, dtype=np.int32))


def write_ply(mesh: Triangles, path: Path) -> None:
    """Writes triangles as binary PLY, which all peers read."""
    header = (
        "ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
        "element face %d\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(mesh.faces), dtype=[("corners", "u1"), ("vertices", "<i4", 3)])
    faces["corners"], faces["vertices"] = 3, mesh.faces
    text = header % (len(mesh.vertices), len(mesh.faces))
    path.write_bytes(text.encode() + mesh.vertices.astype("<f4").tobytes() + faces.tobytes())


def read_ply(path: Path) -> Triangles:
    """Reads what `write_ply` has written."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    counts = {words[1]: int(words[2]) for words in map(bytes.split, header.splitlines()) if words[0] == b"element"}
    vertices = np.frombuffer(body, "<f4", counts[b"vertex"] * 3).reshape(-1, 3)
    faces = np.frombuffer(body, np.dtype([("corners", "u1"), ("vertices", "<i4", 3)]), counts[b"face"], vertices.nbytes)
    return Triangles(vertices, np.ascontiguousarray(faces["vertices"]))


#: A scene that reads the row from the mesh: the same faces as those of the peers.
MESH_SCENE = """version = 2
name = "row"
[orchard]
generator = "import"
trees = 12
tree_spacing_m = %r
row_spacing_m = 4.0
[orchard.import]
mesh = "row.ply"
stands = "in_place"
""" % (PERIOD_M / 12)


def write_files(polygons_file: Path, folder: Path) -> Files:
    """Writes the row for rowscan (a scene that names the mesh) and for the peers (triangles)."""
    files = {"scene": folder / "row.toml", "triangles": folder / "triangles.ply"}
    files["scene"].write_text(MESH_SCENE)
    write_ply(triangles(with_neighbours(read_polygons(polygons_file)) + [ground()]), files["triangles"])
    return files


def agreement(ours: np.ndarray, theirs: np.ndarray, within_m: float = 1e-3) -> float:
    """Share of rays whose ranges differ by no more than `within_m`; two rays that meet nothing agree."""
    both_miss = ~np.isfinite(ours) & ~np.isfinite(theirs)
    with np.errstate(invalid="ignore"):
        near = np.abs(ours - theirs) <= within_m
    return float(np.mean(near | both_miss))


def median_and_spread(values: List[float]) -> Tuple[float, float, float]:
    """Median, least and greatest."""
    if not values or not all(math.isfinite(value) for value in values):
        raise ValueError("a median of no number: %s" % values)
    return float(np.median(values)), min(values), max(values)
