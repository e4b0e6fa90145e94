"""rowscan's ray caster beside the peers that users know: same row, same rays, one core, ratios.

`cargo xtask beside` prepares what this needs and runs it: `beside.py PROGRAM FOLDER [--rounds N] [--json]`, where PROGRAM is the
built `rowscan-benches`. Every round starts each program anew, in turn. The exit code is 1 if fewer than two peers could be measured, or if
the ranges of a peer disagree with rowscan's for more than 3 % of the rays.
"""

import argparse
import importlib.metadata
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional, Sequence

import numpy as np

import drive
import peers

#: The scene, and the share of rays that may disagree.
SCENE = "spindle"
MOST_APART = 0.03

#: Peers that must be there.
FEWEST_PEERS = 2

#: Seconds of processor time that casting takes at least in a round.
LEAST_S = 1.0

#: What `/proc` counts processor time in.
TICKS_PER_S = os.sysconf("SC_CLK_TCK")

#: rowscan with the peers' own faces, which all ranges are held to, and with the scene itself. Peers are compared with both.
MESH = "rowscan, the mesh"
GROWN = "rowscan, the scene"


class Subject(NamedTuple):
    """A program that is measured: its name in tables, its command, its version."""

    name: str
    command: List[str]
    version: str


class Round(NamedTuple):
    """What one fresh process did: rays a second of processor time, processor time from its start to the first line, the most memory until
    then in MB."""

    rays_per_s: float
    first_s: float
    memory_mb: float


class Missing(Exception):
    """A peer that is not there, and why."""


class Child:
    """A process on one core that is asked for drives."""

    def __init__(self, subject: Subject, core: int):
        environment = dict(os.environ, RAYON_NUM_THREADS="1", OMP_NUM_THREADS="1")
        self.process = subprocess.Popen(
            subject.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            preexec_fn=lambda: os.sched_setaffinity(0, {core}),
        )
        self.first = self.heard()

    def heard(self) -> Dict[str, object]:
        """The next line of JSON."""
        for line in self.process.stdout:
            # Libraries may print lines of their own.
            if line.startswith("{"):
                return json.loads(line)
        raise RuntimeError("%s ended with code %s" % (self.process.args[:2], self.process.wait()))

    def ask(self, what: str) -> Dict[str, object]:
        """Asks, and waits for the answer."""
        self.process.stdin.write(what + "\n")
        self.process.stdin.flush()
        return self.heard()

    def processor_s(self) -> float:
        """Processor time of the process so far, all threads: other work on the machine does not count."""
        # The name before the closing bracket may have spaces; user and system time are fields 14 and 15.
        fields = Path("/proc/%d/stat" % self.process.pid).read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICKS_PER_S

    def memory_mb(self) -> float:
        """The most memory that the process has had so far."""
        lines = Path("/proc/%d/status" % self.process.pid).read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024e-6

    def close(self) -> None:
        """Ends it."""
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()


def started(subject: Subject, core: int) -> Child:
    """A child that has cast its first line."""
    child = Child(subject, core)
    if "missing" in child.first:
        child.close()
        raise Missing(child.first["missing"])
    return child


def one_round(subject: Subject, core: int) -> Round:
    """Starts the program, waits for its first line, and lets it drive for a while."""
    child = started(subject, core)
    first_s, memory_mb = child.processor_s(), child.memory_mb()
    child.ask("ready")
    begun_s, rays, seconds = child.processor_s(), 0, 0.0
    while seconds < LEAST_S:
        rays += child.ask("drive")["rays"]
        seconds = child.processor_s() - begun_s
    child.close()
    return Round(rays / seconds, first_s, memory_mb)


def ranges(subject: Subject, core: int, file: Path) -> np.ndarray:
    """Ranges of a drive, (lines, beams); fewer lines where the peer is slow."""
    child = started(subject, core)
    child.ask("ranges %s" % file)
    child.close()
    return np.fromfile(file, "<f8").reshape(-1, drive.BEAMS)


