"""A study on many machines, from one file: a task a shard, then the merge.

    python docs/examples/cluster_study.py CLUSTER.toml

CLUSTER.toml names the study, the folder, the shards and the engine: see docs/examples/cluster.toml. Give the same command line again
after whatever ended it: finished shards are left as they are, and a shard that was begun goes on where it was. A task whose worker
is killed is given to another one.

With HyperQueue's `hq` program alone, the same is an array:

    hq submit --array 1-8 bash -c 'rowscan study run STUDY --shard $HQ_TASK_ID/8 --output out/$HQ_TASK_ID.json --resume'
"""

import argparse
import ctypes
import os
import pathlib
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Optional

try:
    import tomllib
except ImportError:  # before Python 3.11
    import tomli as tomllib

# How often a shard is begun before the study is given up.
ATTEMPTS = 5


@dataclass
class Cluster:
    """What CLUSTER.toml says."""

    study: pathlib.Path
    folder: pathlib.Path
    shards: int
    engine: str
    workers: int = 2
    scheduler: Optional[str] = None
    rowscan: str = os.environ.get("ROWSCAN", "rowscan")

    def file(self, index: int) -> str:
        return str(self.folder / f"{index}.json")

    def files(self) -> list:
        return [self.file(index) for index in self.indices()]

    def indices(self) -> range:
        return range(1, self.shards + 1)

    def command(self, index: int) -> list:
        shard = f"{index}/{self.shards}"
        return [self.rowscan, "study", "run", str(self.study), "--shard", shard, "--output", self.file(index), "--resume"]


def refuse(path: pathlib.Path, why: str) -> None:
    print(f"{path}: {why}", file=sys.stderr)
    sys.exit(2)


def read(path: pathlib.Path) -> Cluster:
    """The file's content; ends the program where it is wrong."""
    try:
        told = tomllib.loads(path.read_text())
    except (OSError, ValueError) as why:
        refuse(path, str(why))
    valid = {"study", "folder", "shards", "engine", "workers", "scheduler"}
    for key in told.keys() - valid:
        refuse(path, f"unknown key `{key}`: expected one of {', '.join(sorted(valid))}")
    for key in ("study", "folder", "shards", "engine"):
        if key not in told:
            refuse(path, f"no `{key}`")
    if told["engine"] not in ENGINES:
        refuse(path, f"engine: expected one of {', '.join(ENGINES)}, found `{told['engine']}`")
    for key in ("shards", "workers"):
        count = told.get(key, 1)
        if not (isinstance(count, int) and count >= 1):
            refuse(path, f"{key}: expected 1 or more, found {count}")
    beside = path.resolve().parent
    paths = {key: (beside / told.pop(key)).resolve() for key in ("study", "folder")}
    return Cluster(**paths, **told)


def end_with_parent():
    """A shard does not outlive the worker that began it: another worker goes on with it. Linux."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def run_shard(command: list) -> None:
    one_thread = {**os.environ, "RAYON_NUM_THREADS": "1"}
    subprocess.run(command, check=True, env=one_thread, preexec_fn=end_with_parent)


def on_processes(cluster: Cluster) -> None:
    def run(index: int) -> None:
        for left in reversed(range(ATTEMPTS)):
            try:
                return run_shard(cluster.command(index))
            except subprocess.CalledProcessError:
                if left == 0:
                    raise

    with ThreadPoolExecutor(cluster.workers) as pool:
        list(pool.map(run, cluster.indices()))


def on_dask(cluster: Cluster) -> None:
    from distributed import Client, LocalCluster

    here = {"n_workers": cluster.workers, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": None}
    with Client(cluster.scheduler or LocalCluster(**here)) as client:
        commands = [cluster.command(index) for index in cluster.indices()]
        client.gather([client.submit(run_shard, command, pure=False, retries=ATTEMPTS) for command in commands])


def on_hyperqueue(cluster: Cluster) -> None:
    """Its server and workers run on this machine. On a cluster start `hq server` and `hq worker` there, and use `Client()`."""
    from hyperqueue import Job, LocalCluster
    from hyperqueue.cluster import WorkerConfig

    job = Job(default_workdir=cluster.folder / "hq")
    for index in cluster.indices():
        job.program(cluster.command(index), env={"RAYON_NUM_THREADS": "1"})
    with LocalCluster() as local:
        for _ in range(cluster.workers):
            local.start_worker(WorkerConfig(cores=1))
        client = local.client()
        client.wait_for_jobs([client.submit(job)])


def on_slurm(cluster: Cluster) -> None:
    """A job array of docs/examples/slurm.sh; SLURM requeues a task whose node is gone."""
    script = str(pathlib.Path(__file__).with_name("slurm.sh"))
    array = ["sbatch", "--wait", "--requeue", f"--array=1-{cluster.shards}"]
    subprocess.run([*array, script, str(cluster.study), str(cluster.folder)], check=True)


ENGINES = {"processes": on_processes, "dask": on_dask, "hyperqueue": on_hyperqueue, "slurm": on_slurm}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cluster", type=pathlib.Path, metavar="CLUSTER.toml")
    cluster = read(parser.parse_args().cluster)
    cluster.folder.mkdir(parents=True, exist_ok=True)
    ENGINES[cluster.engine](cluster)
    merged = cluster.folder / "merged.csv"
    with merged.open("w") as out:
        subprocess.run([cluster.rowscan, "study", "merge", *cluster.files(), "--format", "csv"], check=True, stdout=out)
    print(merged)
    return 0


if __name__ == "__main__":
    sys.exit(main())
