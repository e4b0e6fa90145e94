"""The peers that are Python packages, each as a child process of `beside.py`: `peers.py NAME TRIANGLES`.

A child loads the triangles, casts one line, prints it as JSON, and then answers each line of standard input: `ready`, `drive`, `ranges FILE`. The parent reads its processor time from /proc.
"""

import json
import sys
from pathlib import Path
from typing import Callable, Dict, NamedTuple

import numpy as np

import drive

#: Casts rays that were prepared for the peer; gives ranges in metres, infinite where a ray meets nothing.
Cast = Callable[[object], np.ndarray]


class Peer(NamedTuple):
    """A peer with its mesh: how rays are prepared for it, and how they are cast."""

    prepare: Callable[[np.ndarray, np.ndarray], object]
    cast: Cast


def embree(mesh: Path) -> Peer:
    """Embree by its Python wheel, one ray at a time within C."""
    from embreex import mesh_construction, rtcore_scene

    found = drive.read_ply(mesh)
    scene = rtcore_scene.EmbreeScene()
    built = mesh_construction.TriangleMesh(scene, found.vertices, found.faces)

    def cast(rays: object) -> np.ndarray:
        assert built is not None
        ranges = scene.run(*rays, query="DISTANCE")
        # Embree's binding writes 1e37 where nothing is met.
        return np.where(ranges < 1e6, ranges, np.inf)

    return Peer(lambda origins, directions: (origins.astype(np.float32), directions.astype(np.float32)), cast)


def open3d(mesh: Path) -> Peer:
    """Open3D's RaycastingScene, on one thread."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(open3d.t.io.read_triangle_mesh(str(mesh)))

    def prepare(origins: np.ndarray, directions: np.ndarray) -> object:
        return open3d.core.Tensor(np.concatenate([origins, directions], axis=1).astype(np.float32))

    return Peer(prepare, lambda rays: scene.cast_rays(rays, nthreads=1)["t_hit"].numpy())


def trimesh(mesh: Path) -> Peer:
    """trimesh without Embree: NumPy, and an R-tree of the triangles' boxes."""
    import trimesh
    from trimesh.ray.ray_triangle import RayMeshIntersector

    tree = RayMeshIntersector(trimesh.load(mesh, process=False))

    def cast(rays: object) -> np.ndarray:
        origins, directions = rays
        places, ray, _ = tree.intersects_location(origins, directions, multiple_hits=False)
        ranges = np.full(len(origins), np.inf)
        ranges[ray] = np.linalg.norm(places - origins[ray], axis=1)
        return ranges

    return Peer(lambda origins, directions: (origins, directions), cast)


def helios(_mesh: Path) -> Peer:
    """HELIOS++: PyPI and Debian have no package of it (`pyhelios` and `pyhelios3d` are other projects), and this script installs from them only."""
    raise ImportError("no package on PyPI or in Debian, only `conda install -c conda-forge helios`")


#: The peers by name, and how many lines of the drive they cast in a round.
PEERS: Dict[str, Callable[[Path], Peer]] = {"embree": embree, "open3d": open3d, "trimesh": trimesh, "helios++": helios}
LINES = {"trimesh": 2}


def say(**what: object) -> None:
    """One line of JSON to the parent."""
    print(json.dumps(what), flush=True)


def main() -> int:
    """Answers the parent until it closes standard input."""
    name, mesh = sys.argv[1], Path(sys.argv[2])
    try:
        peer = PEERS[name](mesh)
    except (ImportError, OSError) as why:
        # A library of the system that is not there, such as OpenGL's, is an OSError.
        say(missing=str(why).partition("\n")[0])
        return 0
    peer.cast(peer.prepare(*drive.rays(1)))
    say(first=drive.BEAMS)
    rays = None
    for line in sys.stdin:
        asked = line.rstrip("\n").split(" ", 1)
        # Not before the parent asks: what the rays take is no part of what the first line took.
        if rays is None:
            origins, directions = drive.rays(LINES.get(name, drive.LINES))
            rays = peer.prepare(origins, directions)
        if asked[0] != "ready":
            ranges = peer.cast(rays)
        if asked[0] == "ranges":
            Path(asked[1]).write_bytes(np.asarray(ranges, dtype="<f8").tobytes())
        say(rays=len(origins))
    return 0


if __name__ == "__main__":
    sys.exit(main())
