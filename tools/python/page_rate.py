"""What the live page costs with two scanners, once it has settled: pictures a second, CPU of page and program, bytes to the browser. `cargo xtask bench page` runs it.

One JSON object a scene on standard output. Chromium draws by SwiftShader, without a graphics card: the slowest way there is.
"""

import json
import os
import pathlib
import sys
import tempfile
import time

from browser import Browser
from emulator import Emulator

ROOT = pathlib.Path(__file__).resolve().parents[2]
#: Two scanners on one tractor, one above the other.
SCANNERS = ['\n[[rig.scanner]]\nmodel = "lms111"\nheight_m = %s\ndistance_m = 1.9\n' % height_m for height_m in (1.6, 2.2)]
SCENES = {
    "twelve trees": ROOT / "sim-scenes/scenes/spindle.toml",
    "hectare": ROOT / "docs/orchards/hectare.toml",
}
#: Until the budget of leaves has settled, and how long is measured, seconds.
SETTLE_S, MEASURE_S = (float(value) for value in sys.argv[1:]) if len(sys.argv) == 3 else (30.0, 15.0)
TICKS = os.sysconf("SC_CLK_TCK")


def cpu_s(root):
    """CPU seconds of a process and everything it started."""
    parents, used = {}, {}
    for entry in os.listdir("/proc"):
        try:
            fields = pathlib.Path("/proc", entry, "stat").read_text().rpartition(")")[2].split() if entry.isdigit() else None
        except OSError:
            continue
        if fields:
            parents[int(entry)], used[int(entry)] = int(fields[1]), (int(fields[11]) + int(fields[12])) / TICKS

    def is_of(process):
        while process and process != root:
            process = parents.get(process, 0)
        return process == root

    return sum(seconds for process, seconds in used.items() if is_of(process))


def measure(name, path, folder):
    scene = pathlib.Path(folder, "scene.toml")
    told = path.read_text()
    scene.write_text(told + "".join(SCANNERS[told.count("[[rig.scanner]]"):]))
    started = Emulator(str(scene), "--tcp", "127.0.0.1:0", "--scanner", "0", "--scanner", "1", "--start-when", "now", "--web", "127.0.0.1:0", start_s=300.0)
    try:
        with Browser(1400, 900, scheme="light") as window:
            opened = time.monotonic()
            window.open("http://%s/" % started.endpoint("web")["address"])
            window.wait("rowscan.firstMs && rowscan.world.orchard && rowscan.state", limit_s=120.0)
            orchard_s = time.monotonic() - opened
            time.sleep(SETTLE_S)
            ask = "({pictures: rowscan.pictures, received: rowscan.link.received, at: performance.now()})"
            before, clocks = window.ask(ask), (cpu_s(window.process.pid), cpu_s(started.process.pid))
            time.sleep(MEASURE_S)
            after, ended = window.ask(ask), (cpu_s(window.process.pid), cpu_s(started.process.pid))
            passed_s = (after["at"] - before["at"]) / 1000
            stats = window.ask("({...rowscan.world.stats, budget: rowscan.world.budget})")
            share = [(late - early) / passed_s for early, late in zip(clocks, ended)]
            print(json.dumps({
                "scene": name,
                "scanners": len(window.ask("rowscan.about.scanners")),
                "first_picture_s": window.ask("rowscan.firstMs") / 1000,
                "orchard_s": round(orchard_s, 2),
                "pictures_per_s": round((after["pictures"] - before["pictures"]) / passed_s, 2),
                "kilobytes_per_s": round((after["received"] - before["received"]) / passed_s / 1000, 1),
                "orchard_megabytes": round(stats["orchardBytes"] / 1e6, 2),
                "draw_calls": stats["draws"], "leaves": stats["leaves"], "sticks": stats["sticks"],
                "budget": round(stats["budget"]), "returns": stats["points"],
                "page_cores": round(share[0], 2), "program_cores": round(share[1], 3),
                "errors": window.errors,
            }), flush=True)
    finally:
        started.close()


with tempfile.TemporaryDirectory() as temporary:
    for scene_name, scene_path in SCENES.items():
        measure(scene_name, scene_path, temporary)
