"""The example that runs a study on a cluster, each engine on this machine, with a worker that is killed: the rows are those of a single run."""

import csv
import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "docs" / "examples"
QUICK = (EXAMPLES / "quick-study.toml").read_text()
# What `sbatch --wait --requeue --array=1-N SCRIPT …` does, one task at a time: a task that is killed is begun once more.
SBATCH = """#!/bin/bash
set -eu
count=${3#--array=1-}
shift 3
for index in $(seq "$count"); do
    export SLURM_ARRAY_TASK_ID=$index SLURM_ARRAY_TASK_COUNT=$count
    "$@" || "$@"
done
"""
ENGINES = ["processes", "slurm", "dask", "hyperqueue"]
PACKAGES = {"dask": "distributed", "hyperqueue": "hyperqueue"}


@pytest.fixture
def program(rowscan):
    return rowscan.binary()


@pytest.fixture(params=ENGINES)
def start(request, program, tmp_path):
    """Starts a study on an engine."""
    engine = request.param
    if engine in PACKAGES:
        pytest.importorskip(PACKAGES[engine])
    sbatch = tmp_path / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(SBATCH)
    sbatch.chmod(0o755)
    environment = {**os.environ, "ROWSCAN": program, "PATH": f"{sbatch.parent}:{os.environ['PATH']}"}

    (tmp_path / "study.toml").write_text(QUICK.replace("repeats = 2", "repeats = 6"))
    cluster = tmp_path / "cluster.toml"
    cluster.write_text(f'study = "study.toml"\nfolder = "out"\nshards = 3\nengine = "{engine}"\n')
    command = [sys.executable, str(EXAMPLES / "cluster_study.py"), str(cluster)]
    return lambda: subprocess.Popen(command, env=environment)


def straight(program, folder):
    """The study in one go, as CSV."""
    command = [program, "study", "run", str(folder / "study.toml"), "--format", "csv"]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def worker_of(file):
    """The process that computes the shard of this file, and its parent."""
    for process in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().split(b"\0")
            if os.fsencode(file) in words and b"study" in words and b"rowscan" in words[0]:
                return int(process.name), int((process / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            pass  # It has ended.
    return None


@pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
def test_a_killed_worker_costs_what_it_had_not_finished(program, start, tmp_path):
    running = start()
    shard = tmp_path / "out" / "1.json"
    journal = tmp_path / "out" / "1.json.journal"
    found = None
    while found is None or not journal.exists() or journal.read_text().count("\n") < 3:
        assert running.poll() is None, "it ended before a worker could be killed"
        found = worker_of(shard)
        time.sleep(0.001)
    child, parent = found
    # A worker of Dask is a process of its own; else it is what the engine runs.
    is_worker = b"multiprocessing" in pathlib.Path(f"/proc/{parent}/cmdline").read_bytes()
    os.kill(parent if is_worker else child, signal.SIGKILL)
    time.sleep(0.1)
    assert not shard.exists(), "killed in the middle"
    # What the engine does not begin again itself goes on with the same command line.
    if running.wait(80) != 0:
        assert start().wait(80) == 0
    assert not journal.exists()
    merged = (tmp_path / "out" / "merged.csv").read_text()
    assert merged == straight(program, tmp_path)
    rows = list(csv.DictReader(merged.splitlines()))
    assert len(rows) == 24
    for row in rows:
        assert row["rowscan"] and row["study_seed"] == "1" and len(row["scene_hash"]) == 16


def test_what_a_file_says_wrong_is_named(tmp_path):
    cluster = tmp_path / "cluster.toml"
    for text, named in [
        ('study = "a.toml"\nfolder = "out"\nshards = 3\n', "no `engine`"),
        ('study = "a.toml"\nfolder = "out"\nshards = 3\nengine = "pbs"\n', "found `pbs`"),
        ('study = "a.toml"\nshard = 3\n', "unknown key `shard`"),
        ('study = "a.toml"\nfolder = "out"\nshards = 0\nengine = "processes"\n', "shards: expected 1 or more"),
    ]:
        cluster.write_text(text)
        command = [sys.executable, str(EXAMPLES / "cluster_study.py"), str(cluster)]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert ended.returncode == 2 and named in ended.stderr, (text, ended)