def version(package: str) -> str:
    """The installed version of a package."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""


def subjects(program: str, files: drive.Files) -> List[Subject]:
    """rowscan with the mesh first, then with the scene that the mesh is of, then the peers."""
    script = str(Path(peers.__file__))
    mesh = str(files["triangles"])
    packages = {"embree": "embreex"}
    python = [
        Subject(name, [sys.executable, script, name, mesh], version(packages.get(name, name))) for name in peers.PEERS
    ]
    return [
        Subject(MESH, [program, "beside", "caster", str(files["scene"])], ""),
        Subject(GROWN, [program, "beside", "caster", SCENE], ""),
        Subject("parry3d", [program, "beside", "parry3d", mesh], "0.31"),
        *python,
    ]


def ratios(ours: Sequence[Round], theirs: Sequence[Round]) -> Dict[str, Dict[str, float]]:
    """How many times better rowscan is, round by round: median, least, greatest. Above 1 rowscan is ahead, below 1 the peer."""
    pairs = list(zip(ours, theirs))
    found = {
        "rays_per_s": [mine.rays_per_s / peer.rays_per_s for mine, peer in pairs],
        "first_s": [peer.first_s / mine.first_s for mine, peer in pairs],
        "memory_mb": [peer.memory_mb / mine.memory_mb for mine, peer in pairs],
    }
    return {key: dict(zip(("median", "least", "greatest"), drive.median_and_spread(of))) for key, of in found.items()}


def measure(of: List[Subject], core: int, rounds: int, folder: Path) -> List[Dict[str, object]]:
    """A row for each subject: its agreement with both ways of ours and its ratios to them, or why it is missing."""
    rows: List[Dict[str, object]] = []
    there: List[Subject] = []
    held_to: Dict[str, np.ndarray] = {}
    for subject in of:
        row: Dict[str, object] = {"name": subject.name, "version": subject.version}
        try:
            found = ranges(subject, core, folder / "ranges.f64")
            if subject.name in (MESH, GROWN):
                held_to[subject.name] = found
            row["found"] = found
            row["rays"] = found.size
            there.append(subject)
        except Missing as why:
            row["missing"] = str(why)
        rows.append(row)
    for row in rows:
        if "missing" not in row:
            found = row.pop("found")
            lines = drive.line_numbers(len(found))
            row["agree"] = {name: drive.agreement(ours[lines], found) for name, ours in held_to.items()}
    done: Dict[str, List[Round]] = {subject.name: [] for subject in there}
    for number in range(rounds):
        print("round %d of %d" % (number + 1, rounds), file=sys.stderr)
        for subject in there:
            done[subject.name].append(one_round(subject, core))
    for row in rows:
        if "missing" not in row:
            row["ratios"] = {ours: ratios(done[ours], done[row["name"]]) for ours in (MESH, GROWN)}
            row["median"] = Round(*np.median(done[row["name"]], axis=0).tolist())._asdict()
    return rows


def refusal(rows: List[Dict[str, object]]) -> Optional[str]:
    """Why the comparison does not hold; None if it does."""
    others = [row for row in rows if row["name"] not in (MESH, GROWN)]
    measured = [row for row in others if "missing" not in row]
    if len(measured) < FEWEST_PEERS:
        return "peers measured: %d; at least %d must be" % (len(measured), FEWEST_PEERS)
    for row in measured:
        apart = 1.0 - row["agree"][MESH]
        if apart > MOST_APART:
            return "%s disagrees with rowscan for %.1f %% of the rays" % (row["name"], 100 * apart)
    return None


def cell(ratio: Dict[str, float]) -> str:
    """A ratio with its spread."""
    return "%s (%s to %s)" % tuple(short(ratio[key]) for key in ("median", "least", "greatest"))


def short(ratio: float) -> str:
    """Two digits, or all before the point of a large one."""
    return "%.0f" % ratio if ratio >= 10 else "%.1f" % ratio if ratio >= 1 else "%.2f" % ratio


def table(rows: List[Dict[str, object]], ours: str) -> str:
    """The ratios to one way of ours as Markdown."""
    lines = ["| beside %s | same ranges | rays a second | file to first scan | memory |" % ours, "|---|---|---|---|---|"]
    for row in rows:
        name = ("%s %s" % (row["name"], row["version"])).strip()
        if "missing" in row:
            lines.append("| %s | not there: %s |  |  |  |" % (name, row["missing"]))
        elif row["name"] != ours:
            found = [cell(row["ratios"][ours][key]) for key in ("rays_per_s", "first_s", "memory_mb")]
            lines.append("| %s | %.2f %% | %s |" % (name, 100 * row["agree"][ours], " | ".join(found)))
    return "\n".join(lines)


def machine() -> Dict[str, object]:
    """Which machine it was."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {"cpu": names[0] if names else platform.machine(), "cores": os.cpu_count(), "python": platform.python_version()}


def main() -> int:
    """Prepares the row, measures, prints."""
    parser = argparse.ArgumentParser(description="rowscan's ray caster beside its peers")
    parser.add_argument("program", help="the built rowscan-benches")
    parser.add_argument("folder", type=Path, help="where files of the run are kept")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    polygons = asked.folder / "row.ply"
    subprocess.run([asked.program, "beside", "export", SCENE, str(polygons)], check=True)
    files = drive.write_files(polygons, asked.folder)
    core = max(os.sched_getaffinity(0))
    rows = measure(subjects(asked.program, files), core, asked.rounds, asked.folder)
    why = refusal(rows)
    if asked.json:
        print(json.dumps({"machine": machine(), "rounds": asked.rounds, "rows": rows, "refused": why}, indent=1))
    else:
        print("%(cpu)s, %(cores)d cores, one of them used; Python %(python)s" % machine())
        print("%d rounds; above 1 rowscan is ahead, below 1 the peer" % asked.rounds)
        for ours in (MESH, GROWN):
            print("\n" + table(rows, ours))
    if why:
        print("beside: %s" % why, file=sys.stderr)
    return 1 if why else 0


if __name__ == "__main__":
    sys.exit(main())
